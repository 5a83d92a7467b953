//! The desktop window.

use std::sync::Arc;

use cutaway_gpu::Gpu;
use cutaway_gpu::context::AdapterSummary;
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use egui::{ViewportBuilder, vec2};

use crate::app::{App, Start};

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WindowError {
    /// There is no display, as over a plain ssh connection.
    #[error(
        "there is no display to open a window on (neither WAYLAND_DISPLAY nor DISPLAY is set); `cutaway render` needs none"
    )]
    NoDisplay,
    /// The system would not open it.
    #[error("the window cannot be opened: {reason}; `cutaway render` needs none")]
    Refused {
        /// What the system said.
        reason: String,
    },
}

/// Opens the window, and returns when it is closed.
///
/// # Errors
/// Why it cannot be opened.
pub fn run(start: Start) -> Result<(), WindowError> {
    if !has_display() {
        return Err(WindowError::NoDisplay);
    }
    let gpu = start.gpu.clone();
    let setup = WgpuSetupCreateNew {
        native_adapter_selector: Some(Arc::new(move |adapters, surface| {
            choose(adapters, surface, gpu.as_deref())
        })),
        device_descriptor: Arc::new(device_descriptor),
        ..WgpuSetupCreateNew::without_display_handle()
    };
    let wgpu_options =
        WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(setup), ..WgpuConfiguration::default() };
    let options = eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_title("cutaway")
            .with_app_id("cutaway")
            .with_inner_size(vec2(1280.0, 800.0))
            .with_min_inner_size(vec2(640.0, 400.0)),
        wgpu_options,
        ..eframe::NativeOptions::default()
    };
    let create = move |context: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        let app = App::new(&context.egui_ctx, &start).remembering(context.storage);
        Ok(Box::new(app.drawn_in(context.wgpu_render_state.as_ref(), start.gpu.is_some())))
    };
    eframe::run_native("cutaway", options, Box::new(create))
        .map_err(|error| WindowError::Refused { reason: error.to_string() })
}

/// The adapter of this name, or the best one that the window can be shown with.
fn choose(
    adapters: &[wgpu::Adapter],
    surface: Option<&wgpu::Surface<'_>>,
    name: Option<&str>,
) -> Result<wgpu::Adapter, String> {
    let shows =
        |adapter: &&wgpu::Adapter| surface.is_none_or(|surface| adapter.is_surface_supported(surface));
    let named = |adapter: &&wgpu::Adapter| {
        name.is_none_or(|name| adapter.get_info().name.to_lowercase().contains(&name.to_lowercase()))
    };
    // OpenGL last: the engines do without it.
    let rank = |adapter: &&wgpu::Adapter| {
        (adapter.get_info().backend == wgpu::Backend::Gl, AdapterSummary::of(adapter).rank())
    };
    let chosen = adapters.iter().filter(shows).filter(named).min_by_key(rank).cloned();
    chosen.ok_or_else(|| {
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        match name {
            Some(name) => format!("no GPU that can show a window is called `{name}`; there are: {found}"),
            None => format!("no GPU can show a window; there are: {found} (software: mesa-vulkan-drivers)"),
        }
    })
}

/// A device that the engines can share, where the adapter is good enough for them, else one for the window alone.
fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    if adapter.get_info().backend == wgpu::Backend::Gl {
        return wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: adapter.limits().max_texture_dimension_2d,
                ..wgpu::Limits::downlevel_webgl2_defaults()
            },
            ..wgpu::DeviceDescriptor::default()
        };
    }
    Gpu::descriptor(adapter)
}

/// Whether there is anything to open a window on: systems other than Linux and the like always have something.
fn has_display() -> bool {
    let elsewhere = cfg!(any(target_os = "macos", target_os = "windows"));
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    elsewhere || set("WAYLAND_DISPLAY") || set("WAYLAND_SOCKET") || set("DISPLAY")
}
