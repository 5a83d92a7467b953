// Where the proxy's quads lie in the image, and how far along the rays.

import package::shared::frame::frame;
import package::shared::ray::{Ray, ray_of};

struct ProxyView {
    clip_from_voxel: mat4x4f,
    // Linear part of world_from_voxel, by columns.
    world_from_voxel_x: vec3f,
    // World distance that stretches are longer at both ends than what is measured.
    slack: f32,
    world_from_voxel_y: vec3f,
    // Distances are kept in units of this.
    distance_unit: f32,
    world_from_voxel_z: vec3f,
    // Share of a kept distance that its format may lose.
    rounding: f32,
    // Voxels, along each axis, that quads are moved outward.
    margin: vec3f,
    // Voxels along an edge of a unit.
    unit_edge: f32,
    // Of a wireframe; straight.
    line_color: vec3f,
    // 1: voxel space is mirrored in the world.
    mirrored: u32,
}

// Group 0 has the frame; see shared/frame.wgsl.
@group(1) @binding(0) var<uniform> view: ProxyView;
// See `quads` in cells.wgsl.
@group(1) @binding(1) var<storage, read> proxy_quads: array<vec4u>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) voxel: vec3f,
}

fn unpacked(word: u32) -> vec3f {
    return vec3f(vec3u(extractBits(word, 0u, 10u), extractBits(word, 10u, 10u), extractBits(word, 20u, 10u)));
}

// Corner 0 to 3 of a quad: bit 0 along the axis after that of its normal, bit 1 along the one after.
fn quad_corner(quad: vec4u, corner: u32) -> Corner {
    let axis = quad.x >> 30u;
    let least = min(unpacked(quad.x) * view.unit_edge, frame.extent);
    let greatest = min(unpacked(quad.y) * view.unit_edge, frame.extent);
    var high = vec3<bool>(false);
    high[axis] = (quad.y >> 30u) == 1u;
    high[(axis + 1u) % 3u] = (corner & 1u) == 1u;
    high[(axis + 2u) % 3u] = (corner >> 1u) == 1u;
    let code = extractBits(quad.z, 6u * corner, 6u);
    let ways = vec3f(vec3u(extractBits(code, 0u, 2u), extractBits(code, 2u, 2u), extractBits(code, 4u, 2u))) - 1.0;
    let voxel = select(least, greatest, high) + ways * view.margin;
    return Corner(view.clip_from_voxel * vec4f(voxel, 1.0), voxel);
}

@vertex
fn triangle_corner(@builtin(vertex_index) index: u32) -> Corner {
    let quad = proxy_quads[index / 6u];
    // Anti-clockwise seen from where the normal points, if that is up its axis and the world is not mirrored.
    var corners = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u);
    var turned = array<u32, 6>(0u, 2u, 1u, 1u, 2u, 3u);
    let along = (quad.y >> 30u) ^ view.mirrored;
    return quad_corner(quad, select(turned[index % 6u], corners[index % 6u], along == 1u));
}

@vertex
fn edge_end(@builtin(vertex_index) index: u32) -> Corner {
    var corners = array<u32, 8>(0u, 1u, 1u, 3u, 3u, 2u, 2u, 0u);
    return quad_corner(proxy_quads[index / 8u], corners[index % 8u]);
}

// Distance along a pixel's ray of the point that was drawn there: that of the ray's point nearest to it. The rasteriser has
// moved it sideways by a fraction of a pixel, which does not change this distance; that to the quad's plane it would, without
// bound where the ray grazes it.
fn distance_along(ray: Ray, voxel: vec3f) -> f32 {
    let way = voxel - ray.point;
    let way_in_world =
        view.world_from_voxel_x * way.x + view.world_from_voxel_y * way.y + view.world_from_voxel_z * way.z;
    return dot(way_in_world, ray.direction_in_world);
}

// A number not above t in the format that it is kept in.
fn kept_below(t: f32) -> f32 {
    let kept = (t - view.slack) / view.distance_unit;
    return kept - (abs(kept) * view.rounding + 1e-6 * sign(view.rounding));
}

// Blended by minimum: nearest distance, farthest one negated. Blended by sum: how many of the proxy's solids the ray begins
// in, for it leaves one more than it enters of each of those.
@fragment
fn blended_distances(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let ray = ray_of(floor(corner.clip.xy));
    let t = distance_along(ray, corner.voxel);
    return vec4f(kept_below(t), kept_below(-t), 0.0, select(1.0, -1.0, front));
}

struct Sorted {
    @location(0) t: f32,
    @builtin(frag_depth) depth: f32,
}

// For a depth test, which needs only order.
@fragment
fn sorted_distance(corner: Corner) -> Sorted {
    let ray = ray_of(floor(corner.clip.xy));
    let t = distance_along(ray, corner.voxel);
    return Sorted(t, clamp(0.5 + 0.5 * t / view.distance_unit, 0.0, 1.0));
}

@group(1) @binding(2) var image_depth: texture_2d<f32>;

// A wireframe's line, where the image does not hide it.
@fragment
fn line(corner: Corner) -> @location(0) vec4f {
    let at = floor(corner.clip.xy);
    let ray = ray_of(at);
    let t = distance_along(ray, corner.voxel);
    if t - view.slack + ray.base > textureLoad(image_depth, vec2u(at), 0).x {
        discard;
    }
    return vec4f(view.line_color, 1.0);
}
