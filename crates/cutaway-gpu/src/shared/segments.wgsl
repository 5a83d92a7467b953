// What clipping leaves of a pixel's ray: segments, ascending and disjoint, each with the surface that it begins at.

import package::shared::frame::frame;

struct Segment {
    t_near: f32,
    t_far: f32,
    // Of the surface at the near end: out of what is kept, so against the ray. Zero where no surface is.
    normal: vec3f,
}

// Of each pixel, row by row: where its segments begin in the list, and how many there are.
@group(1) @binding(1) var<storage, read> segment_ranges: array<vec2u>;
// t_near, t_far (as f32 bits), the normal in octahedral form (two 16-bit snorm), and 1 where there is a surface.
@group(1) @binding(2) var<storage, read> segment_list: array<vec4u>;

// Rays are clipped.
override CLIPPED: bool = false;

fn octahedral_normal(packed: u32) -> vec3f {
    let e = unpack2x16snorm(packed);
    var n = vec3f(e, 1.0 - abs(e.x) - abs(e.y));
    let fold = max(-n.z, 0.0);
    n.x += select(fold, -fold, n.x >= 0.0);
    n.y += select(fold, -fold, n.y >= 0.0);
    return normalize(n);
}

fn segment_count(pixel: vec2u) -> u32 {
    return segment_ranges[pixel.y * frame.resolution.x + pixel.x].y;
}

fn segment(pixel: vec2u, index: u32) -> Segment {
    let words = segment_list[segment_ranges[pixel.y * frame.resolution.x + pixel.x].x + index];
    let normal = select(vec3f(0.0), octahedral_normal(words.z), words.w == 1u);
    return Segment(bitcast<f32>(words.x), bitcast<f32>(words.y), normal);
}
