//! The pipelines: one a variant of the shader, made when it is first needed.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use cutaway_core::scene::{Mode, Scene, SpaceSkipping};

use crate::context::{Capabilities, Filtering, Gpu};
use crate::error::GpuError;
use crate::frame::{FORMATS, Inputs, SamplingVariant, SceneBindings, diffuse_curve};
use crate::plumbing::{RenderSetup, flag, render_pipeline};
use crate::shaders::{Shader, shader};

/// The linked shader.
pub(crate) const SHADER: Shader = shader!(raycast::raycast);

/// What is decided when a shader is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Variant {
    mode: Mode,
    shaded: bool,
    /// Whether clip surfaces are lit, which they are in every mode.
    faces_lit: bool,
    curve: u32,
    filtering: Filtering,
    /// Whether the adapter filters the voxels.
    filterable: bool,
    skip_blocks: bool,
    /// Cells along an edge of a brick, for a volume in bricks.
    brick_edge: Option<u32>,
    proxy: bool,
    sampling: SamplingVariant,
    clipped: bool,
}

impl Variant {
    /// `image_order`: whether blocks are skipped along rays.
    pub(crate) fn of(scene: &Scene, inputs: &Inputs, capabilities: &Capabilities, image_order: bool) -> Self {
        let volume = inputs.volume;
        Self {
            mode: scene.settings().mode,
            shaded: scene.is_shaded(),
            faces_lit: scene.lighting().shade && scene.clip().is_some(),
            curve: diffuse_curve(scene),
            filtering: volume.texels().filtering,
            filterable: volume.texels().filterable(capabilities),
            brick_edge: volume.brick_edge(),
            skip_blocks: image_order && scene.settings().space_skipping != SpaceSkipping::Off,
            proxy: inputs.range.is_some(),
            sampling: SamplingVariant::of(scene),
            clipped: scene.clip().is_some(),
        }
    }

    fn constants(&self) -> Vec<(&'static str, f64)> {
        let mode = match self.mode {
            Mode::Composite => 0.0,
            Mode::Iso => 1.0,
            Mode::Mip => 2.0,
            Mode::Minip => 3.0,
            Mode::Mean => 4.0,
        };
        let mut constants = vec![
            ("MODE", mode),
            ("SHADED", flag(self.shaded)),
            ("FACES_LIT", flag(self.faces_lit)),
            ("DIFFUSE_CURVE", f64::from(self.curve)),
            ("EXACT_FILTERING", flag(self.filtering == Filtering::Exact)),
            ("SKIP_BLOCKS", flag(self.skip_blocks)),
            ("BRICKED", flag(self.brick_edge.is_some())),
            ("BRICK_EDGE", f64::from(self.brick_edge.unwrap_or(1))),
            ("PROXY", flag(self.proxy)),
            ("CLIPPED", flag(self.clipped)),
        ];
        constants.extend(self.sampling.constants());
        constants
    }
}

/// The shader, its bindings, and a pipeline a variant.
#[derive(Debug)]
pub(crate) struct Pipelines {
    shader: wgpu::ShaderModule,
    bindings: SceneBindings,
    made: Mutex<HashMap<Variant, wgpu::RenderPipeline>>,
}

impl Pipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the ray caster's shader", || {
            let shader = SHADER.module(device);
            Self { shader, bindings: SceneBindings::new(gpu), made: Mutex::default() }
        })
    }

    /// What frames are bound to.
    pub(crate) fn bindings(&self) -> &SceneBindings {
        &self.bindings
    }

    /// The pipeline of a variant.
    pub(crate) fn get(&self, gpu: &Gpu, variant: Variant) -> Result<wgpu::RenderPipeline, GpuError> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.get(&variant) {
            return Ok(pipeline.clone());
        }
        let pipeline = gpu.checked("the ray caster's pipeline", || self.pipeline(gpu.device(), variant))?;
        made.insert(variant, pipeline.clone());
        Ok(pipeline)
    }

    fn pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
        let groups = self.bindings.layouts(variant.filterable).map(Some);
        let constants = variant.constants();
        let targets = FORMATS.map(|format| Some(format.into()));
        let setup =
            RenderSetup { label: "raycast", groups: &groups, constants: &constants, targets: &targets };
        render_pipeline(device, &self.shader, ["whole_image", "cast_pixel"], &setup)
    }
}
