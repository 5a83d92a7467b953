// Volumes in bricks: where a position of the volume lies in the atlas. A brick holds BRICK_EDGE cells along an edge, so one
// voxel more, and a voxel around them: whatever is interpolated in a brick, and whatever differences are taken there, comes
// from the brick alone. A brick of a coarser level has as many texels and stretches over twice as many cells a level.

import package::shared::frame::frame;

// The volume is in bricks.
override BRICKED: bool = false;
// Cells along an edge of a brick of the finest level; a power of two.
override BRICK_EDGE: u32 = 32u;

// Of each brick of the finest level: its slot along x, y, z in 10 bits each with the highest bit set, and its level; or, if
// it is not there, 0 and the texel that stands for all of it, which classification makes invisible.
@group(0) @binding(5) var pages: texture_3d<u32>;

struct Place {
    resident: bool,
    // Where it is not resident.
    value: f32,
    // Of a voxel, in the brick.
    texels: f32,
    // The texel of the brick's first voxel.
    first: vec3i,
    // From there, in texels.
    local: vec3f,
}

// The brick of a position, which is clamped to the volume, and where it lies in there.
fn place_of(p: vec3f) -> Place {
    let inside = clamp(p, vec3f(0.0), frame.extent);
    let page = min(vec3u(inside) / BRICK_EDGE, textureDimensions(pages) - 1u);
    let entry = textureLoad(pages, page, 0).xy;
    if entry.x == 0u {
        return Place(false, bitcast<f32>(entry.y), 1.0, vec3i(0), vec3f(0.0));
    }
    let slot = vec3u(extractBits(entry.x, 0u, 10u), extractBits(entry.x, 10u, 10u), extractBits(entry.x, 20u, 10u));
    let level = entry.y;
    let texels = 1.0 / f32(1u << level);
    let corner = vec3f((page >> vec3u(level)) * (BRICK_EDGE << level));
    return Place(true, 0.0, texels, vec3i(slot * (BRICK_EDGE + 3u)) + 1, (inside - corner) * texels);
}
