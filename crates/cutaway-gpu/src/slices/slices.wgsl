// Slices: a polygon a plane and brick, and what a fragment of it adds (Rezk-Salama and Kolb 2005).
//
// A fragment stands for the *slab* of its plane along the pixel's ray: half the distance of planes before it and behind it,
// which along a slanted ray is longer than along the view. Of the slab, what lies in the volume's box and is kept by
// clipping is cut into *stretches*, each of which has the opacity of its own length and is sampled in its middle. A stretch
// belongs to the brick that its middle is in; every brick finds the same stretches, so that none is drawn twice or missed, and
// bricks do not show.

import package::frame::sampling::gradient::light_gradient;
import package::frame::sampling::preintegration::{
    BEYOND_GAUSS, End, GAUSS, coordinate_of, extrapolated, opacity_of_share, visible_between, whole_step,
};
import package::shared::classification::{classified, opacity_of};
import package::shared::face::{Face, face_of, impregnated};
import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms, UNLIT, lit, terms_of_gradient};
import package::shared::ray::{NO_DEPTH, Ray, box_range, position, ray_of};
import package::shared::segments::{CLIPPED, segment, segment_count};
import package::shared::volume::value_at;
import package::slices::frame::{Brick, slices};
import package::slices::intersection::{Normal, polygon_corner};

// Stretches stand for the integral between their ends, not for the value in their middle.
override PREINTEGRATED: bool = false;
// Clip surfaces are lit.
override FACES_LIT: bool = true;
// Mean instead of extreme values.
override MEAN: bool = false;

@group(3) @binding(1) var<storage, read> bricks: array<Brick>;

struct SlicePoint {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) brick: u32,
    // Of the plane.
    @location(1) @interpolate(flat) depth: f32,
}

// Six corners as a strip of triangles: 0 1 5 2 4 3, four bits each.
const STRIP = 0x342510u;

// Six vertices a slice, from nothing but their number: that of the brick times six, and the corner. Instances are planes,
// the farthest first.
@vertex
fn slice_corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> SlicePoint {
    let brick = bricks[vertex / 6u];
    let depth = slices.first_depth + f32(slices.last_plane - instance) * slices.spacing;
    let margin = select(slices.narrow_margin, slices.wide_margin, brick.cut == 1u);
    let origin = brick.origin - margin;
    let size = min(vec3f(brick.edge), frame.extent - brick.origin) + 2.0 * margin;
    let planes = Normal(slices.normal, slices.sequence);
    let p = polygon_corner(planes, depth + slices.offset, origin, size, extractBits(STRIP, 4u * (vertex % 6u), 4u));
    let at = slices.clip_from_voxel * vec4f(p, 1.0);
    // Planes lie before the eye, and none is too far.
    return SlicePoint(vec4f(at.xy, 0.5 * at.w, at.w), vertex / 6u, depth);
}

// The part of a ray that a plane stands for; empty unless near < far.
struct Slab {
    near: f32,
    far: f32,
}

fn slab_of(ray: Ray, depth: f32, cut: bool) -> Slab {
    // How much longer the ray is than the depth that it covers.
    let slant = ray.base / frame.base_distance;
    let middle = depth * slant;
    let half = 0.5 * slices.spacing * slant;
    if !cut {
        return Slab(middle - half, middle + half);
    }
    let range = box_range(ray);
    return Slab(max(middle - half, range.x), min(middle + half, range.y));
}

// Whether a stretch with its middle here belongs to a brick; what lies outside the volume by rounding, to the nearest one.
fn owns(brick: Brick, p: vec3f) -> bool {
    let end = brick.origin + brick.edge;
    let lo = select(brick.origin, vec3f(-1e30), brick.origin <= vec3f(0.0));
    let hi = select(end, vec3f(1e30), end >= frame.extent);
    return all((p >= lo) & (p < hi));
}

struct Blended {
    // Premultiplied.
    @location(0) color: vec4f,
    // Distance along the ray, in `length_unit`s, times opacity; then opacity.
    @location(1) distance: vec4f,
}

// What the stretches of a slab add up to, front to back.
struct Gathered {
    color: vec3f,
    transmittance: f32,
    distance: f32,
}

fn gather(gathered: ptr<function, Gathered>, premultiplied: vec4f, distance: f32) {
    (*gathered).color += (*gathered).transmittance * premultiplied.xyz;
    (*gathered).distance += (*gathered).transmittance * premultiplied.w * distance;
    (*gathered).transmittance *= 1.0 - premultiplied.w;
}

