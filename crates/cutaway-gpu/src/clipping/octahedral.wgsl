// A unit vector in 32 bits: on the octahedron, unfolded to a square, 16 bits a side. `octahedral_normal` of
// shared/segments.wgsl is the way back.

// Where a unit vector is on the unfolded octahedron: -1 to 1.
fn octahedral_point(n: vec3f) -> vec2f {
    let on_octahedron = n / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(on_octahedron.yx)) * select(vec2f(-1.0), vec2f(1.0), on_octahedron.xy >= vec2f(0.0));
    return select(on_octahedron.xy, folded, on_octahedron.z < 0.0);
}

fn octahedral_packed(n: vec3f) -> u32 {
    return pack2x16snorm(octahedral_point(n));
}

fn octahedral_unpacked(packed: u32) -> vec3f {
    let e = unpack2x16snorm(packed);
    let z = 1.0 - abs(e.x) - abs(e.y);
    let fold = max(-z, 0.0);
    let xy = e - fold * select(vec2f(-1.0), vec2f(1.0), e >= vec2f(0.0));
    return normalize(vec3f(xy, z));
}
