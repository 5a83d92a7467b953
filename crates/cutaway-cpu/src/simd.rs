//! Instruction sets: chosen once at run time, then every kernel is compiled for each of them.

use fearless_simd::Level;

/// Which instructions the kernels use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SimdChoice {
    /// The widest that this processor has.
    #[default]
    Auto,
    /// Plain scalar code: the twin that the others are held against.
    Scalar,
    /// AVX2 and FMA: 8 rays at once.
    Avx2,
    /// AVX-512: 16 rays at once.
    Avx512,
}

/// An instruction set that this processor does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this processor has no {0}; leave the choice to `auto`")]
pub struct UnsupportedSimd(&'static str);

impl SimdChoice {
    /// The proof that kernels may use the instructions.
    pub(crate) fn level(self) -> Result<Level, UnsupportedSimd> {
        match self {
            Self::Auto => Ok(Level::new()),
            Self::Scalar => Ok(Level::fallback()),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => Level::new().as_avx2().map(Level::Avx2).ok_or(UnsupportedSimd("AVX2")),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => Level::new().as_avx512().map(Level::Avx512).ok_or(UnsupportedSimd("AVX-512")),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx2 => Err(UnsupportedSimd("AVX2")),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx512 => Err(UnsupportedSimd("AVX-512")),
        }
    }
}

/// What statistics call a level.
pub(crate) fn level_name(level: Level) -> &'static str {
    if level.is_fallback() {
        return "scalar";
    }
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        if level.as_avx512().is_some() {
            return "avx512";
        }
        if level.as_avx2().is_some() {
            return "avx2";
        }
        if level.as_sse4_2().is_some() { "sse4.2" } else { "sse2" }
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    "neon"
}
