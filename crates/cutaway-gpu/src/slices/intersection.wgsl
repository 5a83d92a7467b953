// Where a plane cuts a box, by a corner of the polygon (Rezk-Salama and Kolb 2005, section 4 and listing 1).
//
// From the corner of the box that is nearest along the planes' normal, V0, three paths of three edges lead to the opposite
// one, V7, and no two share a corner in between; distances grow along each. Every plane that meets the box cuts each path
// once, which makes P0, P2 and P4. Between two paths lies one more edge; where the plane cuts it there is P1, P3 or P5, else
// that is the same as the one before. In this order they are the polygon.
//
// The paper's tables come in words, four bits an entry: an array that is indexed by a variable would be copied by every
// vertex. `slices/intersection.rs` has them as the paper does, and the same function for the host; a test holds the words
// against them.

// For each corner of the polygon, the four edges that it may lie on, in the order in which they are tried: from the lowest
// bits on, where an edge begins, and where it ends.
const EDGES = array<u32, 6>(0x74744110u, 0x74411051u, 0x75755220u, 0x75522062u, 0x76766330u, 0x76633043u);

// Planes across `normal`, which need not have unit length.
struct Normal {
    normal: vec3f,
    // Of the corner of boxes that is nearest along it: the corners V0 to V7 of a box whose corner c is at
    // (c & 1, c >> 1 & 1, c >> 2).
    sequence: u32,
}

fn box_corner(origin: vec3f, size: vec3f, corner: u32) -> vec3f {
    return origin + size * vec3f(f32(corner & 1u), f32((corner >> 1u) & 1u), f32(corner >> 2u));
}

// Corner 0 to 5 of the polygon in which the plane of points p with dot(normal, p) = distance cuts a box. A plane beside the
// box gives one point for all.
fn polygon_corner(planes: Normal, distance: f32, origin: vec3f, size: vec3f, corner: u32) -> vec3f {
    let edges = EDGES[corner];
    var begin = vec3f(0.0);
    for (var e = 0u; e < 4u; e += 1u) {
        let ends = extractBits(edges, 8u * e, 8u);
        begin = box_corner(origin, size, extractBits(planes.sequence, 4u * (ends & 15u), 4u));
        let end = box_corner(origin, size, extractBits(planes.sequence, 4u * (ends >> 4u), 4u));
        // Distances of corners, not of edges: paths then cannot lose the plane between two edges by rounding.
        let near = dot(planes.normal, begin);
        let far = dot(planes.normal, end);
        if (near <= distance) && (distance <= far) && (near < far) {
            return begin + (end - begin) * ((distance - near) / (far - near));
        }
    }
    return begin;
}
