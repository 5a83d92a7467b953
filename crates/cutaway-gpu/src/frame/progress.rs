//! What a frame on its way tells whoever waits for it, and how they end it.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::context::Gpu;
use crate::error::GpuError;

/// Told between the parts in which a frame goes to the device.
#[derive(Clone, Copy)]
pub(crate) struct Progress<'a> {
    tell: &'a dyn Fn(f32),
    cancel: Option<&'a AtomicBool>,
}

impl<'a> Progress<'a> {
    /// `tell` is called with the finished share, 0..=1; `cancel`, once it is set, ends the frame.
    pub(crate) fn new(tell: &'a dyn Fn(f32), cancel: Option<&'a AtomicBool>) -> Self {
        Self { tell, cancel }
    }

    /// Of what is itself a part: it tells nothing, and can be cancelled as the whole.
    pub(crate) fn silent(&self) -> Self {
        Self { tell: &|_| {}, ..*self }
    }

    /// [`GpuError::Cancelled`], if nobody wants the frame any more.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        match self.cancel {
            Some(cancel) if cancel.load(Ordering::Relaxed) => Err(GpuError::Cancelled),
            _ => Ok(()),
        }
    }

    /// A part was submitted, and with it this share of all. What is finished is not cancelled.
    pub(crate) fn advance(&self, gpu: &Gpu, share: f32) -> Result<(), GpuError> {
        if self.cancel.is_some() {
            // What is submitted cannot be called back: no part waits behind another.
            gpu.finish()?;
        }
        (self.tell)(share);
        if share < 1.0 { self.check() } else { Ok(()) }
    }
}
