//! Classification on the device: the transfer function's table, and which blocks it can make visible.
//!
//! Remade on a change of transfer function, mode, step or isovalues, in time proportional to the number of blocks; no voxel
//! is read.

use std::sync::{Arc, Mutex, PoisonError};

use cutaway_core::scene::{Mode, Scene, SpaceSkipping};
use cutaway_core::transfer_function::{ClassificationTable, extinction};

use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::{GpuPreintegration, IndexMap};
use crate::notice::Notice;
use crate::proxy::{Flavour, ProxyGeometry, ProxyOptions, ProxyPipelines};
use crate::ranges::{BlockLevels, BlockPipelines, Criterion, GpuRanges, Occupancy, RangeMap};
use crate::volume::{GpuVolume, Wanted};

/// Tables and blocks of one scene's transfer function, mode and step.
#[derive(Debug)]
pub struct GpuClassification {
    table: wgpu::Buffer,
    index_map: IndexMap,
    occupancy: Occupancy,
    wanted: Option<Arc<Wanted>>,
    notices: Vec<Notice>,
    proxy: Mutex<Option<Arc<ProxyGeometry>>>,
    preintegration: Option<GpuPreintegration>,
}

impl GpuClassification {
    pub(crate) fn new(
        gpu: &Gpu,
        pipelines: &BlockPipelines,
        ranges: &GpuRanges,
        volume: &GpuVolume,
        scene: &Scene,
    ) -> Result<Self, GpuError> {
        let source = scene.volume();
        let function = scene.transfer_function();
        let table = ClassificationTable::new(function, source.rescale(), source.stored_range());
        let index_map = IndexMap::new(&table, source.stored_range(), volume.texels());
        let entries = entries(&table, scene, volume);
        let criterion = criterion(&table, index_map, scene, volume);
        let occupancy = Occupancy::new(gpu, pipelines.occupancy(), ranges, &criterion)?;
        // Bricks that become visible are uploaded now, not while a frame waits for them.
        // A pre-integrated step depends on the values at both its ends, one of which may lie in a block beside a visible one.
        let margin = scene.settings().pre_integration;
        let wanted = volume.wanted(|lo, hi| visible(&table, scene, lo, hi), margin);
        drop(volume.resident(gpu, source, wanted.as_ref())?);
        let notices = volume.notices();
        let table = gpu.checked("the transfer function's table", || {
            gpu.buffer("table", bytemuck::cast_slice(&entries), wgpu::BufferUsages::STORAGE)
        })?;
        let proxy = Mutex::new(None);
        let preintegration = GpuPreintegration::new(gpu, scene, volume)?;
        Ok(Self { table, index_map, occupancy, wanted, notices, proxy, preintegration })
    }

    /// What of the volume is shown otherwise than it is.
    pub fn notices(&self) -> &[Notice] {
        &self.notices
    }

    /// The bricks that it makes visible, of a volume in bricks.
    pub(crate) fn wanted(&self) -> Option<&Arc<Wanted>> {
        self.wanted.as_ref()
    }

    /// The share of blocks that can be visible, 0..=1. The first call waits for the device to have counted them.
    pub fn occupied_fraction(&self) -> Result<f64, GpuError> {
        self.occupancy.occupied_fraction()
    }

    /// What it takes of the device's memory.
    pub fn bytes(&self) -> u64 {
        let integrals = self.preintegration.as_ref().map_or(0, GpuPreintegration::bytes);
        self.table.size() + self.occupied().size() + integrals
    }

    pub(crate) fn index_map(&self) -> IndexMap {
        self.index_map
    }

    pub(crate) fn blocks(&self) -> BlockLevels {
        self.occupancy.levels()
    }

    pub(crate) fn range_map(&self) -> RangeMap {
        self.occupancy.map()
    }

    /// The tables of pre-integrated steps, where the scene asks for them.
    pub(crate) fn preintegration(&self) -> Option<&GpuPreintegration> {
        self.preintegration.as_ref()
    }

    pub(crate) fn table(&self) -> &wgpu::Buffer {
        &self.table
    }

    /// The proxy geometry of the blocks; made when another one is asked for than the last time.
    pub(crate) fn proxy(
        &self,
        gpu: &Gpu,
        pipelines: &ProxyPipelines,
        flavour: Flavour,
        options: &ProxyOptions,
    ) -> Result<Arc<ProxyGeometry>, GpuError> {
        let mut kept = self.proxy.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(proxy) = kept.as_ref().filter(|proxy| proxy.is(flavour, options)) {
            return Ok(proxy.clone());
        }
        let proxy = Arc::new(ProxyGeometry::new(gpu, pipelines, &self.occupancy, flavour, options)?);
        *kept = Some(proxy.clone());
        Ok(proxy)
    }

    pub(crate) fn occupied(&self) -> &wgpu::Buffer {
        self.occupancy.bits()
    }
}

/// How far a texel and the level that it is equal to may lie apart after rounding, relative to them.
const LEVEL_ROUNDING: f64 = 2.4e-7;

/// Straight colour and optical depth of a whole step of each entry (projections: opacity as it is); then colour and level
/// of each isosurface, ascending. A level is a texel, negated where greater texels are lesser values; it is lowered by
/// what rounding may take from a voxel of exactly that value, for such a voxel is inside.
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
            let level = rescale.slope.signum() * volume.texels().texel(rescale.stored_level(level));
            // Texels about zero come of differences of greater numbers.
            [r, g, b, (level - LEVEL_ROUNDING * level.abs().max(0.01)) as f32]
        })
        .collect();
    surfaces.sort_by(|a, b| a[3].total_cmp(&b[3]));
    entries.extend(surfaces);
    entries
}

/// Whether stored numbers from `lo` to `hi` can be visible. Projections look at values before they are classified, so that
/// no block is empty to them.
pub(crate) fn visible(table: &ClassificationTable, scene: &Scene, lo: f32, hi: f32) -> bool {
    let settings = scene.settings();
    let rescale = scene.volume().rescale();
    let within = |level: f64| (f64::from(lo)..=f64::from(hi)).contains(&rescale.stored_level(level));
    match settings.mode {
        _ if settings.space_skipping == SpaceSkipping::Off => true,
        Mode::Composite => table.visible(lo, hi),
        Mode::Iso => settings.iso.iter().any(|level| within(*level)),
        _ => true,
    }
}

/// What makes a texel visible: the same for the device.
fn criterion(table: &ClassificationTable, map: IndexMap, scene: &Scene, volume: &GpuVolume) -> Criterion {
    let settings = scene.settings();
    let rescale = scene.volume().rescale();
    let level = |value: &f64| volume.texels().texel(rescale.stored(*value));
    match settings.mode {
        _ if settings.space_skipping == SpaceSkipping::Off => Criterion::All,
        Mode::Composite => Criterion::Entries {
            visible_before: visible_before(table),
            offset: map.offset.into(),
            scale: map.scale.into(),
        },
        Mode::Iso => Criterion::Levels(settings.iso.iter().map(level).collect()),
        _ => Criterion::All,
    }
}

/// Of each entry and of the end: how many entries before it are visible.
fn visible_before(table: &ClassificationTable) -> Vec<u32> {
    let mut count = 0;
    let counted = table.entries().iter().map(|entry| {
        count += u32::from(entry[3] > 0.0);
        count
    });
    std::iter::once(0).chain(counted).collect()
}
