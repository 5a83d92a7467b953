//! Errors of the engine.

use crate::simd::UnsupportedSimd;

/// Why the engine cannot start or render.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CpuError {
    /// The processor lacks the instructions that were asked for.
    #[error(transparent)]
    Simd(#[from] UnsupportedSimd),
    /// The threads could not be started.
    #[error("could not start {threads} threads: {reason}")]
    Threads {
        /// How many were asked for (0: one a core).
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// More voxels than 32-bit indices address.
    #[error("the volume has {voxels} voxels; the cpu engine addresses at most 4294967295")]
    TooLarge {
        /// Voxels of the volume.
        voxels: usize,
    },
}
