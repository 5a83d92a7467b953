//! Value ranges on the device: the least and greatest texel of every block of a volume, and what follows from them.
//!
//! Enters: a volume's texture. Leaves: a word a block, two 16-bit unorm that contain every value that interpolation can make
//! inside the block; fine blocks, then coarse ones ([`BlockLevels`]). They are made once a volume, in slabs, and no voxel is
//! read again: an edit of the transfer function goes from ranges to bits ([`Occupancy`]), and rays that look for an extreme
//! value compare ranges with what they have.

mod levels;
mod map;
mod occupancy;
#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::UVec3;
use cutaway_core::volume::Volume;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::shaders::{Shader, shader};
use crate::volume::GpuVolume;
pub(crate) use levels::BlockLevels;
pub(crate) use map::RangeMap;
#[cfg(test)]
pub(crate) use occupancy::OccupancyTask;
pub(crate) use occupancy::{Criterion, Occupancy, read_words};

/// The linked shaders.
pub(crate) const RANGES_SHADER: Shader = shader!(ranges::value_ranges);
pub(crate) const OCCUPANCY_SHADER: Shader = shader!(ranges::occupancy);

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
    pub(crate) first_texel: f32,
    pub(crate) scale: f32,
    pub(crate) reserved: [u32; 2],
}

/// The ranges of a volume's blocks.
#[derive(Debug)]
pub(crate) struct GpuRanges {
    levels: BlockLevels,
    map: RangeMap,
    words: wgpu::Buffer,
}

impl GpuRanges {
    /// What they are in.
    pub(crate) fn map(&self) -> RangeMap {
        self.map
    }

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
    /// By whether the voxels can be filtered.
    layouts: [wgpu::BindGroupLayout; 2],
    ranges: wgpu::ShaderModule,
    occupancy: occupancy::Pipelines,
}

impl BlockPipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the shaders of blocks", || {
            let ranges = RANGES_SHADER.module(device);
            let layouts = [false, true].map(|filterable| {
                let texture = wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable },
                    view_dimension: wgpu::TextureViewDimension::D3,
                    multisampled: false,
                };
                layout(device, "ranges", &[(0, UNIFORM), (1, storage(false)), (2, texture)])
            });
            Self { layouts, ranges, occupancy: occupancy::Pipelines::new(device) }
        })
    }

    /// The pipelines of occupancy.
    pub(crate) fn occupancy(&self) -> &occupancy::Pipelines {
        &self.occupancy
    }

    /// The ranges of a volume's blocks: of a volume in bricks, of which not all voxels are on the device, those that were
    /// found on the host. `source` is what it was made of.
    pub(crate) fn ranges(
        &self,
        gpu: &Gpu,
        volume: &GpuVolume,
        source: &Volume,
    ) -> Result<GpuRanges, GpuError> {
        let map = RangeMap::new(source, volume.texels());
        let most_bytes = gpu.capabilities().max_buffer;
        if let Some(found) = volume.host_ranges() {
            let (levels, words) = map::packed_on_host(found, map, volume.texels(), most_bytes);
            let words = gpu.checked("the ranges of blocks", || {
                gpu.buffer("ranges", bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE)
            })?;
            return Ok(GpuRanges { levels, map, words });
        }
        let levels = BlockLevels::new(volume.dimensions(), most_bytes);
        let words = self.make(gpu, volume, source, &levels, map)?;
        Ok(GpuRanges { levels, map, words })
    }

    /// Reads every voxel, and those that blocks share several times.
    fn make(
        &self,
        gpu: &Gpu,
        volume: &GpuVolume,
        source: &Volume,
        levels: &BlockLevels,
        map: RangeMap,
    ) -> Result<wgpu::Buffer, GpuError> {
        let device = gpu.device();
        let layout = &self.layouts[usize::from(volume.texels().filterable(gpu.capabilities()))];
        let resident = volume.resident(gpu, source, None)?;
        let (words, [fine, coarse]) = gpu.checked("the ranges of blocks", || {
            let words = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("ranges"),
                size: levels.range_bytes(),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let constants = [("WHOLE_TEXELS", f64::from(u8::from(map.whole)))];
            let make = |(entry, constants)| compute_pipeline(device, &self.ranges, entry, layout, constants);
            (words, [("fine_ranges", &constants[..]), ("coarse_ranges", &[])].map(make))
        })?;
        let run = |pipeline, groups: UVec3, first_layer| {
            let task = ranges_task(volume.dimensions(), levels, map, first_layer);
            gpu.checked("finding the ranges of blocks", || {
                let task = uniform(gpu, &task);
                let voxels = wgpu::BindingResource::TextureView(&resident.voxels);
                let bindings = [task.as_entire_binding(), words.as_entire_binding(), voxels];
                dispatch(gpu, pipeline, &bind(device, layout, &bindings), groups);
            })
        };
        let layers = layers_at_once(levels, gpu.adapter().software);
        for first in (0..levels.fine.z).step_by(layers as usize) {
            let slab = levels.fine.with_z(layers.min(levels.fine.z - first));
            run(&fine, groups_of(slab, UVec3::new(8, 4, 2)), first)?;
        }
        run(&coarse, groups_of(levels.coarse, UVec3::splat(4)), 0)?;
        Ok(words)
    }
}

fn ranges_task(dimensions: UVec3, levels: &BlockLevels, map: RangeMap, first_layer: u32) -> RangesTask {
    RangesTask {
        dimensions: dimensions.to_array(),
        edge: levels.fine_edge,
        blocks: levels.fine.to_array(),
        first_layer,
        coarse_blocks: levels.coarse.to_array(),
        fine_per_coarse: levels.fine_per_coarse(),
        first_texel: map.first as f32,
        scale: map.scale as f32,
        reserved: [0; 2],
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

fn uniform(gpu: &Gpu, task: &impl Pod) -> wgpu::Buffer {
    gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM)
}

/// Resources at the bindings from 0 on.
fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = (0u32..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn compute_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entry: &str,
    layout: &wgpu::BindGroupLayout,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &[Some(layout)],
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

/// Submits one dispatch of so many workgroups.
fn dispatch(gpu: &Gpu, pipeline: &wgpu::ComputePipeline, group: &wgpu::BindGroup, groups: UVec3) {
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(groups.x, groups.y, groups.z);
    }
    gpu.queue().submit([encoder.finish()]);
}
