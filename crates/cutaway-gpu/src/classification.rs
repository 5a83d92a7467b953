//! Classification on the device: the transfer function's table, and which blocks it can make visible.
//!
//! Remade on a change of transfer function, mode, step or isovalues, in time proportional to the number of blocks; no voxel
//! is read.

use cutaway_core::occupancy::Occupancy;
use cutaway_core::scene::{Mode, Scene, SpaceSkipping};
use cutaway_core::transfer_function::{ClassificationTable, extinction};
use cutaway_core::value_ranges::{BLOCK, ValueRanges};
use wgpu::util::DeviceExt;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::raycast::{BlockLevels, GpuPreintegration};
use crate::volume::GpuVolume;

/// From texels to entries of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IndexMap {
    pub(crate) offset: f32,
    pub(crate) scale: f32,
    pub(crate) last: u32,
}

/// Tables and blocks of one scene's transfer function, mode and step.
#[derive(Debug)]
pub struct GpuClassification {
    table: wgpu::Buffer,
    index_map: IndexMap,
    occupied: wgpu::Buffer,
    blocks: BlockLevels,
    occupied_fraction: f64,
    preintegration: Option<GpuPreintegration>,
}

impl GpuClassification {
    pub(crate) fn new(
        gpu: &Gpu,
        ranges: &ValueRanges,
        volume: &GpuVolume,
        scene: &Scene,
    ) -> Result<Self, GpuError> {
        let source = scene.volume();
        let function = scene.transfer_function();
        let table = ClassificationTable::new(function, source.rescale(), source.stored_range());
        let (lo, bins_per_unit) = table.index_map();
        let texels = volume.texels();
        let index_map = IndexMap {
            offset: texels.texel(f64::from(lo)) as f32,
            scale: (f64::from(bins_per_unit) * texels.stored_per_texel) as f32,
            last: table.entries().len() as u32 - 1,
        };
        let entries = entries(&table, scene, volume);
        let occupancy = occupancy(&table, ranges, scene);
        let (bits, blocks) = packed(&occupancy);
        let upload = |label, contents: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let (table, occupied) = gpu.checked("the transfer function's table", || {
            (
                upload("table", bytemuck::cast_slice(&entries)),
                upload("occupancy", bytemuck::cast_slice(&bits)),
            )
        })?;
        let occupied_fraction = occupancy.occupied_fraction();
        let preintegration = GpuPreintegration::new(gpu, scene, volume)?;
        Ok(Self { table, index_map, occupied, blocks, occupied_fraction, preintegration })
    }

    /// The share of blocks that can be visible, 0..=1.
    pub fn occupied_fraction(&self) -> f64 {
        self.occupied_fraction
    }

    /// What it takes of the device's memory.
    pub fn bytes(&self) -> u64 {
        let integrals = self.preintegration.as_ref().map_or(0, GpuPreintegration::bytes);
        self.table.size() + self.occupied.size() + integrals
    }

    pub(crate) fn index_map(&self) -> IndexMap {
        self.index_map
    }

    pub(crate) fn blocks(&self) -> BlockLevels {
        self.blocks
    }

    /// The tables of pre-integrated steps, where the scene asks for them.
    pub(crate) fn preintegration(&self) -> Option<&GpuPreintegration> {
        self.preintegration.as_ref()
    }

    pub(crate) fn table(&self) -> &wgpu::Buffer {
        &self.table
    }

    pub(crate) fn occupied(&self) -> &wgpu::Buffer {
        &self.occupied
    }
}

/// Straight colour and optical depth of a whole step of each entry (projections: opacity as it is); then colour and texel
/// of each isosurface, by texel.
fn entries(table: &ClassificationTable, scene: &Scene, volume: &GpuVolume) -> Vec<[f32; 4]> {
    let (unit, step) = (scene.unit_distance(), scene.step_length());
    let projection = matches!(scene.settings().mode, Mode::Mip | Mode::Minip | Mode::Mean);
    let weight = |opacity: f32| {
        if projection { opacity } else { (extinction(f64::from(opacity), unit) * step) as f32 }
    };
    let mut entries: Vec<[f32; 4]> =
        table.entries().iter().map(|&[r, g, b, a]| [r, g, b, weight(a)]).collect();
    let rescale = scene.volume().rescale();
    let mut surfaces: Vec<[f32; 4]> = (scene.settings().iso.iter())
        .map(|&level| {
            let [r, g, b] = scene.transfer_function().evaluate(level).0.map(|c| c as f32);
            [r, g, b, volume.texels().texel(rescale.stored(level)) as f32]
        })
        .collect();
    surfaces.sort_by(|a, b| a[3].total_cmp(&b[3]));
    entries.extend(surfaces);
    entries
}

fn occupancy(table: &ClassificationTable, ranges: &ValueRanges, scene: &Scene) -> Occupancy {
    let settings = scene.settings();
    let rescale = scene.volume().rescale();
    let isovalues: Vec<f64> = settings.iso.iter().map(|v| rescale.stored(*v)).collect();
    let met = |lo: f32, hi: f32| isovalues.iter().any(|v| (f64::from(lo)..=f64::from(hi)).contains(v));
    match settings.mode {
        _ if settings.space_skipping == SpaceSkipping::Off => Occupancy::full(ranges),
        Mode::Composite => Occupancy::new(ranges, |lo, hi| table.visible(lo, hi)),
        Mode::Iso => Occupancy::new(ranges, met),
        _ => Occupancy::full(ranges),
    }
}

/// A bit a block: the fine ones, then from a new word on the coarse ones.
fn packed(occupancy: &Occupancy) -> (Vec<u32>, BlockLevels) {
    let levels = BlockLevels {
        fine: occupancy.dimensions(),
        coarse: occupancy.level1_dimensions(),
        fine_edge: BLOCK,
        coarse_edge: BLOCK * BLOCK,
    };
    let mut words = Vec::new();
    let fine = levels.fine.element_product() as usize;
    let coarse = levels.coarse.element_product() as usize;
    let mut pack = |count: usize, occupied: &dyn Fn(usize) -> bool| {
        words.extend((0..count.div_ceil(32)).map(|word| {
            (word * 32..count.min(word * 32 + 32))
                .fold(0u32, |bits, i| bits | u32::from(occupied(i)) << (i % 32))
        }));
    };
    pack(fine, &|i| occupancy.level0(i));
    pack(coarse, &|i| occupancy.level1(i));
    (words, levels)
}
