// The clip surface that a segment begins at, and its light on what lies behind it; see `cutaway_core::clip::Impregnation`.

import package::shared::frame::frame;
import package::shared::lighting::{Terms, UNLIT, terms_of_normal};
import package::shared::ray::Ray;
import package::shared::segments::Segment;

struct Face {
    present: bool,
    t: f32,
    terms: Terms,
    // How far along the ray its normal takes part in the light.
    reach: f32,
}

// The least cosine between ray and normal that depth is measured with.
const LEAST_COSINE = 0.25;

fn face_of(ray: Ray, segment: Segment, shaded: bool) -> Face {
    let present = any(segment.normal != vec3f(0.0));
    var terms = UNLIT;
    if present && shaded {
        terms = terms_of_normal(segment.normal, ray.direction_in_world);
    }
    let cosine = max(abs(dot(segment.normal, ray.direction_in_world)), LEAST_COSINE);
    return Face(present, segment.t_near, terms, frame.impregnation_depth / cosine);
}

// The light at t, where the gradient alone gives `terms`.
fn impregnated(face: Face, t: f32, terms: Terms) -> Terms {
    if !face.present || frame.impregnation == 0u || face.reach <= 0.0 {
        return terms;
    }
    let depth = (t - face.t) / face.reach;
    let weight = select(max(1.0 - depth, 0.0), select(0.0, 1.0, depth < 1.0), frame.impregnation == 1u);
    return Terms(mix(terms.factor, face.terms.factor, weight), mix(terms.white, face.terms.white, weight));
}
