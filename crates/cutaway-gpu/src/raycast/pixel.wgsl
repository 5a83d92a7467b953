// What a ray has gathered.

import package::shared::ray::NO_DEPTH;

struct Pixel {
    // Premultiplied.
    color: vec3f,
    transmittance: f32,
    // Along the ray; 1e30 where nothing is.
    depth: f32,
    // Values of the field that were taken, and stretches of visible blocks.
    samples: u32,
    stretches: u32,
    // Steps on all segments, and those at which the field was looked at.
    steps: u32,
    taken: u32,
}

const NOTHING = Pixel(vec3f(0.0), 1.0, NO_DEPTH, 0u, 0u, 0u, 0u);

// A surface behind what there is.
fn add_surface(pixel: ptr<function, Pixel>, color: vec3f, opacity: f32, t: f32) {
    let weight = (*pixel).transmittance * opacity;
    (*pixel).color += weight * color;
    (*pixel).transmittance -= weight;
    if (*pixel).depth == NO_DEPTH {
        (*pixel).depth = t;
    }
}

// What a ray took, in two words: 22 bits of samples and 10 of stretches; then 20 bits of steps, and in 12 bits which share of them
// was taken. Each stops at its largest value. The host unpacks it.
fn packed_counts(pixel: Pixel) -> vec2u {
    let counts = min(pixel.samples, 0x3fffffu) | (min(pixel.stretches, 0x3ffu) << 22u);
    let share = min(f32(pixel.taken) / max(f32(pixel.steps), 1.0), 1.0);
    return vec2u(counts, min(pixel.steps, 0xfffffu) | (u32(round(share * 4095.0)) << 20u));
}
