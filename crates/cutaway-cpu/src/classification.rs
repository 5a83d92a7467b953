//! Classification: what stored numbers look like to the kernels, and which blocks can be seen.
//!
//! Rebuilt on a change of transfer function, mode or step, in time proportional to the number of blocks; no voxel is read.

use cutaway_core::compositing::segment_opacity;
use cutaway_core::occupancy::Occupancy;
use cutaway_core::scene::{Mode, Scene, SpaceSkipping};
use cutaway_core::transfer_function::{ClassificationTable, extinction};

use crate::renderer::CpuVolume;

/// Tables and occupancy of one scene's transfer function, mode and step.
#[derive(Clone, Debug)]
pub struct Classification {
    /// *Opacity of a whole step* of each entry: read for every sample.
    pub(crate) opacities: Vec<f32>,
    /// Straight colour of each entry, padded: read where something is visible.
    pub(crate) colors: Vec<[f32; 4]>,
    /// Stored number of entry 0, entries per stored unit.
    pub(crate) index_map: (f32, f32),
    pub(crate) occupancy: Occupancy,
}

impl Classification {
    /// Classifies a volume's blocks for a scene.
    pub fn new(volume: &CpuVolume, scene: &Scene) -> Self {
        let source = scene.volume();
        let table =
            ClassificationTable::new(scene.transfer_function(), source.rescale(), source.stored_range());
        let (unit, step) = (scene.unit_distance(), scene.step_length());
        let opacity_of_step =
            |opacity: f32| segment_opacity(extinction(f64::from(opacity), unit), step) as f32;
        let opacities = table.entries().iter().map(|e| opacity_of_step(e[3])).collect();
        let colors = table.entries().to_vec();
        let settings = scene.settings();
        let ranges = volume.ranges();
        let isovalues: Vec<f64> = settings.iso.iter().map(|v| source.rescale().stored(*v)).collect();
        let occupancy = match (settings.space_skipping, settings.mode) {
            (SpaceSkipping::Off, _) | (_, Mode::Mip | Mode::Minip | Mode::Mean) => Occupancy::full(ranges),
            (SpaceSkipping::Auto, Mode::Composite) => Occupancy::new(ranges, |lo, hi| table.visible(lo, hi)),
            (SpaceSkipping::Auto, Mode::Iso) => Occupancy::new(ranges, |lo, hi| {
                isovalues.iter().any(|v| (f64::from(lo)..=f64::from(hi)).contains(v))
            }),
        };
        Self { opacities, colors, index_map: table.index_map(), occupancy }
    }

    /// The share of blocks that can be visible, 0..=1.
    pub fn occupied_fraction(&self) -> f64 {
        self.occupancy.occupied_fraction()
    }
}
