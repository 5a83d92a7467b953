//! Value ranges: the least and greatest stored number in every block of a volume, built once from the voxels.
//!
//! A level-0 block is [`BLOCK`]³ cells; it needs the voxels on all their corners, one layer more than it has cells, so
//! that interpolation inside a block never leaves the block's range. A level-1 block is [`BLOCK`]³ level-0 blocks.
//! A transfer-function edit reads these ranges and no voxel: see [`crate::occupancy`].

use glam::UVec3;
use rayon::prelude::*;

use crate::volume::Volume;
use crate::with_voxels;

/// Cells along an edge of a level-0 block, and level-0 blocks along an edge of a level-1 block.
pub const BLOCK: u32 = 8;

/// A dense 3D grid of blocks, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockGrid<T> {
    /// Blocks along x, y, z.
    pub dimensions: UVec3,
    /// One entry a block.
    pub blocks: Vec<T>,
}

impl<T: Copy> BlockGrid<T> {
    /// Linear index of a block.
    #[inline]
    pub fn index(&self, b: UVec3) -> usize {
        (b.z as usize * self.dimensions.y as usize + b.y as usize) * self.dimensions.x as usize + b.x as usize
    }

    /// The entry of a block.
    #[inline]
    pub fn get(&self, b: UVec3) -> T {
        self.blocks[self.index(b)]
    }

    /// The grid one level up: each of its blocks reduces up to [`BLOCK`]³ of these.
    pub fn coarser<U: Copy + Send>(&self, init: U, merge: impl Fn(U, T) -> U + Sync) -> BlockGrid<U>
    where
        T: Sync,
    {
        self.coarser_by(BLOCK, init, merge)
    }

    /// A coarser grid: each of its blocks reduces up to `edge`³ of these.
    pub fn coarser_by<U: Copy + Send>(
        &self,
        edge: u32,
        init: U,
        merge: impl Fn(U, T) -> U + Sync,
    ) -> BlockGrid<U>
    where
        T: Sync,
    {
        let d = self.dimensions;
        let dimensions = UVec3::new(d.x.div_ceil(edge), d.y.div_ceil(edge), d.z.div_ceil(edge));
        let mut blocks = vec![init; (dimensions.x * dimensions.y * dimensions.z) as usize];
        let plane = (dimensions.x * dimensions.y) as usize;
        blocks.par_chunks_mut(plane).enumerate().for_each(|(bz, out)| {
            let z0 = bz as u32 * edge;
            for z in z0..(z0 + edge).min(d.z) {
                for y in 0..d.y {
                    let row = self.index(UVec3::new(0, y, z));
                    for x in 0..d.x {
                        let to = &mut out[(y / edge * dimensions.x + x / edge) as usize];
                        *to = merge(*to, self.blocks[row + x as usize]);
                    }
                }
            }
        });
        BlockGrid { dimensions, blocks }
    }
}

/// Least and greatest stored number of every block, in two levels.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueRanges {
    /// Blocks of [`BLOCK`]³ cells.
    pub level0: BlockGrid<[f32; 2]>,
    /// Blocks of [`BLOCK`]³ level-0 blocks.
    pub level1: BlockGrid<[f32; 2]>,
}

/// What no number is in.
const NONE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl BlockGrid<[f32; 2]> {
    /// Least and greatest stored number in blocks of `edge`³ cells. Reads every voxel once (and the shared layers twice), in
    /// parallel over rows of blocks.
    pub fn of_values(volume: &Volume, edge: u32) -> Self {
        let d = volume.dimensions();
        let cells = (d - UVec3::ONE).max(UVec3::ONE);
        let dimensions = UVec3::new(cells.x.div_ceil(edge), cells.y.div_ceil(edge), cells.z.div_ceil(edge));
        let mut blocks = vec![[0.0; 2]; (dimensions.x * dimensions.y * dimensions.z) as usize];
        with_voxels!(volume.voxels(), voxels => {
            blocks.par_chunks_mut(dimensions.x as usize).enumerate().for_each(|(row, out)| {
                let (by, bz) = (row as u32 % dimensions.y, row as u32 / dimensions.y);
                block_row(voxels, d, edge, (by, bz), out);
            });
        });
        Self { dimensions, blocks }
    }
}

