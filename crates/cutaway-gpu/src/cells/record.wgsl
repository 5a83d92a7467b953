// What is drawn of a tetrahedron: its projection, with what its longest stretch is like.

import package::cells::project::{Projection, project};
import package::cells::pieces::pieces_of;

struct Record {
    // Of the thick place: x, y in pixels; depth / w at its near and far end.
    thick: vec4f,
    // There value / w, near and far; then the tetrahedron's least and greatest value. In bins.
    values: vec4f,
    // The border's points: corners of a grid's cell, points of a mesh.
    ring: vec4u,
    // First and last piece of the transfer function, 16 bits each.
    pieces: u32,
    // Depth from the near to the far end of the longest stretch, in world units.
    longest: f32,
    // In the middle of it, gradient / w of meshes: its direction, and the logarithm of its length in sixty-fourths; 16-bit snorm.
    gradient: vec2u,
}

// Of four points (x, y, depth / w, 1 / w) with values in bins; `inverse` is 1 / D of the view.
fn record_of(p: array<vec4f, 4>, s: vec4f, points: vec4u, inverse: f32) -> Record {
    var places: array<vec3f, 4>;
    for (var k = 0u; k < 4u; k += 1u) {
        places[k] = p[k].xyz;
    }
    let flat_one = project(places);
    let depths = vec4f(p[0].z, p[1].z, p[2].z, p[3].z);
    let inverse_w = vec4f(p[0].w, p[1].w, p[2].w, p[3].w);
    let e = vec2f(dot(flat_one.near, depths), dot(flat_one.far, depths));
    let q = s * inverse_w;
    let ends = e / (1.0 - e * inverse);
    let least = min(min(s.x, s.y), min(s.z, s.w));
    let most = max(max(s.x, s.y), max(s.z, s.w));
    let ring = vec4u(points[flat_one.ring.x], points[flat_one.ring.y], points[flat_one.ring.z], points[flat_one.ring.w]);
    return Record(
        vec4f(flat_one.thick, e),
        vec4f(dot(flat_one.near, q), dot(flat_one.far, q), least, most),
        ring,
        pieces_of(least, most),
        ends.y - ends.x,
        vec2u(0u),
    );
}

// The mean of four points' gradients in the middle of the longest stretch, as a record holds it.
fn middle_gradient(p: array<vec4f, 4>, g: array<vec3f, 4>) -> vec2u {
    var places: array<vec3f, 4>;
    for (var k = 0u; k < 4u; k += 1u) {
        places[k] = p[k].xyz;
    }
    let flat_one = project(places);
    let weights = 0.5 * (flat_one.near + flat_one.far);
    var sum = vec3f(0.0);
    for (var k = 0u; k < 4u; k += 1u) {
        sum += weights[k] * p[k].w * g[k];
    }
    let far = max(length(sum), 1e-18);
    return vec2u(pack2x16snorm(sum.xy / far), pack2x16snorm(vec2f(sum.z / far, log2(far) / 64.0)));
}
