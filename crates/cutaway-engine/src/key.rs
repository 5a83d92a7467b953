//! Keys: exactly what a preparation and a classification depend on. Equal keys mean that the old one still serves.
//!
//! Light, camera, resolution, image interpolation, poses of clips and everything else that is not here changes frames only.

use cutaway_core::scene::{Data, Mode, Scene, SpaceSkipping};
use cutaway_core::transfer_function::TransferFunction;

/// The data that a preparation was made for. Keeps them alive, so that equal keys are the same data.
#[derive(Clone, Debug)]
pub(crate) struct PrepareKey(Data);

impl PrepareKey {
    pub(crate) fn of(scene: &Scene) -> Self {
        Self(scene.data().clone())
    }

    pub(crate) fn serves(&self, scene: &Scene) -> bool {
        self.0.is_same(scene.data())
    }
}

/// Everything that a classification depends on, besides the prepared data.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClassifyKey {
    /// With brightness applied.
    function: TransferFunction,
    unit_distance: f64,
    mode: Mode,
    /// Isovalues, in iso mode.
    iso: Vec<f64>,
    step: f64,
    pre_integration: bool,
    skipping: bool,
    brick_size: u32,
    /// True if clip surfaces are drawn, which show where nothing else does.
    overlaid: bool,
}

impl ClassifyKey {
    pub(crate) fn of(scene: &Scene) -> Self {
        let settings = scene.settings();
        Self {
            function: scene.transfer_function().clone(),
            unit_distance: scene.unit_distance(),
            mode: settings.mode,
            iso: if settings.mode == Mode::Iso { settings.iso.clone() } else { Vec::new() },
            step: settings.step,
            pre_integration: settings.pre_integration,
            skipping: settings.space_skipping != SpaceSkipping::Off,
            brick_size: settings.brick_size,
            overlaid: scene.clip().is_some() && scene.clip_shading().overlay > 0.0,
        }
    }
}
