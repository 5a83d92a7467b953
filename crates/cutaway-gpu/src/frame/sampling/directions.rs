//! Directions of the gradient, found once a volume on the device: four bytes a voxel, filtered by the adapter, one fetch
//! instead of six. Directions, not gradients, are interpolated, as in the CPU engine's precomputed gradients.

use bytemuck::{Pod, Zeroable};
use cutaway_core::field::vanishing_gradient;
use cutaway_core::volume::Volume;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{COMPUTE, UNIFORM, bind_in_order, compute_pipeline, floats, group_layout_of};
use crate::shaders::{Shader, shader};
use crate::volume::GpuVolume;

/// The linked shader.
pub(crate) const DIRECTIONS_SHADER: Shader = shader!(frame::sampling::directions);

/// A byte a component, of which the fourth is unused: the smallest format that every device can write and filter.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Snorm;

/// Voxels that a software adapter finds directions of in 100 ms at the least, and a GPU.
const VOXELS_AT_ONCE: [u64; 2] = [1 << 20, 1 << 28];

/// `Slab` in `directions.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Slab {
    pub(crate) first: u32,
    pub(crate) vanishing: f32,
    pub(crate) reserved: [u32; 2],
}

/// The directions of a volume.
#[derive(Debug)]
pub(crate) struct GpuDirections {
    view: wgpu::TextureView,
    bytes: u64,
}

impl GpuDirections {
    pub(crate) fn new(gpu: &Gpu, source: &Volume, volume: &GpuVolume) -> Result<Self, GpuError> {
        let dimensions = volume.dimensions();
        let voxels = u64::from(dimensions.x) * u64::from(dimensions.y) * u64::from(dimensions.z);
        let what = "precomputed gradients (`--gradient central` needs no memory)";
        let bytes = voxels * 4;
        // What does not fit in one texture as voxels does not as directions, either.
        if volume.brick_edge().is_some() || bytes > gpu.capabilities().max_texture_bytes {
            return Err(GpuError::OutOfMemory { what: what.to_owned() });
        }
        let texture = gpu.checked(what, || {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("directions"),
                size: wgpu::Extent3d {
                    width: dimensions.x,
                    height: dimensions.y,
                    depth_or_array_layers: dimensions.z,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: FORMAT,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
                view_formats: &[],
            })
        })?;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pipeline = gpu.checked("the shader of precomputed gradients", || pipeline(gpu.device()))?;
        let at_once = VOXELS_AT_ONCE[usize::from(!gpu.adapter().software)];
        let planes = (at_once / (u64::from(dimensions.x) * u64::from(dimensions.y))).clamp(1, 4096) as u32;
        let vanishing = vanishing_difference(source, volume);
        let resident = volume.resident(gpu, source, None)?;
        for first in (0..dimensions.z).step_by(planes as usize) {
            let slab = Slab { first, vanishing, reserved: [0; 2] };
            let groups = [
                dimensions.x.div_ceil(8),
                dimensions.y.div_ceil(4),
                planes.min(dimensions.z - first).div_ceil(2),
            ];
            gpu.checked(what, || dispatch(gpu, &pipeline, slab, [&resident.voxels, &view], groups))?;
        }
        Ok(Self { view, bytes })
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// What counts as no gradient, as a difference over two voxels in texels; as the CPU engine's normals.
fn vanishing_difference(source: &Volume, volume: &GpuVolume) -> f32 {
    let value_per_stored = source.rescale().slope.abs().max(f64::MIN_POSITIVE);
    let stored = vanishing_gradient(source) * source.spacing().min_element() / value_per_stored;
    (2.0 * stored / volume.texels().stored_per_texel) as f32
}

fn pipeline(device: &wgpu::Device) -> wgpu::ComputePipeline {
    let module = DIRECTIONS_SHADER.module(device);
    let written = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: FORMAT,
        view_dimension: wgpu::TextureViewDimension::D3,
    };
    let types = [UNIFORM, floats(false, wgpu::TextureViewDimension::D3), written];
    let group = group_layout_of(device, "directions", COMPUTE, &types);
    compute_pipeline(device, &module, "find_directions", &[Some(&group)], &[])
}

fn dispatch(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    slab: Slab,
    [source, target]: [&wgpu::TextureView; 2],
    [x, y, z]: [u32; 3],
) {
    let device = gpu.device();
    let slab = gpu.buffer("slab", bytemuck::bytes_of(&slab), wgpu::BufferUsages::UNIFORM);
    let views = [source, target].map(wgpu::BindingResource::TextureView);
    let [source, target] = views;
    let resources = [slab.as_entire_binding(), source, target];
    let group = bind_in_order(device, &pipeline.get_bind_group_layout(0), &resources);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(x, y, z);
    }
    gpu.queue().submit([encoder.finish()]);
}
