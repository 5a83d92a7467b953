// Draws a tile's tetrahedra from front to back, in registers: a thread has eight pixels, four by two, and goes through its
// tile's list by itself. It looks for the next tetrahedron that its pixels are in, and then integrates along all eight of
// them, one piece of the transfer function at a time: neighbouring threads, which go in step, are mostly each at work on
// another tetrahedron and none waits for what only its neighbour sees.

import package::cells::pieces::{BINS, Piece, bins};
import package::cells::tiles::record::{ROW_BITS, TEXELS, TILE};
import package::cells::tiles::task::TileTask;
import package::cells::view::view;
import package::shared::frame::frame;
import package::shared::ray::ray_of;

@group(1) @binding(0) var<uniform> task: TileTask;
@group(1) @binding(1) var<storage, read> spans: array<vec2u>;
@group(1) @binding(2) var<storage, read> live: array<u32>;
@group(1) @binding(3) var<storage, read> totals: array<u32>;
@group(1) @binding(4) var records: texture_2d<u32>;
@group(1) @binding(5) var lists: texture_2d<u32>;
// Three texels a piece, as in `Piece`.
@group(1) @binding(6) var piece_texels: texture_2d<f32>;
// Premultiplied colour and opacity of what is in front: by tile, part and pixel.
@group(1) @binding(7) var<storage, read_write> image: array<vec4f>;
// What is shown, where all is drawn at once.
@group(1) @binding(8) var shown: texture_storage_2d<rgba32float, write>;

// Entries of a list that are drawn at once: some drivers end a shader's loops after 65,535 rounds, all loops together.
const WINDOW = 2048u;

// Workgroups along y are 2 to this power, as in tiles/mod.rs.
const LIST_PARTS = 5u;

override PARALLEL: bool = false;

// Whether nothing is drawn before or after: pixels begin empty, and go to where they are shown.
override WHOLE: bool = false;

// What eight pixels integrate at a time.
struct Slab {
    // Faces at the first pixel, per x, per y.
    entry_0: vec3f,
    plane_1: vec3f,
    plane_2: vec3f,
    exit_3: vec3f,
    entries: u32,
    value: vec4f,
    piece: Piece,
    // Whether values rise along rays.
    rising: bool,
}

fn at_pixel(plane: vec3f, pixel: vec2f) -> f32 {
    return plane.x + plane.y * pixel.x + plane.z * pixel.y;
}

fn place_in_rows(index: u32) -> vec2u {
    return vec2u(index & ((1u << ROW_BITS) - 1u), index >> ROW_BITS);
}

fn record_texel(index: u32) -> vec4u {
    return textureLoad(records, place_in_rows(index), 0);
}

fn piece_of(index: u32) -> Piece {
    let at = 3u * index;
    let range = textureLoad(piece_texels, place_in_rows(at + 2u), 0);
    return Piece(
        textureLoad(piece_texels, place_in_rows(at), 0),
        textureLoad(piece_texels, place_in_rows(at + 1u), 0),
        range.x,
        range.y,
        range.z,
        0u,
    );
}

// As `of_piece` in `integral.wgsl`, of shares of the piece, with one logarithm: by Simpson's rule the mean extinction is that
// of a product. The rise of the extinction along the stretch is a series, off by at most 3 % where opacity changes by 0.9.
fn of_stretch(piece: Piece, x: f32, y: f32, length: f32) -> vec4f {
    let front = greater(1.0 - (piece.low.w + x * piece.rise.w), 1e-6);
    let back = greater(1.0 - (piece.low.w + y * piece.rise.w), 1e-6);
    let middle = 0.5 * (front + back);
    let square = middle * middle;
    let mean = log(front * back * square * square) * (-1.0 / 6.0);
    let depth = mean * length;
    let alpha = 1.0 - exp(-depth);
    // The place is (12 + depth) / (24 + depth (6 + depth)) + rise / (mean (12 + depth)); all that is divided by at once, for
    // nothing here takes longer. From a depth of 100 on nothing comes through.
    let bounded = lesser(depth, 1e4);
    let near_part = 12.0 + bounded;
    let far_part = 24.0 + bounded * (6.0 + bounded);
    let scale = near_part * greater(mean, 1e-12);
    let inverse = 1.0 / (middle * far_part * scale);
    let change = 0.5 * (front - back) * (far_part * scale * inverse);
    let squared = change * change;
    let rise = 2.0 * change * (1.0 + squared * (1.0 / 3.0 + squared * (0.2 + squared * (1.0 / 7.0))));
    let place = (near_part * scale + rise * far_part) * (middle * inverse);
    return vec4f((piece.low.xyz + (x + (y - x) * place) * piece.rise.xyz) * alpha, alpha);
}

