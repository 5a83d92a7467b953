// The picture over its background: one texel a pixel, or one between texels where the picture is smaller than its place.

struct Canvas {
    // Display values, opaque.
    background: vec4f,
}

@group(0) @binding(0) var<uniform> canvas: Canvas;
// Premultiplied display values.
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var texels: sampler;

// Whether what is written is taken for linear light, and encoded.
override ENCODES: bool = false;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) at: vec2f,
}

@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let at = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Corner(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0), at);
}

@fragment
fn show_pixel(corner: Corner) -> @location(0) vec4f {
    let front = textureSampleLevel(picture, texels, corner.at, 0.0);
    let shown = front.rgb + (1.0 - front.a) * canvas.background.rgb;
    if ENCODES {
        return vec4f(light_of(shown), 1.0);
    }
    return vec4f(shown, 1.0);
}

// IEC 61966-2-1.
fn light_of(encoded: vec3f) -> vec3f {
    let bright = pow((encoded + 0.055) / 1.055, vec3f(2.4));
    return select(bright, encoded / 12.92, encoded <= vec3f(0.04045));
}
