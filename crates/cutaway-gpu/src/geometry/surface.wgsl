// Opaque triangles: what the eye sees of them, and how far along its ray.

import package::proxy::view::{distance_along, view};
import package::shared::frame::frame;
import package::shared::ray::ray_of;

struct Paint {
    // Straight.
    color: vec3f,
    // 1: lit from the eye.
    lit: u32,
    // A world distance that depths are scaled by.
    depth_unit: f32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(1) @binding(1) var<uniform> paint: Paint;

struct SurfacePoint {
    @builtin(position) clip: vec4f,
    @location(0) voxel: vec3f,
}

struct Seen {
    @location(0) color: vec4f,
    // From the eye, in the world.
    @location(1) eye_distance: f32,
    @builtin(frag_depth) depth: f32,
}

@vertex
fn surface_corner(@location(0) voxel: vec3f) -> SurfacePoint {
    return SurfacePoint(view.clip_from_voxel * vec4f(voxel, 1.0), voxel);
}

fn in_world(way: vec3f) -> vec3f {
    return view.world_from_voxel_x * way.x + view.world_from_voxel_y * way.y + view.world_from_voxel_z * way.z;
}

@fragment
fn surface_color(point: SurfacePoint) -> Seen {
    let across = in_world(dpdx(point.voxel));
    let down = in_world(dpdy(point.voxel));
    let ray = ray_of(floor(point.clip.xy));
    let eye_distance = max(distance_along(ray, point.voxel) + ray.base, 0.0);
    var light = 1.0;
    if paint.lit == 1u {
        let normal = cross(across, down);
        let far = length(normal);
        let cosine = select(abs(dot(normal, ray.direction_in_world)) / far, 1.0, far == 0.0);
        light = frame.ambient + frame.diffuse * cosine;
    }
    return Seen(vec4f(paint.color * light, 1.0), eye_distance, eye_distance / (eye_distance + paint.depth_unit));
}
