//! Transfer functions with names: the presets that users of 3D Slicer and VTK ask for, with points of our own.
//!
//! CT presets stand on the Hounsfield scale (air -1000, lung -900 to -500, fat -120 to -60, water 0, muscle and organs 30
//! to 80, blood with contrast agent 150 to 450, spongy bone 150 to 500, cortical bone above). MR and ultrasound have no
//! such scale: their points are shares of a [`RobustScale`] that is measured in the volume.

use std::fmt;

use crate::defaults::robust_range;
use crate::histogram::{Histogram, otsu_threshold};
use crate::numbers::short;
use crate::scene::Mode;
use crate::transfer_function::{TransferFunction, TransferFunctionError};
use crate::volume::Volume;

mod ct;
mod others;

/// What kind of image a preset is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Modality {
    /// Computed tomography, in Hounsfield units.
    Ct,
    /// Magnetic resonance, and what is derived from it.
    Mr,
    /// Ultrasound.
    Us,
    /// Any volume whose larger values are what matters.
    Any,
}

impl Modality {
    /// The name in lists.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ct => "CT",
            Self::Mr => "MR",
            Self::Us => "US",
            Self::Any => "any",
        }
    }
}

/// Signs that a volume is not in Hounsfield units, as far as its values show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotHounsfield {
    /// No value is below 0, where Hounsfield units have air: it looks like CT plus 1024, as scanners store it.
    Raised {
        /// Least and greatest value.
        values: [f64; 2],
    },
    /// The values are too close together for any body: it looks scaled to 0 to 1, -1 to 1 or 8 bits.
    Scaled {
        /// Least and greatest value.
        values: [f64; 2],
    },
}

impl fmt::Display for NotHounsfield {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Raised { values: [lo, hi] } | Self::Scaled { values: [lo, hi] }) = self;
        let (lo, hi) = (short(*lo), short(*hi));
        write!(
            f,
            "the preset is in Hounsfield units (air is -1000, water 0), and the volume has {lo} to {hi}"
        )?;
        match self {
            Self::Raised { .. } => write!(f, ", no value below 0: it looks like CT plus 1024"),
            Self::Scaled { .. } => write!(f, ": it looks scaled to another range"),
        }
    }
}

/// What the positions of a preset's points mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scale {
    /// Values of the volume; opacities are for 1 world unit (mm).
    Absolute,
    /// Shares of the volume's [`RobustScale`]; opacities are for the mean voxel spacing.
    Relative,
}

/// A named way to look at a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Preset {
    /// Its name, as 3D Slicer writes it.
    pub name: &'static str,
    /// What it is for.
    pub modality: Modality,
    /// What it shows, in one line.
    pub description: &'static str,
    /// What a ray makes of the values along it.
    pub mode: Mode,
    /// Whether it is meant to be lit.
    pub shade: bool,
    /// Straight RGB display values in 0..=1 by position.
    pub colors: &'static [(f64, [f64; 3])],
    /// Opacity per [`Preset::unit_distance`] in 0..=1 by position; `mip` and `mean` use it as it is.
    pub opacities: &'static [(f64, f64)],
    /// What the positions mean.
    pub scale: Scale,
}

impl Preset {
    /// The preset as a function of the volume's values.
    pub fn transfer_function(&self, volume: &Volume) -> TransferFunction {
        let function = match self.scale {
            Scale::Absolute => self.over(|value| value),
            Scale::Relative => {
                let scale = RobustScale::of(volume);
                self.over(|share| scale.value(share))
            }
        };
        function.expect("a test holds that presets are valid")
    }

    /// Returns the signs that a volume does not have the units of this preset; none where there are none.
    pub fn unit_mismatch(&self, volume: &Volume) -> Option<NotHounsfield> {
        if self.modality != Modality::Ct || self.scale != Scale::Absolute {
            return None;
        }
        let values = volume.value_range();
        let [lo, hi] = values;
        // Air and bone are about 1300 apart; 8 bits hold 256 values.
        if hi - lo <= 256.0 {
            return Some(NotHounsfield::Scaled { values });
        }
        (lo >= 0.0).then_some(NotHounsfield::Raised { values })
    }

    /// The world length that the opacities are for; none is the mean voxel spacing.
    pub fn unit_distance(&self) -> Option<f64> {
        (self.scale == Scale::Absolute).then_some(1.0)
    }

    fn over(&self, place: impl Fn(f64) -> f64) -> Result<TransferFunction, TransferFunctionError> {
        let colors: Vec<_> = self.colors.iter().map(|&(p, color)| (place(p), color)).collect();
        let opacities: Vec<_> = self.opacities.iter().map(|&(p, opacity)| (place(p), opacity)).collect();
        TransferFunction::from_color_and_opacity(&colors, &opacities)
    }
}

