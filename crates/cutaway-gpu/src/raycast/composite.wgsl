// Emission and absorption: each step is classified at its middle and has the opacity of its own length.

import package::raycast::pixel::Pixel;
import package::shared::blocks::next_stretch;
import package::shared::classification::{classified, opacity_of};
import package::shared::face::{Face, impregnated};
import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms, UNLIT, lit, terms_of_gradient};
import package::shared::ray::{Ray, position, step_along};
import package::shared::volume::{gradient_at, value_at};

// What lies behind takes over from T to T * (1 - alpha); depth is where opacity passes one half.
fn absorb(pixel: ptr<function, Pixel>, color: vec3f, optical_depth: f32, t: f32, length: f32) {
    let alpha = opacity_of(optical_depth);
    let before = (*pixel).transmittance;
    let after = before * (1.0 - alpha);
    (*pixel).color += before * alpha * color;
    (*pixel).transmittance = after;
    if before > 0.5 && after <= 0.5 {
        // Transmittance falls exponentially within a step of constant extinction.
        (*pixel).depth = t + length * min(log(before * 2.0) / optical_depth, 1.0);
    }
}

// The segment from t_near to t_far, behind what the pixel has gathered.
fn composite(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t_near: f32, t_far: f32) {
    let step = step_along(ray);
    let steps = i32(ceil((t_far - t_near) / step));
    var i = 0;
    while i < steps {
        let stretch = next_stretch(ray, t_near + f32(i) * step, t_far);
        if stretch.x >= stretch.y {
            return;
        }
        (*pixel).stretches += 1u;
        i = max(i, i32(floor((stretch.x - t_near) / step)));
        // One step at least: a stretch may lie within a step that has been taken.
        let end = max(i + 1, min(steps, i32(ceil((stretch.y - t_near) / step))));
        for (; i < end; i += 1) {
            let t = t_near + f32(i) * step;
            let length = min(step, t_far - t);
            sample(pixel, ray, face, t, length);
            if (*pixel).transmittance < frame.opaque_below {
                return;
            }
        }
    }
}

fn sample(pixel: ptr<function, Pixel>, ray: Ray, face: Face, t: f32, length: f32) {
    let middle = t + 0.5 * length;
    let p = position(ray, middle);
    let entry = classified(value_at(p));
    (*pixel).samples += 1u;
    (*pixel).taken += 1u;
    if entry.w <= 0.0 {
        return;
    }
    var terms = UNLIT;
    if SHADED {
        terms = impregnated(face, middle, terms_of_gradient(gradient_at(p), ray.direction_in_world));
        (*pixel).samples += 6u;
    }
    absorb(pixel, lit(entry.xyz, terms), entry.w * length / frame.step_length, t, length);
}
