//! The desktop window.

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
    let setup = WgpuSetupCreateNew {
        power_preference: wgpu::PowerPreference::HighPerformance,
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
        Ok(Box::new(App::new(&context.egui_ctx, &start).remembering(context.storage)))
    };
    eframe::run_native("cutaway", options, Box::new(create))
        .map_err(|error| WindowError::Refused { reason: error.to_string() })
}

/// Whether there is anything to open a window on: systems other than Linux and the like always have something.
fn has_display() -> bool {
    let elsewhere = cfg!(any(target_os = "macos", target_os = "windows"));
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    elsewhere || set("WAYLAND_DISPLAY") || set("WAYLAND_SOCKET") || set("DISPLAY")
}
