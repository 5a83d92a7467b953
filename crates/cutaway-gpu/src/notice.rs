//! What was done otherwise than asked for, so that it could be done at all.

use std::fmt;

/// A substitution that can be seen in the image, or could be.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// Voxels are kept as 16-bit floats, for what they were does not fit.
    HalfPrecision {
        /// Largest rounding, as a share of the volume's range.
        rounding: f64,
        /// Bytes that full precision takes.
        needed: u64,
    },
    /// Parts of the volume are kept at coarser levels.
    Coarser {
        /// Voxels along an edge that the coarsest parts merge into one.
        factor: u32,
        /// The share of what is visible that is coarser than it was, 0..=1.
        share: f64,
        /// Bytes that all visible bricks take.
        needed: u64,
        /// Bytes that there are for them.
        available: u64,
    },
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HalfPrecision { rounding, needed } => write!(
                f,
                "the GPU has no room for the volume at full precision ({}): its values are rounded by up to \
                 {:.3} % of their range",
                megabytes(*needed),
                rounding * 100.0
            ),
            Self::Coarser { factor, share, needed, available } => write!(
                f,
                "the GPU has no room for all visible parts of the volume ({} of {}): {:.0} % of them are shown \
                 coarser, down to one voxel of {factor} along each axis",
                megabytes(*available),
                megabytes(*needed),
                (share * 100.0).max(1.0)
            ),
        }
    }
}

/// Bytes in words, with three digits or all before the point.
pub(crate) fn megabytes(bytes: u64) -> String {
    let mib = bytes as f64 / f64::from(1 << 20);
    match mib {
        _ if bytes < 100_000 => format!("{bytes} bytes"),
        _ if mib < 10.0 => format!("{mib:.2} MiB"),
        _ => format!("{mib:.0} MiB"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_are_one_line_with_the_figures() {
        let coarser = Notice::Coarser { factor: 4, share: 0.25, needed: 3 << 30, available: 1 << 30 };
        assert_eq!(
            coarser.to_string(),
            "the GPU has no room for all visible parts of the volume (1024 MiB of 3072 MiB): 25 % of them are \
             shown coarser, down to one voxel of 4 along each axis"
        );
        let half = Notice::HalfPrecision { rounding: 1.0 / 8192.0, needed: 5 << 20 };
        assert_eq!(
            half.to_string(),
            "the GPU has no room for the volume at full precision (5.00 MiB): its values are rounded by up to \
             0.012 % of their range"
        );
    }
}
