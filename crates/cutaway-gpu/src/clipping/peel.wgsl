// Depth peeling (Termeer 3.2.4, after Everitt 2001): the front faces of a mesh, or its back faces, one layer after another,
// nearest first. A pass keeps of each pixel the nearest fragment behind what the pass before it kept.
//
// Only crossings within the volume are layers. Those before and behind it are summed up, in `count_ends`: all that matters of
// them is what a ray is inside of where it enters the volume and where it leaves it. So the first of N layers is the first
// that shows, wherever the eye is and however much of a mesh lies outside the volume.
//
// Order is that of (depth, triangle): of coincident triangles each has a layer of its own.

import package::clipping::leaf::{direction_in_object, first_at, leaves, normal_in_world};
import package::clipping::mesh::{Corner, corner_of, crossing_of};
import package::clipping::octahedral::octahedral_point;
import package::shared::ray::{Ray, box_range, ray_of};

// The layer before: its depth, 0 where there is none, and its triangle.
@group(3) @binding(0) var previous_depth: texture_2d<f32>;
@group(3) @binding(1) var previous_triangle: texture_2d<u32>;

// Layers are in half precision: t is kept as a place between the ends of the volume.
override HALF: bool = false;

struct Peeled {
    // t, the octahedral point of the outward normal, and 1.
    @location(0) layer: vec4f,
    @location(1) triangle: u32,
    @builtin(frag_depth) depth: f32,
}

@vertex
fn peeled_corner(@builtin(vertex_index) corner: u32, @builtin(instance_index) leaf: u32) -> Corner {
    return corner_of(corner, leaf);
}

// Where a fragment's ray crosses its triangle, then the ends of the volume.
fn crossing_in_range(corner: Corner, pixel: vec2f, ray: Ray) -> vec3f {
    let t = crossing_of(corner, first_at(corner.leaf, pixel), direction_in_object(corner.leaf, ray));
    return vec3f(t, box_range(ray));
}

// Where t is between the ends of the volume, above 0 and at most 1/2: apart from 0, where nothing is before, and from 1, where
// nothing is behind. Rounding keeps the order, and that is all that counts.
fn depth_of(t: f32, range: vec2f) -> f32 {
    return clamp(0.5 * (t - range.x) / (range.y - range.x), 1e-30, 0.5);
}

@fragment
fn peel_fragment(corner: Corner) -> Peeled {
    let pixel = floor(corner.position.xy);
    let ray = ray_of(pixel);
    let found = crossing_in_range(corner, pixel, ray);
    let t = found.x;
    let range = found.yz;
    if (t <= range.x) || (t >= range.y) {
        discard;
    }
    let depth = depth_of(t, range);
    let before = textureLoad(previous_depth, vec2i(pixel), 0).x;
    if depth < before {
        discard;
    }
    if (depth == before) && (corner.triangle < textureLoad(previous_triangle, vec2i(pixel), 0).x) {
        discard;
    }
    let normal = octahedral_point(normal_in_world(corner.leaf, corner.normal));
    let place = select(t, 4.0 * depth - 1.0, HALF);
    return Peeled(vec4f(place, normal, 1.0), corner.triangle + 1u, depth);
}

// How often the ray is inside the mesh where it enters the volume, and where it leaves it: sums of these, by blending.
@fragment
fn count_ends(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec2f {
    let pixel = floor(corner.position.xy);
    let ray = ray_of(pixel);
    let found = crossing_in_range(corner, pixel, ray);
    let t = found.x;
    let range = found.yz;
    if (t > range.x) && (t < range.y) {
        discard;
    }
    let entering = front != (leaves[corner.leaf].mirrored == 1u);
    let sign = select(-1.0, 1.0, entering);
    // Behind the volume's end the winding number comes to 0: what follows is what is missing there.
    return select(vec2f(0.0, -sign), vec2f(sign, 0.0), t <= range.x);
}
