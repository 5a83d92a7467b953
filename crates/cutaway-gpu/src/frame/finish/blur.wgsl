// A Gaussian along one axis of the image; see `cutaway_core::image::blur`. Premultiplied colours; the border repeats.

struct Blur {
    // To the next pixel: (1, 0) or (0, 1).
    along: vec2i,
    // Weights, the middle one counted.
    count: u32,
    reserved: u32,
}

@group(0) @binding(0) var<uniform> blur: Blur;
@group(0) @binding(1) var sharp: texture_2d<f32>;
@group(0) @binding(2) var<storage, read> weights: array<f32>;

@vertex
fn whole_image(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn sharp_at(at: vec2i) -> vec4f {
    return textureLoad(sharp, clamp(at, vec2i(0), vec2i(textureDimensions(sharp)) - 1), 0);
}

@fragment
fn blur_pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    var sum = sharp_at(pixel) * weights[0];
    for (var d = 1u; d < blur.count; d += 1u) {
        let offset = blur.along * i32(d);
        sum += (sharp_at(pixel - offset) + sharp_at(pixel + offset)) * weights[d];
    }
    return sum;
}
