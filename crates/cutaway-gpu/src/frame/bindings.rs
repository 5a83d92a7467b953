//! What a scene's frame is bound to, whichever engine draws it: bind groups 0 to 2, which the shaders in `shared/` and those
//! of sampling read.

use super::sampling::{GpuDirections, SamplingBindings, SamplingInputs};
use super::uniforms::FrameUniforms;
use crate::classification::GpuClassification;
use crate::context::Gpu;
use crate::plumbing::{
    FRAGMENT, UNIFORM, VERTEX, bind_in_order, floats, group_layout, group_layout_of, sampler, storage,
    texture,
};
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

/// The layouts of the groups, and what is in all of them.
#[derive(Debug)]
pub(crate) struct SceneBindings {
    /// By whether the adapter filters the voxels.
    layouts: [[wgpu::BindGroupLayout; 2]; 2],
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

impl SceneBindings {
    /// To be called within [`Gpu::checked`].
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
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
        Self { layouts, samplers, nothing, sampling }
    }

    /// The layouts of groups 0 to 2: what belongs to the scene, to the image, and to the way of sampling.
    pub(crate) fn layouts(&self, filterable: bool) -> [&wgpu::BindGroupLayout; 3] {
        let [scene, image] = &self.layouts[usize::from(filterable)];
        [scene, image, self.sampling.layout()]
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
            bind_in_order(device, &self.layouts[usize::from(filterable)][group], resources)
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
    use wgpu::TextureViewDimension::{D2, D3};
    let words = storage(true);
    // Where rays are is asked for by vertices, too.
    let scene = [
        (0, VERTEX | FRAGMENT, UNIFORM),
        (1, FRAGMENT, floats(filterable, D3)),
        (2, FRAGMENT, sampler(filterable)),
        (3, FRAGMENT, words),
        (4, FRAGMENT, words),
        (5, FRAGMENT, texture(wgpu::TextureSampleType::Uint, D3)),
        (6, FRAGMENT, words),
    ];
    let image = [floats(false, D2), words, words];
    [group_layout(device, "scene", &scene), group_layout_of(device, "image", FRAGMENT, &image)]
}
