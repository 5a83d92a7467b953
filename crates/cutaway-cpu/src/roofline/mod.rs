//! What this processor can do at most: the ceiling that frames are held against.
//!
//! A frame spends its time on samples, and on everything that decides which samples to take: rays, slabs, skipping,
//! early termination. [`Ceiling`] measures the first without the second: the engine's own sampler, at one instruction set,
//! over white noise, along parallel rays a voxel apart in three directions, in steps of one voxel. With a cube that
//! fits the caches beside a core it is the processor's limit; with one that fits no cache it is the memory's.
//!
//! It is the ceiling of these kernels, not of the silicon: a better kernel lifts it. And frames may pass it where it
//! does not apply: samples with nothing to see need no colour and no light.

mod kernel;

use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::scene::{Layer, RenderSettings, Scene, default_camera};
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume, VoxelType};
use cutaway_core::with_voxels;
use rayon::prelude::*;

use crate::cast::Shading;
use crate::error::CpuError;
use crate::sample::Grid;
use crate::simd::{SimdChoice, dispatch};
use crate::threads::STACK;
pub use kernel::Work;
use kernel::{CeilingTile, Done, Looks, TILE, VIEWS, View};

/// Entries of the table of colours: 16 KiB.
const ENTRIES: usize = 1024;

/// Fewest and most voxels a side of a cube.
const EDGES: std::ops::RangeInclusive<u32> = 16..=1024;

/// A cube of white noise, to measure how fast samples can be taken.
#[derive(Debug)]
pub struct Ceiling {
    volume: Volume,
    views: [View; 3],
    /// The next row of tiles and tile in it: measurements go on where the last one ended, so that a cube that is larger
    /// than the caches does not come to lie in them.
    next: AtomicUsize,
}

impl Ceiling {
    /// A cube of `edge` voxels a side, moved to a multiple of 16 from 16 to 1024, whose voxels are held as those of
    /// `voxel_type` are: in 8 bits, 16 bits or f32.
    pub fn new(edge: u32, voxel_type: VoxelType) -> Self {
        let edge = edge.clamp(*EDGES.start(), *EDGES.end()) / TILE * TILE;
        let volume = match voxel_type {
            VoxelType::U8 | VoxelType::I8 => noise(edge, |h| (h >> 24) as u8),
            VoxelType::U16 | VoxelType::I16 => noise(edge, |h| (h >> 16) as u16),
            _ => noise(edge, |h| (h >> 8) as f32 / (1 << 24) as f32),
        };
        let views = VIEWS.map(|(direction, up)| View::new(edge, direction, up));
        Self { volume, views, next: AtomicUsize::new(0) }
    }

    /// Bytes of its voxels.
    pub fn bytes(&self) -> usize {
        self.volume.voxels().bytes()
    }

    /// Samples a second that some threads (0: one a core) take together, measured over about `duration`.
    pub fn samples_per_second(
        &self,
        simd: SimdChoice,
        threads: usize,
        work: Work,
        duration: Duration,
    ) -> Result<f64, CpuError> {
        let level = simd.level()?;
        let looks = self.looks();
        let tiles_a_row = (self.volume.dimensions().x / TILE) as usize;
        let tile = || {
            let (view, at) = self.place(self.next.fetch_add(1, Ordering::Relaxed), tiles_a_row);
            let mut done = Done::default();
            with_voxels!(self.volume.voxels(), voxels => {
                let grid = Grid::new(&self.volume, voxels);
                dispatch(level, CeilingTile { work, grid, looks: &looks, view, at, done: &mut done });
            });
            black_box(done.sum);
            done.samples
        };
        rate(threads, duration, |_| tile)
    }

    /// The `k`-th tile: row by row, each row from another side. Rows far from each other follow each other, for those in
    /// the middle of an image are longer than those at its rim.
    fn place(&self, k: usize, tiles_a_row: usize) -> (&View, (u32, u32)) {
        const APART: usize = 13;
        let (row, column) = (k / tiles_a_row, k % tiles_a_row);
        let view = &self.views[row % self.views.len()];
        let row = row / self.views.len() * APART % tiles_a_row;
        (view, (column as u32 * TILE, row as u32 * TILE))
    }

    fn looks(&self) -> Looks {
        let volume = &self.volume;
        let point = |value: f64| ControlPoint { value, color: [1.0; 3], opacity: 0.01 };
        let [lo, hi] = volume.value_range();
        let function =
            TransferFunction::new(vec![point(lo), point(hi)]).expect("two points in ascending order");
        let settings = RenderSettings { step: 1.0, ..RenderSettings::default() };
        let camera = default_camera(volume, 1.0);
        let scene = Scene::new(Layer::new(volume.clone(), &function), camera, settings)
            .expect("a plain scene of a cube");
        Looks::new(volume.stored_range(), ENTRIES, Shading::new(&scene))
    }
}

