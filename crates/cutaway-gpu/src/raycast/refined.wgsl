// Emission and absorption by steps that are more than the value in their middle: pre-integrated, cut finer where they must
// be, jittered, on planes of voxels, or lit by another gradient. Apart from the plain kernel, which they would slow down.

import package::frame::sampling::gradient::{gradient_samples, light_gradient};
import package::frame::sampling::preintegration::{
    BEYOND_GAUSS, End, GAUSS, coordinate_of, extrapolated, opacity_of_share, visible_between, whole_step,
};
import package::raycast::composite::absorb;
import package::raycast::pixel::Pixel;
import package::raycast::steps::{Step, Steps, step_at, step_of, steps_before, steps_of};
import package::shared::blocks::next_stretch;
import package::shared::classification::{classified, opacity_of};
import package::shared::face::{Face, impregnated};
import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms, UNLIT, lit, terms_of_gradient};
import package::shared::ray::{Ray, position};
import package::shared::volume::value_at;

// 0 the plain kernel, 1 steps by their middle, 2 these cut finer where they differ, 3 pre-integrated.
override STEPPING: u32 = 0u;

// Into how many shorter steps one is cut; as the CPU engine.
const FINER = 4;

// The segment from t_near to t_far, behind what the pixel has gathered.
fn composite_refined(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t_near: f32, t_far: f32) {
    let steps = steps_of(ray, t_near, t_far);
    var i = 0;
    while i < steps.count {
        let from_t = max(step_at(steps, i).t, t_near);
        let stretch = next_stretch(ray, from_t, t_far);
        if stretch.x >= stretch.y {
            return;
        }
        (*pixel).stretches += 1u;
        i = max(i, step_of(steps, stretch.x));
        // One step at least: a stretch may lie within a step that has been taken.
        let end = max(i + 1, min(steps.count, steps_before(steps, stretch.y)));
        if STEPPING == 3u {
            preintegrated_run(pixel, ray, face, steps, i, end);
        } else {
            run_by_middles(pixel, ray, face, steps, i, end);
        }
        if (*pixel).transmittance < frame.opaque_below {
            return;
        }
        i = end;
    }
}

// What a point of a ray looks like: lit colour, and optical depth of a whole step of the scene's.
struct Look {
    color: vec3f,
    depth: f32,
}

const NOTHING_SEEN = Look(vec3f(0.0), 0.0);

fn terms_at(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t: f32) -> Terms {
    (*pixel).samples += gradient_samples();
    return impregnated(face, t, terms_of_gradient(light_gradient(position(ray, t)), ray.direction_in_world));
}

fn look(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t: f32) -> Look {
    let entry = classified(value_at(position(ray, t)));
    (*pixel).samples += 1u;
    if entry.w <= 0.0 {
        return NOTHING_SEEN;
    }
    if SHADED {
        return Look(lit(entry.xyz, terms_at(pixel, ray, face, t)), entry.w);
    }
    return Look(entry.xyz, entry.w);
}

// Of step j; beyond the segment's ends there is nothing.
fn look_at_step(pixel: ptr<function, Pixel>, ray: Ray, face: Face, steps: Steps, j: i32) -> Look {
    if (j < 0) || (j >= steps.count) {
        return NOTHING_SEEN;
    }
    return look(pixel, ray, face, step_at(steps, j).middle);
}

fn differ(a: Look, b: Look) -> bool {
    let alpha_a = opacity_of(a.depth);
    let alpha_b = opacity_of(b.depth);
    let apart = abs(vec4f(alpha_a * a.color, alpha_a) - vec4f(alpha_b * b.color, alpha_b));
    return any(apart > vec4f(frame.adaptive_threshold));
}

fn add_look(pixel: ptr<function, Pixel>, seen: Look, t: f32, length: f32) {
    if seen.depth > 0.0 {
        absorb(pixel, seen.color, seen.depth * length / frame.step_length, t, length);
    }
}

fn run_by_middles(pixel: ptr<function, Pixel>, ray: Ray, face: Face, steps: Steps, begin: i32, end: i32) {
    let adaptive = STEPPING == 2u;
    var before = NOTHING_SEEN;
    var now = NOTHING_SEEN;
    // Neighbours count even where they are skipped: what a step is must not depend on that.
    if adaptive {
        before = look_at_step(pixel, ray, face, steps, begin - 1);
        now = look_at_step(pixel, ray, face, steps, begin);
    }
    for (var i = begin; i < end; i += 1) {
        let at = step_at(steps, i);
        (*pixel).taken += 1u;
        if !adaptive {
            add_look(pixel, look(pixel, ray, face, at.middle), at.t, at.length);
        } else {
            let after = look_at_step(pixel, ray, face, steps, i + 1);
            if differ(now, before) || differ(now, after) {
                let length = at.length / f32(FINER);
                for (var k = 0; k < FINER; k += 1) {
                    let t = at.t + f32(k) * length;
                    add_look(pixel, look(pixel, ray, face, t + 0.5 * length), t, length);
                }
            } else {
                add_look(pixel, now, at.t, at.length);
            }
            before = now;
            now = after;
        }
        if (*pixel).transmittance < frame.opaque_below {
            return;
        }
    }
}

// Steps by the integral along the straight line that stands for the field, and for the light, over a step: the line
// through both at the two Gauss points. Its integral is that of the field up to cubics, which the field is along a ray
// within a cell; the line through the step's ends is off by the field's curvature, which shows more than half as many
// fetches save.
fn preintegrated_run(pixel: ptr<function, Pixel>, ray: Ray, face: Face, steps: Steps, begin: i32, end: i32) {
    for (var i = begin; i < end; i += 1) {
        let at = step_at(steps, i);
        (*pixel).taken += 1u;
        let t = vec2f(at.t + GAUSS * at.length, at.t + (1.0 - GAUSS) * at.length);
        let near = value_at(position(ray, t.x));
        let far = value_at(position(ray, t.y));
        (*pixel).samples += 2u;
        let beyond = BEYOND_GAUSS * (far - near);
        var front = End(coordinate_of(near - beyond), UNLIT);
        var back = End(coordinate_of(far + beyond), UNLIT);
        if SHADED && visible_between(front, back) {
            let a = terms_at(pixel, ray, face, t.x);
            let b = terms_at(pixel, ray, face, t.y);
            front.terms = extrapolated(a, b);
            back.terms = extrapolated(b, a);
        }
        add_integral(pixel, whole_step(front, back), at);
        if (*pixel).transmittance < frame.opaque_below {
            return;
        }
    }
}

// What a whole step adds, cut down to what there is of it.
fn add_integral(pixel: ptr<function, Pixel>, whole: vec4f, at: Step) {
    if whole.w <= 0.0 {
        return;
    }
    let alpha = opacity_of_share(whole.w, at.length / frame.step_length);
    let before = (*pixel).transmittance;
    let after = before * (1.0 - alpha);
    (*pixel).color += before * (alpha / whole.w) * whole.xyz;
    (*pixel).transmittance = after;
    if before > 0.5 && after <= 0.5 {
        // As if extinction were constant over the step; see `absorb`.
        (*pixel).depth = at.t + at.length * min(log(before * 2.0) / log(before / max(after, 1e-30)), 1.0);
    }
}
