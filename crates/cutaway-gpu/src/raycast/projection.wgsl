// Projections: the greatest, the least or the mean value over all segments, classified once.

import package::raycast::pixel::Pixel;
import package::shared::block_ranges::stretch_at;
import package::shared::blocks::SKIP_BLOCKS;
import package::shared::classification::classified;
import package::shared::frame::frame;
import package::shared::ray::{Ray, position, step_along};
import package::shared::volume::value_at;

// What is left to classify.
struct Projected {
    // Greatest or least texel; the sum of texel times length for the mean.
    value: f32,
    length: f32,
    t: f32,
}

const NOTHING_PROJECTED = Projected(0.0, 0.0, 1e30);

// Steps across a block from which on it is worth a look at what is in the block, which takes as long as two or three of
// them. Across coarse blocks there are always more.
const STEPS_A_LOOK = 8.0;

// 1 greatest texel, -1 least, 0 mean.
fn project(
    projected: ptr<function, Projected>,
    pixel: ptr<function, Pixel>,
    ray: Ray,
    kind: f32,
    t_near: f32,
    t_far: f32,
) {
    let step = step_along(ray);
    let steps = i32(ceil((t_far - t_near) / step));
    let along = abs(ray.direction);
    let fine = frame.block_edge >= STEPS_A_LOOK * step * max(along.x, max(along.y, along.z));
    var i = 0;
    while i < steps {
        // Up to here samples are taken, or none is: what is known is not to be outdone in such blocks.
        var end = steps;
        if SKIP_BLOCKS && kind != 0.0 {
            end = i + 1;
            if (*projected).length > 0.0 {
                let t = t_near + f32(i) * step;
                let stretch = stretch_at(ray, t + 0.5 * min(step, t_far - t), kind, (*projected).value, fine);
                // The first step whose middle is not within the stretch.
                end = clamp(i32(ceil((stretch.t_end - t_near) / step - 0.5)), i + 1, steps);
                if !stretch.promising {
                    i = end;
                    continue;
                }
            }
        }
        for (; i < end; i += 1) {
            let t = t_near + f32(i) * step;
            let length = min(step, t_far - t);
            project_value(projected, ray, kind, t + 0.5 * length, length);
            (*pixel).samples += 1u;
            (*pixel).taken += 1u;
        }
    }
    if kind == 0.0 && steps > 0 {
        (*projected).t = min((*projected).t, t_near);
    }
    if kind != 0.0 && (*projected).t >= t_near && (*projected).t <= t_far {
        close_in(projected, pixel, ray, kind, t_near, t_far);
    }
}

fn project_value(projected: ptr<function, Projected>, ray: Ray, kind: f32, t: f32, length: f32) {
    let value = value_at(position(ray, t));
    if kind == 0.0 {
        (*projected).value += value * length;
    } else if (*projected).length == 0.0 || (value - (*projected).value) * kind > 0.0 {
        (*projected).value = value;
        (*projected).t = t;
    }
    (*projected).length += length;
}

// The extremum lies between samples: closes in on it from the best one of this segment.
fn close_in(
    projected: ptr<function, Projected>,
    pixel: ptr<function, Pixel>,
    ray: Ray,
    kind: f32,
    t_near: f32,
    t_far: f32,
) {
    var reach = 0.5 * step_along(ray);
    for (var halving = 0; halving < 4; halving += 1) {
        let middle = (*projected).t;
        for (var side = -1.0; side < 2.0; side += 2.0) {
            let t = clamp(middle + side * reach, t_near, t_far);
            let value = value_at(position(ray, t));
            if (value - (*projected).value) * kind > 0.0 {
                (*projected).value = value;
                (*projected).t = t;
            }
        }
        reach *= 0.5;
    }
    (*pixel).samples += 8u;
}

// The opacity of a projected value is used as it is: the table holds it for projections.
fn finish_projection(projected: Projected, kind: f32, pixel: ptr<function, Pixel>) {
    if projected.length <= 0.0 {
        return;
    }
    let value = select(projected.value, projected.value / projected.length, kind == 0.0);
    let entry = classified(value);
    let weight = (*pixel).transmittance * entry.w;
    (*pixel).color += weight * entry.xyz;
    (*pixel).transmittance -= weight;
    if entry.w > 0.0 {
        (*pixel).depth = projected.t;
    }
}
