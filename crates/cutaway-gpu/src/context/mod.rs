//! The device: which adapter, what it can do, and what becomes of its errors.
//!
//! Enters: options. Leaves: a [`Gpu`], on which everything else is made. Optional features of the adapter are probed once
//! ([`Capabilities`]); whatever can be missing has a substitute, and [`Fallbacks`] pretends that it is missing, so that
//! tests on one machine see all of them.

mod adapter;
mod capabilities;

use std::future::Future;
use std::sync::{Arc, OnceLock};

pub use adapter::{AdapterChoice, AdapterSummary, adapters};
pub use capabilities::{Capabilities, Fallbacks, Filtering};

use crate::error::GpuError;

/// A device and what it can do. Cheap to clone; the clones are one device.
#[derive(Clone, Debug)]
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: AdapterSummary,
    capabilities: Capabilities,
    lost: Arc<OnceLock<String>>,
}

/// How a device is chosen and used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GpuOptions {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Features that are to be treated as missing.
    pub fallbacks: Fallbacks,
}

impl Gpu {
    /// Opens a device and waits for it.
    pub fn new(options: &GpuOptions) -> Result<Self, GpuError> {
        pollster::block_on(Self::open(options))
    }

    /// Opens a device.
    pub async fn open(options: &GpuOptions) -> Result<Self, GpuError> {
        let adapter = adapter::choose(&options.adapter).await?;
        let summary = AdapterSummary::of(&adapter);
        let wanted = capabilities::optional_features() & adapter.features();
        let limits = capabilities::limits(&adapter);
        capabilities::check(&summary, &adapter)?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("cutaway"),
            required_features: wanted,
            required_limits: limits,
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|e| GpuError::NoAdapter { reason: format!("{}: {e}", summary.name) })?;
        let lost = Arc::new(OnceLock::new());
        let tell = lost.clone();
        device.set_device_lost_callback(move |_, reason| {
            // The first reason is the cause; later ones follow from it.
            let _ = tell.set(reason);
        });
        let capabilities = Capabilities::probe(&device, &summary, &options.fallbacks);
        Ok(Self { device, queue, adapter: summary, capabilities, lost })
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
        self.alive()?;
        match errors.into_iter().flatten().next() {
            None => Ok(made),
            Some(wgpu::Error::OutOfMemory { .. }) => Err(GpuError::OutOfMemory { what: what.to_owned() }),
            Some(error) => Err(GpuError::Refused { what: what.to_owned(), reason: one_line(&error) }),
        }
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
