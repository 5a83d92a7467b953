//! Counts that the engine reports of a frame.

/// Counts of the rays and samples of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Rays that were cast and met the volume.
    pub rays: u64,
    /// Samples of the field that were taken; cells looked at, for isosurfaces.
    pub samples: u64,
    /// Stretches of occupied blocks: along packets of rays, or along single rays for isosurfaces.
    pub segments: u64,
    /// Lines through clip objects whose events did not balance and were repaired.
    pub repaired: u64,
    /// The share of samples within the volume that were not taken: empty, or behind opaque ones; 0..=1. Isosurfaces have no
    /// samples to skip: 0.
    pub skipped_fraction: f64,
}
