//! Abilities: what an engine can do, as a typed list. Refusals and notices are made of it, in one wording.

use cutaway_core::clip::ClipEvents;
use cutaway_core::scene::{Mode, Scene};

use crate::error::EngineError;
use crate::notice::Notice;
use crate::request::DebugView;
use crate::setting::Setting;

/// Modes in which a setting has an effect.
pub const ALL_MODES: &[Mode] = &Mode::ALL;

/// The mode of most settings that refine sampling.
pub const COMPOSITE: &[Mode] = &[Mode::Composite];

/// The abilities of an engine.
#[derive(Clone, Copy, Debug)]
pub struct Abilities {
    /// The engine's name at the command line and in scene files.
    pub name: &'static str,
    /// Modes that it renders.
    pub modes: &'static [Mode],
    /// Modes in which its images have depth.
    pub depth: &'static [Mode],
    /// True if it renders volumes.
    pub volumes: bool,
    /// True if it renders unstructured grids.
    pub grids: bool,
    /// True if it runs on a graphics device.
    pub on_device: bool,
    /// Views of its work that it offers instead of the image.
    pub debug: &'static [DebugView],
    /// Settings that have an effect, with the modes in which they have it.
    pub settings: &'static [(Setting, &'static [Mode])],
}

impl Abilities {
    /// Checks that the engine renders this kind of data in this mode.
    ///
    /// # Errors
    /// The kind of data, the mode or the debug view that it does not render.
    pub fn check(&self, scene: &Scene, debug: DebugView) -> Result<(), EngineError> {
        let engine = self.name;
        let data = scene.data();
        let takes = if data.grid().is_some() { self.grids } else { self.volumes };
        if !takes {
            return Err(EngineError::Data { engine, kind: data.kind() });
        }
        let mode = scene.settings().mode;
        if !self.modes.contains(&mode) {
            return Err(EngineError::Mode { engine, mode: mode.name() });
        }
        if debug != DebugView::Off && !self.debug.contains(&debug) {
            return Err(EngineError::Debug { engine, view: debug.name() });
        }
        Ok(())
    }

    /// Returns true if a setting has an effect in a mode.
    pub fn has(&self, setting: Setting, mode: Mode) -> bool {
        self.settings.iter().any(|(s, modes)| *s == setting && modes.contains(&mode))
    }

    /// Returns true if images of a mode have depth.
    pub fn has_depth(&self, mode: Mode) -> bool {
        self.depth.contains(&mode)
    }

    /// Returns a notice for each setting of a scene that differs from its default and has no effect.
    pub fn notices(&self, scene: &Scene) -> Vec<Notice> {
        let settings = scene.settings();
        let mode = settings.mode;
        let clipped = scene.clip().is_some();
        let without_effect = |setting: &Setting| {
            let of_clips =
                matches!(setting, Setting::ProcessorEvents | Setting::DeviceEvents | Setting::BufferDepth);
            // The depth of buffers matters to peeling alone, and that is its own setting.
            let unused = of_clips && !clipped
                || *setting == Setting::BufferDepth && settings.clip_events != ClipEvents::Peel;
            !(self.has(*setting, mode) || unused)
        };
        Setting::ALL
            .into_iter()
            .filter(without_effect)
            .filter_map(|setting| {
                let value = setting.chosen(settings)?;
                let elsewhere = self.settings.iter().any(|(s, _)| *s == setting);
                Some(Notice::NoEffect { setting, value, engine: self.name, mode: elsewhere.then_some(mode) })
            })
            .collect()
    }
}
