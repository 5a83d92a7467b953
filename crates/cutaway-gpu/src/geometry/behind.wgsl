// An image in front of opaque geometry that has ended its rays.

@group(0) @binding(0) var image_color: texture_2d<f32>;
@group(0) @binding(1) var image_distance: texture_2d<f32>;
@group(0) @binding(2) var geometry_color: texture_2d<f32>;
@group(0) @binding(3) var geometry_distance: texture_2d<f32>;

const NO_DISTANCE = 1e30;

struct Together {
    // Premultiplied.
    @location(0) color: vec4f,
    @location(1) eye_distance: f32,
}

@vertex
fn whole_picture(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn over_geometry(@builtin(position) at: vec4f) -> Together {
    let place = vec2u(at.xy);
    let front = textureLoad(image_color, place, 0);
    let front_distance = textureLoad(image_distance, place, 0).x;
    let behind_distance = textureLoad(geometry_distance, place, 0).x;
    if !(behind_distance < NO_DISTANCE) {
        return Together(front, front_distance);
    }
    let behind = textureLoad(geometry_color, place, 0);
    return Together(front + (1.0 - front.a) * behind, select(front_distance, behind_distance, front_distance >= NO_DISTANCE));
}
