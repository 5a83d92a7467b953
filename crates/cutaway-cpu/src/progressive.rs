//! Progressive rendering: a whole image at once, and a better one with every call.
//!
//! What enters: a scene, and a time budget a call. What leaves: at any moment an image of full size; in the end that of
//! [`CpuRenderer::render`], bit for bit.
//!
//! The first tile is a whole image: a lattice so coarse that one tile holds it. What it took says what a ray costs in this
//! view, and so which lattice the rest of the budget has the time for: the finest power of two that fits, or else one
//! quarter of the spacing. Every lattice begins as what the one before makes of it, so that wherever casting stops the image has
//! no holes. From a spacing of 4 the next step is every pixel: lattices cost at most a third of the full image when the
//! budget allowed for a spacing of 2, a tenth otherwise.
//!
//! Lifetimes: a [`Progressive`] borrows the renderer, the prepared volume, the classification and the scene, and is for one
//! view; a viewer makes one after each change. It is `Send`: a viewer drives it from a thread of its own, sets the flag
//! when the user moves on, and drops it.

use std::borrow::Cow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;

use crate::cast::Kernel;
use crate::classification::Classification;
use crate::lattice::{DepthFill, Lattice};
use crate::prepared::CpuVolume;
use crate::rays::Frame;
use crate::renderer::CpuRenderer;
use crate::statistics::Statistics;
use crate::tiles::{Raster, TILE, Tally, Tile, morton_tiles};

/// The share of a budget that a lattice is chosen to take: rays of another lattice may cost more.
const PLANNED_SHARE: f64 = 0.75;

/// The coarsest lattice, in pixels, that is followed by every pixel.
const LAST_LATTICE: u32 = 4;

/// How far an image is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The share of pixels that are as they will stay, 0..=1.
    pub finished_share: f32,
    /// Distance in pixels of the cast pixels that the whole image has at least; 0 while there is no image at all.
    pub spacing: u32,
    /// Whether every pixel is as it will stay.
    pub done: bool,
    /// Whether the call returned because the flag was set.
    pub cancelled: bool,
}

/// An image that is rendered bit by bit; see the methods of [`CpuRenderer`].
#[derive(Debug)]
pub struct Progressive<'a> {
    renderer: &'a CpuRenderer,
    volume: &'a CpuVolume,
    classification: &'a Classification,
    scene: Cow<'a, Scene>,
    /// What is being cast: whole at any time, filled in from the lattice before where it is not cast yet.
    current: Lattice,
    /// Tiles of the current lattice, and how many of them are cast.
    tiles: Vec<(u32, u32)>,
    cast: usize,
    /// Spacing of the last lattice that was cast whole; 0: none.
    whole: u32,
    tally: Tally,
    /// Seconds a pixel took in one thread, the newest counting half; none before the first tile.
    pace: Option<f64>,
}

impl CpuRenderer {
    /// An image of a scene that is there at once and refined by every [`Progressive::advance`]. Nothing is cast yet. The
    /// scene's `image_interpolation` has no part in it: in the end every pixel is cast.
    pub fn progressive<'a>(
        &'a self,
        volume: &'a CpuVolume,
        classification: &'a Classification,
        scene: &'a Scene,
    ) -> Progressive<'a> {
        let scene = scene.normalised();
        let size = scene.resolution();
        let spacing = first_spacing(size);
        let dimensions = Lattice::dimensions(size, spacing);
        Progressive {
            renderer: self,
            volume,
            classification,
            scene,
            current: Lattice { spacing, raster: Raster::new(dimensions) },
            tiles: morton_tiles(dimensions.0, dimensions.1),
            cast: 0,
            whole: 0,
            tally: Tally::default(),
            pace: None,
        }
    }
}

/// The finest power of two whose lattice is a single tile.
fn first_spacing(size: (u32, u32)) -> u32 {
    let one_tile = |spacing: &u32| {
        let (columns, rows) = Lattice::dimensions(size, *spacing);
        columns.max(rows) <= TILE
    };
    (0..).map(|exponent| 1 << exponent).find(one_tile).expect("a lattice of 2 x 2 pixels is a tile")
}

