//! Occupancy on the device: which blocks can be visible, from their ranges and the transfer function.
//!
//! Enters: ranges and what makes a value visible ([`Criterion`]). Leaves: bits in the layout of `shared/blocks.wgsl`, and a
//! count that is read back only when somebody asks. Made anew on every edit, in time proportional to the number of blocks.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::UVec3;

use super::blocks::GpuRanges;
use super::levels::BlockLevels;
use super::map::RangeMap;
use super::tasks::{dispatch, groups_of, uniform};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{COMPUTE, UNIFORM, bind_buffers, compute_pipeline, group_layout_of, storage};
use crate::shaders::{Shader, shader};

/// The linked shader.
pub(crate) const OCCUPANCY_SHADER: Shader = shader!(ranges::occupancy);

/// Blocks that a software adapter decides on in 100 ms at the least, in words of 32.
const WORDS_AT_ONCE: u32 = 1 << 16;

/// As `OccupancyTask` in `occupancy.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct OccupancyTask {
    pub(crate) blocks: [u32; 3],
    pub(crate) first_word: u32,
    pub(crate) coarse_blocks: [u32; 3],
    pub(crate) fine_per_coarse: u32,
    pub(crate) entry_offset: f32,
    pub(crate) entry_scale: f32,
    pub(crate) entry_last: u32,
    pub(crate) level_count: u32,
    pub(crate) criterion: u32,
    pub(crate) fine_words: u32,
    pub(crate) coarse_words: u32,
    pub(crate) end_word: u32,
}

/// What makes a value visible.
#[derive(Debug)]
pub(crate) enum Criterion {
    /// A table of which some entries are: entry `(texel - offset) * scale + 0.5`, truncated and clamped.
    Entries {
        /// Of each entry and of the end: how many before it are visible.
        visible_before: Vec<u32>,
        /// The texel of the first entry.
        offset: f64,
        /// Entries in a texel's unit.
        scale: f64,
    },
    /// Being one of these texels.
    Levels(Vec<f64>),
    /// Nothing: all values are.
    All,
}

impl Criterion {
    /// The words that the shader reads; never none, for no buffer is empty.
    fn words(&self, map: RangeMap) -> Vec<u32> {
        match self {
            Self::Entries { visible_before, .. } => visible_before.clone(),
            Self::Levels(levels) if !levels.is_empty() => {
                levels.iter().map(|level| (map.place(*level) as f32).to_bits()).collect()
            }
            Self::Levels(_) | Self::All => vec![0],
        }
    }

    fn describe(&self, map: RangeMap, task: &mut OccupancyTask) {
        match self {
            Self::Entries { visible_before, offset, scale } => {
                task.entry_offset = map.place(*offset) as f32;
                task.entry_scale = (scale / map.scale) as f32;
                task.entry_last = (visible_before.len() as u32).saturating_sub(2);
            }
            Self::Levels(levels) => {
                task.criterion = 1;
                task.level_count = levels.len() as u32;
            }
            Self::All => task.criterion = 2,
        }
    }
}

/// The pipelines, which are the same for all volumes.
#[derive(Debug)]
pub(crate) struct Pipelines {
    layout: wgpu::BindGroupLayout,
    fine: wgpu::ComputePipeline,
    coarse: wgpu::ComputePipeline,
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let shader = OCCUPANCY_SHADER.module(device);
        let types = [UNIFORM, storage(true), storage(true), storage(false)];
        let layout = group_layout_of(device, "occupancy", COMPUTE, &types);
        let make = |entry| compute_pipeline(device, &shader, entry, &[Some(&layout)], &[]);
        let (fine, coarse) = (make("fine_occupancy"), make("coarse_occupancy"));
        Self { layout, fine, coarse }
    }
}

/// Which blocks can be visible.
#[derive(Debug)]
pub(crate) struct Occupancy {
    gpu: Gpu,
    levels: BlockLevels,
    map: RangeMap,
    bits: wgpu::Buffer,
    occupied: OnceLock<u64>,
}

impl Occupancy {
    /// Asks the criterion about every block.
    pub(crate) fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        ranges: &GpuRanges,
        criterion: &Criterion,
    ) -> Result<Self, GpuError> {
        let levels = ranges.levels();
        let mut task = OccupancyTask {
            blocks: levels.fine.to_array(),
            coarse_blocks: levels.coarse.to_array(),
            fine_per_coarse: levels.fine_per_coarse(),
            fine_words: levels.fine_words() as u32,
            coarse_words: levels.coarse_words() as u32,
            ..OccupancyTask::zeroed()
        };
        criterion.describe(ranges.map(), &mut task);
        let bits = gpu.checked("finding the blocks that can be visible", || {
            let device = gpu.device();
            let words = criterion.words(ranges.map());
            let criteria = gpu.buffer("criteria", bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE);
            // New buffers are all zero: the bits of coarse blocks and the count begin with that.
            let bits = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("occupancy"),
                size: 4 * (levels.fine_words() + levels.coarse_words() + 1),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let bound = |task: &OccupancyTask| {
                let task = uniform(gpu, task);
                let buffers = [&task, ranges.words(), &criteria, &bits];
                bind_buffers(device, &pipelines.layout, &buffers)
            };
            for first in (0..task.fine_words).step_by(WORDS_AT_ONCE as usize) {
                let end = (first + WORDS_AT_ONCE).min(task.fine_words);
                let task = OccupancyTask { first_word: first, end_word: end, ..task };
                let groups = UVec3::new((end - first).div_ceil(64), 1, 1);
                dispatch(gpu, &pipelines.fine, &bound(&task), groups);
            }
            dispatch(gpu, &pipelines.coarse, &bound(&task), groups_of(levels.coarse, UVec3::splat(4)));
            bits
        })?;
        Ok(Self { gpu: gpu.clone(), levels, map: ranges.map(), bits, occupied: OnceLock::new() })
    }

    /// The blocks that there are.
    pub(crate) fn levels(&self) -> BlockLevels {
        self.levels
    }

    /// What the ranges that it was made of are in.
    pub(crate) fn map(&self) -> RangeMap {
        self.map
    }

    /// A bit a fine block; two a coarse one, whether any fine one in it is occupied and whether all are; and how many are.
    pub(crate) fn bits(&self) -> &wgpu::Buffer {
        &self.bits
    }

    /// The share of fine blocks that can be visible, 0..=1. The first call waits for the device.
    pub(crate) fn occupied_fraction(&self) -> Result<f64, GpuError> {
        let occupied = match self.occupied.get() {
            Some(count) => *count,
            None => {
                let last = self.bits.size() - 4;
                let word = read_words(&self.gpu, &self.bits, last..last + 4)?;
                *self.occupied.get_or_init(|| u64::from(word[0]))
            }
        };
        Ok(occupied as f64 / self.levels.fine_count() as f64)
    }
}

/// Words of a buffer, by a range of bytes.
pub(crate) fn read_words(
    gpu: &Gpu,
    from: &wgpu::Buffer,
    bytes: std::ops::Range<u64>,
) -> Result<Vec<u32>, GpuError> {
    let size = bytes.end - bytes.start;
    let copy = gpu.checked("reading what was found of blocks", || {
        let copy = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("words on their way"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(from, bytes.start, &copy, 0, size);
        gpu.queue().submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |_| {});
        copy
    })?;
    gpu.finish()?;
    let mapped = copy.get_mapped_range(..).map_err(|e| GpuError::Refused {
        what: "reading what was found of blocks".to_owned(),
        reason: e.to_string(),
    })?;
    Ok(bytemuck::cast_slice(&mapped).to_vec())
}
