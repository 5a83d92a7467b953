// How many pixels a layer covers: whether another one is needed.

@group(0) @binding(0) var counted_layer: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> covered_pixels: atomic<u32>;

var<workgroup> in_group: atomic<u32>;

@compute @workgroup_size(16, 16)
fn count_layer(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    let size = textureDimensions(counted_layer);
    if (id.x < size.x) && (id.y < size.y) {
        if textureLoad(counted_layer, id.xy, 0).w > 0.0 {
            atomicAdd(&in_group, 1u);
        }
    }
    workgroupBarrier();
    if index == 0u {
        let pixels = atomicLoad(&in_group);
        if pixels > 0u {
            atomicAdd(&covered_pixels, pixels);
        }
    }
}
