//! A device, and what becomes of its errors.

use std::future::Future;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::adapter::AdapterSummary;
use super::capabilities::Capabilities;
use super::filter_errors::FilterErrors;
use super::options::Oversize;
use crate::error::GpuError;

/// A device and what it can do. Cheap to clone; the clones are one device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) adapter: AdapterSummary,
    pub(super) capabilities: Capabilities,
    pub(super) filter_errors: FilterErrors,
    pub(super) oversize: Oversize,
    pub(super) lost: Arc<OnceLock<String>>,
    pub(super) uncaptured: Arc<Mutex<Option<wgpu::Error>>>,
}

impl Gpu {
    /// How exact its own filter is.
    pub fn filter_errors(&self) -> &FilterErrors {
        &self.filter_errors
    }

    /// What becomes of volumes that do not fit.
    pub fn oversize(&self) -> Oversize {
        self.oversize
    }

    /// The adapter in use.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.adapter
    }

    /// What it can do, after fallbacks.
    pub fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// The device, for whoever draws with it.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Does something on the device; what the driver has against it comes back as an error that says `what`.
    pub(crate) fn checked<T>(&self, what: &str, work: impl FnOnce() -> T) -> Result<T, GpuError> {
        self.alive()?;
        let out_of_memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = work();
        let errors = [self.wait(validation.pop()), self.wait(internal.pop()), self.wait(out_of_memory.pop())];
        // A device tells of its end when it is polled.
        let _ = self.device.poll(wgpu::PollType::Poll);
        self.alive()?;
        let error = errors.into_iter().flatten().next();
        // One from elsewhere, outside every scope, comes to light here.
        let stray = || self.uncaptured.lock().unwrap_or_else(PoisonError::into_inner).take();
        match error.or_else(stray) {
            None => Ok(made),
            Some(wgpu::Error::OutOfMemory { .. }) => Err(GpuError::OutOfMemory { what: what.to_owned() }),
            Some(error) => Err(GpuError::Refused { what: what.to_owned(), reason: one_line(&error) }),
        }
    }

    /// A buffer that holds `contents`, padded with zeros to a multiple of four bytes. Unlike wgpu's own helper it does not
    /// map the buffer, which would be a panic where there is no memory for it or the device is lost.
    pub(crate) fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len().next_multiple_of(4) as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let (whole, rest) = contents.split_at(contents.len() / 4 * 4);
        self.queue.write_buffer(&buffer, 0, whole);
        if !rest.is_empty() {
            let mut last = [0; 4];
            last[..rest.len()].copy_from_slice(rest);
            self.queue.write_buffer(&buffer, whole.len() as u64, &last);
        }
        buffer
    }

    /// An error if the device is gone.
    pub(crate) fn alive(&self) -> Result<(), GpuError> {
        match self.lost.get() {
            Some(reason) => Err(GpuError::Lost { reason: reason.clone() }),
            None => Ok(()),
        }
    }

    /// Waits until all submitted work is done.
    pub(crate) fn finish(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.alive()?;
        waited.map(|_| ()).map_err(|e| GpuError::Lost { reason: e.to_string() })
    }

    fn wait<T>(&self, future: impl Future<Output = T>) -> T {
        pollster::block_on(future)
    }
}

/// The causes of an error in one line, the innermost last.
fn one_line(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
