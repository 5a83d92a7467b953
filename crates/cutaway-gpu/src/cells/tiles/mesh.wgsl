// Finds in which order a mesh's tetrahedra are drawn, and what is drawn of them.

import package::cells::tiles::keep::{keep, task};
import package::cells::tiles::record::{before_division, bounds_of, cell_of, has_a_centre};

@group(1) @binding(3) var<storage, read> cells: array<vec4u>;
// Points in the world, from the mesh's middle, and values in bins.
@group(1) @binding(4) var<storage, read> places: array<vec4f>;
@group(1) @binding(5) var<storage, read> order: array<u32>;

@compute @workgroup_size(16)
fn keep_mesh(@builtin(global_invocation_id) id: vec3u) {
    let run = id.x;
    if run >= task.runs {
        return;
    }
    let end = min((run + 1u) * task.run, task.count);
    for (var i = run * task.run; i < end; i += 1u) {
        let cell = cells[order[task.total - 1u - task.first - i]];
        var p: array<vec3f, 4>;
        var s: vec4f;
        for (var k = 0u; k < 4u; k += 1u) {
            let point = places[cell[k]];
            p[k] = before_division(point.xyz);
            s[k] = point.w;
        }
        keep(i, run, cell_of(p, s));
    }
}

// Ascending from back to front; what is not drawn comes last.
@group(1) @binding(6) var<storage, read_write> keys: array<vec2u>;

// As `MeshTask` in `project_mesh.wgsl`.
struct MeshSpan {
    first: u32,
    end: u32,
    depth_least: f32,
    depth_scale: f32,
}

@group(1) @binding(7) var<uniform> span: MeshSpan;
// The tetrahedra that the transfer function shows anything of.
@group(1) @binding(8) var<storage, read> visible: array<u32>;

const NOT_DRAWN = 0xffffffu;

// Gives each visible tetrahedron a key to sort it by.
@compute @workgroup_size(64)
fn key_mesh(@builtin(global_invocation_id) id: vec3u) {
    let place = span.first + id.x;
    if place >= span.end {
        return;
    }
    let index = visible[place];
    let cell = cells[index];
    var p: array<vec3f, 4>;
    for (var k = 0u; k < 4u; k += 1u) {
        p[k] = before_division(places[cell[k]].xyz);
    }
    let depth = 0.25 * (p[0].z + p[1].z + (p[2].z + p[3].z));
    let nearness = 1.0 - saturate((depth - span.depth_least) * span.depth_scale);
    let key = min(u32(nearness * 16777215.0), NOT_DRAWN - 1u);
    keys[place] = vec2u(select(NOT_DRAWN, key, has_a_centre(bounds_of(p))), index);
}
