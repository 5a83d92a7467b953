//! Bytes of the device on their way to the host.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::gpu::Gpu;
use crate::error::GpuError;

/// A buffer that is being mapped.
#[derive(Debug)]
pub(crate) struct Arrival {
    buffer: wgpu::Buffer,
    /// Of what it is, for errors.
    what: &'static str,
    there: Arc<AtomicBool>,
}

impl Arrival {
    /// Has a buffer mapped that was made for that, and copied to by what was submitted.
    pub(crate) fn of(buffer: wgpu::Buffer, what: &'static str) -> Self {
        let there = Arc::new(AtomicBool::new(false));
        let tell = there.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |_| tell.store(true, Ordering::Release));
        Self { buffer, what, there }
    }

    /// Whether it is there, or never will be; looked at whenever the device is ([`Gpu::look`]).
    pub(crate) fn is_there(&self) -> bool {
        self.there.load(Ordering::Acquire)
    }

    /// Its bytes, to be called once it is there.
    pub(crate) fn bytes<T>(&self, read: impl FnOnce(&[u8]) -> T) -> Result<T, GpuError> {
        let refused =
            |e: wgpu::MapRangeError| GpuError::Refused { what: self.what.to_owned(), reason: e.to_string() };
        let mapped = self.buffer.get_mapped_range(..).map_err(refused)?;
        Ok(read(&mapped))
    }
}

impl Gpu {
    /// Looks at what the device has done, without waiting for it.
    pub(crate) fn look(&self) -> Result<(), GpuError> {
        let looked = self.device().poll(wgpu::PollType::Poll);
        self.alive()?;
        looked.map(|_| ()).map_err(|e| GpuError::Lost { reason: e.to_string() })
    }
}
