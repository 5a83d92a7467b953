// Isosurfaces, exactly: a ray goes from cell to cell; inside a cell the trilinear field along it is a cubic, whose pieces
// between its extrema rise or fall, so that each level is crossed once a piece at most, and is then found by bisection and
// false position. What one cell ends with the next one begins with: no surface is lost or doubled at a face.

import package::raycast::pixel::{Pixel, add_surface};
import package::shared::blocks::next_stretch;
import package::shared::classification::isosurface;
import package::shared::face::Face;
import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms, UNLIT, lit, terms_of_gradient};
import package::shared::ray::{Ray, past, position};
import package::shared::volume::{Corners, cell_of, corners_of, exact_gradient_at, trilinear};

// c.x + s (c.y + s (c.z + s c.w)), s from 0 to 1 along a cell's stretch.
fn cubic_at(c: vec4f, s: f32) -> f32 {
    return c.x + s * (c.y + s * (c.z + s * c.w));
}

// Through the values at 0, 1/3, 2/3 and 1. Of differences, so that equal values make a constant, without rounding.
fn cubic_through(v: vec4f) -> vec4f {
    let d = v.yzw - v.x;
    return vec4f(
        v.x,
        9.0 * d.x - 4.5 * d.y + d.z,
        -22.5 * d.x + 18.0 * d.y - 4.5 * d.z,
        13.5 * d.x - 13.5 * d.y + 4.5 * d.z,
    );
}

// The field in a cell, negated where that makes it rise with the value.
fn field_in(corners: Corners, f: vec3f) -> f32 {
    return frame.value_sign * trilinear(corners, f);
}

// The extrema inside, ascending; 1 where there is none.
fn extrema(c: vec4f) -> vec2f {
    let a = 3.0 * c.w;
    let b = 2.0 * c.z;
    let discriminant = b * b - 4.0 * a * c.y;
    if discriminant <= 0.0 {
        return vec2f(1.0);
    }
    // Without cancellation: q is the larger of both sums.
    let root = sqrt(discriminant);
    let q = -0.5 * (b + select(-root, root, b >= 0.0));
    let s = vec2f(select(q / a, 1.0, a == 0.0), select(c.y / q, 1.0, q == 0.0));
    let inside = select(vec2f(1.0), s, (s > vec2f(0.0)) & (s < vec2f(1.0)));
    return vec2f(min(inside.x, inside.y), max(inside.x, inside.y));
}

// Where a piece that rises or falls from s0 to s1 is at `level`.
fn crossing(c: vec4f, level: f32, s0: f32, s1: f32) -> f32 {
    var a = s0;
    var b = s1;
    var fa = cubic_at(c, a) - level;
    var fb = cubic_at(c, b) - level;
    if (fa < 0.0) == (fb < 0.0) {
        // Rounding has put the level just outside the piece.
        return select(b, a, abs(fa) < abs(fb));
    }
    for (var i = 0; i < 12; i += 1) {
        let slope = fb - fa;
        // False position and halving by turns: the first is fast, the second is never slow.
        var s = 0.5 * (a + b);
        if (i & 1) == 0 && slope != 0.0 {
            s = clamp(a - fa * (b - a) / slope, a, b);
        }
        let f = cubic_at(c, s) - level;
        if f == 0.0 {
            return s;
        }
        if (f < 0.0) == (fa < 0.0) {
            a = s;
            fa = f;
        } else {
            b = s;
            fb = f;
        }
    }
    let slope = fb - fa;
    return select(clamp(a - fa * (b - a) / slope, a, b), 0.5 * (a + b), slope == 0.0);
}

fn surface(pixel: ptr<function, Pixel>, ray: Ray, index: u32, t: f32) {
    var terms = UNLIT;
    if SHADED {
        let p = clamp(position(ray, t), vec3f(0.0), frame.extent);
        terms = terms_of_gradient(exact_gradient_at(p), ray.direction_in_world);
        (*pixel).samples += 6u;
    }
    add_surface(pixel, lit(isosurface(index).xyz, terms), frame.iso_opacity, t);
}

// The cubic stays between the least and the greatest of its Bernstein coefficients.
fn bounds_of(c: vec4f) -> vec2f {
    let inner = c.x + vec2f(c.y, 2.0 * c.y + c.z) / 3.0;
    let end = c.x + c.y + c.z + c.w;
    let least = min(min(c.x, end), min(inner.x, inner.y));
    let greatest = max(max(c.x, end), max(inner.x, inner.y));
    return vec2f(least, greatest);
}

