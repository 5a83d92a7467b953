//! The panels beside the picture. They hold how they are drawn, and no part of the scene.

mod export;

use std::path::Path;

use cutaway_core::clip::ClipSource;
use egui::{Response, Ui};

use crate::command::{Command, Purpose};
use crate::document::Document;
use crate::picture::{Overlays, Projection};
use crate::slices::Slices;
pub use export::ExportPanel;

/// All panels.
#[derive(Default)]
pub struct Panels {
    /// Slices beside the picture, and what points at them.
    pub slices: Slices,
    /// What pictures and films are to be.
    pub export: ExportPanel,
}

impl Panels {
    /// Another document is open; `viewer` is what its scene file kept for a viewer.
    pub fn opened(&mut self, _viewer: Option<&serde_json::Value>) {
        self.slices.opened();
    }

    /// Draws the panels.
    pub fn show(&mut self, ui: &mut Ui, _document: &mut Document, commands: &mut Vec<Command>) {
        egui::ScrollArea::vertical().show(ui, |ui| {
            ui.collapsing("Transfer function", |_ui| {});
            ui.collapsing("Light", |_ui| {});
            ui.collapsing("Cutting", |_ui| {});
            ui.collapsing("Pictures and films", |ui| self.export.show(ui, commands));
        });
    }

    /// Draws what lies in the picture and is moved there; whether it has the pointer, so that the camera must not move.
    pub fn in_picture(
        &mut self,
        _ui: &mut Ui,
        _response: &Response,
        _projection: &Projection,
        _document: &mut Document,
        _commands: &mut Vec<Command>,
    ) -> bool {
        false
    }

    /// Adds an operand that cuts with a surface.
    pub fn add_solid(&mut self, _document: &mut Document, _source: ClipSource) {}

    /// Reads or writes the transfer function.
    ///
    /// # Errors
    /// One line: the file, and what is wrong.
    pub fn use_function_file(
        &mut self,
        _document: &mut Document,
        _purpose: Purpose,
        _path: &Path,
    ) -> Result<(), String> {
        Ok(())
    }

    /// What a scene file keeps for a viewer.
    pub fn notes(&self, _document: &Document, overlays: Overlays) -> serde_json::Value {
        serde_json::json!({ "overlays": overlays })
    }

    /// Shows three slices beside the picture, or no longer.
    pub fn toggle_slices(&mut self) {
        self.slices.visible ^= true;
    }
}
