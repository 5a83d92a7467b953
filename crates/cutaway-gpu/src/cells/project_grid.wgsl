// Projects the listed tetrahedra of a grid one by one, as perspective needs it.

import package::cells::lattice::{corner_offset, corners_of_tet, parity_of};
import package::cells::record::{Record, record_of};
import package::cells::view::{bins_of, projected, view};
import package::shared::volume::voxel;

// First of the ordered blocks in the chunk.
struct Chunk {
    first: u32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> ordered: array<u32>;
@group(1) @binding(2) var<storage, read> list: array<u32>;
@group(1) @binding(3) var<storage, read> work: array<u32>;
@group(1) @binding(4) var<storage, read_write> records: array<Record>;

@compute @workgroup_size(64)
fn project_listed(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * 65535u * 64u + id.x;
    if index >= work[11] {
        return;
    }
    let entry = list[index];
    let packed = ordered[1u + chunk.first + (entry >> 12u)];
    let block = vec3u(extractBits(packed, 0u, 10u), extractBits(packed, 10u, 10u), extractBits(packed, 20u, 10u));
    let local = vec3u(extractBits(entry, 3u, 3u), extractBits(entry, 6u, 3u), extractBits(entry, 9u, 3u));
    let cell = block * 8u + local;
    let corners = corners_of_tet(entry & 7u, parity_of(cell));
    var p: array<vec4f, 4>;
    var s: vec4f;
    for (var k = 0u; k < 4u; k += 1u) {
        let at = cell + corner_offset(corners[k]);
        p[k] = projected(vec3f(at));
        s[k] = bins_of(voxel(vec3i(at)));
    }
    records[index] = record_of(p, s, corners, view.inverse);
}
