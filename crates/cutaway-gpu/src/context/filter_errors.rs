//! What is known of an adapter's own filter.

/// Largest error of a filter that is good enough, in units of the neighbours' difference: weights of eight bits, cut off,
/// along three axes are 3/256; rounding values to the format's steps is 1/8 here.
pub(crate) const LARGEST_ERROR: f32 = 1.0 / 64.0;

/// Errors of the adapter's filter, in units of the difference of neighbouring voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilterErrors {
    errors: Vec<(wgpu::TextureFormat, f32)>,
}

impl FilterErrors {
    /// What was found, format by format.
    pub(super) fn new(errors: Vec<(wgpu::TextureFormat, f32)>) -> Self {
        Self { errors }
    }

    /// The largest error in a format; `None` where the adapter does not filter it, or it was not tried.
    pub fn of(&self, format: wgpu::TextureFormat) -> Option<f32> {
        self.errors.iter().find(|(f, _)| *f == format).map(|(_, e)| *e)
    }

    /// Whether the filter does what trilinear interpolation is, up to the coarseness of its weights.
    pub fn is_exact_enough(&self, format: wgpu::TextureFormat) -> bool {
        self.of(format).is_some_and(|e| e <= LARGEST_ERROR)
    }
}
