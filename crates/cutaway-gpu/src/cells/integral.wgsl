// Emission and absorption along a stretch on which the value is linear.

import package::cells::pieces::{Piece, extinction_at, pieces, share_of};
import package::cells::view::view;

// 0: colour and extinction of the mean value. 1: partial pre-integration (Moreland and Angel): both linear between the ends.
// 2: exact: cut at the transfer function's points.
override INTEGRAL: u32 = 2u;
// e^-u from a table, for the first two (Maximo, section 4.2.2).
override EXPONENTIAL_TABLE: bool = false;

struct Stretch {
    // Values in bins at both ends, and the length in world units.
    near: f32,
    far: f32,
    length: f32,
}

// Of the square of gammas (see `psi`), then e^-u for u from 0 to 1.
@group(2) @binding(3) var<storage, read> integrals: array<f32>;

const PSI_SIDE = 128u;
const EXPONENTIALS = 256u;

fn transmittance(depth: f32) -> f32 {
    if EXPONENTIAL_TABLE && (depth <= 1.0) {
        let at = depth * f32(EXPONENTIALS - 1u);
        let i = min(u32(at), EXPONENTIALS - 2u) + PSI_SIDE * PSI_SIDE;
        return mix(integrals[i], integrals[i + 1u], at - floor(at));
    }
    return exp(-depth);
}

// The mean transmittance within a stretch whose optical density goes linearly from a to b (times its length).
fn psi(a: f32, b: f32) -> f32 {
    let gamma = vec2f(a / (1.0 + a), b / (1.0 + b)) * f32(PSI_SIDE - 1u);
    let cell = min(vec2u(gamma), vec2u(PSI_SIDE - 2u));
    let f = gamma - vec2f(cell);
    let i = cell.y * PSI_SIDE + cell.x;
    let low = mix(integrals[i], integrals[i + 1u], f.x);
    let high = mix(integrals[i + PSI_SIDE], integrals[i + PSI_SIDE + 1u], f.x);
    return mix(low, high, f.y);
}

// Straight colour and extinction per unit distance of a value, by the pieces from first to last.
fn classified(value: f32, first: u32, last: u32) -> vec4f {
    var i = first;
    while (i < last) && (pieces[i].end <= value) {
        i += 1u;
    }
    let piece = pieces[i];
    let x = share_of(piece, value);
    return vec4f(piece.low.xyz + x * piece.rise.xyz, extinction_at(piece, x));
}

// Premultiplied colour and opacity.
fn integral_of(stretch: Stretch, range: u32) -> vec4f {
    let first = range & 0xffffu;
    let last = range >> 16u;
    let length = stretch.length * view.per_unit;
    if INTEGRAL == 0u {
        let entry = classified(0.5 * (stretch.near + stretch.far), first, last);
        let alpha = 1.0 - transmittance(entry.w * length);
        return vec4f(entry.xyz * alpha, alpha);
    }
    if INTEGRAL == 1u {
        let front = classified(stretch.near, first, last);
        let back = classified(stretch.far, first, last);
        let a = front.w * length;
        let b = back.w * length;
        let through = transmittance(0.5 * (a + b));
        return vec4f(front.xyz - back.xyz * through + (back.xyz - front.xyz) * psi(a, b), 1.0 - through);
    }
    let change = stretch.far - stretch.near;
    let rising = change >= 0.0;
    let inverse = select(-1.0, 1.0, rising) / max(abs(change), 1e-6);
    // The pieces that the stretch itself meets: the tetrahedron may meet more.
    let low = min(stretch.near, stretch.far);
    let high = max(stretch.near, stretch.far);
    var bottom = first;
    while (bottom < last) && (pieces[bottom].end <= low) {
        bottom += 1u;
    }
    var top = bottom;
    while (top < last) && (pieces[top].end < high) {
        top += 1u;
    }
    var i = select(top, bottom, rising);
    let final_piece = select(bottom, top, rising);
    let step = select(0xffffffffu, 1u, rising);
    var sum = vec3f(0.0);
    var through = 1.0;
    var near = 0.0;
    // No branch in the loop: where lanes go together, each would cost all of them.
    loop {
        let piece = pieces[i];
        let bound = (select(piece.begin, piece.end, rising) - stretch.near) * inverse;
        let far = select(clamp(bound, near, 1.0), 1.0, i == final_piece);
        let color = of_piece(piece, stretch.near + near * change, stretch.near + far * change, (far - near) * length);
        sum += through * color.xyz;
        through *= 1.0 - color.w;
        near = far;
        if i == final_piece {
            break;
        }
        i += step;
    }
    return vec4f(sum, 1.0 - through);
}

// Between two values of a piece, over a length in unit distances. Colour is linear, so what counts of it is where along the
// stretch, 0 to 1, the light that leaves it comes from on average. For constant extinction that is 1 / depth less
// 1 / (e^depth - 1), here as a fraction of polynomials that has the same beginning and end; extinction that rises moves
// it back. Off by at most 0.02, and by the square of the depth where that is small.
fn of_piece(piece: Piece, near: f32, far: f32, length: f32) -> vec4f {
    let x = share_of(piece, near);
    let y = share_of(piece, far);
    let front = extinction_at(piece, x);
    let middle = extinction_at(piece, 0.5 * (x + y));
    let back = extinction_at(piece, y);
    // Simpson's rule.
    let mean = (front + 4.0 * middle + back) / 6.0;
    let depth = mean * length;
    let alpha = 1.0 - exp(-depth);
    let slope = (back - front) / max(mean, 1e-12);
    let place = (12.0 + depth) / (24.0 + depth * (6.0 + depth)) + slope / (12.0 + depth);
    return vec4f((piece.low.xyz + mix(x, y, place) * piece.rise.xyz) * alpha, alpha);
}