// What is in front of a pixel; and the greatest value on rays so far, or where they fall the least one, negated.
struct Pixel {
    color: vec4f,
    far: f32,
}

// What is in front of a pixel, with a slab behind it.
fn behind(front: Pixel, slab: Slab, pixel: vec2f, per_depth: f32) -> Pixel {
    let z0 = at_pixel(slab.entry_0, pixel);
    let z1 = at_pixel(slab.plane_1, pixel);
    let z2 = at_pixel(slab.plane_2, pixel);
    let z3 = at_pixel(slab.exit_3, pixel);
    let second = slab.entries >= 2u;
    let third = slab.entries >= 3u;
    var e_near = greater(z0, greater(select(z0, z1, second), select(z0, z2, third)));
    var e_far = lesser(z3, lesser(select(z1, z3, second), select(z2, z3, third)));
    let q = slab.value.x + slab.value.y * pixel.x + slab.value.z * pixel.y;
    var near: f32;
    var far: f32;
    var depth: f32;
    if PARALLEL {
        near = q + slab.value.w * e_near;
        far = q + slab.value.w * e_far;
        depth = e_far - e_near;
    } else {
        // Not nearer than the nearest that is drawn. From inside, rays leave by all planes.
        let inside = slab.entries == 0u;
        e_far = select(e_far, lesser(e_far, z0), inside);
        e_near = greater(select(e_near, nearest(), inside), nearest());
        let near_inverse = 1.0 - e_near * view.inverse;
        let far_inverse = greater(1.0 - e_far * view.inverse, 1e-18);
        let both = 1.0 / (near_inverse * far_inverse);
        let w_near = both * far_inverse;
        let w_far = both * near_inverse;
        near = (q + slab.value.w * e_near) * w_near;
        far = (q + slab.value.w * e_far) * w_far;
        depth = e_far * w_far - e_near * w_near;
    }
    let covered = e_far > e_near;
    let change = far - near;
    let inverse = select(-1.0, 1.0, change >= 0.0) / greater(abs(change), 1e-6);
    let at_begin = within((slab.piece.begin - near) * inverse);
    let at_end = within((slab.piece.end - near) * inverse);
    let a = lesser(at_begin, at_end);
    let b = greater(at_begin, at_end);
    let length = (b - a) * depth * per_depth;
    let share = (near - slab.piece.begin) * slab.piece.inverse;
    let per_share = change * slab.piece.inverse;
    let color = of_stretch(slab.piece, share + a * per_share, share + b * per_share, length);
    let seen = covered && (length > 0.0);
    // Where the ray does not meet the slab the colour may be anything.
    let added = select(vec4f(0.0), (1.0 - front.color.w) * color, seen);
    let value = select(-1e30, select(-lesser(near, far), greater(near, far), slab.rising), covered);
    return Pixel(front.color + added, greater(value, front.far));
}

// Where the nearest plane is that is drawn.
fn nearest() -> f32 {
    return select((view.least_w - 1.0) / (view.least_w * view.inverse), -1e30, PARALLEL);
}

