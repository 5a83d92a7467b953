// The transfer function as the pieces between its points, on each of which colour and opacity are linear, and which of them
// a range of values meets. Values are in bins: 0 to BINS over the volume's range.

import package::cells::view::view;

struct Piece {
    // Straight colour and opacity per unit distance at the lower end.
    low: vec4f,
    // How much they rise to the upper end.
    rise: vec4f,
    // The ends in bins, and 1 / their distance.
    begin: f32,
    end: f32,
    inverse: f32,
    // The first piece from this one on that can be seen, and the last one up to it; 16 bits each, all ones where none is.
    seen: u32,
}

@group(2) @binding(1) var<storage, read> pieces: array<Piece>;
// Of each bin, and of the end: how many before it can be visible, and the first piece that reaches into it.
@group(2) @binding(2) var<storage, read> bins: array<vec2u>;

const BINS = 1024.0;

// Whether anything between two values can be visible.
fn any_visible(lo: f32, hi: f32) -> bool {
    let first = u32(clamp(lo, 0.0, BINS - 1.0));
    let end = u32(clamp(ceil(hi), f32(first) + 1.0, BINS));
    return bins[end].x > bins[first].x;
}

// The first and the last piece of a range of values, in 16 bits each.
fn pieces_of(lo: f32, hi: f32) -> u32 {
    var first = bins[u32(clamp(lo, 0.0, BINS - 1.0))].y;
    while (first < view.piece_last) && (pieces[first].end <= lo) {
        first += 1u;
    }
    var last = max(first, bins[u32(clamp(hi, 0.0, BINS - 1.0))].y);
    while (last < view.piece_last) && (pieces[last + 1u].begin <= hi) {
        last += 1u;
    }
    return first | (last << 16u);
}

// How far into a piece a value is, 0 to 1.
fn share_of(piece: Piece, value: f32) -> f32 {
    return saturate((value - piece.begin) * piece.inverse);
}

// Extinction per unit distance there; the clamp is `MAX_OPACITY`.
fn extinction_at(piece: Piece, x: f32) -> f32 {
    return -log(max(1.0 - (piece.low.w + x * piece.rise.w), 1e-6));
}