/// Every preset, by name.
pub fn all() -> &'static [Preset] {
    static ALL: std::sync::LazyLock<Vec<Preset>> = std::sync::LazyLock::new(|| {
        let mut all: Vec<Preset> = ct::PRESETS.iter().chain(others::PRESETS).cloned().collect();
        all.sort_by_key(|p| p.name);
        all
    });
    &ALL
}

/// The preset of a name; upper and lower case are the same.
pub fn by_name(name: &str) -> Option<&'static Preset> {
    all().iter().find(|p| p.name.eq_ignore_ascii_case(name))
}

/// A volume's own scale of intensities: five landmarks of its histogram, linear between them.
///
/// | share | landmark |
/// |---|---|
/// | 0 | the least value |
/// | 0.25 | where the background ends (Otsu's threshold, 1979) |
/// | 0.5 | the median of what is above it |
/// | 1 | the 99.5th percentile of what is above it |
/// | 1.25 | the greatest value |
///
/// Landmarks make intensities comparable that have no unit (Nyúl, Udupa and Zhang, "New variants of a method of MRI
/// scale standardization", 2000); outliers move none but the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustScale {
    /// The values of the landmarks, in the volume's units; they do not decrease.
    pub landmarks: [f64; 5],
}

/// Bins of the histogram that landmarks are measured in.
const BINS: usize = 4096;

