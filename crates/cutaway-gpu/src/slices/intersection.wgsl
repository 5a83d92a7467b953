// Where a plane cuts a box, by a corner of the polygon (Rezk-Salama and Kolb 2005, section 4 and listing 1).
//
// From the corner of the box that is nearest along the planes' normal, V0, three paths of three edges lead to the opposite
// one, V7, and no two share a corner in between; distances grow along each. Every plane that meets the box cuts each path
// once, which makes P0, P2 and P4. Between two paths lies one more edge; where the plane cuts it there is P1, P3 or P5, else
// that is the same as the one before. In this order they are the polygon.
//
// `slices/intersection.rs` has the same for the host; a test holds the tables against each other.

// For each front corner: the corners V0 to V7 of a box whose corner c is at (c & 1, c >> 1 & 1, c >> 2).
const SEQUENCE = array<u32, 64>(
    0u, 1u, 2u, 4u, 5u, 3u, 6u, 7u,
    1u, 0u, 3u, 5u, 4u, 2u, 7u, 6u,
    2u, 3u, 0u, 6u, 7u, 1u, 4u, 5u,
    3u, 2u, 1u, 7u, 6u, 0u, 5u, 4u,
    4u, 5u, 6u, 0u, 1u, 7u, 2u, 3u,
    5u, 4u, 7u, 1u, 0u, 6u, 3u, 2u,
    6u, 7u, 4u, 2u, 3u, 5u, 0u, 1u,
    7u, 6u, 5u, 3u, 2u, 4u, 1u, 0u,
);

// For each corner of the polygon: where the edges begin that it may lie on, in the order in which they are tried.
const EDGE_BEGINS = array<u32, 24>(
    0u, 1u, 4u, 4u,
    1u, 0u, 1u, 4u,
    0u, 2u, 5u, 5u,
    2u, 0u, 2u, 5u,
    0u, 3u, 6u, 6u,
    3u, 0u, 3u, 6u,
);

// And where they end.
const EDGE_ENDS = array<u32, 24>(
    1u, 4u, 7u, 7u,
    5u, 1u, 4u, 7u,
    2u, 5u, 7u, 7u,
    6u, 2u, 5u, 7u,
    3u, 6u, 7u, 7u,
    4u, 3u, 6u, 7u,
);

// Planes across `normal`, which need not have unit length, and the corner of boxes that is nearest along it.
struct Normal {
    normal: vec3f,
    front: u32,
}

fn box_corner(origin: vec3f, size: vec3f, corner: u32) -> vec3f {
    return origin + size * vec3f(f32(corner & 1u), f32((corner >> 1u) & 1u), f32(corner >> 2u));
}

// Corner 0 to 5 of the polygon in which the plane of points p with dot(normal, p) = distance cuts a box. A plane beside the
// box gives one point for all.
fn polygon_corner(planes: Normal, distance: f32, origin: vec3f, size: vec3f, corner: u32) -> vec3f {
    var begin = vec3f(0.0);
    for (var e = 0u; e < 4u; e += 1u) {
        begin = box_corner(origin, size, SEQUENCE[planes.front * 8u + EDGE_BEGINS[corner * 4u + e]]);
        let end = box_corner(origin, size, SEQUENCE[planes.front * 8u + EDGE_ENDS[corner * 4u + e]]);
        // Distances of corners, not of edges: paths then cannot lose the plane between two edges by rounding.
        let near = dot(planes.normal, begin);
        let far = dot(planes.normal, end);
        if (near <= distance) && (distance <= far) && (near < far) {
            return begin + (end - begin) * ((distance - near) / (far - near));
        }
    }
    return begin;
}
