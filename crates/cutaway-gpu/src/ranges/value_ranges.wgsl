// Value ranges: the least and greatest texel of every block, from the voxels, and of coarse blocks from the fine ones.
// A block reads the voxels on all corners of its cells, one layer more than it has cells: what is interpolated inside it
// never leaves its range.

import package::ranges::packing::{packed_range, united};

// The host's side is `RangesTask` in ranges/mod.rs.
struct RangesTask {
    // Voxels along each axis.
    dimensions: vec3u,
    // Cells along an edge of a fine block.
    edge: u32,
    blocks: vec3u,
    // The first layer of blocks to be made.
    first_layer: u32,
    coarse_blocks: vec3u,
    fine_per_coarse: u32,
    // Ranges are in 65535ths: (texel - first_texel) * scale.
    first_texel: f32,
    scale: f32,
    reserved: vec2u,
}

@group(0) @binding(0) var<uniform> task: RangesTask;
// Two 16-bit unorm a block, x fastest: the fine blocks, then the coarse ones.
@group(0) @binding(1) var<storage, read_write> made_ranges: array<u32>;
@group(0) @binding(2) var whole_volume: texture_3d<f32>;

@compute @workgroup_size(8, 4, 2)
fn fine_ranges(@builtin(global_invocation_id) id: vec3u) {
    let block = id + vec3u(0u, 0u, task.first_layer);
    if any(block >= task.blocks) {
        return;
    }
    let first = vec3i(block * task.edge);
    let last = min(first + i32(task.edge), vec3i(task.dimensions) - 1);
    var range = vec2f(1e30, -1e30);
    for (var z = first.z; z <= last.z; z += 1) {
        for (var y = first.y; y <= last.y; y += 1) {
            for (var x = first.x; x <= last.x; x += 1) {
                let texel = textureLoad(whole_volume, vec3i(x, y, z), 0).x;
                range = vec2f(min(range.x, texel), max(range.y, texel));
            }
        }
    }
    let packed = packed_range((range - task.first_texel) * task.scale);
    made_ranges[(block.z * task.blocks.y + block.y) * task.blocks.x + block.x] = packed;
}

@compute @workgroup_size(4, 4, 4)
fn coarse_ranges(@builtin(global_invocation_id) id: vec3u) {
    if any(id >= task.coarse_blocks) {
        return;
    }
    let first = id * task.fine_per_coarse;
    let end = min(first + task.fine_per_coarse, task.blocks);
    var range = 0xffffu;
    for (var z = first.z; z < end.z; z += 1u) {
        for (var y = first.y; y < end.y; y += 1u) {
            for (var x = first.x; x < end.x; x += 1u) {
                range = united(range, made_ranges[(z * task.blocks.y + y) * task.blocks.x + x]);
            }
        }
    }
    let behind_fine = task.blocks.x * task.blocks.y * task.blocks.z;
    made_ranges[behind_fine + (id.z * task.coarse_blocks.y + id.y) * task.coarse_blocks.x + id.x] = range;
}
