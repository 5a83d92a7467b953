//! Prepared volumes: what the engine computes of a volume once, whatever scenes show of it.

use std::sync::OnceLock;

use cutaway_core::value_ranges::{BLOCK, BlockGrid, ValueRanges};
use cutaway_core::volume::{Volume, Voxels};

use crate::bricks;
use crate::normals;

/// A volume made ready: its value ranges. The voxels are used where they are.
///
/// What only some settings need (bricks, normals) is made when a scene first asks for it, and kept.
#[derive(Debug)]
pub struct CpuVolume {
    ranges: ValueRanges,
    /// Least and greatest stored number in blocks of half the edge.
    halves: BlockGrid<[f32; 2]>,
    bricks: OnceLock<Option<Voxels>>,
    normals: OnceLock<Vec<u32>>,
}

impl CpuVolume {
    /// Prepares a volume; reads every voxel once, in the calling thread's pool.
    pub(crate) fn new(volume: &Volume) -> Self {
        let halves = BlockGrid::of_values(volume, BLOCK / 2);
        let ranges = ValueRanges::from_halves(&halves);
        Self { ranges, halves, bricks: OnceLock::new(), normals: OnceLock::new() }
    }

    /// Value ranges of the volume's blocks.
    pub fn ranges(&self) -> &ValueRanges {
        &self.ranges
    }

    /// Least and greatest stored number in blocks of [`BLOCK`] / 2 cells a side.
    pub(crate) fn halves(&self) -> &BlockGrid<[f32; 2]> {
        &self.halves
    }

    /// The voxels in bricks; none where those would be too many to address.
    pub(crate) fn bricks(&self, volume: &Volume) -> Option<&Voxels> {
        self.bricks.get_or_init(|| bricks::bricked(volume)).as_ref()
    }

    /// Directions of the gradient, one word a voxel.
    pub(crate) fn normals(&self, volume: &Volume) -> &[u32] {
        self.normals.get_or_init(|| normals::normals(volume))
    }

    /// Bytes that settings have added to the volume's own: bricks and normals.
    pub fn added_bytes(&self) -> usize {
        let bricks = self.bricks.get().and_then(Option::as_ref).map_or(0, bricks::bytes);
        bricks + self.normals.get().map_or(0, |n| size_of_val(n.as_slice()))
    }
}
