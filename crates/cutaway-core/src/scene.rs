//! A scene: everything that decides an image, and its form in a file.
//!
//! [`Scene`] is what renderers take: a volume in memory and settings that have been checked. [`SceneFile`] is what a
//! JSON file says; paths in it are relative to the file.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Camera, CameraError};
use crate::clip::{
    BufferDepth, Clip, ClipEvents, ClipFile, ClipShading, FlatClip, Impregnation, PoseError, SegmentCount,
    SegmentLimit,
};
use crate::image::blur::LARGEST_SIGMA;
use crate::lighting::Lighting;
use crate::space::WorldFrame;
use crate::transfer_function::{ControlPoint, TransferFunction};
use crate::volume::Volume;

/// What a ray makes of the values along it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Emission and absorption, front to back.
    #[default]
    Composite,
    /// Surfaces of constant value (`iso`).
    Iso,
    /// Maximum of the value, then classified.
    Mip,
    /// Minimum of the value, then classified.
    Minip,
    /// Mean of the value over the kept length, then classified.
    Mean,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 5] = [Self::Composite, Self::Iso, Self::Mip, Self::Minip, Self::Mean];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Composite => "composite",
            Self::Iso => "iso",
            Self::Mip => "mip",
            Self::Minip => "minip",
            Self::Mean => "mean",
        }
    }
}

/// Which renderer makes the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// The best one here.
    #[default]
    Auto,
    /// The CPU ray caster.
    Cpu,
    /// The GPU ray caster.
    Raycast,
    /// Slices across the view, blended on the GPU.
    Slices,
    /// Projected tetrahedra, blended on the GPU: grids, and unstructured grids, which no other engine takes.
    Cells,
    /// The slow, exact renderer that the others are held against.
    Reference,
}

impl Engine {
    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Raycast => "raycast",
            Self::Slices => "slices",
            Self::Cells => "cells",
            Self::Reference => "reference",
        }
    }
}

/// How empty space is skipped. All ways give the same image.
///
/// The GPU ray caster begins and ends its rays at the surface of a *proxy geometry* of cells that can be visible (Termeer,
/// figure 4.8), and crosses what is empty in between block by block. The other engines have no use for a proxy: to them
/// every way but [`Self::Off`] is [`Self::Auto`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpaceSkipping {
    /// Every sample inside the volume is taken.
    Off,
    /// Proxy: all cells that can be visible, as boxes.
    Cells,
    /// Proxy: the same, each shrunk to what can be visible in it.
    Fitted,
    /// Proxy: those that touch a cell that cannot be visible, or the volume's border.
    Boundary,
    /// Proxy: only the faces between cells that can be visible and cells that cannot.
    Contour,
    /// Proxy: shrunk cells, without the faces that two of them share.
    FittedContour,
    /// Blocks that cannot be visible are crossed without a sample, in the way that is fastest.
    #[default]
    Auto,
}

impl SpaceSkipping {
    /// Every way.
    pub const ALL: [Self; 7] = [
        Self::Off,
        Self::Cells,
        Self::Fitted,
        Self::Boundary,
        Self::Contour,
        Self::FittedContour,
        Self::Auto,
    ];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Cells => "cells",
            Self::Fitted => "fitted",
            Self::Boundary => "boundary",
            Self::Contour => "contour",
            Self::FittedContour => "fitted-contour",
            Self::Auto => "auto",
        }
    }
}

/// Where along a ray samples lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// A fixed step apart, from where the ray enters the volume.
    #[default]
    View,
    /// On the planes of voxels across the axis that the ray follows most (Termeer 4.1.1): there the field is bilinear. The
    /// step is that between planes, whatever `step` says.
    Object,
}

/// How the gradient for lighting is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Gradient {
    /// Central differences of the voxels, interpolated.
    #[default]
    Central,
    /// The same smoothed across by 1 2 1 along the two other axes: calmer on noisy data, softer on fine detail.
    Sobel,
    /// Directions of central differences, computed once a volume and kept in 32 bits a voxel, then interpolated.
    Precomputed,
}

/// How the voxels lie in memory while an image is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// As they came: x fastest, then y, then z. Needs no preparation.
    #[default]
    Linear,
    /// In bricks with copies of their neighbours' nearest voxels: what a ray needs is near itself in memory.
    Bricks,
}

