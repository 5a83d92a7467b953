//! Tiles: how an image is shared among threads.
//!
//! Tiles are cast in Morton order, so that threads work near each other in the volume, and are handed out by work
//! stealing. A pixel does not depend on its tile: any number of threads gives the same image, bit for bit.

use std::sync::{LockResult, Mutex, MutexGuard, PoisonError};

use cutaway_core::image::Image;

use crate::statistics::Statistics;

/// Edge of a tile in pixels; a multiple of a bundle's.
pub(crate) const TILE: u32 = 32;

/// A cast tile: `TILE²` pixels, rows from its top left, beyond the image's border transparent.
#[derive(Default)]
pub(crate) struct Tile {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) colors: Vec<[f32; 4]>,
    pub(crate) depths: Vec<f32>,
    pub(crate) samples: u64,
    pub(crate) runs: u64,
    pub(crate) rays: u64,
    /// Lines through clip objects whose events did not balance.
    pub(crate) repaired: u64,
    /// Samples that a ray casting without any skipping would take.
    pub(crate) samples_without_skipping: u64,
}

impl Tile {
    pub(crate) fn new(x: u32, y: u32) -> Self {
        let n = (TILE * TILE) as usize;
        Self {
            x,
            y,
            colors: vec![[0.0; 4]; n],
            depths: vec![f32::INFINITY; n],
            samples: 0,
            runs: 0,
            rays: 0,
            repaired: 0,
            samples_without_skipping: 0,
        }
    }

    /// Makes it a new tile at another place.
    fn begin_at(&mut self, x: u32, y: u32) {
        let Self { mut colors, mut depths, .. } = std::mem::take(self);
        colors.fill([0.0; 4]);
        depths.fill(f32::INFINITY);
        *self = Self { x, y, colors, depths, ..Self::default() };
    }
}

/// A tile a thread, used again and again: the memory of a tile is then in the nearest cache, and none is asked for in
/// the course of a frame.
pub(crate) struct Scratch(Vec<Mutex<Tile>>);

impl Scratch {
    pub(crate) fn new(threads: usize) -> Self {
        Self((0..threads.max(1)).map(|_| Mutex::new(Tile::new(0, 0))).collect())
    }

    /// The calling thread's tile, with nothing cast into it. To be called in a thread of the pool, and not again before the
    /// tile is given back.
    pub(crate) fn tile(&self, x: u32, y: u32) -> MutexGuard<'_, Tile> {
        let thread = rayon::current_thread_index().unwrap_or(0) % self.0.len();
        let mut tile = unpoisoned(self.0[thread].lock());
        tile.begin_at(x, y);
        tile
    }
}

/// What a lock guards here is written anew by whoever takes it: nothing half done can be seen.
fn unpoisoned<T>(lock: LockResult<T>) -> T {
    lock.unwrap_or_else(PoisonError::into_inner)
}

/// What casting some tiles took.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    samples: u64,
    runs: u64,
    rays: u64,
    repaired: u64,
    samples_without_skipping: u64,
}

impl Tally {
    pub(crate) fn of(tile: &Tile) -> Self {
        let &Tile { samples, runs, rays, repaired, samples_without_skipping, .. } = tile;
        Self { samples, runs, rays, repaired, samples_without_skipping }
    }

    /// Both together.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            runs: self.runs + other.runs,
            rays: self.rays + other.rays,
            repaired: self.repaired + other.repaired,
            samples_without_skipping: self.samples_without_skipping + other.samples_without_skipping,
        }
    }

    pub(crate) fn statistics(&self) -> Statistics {
        let all = self.samples_without_skipping;
        let skipped_fraction = if all > 0 { 1.0 - self.samples as f64 / all as f64 } else { 0.0 };
        let Self { rays, samples, runs: segments, repaired, .. } = *self;
        Statistics { rays, samples, segments, repaired, skipped_fraction }
    }
}

/// Pixels and depths that tiles are put together to: rows from the top left, transparent at first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) colors: Vec<[f32; 4]>,
    pub(crate) depths: Vec<f32>,
}

impl Raster {
    pub(crate) fn new((width, height): (u32, u32)) -> Self {
        let n = width as usize * height as usize;
        Self { width, height, colors: vec![[0.0; 4]; n], depths: vec![f32::INFINITY; n] }
    }

    /// Its rows of tiles, top to bottom, each of which any thread can put tiles into.
    pub(crate) fn rows_of_tiles(&mut self) -> Vec<RowOfTiles<'_>> {
        let width = self.width as usize;
        let len = width * TILE as usize;
        let rows = self.colors.chunks_mut(len).zip(self.depths.chunks_mut(len));
        rows.map(|pixels| RowOfTiles { width, pixels: Mutex::new(pixels) }).collect()
    }

    pub(crate) fn into_image(self) -> Image {
        let image = Image::new(self.width, self.height, self.colors);
        let image = image.and_then(|image| image.with_depth(self.depths));
        image.expect("as many pixels as a resolution that the scene has checked")
    }
}

/// The pixels of a row of tiles of a raster.
pub(crate) struct RowOfTiles<'a> {
    width: usize,
    /// Colours and depths.
    pixels: Mutex<(&'a mut [[f32; 4]], &'a mut [f32])>,
}

impl RowOfTiles<'_> {
    /// Puts a tile of this row in its place.
    pub(crate) fn put(&self, tile: &Tile) {
        let first = tile.x as usize;
        let columns = (TILE as usize).min(self.width - first);
        let mut pixels = unpoisoned(self.pixels.lock());
        let (colors, depths) = &mut *pixels;
        let rows = colors.chunks_mut(self.width).zip(depths.chunks_mut(self.width));
        for ((colors, depths), from) in rows.zip((0..).step_by(TILE as usize)) {
            colors[first..first + columns].copy_from_slice(&tile.colors[from..from + columns]);
            depths[first..first + columns].copy_from_slice(&tile.depths[from..from + columns]);
        }
    }
}

/// Top left corners of all tiles of an image, in Morton order.
pub(crate) fn morton_tiles(width: u32, height: u32) -> Vec<(u32, u32)> {
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let mut tiles: Vec<(u32, u32)> = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).collect();
    tiles.sort_by_key(|&(x, y)| interleave(x) | interleave(y) << 1);
    tiles.into_iter().map(|(x, y)| (x * TILE, y * TILE)).collect()
}

/// Spreads the bits of a number to the even places.
fn interleave(v: u32) -> u64 {
    let mut v = u64::from(v);
    for (shift, mask) in [(16, 0x0000_ffff_0000_ffff), (8, 0x00ff_00ff_00ff_00ff), (4, 0x0f0f_0f0f_0f0f_0f0f)]
    {
        v = (v | v << shift) & mask;
    }
    v = (v | v << 2) & 0x3333_3333_3333_3333;
    (v | v << 1) & 0x5555_5555_5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_comes_once_and_neighbours_come_together() {
        let tiles = morton_tiles(130, 70);
        assert_eq!(tiles.len(), 5 * 3);
        assert_eq!(&tiles[..4], &[(0, 0), (32, 0), (0, 32), (32, 32)]);
        let mut sorted = tiles.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), tiles.len());
    }
}