@fragment
fn blend_slice(point: SlicePoint) -> Blended {
    let place = vec2u(point.at.xy);
    let ray = ray_of(vec2f(place));
    let brick = bricks[point.brick];
    let slab = slab_of(ray, point.depth, brick.cut == 1u);
    var gathered = Gathered(vec3f(0.0), 1.0, 0.0);
    if CLIPPED {
        let count = segment_count(place);
        for (var k = 0u; k < count; k += 1u) {
            let kept = segment(place, k);
            if kept.t_near >= slab.far {
                break;
            }
            let near = max(slab.near, kept.t_near);
            let far = min(slab.far, kept.t_far);
            if (near < far) && owns(brick, position(ray, 0.5 * (near + far))) {
                let face = face_of(ray, kept, FACES_LIT);
                if face.present && (frame.overlay > 0.0) && (near == kept.t_near) {
                    let color = lit(vec3f(1.0), face.terms);
                    gather(&gathered, vec4f(frame.overlay * color, frame.overlay), near / slices.length_unit);
                }
                gather(&gathered, stretch_of(ray, face, near, far), 0.5 * (near + far) / slices.length_unit);
            }
        }
    } else if (slab.near < slab.far) && owns(brick, position(ray, 0.5 * (slab.near + slab.far))) {
        let face = Face(false, 0.0, UNLIT, 0.0);
        gather(&gathered, stretch_of(ray, face, slab.near, slab.far), 0.5 * (slab.near + slab.far) / slices.length_unit);
    }
    let alpha = 1.0 - gathered.transmittance;
    if alpha <= 0.0 {
        discard;
    }
    return Blended(vec4f(gathered.color, alpha), vec4f(gathered.distance, 0.0, 0.0, alpha));
}

fn terms_at(ray: Ray, face: Face, t: f32) -> Terms {
    return impregnated(face, t, terms_of_gradient(light_gradient(position(ray, t)), ray.direction_in_world));
}

// Premultiplied colour and opacity of a stretch.
fn stretch_of(ray: Ray, face: Face, near: f32, far: f32) -> vec4f {
    if PREINTEGRATED {
        return integrated_stretch(ray, face, near, far);
    }
    let middle = 0.5 * (near + far);
    let entry = classified(value_at(position(ray, middle)));
    if entry.w <= 0.0 {
        return vec4f(0.0);
    }
    let alpha = opacity_of(entry.w * (far - near) / frame.step_length);
    var terms = UNLIT;
    if SHADED {
        terms = terms_at(ray, face, middle);
    }
    return vec4f(alpha * lit(entry.xyz, terms), alpha);
}

fn integrated_stretch(ray: Ray, face: Face, near: f32, far: f32) -> vec4f {
    let length = far - near;
    let t = vec2f(near + GAUSS * length, far - GAUSS * length);
    let first = value_at(position(ray, t.x));
    let second = value_at(position(ray, t.y));
    let beyond = BEYOND_GAUSS * (second - first);
    var front = End(coordinate_of(first - beyond), UNLIT);
    var back = End(coordinate_of(second + beyond), UNLIT);
    if !visible_between(front, back) {
        return vec4f(0.0);
    }
    if SHADED {
        let a = terms_at(ray, face, t.x);
        let b = terms_at(ray, face, t.y);
        front.terms = extrapolated(a, b);
        back.terms = extrapolated(b, a);
    }
    let whole = whole_step(front, back);
    if whole.w <= 0.0 {
        return vec4f(0.0);
    }
    let alpha = opacity_of_share(whole.w, length / frame.step_length);
    return vec4f((alpha / whole.w) * whole.xyz, alpha);
}

// Of extreme values: the greatest texel, negated where the least is looked for. Of means: texel times length, and length.
@fragment
fn project_slice(point: SlicePoint) -> @location(0) vec4f {
    let place = vec2u(point.at.xy);
    let ray = ray_of(vec2f(place));
    let brick = bricks[point.brick];
    let slab = slab_of(ray, point.depth, brick.cut == 1u);
    var found = vec2f(select(-NO_DEPTH, 0.0, MEAN), 0.0);
    var any_stretch = false;
    var count = 1u;
    if CLIPPED {
        count = segment_count(place);
    }
    for (var k = 0u; k < count; k += 1u) {
        var near = slab.near;
        var far = slab.far;
        if CLIPPED {
            let kept = segment(place, k);
            near = max(near, kept.t_near);
            far = min(far, kept.t_far);
        }
        if near >= far {
            continue;
        }
        let p = position(ray, 0.5 * (near + far));
        if owns(brick, p) {
            any_stretch = true;
            found = projected(found, ray, near, far);
        }
    }
    if !any_stretch {
        discard;
    }
    return vec4f(found, 0.0, 0.0);
}

fn projected(before: vec2f, ray: Ray, near: f32, far: f32) -> vec2f {
    if MEAN {
        let length = (far - near) / slices.length_unit;
        return before + vec2f(value_at(position(ray, 0.5 * (near + far))) * length, length);
    }
    // Extremes lie between planes, too: three places of each stretch.
    var most = before.x;
    for (var i = 0; i < 3; i += 1) {
        let t = near + (far - near) * (1.0 + 2.0 * f32(i)) / 6.0;
        most = max(most, slices.kind * value_at(position(ray, t)));
    }
    return vec2f(most, 0.0);
}
