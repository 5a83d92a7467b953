//! Checks of every number of a scene, so that renderers need none.

use super::choices::{ImageInterpolation, Mode, Sampling};
use super::settings::RenderSettings;
use crate::camera::CameraError;
use crate::clip::PoseError;
use crate::image::blur::LARGEST_SIGMA;
use crate::lighting::Lighting;
use crate::numbers::exact;

/// Why a scene cannot be rendered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A setting outside its range.
    #[error("{field} is {found}; expected {expected}")]
    Setting {
        /// Which setting, as in a scene file.
        field: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The camera shows nothing.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The poses of a clip expression, each of which can be undone, cannot be undone together.
    #[error("clip: {0}")]
    Pose(#[from] PoseError),
    /// The volume's box has no inside.
    #[error("the volume has {dimensions:?} voxels; rendering needs at least 2 along each axis")]
    Flat {
        /// Voxels along x, y, z.
        dimensions: [u32; 3],
    },
}
/// The largest number of pixels along a side of an image, and the largest number of pixels altogether.
pub const MAX_RESOLUTION: (u32, u64) = (32_768, 1 << 27);
pub(crate) fn setting(field: &'static str, found: impl ToString, expected: &'static str) -> SceneError {
    SceneError::Setting { field, found: found.to_string(), expected }
}

fn positive(field: &'static str, found: f64) -> Result<(), SceneError> {
    if found > 0.0 && found.is_finite() {
        Ok(())
    } else {
        Err(setting(field, exact(found), "a number above 0"))
    }
}

pub(super) fn validate_settings(s: &RenderSettings) -> Result<(), SceneError> {
    positive("step", s.step)?;
    if !(1e-3..=1e6).contains(&s.step) {
        return Err(setting(
            "step",
            exact(s.step),
            "at least 0.001 (a thousand samples a voxel) and at most 1000000",
        ));
    }
    let [width, height] = s.resolution;
    let (side, pixels) = MAX_RESOLUTION;
    let fits =
        width.min(height) > 0 && width.max(height) <= side && u64::from(width) * u64::from(height) <= pixels;
    if !fits {
        let expected = "1 to 32768 pixels a side and at most 134217728 altogether";
        return Err(setting("resolution", format!("{width} x {height}"), expected));
    }
    let share = |v: f64| v > 0.0 && v <= 1.0;
    if !share(s.early_termination) {
        return Err(setting("early_termination", exact(s.early_termination), "more than 0 and at most 1"));
    }
    if !share(s.iso_opacity) {
        return Err(setting("iso_opacity", exact(s.iso_opacity), "more than 0 and at most 1"));
    }
    if !(s.brightness >= 0.0 && s.brightness.is_finite()) {
        return Err(setting("brightness", exact(s.brightness), "a number of 0 or more"));
    }
    if let Some(t) = s.adaptive_threshold.filter(|t| !(0.0..=1.0).contains(t)) {
        return Err(setting("adaptive_threshold", exact(t), "a difference of 0 to 1"));
    }
    if s.pre_integration && s.sampling == Sampling::Object {
        let found = "on with `sampling` object";
        return Err(setting("pre_integration", found, "one of the two: both decide what a step is"));
    }
    if s.pre_integration && s.adaptive_threshold.is_some() {
        let found = "on with `adaptive_threshold`";
        return Err(setting(
            "pre_integration",
            found,
            "one of the two: a pre-integrated step needs no finer one",
        ));
    }
    if !(0.0..=LARGEST_SIGMA).contains(&s.blur) {
        return Err(setting("blur", exact(s.blur), "0 to 64 pixels"));
    }
    if let ImageInterpolation::Factor(factor) = s.image_interpolation
        && !ImageInterpolation::FACTORS.contains(&factor)
    {
        return Err(setting("image_interpolation", factor, "`off`, `adaptive` or a factor of 2 to 16"));
    }
    if s.brick_size != 0 && !(s.brick_size.is_power_of_two() && (8..=1024).contains(&s.brick_size)) {
        return Err(setting("brick_size", s.brick_size, "0, or a power of two of 8 to 1024"));
    }
    if s.mode == Mode::Iso && s.iso.is_empty() {
        return Err(setting("iso", "missing", "at least one isovalue in iso mode"));
    }
    match s.iso.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(setting("iso", exact(*v), "finite numbers")),
        None => Ok(()),
    }
}

/// Kernels compute in f32: products of factors must stay far from its end.
const LARGEST_FACTOR: f64 = 1e6;

pub(super) fn validate_lighting(l: &Lighting) -> Result<(), SceneError> {
    let factors = [
        ("ambient", l.ambient),
        ("diffuse", l.diffuse),
        ("specular", l.specular),
        ("specular_power", l.specular_power),
    ];
    for (field, v) in factors {
        if !(0.0..=LARGEST_FACTOR).contains(&v) {
            return Err(setting(field, exact(v), "0 to 1000000"));
        }
    }
    positive("wrap_power", l.wrap_power)?;
    match l.light {
        Some(d) if !d.iter().all(|x| x.is_finite()) || d.iter().all(|x| *x == 0.0) => {
            Err(setting("light", format!("{d:?}"), "a direction towards the light, not zero"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_are_refused() {
        let wrong = [
            RenderSettings { step: 0.0, ..Default::default() },
            RenderSettings { step: f64::NAN, ..Default::default() },
            RenderSettings { resolution: [0, 5], ..Default::default() },
            RenderSettings { resolution: [32_768, 32_768], ..Default::default() },
            RenderSettings { early_termination: 1.1, ..Default::default() },
            RenderSettings { mode: Mode::Iso, ..Default::default() },
            RenderSettings { image_interpolation: ImageInterpolation::Factor(1), ..Default::default() },
            RenderSettings { image_interpolation: ImageInterpolation::Factor(17), ..Default::default() },
            RenderSettings { blur: -0.5, ..Default::default() },
            RenderSettings { blur: f64::NAN, ..Default::default() },
            RenderSettings { blur: 65.0, ..Default::default() },
            RenderSettings { brick_size: 4, ..Default::default() },
            RenderSettings { brick_size: 24, ..Default::default() },
            RenderSettings { brick_size: 2048, ..Default::default() },
        ];
        for s in wrong {
            assert!(validate_settings(&s).is_err(), "{s:?}");
        }
        assert!(validate_settings(&RenderSettings::default()).is_ok());
    }
}
