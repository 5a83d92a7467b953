//! Tiles: how an image is shared among threads.
//!
//! Tiles are cast in Morton order, so that threads work near each other in the volume, and are handed out by work
//! stealing. A pixel does not depend on its tile: any number of threads gives the same image, bit for bit.

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
            samples_without_skipping: 0,
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
