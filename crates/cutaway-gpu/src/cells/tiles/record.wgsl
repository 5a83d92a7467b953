// What is kept of a tetrahedron to draw it tile by tile: the planes of its faces as seen along rays, and the field in it.
//
// Of a point, x and y are its pixel less the axis and e is depth / w (see `view.wgsl`). In these a plane of the world is a
// plane again, e = e0 + gx x + gy y, whether its corners are before the eye or not. A ray is in the tetrahedron from the
// farthest of the faces that it enters by to the nearest of those that it leaves by: coverage, depths and length come from
// four planes, nothing is interpolated, and what reaches behind the eye needs no other treatment than a near limit of e.
//
// A record is six texels of four words:
//   0 to 3: planes, those that rays enter by first: at the reference pixel, per x, per y; and a word each:
//           0: reference pixel, 14 bits x, 14 bits y, then how many are entered by: 1 to 3; 0 with the eye inside
//           1: first and last piece of the transfer function that can be seen, 16 bits each
//           2, 3: gradient / w in the middle, of meshes, as in `Record`
//   4: value / w as q0 + qx x + qy y + qe e, likewise
//   5: first and last tile that it may be in, 16 bits an axis

import package::cells::pieces::{pieces, pieces_of};
import package::cells::view::view;

const TEXELS = 6u;
const ROW_BITS = 12u;

// Pixels along a side of a tile.
const TILE = 8u;

// In place of how many planes are entered by: nothing is seen.
const NOT_SEEN = 7u;

struct Cell {
    // At the reference pixel, per x, per y; those of rays' entries first.
    planes: array<vec3f, 4>,
    value: vec4f,
    reference: vec2f,
    // How many planes rays enter by, or NOT_SEEN.
    entries: u32,
    pieces: u32,
    // Pixels.
    low: vec2f,
    high: vec2f,
}

// A point in the cells' space: pixels from the axis and depth, before the division by w.
fn before_division(p: vec3f) -> vec3f {
    let q = vec4f(p, 1.0);
    return vec3f(dot(view.x, q), dot(view.y, q), dot(view.depth, q));
}

fn w_of(p: vec3f) -> f32 {
    return 1.0 + p.z * view.inverse;
}

struct Bounds {
    low: vec2f,
    high: vec2f,
}

// Where the edge from a to b meets the nearest plane that is drawn, if it does.
fn with_edge(bounds: Bounds, a: vec3f, b: vec3f) -> Bounds {
    let u = w_of(a) - view.least_w;
    let v = w_of(b) - view.least_w;
    let crosses = (u > 0.0) != (v > 0.0);
    let at = mix(a.xy, b.xy, saturate(u / select(u - v, 1.0, !crosses))) / view.least_w;
    return Bounds(select(bounds.low, min(bounds.low, at), crosses), select(bounds.high, max(bounds.high, at), crosses));
}

fn with_point(bounds: Bounds, p: vec3f) -> Bounds {
    let w = w_of(p);
    let at = p.xy / max(w, view.least_w);
    let there = w >= view.least_w;
    return Bounds(select(bounds.low, min(bounds.low, at), there), select(bounds.high, max(bounds.high, at), there));
}

// The box, in pixels, of what is before the eye of a tetrahedron.
fn bounds_of(p: array<vec3f, 4>) -> Bounds {
    var bounds = Bounds(vec2f(1e30), vec2f(-1e30));
    for (var k = 0u; k < 4u; k += 1u) {
        bounds = with_point(bounds, p[k]);
    }
    if view.inverse > 0.0 {
        bounds = with_edge(bounds, p[0], p[1]);
        bounds = with_edge(bounds, p[0], p[2]);
        bounds = with_edge(bounds, p[0], p[3]);
        bounds = with_edge(bounds, p[1], p[2]);
        bounds = with_edge(bounds, p[1], p[3]);
        bounds = with_edge(bounds, p[2], p[3]);
    }
    return Bounds(bounds.low + view.axis, bounds.high + view.axis);
}

// Whether a box has the centre of a pixel of the image in it.
fn has_a_centre(bounds: Bounds) -> bool {
    let first = max(ceil(bounds.low), vec2f(0.0));
    let last = min(floor(bounds.high), view.size - 1.0);
    return all(first <= last);
}

// A face through a point with a normal that points out of the tetrahedron. w of the result: 1 where rays enter by it.
fn plane_of(normal: vec3f, at: vec3f, reference: vec2f, least: f32) -> vec4f {
    let facing = normal.z + dot(normal, at) * view.inverse;
    // Seen from the side a face is as good as a wall: steep, but not infinitely so.
    let wall = least * (abs(normal.x) + abs(normal.y)) + 1e-37;
    let by = select(-1.0, 1.0, facing >= 0.0) * max(abs(facing), wall);
    let from_reference = dot(normal, vec3f(at.xy - reference, at.z));
    return vec4f(vec3f(from_reference, -normal.xy) / by, select(1.0, 0.0, by > 0.0));
}

fn entries_first(a: vec4f, b: vec4f) -> bool {
    return a.w < b.w;
}

