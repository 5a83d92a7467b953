// What the blocks along a ray hold, for rays that look for an extreme value.

import package::ranges::packing::range_ends;
import package::shared::blocks::{PAST_FACE, SKIP_BLOCKS, block_at, block_exit, block_index, fine_count};
import package::shared::frame::frame;
import package::shared::ray::{Ray, past, position};

// The range of a block in a word, x fastest: the fine blocks, then the coarse ones.
@group(0) @binding(6) var<storage, read> block_ranges: array<u32>;

// A stretch of a ray, up to t_end, and whether anything in it can be more extreme.
struct Stretch {
    t_end: f32,
    promising: bool,
}

// Interpolation rounds by less than this, in 65535ths of a range; it never goes below the least value that there is.
const INTERPOLATION_ROUNDING = 0.125;

// Whether a block can hold a greater (kind 1) or lesser (kind -1) texel than one in 65535ths.
fn more_extreme(range: u32, kind: f32, value: f32) -> bool {
    let ends = vec2f(range_ends(range));
    if kind > 0.0 {
        return select(ends.y + INTERPOLATION_ROUNDING, 0.0, ends.y == 0.0) > value;
    }
    return max(ends.x - INTERPOLATION_ROUNDING, 0.0) < value;
}

// A distance before t by more than rounding.
fn short_of(ray: Ray, t: f32) -> f32 {
    return 2.0 * t - past(ray, t, PAST_FACE);
}

// From the sample at t to where its block ends, short of it by more than rounding: samples in between are in that block.
// Of a coarse block that is promising, the fine one decides if `fine`.
fn stretch_at(ray: Ray, t: f32, kind: f32, texel: f32, fine: bool) -> Stretch {
    let value = (texel - frame.range_first) * frame.range_scale;
    let p = clamp(position(ray, t), vec3f(0.0), frame.extent);
    var block = block_at(p, frame.per_coarse_edge, frame.coarse_blocks);
    var edge = frame.coarse_edge;
    var promising = more_extreme(block_ranges[fine_count() + block_index(block, frame.coarse_blocks)], kind, value);
    if promising && fine {
        block = block_at(p, frame.per_block_edge, frame.blocks);
        edge = frame.block_edge;
        promising = more_extreme(block_ranges[block_index(block, frame.blocks)], kind, value);
    }
    return Stretch(short_of(ray, block_exit(ray, block, edge)), promising);
}
