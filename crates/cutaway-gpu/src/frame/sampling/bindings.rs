//! Bind group 2: what only some ways of sampling need.

use cutaway_core::blue_noise;

use super::directions::GpuDirections;
use super::tables::GpuPreintegration;
use crate::context::Gpu;
use crate::plumbing::{FRAGMENT, bind_in_order, floats, group_layout_of, sampler, storage};

/// The layout of the group, and what is bound where a scene needs nothing.
#[derive(Debug)]
pub(crate) struct SamplingBindings {
    layout: wgpu::BindGroupLayout,
    /// The tile of blue noise: 4 KiB, for every scene.
    noise: wgpu::TextureView,
    no_table: wgpu::Buffer,
    no_directions: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

/// What a scene's way of sampling has been given.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SamplingInputs<'a> {
    pub(crate) preintegration: Option<&'a GpuPreintegration>,
    pub(crate) directions: Option<&'a GpuDirections>,
}

impl SamplingBindings {
    /// To be called within [`Gpu::checked`].
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let no_table = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("no integrals"),
            size: 32,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let one = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
        let no_directions = texture(device, "no directions", wgpu::TextureDimension::D3, one);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("directions"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        Self {
            layout: layout(device),
            noise: noise(gpu),
            no_table,
            no_directions: no_directions.create_view(&wgpu::TextureViewDescriptor::default()),
            sampler,
        }
    }

    pub(crate) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The group of a frame. To be called within [`Gpu::checked`].
    pub(crate) fn bind(&self, gpu: &Gpu, inputs: SamplingInputs) -> wgpu::BindGroup {
        let [bins, integrals] = inputs.preintegration.map_or([&self.no_table; 2], GpuPreintegration::buffers);
        let directions = inputs.directions.map_or(&self.no_directions, GpuDirections::view);
        let resources = [
            bins.as_entire_binding(),
            integrals.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.noise),
            wgpu::BindingResource::TextureView(directions),
            wgpu::BindingResource::Sampler(&self.sampler),
        ];
        bind_in_order(gpu.device(), &self.layout, &resources)
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    use wgpu::TextureViewDimension::{D2, D3};
    let types = [storage(true), storage(true), floats(false, D2), floats(true, D3), sampler(true)];
    group_layout_of(device, "sampling", FRAGMENT, &types)
}

/// One byte a texel in 2D, four of a direction in 3D.
fn texture(
    device: &wgpu::Device,
    label: &str,
    dimension: wgpu::TextureDimension,
    size: wgpu::Extent3d,
) -> wgpu::Texture {
    let format = match dimension {
        wgpu::TextureDimension::D3 => super::directions::FORMAT,
        _ => wgpu::TextureFormat::R8Unorm,
    };
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn noise(gpu: &Gpu) -> wgpu::TextureView {
    let side = blue_noise::SIDE;
    let size = wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 };
    let texture = texture(gpu.device(), "blue noise", wgpu::TextureDimension::D2, size);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(side), rows_per_image: None };
    gpu.queue().write_texture(texture.as_image_copy(), blue_noise::TILE.as_slice(), layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
