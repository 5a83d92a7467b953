//! The same scene in numbers that 32-bit floats compute well with.
//!
//! Engines compute in f32. The unit of length (a crystal in metres, a galaxy in kilometres), the place of the origin and the
//! unit of the values must not change an image, so engines work on [`Scene::normalised`]: lengths in voxels (a power of two
//! of the given unit, so that no digit changes), positions from near the volume, and values as stored numbers. Scenes with
//! ordinary numbers are normalised already, and stay as they are, bit for bit.

use std::borrow::Cow;
use std::sync::Arc;

use super::space::{ORDINARY_EXPONENT, SceneSpace};
use super::{Data, Layer, RenderSettings, Scene};

use crate::transfer_function::{ControlPoint, TransferFunction};
use crate::volume::{Rescale, Volume};

/// Values that are at most so many times as far from zero as they vary keep their digits in f64.
const ORDINARY_OFFSET: f64 = (1u64 << 24) as f64;

/// No point of a transfer function is further away than this, in stored numbers; what is further away looks the same.
const FARTHEST_VALUE: f64 = 1e300;

/// Whether values are to be replaced by stored numbers.
fn has_extreme_values(volume: &Volume) -> bool {
    let Rescale { slope, intercept } = volume.rescale();
    let [lo, hi] = volume.stored_range().map(f64::from);
    let variation = slope.abs() * (hi - lo).max(f64::from(f32::MIN_POSITIVE));
    slope.abs().log2().abs() > ORDINARY_EXPONENT || intercept.abs() > ORDINARY_OFFSET * variation
}

/// From values to stored numbers, those of falling rescales negated, so that order stays.
#[derive(Clone, Copy)]
struct Values(Rescale);

impl Values {
    fn number(self, value: f64) -> f64 {
        let number = self.0.stored_level(value) * self.0.slope.signum();
        number.clamp(-FARTHEST_VALUE, FARTHEST_VALUE)
    }

    fn function(self, function: &TransferFunction) -> TransferFunction {
        let point = |p: &ControlPoint| ControlPoint { value: self.number(p.value), ..*p };
        TransferFunction::new(function.points().iter().map(point).collect())
            .expect("a rising map keeps the order of points")
    }

    fn settings(self, settings: &RenderSettings) -> RenderSettings {
        RenderSettings {
            iso: settings.iso.iter().map(|value| self.number(*value)).collect(),
            ..settings.clone()
        }
    }

    fn rescale(self) -> Rescale {
        Rescale { slope: self.0.slope.signum(), intercept: 0.0 }
    }
}

impl Scene {
    /// Where the scene's coordinates are in the world: anywhere but in the world only if it is [normalised](Self::normalised).
    pub fn space(&self) -> SceneSpace {
        self.space
    }

    /// Returns a scene that looks the same, in the units that engines compute with; itself where it has them. Lengths along
    /// its rays are those of the world divided by the unit of its [`space`](Self::space).
    pub fn normalised(&self) -> Cow<'_, Self> {
        let volume = self.volume();
        let space = SceneSpace::of(volume);
        let values = has_extreme_values(volume).then(|| Values(volume.rescale()));
        if space == SceneSpace::WORLD && values.is_none() {
            return Cow::Borrowed(self);
        }
        // What cannot be normalised is rendered as it is.
        self.in_space(space, values).map_or(Cow::Borrowed(self), Cow::Owned)
    }

    fn in_space(&self, space: SceneSpace, values: Option<Values>) -> Option<Self> {
        let given = &self.layers[0];
        let volume = self.volume();
        let rescale = values.map_or(volume.rescale(), Values::rescale);
        let volume = volume.placed(rescale, space.affine(volume.world_from_voxel())).ok()?;
        let function = match values {
            Some(values) => values.function(given.transfer_function()),
            None => given.transfer_function().clone(),
        };
        let layer = Layer::new(Data::Volume(Arc::new(volume)), &function)
            .with_unit_distance(Some(given.unit_distance() / space.unit))
            .with_lighting(given.lighting().clone());
        let clip = self.clip.as_ref().map(|clip| clip.seen_from(&space.scene_from_world()));
        Some(Self {
            layers: vec![layer],
            camera: space.camera(&self.camera),
            settings: values.map_or_else(|| self.settings.clone(), |values| values.settings(&self.settings)),
            clip,
            clip_shading: self.clip_shading.clone(),
            space: SceneSpace {
                unit: self.space.unit * space.unit,
                origin: self.space.origin + self.space.unit * space.origin,
            },
        })
    }
}
