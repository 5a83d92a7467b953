// Occupancy: which blocks can be visible, from their ranges and the transfer function. No voxel is read.

import package::ranges::packing::range_ends;

// The host's side is `OccupancyTask` in ranges/occupancy.rs.
struct OccupancyTask {
    blocks: vec3u,
    // The first word of fine blocks to be made.
    first_word: u32,
    coarse_blocks: vec3u,
    fine_per_coarse: u32,
    // Entry of the classification table: (65535ths - offset) * scale + 0.5, truncated.
    entry_offset: f32,
    entry_scale: f32,
    entry_last: u32,
    level_count: u32,
    // 0 blocks that meet a visible entry, 1 blocks that meet a level, 2 all.
    criterion: u32,
    fine_words: u32,
    coarse_words: u32,
    // The word behind the last one of fine blocks to be made.
    end_word: u32,
}

@group(0) @binding(0) var<uniform> task: OccupancyTask;
@group(0) @binding(1) var<storage, read> ranges: array<u32>;
// Of each entry, and of the end: how many before it are visible. Or the levels in 65535ths, as f32 bits.
@group(0) @binding(2) var<storage, read> criteria: array<u32>;
// A bit a block, x fastest: the fine blocks that can be visible; from a new word on two bits a coarse block, the lower of
// which is set if any block in it can, the upper if all can; then how many fine ones can.
@group(0) @binding(3) var<storage, read_write> made_bits: array<atomic<u32>>;

// A whole number of 65535ths may be off by up to 1/256 of one, which may be many entries.
const ROUNDING = 1.0 / 64.0;

fn entry_of(end: f32) -> u32 {
    let entry = max((end - task.entry_offset) * task.entry_scale + 0.5, 0.0);
    return min(u32(entry), task.entry_last);
}

fn meets_visible(ends: vec2u) -> bool {
    // One entry more on either side, for the rounding of interpolation.
    let first = max(entry_of(f32(ends.x) - ROUNDING), 1u) - 1u;
    let end = min(entry_of(f32(ends.y) + ROUNDING) + 1u, task.entry_last) + 1u;
    return criteria[end] > criteria[first];
}

fn meets_level(ends: vec2u) -> bool {
    // A quarter of a 65535th more on either side, for rounding.
    let slack = vec2f(ends) + vec2f(-0.25, 0.25);
    for (var k = 0u; k < task.level_count; k += 1u) {
        let level = bitcast<f32>(criteria[k]);
        if (level >= slack.x) && (level <= slack.y) {
            return true;
        }
    }
    return false;
}

fn can_be_visible(block: u32) -> bool {
    if task.criterion == 2u {
        return true;
    }
    let ends = range_ends(ranges[block]);
    if task.criterion == 1u {
        return meets_level(ends);
    }
    return meets_visible(ends);
}

@compute @workgroup_size(64)
fn fine_occupancy(@builtin(global_invocation_id) id: vec3u) {
    let word = task.first_word + id.x;
    if word >= task.end_word {
        return;
    }
    let count = min(task.blocks.x * task.blocks.y * task.blocks.z - word * 32u, 32u);
    var bits = 0u;
    for (var i = 0u; i < count; i += 1u) {
        bits |= u32(can_be_visible(word * 32u + i)) << i;
    }
    atomicStore(&made_bits[word], bits);
    if bits != 0u {
        atomicAdd(&made_bits[task.fine_words + task.coarse_words], countOneBits(bits));
    }
}

fn fine_bit(index: u32) -> bool {
    return extractBits(atomicLoad(&made_bits[index >> 5u]), index & 31u, 1u) == 1u;
}

@compute @workgroup_size(4, 4, 4)
fn coarse_occupancy(@builtin(global_invocation_id) id: vec3u) {
    if any(id >= task.coarse_blocks) {
        return;
    }
    let first = id * task.fine_per_coarse;
    let end = min(first + task.fine_per_coarse, task.blocks);
    var some = false;
    var all_of_them = true;
    for (var z = first.z; z < end.z; z += 1u) {
        for (var y = first.y; y < end.y; y += 1u) {
            let row = (z * task.blocks.y + y) * task.blocks.x;
            for (var x = first.x; x < end.x; x += 1u) {
                let occupied = fine_bit(row + x);
                some = some || occupied;
                all_of_them = all_of_them && occupied;
            }
            if some && !all_of_them {
                break;
            }
        }
    }
    let index = (id.z * task.coarse_blocks.y + id.y) * task.coarse_blocks.x + id.x;
    let state = u32(some) | (u32(all_of_them) << 1u);
    atomicOr(&made_bits[task.fine_words + (index >> 4u)], state << (2u * (index & 15u)));
}