impl ValueRanges {
    /// Reads every voxel once (and the shared layers twice), in parallel over slabs of blocks.
    pub fn new(volume: &Volume) -> Self {
        Self::from_level0(BlockGrid::of_values(volume, BLOCK))
    }

    /// The same from the ranges of blocks of half the edge: a block's voxels are those of its eighths.
    pub fn from_halves(halves: &BlockGrid<[f32; 2]>) -> Self {
        Self::from_level0(halves.coarser_by(2, NONE, union))
    }

    fn from_level0(level0: BlockGrid<[f32; 2]>) -> Self {
        let level1 = level0.coarser(NONE, union);
        Self { level0, level1 }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<[f32; 2]>() * (self.level0.blocks.len() + self.level1.blocks.len())
    }
}

/// Ranges of one row of blocks along x. First reduces over y and z for each x (contiguous, so it vectorises), then
/// over x.
fn block_row<T>(voxels: &[T], d: UVec3, edge: u32, (by, bz): (u32, u32), out: &mut [[f32; 2]])
where
    T: Copy + PartialOrd + Into<f32>,
{
    let width = d.x as usize;
    let end = |b: u32, n: u32| ((b + 1) * edge).min(n - 1);
    let start = |z: u32, y: u32| (z as usize * d.y as usize + y as usize) * width;
    let first = start(bz * edge, by * edge);
    let mut lo = voxels[first..first + width].to_vec();
    let mut hi = lo.clone();
    for z in bz * edge..=end(bz, d.z) {
        for y in by * edge..=end(by, d.y) {
            let row = &voxels[start(z, y)..start(z, y) + width];
            for ((lo, hi), v) in lo.iter_mut().zip(&mut hi).zip(row) {
                *lo = if *v < *lo { *v } else { *lo };
                *hi = if *v > *hi { *v } else { *hi };
            }
        }
    }
    for (b, range) in out.iter_mut().enumerate() {
        let from = b * edge as usize;
        let to = (from + edge as usize).min(width - 1);
        let least = lo[from..=to].iter().fold(lo[from], |a, &v| if v < a { v } else { a });
        let most = hi[from..=to].iter().fold(hi[from], |a, &v| if v > a { v } else { a });
        *range = [least.into(), most.into()];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field;
    use crate::volume::{Geometry, Rescale};
    use glam::DVec3;
    use proptest::prelude::*;

    fn noise(d: UVec3, seed: u32) -> Volume {
        let mut state = seed;
        let voxels: Vec<u16> = (0..d.x * d.y * d.z)
            .map(|_| {
                state = state.wrapping_mul(1664525).wrapping_add(1013904223);
                (state >> 16) as u16
            })
            .collect();
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn level_one_spans_its_blocks() {
        let volume = noise(UVec3::new(70, 20, 9), 7);
        let ranges = ValueRanges::new(&volume);
        assert_eq!(ranges.level0.dimensions, UVec3::new(9, 3, 1));
        assert_eq!(ranges.level1.dimensions, UVec3::new(2, 1, 1));
        let all =
            ranges.level1.blocks.iter().fold([f32::MAX, f32::MIN], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        assert_eq!(all, volume.stored_range());
    }

    #[test]
    fn blocks_hold_what_their_eighths_hold() {
        for d in [UVec3::new(70, 20, 9), UVec3::new(2, 6, 33), UVec3::new(13, 12, 11)] {
            let volume = noise(d, 11);
            let halves = BlockGrid::of_values(&volume, BLOCK / 2);
            assert_eq!(ValueRanges::from_halves(&halves), ValueRanges::new(&volume), "{d}");
        }
    }

    proptest! {
        #[test]
        fn every_interpolated_value_is_in_its_blocks_range(
            d in prop::array::uniform3(2u32..30), seed: u32, at in prop::array::uniform3(0.0f64..=1.0),
        ) {
            let d = UVec3::from_array(d);
            let volume = noise(d, seed);
            let ranges = ValueRanges::new(&volume);
            let p = DVec3::from_array(at) * volume.extent();
            let (cell, _) = field::cell_of(&volume, p);
            let block = UVec3::from_array(cell.map(|c| c as u32 / BLOCK));
            let [lo, hi] = ranges.level0.get(block);
            let v = field::value(&volume, p);
            prop_assert!(v >= f64::from(lo) - 1e-6 && v <= f64::from(hi) + 1e-6);
        }
    }
}
