// What an adapter's own trilinear filter makes of a few voxels, at many places between them.

@group(0) @binding(0) var filtered_voxels: texture_3d<f32>;
@group(0) @binding(1) var filter_sampler: sampler;
// Texture coordinates.
@group(0) @binding(2) var<storage, read> filter_places: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> filter_values: array<f32>;

@compute @workgroup_size(64)
fn filter_at_places(@builtin(global_invocation_id) id: vec3u) {
    filter_values[id.x] = textureSampleLevel(filtered_voxels, filter_sampler, filter_places[id.x].xyz, 0.0).x;
}
