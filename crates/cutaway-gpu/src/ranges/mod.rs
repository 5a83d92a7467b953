//! Value ranges on the device: the least and greatest texel of every block of a volume, and what follows from them.
//!
//! Enters: a volume's texture. Leaves: a word a block, two 16-bit unorm that contain every value that interpolation can make
//! inside the block; fine blocks, then coarse ones ([`BlockLevels`]). They are made once a volume, in slabs, and no voxel is
//! read again: an edit of the transfer function goes from ranges to bits ([`Occupancy`]), and rays that look for an extreme
//! value compare ranges with what they have.

mod levels;
mod occupancy;
#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::UVec3;
use wgpu::util::DeviceExt;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::volume::GpuVolume;
pub(crate) use levels::BlockLevels;
#[cfg(test)]
pub(crate) use occupancy::OccupancyTask;
pub(crate) use occupancy::{Criterion, Occupancy};

/// The linked shaders.
pub(crate) const RANGES_SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/ranges_value_ranges.wgsl"));
pub(crate) const OCCUPANCY_SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/ranges_occupancy.wgsl"));

/// Voxels that a software adapter reads in 100 ms at the least (two cores), and a GPU.
const VOXELS_AT_ONCE: [u64; 2] = [8_000_000, 1_000_000_000];

/// As `RangesTask` in `value_ranges.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct RangesTask {
    pub(crate) dimensions: [u32; 3],
    pub(crate) edge: u32,
    pub(crate) blocks: [u32; 3],
    pub(crate) first_layer: u32,
    pub(crate) coarse_blocks: [u32; 3],
    pub(crate) fine_per_coarse: u32,
}

/// The ranges of a volume's blocks.
#[derive(Debug)]
pub(crate) struct GpuRanges {
    levels: BlockLevels,
    words: wgpu::Buffer,
}

impl GpuRanges {
    /// The blocks that there are.
    pub(crate) fn levels(&self) -> BlockLevels {
        self.levels
    }

    /// A word a block: fine ones, then coarse ones.
    pub(crate) fn words(&self) -> &wgpu::Buffer {
        &self.words
    }

    /// What they take of the device's memory.
    pub(crate) fn bytes(&self) -> u64 {
        self.words.size()
    }
}

/// The pipelines that make ranges and occupancy.
#[derive(Debug)]
pub(crate) struct BlockPipelines {
    /// By whether the voxels can be filtered: what they are bound as.
    voxels: [wgpu::BindGroupLayout; 2],
    task: wgpu::BindGroupLayout,
    ranges: wgpu::ShaderModule,
    occupancy: occupancy::Pipelines,
}

impl BlockPipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the shaders of blocks", || {
            let ranges = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("value ranges"),
                source: wgpu::ShaderSource::Wgsl(RANGES_SHADER.into()),
            });
            let voxels = [false, true].map(|filterable| {
                let texture = wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable },
                    view_dimension: wgpu::TextureViewDimension::D3,
                    multisampled: false,
                };
                layout(device, "voxels", &[(1, texture)])
            });
            let task = layout(device, "ranges", &[(0, UNIFORM), (1, storage(false))]);
            Self { voxels, task, ranges, occupancy: occupancy::Pipelines::new(device) }
        })
    }

    /// The pipelines of occupancy.
    pub(crate) fn occupancy(&self) -> &occupancy::Pipelines {
        &self.occupancy
    }

    /// Reads every voxel of a volume, and those that blocks share several times. `whole`: its numbers are whole ones.
    pub(crate) fn make_ranges(
        &self,
        gpu: &Gpu,
        volume: &GpuVolume,
        whole: bool,
    ) -> Result<GpuRanges, GpuError> {
        let device = gpu.device();
        let levels = BlockLevels::new(volume.dimensions(), gpu.capabilities().max_buffer);
        let filterable = usize::from(volume.texels().format != wgpu::TextureFormat::R32Float);
        let groups = [&self.voxels[filterable], &self.task];
        let (words, voxels, fine, coarse) = gpu.checked("the ranges of blocks", || {
            let words = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("ranges"),
                size: levels.range_bytes(),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let voxels = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: groups[0],
                entries: &[wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(volume.view()),
                }],
            });
            let constants = [("WHOLE_TEXELS", f64::from(u8::from(whole)))];
            let make = |entry, constants: &[(&str, f64)]| {
                compute_pipeline(device, &self.ranges, entry, &groups, constants)
            };
            (words, voxels, make("fine_ranges", &constants), make("coarse_ranges", &[]))
        })?;
        let run = |pipeline, layers: UVec3, first_layer| {
            let task = ranges_task(volume.dimensions(), &levels, first_layer);
            gpu.checked("finding the ranges of blocks", || {
                let uniform = uniform(device, &task);
                let task = bind(device, groups[1], &[&uniform, &words]);
                dispatch(gpu, pipeline, &[&voxels, &task], layers.to_array());
            })
        };
        let layers = layers_at_once(&levels, gpu.adapter().software);
        for first in (0..levels.fine.z).step_by(layers as usize) {
            let slab = levels.fine.with_z(layers.min(levels.fine.z - first));
            run(&fine, groups_of(slab, UVec3::new(8, 4, 2)), first)?;
        }
        run(&coarse, groups_of(levels.coarse, UVec3::splat(4)), 0)?;
        Ok(GpuRanges { levels, words })
    }
}

fn ranges_task(dimensions: UVec3, levels: &BlockLevels, first_layer: u32) -> RangesTask {
    RangesTask {
        dimensions: dimensions.to_array(),
        edge: levels.fine_edge,
        blocks: levels.fine.to_array(),
        first_layer,
        coarse_blocks: levels.coarse.to_array(),
        fine_per_coarse: levels.fine_per_coarse(),
    }
}

/// Layers of fine blocks that are few enough for one submission, and an even number: a workgroup makes two.
fn layers_at_once(levels: &BlockLevels, software: bool) -> u32 {
    let reads = u64::from(levels.fine_edge + 1).pow(3);
    let layer = u64::from(levels.fine.x) * u64::from(levels.fine.y) * reads;
    let layers = VOXELS_AT_ONCE[usize::from(!software)] / layer.max(1);
    u32::try_from(layers).unwrap_or(u32::MAX / 2).clamp(2, u32::MAX / 2) / 2 * 2
}

fn groups_of(items: UVec3, per_group: UVec3) -> UVec3 {
    UVec3::new(items.x.div_ceil(per_group.x), items.y.div_ceil(per_group.y), items.z.div_ceil(per_group.z))
}

const UNIFORM: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

const fn storage(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

fn layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(u32, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = bindings
        .iter()
        .map(|&(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

fn uniform(device: &wgpu::Device, task: &impl Pod) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("task"),
        contents: bytemuck::bytes_of(task),
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

/// Buffers at the bindings from 0 on.
fn bind(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = (0u32..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn compute_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entry: &str,
    groups: &[&wgpu::BindGroupLayout],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let groups: Vec<Option<&wgpu::BindGroupLayout>> = groups.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module: shader,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// Submits one dispatch.
fn dispatch(gpu: &Gpu, pipeline: &wgpu::ComputePipeline, groups: &[&wgpu::BindGroup], [x, y, z]: [u32; 3]) {
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        for (index, group) in (0u32..).zip(groups) {
            pass.set_bind_group(index, *group, &[]);
        }
        pass.dispatch_workgroups(x, y, z);
    }
    gpu.queue().submit([encoder.finish()]);
}
