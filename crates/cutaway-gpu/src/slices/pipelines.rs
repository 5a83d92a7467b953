//! The pipelines: one a variant of the shaders, made when it is first needed.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use cutaway_core::scene::{Gradient, Mode, Scene};

use super::targets::{Blended, Blending, SliceTargets};
use crate::context::{Filtering, Gpu};
use crate::error::GpuError;
use crate::frame::{FORMATS, SceneBindings, diffuse_curve};
use crate::plumbing::{
    FRAGMENT, UNIFORM, VERTEX, bind_in_order, floats, group_layout_of, pipeline_layout, storage,
};
use crate::shaders::{Shader, shader};
use crate::volume::GpuVolume;

/// The linked shaders.
pub(crate) const SHADER: Shader = shader!(slices::slices);
pub(crate) const DEVELOP_SHADER: Shader = shader!(slices::develop);

/// What is decided when a shader is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    blending: Blending,
    shaded: bool,
    /// Whether clip surfaces are lit, which they are in every mode.
    faces_lit: bool,
    curve: u32,
    gradient: Gradient,
    preintegrated: bool,
    filtering: Filtering,
    /// Whether the adapter filters the voxels.
    filterable: bool,
    /// Cells along an edge of a brick of the atlas, for a volume in bricks.
    brick_edge: Option<u32>,
    clipped: bool,
}

impl Variant {
    pub(super) fn of(gpu: &Gpu, scene: &Scene, volume: &GpuVolume) -> Self {
        let settings = scene.settings();
        let composite = settings.mode == Mode::Composite;
        Self {
            blending: Blending::of(gpu, settings.mode),
            shaded: scene.is_shaded(),
            faces_lit: scene.lighting().shade && scene.clip().is_some(),
            curve: diffuse_curve(scene),
            gradient: if scene.is_shaded() { settings.gradient } else { Gradient::Central },
            preintegrated: composite && settings.pre_integration,
            filtering: volume.texels().filtering,
            filterable: volume.texels().filterable(gpu.capabilities()),
            brick_edge: volume.brick_edge(),
            clipped: scene.clip().is_some(),
        }
    }

    pub(super) fn blending(&self) -> Blending {
        self.blending
    }

    fn slice_constants(&self) -> Vec<(&'static str, f64)> {
        let gradient = match self.gradient {
            Gradient::Central => 0.0,
            Gradient::Sobel => 1.0,
            Gradient::Precomputed => 2.0,
        };
        vec![
            ("SHADED", flag(self.shaded)),
            ("FACES_LIT", flag(self.faces_lit)),
            ("DIFFUSE_CURVE", f64::from(self.curve)),
            ("GRADIENT", gradient),
            ("PREINTEGRATED", flag(self.preintegrated)),
            ("MEAN", flag(self.blending.what == Blended::Sum)),
            ("EXACT_FILTERING", flag(self.filtering == Filtering::Exact)),
            ("BRICKED", flag(self.brick_edge.is_some())),
            ("BRICK_EDGE", f64::from(self.brick_edge.unwrap_or(1))),
            ("CLIPPED", flag(self.clipped)),
        ]
    }

    fn develop_constants(&self) -> [(&'static str, f64); 4] {
        let kind = match self.blending.what {
            Blended::Over => 0.0,
            Blended::Extreme => 1.0,
            Blended::Sum => 2.0,
        };
        [
            ("KIND", kind),
            ("FACES_LIT", flag(self.faces_lit)),
            ("DIFFUSE_CURVE", f64::from(self.curve)),
            ("CLIPPED", flag(self.clipped)),
        ]
    }
}

fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

/// The pipelines of a variant.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) slices: wgpu::RenderPipeline,
    pub(super) develop: wgpu::RenderPipeline,
}

