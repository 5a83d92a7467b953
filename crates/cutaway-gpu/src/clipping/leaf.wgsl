// The objects of a clip expression as the shaders see them. The host's side is `Leaf` in clipping/leaf.rs; a test holds
// the two against each other. Objects have their own space; the point of a pixel's ray there is an affine function of the
// pixel, computed in f64, so that f32 holds what is left after all large numbers have cancelled.

import package::shared::frame::frame;
import package::shared::ray::Ray;

struct Leaf {
    // Columns of the linear part of object_from_world.
    linear_x: vec3f,
    // MESH, PLANE, BOX or BALL.
    kind: u32,
    linear_y: vec3f,
    // How many times the eye is inside a mesh; 0 where rays are parallel, and of other kinds.
    eye_winding: i32,
    linear_z: vec3f,
    // 1: the gate is told of its outside.
    inverted: u32,
    // At pixel (0, 0). Of a mesh and a ball: the ray's point, from the object's middle and in units of its size (of a ball:
    // its radius), which are those of all their numbers. Of a plane: x is the way from the point to the plane. Of a box: the
    // ways from the point to the faces of small coordinates.
    first: vec3f,
    // 1: the pose mirrors.
    mirrored: u32,
    // What a pixel to the right, and one below, adds to `first` and `second`.
    per_x: vec3f,
    // Where its inside goes: a gate, or ROOT.
    output: u32,
    per_y: vec3f,
    // 1: its surface is not to be seen, it only takes away.
    bare: u32,
    // Of a box: the ways to the faces of large coordinates.
    second: vec3f,
    reserved_second: u32,
    // Of a mesh: rows of clip_from_object; z is clip_w - (0, 0, 0, near).
    clip_x: vec4f,
    clip_y: vec4f,
    clip_z: vec4f,
    clip_w: vec4f,
}

const MESH = 0u;
const PLANE = 1u;
const BOX = 2u;
const BALL = 3u;

@group(1) @binding(1) var<storage, read> leaves: array<Leaf>;

fn first_at(leaf: u32, pixel: vec2f) -> vec3f {
    return leaves[leaf].first + pixel.x * leaves[leaf].per_x + pixel.y * leaves[leaf].per_y;
}

fn second_at(leaf: u32, pixel: vec2f) -> vec3f {
    return leaves[leaf].second + pixel.x * leaves[leaf].per_x + pixel.y * leaves[leaf].per_y;
}

fn direction_in_object(leaf: u32, ray: Ray) -> vec3f {
    let d = ray.direction_in_world;
    return leaves[leaf].linear_x * d.x + leaves[leaf].linear_y * d.y + leaves[leaf].linear_z * d.z;
}

// A normal of the object in the world, of unit length: normals go by the transpose of the inverse.
fn normal_in_world(leaf: u32, n: vec3f) -> vec3f {
    let m = mat3x3f(leaves[leaf].linear_x, leaves[leaf].linear_y, leaves[leaf].linear_z);
    let world = n * m;
    // Lengths of poses vary by many orders of magnitude: no square may leave what f32 holds.
    let largest = max(abs(world.x), max(abs(world.y), abs(world.z)));
    if largest == 0.0 {
        return vec3f(0.0, 0.0, 1.0);
    }
    return normalize(world / largest);
}
