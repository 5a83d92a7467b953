// The proxy geometry of a classification (Termeer, figure 4.8; Haferburg): which cells can be visible, the box of each, and
// the faces that are drawn. Made when the occupancy changes, never for a frame.
//
// Everything here is in *units*: whole fine blocks, so many of them that no coordinate exceeds 10 bits. A cell is a cube of
// units. Three passes: boxes, quads, and the box of everything instead where there were too many quads.

struct Build {
    // Fine blocks along each axis, and of how many of them a unit is made along an edge.
    blocks: vec3u,
    blocks_per_unit: u32,
    // Units along each axis, and along an edge of a cell.
    units: vec3u,
    units_per_cell: u32,
    // Cells along each axis.
    cells: vec3u,
    // Quads that there is room for.
    capacity: u32,
    // Boxes shrink to their occupied units.
    fitted: u32,
    // Faces that two boxes share are left out.
    glued: u32,
    // Cells amid occupied ones are left out.
    boundary: u32,
    // A long pass goes slab by slab.
    first_slab: u32,
}

struct Counts {
    // Quads that there are, and those of them that had no room.
    wanted: atomic<u32>,
    // The box of everything: least, and greatest.
    least: array<atomic<u32>, 3>,
    greatest: array<atomic<u32>, 3>,
    reserved: u32,
}

@group(0) @binding(0) var<uniform> build: Build;
// As `occupied_bits` in shared/blocks.wgsl.
@group(0) @binding(1) var<storage, read> occupancy: array<u32>;
// Of each cell least and greatest corner of its box, 10 bits a coordinate; both 0: there is none.
@group(0) @binding(2) var<storage, read_write> boxes: array<vec2u>;
// Least and greatest corner with the axis of the normal and its side in the two bits above, then how each corner is
// displaced; see `corner_code`.
@group(0) @binding(3) var<storage, read_write> quads: array<vec4u>;
// Vertices, instances, first vertex and first instance: of the quads' triangles, then of their edges.
@group(0) @binding(4) var<storage, read_write> draws: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: Counts;

fn pack(corner: vec3u) -> u32 {
    return corner.x | (corner.y << 10u) | (corner.z << 20u);
}

fn unpack(word: u32) -> vec3u {
    return vec3u(extractBits(word, 0u, 10u), extractBits(word, 10u, 10u), extractBits(word, 20u, 10u));
}

fn block_occupied(block: vec3u) -> bool {
    let index = (block.z * build.blocks.y + block.y) * build.blocks.x + block.x;
    return extractBits(occupancy[index >> 5u], index & 31u, 1u) == 1u;
}

fn unit_occupied(unit: vec3u) -> bool {
    let first = unit * build.blocks_per_unit;
    let end = min(first + build.blocks_per_unit, build.blocks);
    for (var z = first.z; z < end.z; z += 1u) {
        for (var y = first.y; y < end.y; y += 1u) {
            for (var x = first.x; x < end.x; x += 1u) {
                if block_occupied(vec3u(x, y, z)) {
                    return true;
                }
            }
        }
    }
    return false;
}

fn cell_index(cell: vec3u) -> u32 {
    return (cell.z * build.cells.y + cell.y) * build.cells.x + cell.x;
}

@compute @workgroup_size(4, 4, 4)
fn find_boxes(@builtin(global_invocation_id) id: vec3u) {
    let cell = id + vec3u(0u, 0u, build.first_slab);
    if any(cell >= build.cells) {
        return;
    }
    let first = cell * build.units_per_cell;
    let end = min(first + build.units_per_cell, build.units);
    var least = end;
    var greatest = first;
    for (var z = first.z; z < end.z; z += 1u) {
        for (var y = first.y; y < end.y; y += 1u) {
            for (var x = first.x; x < end.x; x += 1u) {
                let unit = vec3u(x, y, z);
                if unit_occupied(unit) {
                    least = min(least, unit);
                    greatest = max(greatest, unit + 1u);
                }
            }
        }
    }
    if any(least >= greatest) {
        boxes[cell_index(cell)] = vec2u(0u);
        return;
    }
    for (var axis = 0u; axis < 3u; axis += 1u) {
        atomicMin(&counts.least[axis], least[axis]);
        atomicMax(&counts.greatest[axis], greatest[axis]);
    }
    if build.fitted == 0u {
        least = first;
        greatest = end;
    }
    boxes[cell_index(cell)] = vec2u(pack(least), pack(greatest));
}