impl RobustScale {
    /// The shares of the landmarks.
    pub const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 1.0, 1.25];

    /// Measures a volume.
    pub fn of(volume: &Volume) -> Self {
        // A few outliers must not put all the rest into one bin.
        let histogram = Histogram::over(volume, robust_range(volume), BINS);
        let [lo, hi] = histogram.range;
        let foreground = otsu_threshold(&histogram.counts).min(BINS - 1);
        let end = lo + foreground as f64 / BINS as f64 * (hi - lo);
        let [middle, high] = [0.5, 0.995].map(|share| histogram.percentile_from(foreground, share).min(hi));
        // The middle of the bin that both are in may lie above either.
        let [least, greatest] = volume.value_range();
        Self { landmarks: [least.min(lo), end, middle.max(end), high.max(middle).max(end), greatest.max(hi)] }
    }

    /// The value at a share; shares outside 0..=1.25 take the nearest landmark.
    pub fn value(&self, share: f64) -> f64 {
        let upper = Self::SHARES.partition_point(|s| *s <= share).clamp(1, Self::SHARES.len() - 1);
        let (s, v) = (&Self::SHARES[upper - 1..=upper], &self.landmarks[upper - 1..=upper]);
        let w = ((share - s[0]) / (s[1] - s[0])).clamp(0.0, 1.0);
        v[0] + (v[1] - v[0]) * w
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::lighting::Lighting;
    use crate::reference;
    use crate::scene::{Layer, RenderSettings, Scene};
    use crate::volume::{Geometry, Rescale};
    use glam::{DVec3, UVec3};

    /// Shells around the middle of a cube of 33 voxels: the value by the distance from it, in voxels.
    fn shells(value: impl Fn(f64) -> f64, rescale: Rescale) -> Volume {
        let n = 33u32;
        let middle = DVec3::splat(f64::from(n - 1) / 2.0);
        let distance = |i: u32| {
            let p = UVec3::new(i % n, i / n % n, i / n / n).as_dvec3();
            p.distance(middle)
        };
        let voxels: Vec<i16> = (0..n.pow(3)).map(|i| value(distance(i)) as i16).collect();
        Volume::new(UVec3::splat(n), voxels, rescale, Geometry::from_spacing(DVec3::splat(3.0))).unwrap()
    }

    /// Lung, bone, enhanced blood, organ, fat and air, from the inside out.
    fn body() -> Volume {
        let tissue = [(3.0, -800.0), (5.0, 1100.0), (8.0, 320.0), (12.0, 60.0), (14.5, -95.0)];
        let at = |d: f64| tissue.iter().find(|t| d < t.0).map_or(-1000.0, |t| t.1);
        shells(at, Rescale::IDENTITY)
    }

    /// Fluid, white matter, grey matter and skin, noise around them; intensities times `factor`.
    fn head(factor: f64) -> Volume {
        let tissue = [(3.0, 480.0), (8.0, 310.0), (11.0, 220.0), (12.0, 60.0), (13.0, 500.0)];
        let noise = |d: f64| (d * 977.0).rem_euclid(23.0);
        let at = |d: f64| tissue.iter().find(|t| d < t.0).map_or(noise(d), |t| t.1 + noise(d));
        shells(at, Rescale { slope: factor, intercept: 0.0 })
    }

    fn volume_for(preset: &Preset) -> Volume {
        if preset.modality == Modality::Ct { body() } else { head(1.0) }
    }

    #[test]
    fn names_are_unique_and_found_in_any_case() {
        assert!(all().windows(2).all(|w| w[0].name < w[1].name));
        for preset in all() {
            assert_eq!(by_name(&preset.name.to_uppercase()).map(|p| p.name), Some(preset.name));
            assert!(!preset.description.contains('\n') && preset.description.len() < 90, "{}", preset.name);
        }
        assert!(by_name("CT-Cardiac4").is_none());
    }

    /// The presets that the familiar programs have.
    #[test]
    fn the_familiar_names_are_there() {
        let ct = "AAA AAA2 Air Bone Bones Cardiac Cardiac2 Cardiac3 Chest-Contrast-Enhanced Chest-Vessels \
                  Coronary-Arteries Coronary-Arteries-2 Coronary-Arteries-3 Cropped-Volume-Bone Fat \
                  Liver-Vasculature Lung MIP Muscle Pulmonary-Arteries Soft-Tissue X-ray";
        let ct = ct.split_whitespace().map(|n| format!("CT-{n}"));
        let others = ["MR-Angio", "MR-Default", "MR-MIP", "MR-T2-Brain", "DTI-FA-Brain", "US-Fetal"];
        for name in ct.chain(others.map(str::to_owned)) {
            assert!(by_name(&name).is_some(), "{name}");
        }
    }

    #[test]
    fn points_are_valid_and_distinct() {
        for preset in all() {
            preset.over(|p| p).unwrap_or_else(|e| panic!("{}: {e}", preset.name));
            assert!(preset.colors.windows(2).all(|w| w[0].0 < w[1].0), "{}", preset.name);
            assert!(preset.opacities.windows(2).all(|w| w[0].0 < w[1].0), "{}", preset.name);
            let mut positions = preset.colors.iter().map(|p| p.0).chain(preset.opacities.iter().map(|p| p.0));
            if preset.scale == Scale::Relative {
                assert!(positions.all(|p| (0.0..=1.25).contains(&p)), "{}", preset.name);
            }
        }
    }

    #[test]
    fn every_preset_shows_its_modality_and_nothing_beside_it() {
        for preset in all() {
            let volume = volume_for(preset);
            let camera =
                Camera::framing(&volume.corners_in_world(), DVec3::new(0.3, 0.9, 0.2), DVec3::Z, 1.0, 1.0);
            let lighting = Lighting { shade: preset.shade, ..Lighting::default() };
            let render = RenderSettings { mode: preset.mode, resolution: [25, 25], ..Default::default() };
            let function = preset.transfer_function(&volume);
            let unit = preset.unit_distance();
            let scene = Scene::new(
                Layer::new(volume.clone(), &function).with_unit_distance(unit).with_lighting(lighting),
                camera,
                render,
            )
            .unwrap();
            let image = reference::render(&scene);
            let brightest = |p: &[f32; 4]| p[0].max(p[1]).max(p[2]);
            let shown = image.pixels().iter().filter(|p| p[3] > 0.1 && brightest(p) > 0.05).count();
            let white = image.pixels().iter().filter(|p| p[0].min(p[1]).min(p[2]) > 1.0).count();
            assert!(shown > 20, "{}: {shown} pixels show something", preset.name);
            assert!(white == 0, "{}: {white} pixels are clipped", preset.name);
            assert_eq!(image.pixels()[0][3], 0.0, "{}: a corner shows what is outside", preset.name);
        }
    }

    #[test]
    fn air_is_transparent() {
        for preset in all().iter().filter(|p| p.modality == Modality::Ct) {
            let function = preset.transfer_function(&body());
            assert_eq!(function.evaluate(-1000.0).1, 0.0, "{}", preset.name);
            assert_eq!(function.evaluate(-1024.0).1, 0.0, "{}", preset.name);
        }
    }

    #[test]
    fn the_robust_scale_follows_the_intensities_and_not_their_unit() {
        let (one, seven) = (RobustScale::of(&head(1.0)), RobustScale::of(&head(7.0)));
        for (a, b) in one.landmarks.iter().zip(seven.landmarks) {
            assert!((7.0 * a - b).abs() <= 7.0 * 0.2, "{one:?} {seven:?}");
        }
        let [lo, end, middle, high, greatest] = one.landmarks;
        assert!(lo == 0.0 && end > 23.0 && end < 220.0, "{one:?}");
        assert!((220.0..360.0).contains(&middle) && (480.0..=523.0).contains(&high), "{one:?}");
        assert_eq!((one.value(-1.0), one.value(0.25), one.value(2.0)), (lo, end, greatest));
        assert!((one.value(0.75) - 0.5 * (middle + high)).abs() < 1e-9);
    }

    #[test]
    fn volumes_of_one_or_two_values_have_a_scale() {
        for values in [[7, 7], [-5, 900]] {
            let volume = shells(|d| f64::from(values[usize::from(d < 6.0)]), Rescale::IDENTITY);
            let scale = RobustScale::of(&volume);
            assert!(scale.landmarks.windows(2).all(|w| w[0] <= w[1]), "{scale:?}");
            for preset in all() {
                preset.transfer_function(&volume);
            }
        }
    }
}
