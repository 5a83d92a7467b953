// What all pixels of a sweep share. The host's side is `SweepUniforms` in clipping/sweep.rs; a test holds the two against
// each other.

struct SweepSettings {
    // The first pixel of this dispatch.
    first_pixel: vec2u,
    // Pixels of a row of this dispatch.
    width: u32,
    leaf_count: u32,
    gate_count: u32,
    // 1: what is outside all objects is kept.
    keeps_outside: u32,
    // Events nearer to each other are one, in world units.
    tolerance: f32,
    // Segments of a ray that are used, and 1 where the last of them goes on to the backmost end.
    segment_limit: u32,
    backmost: u32,
    // Segments that fit in the list.
    segment_capacity: u32,
    reserved: vec2u,
}

@group(1) @binding(0) var<uniform> sweep: SweepSettings;