// Whether any level is met between two values.
fn meets_level(least: f32, greatest: f32) -> bool {
    var met = false;
    for (var k = 0u; k < frame.iso_count; k += 1u) {
        let level = isosurface(k).w;
        met = met || ((level >= least) && (level <= greatest));
    }
    return met;
}

// The smallest and largest value at a cell's corners. No value inside leaves this range, whatever rounding says.
fn range_of(corners: Corners) -> vec2f {
    let least = min(corners.low, corners.high);
    let greatest = max(corners.low, corners.high);
    let a = frame.value_sign * min(min(least.x, least.y), min(least.z, least.w));
    let b = frame.value_sign * max(max(greatest.x, greatest.y), max(greatest.z, greatest.w));
    return vec2f(min(a, b), max(a, b));
}

// The part of a ray in one cell: from t on, of this length, where the field is the cubic within `range`, and `before` at
// its start as the cell before ended.
fn cross_cell(pixel: ptr<function, Pixel>, ray: Ray, c: vec4f, range: vec2f, ends: vec2f, part: vec2f) {
    let before = ends.x;
    let end = ends.y;
    let t = part.x;
    let length = part.y;
    let e = extrema(c);
    // Pieces that rise or fall: up to the first extremum, to the second, to the end; those that are not there are empty.
    var from_s = 0.0;
    var from_value = before;
    for (var piece = 0; piece < 3; piece += 1) {
        let to_s = select(select(1.0, e.y, piece == 1), e.x, piece == 0);
        let to_value = select(clamp(cubic_at(c, to_s), range.x, range.y), end, to_s >= 1.0);
        let rises = to_value > from_value;
        for (var k = 0u; k < frame.iso_count; k += 1u) {
            let index = select(frame.iso_count - 1u - k, k, rises);
            let level = isosurface(index).w;
            // At a level is above it.
            if (from_value >= level) != (to_value >= level) {
                surface(pixel, ray, index, t + length * crossing(c, level, from_s, to_s));
                if (*pixel).transmittance < frame.opaque_below {
                    return;
                }
            }
        }
        from_s = to_s;
        from_value = to_value;
    }
}

// Of the levels that a ray begins above, the innermost: the cut closes it.
fn close_by_cut(pixel: ptr<function, Pixel>, face: Face, value: f32) {
    for (var k = frame.iso_count; k > 0u; k -= 1u) {
        let level = isosurface(k - 1u);
        if value >= level.w {
            add_surface(pixel, lit(level.xyz, face.terms), frame.iso_opacity, face.t);
            return;
        }
    }
}

fn isosurfaces(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t_near: f32, t_far: f32) {
    var t = t_near;
    // The field at t, once it is known.
    var value = 0.0;
    var known = false;
    if face.present && frame.cap == 1u {
        let p = clamp(position(ray, t_near), vec3f(0.0), frame.extent);
        let cell = cell_of(p);
        value = field_in(corners_of(cell), p - vec3f(cell));
        close_by_cut(pixel, face, value);
        known = true;
    }
    while (t < t_far) && ((*pixel).transmittance >= frame.opaque_below) {
        let stretch = next_stretch(ray, t, t_far);
        if stretch.x >= stretch.y {
            return;
        }
        known = known && stretch.x <= t;
        t = stretch.x;
        (*pixel).stretches += 1u;
        while (t < stretch.y) && ((*pixel).transmittance >= frame.opaque_below) {
            let inside = past(ray, t, 1e-4);
            let cell = cell_of(position(ray, inside));
            let end = min(max(cell_exit(ray, cell), inside), t_far);
            let length = end - t;
            let corners = corners_of(cell);
            let range = range_of(corners);
            (*pixel).samples += 1u;
            var v: vec4f;
            for (var k = 0; k < 4; k += 1) {
                let f = clamp(position(ray, t + length * f32(k) / 3.0) - vec3f(cell), vec3f(0.0), vec3f(1.0));
                v[k] = clamp(field_in(corners, f), range.x, range.y);
            }
            let before = select(v.x, value, known);
            value = v.w;
            known = true;
            let c = cubic_through(v);
            let bounds = bounds_of(c);
            // Both ends as they are carried on count, whatever rounding makes of the cubic there.
            if meets_level(min(bounds.x, min(before, value)), max(bounds.y, max(before, value))) {
                cross_cell(pixel, ray, c, range, vec2f(before, value), vec2f(t, length));
            }
            t = end;
        }
    }
}

fn cell_exit(ray: Ray, cell: vec3i) -> f32 {
    let side = vec3f(cell) + select(vec3f(0.0), vec3f(1.0), ray.direction > vec3f(0.0));
    let far = (side - ray.point) * ray.inverse + ray.never;
    return min(far.x, min(far.y, far.z));
}
