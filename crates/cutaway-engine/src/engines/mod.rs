//! The engines, one file each. [`ENGINES`] is the one list of them.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod reference;

use std::fmt;

#[cfg(feature = "gpu")]
use cutaway_gpu::{Gpu, GpuOptions, context::AdapterChoice, context::adapters};

use crate::engine::AnyEngine;
use crate::error::EngineError;
use crate::renderer::Setup;

/// A function that starts an engine.
pub type StartFn = fn(&mut Start) -> Result<Box<dyn AnyEngine>, EngineError>;

/// An engine in the list.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Its name at the command line and in scene files.
    pub name: &'static str,
    /// Starts it.
    pub start: StartFn,
}

impl fmt::Debug for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Entry").field(&self.name).finish()
    }
}

/// Every engine of this build. A new engine takes a file that implements [`Engine`](crate::Engine) and a line here.
pub const ENGINES: &[Entry] = &[
    Entry { name: "cpu", start: cpu::start },
    Entry { name: "reference", start: reference::start },
    #[cfg(feature = "gpu")]
    Entry { name: "raycast", start: gpu::raycast::start },
    #[cfg(feature = "gpu")]
    Entry { name: "slices", start: gpu::slices::start },
    #[cfg(feature = "gpu")]
    Entry { name: "cells", start: gpu::cells::start },
];

/// Names of engines that only a build with the feature `gpu` has.
pub(crate) const GPU_ENGINES: [&str; 3] = ["raycast", "slices", "cells"];

/// Everything that engines are started with: the set-up, and the graphics device, opened when it is first needed.
#[derive(Debug)]
pub struct Start {
    /// Threads, instruction set, adapter.
    pub setup: Setup,
    #[cfg(feature = "gpu")]
    gpu: Option<Result<Gpu, cutaway_gpu::GpuError>>,
    /// True if there is a hardware GPU, once that was looked up, which takes as long as a coarse image.
    #[cfg(feature = "gpu")]
    hardware: Option<bool>,
}

impl Start {
    pub(crate) fn new(setup: Setup) -> Self {
        Self {
            setup,
            #[cfg(feature = "gpu")]
            gpu: None,
            #[cfg(feature = "gpu")]
            hardware: None,
        }
    }
}

#[cfg(feature = "gpu")]
impl Start {
    pub(crate) fn sharing(setup: Setup, gpu: Gpu) -> Self {
        Self { setup, gpu: Some(Ok(gpu)), hardware: None }
    }

    /// Returns the graphics device: the shared one, the one of the adapter that the set-up names, or the best one.
    ///
    /// # Errors
    /// No adapter, or none of this name.
    pub fn gpu(&mut self) -> Result<Gpu, EngineError> {
        let open = || {
            let name = self.setup.adapter.clone();
            let adapter = name.map_or(AdapterChoice::Best, AdapterChoice::Named);
            Gpu::new(&GpuOptions { adapter, ..GpuOptions::default() })
        };
        Ok(self.gpu.get_or_insert_with(open).clone()?)
    }

    /// Returns true if the automatic choice is a GPU: a hardware one, or any that the set-up names.
    pub(crate) fn prefers_gpu(&mut self) -> bool {
        if self.setup.adapter.is_some() {
            return true;
        }
        match &self.gpu {
            Some(Ok(gpu)) => !gpu.adapter().software,
            Some(Err(_)) => false,
            None => {
                let look = || adapters().first().is_some_and(|adapter| !adapter.software);
                *self.hardware.get_or_insert_with(look) && self.gpu().is_ok()
            }
        }
    }
}

#[cfg(not(feature = "gpu"))]
impl Start {
    pub(crate) fn prefers_gpu(&mut self) -> bool {
        false
    }
}
