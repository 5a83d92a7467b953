// Tetrahedra of a grid's cells. A corner of a cell is a number of three bits, x + 2 y + 4 z.

// Tetrahedra of a cell: 5, mirrored from cell to cell so that faces match; or 6 around a diagonal, in every cell the same.
override SPLIT: u32 = 5u;

// 1 in every other cell, where the five are mirrored.
fn parity_of(cell: vec3u) -> u32 {
    return select(0u, (cell.x + cell.y + cell.z) & 1u, SPLIT == 5u);
}

// Of five: each of the first four has a corner of its own and its three neighbours; the fifth is in the middle of them.
fn apex(tet: u32) -> u32 {
    // 0, 3, 5, 6
    return extractBits((3u << 3u) | (5u << 6u) | (6u << 9u), 3u * tet, 3u);
}

// Of six: the order of axes by which one comes from corner 0 to corner 7; two bits an axis.
fn path(tet: u32) -> vec3u {
    // xyz, xzy, yxz, yzx, zxy, zyx
    let first = extractBits((1u << 4u) | (1u << 6u) | (2u << 8u) | (2u << 10u), 2u * tet, 2u);
    let second = extractBits(1u | (2u << 2u) | (0u << 4u) | (2u << 6u) | (0u << 8u) | (1u << 10u), 2u * tet, 2u);
    return vec3u(first, second, 3u - first - second);
}

fn corners_of_tet(tet: u32, parity: u32) -> vec4u {
    if SPLIT == 6u {
        let axes = path(tet);
        return vec4u(0u, 1u << axes.x, (1u << axes.x) | (1u << axes.y), 7u);
    }
    if tet == 4u {
        return vec4u(1u, 2u, 4u, 7u) ^ vec4u(parity);
    }
    let own = apex(tet) ^ parity;
    return vec4u(own, own ^ 1u, own ^ 2u, own ^ 4u);
}

fn corner_offset(corner: u32) -> vec3u {
    return vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
}

// How late a tetrahedron comes among those of its cell, back to front, for an eye in the cell's own space (or, with w = 0,
// for the direction towards it). No ray goes from one to another of the same lateness.
fn lateness(tet: u32, parity: u32, eye: vec4f) -> u32 {
    if SPLIT == 6u {
        // Planes through the diagonal divide the six; one is as far back as planes are between it and the eye.
        let axes = path(tet);
        let along = vec3f(eye[axes.x], eye[axes.y], eye[axes.z]);
        let between = vec3<bool>(along.x < along.y, along.y < along.z, along.x < along.z);
        return 3u - dot(select(vec3u(0u), vec3u(1u), between), vec3u(1u));
    }
    if tet == 4u {
        return 1u;
    }
    // The eye is on the corner's side of the plane that cuts it off, or beyond.
    let own = corner_offset(apex(tet) ^ parity);
    let from_corner = select(eye.xyz, vec3f(eye.w) - eye.xyz, own == vec3u(1u));
    return select(0u, 2u, from_corner.x + from_corner.y + from_corner.z < eye.w);
}