/// Which pixels the CPU engine casts, and which it fills in between them. The reference casts every pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ImageInterpolation {
    /// Every pixel is cast.
    #[default]
    Off,
    /// A coarse lattice of pixels is cast; what lies between is filled where colour, opacity and depth allow it, and cast
    /// where they do not.
    Adaptive,
    /// Every so many pixels along x and y are cast, whatever lies between: 2 to 16.
    #[serde(untagged)]
    Factor(u32),
}

impl ImageInterpolation {
    /// The factors that there are.
    pub const FACTORS: std::ops::RangeInclusive<u32> = 2..=16;
}

/// How an image is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSettings {
    /// What a ray makes of the values along it.
    pub mode: Mode,
    /// Isovalues, in the volume's units; `iso` mode needs at least one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub iso: Vec<f64>,
    /// Opacity of isosurfaces, above 0 and at most 1.
    pub iso_opacity: f64,
    /// Distance of samples in units of the smallest voxel spacing; above 0.
    pub step: f64,
    /// Which renderer makes the image.
    pub engine: Engine,
    /// Width and height of the image in pixels.
    pub resolution: [u32; 2],
    /// Accumulated opacity at which a ray ends, above 0 and at most 1.
    pub early_termination: f64,
    /// How empty space is skipped.
    pub space_skipping: SpaceSkipping,
    /// Which pixels are cast, and which are filled in between them: `off`, `adaptive` or a number of 2 to 16.
    pub image_interpolation: ImageInterpolation,
    /// Factor of every opacity, 0 or more.
    pub brightness: f64,
    /// Where along a ray samples lie.
    pub sampling: Sampling,
    /// A step is cut into finer ones where opacity or colour differ by more than this from one sample to the next, 0 to 1;
    /// none: never.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive_threshold: Option<f64>,
    /// Whether a step stands for the integral between its ends instead of the value in its middle.
    pub pre_integration: bool,
    /// How the gradient for lighting is found.
    pub gradient: Gradient,
    /// How the voxels lie in memory while the image is made.
    pub layout: Layout,
    /// How many of the segments that clipping leaves of a ray are used.
    pub segments: SegmentCount,
    /// Whether the last of a limited number of segments goes on to the backmost surface.
    pub backmost: bool,
    /// Whether steps begin a fixed, pixel by pixel different share of a step later, which turns rings into noise (Termeer
    /// 4.2.5). GPU engines only.
    pub jitter: bool,
    /// Sigma in pixels of a Gaussian that the finished image is blurred by, 0 (not at all) to 64.
    pub blur: f64,
    /// How clip meshes are asked where rays cross them. What an engine does not have its own way stands in for.
    pub clip_events: ClipEvents,
    /// Bits of a number in the layers that clip surfaces are peeled into, 16 or 32; for `clip_events` peel only.
    pub buffer_depth: BufferDepth,
    /// Cells along an edge of the bricks that the slice renderer draws or leaves out, a power of two of 8 to 1024; 0: the
    /// volume is one brick. Larger where there would be more than a million bricks; all sizes give the same image.
    pub brick_size: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            iso: Vec::new(),
            iso_opacity: 1.0,
            step: 0.5,
            engine: Engine::default(),
            resolution: [512, 512],
            early_termination: 0.999,
            space_skipping: SpaceSkipping::default(),
            image_interpolation: ImageInterpolation::default(),
            brightness: 1.0,
            sampling: Sampling::default(),
            adaptive_threshold: None,
            pre_integration: false,
            gradient: Gradient::default(),
            layout: Layout::default(),
            segments: SegmentCount::default(),
            backmost: false,
            jitter: false,
            blur: 0.0,
            clip_events: ClipEvents::default(),
            buffer_depth: BufferDepth::default(),
            brick_size: 16,
        }
    }
}

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

/// A volume and how to look at it.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    volume: &'a Volume,
    transfer_function: TransferFunction,
    unit_distance: f64,
    camera: Camera,
    lighting: Lighting,
    settings: RenderSettings,
    clip: Option<FlatClip>,
    clip_shading: ClipShading,
}

impl<'a> Scene<'a> {
    /// Checks every number, so that renderers need not. `unit_distance` (world length that the transfer function's
    /// opacities are for) defaults to the mean voxel spacing.
    pub fn new(
        volume: &'a Volume,
        transfer_function: &TransferFunction,
        unit_distance: Option<f64>,
        camera: Camera,
        lighting: Lighting,
        settings: RenderSettings,
    ) -> Result<Self, SceneError> {
        let unit_distance = unit_distance.unwrap_or_else(|| default_unit_distance(volume));
        if volume.dimensions().min_element() < 2 {
            return Err(SceneError::Flat { dimensions: volume.dimensions().to_array() });
        }
        if !(1e-30..=1e30).contains(&unit_distance) {
            return Err(setting("unit_distance", unit_distance, "a length above 0, of 1e-30 to 1e30"));
        }
        camera.validate()?;
        validate_lighting(&lighting)?;
        validate_settings(&settings)?;
        let transfer_function = transfer_function.with_brightness(settings.brightness);
        let (clip, clip_shading) = (None, ClipShading::default());
        Ok(Self { volume, transfer_function, unit_distance, camera, lighting, settings, clip, clip_shading })
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
        self.clip = clip.map(FlatClip::new).transpose()?;
        Ok(())
    }

