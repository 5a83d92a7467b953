// A mesh under the camera: its corners as the rasteriser takes them, and where a pixel's ray crosses a triangle.

import package::clipping::leaf::leaves;
import package::clipping::octahedral::octahedral_unpacked;

// Of the mesh: x, y, z of each vertex from the object's middle; three vertices a triangle; the normal at each corner of each
// triangle, octahedral.
@group(2) @binding(0) var<storage, read> mesh_positions: array<f32>;
@group(2) @binding(1) var<storage, read> mesh_triangles: array<u32>;
@group(2) @binding(2) var<storage, read> mesh_normals: array<u32>;

struct Corner {
    @invariant @builtin(position) position: vec4f,
    // Corners of the triangle in object space.
    @location(0) @interpolate(flat) a: vec3f,
    @location(1) @interpolate(flat) b: vec3f,
    @location(2) @interpolate(flat) c: vec3f,
    @location(3) normal: vec3f,
    @location(4) @interpolate(flat) leaf: u32,
    @location(5) @interpolate(flat) triangle: u32,
}

fn mesh_position(vertex: u32) -> vec3f {
    return vec3f(mesh_positions[3u * vertex], mesh_positions[3u * vertex + 1u], mesh_positions[3u * vertex + 2u]);
}

// A corner of the object `leaf`, three to a triangle.
fn corner_of(corner: u32, leaf: u32) -> Corner {
    let first = corner - corner % 3u;
    let own = vec4f(mesh_position(mesh_triangles[corner]), 1.0);
    let at = vec4f(
        dot(leaves[leaf].clip_x, own),
        dot(leaves[leaf].clip_y, own),
        dot(leaves[leaf].clip_z, own),
        dot(leaves[leaf].clip_w, own),
    );
    return Corner(
        at,
        mesh_position(mesh_triangles[first]),
        mesh_position(mesh_triangles[first + 1u]),
        mesh_position(mesh_triangles[first + 2u]),
        octahedral_unpacked(mesh_normals[corner]),
        leaf,
        corner / 3u,
    );
}

// Where a ray crosses a triangle that it is known to cross: on its plane, and, of triangles seen nearly edge-on, not beyond
// its corners. A corner's place along the ray is where a plane across the ray holds it; the crossing, a mean of the corners,
// has a mean of their places.
fn crossing_of(corner: Corner, point: vec3f, direction: vec3f) -> f32 {
    let a = corner.a - point;
    let b = corner.b - point;
    let c = corner.c - point;
    let square = dot(direction, direction);
    let places = vec3f(dot(a, direction), dot(b, direction), dot(c, direction)) / square;
    let nearest = min(places.x, min(places.y, places.z));
    let farthest = max(places.x, max(places.y, places.z));
    // Of the corners as they are: differences of what has been moved by the point would be rounded as the point is.
    let normal = cross(corner.b - corner.a, corner.c - corner.a);
    let slope = dot(normal, direction);
    let on_plane = dot(normal, a) / select(slope, 1.0, slope == 0.0);
    return clamp(select(on_plane, nearest, slope == 0.0), nearest, farthest);
}
