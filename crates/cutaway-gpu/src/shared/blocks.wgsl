// Image-order skipping: the blocks of the volume that a ray crosses, and which of them can be visible. Two levels: a coarse
// block of which nothing can be visible, or everything, is crossed in one step.

import package::shared::frame::frame;
import package::shared::ray::{Ray, parallel_axes, past, position};

// A bit a block, x fastest: the fine blocks that can be visible; from a new word on the coarse ones in which any can; from a
// new word on the coarse ones in which all can.
@group(0) @binding(3) var<storage, read> occupied_bits: array<u32>;

// Rays skip blocks of which nothing is visible.
override SKIP_BLOCKS: bool = true;

// Blocks after which a run is handed out even if the next one is occupied too: a ray that ends early should not have been
// followed to its far end first.
const LONGEST_RUN = 8u;

fn bit(index: u32, first_word: u32) -> bool {
    return extractBits(occupied_bits[first_word + (index >> 5u)], index & 31u, 1u) == 1u;
}

fn words_of(blocks: vec3u) -> u32 {
    return (blocks.x * blocks.y * blocks.z + 31u) / 32u;
}

// The block of `edge` cells that p is in.
fn block_at(p: vec3f, edge: f32, blocks: vec3u) -> vec3u {
    return min(vec3u(p / edge), blocks - 1u);
}

fn block_index(block: vec3u, blocks: vec3u) -> u32 {
    return (block.z * blocks.y + block.y) * blocks.x + block.x;
}

// Where a ray leaves the block of `edge` cells at p.
fn block_exit(ray: Ray, block: vec3u, edge: f32) -> f32 {
    let side = (vec3f(block) + select(vec3f(0.0), vec3f(1.0), ray.direction > vec3f(0.0))) * edge;
    let parallel = parallel_axes(ray.direction);
    let exit = (side - ray.point) / select(ray.direction, vec3f(1.0), parallel);
    let far = select(exit, vec3f(1e30), parallel);
    return min(far.x, min(far.y, far.z));
}

// A thousandth of a voxel: past a block's face, on the far side of rounding.
const PAST_FACE = 1e-3;

// A block, fine or coarse, that is all the same.
struct Place {
    block: vec3u,
    edge: f32,
    occupied: bool,
}

fn place_at(p: vec3f) -> Place {
    let coarse = block_at(p, frame.coarse_edge, frame.coarse_blocks);
    let index = block_index(coarse, frame.coarse_blocks);
    let any_words = words_of(frame.blocks);
    if !bit(index, any_words) {
        return Place(coarse, frame.coarse_edge, false);
    }
    if bit(index, any_words + words_of(frame.coarse_blocks)) {
        return Place(coarse, frame.coarse_edge, true);
    }
    let block = block_at(p, frame.block_edge, frame.blocks);
    return Place(block, frame.block_edge, bit(block_index(block, frame.blocks), 0u));
}

// The next stretch of blocks that can be visible, from t on: where it begins and ends; empty where none is before t_end.
fn next_run(ray: Ray, from_t: f32, t_end: f32) -> vec2f {
    if !SKIP_BLOCKS {
        return vec2f(from_t, t_end);
    }
    var begin = t_end;
    var t = from_t;
    var blocks = 0u;
    while (t < t_end) && (blocks < LONGEST_RUN) {
        let inside = past(ray, t, PAST_FACE);
        let place = place_at(clamp(position(ray, inside), vec3f(0.0), frame.extent));
        if place.occupied {
            begin = min(begin, t);
            blocks += 1u;
        } else if blocks > 0u {
            break;
        }
        t = max(block_exit(ray, place.block, place.edge), inside);
    }
    return vec2f(begin, min(t, t_end));
}
