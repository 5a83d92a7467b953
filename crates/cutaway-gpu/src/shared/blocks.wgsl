// Image-order skipping: the blocks of the volume that a ray crosses, and which of them can be visible. Two levels: a coarse
// block of which nothing is visible is crossed in one step.

import package::shared::frame::frame;
import package::shared::ray::{Ray, parallel_axes, past, position};

// A bit a block, x fastest: the fine blocks, then from a new word on the coarse ones.
@group(0) @binding(3) var<storage, read> occupied_bits: array<u32>;

// Rays skip blocks of which nothing is visible.
override SKIP_BLOCKS: bool = true;

fn bit(index: u32, first_word: u32) -> bool {
    return extractBits(occupied_bits[first_word + (index >> 5u)], index & 31u, 1u) == 1u;
}

fn coarse_words() -> u32 {
    return (frame.blocks.x * frame.blocks.y * frame.blocks.z + 31u) / 32u;
}

// Where a ray leaves the block of `edge` cells at p.
fn block_exit(ray: Ray, block: vec3u, edge: f32) -> f32 {
    let side = (vec3f(block) + select(vec3f(0.0), vec3f(1.0), ray.direction > vec3f(0.0))) * edge;
    let parallel = parallel_axes(ray.direction);
    let exit = (side - ray.point) / select(ray.direction, vec3f(1.0), parallel);
    let far = select(exit, vec3f(1e30), parallel);
    return min(far.x, min(far.y, far.z));
}

// Before and behind these nothing is visible along the ray.
var<private> visible_range: vec2f = vec2f(-1e30, 1e30);

// The next stretch of blocks that can be visible, from t on: where it begins and ends; empty where none is before `end`.
fn next_run(ray: Ray, begin: f32, end: f32) -> vec2f {
    let from_t = max(begin, visible_range.x);
    let t_end = min(end, visible_range.y);
    if !SKIP_BLOCKS {
        return vec2f(from_t, t_end);
    }
    var t = from_t;
    while t < t_end {
        // A thousandth of a voxel: past a block's face, on the far side of rounding.
        let inside = past(ray, t, 1e-3);
        let p = clamp(position(ray, inside), vec3f(0.0), frame.extent);
        let block = min(vec3u(p / frame.block_edge), frame.blocks - 1u);
        let index = (block.z * frame.blocks.y + block.y) * frame.blocks.x + block.x;
        if bit(index, 0u) {
            return vec2f(t, min(max(block_exit(ray, block, frame.block_edge), inside), t_end));
        }
        let coarse = min(vec3u(p / frame.coarse_edge), frame.coarse_blocks - 1u);
        let coarse_index = (coarse.z * frame.coarse_blocks.y + coarse.y) * frame.coarse_blocks.x + coarse.x;
        var exit = block_exit(ray, block, frame.block_edge);
        if !bit(coarse_index, coarse_words()) {
            exit = block_exit(ray, coarse, frame.coarse_edge);
        }
        t = max(exit, inside);
    }
    return vec2f(t_end, t_end);
}
