// Image-order skipping: the blocks of the volume that a ray crosses, and which of them can be visible. Two levels: a coarse
// block of which nothing can be visible, or everything, is crossed in one step.

import package::shared::frame::frame;
import package::shared::ray::{Ray, past, position};

// A bit a block, x fastest: the fine blocks that can be visible; from a new word on two bits a coarse block, the lower of
// which is set if any block in it can, the upper if all can; then how many fine ones can.
@group(0) @binding(3) var<storage, read> occupied_bits: array<u32>;

// Rays skip blocks of which nothing is visible.
override SKIP_BLOCKS: bool = true;

// Blocks after which a stretch is handed out even if the next one is occupied too: a ray that ends early should not have been
// followed to its far end first.
const LONGEST_STRETCH = 8u;

fn bit(index: u32, first_word: u32) -> bool {
    return extractBits(occupied_bits[first_word + (index >> 5u)], index & 31u, 1u) == 1u;
}

// The block that p is in, of one over `per_edge` cells.
fn block_at(p: vec3f, per_edge: f32, blocks: vec3u) -> vec3u {
    return min(vec3u(p * per_edge), blocks - 1u);
}

fn block_index(block: vec3u, blocks: vec3u) -> u32 {
    return (block.z * blocks.y + block.y) * blocks.x + block.x;
}

// Where a ray leaves the block of `edge` cells at p.
fn block_exit(ray: Ray, block: vec3u, edge: f32) -> f32 {
    let side = (vec3f(block) + select(vec3f(0.0), vec3f(1.0), ray.direction > vec3f(0.0))) * edge;
    let far = (side - ray.point) * ray.inverse + ray.never;
    return min(far.x, min(far.y, far.z));
}

// A thousandth of a voxel: past a block's face, on the far side of rounding.
const PAST_FACE = 1e-3;

fn fine_count() -> u32 {
    return frame.blocks.x * frame.blocks.y * frame.blocks.z;
}

// 0 empty, 1 mixed, 3 full.
fn coarse_state(index: u32) -> u32 {
    return extractBits(occupied_bits[(fine_count() + 31u) / 32u + (index >> 4u)], 2u * (index & 15u), 2u);
}

// So few blocks are empty that looking for them takes longer than the samples in them.
fn hardly_any_block_is_empty() -> bool {
    let coarse = frame.coarse_blocks.x * frame.coarse_blocks.y * frame.coarse_blocks.z;
    let occupied = occupied_bits[(fine_count() + 31u) / 32u + (coarse + 15u) / 16u];
    return fine_count() - occupied <= fine_count() / 8u;
}

// A block, fine or coarse, that is all the same.
struct Uniform {
    block: vec3u,
    edge: f32,
    occupied: bool,
}

fn uniform_block_at(p: vec3f) -> Uniform {
    let coarse = block_at(p, frame.per_coarse_edge, frame.coarse_blocks);
    let state = coarse_state(block_index(coarse, frame.coarse_blocks));
    var found = Uniform(coarse, frame.coarse_edge, state == 3u);
    if state == 1u {
        let block = block_at(p, frame.per_block_edge, frame.blocks);
        found = Uniform(block, frame.block_edge, bit(block_index(block, frame.blocks), 0u));
    }
    return found;
}

// Before and behind these nothing is visible along the ray.
var<private> visible_range: vec2f = vec2f(-1e30, 1e30);

// The next stretch of blocks that can be visible, from t on: where it begins and ends; empty where none is before `end`.
fn next_stretch(ray: Ray, begin: f32, end: f32) -> vec2f {
    let from_t = max(begin, visible_range.x);
    let t_end = min(end, visible_range.y);
    if !SKIP_BLOCKS || hardly_any_block_is_empty() {
        return vec2f(from_t, t_end);
    }
    var first = t_end;
    var t = from_t;
    var blocks = 0u;
    while (t < t_end) && (blocks < LONGEST_STRETCH) {
        let inside = past(ray, t, PAST_FACE);
        let found = uniform_block_at(clamp(position(ray, inside), vec3f(0.0), frame.extent));
        if found.occupied {
            first = min(first, t);
            blocks += 1u;
        } else if blocks > 0u {
            break;
        }
        t = max(block_exit(ray, found.block, found.edge), inside);
    }
    return vec2f(first, min(t, t_end));
}
