//! A scene: everything that decides an image.
//!
//! [`Scene`] is what renderers take: a volume in memory and settings that have been checked.

mod checks;
mod choices;
mod data;
mod defaults;
mod layer;
mod normal;
mod settings;
mod space;

pub(crate) use checks::setting;
pub use checks::{MAX_RESOLUTION, SceneError};
pub use choices::{Engine, Gradient, ImageInterpolation, Layout, Mode, Sampling, SpaceSkipping};
pub use data::Data;
pub use defaults::{default_camera, default_unit_distance};
pub use layer::Layer;
pub use settings::RenderSettings;
pub use space::SceneSpace;

use crate::camera::Camera;
use crate::clip::{Clip, ClipShading, FlatClip, Impregnation, ObjectId, Pose, SegmentLimit};
use crate::lighting::Lighting;
use crate::transfer_function::TransferFunction;
use crate::volume::Volume;
use checks::validate_settings;

/// The object of a scene's clip that is the volume's missing cells.
const MISSING: ObjectId = ObjectId(u32::MAX);

/// Spacings that differ by less than this share are equal: files round them.
const EQUAL_SPACINGS: f64 = 1e-4;

/// Layers and how to look at them. Cloning shares the data.
///
/// A scene has one layer today.
#[derive(Clone, Debug)]
pub struct Scene {
    layers: Vec<Layer>,
    camera: Camera,
    settings: RenderSettings,
    clip: Option<FlatClip>,
    clip_shading: ClipShading,
    space: SceneSpace,
}

impl Scene {
    /// Checks every number, so that renderers need not.
    ///
    /// # Errors
    /// The first number outside its range, by the name of its setting.
    pub fn new(layer: Layer, camera: Camera, settings: RenderSettings) -> Result<Self, SceneError> {
        layer.validate()?;
        camera.validate()?;
        validate_settings(&settings)?;
        let layers = vec![layer.brightened(settings.brightness)];
        let (clip_shading, space) = (ClipShading::default(), SceneSpace::WORLD);
        let mut scene = Self { layers, camera, settings, clip: None, clip_shading, space };
        scene.set_clip(None)?;
        Ok(scene)
    }

    /// The same scene, clipped: of the volume, what is inside `clip` is shown.
    pub fn with_clip(mut self, clip: &Clip, shading: ClipShading) -> Result<Self, SceneError> {
        shading.validate()?;
        self.clip_shading = shading;
        self.set_clip(Some(clip))?;
        Ok(self)
    }

    /// Another clip, or the same with other poses: costs the number of its nodes, whatever is in them.
    pub fn set_clip(&mut self, clip: Option<&Clip>) -> Result<(), SceneError> {
        self.clip = match self.missing()? {
            Some(missing) => {
                let kept = clip.cloned().unwrap_or_else(Clip::everything);
                Some(FlatClip::new(&kept.cut(missing))?)
            }
            None => clip.map(FlatClip::new).transpose()?,
        };
        Ok(())
    }

    /// The cells of the volume that have no value, which every scene cuts away.
    fn missing(&self) -> Result<Option<Clip>, SceneError> {
        let volume = self.volume();
        let Some(cells) = volume.missing_cells() else { return Ok(None) };
        let pose = Pose::new(*volume.world_from_voxel())?;
        Ok(Some(Clip::object(MISSING, cells.clone()).with_pose(pose)))
    }

    /// What is shown of the volume, also because [voxels are missing](Volume::missing_cells); none: all of it.
    pub fn clip(&self) -> Option<&FlatClip> {
        self.clip.as_ref()
    }

    /// What clip surfaces look like.
    pub fn clip_shading(&self) -> &ClipShading {
        &self.clip_shading
    }

    /// How many segments a ray has at most.
    pub fn segment_limit(&self) -> SegmentLimit {
        SegmentLimit { count: self.settings.segments, backmost: self.settings.backmost }
    }

    /// How deep below a clip surface its normal lights samples, in world units; none: not at all.
    pub fn impregnation_depth(&self) -> Option<f64> {
        let depth = self.clip_shading.thickness * self.volume().spacing().min_element();
        let used = self.clip_shading.impregnation != Impregnation::None && depth > 0.0;
        used.then_some(depth)
    }

    /// Returns the same scene as an image of another width and height in pixels.
    ///
    /// # Errors
    /// A size outside its range.
    pub fn resized(&self, resolution: [u32; 2]) -> Result<Self, SceneError> {
        let settings = RenderSettings { resolution, ..self.settings.clone() };
        validate_settings(&settings)?;
        Ok(Self { settings, ..self.clone() })
    }

    /// The layers: one today.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The data of the layer.
    pub fn data(&self) -> &Data {
        self.layers[0].data()
    }

    /// The regular grid of the layer's data: see [`Data::lattice`].
    pub fn volume(&self) -> &Volume {
        self.data().lattice()
    }

    /// The transfer function, with brightness applied.
    pub fn transfer_function(&self) -> &TransferFunction {
        self.layers[0].transfer_function()
    }

    /// The length in world units that opacities are for.
    pub fn unit_distance(&self) -> f64 {
        self.layers[0].unit_distance()
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Another camera on the same scene.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), SceneError> {
        camera.validate()?;
        self.camera = camera;
        Ok(())
    }

    /// Light and material.
    pub fn lighting(&self) -> &Lighting {
        self.layers[0].lighting()
    }

    /// How the image is made.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Returns the number of voxels along a ray from sample to sample, where a step is so many of them and its world length
    /// depends on the direction: a step is `1 / |d|` times as long, with `d` the ray's unit direction in voxel space. None
    /// where all spacings are equal, and with pre-integration, whose table is made for one length; then every step is
    /// [`Self::step_length`] long.
    pub fn voxels_per_step(&self) -> Option<f64> {
        let spacing = self.volume().spacing();
        let equal = spacing.max_element() <= spacing.min_element() * (1.0 + EQUAL_SPACINGS);
        (!equal && !self.settings.pre_integration).then_some(self.settings.step)
    }

    /// Returns the world length of a step along the axis of smallest spacing: the step that tables are made for.
    pub fn step_length(&self) -> f64 {
        self.settings.step * self.volume().spacing().min_element()
    }

    /// Width and height of the image.
    pub fn resolution(&self) -> (u32, u32) {
        (self.settings.resolution[0], self.settings.resolution[1])
    }

    /// Whether composite samples or surfaces are lit.
    pub fn is_shaded(&self) -> bool {
        self.lighting().shade && matches!(self.settings.mode, Mode::Composite | Mode::Iso)
    }
}
