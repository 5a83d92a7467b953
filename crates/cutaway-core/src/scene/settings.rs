//! How an image is made: numbers and choices, with their defaults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::choices::{Engine, Gradient, ImageInterpolation, Layout, Mode, Sampling, SpaceSkipping};
use crate::clip::{BufferDepth, ClipEvents, SegmentCount};

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
    /// Distance between samples in voxels along the ray; above 0.
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
