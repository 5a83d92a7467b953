// From what slices were blended into to the image: a fragment a pixel.

import package::shared::classification::classified;
import package::shared::face::face_of;
import package::shared::frame::frame;
import package::shared::lighting::lit;
import package::shared::ray::{NO_DEPTH, box_range, ray_of};
import package::shared::segments::{CLIPPED, segment, segment_count};
import package::slices::frame::slices;

// 0 composite, 1 extreme values, 2 means.
override KIND: u32 = 0u;
// Clip surfaces are lit, in every mode.
override FACES_LIT: bool = true;

@group(3) @binding(1) var blended: texture_2d<f32>;
@group(3) @binding(2) var blended_distance: texture_2d<f32>;

struct Developed {
    // Premultiplied.
    @location(0) color: vec4f,
    // World distance from the eye; 1e30 where nothing is.
    @location(1) depth: f32,
    // As `packed_counts`: one value taken where anything is.
    @location(2) counts: vec2u,
}

// Extremes below this are what the target was cleared to.
const NOTHING_MET = -30000.0;

@vertex
fn whole_target(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn develop(@builtin(position) at: vec4f) -> Developed {
    let place = vec2u(at.xy);
    if KIND > 0u {
        return developed_projection(place);
    }
    let color = textureLoad(blended, place, 0);
    let distance = textureLoad(blended_distance, place, 0).x;
    let seen = color.w >= 0.5;
    let depth = distance / max(color.w, 0.5) * slices.length_unit + ray_of(vec2f(place)).base;
    return Developed(color, select(NO_DEPTH, depth, seen), vec2u(select(0u, 1u, color.w > 0.0), 0u));
}

// Overlaid clip surfaces lie before what is projected.
fn developed_projection(place: vec2u) -> Developed {
    let ray = ray_of(vec2f(place));
    let range = box_range(ray);
    var color = vec3f(0.0);
    var transmittance = 1.0;
    var depth = NO_DEPTH;
    var begin = select(NO_DEPTH, range.x, range.x < range.y);
    if CLIPPED && (range.x < range.y) {
        begin = NO_DEPTH;
        let count = segment_count(place);
        for (var k = 0u; k < count; k += 1u) {
            let kept = segment(place, k);
            if kept.t_near >= range.y {
                break;
            }
            if max(kept.t_near, range.x) < min(kept.t_far, range.y) {
                begin = min(begin, max(kept.t_near, range.x));
            }
            let face = face_of(ray, kept, FACES_LIT);
            if face.present && (frame.overlay > 0.0) {
                let weight = transmittance * frame.overlay;
                color += weight * lit(vec3f(1.0), face.terms);
                transmittance -= weight;
                depth = min(depth, face.t);
            }
        }
    }
    let found = textureLoad(blended, place, 0).xy;
    let met = select(found.x > NOTHING_MET, found.y > 0.0, KIND == 2u);
    if met {
        let entry = classified(select(slices.kind * found.x, found.x / max(found.y, 1e-30), KIND == 2u));
        let weight = transmittance * entry.w;
        color += weight * entry.xyz;
        transmittance -= weight;
        if KIND == 2u && entry.w > 0.0 {
            depth = begin;
        }
    }
    let distance = select(depth + ray.base, NO_DEPTH, depth == NO_DEPTH);
    return Developed(vec4f(color, 1.0 - transmittance), distance, vec2u(select(0u, 1u, met), 0u));
}
