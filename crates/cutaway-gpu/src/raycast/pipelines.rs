//! The pipelines: one a variant of the shader, made when it is first needed, and what they are bound to.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use cutaway_core::lighting::DiffuseCurve;
use cutaway_core::scene::{Mode, Scene, SpaceSkipping};

use super::sampling::{GpuDirections, SamplingBindings, SamplingInputs, SamplingVariant};
use super::targets::FORMATS;
use super::{FrameUniforms, SHADER};
use crate::classification::GpuClassification;
use crate::context::{Capabilities, Filtering, Gpu};
use crate::error::GpuError;
use crate::ranges::GpuRanges;
use crate::volume::{GpuVolume, Resident};

/// What a frame is drawn from.
pub(crate) struct Inputs<'a> {
    pub(crate) volume: &'a GpuVolume,
    pub(crate) classification: &'a GpuClassification,
    /// What its blocks hold.
    pub(crate) blocks: &'a GpuRanges,
    /// Where each ray begins and ends, if not at the volume's box.
    pub(crate) range: Option<&'a wgpu::TextureView>,
    /// Directions of the gradient, where the scene asks for them.
    pub(crate) directions: Option<&'a GpuDirections>,
    /// The ranges and the list of the segments that clipping leaves.
    pub(crate) segments: Option<[&'a wgpu::Buffer; 2]>,
}

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
        let curve = match scene.lighting().diffuse_curve {
            // Without light it does not matter: one pipeline for all. Clip surfaces are lit in every mode.
            _ if !scene.lighting().shade => 1,
            DiffuseCurve::Clamped => 0,
            DiffuseCurve::TwoSided => 1,
            DiffuseCurve::Wrapped => 2,
        };
        Self {
            mode: scene.settings().mode,
            shaded: scene.is_shaded(),
            faces_lit: scene.lighting().shade && scene.clip().is_some(),
            curve,
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
        let flag = |on: bool| f64::from(u8::from(on));
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
    /// By whether the adapter filters the voxels.
    layouts: [[wgpu::BindGroupLayout; 2]; 2],
    made: Mutex<HashMap<Variant, wgpu::RenderPipeline>>,
    samplers: [wgpu::Sampler; 2],
    nothing: Nothing,
    sampling: SamplingBindings,
}

/// What is bound where there is nothing to bind.
#[derive(Debug)]
struct Nothing {
    range: wgpu::TextureView,
    words: wgpu::Buffer,
}

impl Pipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the ray caster's shader", || {
            let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("raycast"),
                source: wgpu::ShaderSource::Wgsl(SHADER.into()),
            });
            let layouts = [false, true].map(|filterable| bind_group_layouts(device, filterable));
            let samplers = [wgpu::FilterMode::Nearest, wgpu::FilterMode::Linear].map(|filter| {
                device.create_sampler(&wgpu::SamplerDescriptor {
                    label: Some("voxels"),
                    mag_filter: filter,
                    min_filter: filter,
                    ..wgpu::SamplerDescriptor::default()
                })
            });
            let sampling = SamplingBindings::new(gpu);
            let nothing = Nothing::new(device);
            Self { shader, layouts, made: Mutex::default(), samplers, nothing, sampling }
        })
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
        let [scene, frame] = &self.layouts[usize::from(variant.filterable)];
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("raycast"),
            bind_group_layouts: &[Some(scene), Some(frame), Some(self.sampling.layout())],
            immediate_size: 0,
        });
        let constants = variant.constants();
        let compilation = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("raycast"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.shader,
                entry_point: Some("whole_image"),
                compilation_options: compilation.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.shader,
                entry_point: Some("cast_pixel"),
                compilation_options: compilation,
                targets: &FORMATS.map(|format| Some(format.into())),
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Binds a frame's inputs: what belongs to the scene, to the image, and to the way of sampling.
    pub(crate) fn bind(
        &self,
        gpu: &Gpu,
        inputs: &Inputs,
        resident: &Resident,
        uniforms: &FrameUniforms,
    ) -> [wgpu::BindGroup; 3] {
        let device = gpu.device();
        let filterable = inputs.volume.texels().filterable(gpu.capabilities());
        let uniforms = gpu.buffer("frame", bytemuck::bytes_of(uniforms), wgpu::BufferUsages::UNIFORM);
        let bind = |group: usize, resources: &[wgpu::BindingResource]| {
            let entries: Vec<wgpu::BindGroupEntry> = (0u32..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
                .collect();
            let layout = &self.layouts[usize::from(filterable)][group];
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        };
        let scene = bind(
            0,
            &[
                uniforms.as_entire_binding(),
                wgpu::BindingResource::TextureView(&resident.voxels),
                wgpu::BindingResource::Sampler(&self.samplers[usize::from(filterable)]),
                inputs.classification.occupied().as_entire_binding(),
                inputs.classification.table().as_entire_binding(),
                wgpu::BindingResource::TextureView(&resident.pages),
                inputs.blocks.words().as_entire_binding(),
            ],
        );
        let nothing = &self.nothing;
        let [ranges, list] = inputs.segments.unwrap_or([&nothing.words; 2]);
        let image = bind(
            1,
            &[
                wgpu::BindingResource::TextureView(inputs.range.unwrap_or(&nothing.range)),
                ranges.as_entire_binding(),
                list.as_entire_binding(),
            ],
        );
        let sampling = SamplingInputs {
            preintegration: inputs.classification.preintegration(),
            directions: inputs.directions,
        };
        [scene, image, self.sampling.bind(gpu, sampling)]
    }
}

impl Nothing {
    fn new(device: &wgpu::Device) -> Self {
        let range = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("no range"),
            size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let words = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("no segments"),
            size: 16,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        Self { range: range.create_view(&wgpu::TextureViewDescriptor::default()), words }
    }
}

fn bind_group_layouts(device: &wgpu::Device, filterable: bool) -> [wgpu::BindGroupLayout; 2] {
    let texture = |dimension, filterable| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: dimension,
        multisampled: false,
    };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let words = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    let sampler =
        if filterable { wgpu::SamplerBindingType::Filtering } else { wgpu::SamplerBindingType::NonFiltering };
    let make = |label, types: &[wgpu::BindingType]| {
        let entries: Vec<wgpu::BindGroupLayoutEntry> = (0u32..)
            .zip(types)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: *ty,
                count: None,
            })
            .collect();
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
    };
    let scene = make(
        "scene",
        &[
            buffer(wgpu::BufferBindingType::Uniform),
            texture(wgpu::TextureViewDimension::D3, filterable),
            wgpu::BindingType::Sampler(sampler),
            words,
            words,
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D3,
                multisampled: false,
            },
            words,
        ],
    );
    let image = make("image", &[texture(wgpu::TextureViewDimension::D2, false), words, words]);
    [scene, image]
}