// The box of a cell; both corners 0 where there is none, outside the volume too.
fn box_of(cell: vec3i) -> vec2u {
    if any(cell < vec3i(0)) || any(cell >= vec3i(build.cells)) {
        return vec2u(0u);
    }
    return boxes[cell_index(vec3u(cell))];
}

fn step_along(axis: u32, up: bool) -> vec3i {
    var way = vec3i(0);
    way[axis] = select(-1, 1, up);
    return way;
}

// Whether the face of a cell's box on this side is also its neighbour's, so that neither is drawn. Both have to touch, with
// equal dimensions: otherwise gaps appear (Termeer, figure 4.9).
fn is_glued(cell: vec3i, axis: u32, up: bool) -> bool {
    if build.glued == 0u {
        return false;
    }
    let here = box_of(cell);
    let there = box_of(cell + step_along(axis, up));
    if here.y == 0u || there.y == 0u {
        return false;
    }
    let here_least = unpack(here.x);
    let here_greatest = unpack(here.y);
    let there_least = unpack(there.x);
    let there_greatest = unpack(there.y);
    let touch = select(
        here_least[axis] == there_greatest[axis],
        here_greatest[axis] == there_least[axis],
        up,
    );
    let u = (axis + 1u) % 3u;
    let v = (axis + 2u) % 3u;
    let equal_u = here_least[u] == there_least[u] && here_greatest[u] == there_greatest[u];
    let equal_v = here_least[v] == there_least[v] && here_greatest[v] == there_greatest[v];
    return touch && equal_u && equal_v;
}

// Set with a corner's code: the corner cannot be displaced out of every face that meets in it.
const SADDLE = 64u;

// How far a corner of a box is displaced along each axis, for all faces there to move outward by one margin: 2 bits an
// axis, -1, 0 or 1 times the margin, plus one. Up to eight boxes meet in a corner; those that are glued together around it
// form one solid, whose faces share the corner and must displace it alike, or gaps would open between them. The solid is
// found by flooding the eight octants, bit a of an octant's number telling that it lies beyond the corner along axis a.
fn corner_code(cell: vec3i, corner: u32) -> u32 {
    var reached = 1u;
    var links: array<u32, 3>;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        for (var octant = 0u; octant < 8u; octant += 1u) {
            if extractBits(octant, axis, 1u) == 0u && is_glued(octant_of(cell, corner, octant), axis, is_up(corner, axis)) {
                links[axis] |= 1u << octant;
            }
        }
    }
    for (var round = 0u; round < 7u; round += 1u) {
        for (var axis = 0u; axis < 3u; axis += 1u) {
            let stride = 1u << axis;
            reached |= ((reached & links[axis]) << stride) | ((reached >> stride) & links[axis]);
        }
    }
    var code = 0u;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        let stride = 1u << axis;
        // Octants on this side of the corner along the axis: 0b01010101, 0b00110011, 0b00001111.
        let near = 255u / ((1u << stride) + 1u);
        let outward = (reached & near & ~links[axis]) != 0u;
        let inward = (reached & ~near & ~(links[axis] << stride) & 255u) != 0u;
        var way = i32(outward) - i32(inward);
        if !is_up(corner, axis) {
            way = -way;
        }
        code |= u32(way + 1) << (2u * axis);
        if outward && inward {
            code |= SADDLE;
        }
    }
    return code;
}

fn is_up(corner: u32, axis: u32) -> bool {
    return extractBits(corner, axis, 1u) == 1u;
}

fn octant_of(cell: vec3i, corner: u32, octant: u32) -> vec3i {
    var way = vec3i(0);
    for (var axis = 0u; axis < 3u; axis += 1u) {
        if extractBits(octant, axis, 1u) == 1u {
            way += step_along(axis, is_up(corner, axis));
        }
    }
    return cell + way;
}

