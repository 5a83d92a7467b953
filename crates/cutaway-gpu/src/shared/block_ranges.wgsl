// What the blocks along a ray hold, for rays that look for an extreme value.

import package::ranges::packing::range_ends;
import package::shared::blocks::{PAST_FACE, SKIP_BLOCKS, block_at, block_exit, block_index};
import package::shared::frame::frame;
import package::shared::ray::{Ray, past, position};

// Two 16-bit unorm a block, least and greatest texel, x fastest: the fine blocks, then the coarse ones.
@group(0) @binding(5) var<storage, read> block_ranges: array<u32>;

// A stretch of a ray, up to t_end, and whether anything in it can be more extreme.
struct Stretch {
    t_end: f32,
    promising: bool,
}

// Interpolation rounds by less than this, as a share of the greatest value in the block; it never goes below 0.
const INTERPOLATION_ROUNDING = 1e-6;

// Whether a block can hold more (kind 1) or less (kind -1) than `value`.
fn more_extreme(range: u32, kind: f32, value: f32) -> bool {
    let ends = vec2f(range_ends(range)) / 65535.0;
    let rounding = INTERPOLATION_ROUNDING * ends.y;
    if kind > 0.0 {
        return ends.y + rounding > value;
    }
    return max(ends.x - rounding, 0.0) < value;
}

// A distance before t by more than rounding.
fn short_of(ray: Ray, t: f32) -> f32 {
    return 2.0 * t - past(ray, t, PAST_FACE);
}

// From the sample at t to where its block ends, short of it by more than rounding: samples in between are in that block.
fn stretch_at(ray: Ray, t: f32, t_end: f32, kind: f32, value: f32) -> Stretch {
    if !SKIP_BLOCKS {
        return Stretch(t_end, true);
    }
    let p = clamp(position(ray, t), vec3f(0.0), frame.extent);
    let coarse = block_at(p, frame.coarse_edge, frame.coarse_blocks);
    let behind_fine = frame.blocks.x * frame.blocks.y * frame.blocks.z;
    let coarse_range = block_ranges[behind_fine + block_index(coarse, frame.coarse_blocks)];
    if !more_extreme(coarse_range, kind, value) {
        return Stretch(short_of(ray, block_exit(ray, coarse, frame.coarse_edge)), false);
    }
    let block = block_at(p, frame.block_edge, frame.blocks);
    let promising = more_extreme(block_ranges[block_index(block, frame.blocks)], kind, value);
    return Stretch(short_of(ray, block_exit(ray, block, frame.block_edge)), promising);
}
