// Which tetrahedra of a grid are drawn, and in which order: the blocks that can be visible, back to front; in each its cells,
// back to front; in each its tetrahedra. Blocks and cells are lattices, so three directions, one of eight orders where rays
// are parallel, put them in order (Maximo, section 4.3); an eye among them divides each axis in two, both of which lead to it.
// No step is taken by the host for a cell.

import package::cells::lattice::{SPLIT, corner_offset, corners_of_tet, lateness, parity_of};
import package::cells::pieces::any_visible;
import package::cells::view::{bins_of, covers_a_centre, projected, view};
import package::shared::blocks::{bit, block_index};
import package::shared::frame::frame;
import package::shared::volume::voxel;

// The host's side is `SelectTask` in cells/grid.rs.
struct SelectTask {
    // Blocks of 8 cells a side, along each axis.
    blocks: vec3u,
    // How many of the ordered blocks come before the chunk.
    first: u32,
    // Where the eye divides each axis, in blocks.
    block_pivot: vec3u,
    // How many are in the chunk at most.
    count: u32,
    // The same in cells.
    cell_pivot: vec3i,
    // Indices of a tetrahedron.
    indices: u32,
    // Cells a side of the blocks that occupancy is known of.
    known_edge: u32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(1) @binding(0) var<uniform> task: SelectTask;
// The number of ordered blocks, then they, 10 bits an axis.
@group(1) @binding(1) var<storage, read_write> ordered: array<u32>;
// Of each cell of the chunk, in order: its visible tetrahedra in order, 4 bits each, from 1 on; and how many, from bit 24 on.
@group(1) @binding(2) var<storage, read_write> kept: array<u32>;
// Arguments of a draw (5), of a dispatch (3, from 8 on), tetrahedra of all chunks (16), and from 32 on where each block's
// tetrahedra begin.
@group(1) @binding(3) var<storage, read_write> work: array<atomic<u32>>;
// The tetrahedra: block of the chunk, cell (9 bits), tetrahedron (3 bits).
@group(1) @binding(4) var<storage, read_write> list: array<u32>;

const OFFSETS = 32u;

// The place that comes at a rank: those below the pivot ascend to it, the others descend to it.
fn place_at(rank: vec3u, pivot: vec3u, count: vec3u) -> vec3u {
    return select(count - 1u - (rank - pivot), rank, rank < pivot);
}

fn block_of(rank: u32) -> vec3u {
    let n = task.blocks;
    return place_at(vec3u(rank % n.x, (rank / n.x) % n.y, rank / (n.x * n.y)), task.block_pivot, n);
}

// Occupancy may be known of smaller blocks, or of larger ones.
fn is_occupied(block: vec3u) -> bool {
    if view.draw_all == 1u {
        return true;
    }
    let first = block * 8u / task.known_edge;
    let last = min((block * 8u + 7u) / task.known_edge, frame.blocks - 1u);
    for (var z = first.z; z <= last.z; z += 1u) {
        for (var y = first.y; y <= last.y; y += 1u) {
            for (var x = first.x; x <= last.x; x += 1u) {
                if bit(block_index(vec3u(x, y, z), frame.blocks), 0u) {
                    return true;
                }
            }
        }
    }
    return false;
}

var<workgroup> shared_counts: array<u32, 256>;

// Inclusive sums over a workgroup of 256.
fn sums_up_to(local: u32, value: u32) -> u32 {
    shared_counts[local] = value;
    workgroupBarrier();
    for (var reach = 1u; reach < 256u; reach *= 2u) {
        var before = 0u;
        if local >= reach {
            before = shared_counts[local - reach];
        }
        workgroupBarrier();
        shared_counts[local] += before;
        workgroupBarrier();
    }
    return shared_counts[local];
}

@compute @workgroup_size(256)
fn order_blocks(@builtin(local_invocation_index) local: u32) {
    let count = task.blocks.x * task.blocks.y * task.blocks.z;
    var found = 0u;
    for (var first = 0u; first < count; first += 256u) {
        let rank = first + local;
        var block = vec3u(0u);
        var occupied = 0u;
        if rank < count {
            block = block_of(rank);
            occupied = select(0u, 1u, is_occupied(block));
        }
        let sum = sums_up_to(local, occupied);
        if occupied == 1u {
            ordered[found + sum] = block.x | (block.y << 10u) | (block.z << 20u);
        }
        found += workgroupUniformLoad(&shared_counts[255]);
    }
    if local == 0u {
        ordered[0] = found;
    }
}

fn ordered_block(in_chunk: u32) -> vec3u {
    let packed = ordered[1u + task.first + in_chunk];
    return vec3u(extractBits(packed, 0u, 10u), extractBits(packed, 10u, 10u), extractBits(packed, 20u, 10u));
}

fn cell_in_block(block: vec3u, rank: u32) -> vec3u {
    let pivot = vec3u(clamp(task.cell_pivot - vec3i(block * 8u), vec3i(0), vec3i(8)));
    return place_at(vec3u(rank & 7u, (rank >> 3u) & 7u, rank >> 6u), pivot, vec3u(8u));
}

var<workgroup> values: array<f32, 729>;
var<workgroup> block_total: atomic<u32>;

fn value_of(cell: vec3u, corner: u32) -> f32 {
    let at = cell + corner_offset(corner);
    return values[(at.z * 9u + at.y) * 9u + at.x];
}

// The tetrahedra of a cell that are drawn; see `kept`.
fn kept_of(block: vec3u, local: vec3u) -> u32 {
    let cell = block * 8u + local;
    if any(cell >= vec3u(view.cells_x, view.cells_y, view.cells_z)) {
        return 0u;
    }
    var v: array<f32, 8>;
    var lo = 1e30;
    var hi = -1e30;
    for (var c = 0u; c < 8u; c += 1u) {
        v[c] = value_of(local, c);
        lo = min(lo, v[c]);
        hi = max(hi, v[c]);
    }
    if (view.draw_all == 0u) && !any_visible(lo, hi) {
        return 0u;
    }
    var p: array<vec2f, 8>;
    var low = vec2f(1e30);
    var high = vec2f(-1e30);
    var before = 1.0;
    var farthest = 0.0;
    for (var c = 0u; c < 8u; c += 1u) {
        let at = projected(vec3f(cell + corner_offset(c)));
        p[c] = at.xy;
        low = min(low, at.xy);
        high = max(high, at.xy);
        before = min(before, at.w);
        farthest = max(farthest, at.w);
    }
    // What reaches behind the eye has no projection; tiles need none.
    let crosses = (before <= 0.0) && (farthest > 0.0) && (view.keeps_behind == 1u);
    if !crosses && ((before <= 0.0) || !covers_a_centre(low, high)) {
        return 0u;
    }
    let parity = parity_of(cell);
    let eye = vec4f(view.eye.xyz - vec3f(cell) * view.eye.w, view.eye.w);
    var found = 0u;
    var count = 0u;
    for (var late = 0u; late < 4u; late += 1u) {
        for (var tet = 0u; tet < SPLIT; tet += 1u) {
            if lateness(tet, parity, eye) != late {
                continue;
            }
            let c = corners_of_tet(tet, parity);
            let four = vec4f(v[c.x], v[c.y], v[c.z], v[c.w]);
            let least = min(min(four.x, four.y), min(four.z, four.w));
            let most = max(max(four.x, four.y), max(four.z, four.w));
            let visible = (view.draw_all == 1u) || any_visible(least, most);
            let corner_low = min(min(p[c.x], p[c.y]), min(p[c.z], p[c.w]));
            let corner_high = max(max(p[c.x], p[c.y]), max(p[c.z], p[c.w]));
            if visible && (crosses || covers_a_centre(corner_low, corner_high)) {
                found |= (tet + 1u) << (4u * count);
                count += 1u;
            }
        }
    }
    return found | (count << 24u);
}

@compute @workgroup_size(64)
fn count_tetrahedra(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let block = ordered_block(group.x);
    let cells = vec3u(view.cells_x, view.cells_y, view.cells_z);
    for (var i = local; i < 729u; i += 64u) {
        let at = min(block * 8u + vec3u(i % 9u, (i / 9u) % 9u, i / 81u), cells);
        values[i] = bins_of(voxel(vec3i(at)));
    }
    workgroupBarrier();
    var total = 0u;
    for (var k = 0u; k < 8u; k += 1u) {
        let rank = local * 8u + k;
        let found = kept_of(block, cell_in_block(block, rank));
        kept[group.x * 512u + rank] = found;
        total += found >> 24u;
    }
    atomicAdd(&block_total, total);
    workgroupBarrier();
    if local == 0u {
        atomicStore(&work[OFFSETS + group.x], atomicLoad(&block_total));
    }
}

// Counts of blocks become places where they begin; then what is drawn is known.
@compute @workgroup_size(256)
fn sum_blocks(@builtin(local_invocation_index) local: u32) {
    var found = 0u;
    for (var first = 0u; first < task.count; first += 256u) {
        let block = first + local;
        var count = 0u;
        if block < task.count {
            count = atomicLoad(&work[OFFSETS + block]);
        }
        let sum = sums_up_to(local, count);
        if block < task.count {
            atomicStore(&work[OFFSETS + block], found + sum - count);
        }
        found += workgroupUniformLoad(&shared_counts[255]);
    }
    if local == 0u {
        atomicStore(&work[0], found * task.indices);
        atomicStore(&work[1], 1u);
        atomicStore(&work[2], 0u);
        atomicStore(&work[3], 0u);
        atomicStore(&work[4], 0u);
        let groups = (found + 63u) / 64u;
        atomicStore(&work[8], min(groups, 65535u));
        atomicStore(&work[9], (groups + 65534u) / 65535u);
        atomicStore(&work[10], 1u);
        atomicStore(&work[11], found);
        atomicAdd(&work[16], found);
    }
}

var<workgroup> thread_counts: array<u32, 64>;

@compute @workgroup_size(64)
fn list_tetrahedra(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let block = ordered_block(group.x);
    let first = group.x * 512u + local * 8u;
    var total = 0u;
    for (var k = 0u; k < 8u; k += 1u) {
        total += kept[first + k] >> 24u;
    }
    thread_counts[local] = total;
    workgroupBarrier();
    var at = atomicLoad(&work[OFFSETS + group.x]);
    for (var i = 0u; i < local; i += 1u) {
        at += thread_counts[i];
    }
    for (var k = 0u; k < 8u; k += 1u) {
        let found = kept[first + k];
        let cell = cell_in_block(block, local * 8u + k);
        let own = (group.x << 12u) | ((cell.x | (cell.y << 3u) | (cell.z << 6u)) << 3u);
        let count = extractBits(found, 24u, 8u);
        for (var i = 0u; i < count; i += 1u) {
            list[at] = own | (extractBits(found, 4u * i, 4u) - 1u);
            at += 1u;
        }
    }
}
