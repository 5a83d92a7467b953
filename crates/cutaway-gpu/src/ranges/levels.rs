//! The blocks of a volume, in two levels.

use cutaway_core::glam::UVec3;

/// Cells along an edge of a fine block, unless there would be too many of them. Smaller ones fit what is visible more
/// closely; of 4 cells a block's own voxels are still most of those that it reads (64 of 125).
const FINE_EDGE: u32 = 4;

/// Fine blocks along an edge of a coarse one.
const FINE_PER_COARSE: u32 = 8;

/// Bytes that the ranges of all blocks may take: what every device lets a shader see of a buffer.
const MOST_BYTES: u64 = 128 << 20;

/// Blocks along each axis, in two levels, and cells along an edge of each. Edges are powers of two, so that dividing by
/// them is exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockLevels {
    pub(crate) fine: UVec3,
    pub(crate) coarse: UVec3,
    pub(crate) fine_edge: u32,
    pub(crate) coarse_edge: u32,
}

impl BlockLevels {
    /// The finest blocks of a volume of so many voxels whose ranges fit in a buffer of `most_bytes`.
    pub(crate) fn new(dimensions: UVec3, most_bytes: u64) -> Self {
        let mut levels = Self::with_edge(dimensions, FINE_EDGE);
        while !levels.fits(most_bytes) {
            levels = Self::with_edge(dimensions, levels.fine_edge * 2);
        }
        levels
    }

    /// Whether the ranges fit in a buffer of `most_bytes`. Those of a single block always do.
    pub(super) fn fits(&self, most_bytes: u64) -> bool {
        self.range_bytes() <= most_bytes.min(MOST_BYTES) || self.fine == UVec3::ONE
    }

    fn with_edge(dimensions: UVec3, fine_edge: u32) -> Self {
        let cells = dimensions.saturating_sub(UVec3::ONE).max(UVec3::ONE);
        let blocks = |edge: u32| UVec3::from_array(cells.to_array().map(|n| n.div_ceil(edge)));
        let coarse_edge = fine_edge * FINE_PER_COARSE;
        Self { fine: blocks(fine_edge), coarse: blocks(coarse_edge), fine_edge, coarse_edge }
    }

    /// How many fine blocks there are.
    pub(crate) fn fine_count(&self) -> u64 {
        count(self.fine)
    }

    /// How many coarse blocks there are.
    pub(crate) fn coarse_count(&self) -> u64 {
        count(self.coarse)
    }

    /// Fine blocks along an edge of a coarse one.
    pub(crate) fn fine_per_coarse(&self) -> u32 {
        self.coarse_edge / self.fine_edge
    }

    /// Of a word a block: the fine ones, then the coarse ones.
    pub(crate) fn range_bytes(&self) -> u64 {
        4 * (self.fine_count() + self.coarse_count())
    }

    /// Words of a bit for every fine block.
    pub(crate) fn fine_words(&self) -> u64 {
        self.fine_count().div_ceil(32)
    }

    /// Words of two bits for every coarse block.
    pub(crate) fn coarse_words(&self) -> u64 {
        self.coarse_count().div_ceil(16)
    }
}

fn count(blocks: UVec3) -> u64 {
    blocks.to_array().map(u64::from).iter().product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_grow_until_their_ranges_fit() {
        let small = BlockLevels::new(UVec3::new(513, 9, 2), u64::MAX);
        assert_eq!((small.fine, small.fine_edge), (UVec3::new(128, 2, 1), 4));
        assert_eq!((small.coarse, small.coarse_edge), (UVec3::new(16, 1, 1), 32));
        let large = BlockLevels::new(UVec3::splat(2048), u64::MAX);
        assert_eq!((large.fine_edge, large.fine), (8, UVec3::splat(256)));
        let bound = BlockLevels::new(UVec3::splat(64), 64);
        assert!(bound.range_bytes() <= 64, "{bound:?}");
        assert_eq!(BlockLevels::new(UVec3::splat(2), 1).fine, UVec3::ONE);
    }
}
