// Event lists: every triangle of a mesh, front or back, near or far, adds a node to the list of each pixel that it covers.
//
// Which pixels a triangle covers, and which side of it is seen there, is up to the rasteriser: neighbours share their edges'
// rounded ends, so that on a closed mesh each pixel has as many fronts as backs, whatever was rounded. Only where along the
// ray that is, is computed here, from the triangle's plane and the ray itself.

import package::clipping::leaf::{direction_in_object, first_at, leaves, normal_in_world};
import package::clipping::mesh::{Corner, corner_of, crossing_of};
import package::clipping::octahedral::octahedral_packed;
import package::shared::frame::frame;
import package::shared::ray::ray_of;

@group(3) @binding(0) var<storage, read_write> heads: array<atomic<u32>>;
@group(3) @binding(1) var<storage, read_write> nodes: array<vec4u>;
@group(3) @binding(2) var<storage, read_write> node_count: atomic<u32>;

// The instance is the object.
@vertex
fn mesh_corner(@builtin(vertex_index) corner: u32, @builtin(instance_index) leaf: u32) -> Corner {
    return corner_of(corner, leaf);
}

@fragment
fn add_node(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let pixel = floor(corner.position.xy);
    let place = vec2u(pixel);
    let ray = ray_of(pixel);
    let leaf = corner.leaf;
    let t = crossing_of(corner, first_at(leaf, pixel), direction_in_object(leaf, ray));
    let normal = octahedral_packed(normal_in_world(leaf, corner.normal));
    let index = atomicAdd(&node_count, 1u);
    // What does not fit is counted, for the host to make room.
    if index < arrayLength(&nodes) {
        let next = atomicExchange(&heads[place.y * frame.resolution.x + place.x], index + 1u);
        let entering = front != (leaves[leaf].mirrored == 1u);
        nodes[index] = vec4u(next, bitcast<u32>(t), normal, 2u * leaf + select(0u, 1u, entering));
    }
    return vec4f(0.0);
}
