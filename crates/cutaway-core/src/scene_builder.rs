//! A scene put together step by step, with a default for everything that nobody chose.
//!
//! ```
//! # use cutaway_core::{clip::Sphere, glam::{DVec3, UVec3}, scene::Scene};
//! # use cutaway_core::volume::{Geometry, Rescale, Volume};
//! # let voxels: Vec<u8> = (0..64).collect();
//! # let volume = Volume::new(UVec3::splat(4), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap();
//! let ball = Sphere::new(DVec3::splat(1.5), 1.0).unwrap();
//! let scene = Scene::of(volume).preset("MR-Default").cut(ball).resolution(640, 480).build().unwrap();
//! assert_eq!(scene.resolution(), (640, 480));
//! ```

use std::sync::Arc;

use crate::camera::Camera;
use crate::clip::{Clip, ClipShading, Node, Object, ObjectId, Solid};
use crate::lighting::Lighting;
use crate::scene::{Data, Engine, Layer, Mode, RenderSettings, Scene, SceneError, default_camera, setting};
use crate::transfer_function::TransferFunction;
use crate::{histogram, presets};

/// A solid, or a tree of solids, that cuts.
pub trait IntoClip {
    /// Returns the tree; `next` is the number of its first object.
    fn into_clip(self, next: u32) -> Clip;
}

impl<S: Solid> IntoClip for S {
    fn into_clip(self, next: u32) -> Clip {
        Clip::object(ObjectId(next), Arc::new(self))
    }
}

impl IntoClip for Arc<dyn Solid> {
    fn into_clip(self, next: u32) -> Clip {
        Node::Leaf(Object { id: ObjectId(next), solid: self }).into()
    }
}

impl IntoClip for Clip {
    fn into_clip(self, _next: u32) -> Clip {
        self
    }
}

/// A scene, or something that becomes one.
pub trait ToScene {
    /// Returns the scene, with every number checked.
    ///
    /// # Errors
    /// The first setting outside its range.
    fn to_scene(&self) -> Result<Scene, SceneError>;
}

impl ToScene for Scene {
    fn to_scene(&self) -> Result<Scene, SceneError> {
        Ok(self.clone())
    }
}

/// Colours and opacities of a scene that is put together.
#[derive(Clone, Debug)]
enum Look {
    /// From the histogram.
    Default,
    /// A preset of this name.
    Preset(String),
    Function(TransferFunction),
}

/// A scene that is put together. Wrong numbers and names are errors of [`Self::build`].
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    data: Data,
    look: Look,
    unit_distance: Option<f64>,
    lighting: Option<Lighting>,
    camera: Option<Camera>,
    /// Turns of the default view in degrees: azimuth and elevation; zoom.
    turned: [f64; 2],
    zoom: f64,
    clip: Option<Clip>,
    objects: u32,
    clip_shading: ClipShading,
    settings: RenderSettings,
    mode: Option<Mode>,
}

impl Scene {
    /// Begins a scene of a volume or an unstructured grid, with defaults for everything else.
    pub fn of(data: impl Into<Data>) -> SceneBuilder {
        SceneBuilder {
            data: data.into(),
            look: Look::Default,
            unit_distance: None,
            lighting: None,
            camera: None,
            turned: [0.0; 2],
            zoom: 1.0,
            clip: None,
            objects: 0,
            clip_shading: ClipShading::default(),
            settings: RenderSettings::default(),
            mode: None,
        }
    }
}

impl SceneBuilder {
    /// Shows values as the preset of this name does: its transfer function, mode and whether it is lit.
    #[must_use]
    pub fn preset(mut self, name: impl Into<String>) -> Self {
        self.look = Look::Preset(name.into());
        self
    }

    /// Shows values with this transfer function.
    #[must_use]
    pub fn transfer_function(mut self, function: &TransferFunction) -> Self {
        self.look = Look::Function(function.clone());
        self
    }

    /// Sets the length in world units that opacities are for. Default: the mean voxel spacing.
    #[must_use]
    pub fn unit_distance(mut self, length: f64) -> Self {
        self.unit_distance = Some(length);
        self
    }

    /// Sets light and material.
    #[must_use]
    pub fn lighting(mut self, lighting: Lighting) -> Self {
        self.lighting = Some(lighting);
        self
    }

    /// Sets the camera. Default: a view that frames the data.
    #[must_use]
    pub fn camera(mut self, camera: Camera) -> Self {
        self.camera = Some(camera);
        self
    }

    /// Turns the camera about the data by these angles in degrees.
    #[must_use]
    pub fn turned(mut self, azimuth: f64, elevation: f64) -> Self {
        self.turned = [azimuth, elevation];
        self
    }

    /// Magnifies the image; above 0.
    #[must_use]
    pub fn zoom(mut self, factor: f64) -> Self {
        self.zoom = factor;
        self
    }

    /// Cuts the inside of an object away. Objects are numbered from 0 in the order of cuts and probes.
    #[must_use]
    pub fn cut(mut self, object: impl IntoClip) -> Self {
        let object = object.into_clip(self.objects);
        self.objects += 1;
        self.clip = Some(self.clip.unwrap_or_else(Clip::everything).cut(object));
        self
    }

    /// Keeps the inside of an object only.
    #[must_use]
    pub fn probe(mut self, object: impl IntoClip) -> Self {
        let object = object.into_clip(self.objects);
        self.objects += 1;
        self.clip = Some(self.clip.unwrap_or_else(Clip::everything).probe(object));
        self
    }

