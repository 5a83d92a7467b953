//! Ranges of blocks, as they lie on the device.

use super::levels::BlockLevels;
use super::map::RangeMap;

/// The ranges of a volume's blocks.
#[derive(Debug)]
pub(crate) struct GpuRanges {
    pub(super) levels: BlockLevels,
    pub(super) map: RangeMap,
    pub(super) words: wgpu::Buffer,
}

impl GpuRanges {
    /// What they are in.
    pub(crate) fn map(&self) -> RangeMap {
        self.map
    }

    /// The blocks that there are.
    pub(crate) fn levels(&self) -> BlockLevels {
        self.levels
    }

    /// A word a block: fine ones, then coarse ones.
    pub(crate) fn words(&self) -> &wgpu::Buffer {
        &self.words
    }

    /// What they take of the device's memory.
    pub(crate) fn bytes(&self) -> u64 {
        self.words.size()
    }
}
