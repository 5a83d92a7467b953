// The projection of a tetrahedron (Shirley and Tuchman; Maximo et al., sections 3 and 4.1). Its four points in the image
// have one affine dependency, sum a = 0 and sum a p = 0; the signs of a say what the projection looks like. The points with
// positive a and those with negative a meet in one place, the *thick* one, from both sides: a point of the near side of the
// tetrahedron and one of its far side, between which the ray's stretch is longest. One point against three is class 1, a
// triangle with the thick place inside; two against two is class 2, two edges that cross. Classes 3 and 4 are these with
// triangles of no area.

struct Projection {
    // Pixels.
    thick: vec2f,
    // Weights of the four points at the near and the far end of the longest stretch.
    near: vec4f,
    far: vec4f,
    // The border's points in order; of a triangle the last one twice.
    ring: vec4u,
}

// Triangles of no area.
const NO_PROJECTION = Projection(vec2f(0.0), vec4f(0.0), vec4f(0.0), vec4u(0u));

fn orientation(a: vec2f, b: vec2f, c: vec2f) -> f32 {
    let u = b - a;
    let v = c - a;
    return u.x * v.y - u.y * v.x;
}

// Of points x, y, depth / w.
fn project(p: array<vec3f, 4>) -> Projection {
    let a = vec4f(
        orientation(p[1].xy, p[2].xy, p[3].xy),
        -orientation(p[0].xy, p[2].xy, p[3].xy),
        orientation(p[0].xy, p[1].xy, p[3].xy),
        -orientation(p[0].xy, p[1].xy, p[2].xy),
    );
    let plus = max(a, vec4f(0.0));
    let minus = max(-a, vec4f(0.0));
    // The two are equal but for rounding; each makes its weights sum to 1.
    let sums = vec2f(plus.x + plus.y + (plus.z + plus.w), minus.x + minus.y + (minus.z + minus.w));
    if !(min(sums.x, sums.y) > 0.0) {
        return NO_PROJECTION;
    }
    var near = plus / sums.x;
    var far = minus / sums.y;
    let depths = vec4f(p[0].z, p[1].z, p[2].z, p[3].z);
    let x = vec4f(p[0].x, p[1].x, p[2].x, p[3].x);
    let y = vec4f(p[0].y, p[1].y, p[2].y, p[3].y);
    // The side of fewer points is the more exact one.
    let positive = a >= vec4f(0.0);
    let count = dot(select(vec4f(0.0), vec4f(1.0), positive), vec4f(1.0));
    let from_plus = count < 2.5;
    let weights = select(far, near, from_plus);
    let thick = vec2f(dot(weights, x), dot(weights, y));
    if dot(near, depths) > dot(far, depths) {
        let swap = near;
        near = far;
        far = swap;
    }
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), positive);
    let ring = ring_of(bits.x | bits.y | bits.z | bits.w);
    return Projection(thick, near, far, ring);
}

// By which points are positive.
fn ring_of(positive: u32) -> vec4u {
    // Which of two against two, or who is alone: the same for the complement.
    switch min(positive, 15u - positive) {
        case 1u: { return vec4u(1u, 2u, 3u, 3u); }
        case 2u: { return vec4u(0u, 2u, 3u, 3u); }
        case 4u: { return vec4u(0u, 1u, 3u, 3u); }
        case 7u: { return vec4u(0u, 1u, 2u, 2u); }
        case 3u: { return vec4u(0u, 2u, 1u, 3u); }
        case 5u: { return vec4u(0u, 1u, 2u, 3u); }
        default: { return vec4u(0u, 1u, 3u, 2u); }
    }
}
