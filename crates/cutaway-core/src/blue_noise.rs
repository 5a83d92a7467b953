//! Blue noise: a tile of offsets for the rays of neighbouring pixels, without the low frequencies that an eye would see.
//!
//! The tile was made by void-and-cluster (Ulichney 1993): points are placed one after the other in the largest void among
//! those that are there, as measured by a Gaussian around each, on a torus; a pixel's value is its place in that order.
//! Values are equally often: sixteen times each of 256. The tile repeats over an image without a seam. It is fixed, so
//! that images do not change from one run to the next; a test makes it anew and holds it against the one kept here.

#[cfg(test)]
mod void_and_cluster;

/// Pixels along a side of the tile.
pub const SIDE: u32 = 64;

/// Values row by row.
pub static TILE: &[u8; (SIDE * SIDE) as usize] = include_bytes!("blue_noise/tile.bin");

/// The share of a step, within 0..1 and never either end, that a pixel's rays are offset by.
pub fn offset(x: u32, y: u32) -> f32 {
    let value = TILE[((y % SIDE) * SIDE + x % SIDE) as usize];
    (f32::from(value) + 0.5) / 256.0
}
