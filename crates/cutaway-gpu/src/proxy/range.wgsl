// What a ray has to look at, in one texture for the ray caster: from the proxy's distances, in whichever way they were found,
// and from opaque geometry.

import package::shared::ray::{Ray, ray_of};

struct Limits {
    // World distance that kept distances are in units of.
    distance_unit: f32,
    // World distance that distances found by depth tests are widened by.
    slack: f32,
    // 1: there is opaque geometry.
    opaque: u32,
    // Where no quad was drawn, kept distances are above this.
    nothing_above: f32,
    // Cells along each axis, and voxels along an edge of one.
    cells: vec3u,
    cell_edge: f32,
}

@group(1) @binding(0) var<uniform> limits: Limits;
// World distance from the eye of opaque geometry along the ray.
@group(1) @binding(1) var opaque_distance: texture_2d<f32>;
// See `blended_distances`; or, of depth tests, the nearest distance.
@group(1) @binding(2) var nearest: texture_2d<f32>;
// Of depth tests: the farthest distance, and in how many solids the ray begins.
@group(1) @binding(3) var farthest: texture_2d<f32>;
@group(1) @binding(4) var inside: texture_2d<u32>;
// See `boxes` in cells.wgsl.
@group(1) @binding(5) var<storage, read> cell_boxes: array<vec2u>;

const FAR_AWAY = 1e30;

@vertex
fn whole_range(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// Where opaque geometry ends the ray.
fn end_of(place: vec2u) -> f32 {
    if limits.opaque == 0u {
        return FAR_AWAY;
    }
    let eye_distance = textureLoad(opaque_distance, place, 0).x;
    return select(FAR_AWAY, eye_distance - ray_of(vec2f(place)).base, eye_distance < FAR_AWAY);
}

// Whether the ray begins in an occupied cell. Where only cells at a boundary are drawn, it may begin amid them, in none.
fn begins_in_cell(ray: Ray) -> bool {
    let at = floor((ray.point - ray.base * ray.direction) / limits.cell_edge);
    if any(at < vec3f(0.0)) || any(at >= vec3f(limits.cells)) {
        return false;
    }
    let cell = vec3u(at);
    return cell_boxes[(cell.z * limits.cells.y + cell.y) * limits.cells.x + cell.x].y != 0u;
}

fn range_of(place: vec2u, drawn: bool, near: f32, far_negated: f32, inside_count: f32) -> vec4f {
    let begins = inside_count > 0.5 || begins_in_cell(ray_of(vec2f(place)));
    // A ray that begins inside leaves it somewhere.
    if !drawn {
        return vec4f(FAR_AWAY, FAR_AWAY, end_of(place), 0.0);
    }
    return vec4f(select(near, -FAR_AWAY, begins), far_negated, end_of(place), 0.0);
}

// Where the proxy is all of the volume.
@fragment
fn range_of_all(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(-FAR_AWAY, -FAR_AWAY, end_of(vec2u(at.xy)), 0.0);
}

@fragment
fn range_of_blended(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let place = vec2u(at.xy);
    let found = textureLoad(nearest, place, 0);
    let t = found.xy * limits.distance_unit;
    return range_of(place, found.x < limits.nothing_above, t.x, t.y, found.w);
}

@fragment
fn range_of_sorted(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let place = vec2u(at.xy);
    let near = textureLoad(nearest, place, 0).x;
    let far = textureLoad(farthest, place, 0).x;
    let solids = f32(textureLoad(inside, place, 0).x);
    return range_of(place, near < limits.nothing_above, near - limits.slack, -far - limits.slack, solids);
}
