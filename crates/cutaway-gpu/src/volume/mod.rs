//! A volume on the device: its voxels as a 3D texture, whole where it fits, else in bricks.
//!
//! Enters: a [`Volume`]. Leaves: textures that `shared/volume.wgsl` reads, and [`Texels`], which say what is in them. Choices
//! are tried in turn ([`Texels::choices`]): each whole, in one texture; then, where none fits, bricks in an atlas with a page
//! table (`bricks`, `atlas`).
//!
//! Of a volume in bricks only what a classification can make visible is on the device. Bricks come when a scene is
//! classified, and again before it is drawn, should another classification have taken their slots; the host's volume stays
//! at hand for that. Where not all visible bricks fit, some are kept coarser, with a [`Notice`], or the volume is refused
//! ([`Oversize`](crate::context::Oversize)). Blocks that cannot be visible are not sampled, so what is not there is not
//! missed; a sample that a long step takes there finds a value of the brick's own, invisible like all of them.

mod atlas;
mod bricks;
mod texels;
mod texture;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cutaway_core::glam::UVec3;
use cutaway_core::scene::Scene;
use cutaway_core::value_ranges::ValueRanges;
use cutaway_core::volume::Volume;
use cutaway_core::voxel_source::VoxelSource;
use rayon::prelude::*;

use crate::context::{Gpu, Oversize};
use crate::error::GpuError;
use crate::notice::{Notice, megabytes};
use atlas::{Atlas, BYTES_AT_ONCE, slot_bytes};
pub(crate) use bricks::Wanted;
use bricks::{BrickGrid, Plan};
pub use texels::Texels;
use texture::texture_3d;

/// A volume on the device.
#[derive(Debug)]
pub struct GpuVolume {
    dimensions: UVec3,
    texels: Texels,
    held: Held,
    notices: Vec<Notice>,
}

#[derive(Debug)]
enum Held {
    Whole { texture: wgpu::Texture, no_pages: wgpu::TextureView },
    Bricks(Box<Bricked>),
}

#[derive(Debug)]
struct Bricked {
    grid: BrickGrid,
    /// Known to the host too, which decides what is uploaded.
    ranges: ValueRanges,
    state: Mutex<Bricks>,
}

/// What of a volume in bricks is on the device.
#[derive(Debug, Default)]
struct Bricks {
    atlas: Option<Atlas>,
    /// What was last made to be there.
    current: Option<Arc<Wanted>>,
    notice: Option<Notice>,
    /// Slots that the device turned out to have no memory for.
    too_many: Option<u64>,
}

/// Textures of a volume, which stay as they are while this lives.
pub(crate) struct Resident<'a> {
    pub(crate) voxels: wgpu::TextureView,
    pub(crate) pages: wgpu::TextureView,
    _state: Option<MutexGuard<'a, Bricks>>,
}

