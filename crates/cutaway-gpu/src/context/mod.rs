//! The device: which adapter, what it can do, and what becomes of its errors.
//!
//! Enters: options. Leaves: a [`Gpu`], on which everything else is made. Optional features of the adapter are probed once
//! ([`Capabilities`]); whatever can be missing has a substitute, and [`Fallbacks`] pretends that it is missing, so that
//! tests on one machine see all of them.

mod adapter;
mod capabilities;
pub(crate) mod filter;
mod stopwatch;

use std::future::Future;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

pub use adapter::{AdapterChoice, AdapterSummary, adapters};
#[cfg(test)]
pub(crate) use capabilities::all_capabilities;
pub use capabilities::{Capabilities, Fallbacks, Filtering};
pub use filter::FilterErrors;
pub(crate) use stopwatch::Stopwatch;

use crate::error::GpuError;

/// A device and what it can do. Cheap to clone; the clones are one device.
#[derive(Clone, Debug)]
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: AdapterSummary,
    capabilities: Capabilities,
    filter_errors: FilterErrors,
    oversize: Oversize,
    lost: Arc<OnceLock<String>>,
    uncaptured: Arc<Mutex<Option<wgpu::Error>>>,
}

/// What is done with a volume of which not everything visible fits on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Oversize {
    /// Parts of it are kept at coarser levels, and a [`Notice`](crate::Notice) says so.
    #[default]
    Coarsen,
    /// It is refused.
    Refuse,
}

/// How a device is chosen and used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GpuOptions {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Features that are to be treated as missing.
    pub fallbacks: Fallbacks,
    /// What becomes of volumes that do not fit.
    pub oversize: Oversize,
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
        capabilities::check(&summary, &adapter)?;
        let (device, queue) = adapter
            .request_device(&Self::descriptor(&adapter))
            .await
            .map_err(|e| GpuError::NoAdapter { reason: format!("{}: {e}", summary.name) })?;
        Self::sharing(&adapter, device, queue, options)
    }

    /// What a device of this adapter is to be asked for, by whoever opens one to share it.
    pub fn descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        wgpu::DeviceDescriptor {
            label: Some("cutaway"),
            required_features: capabilities::optional_features() & adapter.features(),
            required_limits: capabilities::limits(adapter),
            ..wgpu::DeviceDescriptor::default()
        }
    }

    /// Uses a device that somebody else opened, with [`Self::descriptor`], and goes on to draw with: a window's. Its errors
    /// and its loss are heard here from now on.
    pub fn sharing(
        adapter: &wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
        options: &GpuOptions,
    ) -> Result<Self, GpuError> {
        let summary = AdapterSummary::of(adapter);
        capabilities::check(&summary, adapter)?;
        let lost = Arc::new(OnceLock::new());
        let tell = lost.clone();
        device.set_device_lost_callback(move |_, reason| {
            let reason = if reason.is_empty() { "its device was closed".to_owned() } else { reason };
            // The first reason is the cause; later ones follow from it.
            let _ = tell.set(reason);
        });
        let uncaptured = Arc::new(Mutex::new(None));
        let keep = uncaptured.clone();
        // Without a handler, an error outside every scope would be a panic.
        device.on_uncaptured_error(Arc::new(move |error| {
            keep.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }));
        let capabilities = Capabilities::probe(&device, &options.fallbacks);
        let filter_errors = FilterErrors::default();
        let oversize = options.oversize;
        let mut gpu =
            Self { device, queue, adapter: summary, capabilities, filter_errors, oversize, lost, uncaptured };
        if gpu.capabilities.filtering.is_none() {
            gpu.filter_errors = FilterErrors::probe(&gpu)?;
        }
        Ok(gpu)
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    fn gpu() -> Option<Gpu> {
        Gpu::new(&GpuOptions::default()).map_err(|e| println!("not run: {e}")).ok()
    }

    #[test]
    fn an_error_outside_every_scope_comes_with_the_next_call() {
        let Some(gpu) = gpu() else { return };
        let _ = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 4,
            // Two usages that do not go together.
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let found = gpu.checked("anything", || ());
        assert!(matches!(&found, Err(GpuError::Refused { what, .. }) if what == "anything"), "{found:?}");
        assert_eq!(gpu.checked("anything", || ()), Ok(()));
    }

    #[test]
    fn too_much_is_out_of_memory_and_no_panic() {
        let Some(gpu) = gpu() else { return };
        let side = gpu.device().limits().max_texture_dimension_3d;
        let size = wgpu::Extent3d { width: side, height: side, depth_or_array_layers: side };
        let made = gpu.checked("a large texture", || {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: None,
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: wgpu::TextureFormat::R32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        });
        // 32 GiB at the least; some devices have them.
        assert!(matches!(made, Ok(_) | Err(GpuError::OutOfMemory { .. })), "{made:?}");
        assert_eq!(gpu.checked("anything", || ()), Ok(()));
    }

    #[test]
    fn a_lost_device_is_an_error_from_then_on() {
        let Some(gpu) = gpu() else { return };
        gpu.device().destroy();
        for _ in 0..2 {
            let found = gpu.checked("anything", || {
                gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size: 4,
                    usage: wgpu::BufferUsages::STORAGE,
                    mapped_at_creation: false,
                })
            });
            assert!(matches!(found, Err(GpuError::Lost { .. })), "{found:?}");
            assert!(matches!(gpu.finish(), Err(GpuError::Lost { .. })));
        }
    }
}