    /// Sets the look of cut surfaces.
    #[must_use]
    pub fn clip_shading(mut self, shading: ClipShading) -> Self {
        self.clip_shading = shading;
        self
    }

    /// Sets width and height of the image in pixels. Default: 512 x 512.
    #[must_use]
    pub fn resolution(mut self, width: u32, height: u32) -> Self {
        self.settings.resolution = [width, height];
        self
    }

    /// Sets the mode. Default: composite, or that of the preset.
    #[must_use]
    pub fn mode(mut self, mode: Mode) -> Self {
        self.mode = Some(mode);
        self
    }

    /// Shows isosurfaces at these values.
    #[must_use]
    pub fn isosurfaces(mut self, values: impl Into<Vec<f64>>) -> Self {
        self.settings.iso = values.into();
        self.mode = Some(Mode::Iso);
        self
    }

    /// Sets the engine. Default: the best one for the data and the machine.
    #[must_use]
    pub fn engine(mut self, engine: Engine) -> Self {
        self.settings.engine = engine;
        self
    }

    /// Sets everything about how the image is made, resolution and engine included.
    #[must_use]
    pub fn settings(mut self, settings: RenderSettings) -> Self {
        self.mode = Some(settings.mode);
        self.settings = settings;
        self
    }

    /// Returns the clip expression so far, to be moved with [`Clip::set_pose`] and given to [`Scene::set_clip`].
    pub fn clip(&self) -> Option<&Clip> {
        self.clip.as_ref()
    }

    /// Returns the scene, with every number checked.
    ///
    /// # Errors
    /// The first setting outside its range, or a preset that does not exist.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let lattice = self.data.lattice();
        let mut settings = self.settings.clone();
        let mut lighting = Lighting::default();
        let mut unit_distance = self.unit_distance;
        settings.mode = self.mode.unwrap_or_default();
        let function = match &self.look {
            Look::Function(function) => function.clone(),
            Look::Default => histogram::default_for_mode(lattice, settings.mode),
            Look::Preset(name) => {
                let unknown = || setting("preset", name, "the name of a preset (`presets::all` lists them)");
                let preset = presets::by_name(name).ok_or_else(unknown)?;
                settings.mode = self.mode.unwrap_or(preset.mode);
                lighting.shade = preset.shade;
                unit_distance = unit_distance.or(preset.unit_distance());
                preset.transfer_function(lattice)
            }
        };
        let lighting = self.lighting.clone().unwrap_or(lighting);
        let layer = Layer::new(&self.data, &function).with_unit_distance(unit_distance);
        let camera = self.view(&settings)?;
        let scene = Scene::new(layer.with_lighting(lighting), camera, settings)?;
        match &self.clip {
            Some(clip) => scene.with_clip(clip, self.clip_shading.clone()),
            None => Ok(scene),
        }
    }

    fn view(&self, settings: &RenderSettings) -> Result<Camera, SceneError> {
        let [width, height] = settings.resolution.map(|side| f64::from(side.max(1)));
        let framing = || default_camera(self.data.lattice(), width / height);
        let mut camera = self.camera.clone().unwrap_or_else(framing);
        // Turning a camera without a direction would make NaN of it.
        camera.validate()?;
        let [azimuth, elevation] = self.turned;
        if !(azimuth.is_finite() && elevation.is_finite()) {
            return Err(setting("turned", format!("{:?}", self.turned), "two angles in degrees"));
        }
        if !(self.zoom > 0.0 && self.zoom.is_finite()) {
            return Err(setting("zoom", self.zoom, "a factor above 0"));
        }
        camera.azimuth(azimuth.to_radians());
        camera.elevation(elevation.to_radians());
        camera.zoom(self.zoom);
        Ok(camera)
    }
}

impl ToScene for SceneBuilder {
    fn to_scene(&self) -> Result<Scene, SceneError> {
        self.build()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, UVec3};

    use super::*;
    use crate::clip::Sphere;
    use crate::volume::{Geometry, Rescale, Volume};

    fn volume() -> Volume {
        let voxels: Vec<u8> = (0..64).collect();
        Volume::new(UVec3::splat(4), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn a_preset_brings_its_mode_unless_another_was_chosen() {
        let scene = Scene::of(volume()).preset("MR-MIP").build().unwrap();
        assert_eq!(scene.settings().mode, Mode::Mip);
        let scene = Scene::of(volume()).preset("MR-MIP").mode(Mode::Composite).build().unwrap();
        assert_eq!(scene.settings().mode, Mode::Composite);
    }

    #[test]
    fn wrong_names_and_numbers_are_errors_of_the_end() {
        let error = |builder: SceneBuilder| builder.build().unwrap_err().to_string();
        assert!(error(Scene::of(volume()).preset("CT-Bonez")).contains("CT-Bonez"));
        assert!(error(Scene::of(volume()).zoom(0.0)).contains("zoom is 0"));
        assert!(error(Scene::of(volume()).resolution(0, 9)).contains("resolution"));
        assert!(error(Scene::of(volume()).turned(f64::NAN, 0.0)).contains("turned"));
        assert!(error(Scene::of(volume()).unit_distance(-1.0)).contains("unit_distance"));
    }

    #[test]
    fn objects_are_numbered_in_their_order() {
        let ball = |r| Sphere::new(DVec3::ONE, r).unwrap();
        let mut clip = Scene::of(volume()).cut(ball(1.0)).probe(ball(2.0)).clip().unwrap().clone();
        let mut ids = Vec::new();
        clip.visit_leaves(&mut |object, _| ids.push(object.id.0));
        ids.sort_unstable();
        assert_eq!(ids, [0, 1]);
    }
}