// Without the rules for what is not a number, which cost as much again.
fn greater(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn lesser(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn within(a: f32) -> f32 {
    return lesser(greater(a, 0.0), 1.0);
}

// The piece that the pixels of a part meet first, of those from first to last: by the least, or where values fall along
// rays the greatest, value that there can be.
fn first_met(own: vec4f, slab_planes: array<vec3f, 4>, entries: u32, rising: bool, first: u32, last: u32) -> u32 {
    let e_near = max(
        max(select(nearest(), lower(slab_planes[0]), entries >= 1u), nearest()),
        max(select(-1e30, lower(slab_planes[1]), entries >= 2u), select(-1e30, lower(slab_planes[2]), entries >= 3u)),
    );
    let e_far = min(
        upper(slab_planes[3]),
        min(select(1e30, upper(slab_planes[2]), entries <= 2u), select(1e30, upper(slab_planes[1]), entries <= 1u)),
    );
    let middle = own.x + 1.5 * own.y + 0.5 * own.z;
    let reach = 1.5 * abs(own.y) + 0.5 * abs(own.z);
    let side = select(1.0, -1.0, rising) * reach;
    let way = own.w * vec2f(e_near, e_far);
    let extreme = middle + side + select(max(way.x, way.y), min(way.x, way.y), rising);
    let w = vec2f(1.0) / max(1.0 - vec2f(e_near, e_far) * view.inverse, vec2f(1e-30));
    let value = select(max(extreme * w.x, extreme * w.y) + 0.01, min(extreme * w.x, extreme * w.y) - 0.01, rising);
    // Of parts that no ray meets the range is empty, and any piece will do.
    let piece = bins[u32(clamp(value, 0.0, BINS - 1.0))].y;
    return clamp(piece, first, last);
}

// The extremes of a plane over the pixels of a part.
fn lower(plane: vec3f) -> f32 {
    return plane.x + min(3.0 * plane.y, 0.0) + min(plane.z, 0.0);
}

fn upper(plane: vec3f) -> f32 {
    return plane.x + max(3.0 * plane.y, 0.0) + max(plane.z, 0.0);
}

@compute @workgroup_size(64)
fn composite_tiles(
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    // Software drivers give each thread a stretch of the workgroups, x first. Each is to have parts of the list from all over
    // it, for some take longer, but long parts: neighbouring tiles show the same tetrahedra.
    let part_of_list = reverseBits(group.y) >> (32u - LIST_PARTS);
    let number = (part_of_list * groups.x + group.x) * 8u + local / 8u;
    if number >= totals[4] {
        return;
    }
    let tile = live[number];
    let part = local & 7u;
    let origin = vec2u(tile % task.tiles_x, tile / task.tiles_x) * TILE + vec2u(4u * (part & 1u), 2u * (part >> 1u));
    let first = vec2f(origin);
    let home = (tile * 8u + part) * 8u;
    var c0 = vec4f(0.0);
    var c1 = vec4f(0.0);
    var c2 = vec4f(0.0);
    var c3 = vec4f(0.0);
    var c4 = vec4f(0.0);
    var c5 = vec4f(0.0);
    var c6 = vec4f(0.0);
    var c7 = vec4f(0.0);
    if !WHOLE {
        c0 = image[home + 0u];
        c1 = image[home + 1u];
        c2 = image[home + 2u];
        c3 = image[home + 3u];
        c4 = image[home + 4u];
        c5 = image[home + 5u];
        c6 = image[home + 6u];
        c7 = image[home + 7u];
    }
    let d0 = per_depth_of(first);
    let d1 = per_depth_of(first + vec2f(1.0, 0.0));
    let d2 = per_depth_of(first + vec2f(2.0, 0.0));
    let d3 = per_depth_of(first + vec2f(3.0, 0.0));
    let d4 = per_depth_of(first + vec2f(0.0, 1.0));
    let d5 = per_depth_of(first + vec2f(1.0, 1.0));
    let d6 = per_depth_of(first + vec2f(2.0, 1.0));
    let d7 = per_depth_of(first + vec2f(3.0, 1.0));
    let span = spans[tile];
    let bit = 1u << (24u + part);
    var cursor = span.x + min(task.window, span.y);
    var end = span.x + min(task.window + WINDOW, span.y);
    // Of the tetrahedron at hand: its record, and its pieces that are still to come.
    var record = 0u;
    var piece = 0u;
    var left = 0u;
    let opaque_at = 1.0 - frame.opaque_below;
    loop {
        var found = left > 0u;
        loop {
            if found || (cursor >= end) {
                break;
            }
            let entry = textureLoad(lists, place_in_rows(cursor), 0).x;
            cursor += 1u;
            found = (entry & bit) != 0u;
            record = (entry & 0xffffffu) * TEXELS;
        }
        if !found {
            break;
        }
        // The first and the last together: a record is in two lines of a cache, which come while the rest is fetched.
        let t0 = record_texel(record);
        let value = bitcast<vec4f>(record_texel(record + 4u));
        let t1 = record_texel(record + 1u);
        let t2 = record_texel(record + 2u);
        let t3 = record_texel(record + 3u);
        let entries = t0.w >> 28u;
        let from_reference = first - vec2f(vec2u(extractBits(t0.w, 0u, 14u), extractBits(t0.w, 14u, 14u)));
        let own = vec4f(value.x + dot(value.yz, from_reference), value.yzw);
        // Values rise or fall along these rays; pieces come in that order.
        let middle = own.x + 1.5 * own.y + 0.5 * own.z;
        let rising = own.w + middle * view.inverse >= 0.0;
        let first_piece = t1.w & 0xffffu;
        let last_piece = t1.w >> 16u;
        let planes = array<vec3f, 4>(
            moved(t0, from_reference),
            moved(t1, from_reference),
            moved(t2, from_reference),
            moved(t3, from_reference),
        );
        if left == 0u {
            piece = first_met(own, planes, entries, rising, first_piece, last_piece);
            left = select(piece - first_piece, last_piece - piece, rising) + 1u;
        }
        let slab = Slab(planes[0], planes[1], planes[2], planes[3], entries, own, piece_of(piece), rising);
        let p0 = behind(Pixel(c0, -1e30), slab, vec2f(0.0, 0.0), d0);
        let p1 = behind(Pixel(c1, p0.far), slab, vec2f(1.0, 0.0), d1);
        let p2 = behind(Pixel(c2, p1.far), slab, vec2f(2.0, 0.0), d2);
        let p3 = behind(Pixel(c3, p2.far), slab, vec2f(3.0, 0.0), d3);
        let p4 = behind(Pixel(c4, p3.far), slab, vec2f(0.0, 1.0), d4);
        let p5 = behind(Pixel(c5, p4.far), slab, vec2f(1.0, 1.0), d5);
        let p6 = behind(Pixel(c6, p5.far), slab, vec2f(2.0, 1.0), d6);
        let p7 = behind(Pixel(c7, p6.far), slab, vec2f(3.0, 1.0), d7);
        c0 = p0.color;
        c1 = p1.color;
        c2 = p2.color;
        c3 = p3.color;
        c4 = p4.color;
        c5 = p5.color;
        c6 = p6.color;
        c7 = p7.color;
        // Pieces beyond the last value that any of these rays meets are not theirs.
        let goes_on = p7.far > select(-slab.piece.begin, slab.piece.end, rising);
        left = select(0u, left - 1u, goes_on);
        piece = select(piece - 1u, piece + 1u, rising);
        let least = min(min(min(c0.w, c1.w), min(c2.w, c3.w)), min(min(c4.w, c5.w), min(c6.w, c7.w)));
        if least > opaque_at {
            left = 0u;
            end = cursor;
        }
    }
    if WHOLE {
        show(origin + vec2u(0u, 0u), c0);
        show(origin + vec2u(1u, 0u), c1);
        show(origin + vec2u(2u, 0u), c2);
        show(origin + vec2u(3u, 0u), c3);
        show(origin + vec2u(0u, 1u), c4);
        show(origin + vec2u(1u, 1u), c5);
        show(origin + vec2u(2u, 1u), c6);
        show(origin + vec2u(3u, 1u), c7);
        return;
    }
    image[home + 0u] = c0;
    image[home + 1u] = c1;
    image[home + 2u] = c2;
    image[home + 3u] = c3;
    image[home + 4u] = c4;
    image[home + 5u] = c5;
    image[home + 6u] = c6;
    image[home + 7u] = c7;
}

fn show(pixel: vec2u, color: vec4f) {
    if all(pixel < textureDimensions(shown)) {
        textureStore(shown, pixel, color);
    }
}

fn moved(texel: vec4u, by: vec2f) -> vec3f {
    let plane = bitcast<vec3f>(texel.xyz);
    return vec3f(plane.x + dot(plane.yz, by), plane.yz);
}

// From a difference in depth to unit distances of the transfer function along a pixel's ray.
fn per_depth_of(pixel: vec2f) -> f32 {
    if PARALLEL {
        return view.per_unit;
    }
    return ray_of(pixel).base * view.inverse * view.per_unit;
}
