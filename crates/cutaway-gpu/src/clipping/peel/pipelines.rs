//! The pipelines of depth peeling, and what they are bound to.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use cutaway_core::clip::BufferDepth;

use super::textures::{DEPTH_FORMAT, ENDS_FORMAT, TRIANGLE_FORMAT, layer_format};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::shaders::{Shader, shader};

/// The linked shader that peels meshes into layers.
pub(crate) const PEEL_SHADER: Shader = shader!(clipping::peel);
/// The linked shader that counts what layers cover.
pub(crate) const PEEL_COUNT_SHADER: Shader = shader!(clipping::peel_count);

/// What a pass does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum PassKind {
    /// Sums up what lies before and behind the volume.
    Ends,
    /// Keeps the nearest fragments that are left, or the farthest.
    Layer {
        /// Which faces are drawn; the others are culled.
        front: bool,
        /// Not the nearest but the farthest.
        farthest: bool,
        depth: BufferDepth,
    },
}

#[derive(Debug)]
pub(super) struct Pipelines {
    shader: wgpu::ShaderModule,
    /// Frame, leaves, mesh, the pass before.
    layouts: [wgpu::BindGroupLayout; 4],
    made: Mutex<HashMap<PassKind, wgpu::RenderPipeline>>,
    pub(super) count: wgpu::ComputePipeline,
    pub(super) count_layout: wgpu::BindGroupLayout,
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the shaders of depth peeling", || {
            let shader = PEEL_SHADER.module(device);
            let layouts = layouts(device);
            let count_layout = count_layout(device);
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("count layers"),
                bind_group_layouts: &[Some(&count_layout)],
                immediate_size: 0,
            });
            let count = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("count layers"),
                layout: Some(&layout),
                module: &PEEL_COUNT_SHADER.module(device),
                entry_point: Some("count_layer"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            Self { shader, layouts, made: Mutex::default(), count, count_layout }
        })
    }

    /// The pipeline of a kind of pass.
    pub(super) fn get(&self, gpu: &Gpu, kind: PassKind) -> Result<wgpu::RenderPipeline, GpuError> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.get(&kind) {
            return Ok(pipeline.clone());
        }
        let pipeline = gpu.checked("a pipeline of depth peeling", || self.make(gpu.device(), kind))?;
        made.insert(kind, pipeline.clone());
        Ok(pipeline)
    }

    fn make(&self, device: &wgpu::Device, kind: PassKind) -> wgpu::RenderPipeline {
        let [frame, leaves, mesh, before] = &self.layouts;
        let groups = [Some(frame), Some(leaves), Some(mesh), Some(before)];
        let used = if kind == PassKind::Ends { 3 } else { 4 };
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("peel"),
            bind_group_layouts: &groups[..used],
            immediate_size: 0,
        });
        let (entry, targets, cull_mode, depth_stencil, half) = match kind {
            PassKind::Ends => ("count_ends", vec![Some(summed())], None, None, false),
            PassKind::Layer { front, farthest, depth } => {
                let culled = if front { wgpu::Face::Back } else { wgpu::Face::Front };
                let targets = vec![Some(layer_format(depth).into()), Some(TRIANGLE_FORMAT.into())];
                let half = depth == BufferDepth::Half;
                ("peel_fragment", targets, Some(culled), Some(depth_test(farthest)), half)
            }
        };
        let constants = [("HALF", f64::from(u8::from(half)))];
        let constants = if kind == PassKind::Ends { &[][..] } else { &constants };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("peel"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.shader,
                entry_point: Some("peeled_corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { cull_mode, ..wgpu::PrimitiveState::default() },
            depth_stencil,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.shader,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// The layouts of what a pass is bound to: frame, leaves, mesh, the pass before.
    pub(super) fn layouts(&self) -> &[wgpu::BindGroupLayout; 4] {
        &self.layouts
    }
}

/// Added up, pixel by pixel.
fn summed() -> wgpu::ColorTargetState {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::ColorTargetState {
        format: ENDS_FORMAT,
        blend: Some(wgpu::BlendState { color: add, alpha: add }),
        write_mask: wgpu::ColorWrites::ALL,
    }
}

/// Of equally deep fragments the first that is drawn stays: that of the first triangle.
fn depth_test(farthest: bool) -> wgpu::DepthStencilState {
    let compare = if farthest { wgpu::CompareFunction::Greater } else { wgpu::CompareFunction::Less };
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

fn entry(binding: u32, visibility: wgpu::ShaderStages, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

const UNFILTERED: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

fn layouts(device: &wgpu::Device) -> [wgpu::BindGroupLayout; 4] {
    let make = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
    };
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let words = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    let plane = wgpu::TextureViewDimension::D2;
    [
        make("peel frame", &[entry(0, fragment, buffer(wgpu::BufferBindingType::Uniform))]),
        make("peel leaves", &[entry(1, vertex | fragment, words)]),
        make("peel mesh", &[0, 1, 2].map(|binding| entry(binding, vertex, words))),
        make(
            "peel before",
            &[
                // Depths are bound as floats that are not filtered.
                entry(0, fragment, texture(UNFILTERED, plane)),
                entry(1, fragment, texture(wgpu::TextureSampleType::Uint, plane)),
            ],
        ),
    ]
}

fn count_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let compute = wgpu::ShaderStages::COMPUTE;
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("count layers"),
        entries: &[
            entry(0, compute, texture(UNFILTERED, wgpu::TextureViewDimension::D2)),
            entry(1, compute, buffer(wgpu::BufferBindingType::Storage { read_only: false })),
        ],
    })
}

/// What the sweep over layers reads them through: `group(2)` of `sweep_peel.wgsl`.
pub(super) fn sweep_bindings() -> [wgpu::BindingType; 3] {
    let array = texture(UNFILTERED, wgpu::TextureViewDimension::D2Array);
    [array, array, buffer(wgpu::BufferBindingType::Storage { read_only: true })]
}
