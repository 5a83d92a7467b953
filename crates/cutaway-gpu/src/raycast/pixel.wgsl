// What a ray has gathered.

struct Pixel {
    // Premultiplied.
    color: vec3f,
    transmittance: f32,
    // Along the ray; 1e30 where nothing is.
    depth: f32,
    // Values of the field that were taken, and stretches of visible blocks.
    samples: u32,
    runs: u32,
}

const NO_DEPTH = 1e30;

const NOTHING = Pixel(vec3f(0.0), 1.0, NO_DEPTH, 0u, 0u);

// A surface behind what there is.
fn add_surface(pixel: ptr<function, Pixel>, color: vec3f, opacity: f32, t: f32) {
    let weight = (*pixel).transmittance * opacity;
    (*pixel).color += weight * color;
    (*pixel).transmittance -= weight;
    if (*pixel).depth == NO_DEPTH {
        (*pixel).depth = t;
    }
}