impl GpuVolume {
    pub(crate) fn new(gpu: &Gpu, volume: &Volume) -> Result<Self, GpuError> {
        gpu.alive()?;
        let choices = Texels::choices(volume, gpu);
        let dimensions = volume.dimensions();
        let full = choices.iter().filter(|t| t.rounding(volume) == 0.0);
        let needed = full.map(|t| whole_bytes(dimensions, t)).min().unwrap_or(0);
        for texels in &choices {
            if fits(gpu, dimensions, texels) {
                match whole(gpu, volume, texels) {
                    Ok(held) => return Ok(Self::with(volume, *texels, held, needed)),
                    Err(GpuError::OutOfMemory { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Self::in_bricks(gpu, volume, &choices, needed)
    }

    /// The first choice of which all bricks fit; else the smallest one.
    fn in_bricks(gpu: &Gpu, volume: &Volume, choices: &[Texels], needed: u64) -> Result<Self, GpuError> {
        let can = gpu.capabilities();
        let dimensions = volume.dimensions();
        let grid = |t: &Texels| {
            BrickGrid::new(dimensions, t.bytes_per_voxel(), can.max_texture_3d, can.max_texture_bytes)
        };
        let grids = || choices.iter().filter_map(|t| grid(t).map(|g| (*t, g)));
        let all_fit = grids().find(|(_, g)| g.most_slots >= g.page_count() as u64);
        let smallest = || grids().min_by_key(|(t, _)| t.bytes_per_voxel());
        let Some((texels, grid)) = all_fit.or_else(smallest) else {
            let in_all = match can.max_texture_bytes {
                u64::MAX => String::new(),
                bytes => format!(", {} in all", megabytes(bytes)),
            };
            let reason = format!(
                "its textures have up to {} voxels along a side{in_all}; take `--engine cpu`",
                can.max_texture_3d
            );
            return Err(GpuError::TooLarge { dimensions, reason });
        };
        let bricked = Bricked { grid, ranges: ValueRanges::new(volume), state: Mutex::default() };
        let held = Held::Bricks(Box::new(bricked));
        Ok(Self::with(volume, texels, held, needed))
    }

    fn with(volume: &Volume, texels: Texels, held: Held, needed: u64) -> Self {
        let rounding = texels.rounding(volume);
        let half = (rounding > 0.0).then_some(Notice::HalfPrecision { rounding, needed });
        Self { dimensions: volume.dimensions(), texels, held, notices: half.into_iter().collect() }
    }

    /// How its numbers stand in the texture.
    pub fn texels(&self) -> &Texels {
        &self.texels
    }

    /// Voxels along x, y, z.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// What it takes of the device's memory now.
    pub fn bytes(&self) -> u64 {
        match &self.held {
            Held::Whole { .. } => whole_bytes(self.dimensions, &self.texels),
            Held::Bricks(bricked) => lock(&bricked.state).atlas.as_ref().map_or(0, Atlas::bytes),
        }
    }

    /// What was substituted so that it fits: now, so for the last scene that was classified or drawn.
    pub fn notices(&self) -> Vec<Notice> {
        let mut notices = self.notices.clone();
        if let Held::Bricks(bricked) = &self.held {
            notices.extend(lock(&bricked.state).notice.clone());
        }
        notices
    }

    /// Cells along an edge of a brick, for a volume in bricks.
    pub fn brick_edge(&self) -> Option<u32> {
        match &self.held {
            Held::Whole { .. } => None,
            Held::Bricks(bricked) => Some(bricked.grid.edge),
        }
    }

    /// Bricks that have been uploaded since the volume was prepared.
    pub fn uploaded_bricks(&self) -> u64 {
        match &self.held {
            Held::Whole { .. } => 0,
            Held::Bricks(bricked) => lock(&bricked.state).atlas.as_ref().map_or(0, Atlas::uploads),
        }
    }

    /// Ranges of the blocks of a volume in bricks, which no shader can find: not all voxels are on the device.
    pub(crate) fn host_ranges(&self) -> Option<&ValueRanges> {
        match &self.held {
            Held::Whole { .. } => None,
            Held::Bricks(bricked) => Some(&bricked.ranges),
        }
    }

    /// What a classification that makes values from `lo` to `hi` visible wants to be there; `None` where everything is.
    pub(crate) fn wanted(
        &self,
        visible: impl Fn(f32, f32) -> bool + Sync,
        margin: bool,
    ) -> Option<Arc<Wanted>> {
        match &self.held {
            Held::Whole { .. } => None,
            Held::Bricks(bricked) => {
                let blocks = &bricked.ranges.level0.blocks;
                let occupied: Vec<bool> = blocks.par_iter().map(|&[lo, hi]| visible(lo, hi)).collect();
                Some(Arc::new(Wanted::new(&bricked.grid, &bricked.ranges, &occupied, margin)))
            }
        }
    }

    /// Its textures, with what is wanted in them. `volume` is what this was made of.
    pub(crate) fn resident(
        &self,
        gpu: &Gpu,
        volume: &dyn VoxelSource,
        wanted: Option<&Arc<Wanted>>,
    ) -> Result<Resident<'_>, GpuError> {
        match &self.held {
            Held::Whole { texture, no_pages } => {
                let voxels = texture.create_view(&wgpu::TextureViewDescriptor::default());
                Ok(Resident { voxels, pages: no_pages.clone(), _state: None })
            }
            Held::Bricks(bricked) => {
                let mut state = lock(&bricked.state);
                if let Some(wanted) = wanted {
                    state.follow(gpu, &bricked.grid, &self.texels, volume, wanted)?;
                }
                let missing = || GpuError::OutOfMemory { what: "the volume's bricks".to_owned() };
                let [voxels, pages] = state.atlas.as_ref().map(Atlas::views).ok_or_else(missing)?;
                Ok(Resident { voxels, pages, _state: Some(state) })
            }
        }
    }

    /// Whether this is the volume of a scene, as far as that can be told.
    pub(crate) fn is_of(&self, scene: &Scene) -> bool {
        scene.volume().dimensions() == self.dimensions
    }
}

impl Bricks {
    /// Makes what is wanted be there.
    fn follow(
        &mut self,
        gpu: &Gpu,
        grid: &BrickGrid,
        texels: &Texels,
        volume: &dyn VoxelSource,
        wanted: &Arc<Wanted>,
    ) -> Result<(), GpuError> {
        if self.current.as_ref().is_some_and(|c| Arc::ptr_eq(c, wanted)) {
            return gpu.alive();
        }
        self.current = None;
        let slots = self.room(gpu, grid, texels, wanted.count())?;
        let plan = Plan::new(grid, wanted, slots);
        let bytes = slot_bytes(grid, texels);
        let (needed, available) = (wanted.count() * bytes, slots * bytes);
        let coarser = plan.coarsest() > 0;
        if coarser && gpu.oversize() == Oversize::Refuse {
            let reason = format!(
                "what is visible of it needs {}, and there are {}; show less of it, or take `--engine cpu`",
                megabytes(needed),
                megabytes(available)
            );
            return Err(GpuError::TooLarge { dimensions: grid.dimensions, reason });
        }
        let atlas = self.atlas.as_mut().expect("room has made it");
        atlas.follow(gpu, volume, &plan)?;
        self.notice = coarser.then(|| Notice::Coarser {
            factor: 1 << plan.coarsest(),
            share: plan.coarser_share(),
            needed,
            available,
        });
        self.current = Some(wanted.clone());
        Ok(())
    }

    /// An atlas for so many bricks, or as many as there is memory for: its slots.
    fn room(&mut self, gpu: &Gpu, grid: &BrickGrid, texels: &Texels, wanted: u64) -> Result<u64, GpuError> {
        loop {
            let most = self.too_many.map_or(u64::MAX, |n| n - 1).min(grid.most_slots).max(1);
            let slots = |n: u64| grid.atlas(n).to_array().iter().map(|n| u64::from(*n)).product::<u64>();
            if let Some(atlas) = &self.atlas
                && atlas.capacity() >= slots(wanted.min(most))
            {
                return Ok(atlas.capacity());
            }
            // One that grows will grow again.
            let spare = if self.atlas.is_some() { wanted / 4 } else { 0 };
            let target = (wanted + spare).clamp(1, most);
            // The old one goes first: both at once may be too much.
            self.atlas = None;
            match Atlas::new(gpu, *grid, *texels, target) {
                Ok(atlas) => self.atlas = Some(atlas),
                Err(GpuError::OutOfMemory { .. }) if target > 1 => self.too_many = Some(target.div_ceil(2)),
                Err(error) => return Err(error),
            }
        }
    }
}

fn lock(state: &Mutex<Bricks>) -> MutexGuard<'_, Bricks> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

fn whole_bytes(dimensions: UVec3, texels: &Texels) -> u64 {
    dimensions.to_array().iter().map(|n| u64::from(*n)).product::<u64>() * u64::from(texels.bytes_per_voxel())
}

/// Whether the limits allow a texture of the whole volume.
fn fits(gpu: &Gpu, dimensions: UVec3, texels: &Texels) -> bool {
    let can = gpu.capabilities();
    dimensions.max_element() <= can.max_texture_3d && whole_bytes(dimensions, texels) <= can.max_texture_bytes
}

/// Uploads a whole volume, in layers of bounded size.
fn whole(gpu: &Gpu, volume: &Volume, texels: &Texels) -> Result<Held, GpuError> {
    let dimensions = volume.dimensions();
    let (texture, no_pages) = gpu.checked("the volume's texture", || {
        let no_pages = texture_3d(gpu, "no pages", UVec3::ONE, wgpu::TextureFormat::Rg32Uint);
        let no_pages = no_pages.create_view(&wgpu::TextureViewDescriptor::default());
        (texture_3d(gpu, "volume", dimensions, texels.format), no_pages)
    })?;
    let layer = dimensions.x as usize * dimensions.y as usize;
    let layer_bytes = layer * texels.bytes_per_voxel() as usize;
    let layers = (BYTES_AT_ONCE / layer_bytes).clamp(1, dimensions.z as usize) as u32;
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(dimensions.x * texels.bytes_per_voxel()),
        rows_per_image: Some(dimensions.y),
    };
    for z in (0..dimensions.z).step_by(layers as usize) {
        let depth = layers.min(dimensions.z - z);
        let bytes = texels.bytes(volume.voxels(), z as usize * layer..(z + depth) as usize * layer);
        let target = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: 0, z },
            ..texture.as_image_copy()
        };
        let size = wgpu::Extent3d { width: dimensions.x, height: dimensions.y, depth_or_array_layers: depth };
        gpu.checked("uploading the volume", || {
            gpu.queue().write_texture(target, &bytes, layout, size);
            gpu.queue().submit([]);
        })?;
        // So that at most two layers are under way.
        gpu.finish()?;
    }
    Ok(Held::Whole { texture, no_pages })
}