// Of four points as from `before_division`, with their values in bins.
fn cell_of(p: array<vec3f, 4>, s: vec4f) -> Cell {
    let bounds = bounds_of(p);
    var cell: Cell;
    cell.low = bounds.low;
    cell.high = bounds.high;
    cell.reference = round(clamp(0.5 * (bounds.low + bounds.high), vec2f(0.0), view.size - 1.0));
    let reference = cell.reference - view.axis;
    let a = p[1] - p[0];
    let b = p[2] - p[0];
    let c = p[3] - p[0];
    let bc = cross(b, c);
    let ca = cross(c, a);
    let ab = cross(a, b);
    let volume = dot(a, bc);
    let out = select(1.0, -1.0, volume > 0.0);
    let reach = max(abs(a), max(abs(b), abs(c)));
    let least = 1e-6 * max(reach.x, reach.y) / max(reach.z, 1e-30);
    var f0 = plane_of(-out * (bc + ca + ab), p[1], reference, least);
    var f1 = plane_of(out * bc, p[0], reference, least);
    var f2 = plane_of(out * ca, p[0], reference, least);
    var f3 = plane_of(out * ab, p[0], reference, least);
    let entries = f0.w + f1.w + f2.w + f3.w;
    // A sorting network.
    let g0 = select(f0, f1, entries_first(f0, f1));
    let g1 = select(f1, f0, entries_first(f0, f1));
    let g2 = select(f2, f3, entries_first(f2, f3));
    let g3 = select(f3, f2, entries_first(f2, f3));
    let h0 = select(g0, g2, entries_first(g0, g2));
    let h2 = select(g2, g0, entries_first(g0, g2));
    let h1 = select(g1, g3, entries_first(g1, g3));
    let h3 = select(g3, g1, entries_first(g1, g3));
    let i1 = select(h1, h2, entries_first(h1, h2));
    let i2 = select(h2, h1, entries_first(h1, h2));
    cell.planes = array<vec3f, 4>(h0.xyz, i1.xyz, i2.xyz, h3.xyz);
    let rise = s.yzw - s.x;
    let gradient = (rise.x * bc + rise.y * ca + rise.z * ab) / volume;
    let at_origin = s.x - dot(gradient, p[0]);
    let at_reference = s.x - dot(gradient, p[0] - vec3f(reference, 0.0));
    cell.value = vec4f(at_reference, gradient.xy, gradient.z - at_origin * view.inverse);
    let least_value = min(min(s.x, s.y), min(s.z, s.w));
    let most_value = max(max(s.x, s.y), max(s.z, s.w));
    cell.pieces = seen_pieces(least_value, most_value);
    let right = (abs(volume) > 0.0) && (abs(volume) < 1e37) && (entries < 3.5);
    let seen = right && has_a_centre(bounds) && (cell.pieces != 0xffffffffu);
    cell.entries = select(NOT_SEEN, u32(entries), seen);
    return cell;
}

// The first and the last piece of a range of values that can be seen; all ones where none can.
fn seen_pieces(lo: f32, hi: f32) -> u32 {
    let all = pieces_of(lo, hi);
    let first = pieces[all & 0xffffu].seen & 0xffffu;
    let last = pieces[all >> 16u].seen >> 16u;
    // The last one before any that is seen is all ones, too.
    let none = (first > last) || (last == 0xffffu);
    return select(first | (last << 16u), 0xffffffffu, none);
}

// What a tile's lists need: which of its eight parts a tetrahedron is in, which are four pixels wide and two high.
struct Cover {
    // Of (plane left by) - (plane entered by), four of them: at the reference pixel, per x, per y.
    at: vec4f,
    per_x: vec4f,
    per_y: vec4f,
    reference: vec2f,
}

fn cover_of(planes: array<vec3f, 4>, entries: u32, reference: vec2f) -> Cover {
    // One entry: planes 1, 2, 3 less 0. Two: 2 and 3 less 0 and 1. Three: 3 less 0, 1, 2.
    let second = entries >= 2u;
    let third = entries >= 3u;
    let p0 = planes[0];
    let p3 = planes[3];
    let q = p3 - p0;
    let r = select(planes[1] - p0, p3 - planes[1], second);
    let s = select(planes[2] - p0, p3 - planes[2], third);
    let t = select(q, planes[2] - planes[1], second && !third);
    if entries == 0u {
        return Cover(vec4f(1.0), vec4f(0.0), vec4f(0.0), reference);
    }
    return Cover(vec4f(q.x, r.x, s.x, t.x), vec4f(q.y, r.y, s.y, t.y), vec4f(q.z, r.z, s.z, t.z), reference);
}

// Whether any of a tile can be in it.
fn meets(cover: Cover, tile: vec2u) -> bool {
    let middle = vec2f(tile * TILE) + 3.5 - cover.reference;
    let most = cover.at + cover.per_x * middle.x + cover.per_y * middle.y + 3.5 * (abs(cover.per_x) + abs(cover.per_y));
    return all(most >= vec4f(0.0));
}

// A bit a part of the tile: along x, then along y.
fn parts_of(cover: Cover, tile: vec2u) -> u32 {
    let middle = vec2f(tile * TILE) + vec2f(1.5, 0.5) - cover.reference;
    var row = cover.at + cover.per_x * middle.x + cover.per_y * middle.y + 1.5 * abs(cover.per_x) + 0.5 * abs(cover.per_y);
    var parts = 0u;
    for (var k = 0u; k < 4u; k += 1u) {
        let right = row + 4.0 * cover.per_x;
        let here = all(row >= vec4f(0.0));
        let beside = all(right >= vec4f(0.0));
        parts |= select(0u, 1u, here) << (2u * k);
        parts |= select(0u, 2u, beside) << (2u * k);
        row += 2.0 * cover.per_y;
    }
    return parts;
}

struct Tiles {
    first: vec2u,
    last: vec2u,
}

fn tiles_of(low: vec2f, high: vec2f) -> Tiles {
    let first = clamp(ceil(low), vec2f(0.0), view.size - 1.0);
    let last = clamp(floor(high), vec2f(0.0), view.size - 1.0);
    return Tiles(vec2u(first) / TILE, vec2u(last) / TILE);
}
