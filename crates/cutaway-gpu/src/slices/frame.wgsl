// What the slices of a frame share, and its bricks. The host's side is `planes.rs`; tests hold the two against each other.

struct SliceFrame {
    clip_from_voxel: mat4x4f,
    // The planes' normal in voxel space: how much the depth grows a voxel along each axis.
    normal: vec3f,
    // dot(normal, p) of points at the depth of the rays' points (see `shared/ray.wgsl`), from which depths are counted.
    offset: f32,
    // Voxels, along each axis, by which a brick is drawn larger: to cover the pixels of its border,
    narrow_margin: vec3f,
    // Depth from plane to plane; the slab of a plane reaches half of that to either side.
    spacing: f32,
    // and also those whose slabs are cut, so that what is left of them has its middle beside the plane.
    wide_margin: vec3f,
    // Depth of the nearest plane.
    first_depth: f32,
    // Of the corner of boxes that is nearest along the normal; see `intersection.wgsl`.
    sequence: u32,
    // The index of the farthest plane, which is drawn first.
    last_plane: u32,
    // 1: the greatest texel is looked for, -1: the least.
    kind: f32,
    // Lengths are added up in units of this.
    length_unit: f32,
}

struct Brick {
    // In voxels.
    origin: vec3f,
    // Cells along an edge.
    edge: f32,
    // 1: slabs may be cut here, by the volume's box or by clipping.
    cut: u32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(3) @binding(0) var<uniform> slices: SliceFrame;