/// Bytes a second that some threads (0: one a core) read together from memory of `bytes` in all, measured over about
/// `duration`.
pub fn read_bandwidth(threads: usize, bytes: usize, duration: Duration) -> Result<f64, CpuError> {
    /// Words between looks at the clock: 512 KiB.
    const PIECE: usize = 1 << 16;
    let threads = threads_of(threads);
    let words = (bytes / 8 / threads).max(PIECE) / PIECE * PIECE;
    rate(threads, duration, |_| {
        // Each thread writes what it reads, so that the memory is really there, and near to it.
        let memory: Vec<u64> = (0..words as u64).collect();
        let mut at = 0;
        move || {
            let piece = &memory[at..at + PIECE];
            black_box(piece.iter().fold(0u64, |sum, v| sum.wrapping_add(*v)));
            at = (at + PIECE) % words;
            8 * PIECE as u64
        }
    })
}

fn threads_of(threads: usize) -> usize {
    if threads > 0 { threads } else { std::thread::available_parallelism().map_or(1, usize::from) }
}

/// How much a second some threads do together. `worker` is called once on each of them, what it returns until the time
/// is over; that says how much it did.
fn rate<W: FnMut() -> u64>(
    threads: usize,
    duration: Duration,
    worker: impl Fn(usize) -> W + Sync,
) -> Result<f64, CpuError> {
    let threads = threads_of(threads);
    let ready = std::sync::Barrier::new(threads);
    let run = |i: usize| {
        let mut piece = worker(i);
        ready.wait();
        let (started, mut amount) = (Instant::now(), 0);
        loop {
            amount += piece();
            let elapsed = started.elapsed();
            if elapsed >= duration {
                return amount as f64 / elapsed.as_secs_f64();
            }
        }
    };
    // All threads come to be or none does: a barrier waits for each of them.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build()
        .map_err(|e| CpuError::Threads { threads, reason: e.to_string() })?;
    Ok(pool.broadcast(|context| run(context.index())).iter().sum())
}

/// White noise from a fixed seed.
fn noise<T: cutaway_core::volume::Voxel>(edge: u32, voxel: impl Fn(u32) -> T + Sync) -> Volume {
    let count = (edge as usize).pow(3);
    let voxels: Vec<T> = (0..count).into_par_iter().map(|i| voxel(hash(i as u32))).collect();
    Volume::new(UVec3::splat(edge), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
        .expect("a cube of voxels with unit spacing")
}

/// A hash of 32 bits ("lowbias32", C. Wellons).
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum and count over all tiles of all views.
    fn sweep(ceiling: &Ceiling, simd: SimdChoice, work: Work) -> Option<Done> {
        let level = simd.level().ok()?;
        let looks = ceiling.looks();
        let tiles_a_row = (ceiling.volume.dimensions().x / TILE) as usize;
        let mut all = Done::default();
        for k in 0..3 * tiles_a_row * tiles_a_row {
            let (view, at) = ceiling.place(k, tiles_a_row);
            with_voxels!(ceiling.volume.voxels(), voxels => {
                let grid = Grid::new(&ceiling.volume, voxels);
                dispatch(level, CeilingTile { work, grid, looks: &looks, view, at, done: &mut all });
            });
        }
        Some(all)
    }

    #[test]
    fn every_instruction_set_does_the_same_work() {
        for (kind, middle) in [(VoxelType::U8, 127.5), (VoxelType::U16, 32767.5), (VoxelType::F32, 0.5)] {
            let ceiling = Ceiling::new(48, kind);
            for work in Work::ALL {
                let scalar = sweep(&ceiling, SimdChoice::Scalar, work).expect("every machine has it");
                if work == Work::Sample {
                    let mean = scalar.sum / scalar.samples as f64;
                    assert!((mean / middle - 1.0).abs() < 0.01, "{kind:?}: a mean of {mean}");
                }
                for simd in [SimdChoice::Avx2, SimdChoice::Avx512, SimdChoice::Auto] {
                    let Some(done) = sweep(&ceiling, simd, work) else { continue };
                    assert_eq!(done.samples, scalar.samples);
                    let ratio = done.sum / scalar.sum;
                    assert!((ratio - 1.0).abs() < 1e-4, "{kind:?} {work:?} {simd:?}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn edges_are_moved_to_what_tiles_fill() {
        for (asked, bytes) in [(0, 16 * 16 * 16), (17, 16 * 16 * 16), (40, 32 * 32 * 32)] {
            assert_eq!(Ceiling::new(asked, VoxelType::U8).bytes(), bytes);
        }
    }

    #[test]
    fn rates_are_amounts_over_time() {
        let wait = Duration::from_millis(5);
        let per_second = rate(2, Duration::from_millis(20), |_| {
            move || {
                std::thread::sleep(wait);
                1
            }
        });
        let per_second = per_second.expect("two threads");
        assert!(per_second > 0.0 && per_second <= 2.0 / wait.as_secs_f64(), "{per_second}");
    }
}
