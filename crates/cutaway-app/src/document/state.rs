//! What decides the picture: the part of a scene that is edited.

use cutaway_core::camera::Camera;
use cutaway_core::clip::Clip;
use cutaway_core::defaults::{Look, default_view};
use cutaway_core::histogram;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Data, Layer, RenderSettings, Scene, SceneError};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::Volume;

use crate::cutting::Cutting;

/// Everything that decides the picture besides the volume itself. Cheap to clone: solids are named, not held.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneState {
    /// What values look like.
    pub function: TransferFunction,
    /// World length that opacities are for; none: the mean voxel spacing.
    pub unit_distance: Option<f64>,
    /// Where it is seen from.
    pub camera: Camera,
    /// Light and material.
    pub lighting: Lighting,
    /// How the image is made. Its resolution is that of stills; the view's own is that of the window.
    pub settings: RenderSettings,
    /// What is cut.
    pub cutting: Cutting,
}

impl SceneState {
    /// What a volume looks like before anybody has said anything.
    pub fn of_volume(volume: &Volume) -> Self {
        let settings = RenderSettings::default();
        let function = histogram::default_for_mode(volume, settings.mode);
        let look = Look { volume, function: &function, mode: settings.mode, iso: &settings.iso, clip: None };
        let camera = default_view(&look, None, 1.0).camera;
        Self {
            function,
            unit_distance: None,
            camera,
            lighting: Lighting::default(),
            settings,
            cutting: Cutting::default(),
        }
    }

    /// The scene as renderers take it, in an image of `resolution`, with the solids of `clip` where there are any.
    ///
    /// # Errors
    /// A number outside its range, or a volume that cannot be rendered.
    pub fn scene(&self, data: &Data, clip: Option<&Clip>, resolution: [u32; 2]) -> Result<Scene, SceneError> {
        let settings = RenderSettings { resolution, ..self.settings.clone() };
        let (camera, lighting) = (self.camera.clone(), self.lighting.clone());
        let scene = Scene::new(
            Layer::new(data, &self.function).with_unit_distance(self.unit_distance).with_lighting(lighting),
            camera,
            settings,
        )?;
        match clip {
            Some(clip) => scene.with_clip(clip, self.cutting.shading.clone()),
            None => Ok(scene),
        }
    }
}
