// From a lattice of cast pixels to the image: colours bilinear; depths too, where all four are there and the mode's depths
// are continuous, else the nearest one, for no surface is half-way between two. As the CPU engine's lattices.

import package::shared::ray::NO_DEPTH;

struct Fill {
    // Pixels from one lattice pixel to the next.
    spacing: u32,
    // 1: depths are always those of the nearest lattice pixel.
    nearest_depths: u32,
    reserved: vec2u,
}

@group(0) @binding(0) var<uniform> fill: Fill;
@group(0) @binding(1) var lattice_colors: texture_2d<f32>;
@group(0) @binding(2) var lattice_depths: texture_2d<f32>;

struct Filled {
    @location(0) color: vec4f,
    @location(1) depth: f32,
}

@vertex
fn whole_image(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn color_of(at: vec2u) -> vec4f {
    return textureLoad(lattice_colors, at, 0);
}

fn depth_of(at: vec2u) -> f32 {
    return textureLoad(lattice_depths, at, 0).x;
}

@fragment
fn fill_pixel(@builtin(position) at: vec4f) -> Filled {
    let pixel = vec2u(at.xy);
    let cell = min(pixel / fill.spacing, textureDimensions(lattice_colors) - 2u);
    let share = vec2f(pixel - cell * fill.spacing) / f32(fill.spacing);
    let x = vec2u(1u, 0u);
    let y = vec2u(0u, 1u);
    let top = mix(color_of(cell), color_of(cell + x), share.x);
    let bottom = mix(color_of(cell + y), color_of(cell + x + y), share.x);
    let depths = vec4f(depth_of(cell), depth_of(cell + x), depth_of(cell + y), depth_of(cell + x + y));
    var depth = mix(mix(depths.x, depths.y, share.x), mix(depths.z, depths.w, share.x), share.y);
    if (fill.nearest_depths == 1u) || any(depths >= vec4f(NO_DEPTH)) {
        depth = depths[select(0u, 1u, share.x > 0.5) + select(0u, 2u, share.y > 0.5)];
    }
    return Filled(mix(top, bottom, share.y), depth);
}
