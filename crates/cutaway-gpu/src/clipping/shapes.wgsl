// Events of what needs no mesh: planes, boxes and balls from their equations, as in `cutaway_core::clip`; and the meshes that
// the eye is in, which the ray has entered before it begins.

import package::clipping::events::{FARTHEST, SHAPE_IDS, offer_event};
import package::clipping::leaf::{BALL, BOX, PLANE, direction_in_object, first_at, leaves, normal_in_world, second_at};
import package::clipping::octahedral::octahedral_packed;
import package::clipping::settings::sweep;
import package::shared::ray::Ray;

fn offer_surface(leaf: u32, t: f32, entering: bool, normal_in_object: vec3f) {
    let normal = octahedral_packed(normal_in_world(leaf, normal_in_object));
    offer_event(t, leaf, entering, normal, SHAPE_IDS + 2u * leaf + select(0u, 1u, entering));
}

// A half-space has no end: one of its events is beyond everything.
fn collect_plane(leaf: u32, gap: f32, direction: vec3f) {
    // The normal is the first row of the linear part, so that x is the way along it.
    let outward = vec3f(1.0, 0.0, 0.0);
    let slope = direction.x;
    if slope == 0.0 && gap < 0.0 {
        return;
    }
    let t = select(gap / select(slope, 1.0, slope == 0.0), FARTHEST, slope == 0.0);
    offer_surface(leaf, select(-FARTHEST, t, slope < 0.0), true, outward);
    offer_surface(leaf, select(t, FARTHEST, slope < 0.0), false, outward);
}

fn collect_box(leaf: u32, low_gap: vec3f, high_gap: vec3f, direction: vec3f) {
    let still = direction == vec3f(0.0);
    if any(still & ((low_gap > vec3f(0.0)) | (high_gap < vec3f(0.0)))) {
        return;
    }
    let divisor = select(direction, vec3f(1.0), still);
    let forward = direction > vec3f(0.0);
    let first = select(select(high_gap, low_gap, forward) / divisor, vec3f(-FARTHEST), still);
    let last = select(select(low_gap, high_gap, forward) / divisor, vec3f(FARTHEST), still);
    let near = max(first.x, max(first.y, first.z));
    let far = min(last.x, min(last.y, last.z));
    if (near >= far) || (near <= -FARTHEST) {
        return;
    }
    let side = select(vec3f(-1.0), vec3f(1.0), forward);
    // Of several faces at one place, the first.
    let entered = first == vec3f(near);
    let left = last == vec3f(far);
    let only_first_entered = vec3f(vec3<bool>(entered.x, entered.y && !entered.x, entered.z && !entered.x && !entered.y));
    let only_first_left = vec3f(vec3<bool>(left.x, left.y && !left.x, left.z && !left.x && !left.y));
    offer_surface(leaf, near, true, -side * only_first_entered);
    offer_surface(leaf, far, false, side * only_first_left);
}

// Numbers of a ball are in units of its radius. The chord from the line's nearest point keeps its length, where b² - 4ac
// would cancel (Haines et al., Ray Tracing Gems, chapter 7).
fn collect_ball(leaf: u32, from_center: vec3f, direction: vec3f) {
    let scale = length(direction);
    let unit = direction / scale;
    let along = -dot(from_center, unit);
    let nearest = from_center + unit * along;
    let distance = length(nearest);
    if distance >= 1.0 {
        return;
    }
    let half = sqrt((1.0 - distance) * (1.0 + distance));
    offer_surface(leaf, (along - half) / scale, true, nearest - unit * half);
    offer_surface(leaf, (along + half) / scale, false, nearest + unit * half);
}

fn collect_shapes(place: vec2u, ray: Ray) {
    let pixel = vec2f(place);
    // Ids behind those of the surfaces.
    var id = SHAPE_IDS + 2u * sweep.leaf_count;
    for (var leaf = 0u; leaf < sweep.leaf_count; leaf += 1u) {
        let kind = leaves[leaf].kind;
        if kind == PLANE {
            collect_plane(leaf, first_at(leaf, pixel).x, direction_in_object(leaf, ray));
        } else if kind == BOX {
            collect_box(leaf, first_at(leaf, pixel), second_at(leaf, pixel), direction_in_object(leaf, ray));
        } else if kind == BALL {
            collect_ball(leaf, first_at(leaf, pixel), direction_in_object(leaf, ray));
        } else {
            let winding = leaves[leaf].eye_winding;
            for (var i = 0; i < abs(winding); i += 1) {
                offer_event(-FARTHEST, leaf, winding > 0, 0u, id);
                id += 1u;
            }
        }
    }
}