// Away from the box in every direction: what corners have that are glued to none.
fn free_code(corner: u32) -> u32 {
    var code = 0u;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        code |= select(0u, 2u, is_up(corner, axis)) << (2u * axis);
    }
    return code;
}

// Whether all six neighbours are occupied: what is in such a cell is hidden by its neighbours' boxes from outside, and the
// boxes around it are further apart than it is.
fn is_amid(cell: vec3i) -> bool {
    for (var axis = 0u; axis < 3u; axis += 1u) {
        if box_of(cell + step_along(axis, false)).y == 0u || box_of(cell + step_along(axis, true)).y == 0u {
            return false;
        }
    }
    return true;
}

fn add_face(corners: vec2u, axis: u32, up: bool, codes: ptr<function, array<u32, 8>>) {
    let index = atomicAdd(&counts.wanted, 1u);
    if index >= build.capacity {
        return;
    }
    let u = 1u << ((axis + 1u) % 3u);
    let v = 1u << ((axis + 2u) % 3u);
    let first = select(0u, 1u << axis, up);
    let code = ((*codes)[first] & 63u)
        | (((*codes)[first | u] & 63u) << 6u)
        | (((*codes)[first | v] & 63u) << 12u)
        | (((*codes)[first | u | v] & 63u) << 18u);
    quads[index] = vec4u(corners.x | (axis << 30u), corners.y | (select(0u, 1u, up) << 30u), code, 0u);
}

@compute @workgroup_size(4, 4, 4)
fn add_quads(@builtin(global_invocation_id) id: vec3u) {
    let place = id + vec3u(0u, 0u, build.first_slab);
    if any(place >= build.cells) {
        return;
    }
    let cell = vec3i(place);
    let corners = box_of(cell);
    if corners.y == 0u || (build.boundary == 1u && is_amid(cell)) {
        return;
    }
    // Bit 2 * axis + side.
    var drawn = 0u;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        drawn |= select(1u, 0u, is_glued(cell, axis, false)) << (2u * axis);
        drawn |= select(2u, 0u, is_glued(cell, axis, true)) << (2u * axis);
    }
    if drawn == 0u {
        return;
    }
    var codes: array<u32, 8>;
    var saddle = false;
    for (var corner = 0u; corner < 8u; corner += 1u) {
        codes[corner] = free_code(corner);
        if build.glued == 1u {
            codes[corner] = corner_code(cell, corner);
            saddle = saddle || (codes[corner] & SADDLE) != 0u;
        }
    }
    for (var axis = 0u; axis < 3u; axis += 1u) {
        if extractBits(drawn, 2u * axis, 1u) == 1u {
            add_face(corners, axis, false, &codes);
        }
        if extractBits(drawn, 2u * axis + 1u, 1u) == 1u {
            add_face(corners, axis, true, &codes);
        }
    }
    if saddle {
        add_box(corners);
    }
}

// A closed box of its own: what it holds is covered whatever becomes of its faces' shared corners.
fn add_box(corners: vec2u) {
    var codes: array<u32, 8>;
    for (var corner = 0u; corner < 8u; corner += 1u) {
        codes[corner] = free_code(corner);
    }
    for (var axis = 0u; axis < 3u; axis += 1u) {
        add_face(corners, axis, false, &codes);
        add_face(corners, axis, true, &codes);
    }
}

@compute @workgroup_size(1)
fn finish() {
    var quads_drawn = atomicLoad(&counts.wanted);
    if quads_drawn > build.capacity {
        let least = vec3u(atomicLoad(&counts.least[0]), atomicLoad(&counts.least[1]), atomicLoad(&counts.least[2]));
        let greatest =
            vec3u(atomicLoad(&counts.greatest[0]), atomicLoad(&counts.greatest[1]), atomicLoad(&counts.greatest[2]));
        atomicStore(&counts.wanted, 0u);
        add_box(vec2u(pack(least), pack(greatest)));
        atomicStore(&counts.wanted, quads_drawn);
        quads_drawn = 6u;
    }
    draws[0] = 6u * quads_drawn;
    draws[1] = 1u;
    draws[2] = 0u;
    draws[3] = 0u;
    draws[4] = 8u * quads_drawn;
    draws[5] = 1u;
    draws[6] = 0u;
    draws[7] = 0u;
}
