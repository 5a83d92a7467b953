// From the 16-bit target of devices that cannot blend wider ones to the image.

@group(0) @binding(0) var blended: texture_2d<f32>;

@vertex
fn widen_all(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn widen_pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(blended, vec2u(at.xy), 0);
}
