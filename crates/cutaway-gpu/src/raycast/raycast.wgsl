// The GPU ray caster: a fragment a pixel, a ray a fragment (Termeer 4.2.1). A ray is the sum of its segments; each is
// sampled from its own near end on, so that both ends are exact.

import package::raycast::composite::composite;
import package::raycast::isosurface::isosurfaces;
import package::raycast::pixel::{NOTHING, Pixel, add_surface, packed_counts};
import package::raycast::projection::{NOTHING_PROJECTED, Projected, finish_projection, project};
import package::raycast::refined::{STEPPING, composite_refined};
import package::raycast::steps::{set_jitter, steps_of};
import package::shared::blocks::visible_range;
import package::shared::face::{Face, face_of};
import package::shared::frame::frame;
import package::shared::lighting::{UNLIT, lit};
import package::shared::ray::{NO_DEPTH, Ray, box_range, ray_of, step_along};
import package::shared::segments::{CLIPPED, Segment, segment, segment_count};

// 0 composite, 1 isosurfaces, 2 maximum, 3 minimum, 4 mean.
override MODE: u32 = 0u;
// Clip surfaces are lit, in every mode.
override FACES_LIT: bool = true;
// Rays have ranges: they look only between the ends of the proxy geometry, and end at opaque geometry.
override PROXY: bool = false;

// Nearest and farthest distance of the proxy geometry along the pixel's ray, the latter negated; that of opaque geometry.
@group(1) @binding(0) var proxy_range: texture_2d<f32>;

struct Output {
    // Premultiplied.
    @location(0) color: vec4f,
    // World distance from the eye; 1e30 where nothing is.
    @location(1) depth: f32,
    // What the ray took; see `packed_counts`.
    @location(2) counts: vec2u,
}

@vertex
fn whole_image(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn cast_pixel(@builtin(position) at: vec4f) -> Output {
    let place = vec2u(at.xy);
    let ray = ray_of(vec2f(place));
    set_jitter(place);
    var range = box_range(ray);
    if PROXY {
        let ends = textureLoad(proxy_range, place, 0);
        // Samples lie where they would without a proxy.
        visible_range = vec2f(ends.x, -ends.y);
        range.y = min(range.y, ends.z);
    }
    var pixel = NOTHING;
    if range.x < range.y {
        cast_ray(&pixel, ray, place, range);
    }
    let depth = select(pixel.depth + ray.base, NO_DEPTH, pixel.depth == NO_DEPTH);
    return Output(vec4f(pixel.color, 1.0 - pixel.transmittance), depth, packed_counts(pixel));
}

// The greatest value is the least texel where the sign turns.
fn projection_kind() -> f32 {
    if MODE == 2u {
        return frame.value_sign;
    }
    return select(0.0, -frame.value_sign, MODE == 3u);
}

fn cast_ray(pixel: ptr<function, Pixel>, ray: Ray, place: vec2u, range: vec2f) {
    var projected = NOTHING_PROJECTED;
    if CLIPPED {
        let count = segment_count(place);
        for (var k = 0u; k < count; k += 1u) {
            let piece = segment(place, k);
            if piece.t_near >= range.y {
                break;
            }
            let t_near = max(piece.t_near, range.x);
            let t_far = min(piece.t_far, range.y);
            count_steps(pixel, ray, t_near, t_far);
            if MODE < 2u && (*pixel).transmittance < frame.opaque_below {
                continue;
            }
            let face = face_of(ray, piece, FACES_LIT);
            if face.present && frame.overlay > 0.0 {
                draw_over(pixel, lit(vec3f(1.0), face.terms), face.t);
            }
            if t_near < t_far {
                cast_segment(pixel, &projected, ray, face, t_near, t_far);
            }
        }
    } else {
        let face = Face(false, 0.0, UNLIT, 0.0);
        count_steps(pixel, ray, range.x, range.y);
        cast_segment(pixel, &projected, ray, face, range.x, range.y);
    }
    if MODE >= 2u {
        finish_projection(projected, projection_kind(), pixel);
    }
}

// Steps of a segment, whether they will be taken or not; isosurfaces have none.
fn count_steps(pixel: ptr<function, Pixel>, ray: Ray, t_near: f32, t_far: f32) {
    if MODE != 1u && t_near < t_far {
        var steps = i32(ceil((t_far - t_near) / step_along(ray)));
        if MODE == 0u && STEPPING != 0u {
            steps = steps_of(ray, t_near, t_far).count;
        }
        (*pixel).steps += u32(max(steps, 0));
    }
}

// A clip surface that is drawn itself.
fn draw_over(pixel: ptr<function, Pixel>, color: vec3f, t: f32) {
    let depth = (*pixel).depth;
    add_surface(pixel, color, frame.overlay, t);
    if MODE == 0u && (*pixel).transmittance > 0.5 {
        // Of emission and absorption, depth is where opacity passes one half.
        (*pixel).depth = depth;
    }
}

fn cast_segment(
    pixel: ptr<function, Pixel>,
    projected: ptr<function, Projected>,
    ray: Ray,
    face: Face,
    t_near: f32,
    t_far: f32,
) {
    if MODE == 0u && STEPPING != 0u {
        composite_refined(pixel, ray, face, t_near, t_far);
    } else if MODE == 0u {
        composite(pixel, ray, face, t_near, t_far);
    } else if MODE == 1u {
        isosurfaces(pixel, ray, face, t_near, t_far);
    } else {
        project(projected, pixel, ray, projection_kind(), t_near, t_far);
    }
}
