//! Tiles: how an image is shared among threads.
//!
//! Tiles are cast in Morton order, so that threads work near each other in the volume, and are handed out by work
//! stealing. A pixel does not depend on its tile: any number of threads gives the same image, bit for bit.

use cutaway_core::image::Image;

use crate::renderer::Statistics;

/// Edge of a tile in pixels; a multiple of a bundle's.
pub(crate) const TILE: u32 = 32;

/// A cast tile: `TILE²` pixels, rows from its top left, beyond the image's border transparent.
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
    pub(crate) fn add(&mut self, tile: &Tile) {
        self.samples += tile.samples;
        self.runs += tile.runs;
        self.rays += tile.rays;
        self.repaired += tile.repaired;
        self.samples_without_skipping += tile.samples_without_skipping;
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

    pub(crate) fn put(&mut self, tile: &Tile) {
        let columns = TILE.min(self.width - tile.x) as usize;
        for row in 0..TILE.min(self.height - tile.y) {
            let to = (tile.y + row) as usize * self.width as usize + tile.x as usize;
            let from = (row * TILE) as usize;
            self.colors[to..to + columns].copy_from_slice(&tile.colors[from..from + columns]);
            self.depths[to..to + columns].copy_from_slice(&tile.depths[from..from + columns]);
        }
    }

    pub(crate) fn into_image(self) -> Image {
        let image = Image::new(self.width, self.height, self.colors);
        let image = image.and_then(|image| image.with_depth(self.depths));
        image.expect("as many pixels as a resolution that the scene has checked")
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
