//! The pixels of an image for which rays are cast.

use cutaway_core::scene::{ImageInterpolation, Scene};

/// The pixels that are cast: lattice pixel `(i, j)` is pixel `(i, j) * spacing` of the image. A lattice reaches beyond the
/// image's right and lower border, so that every pixel lies in a cell with four corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lattice {
    /// Pixels from one cast pixel to the next.
    pub(crate) spacing: u32,
    /// Cast pixels along x and y.
    pub(crate) size: [u32; 2],
}

impl Lattice {
    pub(crate) fn of(scene: &Scene) -> Self {
        let settings = scene.settings();
        match settings.image_interpolation {
            ImageInterpolation::Factor(spacing) => {
                Self { spacing, size: settings.resolution.map(|side| (side - 1) / spacing + 2) }
            }
            ImageInterpolation::Off | ImageInterpolation::Adaptive => {
                Self { spacing: 1, size: settings.resolution }
            }
        }
    }
}
