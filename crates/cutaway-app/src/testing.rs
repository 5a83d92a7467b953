//! What tests of panels and handles have in common.

use std::sync::Arc;

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_io::scene_file::VolumeReference;

use crate::document::{Document, OpenVolume, SceneState, Solids};

/// A document with a small volume: 21 x 17 x 13 voxels of 1, 1 and 2 millimetres, brighter towards its middle.
pub(crate) fn document() -> Document {
    let dimensions = UVec3::new(21, 17, 13);
    let middle = 0.5 * (dimensions.as_dvec3() - 1.0);
    let voxels = (0..dimensions.element_product()).map(|i| {
        let at = UVec3::new(i % 21, i / 21 % 17, i / (21 * 17)).as_dvec3();
        (255.0 * (1.0 - (at - middle).length() / middle.length()).max(0.0)) as u8
    });
    let geometry = Geometry::from_spacing(DVec3::new(1.0, 1.0, 2.0));
    let volume = Volume::new(dimensions, voxels.collect(), Rescale::IDENTITY, geometry).unwrap();
    let state = SceneState::of_volume(&volume);
    let open = OpenVolume::new(volume, VolumeReference::Path("test.nrrd".to_owned()));
    Document::new(Arc::new(open), state, Solids::default(), None)
}
