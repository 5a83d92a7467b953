// What all rays of a frame share. The host's side is `FrameUniforms` in frame/uniforms.rs; a test holds the two against
// each other. A value that is an affine function of the pixel is `first + x * per_x + y * per_y`.

struct Frame {
    // Point of a pixel's ray near the middle of the volume, in voxel space.
    point_first: vec3f,
    // World length of the step that tables are made for; where `voxels_per_step` is 0, of every step.
    step_length: f32,
    point_per_x: vec3f,
    // World distance from a ray's origin to its point, where rays are parallel.
    base_distance: f32,
    point_per_y: vec3f,
    // Transmittance below which a ray ends.
    opaque_below: f32,
    // From the eye to the same point, in world units; where rays are parallel, their direction.
    direction_first: vec3f,
    // Gradients shorter than this vanish.
    vanishing: f32,
    direction_per_x: vec3f,
    ambient: f32,
    direction_per_y: vec3f,
    diffuse: f32,
    voxel_from_world_x: vec3f,
    specular: f32,
    voxel_from_world_y: vec3f,
    specular_power: f32,
    voxel_from_world_z: vec3f,
    wrap_power: f32,
    // The gradient of a difference in texels over two voxels, as the value range per largest spacing: columns of a matrix.
    gradient_from_texel_x: vec3f,
    // Means of the light's curves over all directions.
    mean_diffuse: f32,
    gradient_from_texel_y: vec3f,
    mean_specular: f32,
    gradient_from_texel_z: vec3f,
    iso_opacity: f32,
    // Towards the light, in the world.
    light: vec3f,
    // 1: the light is where the eye is.
    headlight: u32,
    // The far corner of the volume's box in voxel space.
    extent: vec3f,
    // 1: rays are parallel.
    parallel: u32,
    // Entry of the classification table: (texel - offset) * scale + 0.5, truncated.
    table_offset: f32,
    table_scale: f32,
    table_last: u32,
    // Isosurfaces; they stand behind the table's entries: colour and level, ascending.
    iso_count: u32,
    // Blocks along each axis, and cells along an edge of one.
    blocks: vec3u,
    block_edge: f32,
    // The same of coarse blocks, which are made of whole blocks.
    coarse_blocks: vec3u,
    coarse_edge: f32,
    // Depth below a clip surface that its normal lights, in world units; 0: none.
    impregnation_depth: f32,
    // 1 step, 2 linear.
    impregnation: u32,
    // Opacity of clip surfaces.
    overlay: f32,
    // 1: isosurfaces that are cut open are closed by the cut.
    cap: u32,
    // Pixels of the image that is drawn.
    resolution: vec2u,
    // Pre-integration: the map from texels to bins.
    bins_offset: f32,
    bins_scale: f32,
    bins_last: u32,
    // Nodes along a side of the pre-integration table.
    nodes: u32,
    // -1: greater texels are lesser values.
    value_sign: f32,
    // Differences of opacity and colour from which on a step is cut into finer ones.
    adaptive_threshold: f32,
    // Ranges of blocks are in 65535ths: (texel - first) * scale.
    range_first: f32,
    range_scale: f32,
    // One over the edges of blocks and of coarse blocks.
    per_block_edge: f32,
    per_coarse_edge: f32,
    // One over the volume's voxels along each axis.
    per_voxels: vec3f,
    // Voxels along the ray from sample to sample, where spacings differ; 0 where they are equal.
    voxels_per_step: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