    /// What is shown of the volume; none: all of it.
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
        let depth = self.clip_shading.thickness * self.volume.spacing().min_element();
        let used = self.clip_shading.impregnation != Impregnation::None && depth > 0.0;
        used.then_some(depth)
    }

    /// The volume.
    pub fn volume(&self) -> &'a Volume {
        self.volume
    }

    /// The transfer function, brightness already applied.
    pub fn transfer_function(&self) -> &TransferFunction {
        &self.transfer_function
    }

    /// The world length that opacities are for.
    pub fn unit_distance(&self) -> f64 {
        self.unit_distance
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
        &self.lighting
    }

    /// How the image is made.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Distance of samples along a ray, in world units.
    pub fn step_length(&self) -> f64 {
        self.settings.step * self.volume.spacing().min_element()
    }

    /// Width and height of the image.
    pub fn resolution(&self) -> (u32, u32) {
        (self.settings.resolution[0], self.settings.resolution[1])
    }

    /// Whether composite samples or surfaces are lit.
    pub fn is_shaded(&self) -> bool {
        self.lighting.shade && matches!(self.settings.mode, Mode::Composite | Mode::Iso)
    }
}

/// The unit distance that a scene has unless it says otherwise: the mean voxel spacing, in world units.
pub fn default_unit_distance(volume: &Volume) -> f64 {
    volume.spacing().element_sum() / 3.0
}

/// The view of a volume that nobody asked for another one of: all of it, from the front, a little from the side and
/// from above. Front is the patient's where the file tells, else the side of small y. `aspect`: width / height.
pub fn default_camera(volume: &Volume, aspect: f64) -> Camera {
    let forward = match volume.geometry().frame {
        WorldFrame::Ras => DVec3::new(0.42, -0.85, -0.25),
        WorldFrame::Unknown => DVec3::new(0.42, 0.85, -0.3),
    };
    Camera::framing(&volume.corners_in_world(), forward, DVec3::Z, aspect, 1.05)
}

pub(crate) fn setting(field: &'static str, found: impl ToString, expected: &'static str) -> SceneError {
    SceneError::Setting { field, found: found.to_string(), expected }
}

fn positive(field: &'static str, found: f64) -> Result<(), SceneError> {
    if found > 0.0 && found.is_finite() { Ok(()) } else { Err(setting(field, found, "a number above 0")) }
}

