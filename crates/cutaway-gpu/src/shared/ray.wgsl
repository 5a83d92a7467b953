// The ray of a pixel. Distances `t` along it are world lengths from the ray's *point*, which lies near the middle of the
// volume, not from the eye: however far that is, neighbouring distances stay apart in f32.

import package::shared::frame::frame;

// The depth of a pixel in which nothing is. The host has it in frame/targets.rs.
const NO_DEPTH = 1e30;

struct Ray {
    // In voxel space, at t = 0.
    point: vec3f,
    // In voxel space, for one world unit.
    direction: vec3f,
    // In the world, of unit length.
    direction_in_world: vec3f,
    // World distance from the eye to the point: the ray begins at t = -base.
    base: f32,
    // World units from plane to plane of voxels along each axis, signed; 0 along axes that the ray does not go.
    inverse: vec3f,
    // 1e30 along those axes, 0 along the others.
    never: vec3f,
}

fn ray_of(pixel: vec2f) -> Ray {
    let point = frame.point_first + pixel.x * frame.point_per_x + pixel.y * frame.point_per_y;
    let way = frame.direction_first + pixel.x * frame.direction_per_x + pixel.y * frame.direction_per_y;
    let far = length(way);
    let direction_in_world = way / far;
    let direction = frame.voxel_from_world_x * direction_in_world.x
        + frame.voxel_from_world_y * direction_in_world.y
        + frame.voxel_from_world_z * direction_in_world.z;
    let zero = parallel_axes(direction);
    let inverse = select(1.0 / select(direction, vec3f(1.0), zero), vec3f(0.0), zero);
    let never = select(vec3f(0.0), vec3f(1e30), zero);
    let base = select(far, frame.base_distance, frame.parallel == 1u);
    return Ray(point, direction, direction_in_world, base, inverse, never);
}

// World length of a step along a ray.
fn step_along(ray: Ray) -> f32 {
    if frame.voxels_per_step == 0.0 {
        return frame.step_length;
    }
    return frame.voxels_per_step / length(ray.direction);
}

fn position(ray: Ray, t: f32) -> vec3f {
    return ray.point + t * ray.direction;
}

// The axes along which a direction does not go: over the length of any volume it moves by less than rounding does. Relative
// to the others, for directions are as long as there are voxels to a world unit.
fn parallel_axes(direction: vec3f) -> vec3<bool> {
    let along = abs(direction);
    return along <= vec3f(1e-9 * max(along.x, max(along.y, along.z)));
}

// A distance after t that is `voxels` further along the axis that the ray follows most, and further than rounding in any
// case: loops that step by it end.
fn past(ray: Ray, t: f32, voxels: f32) -> f32 {
    let along = abs(ray.direction);
    return t + max(voxels / max(along.x, max(along.y, along.z)), 4e-7 * abs(t));
}

// Where the ray is inside the volume's box, not before its origin: (t_near, t_far); empty unless near < far.
fn box_range(ray: Ray) -> vec2f {
    let zero = parallel_axes(ray.direction);
    // A ray along a face is either between the two planes of an axis or it never is.
    let outside = zero & ((ray.point < vec3f(0.0)) | (ray.point > frame.extent));
    if any(outside) {
        return vec2f(0.0);
    }
    let a = (vec3f(0.0) - ray.point) * ray.inverse;
    let b = (frame.extent - ray.point) * ray.inverse;
    let near = select(min(a, b), vec3f(-1e30), zero);
    let far = select(max(a, b), vec3f(1e30), zero);
    return vec2f(max(max(near.x, near.y), max(near.z, -ray.base)), min(far.x, min(far.y, far.z)));
}
