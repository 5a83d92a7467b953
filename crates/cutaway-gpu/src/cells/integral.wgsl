// Emission and absorption along a stretch on which the value is linear.

import package::cells::pieces::{Piece, at, pieces};
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

// Extinction per world unit of an opacity per unit distance; the clamp is `MAX_OPACITY`.
fn extinction(opacity: f32) -> f32 {
    let small = opacity * (1.0 + opacity * (0.5 + opacity / 3.0));
    return select(-log(max(1.0 - opacity, 1e-6)), small, opacity < 0.01) * view.per_unit;
}

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

// The piece of a value among those from first to last.
fn piece_of(value: f32, first: u32, last: u32) -> u32 {
    var i = first;
    while (i < last) && (pieces[i].end <= value) {
        i += 1u;
    }
    return i;
}

// Premultiplied colour and opacity.
fn integral_of(stretch: Stretch, range: u32) -> vec4f {
    let first = range & 0xffffu;
    let last = range >> 16u;
    if INTEGRAL == 0u {
        let value = 0.5 * (stretch.near + stretch.far);
        let entry = at(pieces[piece_of(value, first, last)], value);
        let alpha = 1.0 - transmittance(extinction(entry.w) * stretch.length);
        return vec4f(entry.xyz * alpha, alpha);
    }
    if INTEGRAL == 1u {
        let front = at(pieces[piece_of(stretch.near, first, last)], stretch.near);
        let back = at(pieces[piece_of(stretch.far, first, last)], stretch.far);
        let a = extinction(front.w) * stretch.length;
        let b = extinction(back.w) * stretch.length;
        let through = transmittance(0.5 * (a + b));
        return vec4f(front.xyz - back.xyz * through + (back.xyz - front.xyz) * psi(a, b), 1.0 - through);
    }
    if first == last {
        let piece = pieces[first];
        return of_piece(at(piece, stretch.near), at(piece, stretch.far), stretch.length);
    }
    return in_pieces(stretch, first, last);
}

fn in_pieces(stretch: Stretch, first: u32, last: u32) -> vec4f {
    let change = stretch.far - stretch.near;
    if abs(change) < 1e-6 {
        let entry = at(pieces[piece_of(stretch.near, first, last)], stretch.near);
        return of_piece(entry, entry, stretch.length);
    }
    var sum = vec4f(0.0);
    for (var k = 0u; k <= last - first; k += 1u) {
        let i = select(last - k, first + k, change > 0.0);
        let piece = pieces[i];
        // What is below the first piece or above the last one takes their nearest point's.
        let low = select(piece.begin, -1e30, i == first);
        let high = select(piece.end, 1e30, i == last);
        let near = clamp(stretch.near, low, high);
        let far = clamp(stretch.far, low, high);
        let share = (far - near) / change;
        if share > 0.0 {
            sum += (1.0 - sum.w) * of_piece(at(piece, near), at(piece, far), share * stretch.length);
        }
    }
    return sum;
}

// Between two points of the transfer function colour and opacity are linear. The optical depth is that of the parabola
// through the extinction at the ends and in the middle; where it is more than 2 the stretch is cut further.
fn of_piece(front: vec4f, back: vec4f, length: f32) -> vec4f {
    if max(front.w, back.w) <= 0.0 {
        return vec4f(0.0);
    }
    let most = max(extinction(front.w), extinction(back.w)) * length;
    if most <= 2.0 {
        return short_piece(front, back, length);
    }
    let parts = min(ceil(0.5 * most), 8.0);
    var sum = vec4f(0.0);
    for (var k = 0.0; k < parts; k += 1.0) {
        let a = mix(front, back, k / parts);
        let b = mix(front, back, (k + 1.0) / parts);
        sum += (1.0 - sum.w) * short_piece(a, b, length / parts);
    }
    return sum;
}

fn short_piece(front: vec4f, back: vec4f, length: f32) -> vec4f {
    let sigma = vec3f(extinction(front.w), extinction(0.5 * (front.w + back.w)), extinction(back.w));
    let depth = length * (sigma.x + 4.0 * sigma.y + sigma.z) / 6.0;
    let half_depth = length * (5.0 * sigma.x + 8.0 * sigma.y - sigma.z) / 24.0;
    let through = exp(-depth);
    // The integral of colour times extinction times transmittance, by parts: the colour's change meets the mean
    // transmittance, here by Simpson's rule.
    let mean = (1.0 + 4.0 * exp(-half_depth) + through) / 6.0;
    return vec4f(front.xyz - back.xyz * through + (back.xyz - front.xyz) * mean, 1.0 - through);
}
