//! How near to each other two renderings of one scene must be, and why.

use cutaway_core::image::Image;
use cutaway_core::image::compare::compare_with;

/// Bounds on the difference of two images.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Largest root mean square over pixels and channels.
    pub rmse: f64,
    /// Largest magnitude of the mean signed difference of any channel: a brightening or darkening.
    pub bias: f64,
    /// Largest share of pixels off by more than [`OUTLIER`].
    pub outliers: f64,
}

/// A pixel further off than this in any channel is an outlier: two levels of an 8-bit image.
pub const OUTLIER: f32 = 2.0 / 255.0;

/// A stepping engine at a quarter of a voxel against the reference. Its midpoint rule is off by `step² / 24` times the
/// second derivative of the integrand; for the transfer functions of the tests that is a few ten-thousandths, with
/// outliers where a ray grazes a steep ramp, and early termination at 0.999 darkens by less than 0.001.
pub const STEPPED: Tolerance = Tolerance { rmse: 0.002, bias: 0.001, outliers: 0.02 };

/// Adaptive image interpolation against every pixel cast: the project's bound of 1 %; a filled cell is within 1 % where it
/// is farthest from what is cast, and the other cells are exact. Errors of filled pixels have no preferred sign.
pub const INTERPOLATED: Tolerance = Tolerance { rmse: 0.01, bias: 0.002, outliers: 1.0 };

/// Two exact solutions, one of them in f32: rounding only.
pub const EXACT: Tolerance = Tolerance { rmse: 1e-5, bias: 1e-5, outliers: 0.0 };

/// The same kernel with other instructions: other rounding, fused or not, and nothing else. A rounding may move a
/// sample to the next entry of a classification table, which is off by at most the table's tolerance.
pub const SAME_KERNEL: Tolerance = Tolerance { rmse: 2e-5, bias: 1e-5, outliers: 0.0 };

/// Panics with all numbers where an image is further from what is expected than it may be.
#[track_caller]
pub fn assert_close(what: &str, expected: &Image, actual: &Image, tolerance: Tolerance) {
    let c = compare_with(expected, actual, OUTLIER).unwrap_or_else(|e| panic!("{what}: {e}"));
    let bias = c.bias.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let ok = c.rmse <= tolerance.rmse && bias <= tolerance.bias && c.outlier_share <= tolerance.outliers;
    assert!(
        ok && c.non_finite_pixels == 0,
        "{what}: rmse {:.2e}, bias {bias:.2e}, outliers {:.2e}, largest {:.2e}; allowed {tolerance:?}",
        c.rmse,
        c.outlier_share,
        c.largest_difference
    );
}
