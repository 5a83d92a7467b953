//! The renderer: threads, tiles and statistics around the kernels.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutaway_core::image::Image;
use cutaway_core::scene::{ImageInterpolation, Scene};
use cutaway_core::value_ranges::{BLOCK, BlockGrid, ValueRanges};
use cutaway_core::volume::{Volume, Voxels};
use fearless_simd::Level;
use rayon::prelude::*;

use crate::adaptive::{self, Cells, SPACING};
use crate::bricks;
use crate::cast::{self, Kernel};
use crate::classification::Classification;
use crate::lattice::{DepthFill, Lattice};
use crate::normals;
use crate::rays::Frame;
use crate::simd::{SimdChoice, UnsupportedSimd, level_name};
use crate::tiles::{Raster, Scratch, TILE, Tally, Tile, morton_tiles};

/// Why the engine cannot start or render.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// Least and greatest stored number in blocks of half the edge.
    halves: BlockGrid<[f32; 2]>,
    bricks: OnceLock<Option<Voxels>>,
    normals: OnceLock<Vec<u32>>,
}

impl CpuVolume {
    /// Value ranges of the volume's blocks.
    pub fn ranges(&self) -> &ValueRanges {
        &self.ranges
    }

    /// Least and greatest stored number in blocks of [`BLOCK`] / 2 cells a side.
    pub(crate) fn halves(&self) -> &BlockGrid<[f32; 2]> {
        &self.halves
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
    /// Rays that were cast and met the volume.
    pub rays: u64,
    /// Samples of the field that were taken; cells looked at, for isosurfaces.
    pub samples: u64,
    /// Stretches of occupied blocks: along packets of rays, or along single rays for isosurfaces.
    pub segments: u64,
    /// Lines through clip objects whose events did not balance and were repaired.
    pub repaired: u64,
    /// The share of samples within the volume that were not taken: empty, or behind opaque ones; 0..=1. Isosurfaces have no
    /// samples to skip: 0.
    pub skipped_fraction: f64,
}

/// Bytes of stack of each thread that runs kernels. The compiler inlines the kernels into a few large functions. Without
/// optimisation, as in a plain `cargo run` of another project, their frames need between 4 and 8 MiB, and the usual 2 MiB
/// overflow. The system provides only the pages that are used.
pub(crate) const STACK: usize = 32 << 20;

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
            .stack_size(STACK)
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
        let (ranges, halves) = self.pool.install(|| {
            let halves = BlockGrid::of_values(volume, BLOCK / 2);
            (ValueRanges::from_halves(&halves), halves)
        });
        Ok(CpuVolume { ranges, halves, bricks: OnceLock::new(), normals: OnceLock::new() })
    }

    /// Classifies a prepared volume; see [`Classification`].
    pub fn classify(&self, volume: &CpuVolume, scene: &Scene) -> Classification {
        self.pool.install(|| Classification::new(volume, &scene.normalised()))
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
        let scene = &*scene.normalised();
        let frame = Frame::new(scene);
        let kernel = self.pool.install(|| Kernel::new(volume, classification, scene));
        let mut render = Render {
            renderer: self,
            kernel: &kernel,
            frame: &frame,
            depths: DepthFill::of(scene.settings().mode),
            tally: Tally::default(),
            progress,
        };
        let raster = self.pool.install(|| match scene.settings().image_interpolation {
            ImageInterpolation::Off => render.every_pixel(),
            ImageInterpolation::Factor(factor) => render.every_so_many(factor),
            ImageInterpolation::Adaptive => render.adaptive(),
        });
        let image = self.install(|| raster.into_image().blurred(scene.settings().blur));
        (image.with_depth_unit(scene.space().unit), render.tally.statistics())
    }

    /// Runs work on every thread at once.
    pub(crate) fn on_every_thread(&self, work: impl Fn() + Sync) {
        self.pool.broadcast(|_| work());
    }

    /// Runs work in the threads.
    pub(crate) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Casts a tile of a frame.
    pub(crate) fn cast(&self, kernel: &Kernel, frame: &Frame, tile: &mut Tile) {
        cast::tile(self.level, kernel, frame, tile);
    }
}

/// One frame on its way. Runs within the threads.
struct Render<'a> {
    renderer: &'a CpuRenderer,
    kernel: &'a Kernel<'a>,
    frame: &'a Frame<'a>,
    depths: DepthFill,
    tally: Tally,
    progress: &'a (dyn Fn(f32) + Sync),
}

impl Render<'_> {
    fn every_pixel(&mut self) -> Raster {
        self.tiles(self.frame, [0.0, 1.0], |_| {})
    }

    fn every_so_many(&mut self, factor: u32) -> Raster {
        let size = (self.frame.width, self.frame.height);
        self.lattice(factor, [0.0, 1.0]).filled(size, 1, self.depths)
    }

    fn adaptive(&mut self) -> Raster {
        // Shares of the progress are those of rays, had every cell to be cast.
        let lattice = self.lattice(SPACING, [0.0, 0.05]);
        let columns_and_rows = adaptive::cells_of(self.frame);
        let Some(with_middle) = adaptive::agreeing_corners(&lattice, columns_and_rows) else {
            return self.tiles(self.frame, [0.05, 1.0], |_| {});
        };
        let middles = self.frame.lattice(SPACING / 2, SPACING, columns_and_rows);
        let middles = self.tiles(&middles.masked(&with_middle), [0.05, 0.1], |_| {});
        let cells = Cells::new(lattice, middles, self.depths);
        let cast = cells.to_cast(&with_middle, self.kernel);
        let frame = self.frame.masked(&cast);
        self.tiles(&frame, [0.1, 1.0], |tile| cells.fill(&cast, &frame, tile))
    }

    /// The lattice of this spacing.
    fn lattice(&mut self, spacing: u32, progress: [f32; 2]) -> Lattice {
        let size = Lattice::dimensions((self.frame.width, self.frame.height), spacing);
        let raster = self.tiles(&self.frame.lattice(0, spacing, size), progress, |_| {});
        Lattice { spacing, raster }
    }

    /// Casts what is wanted of a frame, tile by tile; `finish` has each tile after that.
    fn tiles(&mut self, frame: &Frame, [from, to]: [f32; 2], finish: impl Fn(&mut Tile) + Sync) -> Raster {
        let corners = morton_tiles(frame.width, frame.height);
        let done = AtomicUsize::new(0);
        let mut raster = Raster::new((frame.width, frame.height));
        let rows = raster.rows_of_tiles();
        let scratch = Scratch::new(self.renderer.threads());
        let cast = |&(x, y): &(u32, u32)| {
            let mut tile = scratch.tile(x, y);
            if frame.wants((x, y), (TILE, TILE)) {
                self.renderer.cast(self.kernel, frame, &mut tile);
            }
            finish(&mut tile);
            rows[(y / TILE) as usize].put(&tile);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.progress)(from + (to - from) * (done as f32 / corners.len() as f32));
            Tally::of(&tile)
        };
        let tally = corners.par_iter().with_max_len(1).map(cast).reduce(Tally::default, Tally::and);
        drop(rows);
        self.tally = self.tally.and(tally);
        raster
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_have_room_for_kernels_that_are_not_optimised() {
        let renderer = CpuRenderer::new(2, SimdChoice::Scalar).expect("two threads");
        // The usual 2 MiB would end the process here.
        renderer.on_every_thread(|| {
            let frame = [1u8; 12 << 20];
            assert_eq!(std::hint::black_box(&frame)[12345], 1);
        });
    }
}
