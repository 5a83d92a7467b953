//! Errors: why there is no frame.

use cutaway_core::scene::SceneError;
use cutaway_cpu::CpuError;
#[cfg(feature = "gpu")]
use cutaway_gpu::GpuError;

/// The reason why a frame was not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// No engine has this name here.
    #[error("no engine is named `{name}`; choose from {known}")]
    Unknown {
        /// The name.
        name: String,
        /// Names of the engines that there are.
        known: String,
    },
    /// The engine is not part of this build.
    #[error("the {engine} engine is not part of this build; it needs the Cargo feature `gpu`")]
    NotBuilt {
        /// The engine.
        engine: &'static str,
    },
    /// A kind of data that the engine does not render.
    #[error("the {engine} engine does not render an {kind}; set engine to {}", instead(kind))]
    Data {
        /// The engine.
        engine: &'static str,
        /// `volume` or `unstructured grid`.
        kind: &'static str,
    },
    /// A mode that the engine does not have.
    #[error("the {engine} engine does not have {mode} mode; set engine to cpu or raycast")]
    Mode {
        /// The engine.
        engine: &'static str,
        /// The mode.
        mode: &'static str,
    },
    /// A view of the engine's work that it does not offer.
    #[error("the {engine} engine does not show {view}; set engine to raycast")]
    Debug {
        /// The engine.
        engine: &'static str,
        /// The view.
        view: &'static str,
    },
    /// The edges of proxy geometry were asked for where there is none.
    #[error(
        "there is no proxy geometry to show in {mode} mode with space_skipping {skipping}; set space_skipping to cells, \
         fitted, boundary, contour or fitted-contour, in composite or iso mode"
    )]
    NoProxy {
        /// The mode.
        mode: &'static str,
        /// The way of skipping.
        skipping: &'static str,
    },
    /// The threads of the reference engine could not be started.
    #[error("could not start {threads} threads: {reason}")]
    Threads {
        /// Number of threads asked for; 0: one per core.
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// The frame was cancelled.
    #[error("the frame was cancelled before it was finished")]
    Cancelled,
    /// The CPU engine failed.
    #[error(transparent)]
    Cpu(#[from] CpuError),
    /// A GPU engine failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(GpuError),
    /// The scene is not valid at another resolution.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

fn instead(kind: &str) -> &'static str {
    if kind == "volume" { "cpu" } else { "cells" }
}

#[cfg(feature = "gpu")]
impl From<GpuError> for EngineError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Cancelled => Self::Cancelled,
            error => Self::Gpu(error),
        }
    }
}
