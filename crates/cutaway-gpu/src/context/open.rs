//! How a device is opened.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::adapter::{self, AdapterSummary};
use super::capabilities::{self, Capabilities};
use super::filter;
use super::filter_errors::FilterErrors;
use super::gpu::Gpu;
use super::options::GpuOptions;
use crate::error::GpuError;

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
            gpu.filter_errors = filter::probe(&gpu)?;
        }
        Ok(gpu)
    }
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
