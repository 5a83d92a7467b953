// Lists of each tile's tetrahedra, in order: a stable counting sort, as in `sort.wgsl`, with tiles for digits.

import package::cells::tiles::record::{Cover, NOT_SEEN, ROW_BITS, TEXELS, cover_of, meets, parts_of};
import package::cells::tiles::task::TileTask;

@group(0) @binding(0) var<uniform> task: TileTask;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// Of each tile: where its list begins, and how long it is.
@group(0) @binding(2) var<storage, read_write> spans: array<vec2u>;
// Tiles whose lists are not empty.
@group(0) @binding(3) var<storage, read_write> live: array<u32>;
// The longest list; then, from 3 on, the length of all lists, and how many tiles are live.
@group(0) @binding(4) var<storage, read_write> totals: array<u32>;
@group(0) @binding(5) var records: texture_2d<u32>;
// A tetrahedron in 24 bits, and which parts of the tile it is in.
@group(0) @binding(6) var lists: texture_storage_2d<r32uint, write>;

// A thread a tile: sums over runs.
@compute @workgroup_size(64)
fn sum_runs(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= task.tiles {
        return;
    }
    var sum = 0u;
    let first = id.x * task.runs;
    for (var run = 0u; run < task.runs; run += 1u) {
        let count = counts[first + run];
        counts[first + run] = sum;
        sum += count;
    }
    spans[id.x] = vec2u(0u, sum);
}

var<workgroup> sums: array<vec2u, 256>;
var<workgroup> longest: atomic<u32>;

// Sums over tiles, by one workgroup: of lengths, and of lists that are not empty.
@compute @workgroup_size(256)
fn sum_tiles(@builtin(local_invocation_index) local: u32) {
    // Each thread has neighbouring tiles.
    let share = (task.tiles + 255u) / 256u;
    let first = min(local * share, task.tiles);
    let end = min(first + share, task.tiles);
    var own = vec2u(0u);
    var own_longest = 0u;
    for (var tile = first; tile < end; tile += 1u) {
        let length = spans[tile].y;
        own_longest = max(own_longest, length);
        own += vec2u(length, select(0u, 1u, length > 0u));
    }
    sums[local] = own;
    atomicMax(&longest, own_longest);
    workgroupBarrier();
    for (var reach = 1u; reach < 256u; reach *= 2u) {
        var before = vec2u(0u);
        if local >= reach {
            before = sums[local - reach];
        }
        workgroupBarrier();
        sums[local] += before;
        workgroupBarrier();
    }
    var at = sums[local] - own;
    for (var tile = first; tile < end; tile += 1u) {
        let length = spans[tile].y;
        spans[tile].x = at.x;
        if length > 0u {
            live[at.y] = tile;
            at += vec2u(length, 1u);
        }
    }
    if local == 255u {
        totals[0] = atomicLoad(&longest);
        totals[3] = at.x;
        totals[4] = at.y;
    }
}

fn texel(index: u32) -> vec4u {
    return textureLoad(records, vec2u(index & ((1u << ROW_BITS) - 1u), index >> ROW_BITS), 0);
}

@compute @workgroup_size(16)
fn list_runs(@builtin(global_invocation_id) id: vec3u) {
    let run = id.x;
    if run >= task.runs {
        return;
    }
    let end = min((run + 1u) * task.run, task.count);
    for (var i = run * task.run; i < end; i += 1u) {
        let at = i * TEXELS;
        let box = texel(at + 5u);
        if box.z == NOT_SEEN {
            continue;
        }
        let t0 = texel(at);
        let planes = array<vec3f, 4>(
            bitcast<vec3f>(t0.xyz),
            bitcast<vec3f>(texel(at + 1u).xyz),
            bitcast<vec3f>(texel(at + 2u).xyz),
            bitcast<vec3f>(texel(at + 3u).xyz),
        );
        let cover = cover_of(planes, box.z, vec2f(vec2u(extractBits(t0.w, 0u, 14u), extractBits(t0.w, 14u, 14u))));
        let first = vec2u(box.x & 0xffffu, box.x >> 16u);
        let last = vec2u(box.y & 0xffffu, box.y >> 16u);
        var tile = first;
        while tile.y <= last.y {
            if meets(cover, tile) {
                let parts = parts_of(cover, tile);
                let number = tile.y * task.tiles_x + tile.x;
                let slot = number * task.runs + run;
                let place = spans[number].x + counts[slot];
                counts[slot] += 1u;
                textureStore(lists, vec2u(place & ((1u << ROW_BITS) - 1u), place >> ROW_BITS), vec4u(i | (parts << 24u)));
            }
            tile.x += 1u;
            if tile.x > last.x {
                tile = vec2u(first.x, tile.y + 1u);
            }
        }
    }
}
