//! What is made of a volume once, before any scene is known.

use std::sync::OnceLock;

use cutaway_core::scene::Scene;
use cutaway_core::volume::Volume;

use super::sampling::{GpuDirections, SamplingVariant};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::notice::Notice;
use crate::ranges::{BlockPipelines, GpuRanges};
use crate::volume::GpuVolume;

/// A volume made ready: on the device, and what is in its blocks.
#[derive(Debug)]
pub struct PreparedVolume {
    voxels: GpuVolume,
    ranges: GpuRanges,
    /// Made when a scene first asks for them.
    directions: OnceLock<GpuDirections>,
}

impl PreparedVolume {
    /// Uploads a volume, and finds the ranges of its blocks.
    pub(crate) fn new(gpu: &Gpu, blocks: &BlockPipelines, volume: &Volume) -> Result<Self, GpuError> {
        let voxels = GpuVolume::new(gpu, volume)?;
        let ranges = blocks.ranges(gpu, &voxels, volume)?;
        Ok(Self { voxels, ranges, directions: OnceLock::new() })
    }

    /// What its blocks hold.
    pub(crate) fn ranges(&self) -> &GpuRanges {
        &self.ranges
    }

    /// Directions of its gradient, where a scene wants them.
    pub(crate) fn directions(&self, gpu: &Gpu, scene: &Scene) -> Result<Option<&GpuDirections>, GpuError> {
        if !SamplingVariant::of(scene).wants_directions() {
            return Ok(None);
        }
        if let Some(made) = self.directions.get() {
            return Ok(Some(made));
        }
        let made = GpuDirections::new(gpu, scene.volume(), &self.voxels)?;
        Ok(Some(self.directions.get_or_init(|| made)))
    }

    /// The voxels on the device.
    pub fn voxels(&self) -> &GpuVolume {
        &self.voxels
    }

    /// What was substituted so that it fits; of a volume in bricks, for the last scene that was classified.
    pub fn notices(&self) -> Vec<Notice> {
        self.voxels.notices()
    }
}
