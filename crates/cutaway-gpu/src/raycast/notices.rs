//! What the ray caster says of settings.

use cutaway_core::scene::{Gradient, ImageInterpolation, Mode, RenderSettings, Sampling};

/// What of these settings the ray caster does without, in words for whoever asked for it.
pub fn notices(settings: &RenderSettings) -> Vec<String> {
    let composite = settings.mode == Mode::Composite;
    let refined = settings.jitter
        || settings.pre_integration
        || settings.adaptive_threshold.is_some()
        || settings.sampling != Sampling::default()
        || settings.gradient != Gradient::default();
    let on_planes = settings.sampling == Sampling::Object;
    let all = [
        (
            settings.image_interpolation == ImageInterpolation::Adaptive,
            "adaptive image interpolation is of the cpu engine; the gpu casts every pixel (a factor, 2 to 16, works)",
        ),
        (composite && settings.jitter && on_planes, "steps on planes of voxels are not jittered"),
        (
            !composite && refined,
            "jitter, pre-integration, adaptive steps, object-aligned sampling and kinds of gradient are of composite mode",
        ),
    ];
    all.into_iter().filter(|(is, _)| *is).map(|(_, notice)| notice.to_owned()).collect()
}
