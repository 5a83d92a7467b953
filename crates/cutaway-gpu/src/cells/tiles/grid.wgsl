// What is drawn of the listed tetrahedra of a grid, which come back to front.

import package::cells::lattice::{corner_offset, corners_of_tet, parity_of};
import package::cells::tiles::keep::{keep, task};
import package::cells::tiles::record::{before_division, cell_of};
import package::cells::view::bins_of;
import package::shared::volume::voxel;

// First of the ordered blocks in the chunk.
struct Chunk {
    first: u32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(1) @binding(3) var<uniform> chunk: Chunk;
@group(1) @binding(4) var<storage, read> ordered: array<u32>;
@group(1) @binding(5) var<storage, read> list: array<u32>;

@compute @workgroup_size(16)
fn keep_grid(@builtin(global_invocation_id) id: vec3u) {
    let run = id.x;
    if run >= task.runs {
        return;
    }
    let end = min((run + 1u) * task.run, task.count);
    for (var i = run * task.run; i < end; i += 1u) {
        let entry = list[task.total - 1u - task.first - i];
        let packed = ordered[1u + chunk.first + (entry >> 12u)];
        let block = vec3u(extractBits(packed, 0u, 10u), extractBits(packed, 10u, 10u), extractBits(packed, 20u, 10u));
        let local = vec3u(extractBits(entry, 3u, 3u), extractBits(entry, 6u, 3u), extractBits(entry, 9u, 3u));
        let cell = block * 8u + local;
        let corners = corners_of_tet(entry & 7u, parity_of(cell));
        var p: array<vec3f, 4>;
        var s: vec4f;
        for (var k = 0u; k < 4u; k += 1u) {
            let at = cell + corner_offset(corners[k]);
            p[k] = before_division(vec3f(at));
            s[k] = bins_of(voxel(vec3i(at)));
        }
        keep(i, run, cell_of(p, s));
    }
}
