//! What slices are made of, and what a frame of them took.

use cutaway_core::value_ranges::ValueRanges;

use super::octree::Octree;
use crate::classification::GpuClassification;
use crate::clipping::ClipStatistics;
use crate::frame::{self, Taken};
use crate::notice::Notice;
use crate::volume::GpuVolume;

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SliceStatistics {
    /// Pixels in which something is.
    pub rays: u64,
    /// Bricks of which something can be visible.
    pub bricks: u64,
    /// The share of all bricks that they are not, 0..=1.
    pub skipped_fraction: f64,
    /// Boxes that were drawn, each in one call: bricks, or several that are visible together.
    pub boxes: u64,
    /// Polygons, over all boxes.
    pub slices: u64,
    /// Bytes on the device: volume, ranges of blocks, tables, targets, clip.
    pub gpu_bytes: u64,
    /// What clipping took; nothing where there is none.
    pub clip: ClipStatistics,
    /// Milliseconds of blending on the device's own clock; none where it has no timestamps.
    pub gpu_ms: Option<f64>,
}

impl SliceStatistics {
    /// With what is known once a frame is there.
    pub(super) fn completed(self, taken: Taken, gpu_ms: Option<f64>) -> Self {
        Self { rays: taken.rays, gpu_ms, ..self }
    }

    /// Triangles that were drawn, some of them without area: four a polygon.
    pub fn triangles(&self) -> u64 {
        4 * self.slices
    }
}

/// A volume made ready: on the device, and what is in its blocks.
#[derive(Debug)]
pub struct PreparedSlices {
    pub(super) on_device: frame::PreparedVolume,
    /// Known to the host, which decides what is drawn; none where the volume has them.
    pub(super) ranges: Option<ValueRanges>,
}

impl PreparedSlices {
    pub(super) fn ranges(&self) -> Option<&ValueRanges> {
        self.on_device.voxels().host_ranges().or(self.ranges.as_ref())
    }

    /// The voxels on the device.
    pub fn voxels(&self) -> &GpuVolume {
        self.on_device.voxels()
    }

    /// What was substituted so that it fits.
    pub fn notices(&self) -> Vec<Notice> {
        self.on_device.notices()
    }
}

/// Tables and the octree of one scene's transfer function, mode, step, clip and size of bricks.
#[derive(Debug)]
pub struct SliceClassification {
    pub(super) on_device: GpuClassification,
    pub(super) octree: Octree,
}

impl SliceClassification {
    /// Bricks that there are, and those of which something can be visible.
    pub fn brick_counts(&self) -> [u64; 2] {
        [self.octree.brick_count(), self.octree.visible_count()]
    }
}
