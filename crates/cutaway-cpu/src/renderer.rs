//! The renderer: threads, tiles and statistics around the kernels.

use std::sync::atomic::{AtomicUsize, Ordering};

use cutaway_core::image::Image;
use cutaway_core::scene::{ImageInterpolation, Scene};
use cutaway_core::volume::Volume;
use fearless_simd::Level;
use rayon::prelude::*;

use crate::adaptive::{self, Cells, SPACING};
use crate::cast::{self, Kernel};
use crate::classification::Classification;
use crate::error::CpuError;
use crate::lattice::{DepthFill, Lattice};
use crate::prepared::CpuVolume;
use crate::rays::Frame;
use crate::simd::{SimdChoice, level_name};
use crate::statistics::Statistics;
use crate::threads::STACK;
use crate::tiles::{Raster, Scratch, TILE, Tally, Tile, morton_tiles};

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
        Ok(self.pool.install(|| CpuVolume::new(volume)))
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
