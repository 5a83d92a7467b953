//! The renderer: threads, tiles and statistics around the kernels.

use std::sync::OnceLock;

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::value_ranges::ValueRanges;
use cutaway_core::volume::{Volume, Voxels};
use fearless_simd::Level;
use rayon::prelude::*;

use crate::bricks;
use crate::cast::{self, Kernel};
use crate::classification::Classification;
use crate::normals;
use crate::rays::Frame;
use crate::simd::{SimdChoice, UnsupportedSimd, level_name};
use crate::tiles::{TILE, Tile, morton_tiles};

/// Why the engine cannot start or render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CpuError {
    /// The processor lacks the instructions that were asked for.
    #[error(transparent)]
    Simd(#[from] UnsupportedSimd),
    /// The threads could not be started.
    #[error("could not start {threads} threads: {reason}")]
    Threads {
        /// How many were asked for (0: one a core).
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// More voxels than 32-bit indices address.
    #[error("the volume has {voxels} voxels; the cpu engine addresses at most 4294967295")]
    TooLarge {
        /// Voxels of the volume.
        voxels: usize,
    },
}

/// A volume made ready: its value ranges. The voxels are used where they are.
///
/// What only some settings need (bricks, normals) is made when a scene first asks for it, and kept.
#[derive(Debug)]
pub struct CpuVolume {
    ranges: ValueRanges,
    bricks: OnceLock<Option<Voxels>>,
    normals: OnceLock<Vec<u32>>,
}

impl CpuVolume {
    /// Value ranges of the volume's blocks.
    pub fn ranges(&self) -> &ValueRanges {
        &self.ranges
    }

    /// The voxels in bricks; none where those would be too many to address.
    pub(crate) fn bricks(&self, volume: &Volume) -> Option<&Voxels> {
        self.bricks.get_or_init(|| bricks::bricked(volume)).as_ref()
    }

    /// Directions of the gradient, one word a voxel.
    pub(crate) fn normals(&self, volume: &Volume) -> &[u32] {
        self.normals.get_or_init(|| normals::normals(volume))
    }

    /// Bytes that settings have added to the volume's own: bricks and normals.
    pub fn added_bytes(&self) -> usize {
        let bricks = self.bricks.get().and_then(Option::as_ref).map_or(0, bricks::bytes);
        bricks + self.normals.get().map_or(0, |n| size_of_val(n.as_slice()))
    }
}

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Rays that met the volume.
    pub rays: u64,
    /// Samples of the field that were taken; cells looked at, for isosurfaces.
    pub samples: u64,
    /// Stretches of occupied blocks: along packets of rays, or along single rays for isosurfaces.
    pub segments: u64,
    /// The share of samples within the volume that were not taken: empty, or behind opaque ones; 0..=1. Isosurfaces have no
    /// samples to skip: 0.
    pub skipped_fraction: f64,
}

/// Threads and an instruction set.
#[derive(Debug)]
pub struct CpuRenderer {
    pool: rayon::ThreadPool,
    level: Level,
}

impl CpuRenderer {
    /// `threads`: 0 for one a core.
    pub fn new(threads: usize, simd: SimdChoice) -> Result<Self, CpuError> {
        let level = simd.level()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("cutaway-{i}"))
            .build()
            .map_err(|e| CpuError::Threads { threads, reason: e.to_string() })?;
        Ok(Self { pool, level })
    }

    /// Threads in use.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Name of the instruction set in use.
    pub fn simd(&self) -> &'static str {
        level_name(self.level)
    }

    /// Makes a volume ready; reads every voxel once.
    pub fn prepare(&self, volume: &Volume) -> Result<CpuVolume, CpuError> {
        let voxels = volume.voxels().len();
        if u32::try_from(voxels).is_err() {
            return Err(CpuError::TooLarge { voxels });
        }
        let ranges = self.pool.install(|| ValueRanges::new(volume));
        Ok(CpuVolume { ranges, bricks: OnceLock::new(), normals: OnceLock::new() })
    }

    /// Classifies a prepared volume; see [`Classification`].
    pub fn classify(&self, volume: &CpuVolume, scene: &Scene) -> Classification {
        self.pool.install(|| Classification::new(volume, scene))
    }

    /// Renders a frame of a scene with a classification made for it. `progress` is called with the finished share of
    /// the image, 0..=1, from any thread.
    pub fn render(
        &self,
        volume: &CpuVolume,
        classification: &Classification,
        scene: &Scene,
        progress: &(dyn Fn(f32) + Sync),
    ) -> (Image, Statistics) {
        let (width, height) = scene.resolution();
        let frame = Frame::new(scene);
        let kernel = self.pool.install(|| Kernel::new(volume, classification, scene));
        let corners = morton_tiles(width, height);
        let done = std::sync::atomic::AtomicUsize::new(0);
        let cast = |&(x, y): &(u32, u32)| {
            let tile = cast::tile(self.level, &kernel, &frame, x, y);
            let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            progress(done as f32 / corners.len() as f32);
            tile
        };
        let tiles: Vec<Tile> = self.pool.install(|| corners.par_iter().with_max_len(1).map(cast).collect());
        assemble(width, height, &tiles)
    }
}

fn assemble(width: u32, height: u32, tiles: &[Tile]) -> (Image, Statistics) {
    let count = width as usize * height as usize;
    let (mut colors, mut depths) = (vec![[0.0f32; 4]; count], vec![f32::INFINITY; count]);
    let mut statistics = Statistics::default();
    let mut without_skipping = 0;
    for tile in tiles {
        let columns = TILE.min(width - tile.x) as usize;
        for row in 0..TILE.min(height - tile.y) {
            let to = (tile.y + row) as usize * width as usize + tile.x as usize;
            let from = (row * TILE) as usize;
            colors[to..to + columns].copy_from_slice(&tile.colors[from..from + columns]);
            depths[to..to + columns].copy_from_slice(&tile.depths[from..from + columns]);
        }
        statistics.rays += tile.rays;
        statistics.samples += tile.samples;
        statistics.segments += tile.runs;
        without_skipping += tile.samples_without_skipping;
    }
    if without_skipping > 0 {
        statistics.skipped_fraction = 1.0 - statistics.samples as f64 / without_skipping as f64;
    }
    let image = Image::new(width, height, colors).and_then(|image| image.with_depth(depths));
    (image.expect("one pixel a ray of a resolution that the scene has checked"), statistics)
}
