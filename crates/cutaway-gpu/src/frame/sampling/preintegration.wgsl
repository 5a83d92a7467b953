// Look-ups of pre-integrated steps; see `cutaway_core::preintegration` for the tables and for how they are read.

import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms};

// Coordinate among the nodes at a bin's start, and its growth over the bin.
@group(2) @binding(0) var<storage, read> bins: array<vec2f>;
// Back node fastest. Lit: front weights, then back weights, of red, green, blue and opacity. Unlit: their sum.
@group(2) @binding(1) var<storage, read> integrals: array<vec4f>;

// Where the Gauss points of a step are, (1 - 1/sqrt(3)) / 2 of it from its ends, and how far the ends are beyond them in
// distances of the points: the line through both stands for the field, and for the light.
const GAUSS = 0.21132487;
const BEYOND_GAUSS = 0.3660254;

// One end of a step: its value's coordinate among the nodes, and its light.
struct End {
    coordinate: f32,
    terms: Terms,
}

fn coordinate_of(texel: f32) -> f32 {
    let x = clamp((texel - frame.bins_offset) * frame.bins_scale, 0.0, f32(frame.bins_last));
    let i = u32(x);
    let bin = bins[i];
    return bin.x + (x - f32(i)) * bin.y;
}

// Among four entries; one half of each where they have two.
fn integral(row: u32, column: u32, weights: vec2f, half: u32) -> vec4f {
    let stride = select(1u, 2u, SHADED);
    let near = (row * frame.nodes + column) * stride + half;
    let far = near + frame.nodes * stride;
    return mix(
        mix(integrals[near], integrals[near + stride], weights.y),
        mix(integrals[far], integrals[far + stride], weights.y),
        weights.x,
    );
}

// Premultiplied colour and opacity of a whole step.
fn whole_step(front: End, back: End) -> vec4f {
    let last = frame.nodes - 2u;
    let row = min(u32(front.coordinate), last);
    let column = min(u32(back.coordinate), last);
    let weights = vec2f(front.coordinate - f32(row), back.coordinate - f32(column));
    let first = integral(row, column, weights, 0u);
    if !SHADED {
        return first;
    }
    let second = integral(row, column, weights, 1u);
    let white = first.w * front.terms.white + second.w * back.terms.white;
    let color = first.xyz * front.terms.factor + second.xyz * back.terms.factor + white;
    return vec4f(color, first.w + second.w);
}

// The opacity of a share of a step of this opacity; by its series where a difference would be all rounding.
fn opacity_of_share(alpha: f32, share: f32) -> f32 {
    let series = alpha * share * (1.0 + 0.5 * alpha * (1.0 - share));
    return select(1.0 - pow(max(1.0 - alpha, 0.0), share), series, alpha < 1e-3);
}

// Whether a step has any opacity: light need not be found where it has not.
fn visible_between(front: End, back: End) -> bool {
    let last = frame.nodes - 2u;
    let row = min(u32(front.coordinate), last);
    let column = min(u32(back.coordinate), last);
    let weights = vec2f(front.coordinate - f32(row), back.coordinate - f32(column));
    return integral(row, column, weights, 0u).w > 0.0;
}

// The light at a's end of a step: on the line through both points, but no less than none.
fn extrapolated(a: Terms, b: Terms) -> Terms {
    let factor = a.factor + BEYOND_GAUSS * (a.factor - b.factor);
    let white = a.white + BEYOND_GAUSS * (a.white - b.white);
    return Terms(max(factor, 0.0), max(white, 0.0));
}