impl Progressive<'_> {
    /// Casts tiles until the budget is spent, all is done or `cancel` is set.
    ///
    /// Unless `cancel` is set before, every call casts at least one tile, so that any budget leads to the end; the first
    /// one always leaves a whole image. A thread takes no new tile once the budget is spent or the flag is set: a call
    /// takes no longer than that and the tile in hand, 32 x 32 rays.
    pub fn advance(&mut self, budget: Duration, cancel: &AtomicBool) -> Step {
        // Later than the clock can say is never.
        let deadline = Instant::now().checked_add(budget);
        let cancelled = || cancel.load(Ordering::Relaxed);
        let mut any = false;
        while !self.is_done() && !cancelled() {
            let left = deadline.map(|d| d.saturating_duration_since(Instant::now()));
            if any && left == Some(Duration::ZERO) {
                break;
            }
            if self.cast == self.tiles.len() {
                self.refine(left.unwrap_or(budget));
            }
            self.cast_tiles(deadline, cancel, !any);
            any = true;
        }
        Step {
            finished_share: self.finished_share(),
            spacing: self.whole,
            done: self.is_done(),
            cancelled: !self.is_done() && cancelled(),
        }
    }

    /// The image so far, of full size; transparent before the first tile. Takes time in proportion to the pixels.
    pub fn image(&self) -> Image {
        let depths = DepthFill::of(self.scene.settings().mode);
        let size = self.scene.resolution();
        let blur = self.scene.settings().blur;
        let image = self.renderer.install(|| self.current.filled(size, 1, depths).into_image().blurred(blur));
        image.with_depth_unit(self.scene.space().unit)
    }

    /// What all calls together took.
    pub fn statistics(&self) -> Statistics {
        self.tally.statistics()
    }

    /// Whether every pixel is as it will stay.
    pub fn is_done(&self) -> bool {
        self.whole == 1
    }

    fn finished_share(&self) -> f32 {
        if self.current.spacing > 1 {
            return 0.0;
        }
        let (width, height) = self.scene.resolution();
        let pixels = |(x, y): &(u32, u32)| u64::from(TILE.min(width - x)) * u64::from(TILE.min(height - y));
        let cast: u64 = self.tiles[..self.cast].iter().map(pixels).sum();
        if self.is_done() { 1.0 } else { cast as f32 / (u64::from(width) * u64::from(height)) as f32 }
    }

    /// Goes on to a finer lattice, for which there is so much time.
    fn refine(&mut self, left: Duration) {
        let size = self.scene.resolution();
        let spacing = next_spacing(self.current.spacing, |spacing| {
            let (columns, rows) = Lattice::dimensions(size, spacing);
            let rays = f64::from(columns) * f64::from(rows) / self.renderer.threads() as f64;
            self.pace.is_some_and(|pace| rays * pace <= left.as_secs_f64() * PLANNED_SHARE)
        });
        let depths = DepthFill::of(self.scene.settings().mode);
        let dimensions = Lattice::dimensions(size, spacing);
        let raster = self.renderer.install(|| self.current.filled(dimensions, spacing, depths));
        self.current = Lattice { spacing, raster };
        self.tiles = morton_tiles(dimensions.0, dimensions.1);
        self.cast = 0;
    }

    /// Casts tiles of the current lattice, in their order; at least one where `one` says so and nobody cancels.
    fn cast_tiles(&mut self, deadline: Option<Instant>, cancel: &AtomicBool, one: bool) {
        let Self { renderer, tiles, cast, current, .. } = self;
        let scene = self.scene.clone();
        let full = Frame::new(&scene);
        let frame = match current.spacing {
            1 => full,
            spacing => full.lattice(0, spacing, (current.raster.width, current.raster.height)),
        };
        let kernel = Kernel::new(self.volume, self.classification, &scene);
        let begin = *cast;
        let next = AtomicUsize::new(begin);
        let finished: Mutex<Vec<(Tile, Duration)>> = Mutex::new(Vec::new());
        renderer.on_every_thread(|| {
            loop {
                let owed = one && next.load(Ordering::Relaxed) == begin;
                let late = deadline.is_some_and(|d| Instant::now() >= d);
                if cancel.load(Ordering::Relaxed) || (late && !owed) {
                    return;
                }
                // Tiles are taken in order, and a tile that is taken is cast: what is cast is always the first so many.
                let Some(&tile) = tiles.get(next.fetch_add(1, Ordering::Relaxed)) else { return };
                let started = Instant::now();
                let mut tile = Tile::new(tile.0, tile.1);
                renderer.cast(&kernel, &frame, &mut tile);
                let entry = (tile, started.elapsed());
                finished.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(entry);
            }
        });
        let finished = finished.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        self.take_in(&finished);
    }

    fn take_in(&mut self, finished: &[(Tile, Duration)]) {
        let (mut seconds, mut pixels) = (0.0, 0.0);
        let (width, height) = (self.current.raster.width, self.current.raster.height);
        let rows = self.current.raster.rows_of_tiles();
        for (tile, time) in finished {
            rows[(tile.y / TILE) as usize].put(tile);
            self.tally = self.tally.and(Tally::of(tile));
            pixels += f64::from(TILE.min(width - tile.x)) * f64::from(TILE.min(height - tile.y));
            seconds += time.as_secs_f64();
        }
        drop(rows);
        if pixels > 0.0 {
            let newest = seconds / pixels;
            self.pace = Some(self.pace.map_or(newest, |pace| 0.5 * (pace + newest)));
        }
        self.cast += finished.len();
        if self.cast == self.tiles.len() {
            self.whole = self.current.spacing;
        }
    }
}

/// The spacing after `spacing`, above 1: the finest power of two that `fits`, and at any rate a quarter, or 1 after
/// [`LAST_LATTICE`].
fn next_spacing(spacing: u32, fits: impl Fn(u32) -> bool) -> u32 {
    let at_any_rate = if spacing <= LAST_LATTICE { 1 } else { (spacing / 4).max(LAST_LATTICE) };
    (0..at_any_rate.ilog2()).map(|exponent| 1 << exponent).find(|s| fits(*s)).unwrap_or(at_any_rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_lattice_is_one_tile() {
        let spacings = [(1, 1), (32, 32), (33, 20), (512, 512), (32_768, 4096)].map(first_spacing);
        assert_eq!(spacings, [1, 1, 2, 32, 2048]);
    }

    #[test]
    fn spacings_fall_to_every_pixel_and_faster_where_time_allows() {
        let chain = |finest: u32| {
            let mut chain = vec![32];
            while *chain.last().unwrap() > 1 {
                chain.push(next_spacing(*chain.last().unwrap(), |s| s >= finest));
            }
            chain
        };
        assert_eq!(chain(64), [32, 8, 4, 1]);
        assert_eq!(chain(4), [32, 4, 1]);
        assert_eq!(chain(2), [32, 2, 1]);
        assert_eq!(chain(1), [32, 1]);
    }
}
