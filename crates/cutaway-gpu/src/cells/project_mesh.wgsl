// Projects the points of a mesh, then its tetrahedra, and gives each a key to sort it by.

import package::cells::pieces::any_visible;
import package::cells::record::{Record, middle_gradient, record_of};
import package::cells::view::{bins_of, covers_a_centre, projected, view};

// The host's side is `MeshTask` in cells/mesh.rs.
struct MeshTask {
    // The first point or tetrahedron of this dispatch, and the end.
    first: u32,
    end: u32,
    // Depths from the nearest to the farthest that a point may have.
    depth_least: f32,
    depth_scale: f32,
}

@group(1) @binding(0) var<uniform> task: MeshTask;
// Gradient (value range per world unit, as grids have it) and value, in bins.
@group(1) @binding(1) var<storage, read> attributes: array<vec4f>;
// Points in the world, from the mesh's middle.
@group(1) @binding(2) var<storage, read> places: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> points: array<vec4f>;
@group(1) @binding(4) var<storage, read> cells: array<vec4u>;
@group(1) @binding(5) var<storage, read_write> records: array<Record>;
// Ascending from back to front; what is not drawn comes last.
@group(1) @binding(6) var<storage, read_write> keys: array<vec2u>;

@compute @workgroup_size(64)
fn project_points(@builtin(global_invocation_id) id: vec3u) {
    let index = task.first + id.x;
    if index < task.end {
        points[index] = projected(places[index].xyz);
    }
}

const NOT_DRAWN = 0xffffffu;

@compute @workgroup_size(64)
fn project_tetrahedra(@builtin(global_invocation_id) id: vec3u) {
    let index = task.first + id.x;
    if index >= task.end {
        return;
    }
    let cell = cells[index];
    var p: array<vec4f, 4>;
    var g: array<vec3f, 4>;
    var s: vec4f;
    for (var k = 0u; k < 4u; k += 1u) {
        p[k] = points[cell[k]];
        g[k] = attributes[cell[k]].xyz;
        s[k] = attributes[cell[k]].w;
    }
    let low = min(min(p[0], p[1]), min(p[2], p[3]));
    let high = max(max(p[0], p[1]), max(p[2], p[3]));
    let least = min(min(s.x, s.y), min(s.z, s.w));
    let most = max(max(s.x, s.y), max(s.z, s.w));
    let visible = (view.draw_all == 1u) || any_visible(least, most);
    if !visible || (low.w <= 0.0) || !covers_a_centre(low.xy, high.xy) {
        keys[index] = vec2u(NOT_DRAWN, index);
        return;
    }
    var record = record_of(p, s, cell, view.inverse);
    record.gradient = middle_gradient(p, g);
    records[index] = record;
    var depth = 0.0;
    for (var k = 0u; k < 4u; k += 1u) {
        depth += 0.25 * p[k].z / (1.0 - p[k].z * view.inverse);
    }
    let nearness = 1.0 - saturate((depth - task.depth_least) * task.depth_scale);
    keys[index] = vec2u(min(u32(nearness * 16777215.0), NOT_DRAWN - 1u), index);
}
