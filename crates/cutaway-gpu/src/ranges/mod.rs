//! Value ranges on the device: the least and greatest texel of every block of a volume, and what follows from them.
//!
//! Enters: a volume's texture. Leaves: a word a block, two 16-bit unorm that contain every value that interpolation can make
//! inside the block; fine blocks, then coarse ones ([`BlockLevels`]). They are made once a volume, in slabs, and no voxel is
//! read again: an edit of the transfer function goes from ranges to bits ([`Occupancy`]), and rays that look for an extreme
//! value compare ranges with what they have.

mod blocks;
mod levels;
mod map;
mod occupancy;
mod tasks;
#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::UVec3;
use cutaway_core::volume::Volume;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{COMPUTE, UNIFORM, bind_in_order, compute_pipeline, floats, group_layout_of, storage};
use crate::shaders::{Shader, shader};
use crate::volume::GpuVolume;
pub(crate) use blocks::GpuRanges;
pub(crate) use levels::BlockLevels;
pub(crate) use map::RangeMap;
pub(crate) use occupancy::{Criterion, Occupancy, read_words};
#[cfg(test)]
pub(crate) use occupancy::{OCCUPANCY_SHADER, OccupancyTask};
use tasks::{dispatch, groups_of, uniform};

/// The linked shader.
pub(crate) const RANGES_SHADER: Shader = shader!(ranges::value_ranges);

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
                let types = [UNIFORM, storage(false), floats(filterable, wgpu::TextureViewDimension::D3)];
                group_layout_of(device, "ranges", COMPUTE, &types)
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
            let make = |(entry, constants)| {
                compute_pipeline(device, &self.ranges, entry, &[Some(layout)], constants)
            };
            (words, [("fine_ranges", &constants[..]), ("coarse_ranges", &[])].map(make))
        })?;
        let run = |pipeline, groups: UVec3, first_layer| {
            let task = ranges_task(volume.dimensions(), levels, map, first_layer);
            gpu.checked("finding the ranges of blocks", || {
                let task = uniform(gpu, &task);
                let voxels = wgpu::BindingResource::TextureView(&resident.voxels);
                let bindings = [task.as_entire_binding(), words.as_entire_binding(), voxels];
                dispatch(gpu, pipeline, &bind_in_order(device, layout, &bindings), groups);
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
