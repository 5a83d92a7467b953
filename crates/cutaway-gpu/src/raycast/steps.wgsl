// The steps of a segment. Each is a stretch and a place in it that is sampled; together they are the segment, and its two
// ends are exact, whatever lies between.
//
// - Along the view: steps of one length from the segment's near end on, the last one shorter. With jitter the *second* one
//   is shorter, too, by a share that is each pixel's own: what begins deeper in the volume is met at another phase in
//   every pixel, while the first step, which makes the face of a cut, is the same in all (Termeer 4.2.5 and 4.2.6).
// - On the planes of voxels across the axis that the ray follows most: a step is what is nearest to a plane, and is sampled
//   on it; the first and the last are cut short by the segment (Termeer 4.1.1).

import package::shared::frame::frame;
import package::shared::ray::{Ray, step_along};

// The tile of blue noise, one byte a pixel.
@group(2) @binding(2) var noise: texture_2d<f32>;

override JITTER: bool = false;
override ON_PLANES: bool = false;

// The share of a step that the second one has.
var<private> second_share: f32 = 1.0;

fn set_jitter(place: vec2u) {
    if JITTER {
        let value = textureLoad(noise, place % textureDimensions(noise), 0).x;
        // Bytes come as shares of 255; never 0, never 1.
        second_share = (value * 255.0 + 0.5) / 256.0;
    }
}

struct Steps {
    // Where the first step would begin were it whole.
    origin: f32,
    // Of a whole step.
    length: f32,
    // The second step's, as a share.
    second: f32,
    t_near: f32,
    t_far: f32,
    count: i32,
}

struct Step {
    t: f32,
    length: f32,
    // Where it is sampled.
    middle: f32,
}

fn steps_of(ray: Ray, t_near: f32, t_far: f32) -> Steps {
    var steps = Steps(t_near, step_along(ray), second_share, t_near, t_far, 0);
    if ON_PLANES {
        let along = abs(ray.direction);
        var point = ray.point.z;
        var direction = ray.direction.z;
        if (along.x >= along.y) && (along.x >= along.z) {
            point = ray.point.x;
            direction = ray.direction.x;
        } else if along.y >= along.z {
            point = ray.point.y;
            direction = ray.direction.y;
        }
        // Steps end half-way between planes. Of the first, as much as there is lies behind t_near.
        let length = 1.0 / abs(direction);
        let first = floor(point * sign(direction) + t_near / length + 0.5) - 0.5;
        steps.origin = (first - point * sign(direction)) * length;
        steps.length = length;
        steps.second = 1.0;
    }
    steps.count = steps_before(steps, t_far);
    return steps;
}

// How many steps begin before t.
fn steps_before(steps: Steps, t: f32) -> i32 {
    let x = (t - steps.origin) / steps.length;
    return i32(ceil(select(x, x + 1.0 - steps.second, x > 1.0)));
}

// The step that t lies in.
fn step_of(steps: Steps, t: f32) -> i32 {
    let x = (t - steps.origin) / steps.length;
    return i32(floor(select(x, x + 1.0 - steps.second, x >= 1.0)));
}

fn step_begin(steps: Steps, i: i32) -> f32 {
    return steps.origin + (f32(i) + select(0.0, steps.second - 1.0, i > 1)) * steps.length;
}

fn step_at(steps: Steps, i: i32) -> Step {
    let whole = step_begin(steps, i);
    let t = max(whole, steps.t_near);
    let share = select(1.0, steps.second, i == 1);
    let length = max(min(share * steps.length - (t - whole), steps.t_far - t), 0.0);
    return Step(t, length, select(t + 0.5 * length, whole + 0.5 * steps.length, ON_PLANES));
}