fn validate_settings(s: &RenderSettings) -> Result<(), SceneError> {
    positive("step", s.step)?;
    if !(1e-3..=1e6).contains(&s.step) {
        return Err(setting(
            "step",
            s.step,
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
        return Err(setting("early_termination", s.early_termination, "more than 0 and at most 1"));
    }
    if !share(s.iso_opacity) {
        return Err(setting("iso_opacity", s.iso_opacity, "more than 0 and at most 1"));
    }
    if !(s.brightness >= 0.0 && s.brightness.is_finite()) {
        return Err(setting("brightness", s.brightness, "a number of 0 or more"));
    }
    if let Some(t) = s.adaptive_threshold.filter(|t| !(0.0..=1.0).contains(t)) {
        return Err(setting("adaptive_threshold", t, "a difference of 0 to 1"));
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
        return Err(setting("blur", s.blur, "0 to 64 pixels"));
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
        Some(v) => Err(setting("iso", v, "finite numbers")),
        None => Ok(()),
    }
}

/// Kernels compute in f32: products of factors must stay far from its end.
const LARGEST_FACTOR: f64 = 1e6;

fn validate_lighting(l: &Lighting) -> Result<(), SceneError> {
    let factors = [
        ("ambient", l.ambient),
        ("diffuse", l.diffuse),
        ("specular", l.specular),
        ("specular_power", l.specular_power),
    ];
    for (field, v) in factors {
        if !(0.0..=LARGEST_FACTOR).contains(&v) {
            return Err(setting(field, v, "0 to 1000000"));
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

/// A transfer function in a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferFunctionFile {
    /// The world length that the opacities are for; the mean voxel spacing unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_distance: Option<f64>,
    /// The points; values must not decrease.
    pub points: Vec<ControlPoint>,
}

/// Where a scene file finds its volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum VolumeSource {
    /// A path, relative to the scene file, or `sample:NAME`.
    Path(String),
    /// A raw file with what its name does not tell.
    Described(RawVolumeSource),
}

/// A volume file with a description of its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawVolumeSource {
    /// Path, relative to the scene file.
    pub path: String,
    /// World units a voxel along x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<[f64; 3]>,
    /// Voxels along x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dims: Option<[u32; 3]>,
    /// `uint8`, `int16`, `float32`, ...
    #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
    pub voxel_type: Option<String>,
    /// Whether the most significant byte comes first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub big_endian: Option<bool>,
    /// Bytes before the first voxel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub header_bytes: Option<u64>,
}

/// A scene as a JSON file holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// The volume.
    pub volume: VolumeSource,
    /// What values look like; made from the volume's histogram unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer_function: Option<TransferFunctionFile>,
    /// Where it is seen from; a view that frames the volume unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// Light and material.
    #[serde(default)]
    pub lighting: Lighting,
    /// What is kept of the volume; all of it unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<ClipFile>,
    /// What clip surfaces look like.
    #[serde(default)]
    pub clip_shading: ClipShading,
    /// How the image is made.
    #[serde(default)]
    pub render: RenderSettings,
    /// What a viewer keeps beside the picture: names, what is hidden, panes. Nothing in it changes an image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viewer: Option<serde_json::Value>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = r#"{
        "volume": "engine_256x256x128_uint8.raw",
        "transfer_function": { "unit_distance": 1.0, "points": [
            { "value": 80, "color": [0.9, 0.7, 0.5], "opacity": 0.0 },
            { "value": 200, "color": [1, 1, 1], "opacity": 0.4 } ] },
        "camera": { "position": [0, -600, 120], "focal_point": [127.5, 127.5, 63.5], "view_up": [0, 0, 1], "view_angle": 30 },
        "lighting": { "shade": true, "ambient": 0.1, "diffuse": 0.9, "specular": 0.2, "specular_power": 10, "diffuse_curve": "two-sided" },
        "clip": { "difference": [ "volume", { "mesh": "bunny.ply", "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] } ] },
        "clip_shading": { "impregnation": "linear", "thickness": 3, "overlay": 0.0 },
        "render": { "mode": "composite", "step": 0.5, "engine": "cpu", "resolution": [512, 512] }
    }"#;

    #[test]
    fn the_documented_scene_is_read_and_written_without_loss() {
        let scene: SceneFile = serde_json::from_str(EXAMPLE).unwrap();
        assert_eq!(scene.render.engine, Engine::Cpu);
        let again: SceneFile = serde_json::from_str(&serde_json::to_string(&scene).unwrap()).unwrap();
        assert_eq!(scene, again);
    }

    #[test]
    fn a_raw_volume_can_be_described() {
        let text =
            r#"{ "volume": { "path": "a.bin", "dims": [2, 3, 4], "type": "int16", "big_endian": true } }"#;
        let scene: SceneFile = serde_json::from_str(text).unwrap();
        let VolumeSource::Described(raw) = scene.volume else { panic!("not described") };
        assert_eq!((raw.dims, raw.voxel_type.as_deref()), (Some([2, 3, 4]), Some("int16")));
    }

    #[test]
    fn what_does_not_exist_is_refused_by_name() {
        let error = serde_json::from_str::<SceneFile>(r#"{ "volume": "a", "clipp": {} }"#).unwrap_err();
        assert!(error.to_string().contains("`clipp`"), "{error}");
    }

    #[test]
    fn image_interpolation_is_a_name_or_a_number() {
        let all = [
            ("\"off\"", ImageInterpolation::Off),
            ("\"adaptive\"", ImageInterpolation::Adaptive),
            ("3", ImageInterpolation::Factor(3)),
        ];
        for (text, setting) in all {
            assert_eq!(serde_json::from_str::<ImageInterpolation>(text).unwrap(), setting);
            assert_eq!(serde_json::to_string(&setting).unwrap(), text);
        }
        for wrong in ["\"on\"", "2.5", "-2", "true", "{}"] {
            assert!(serde_json::from_str::<ImageInterpolation>(wrong).is_err(), "{wrong}");
        }
    }

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