/// The shaders, their bindings, and pipelines.
#[derive(Debug)]
pub(super) struct Pipelines {
    slices: wgpu::ShaderModule,
    develop: wgpu::ShaderModule,
    bindings: SceneBindings,
    slice_layout: wgpu::BindGroupLayout,
    develop_layout: wgpu::BindGroupLayout,
    made: Mutex<HashMap<Variant, Made>>,
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        gpu.checked("the slice renderer's shaders", || {
            let device = gpu.device();
            let blended = floats(false, wgpu::TextureViewDimension::D2);
            let layout =
                |stages, types: &[wgpu::BindingType]| group_layout_of(device, "slices", stages, types);
            Self {
                slices: SHADER.module(device),
                develop: DEVELOP_SHADER.module(device),
                bindings: SceneBindings::new(gpu),
                slice_layout: layout(VERTEX | FRAGMENT, &[UNIFORM, storage(true)]),
                develop_layout: layout(FRAGMENT, &[UNIFORM, blended, blended]),
                made: Mutex::default(),
            }
        })
    }

    pub(super) fn bindings(&self) -> &SceneBindings {
        &self.bindings
    }

    /// The pipelines of a variant.
    pub(super) fn get(&self, gpu: &Gpu, variant: Variant) -> Result<Made, GpuError> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = made.get(&variant) {
            return Ok(found.clone());
        }
        let new = gpu.checked("the slice renderer's pipelines", || Made {
            slices: self.slice_pipeline(gpu.device(), variant),
            develop: self.develop_pipeline(gpu.device(), variant),
        })?;
        made.insert(variant, new.clone());
        Ok(new)
    }

    fn slice_pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
        let blending = variant.blending;
        let targets: Vec<_> = (blending.formats().iter())
            .map(|format| {
                Some(wgpu::ColorTargetState {
                    format: *format,
                    blend: Some(blending.state()),
                    write_mask: wgpu::ColorWrites::ALL,
                })
            })
            .collect();
        let entry = if blending.what == Blended::Over { "blend_slice" } else { "project_slice" };
        let made = Draw {
            label: "slices",
            shader: &self.slices,
            own: &self.slice_layout,
            entries: ["slice_corner", entry],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            constants: &variant.slice_constants(),
            targets: &targets,
        };
        self.pipeline(device, variant, &made)
    }

    fn develop_pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
        let made = Draw {
            label: "develop",
            shader: &self.develop,
            own: &self.develop_layout,
            entries: ["whole_target", "develop"],
            topology: wgpu::PrimitiveTopology::TriangleList,
            constants: &variant.develop_constants(),
            targets: &FORMATS.map(|format| Some(format.into())),
        };
        self.pipeline(device, variant, &made)
    }

    fn pipeline(&self, device: &wgpu::Device, variant: Variant, draw: &Draw) -> wgpu::RenderPipeline {
        let [scene, image, sampling] = self.bindings.layouts(variant.filterable);
        let groups = [Some(scene), Some(image), Some(sampling), Some(draw.own)];
        let layout = pipeline_layout(device, draw.label, &groups);
        let compilation =
            wgpu::PipelineCompilationOptions { constants: draw.constants, ..Default::default() };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(draw.label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: draw.shader,
                entry_point: Some(draw.entries[0]),
                compilation_options: compilation.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: draw.topology, ..wgpu::PrimitiveState::default() },
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: draw.shader,
                entry_point: Some(draw.entries[1]),
                compilation_options: compilation,
                targets: draw.targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Binds the uniforms and bricks of a frame's slices. To be called within [`Gpu::checked`].
    pub(super) fn bind_slices(
        &self,
        gpu: &Gpu,
        uniforms: &wgpu::Buffer,
        bricks: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        bind_in_order(
            gpu.device(),
            &self.slice_layout,
            &[uniforms.as_entire_binding(), bricks.as_entire_binding()],
        )
    }

    /// Binds what slices were blended into. To be called within [`Gpu::checked`].
    pub(super) fn bind_blended(
        &self,
        gpu: &Gpu,
        uniforms: &wgpu::Buffer,
        targets: &SliceTargets,
    ) -> wgpu::BindGroup {
        let [color, distance] = targets.views().map(wgpu::BindingResource::TextureView);
        bind_in_order(gpu.device(), &self.develop_layout, &[uniforms.as_entire_binding(), color, distance])
    }
}

/// What tells one pipeline from another.
struct Draw<'a> {
    label: &'a str,
    shader: &'a wgpu::ShaderModule,
    /// The layout of group 3.
    own: &'a wgpu::BindGroupLayout,
    entries: [&'a str; 2],
    topology: wgpu::PrimitiveTopology,
    constants: &'a [(&'a str, f64)],
    targets: &'a [Option<wgpu::ColorTargetState>],
}
