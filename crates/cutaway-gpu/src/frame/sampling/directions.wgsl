// Directions of the gradient, a voxel a thread: what `GRADIENT == 2` reads.

struct Slab {
    // The first plane of this dispatch.
    first: u32,
    // Differences over two voxels, in texels, that are no longer than this vanish.
    vanishing: f32,
    reserved: vec2u,
}

@group(0) @binding(0) var<uniform> slab: Slab;
@group(0) @binding(1) var source: texture_3d<f32>;
@group(0) @binding(2) var target_directions: texture_storage_3d<rgba8snorm, write>;

fn texel(p: vec3i) -> f32 {
    return textureLoad(source, clamp(p, vec3i(0), vec3i(textureDimensions(source)) - 1), 0).x;
}

@compute @workgroup_size(8, 4, 2)
fn find_directions(@builtin(global_invocation_id) id: vec3u) {
    let p = vec3i(id) + vec3i(0, 0, i32(slab.first));
    if any(p >= vec3i(textureDimensions(source))) {
        return;
    }
    let x = vec3i(1, 0, 0);
    let y = vec3i(0, 1, 0);
    let z = vec3i(0, 0, 1);
    let d = vec3f(texel(p + x) - texel(p - x), texel(p + y) - texel(p - y), texel(p + z) - texel(p - z));
    let far = length(d);
    let direction = select(vec3f(0.0), d / far, far > slab.vanishing);
    textureStore(target_directions, p, vec4f(direction, 0.0));
}
