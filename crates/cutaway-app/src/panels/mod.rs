//! The panels beside the picture. They hold how they are drawn, and no part of the scene.

pub mod cutting;
mod export;

use std::path::Path;

use cutaway_core::clip::ClipSource;
use egui::{Response, Ui};

use crate::command::{Command, Purpose};
use crate::document::Document;
use crate::handles::Handles;
use crate::picture::{Overlays, Projection};
use crate::slices::Slices;
pub use cutting::CuttingPanel;
pub use export::ExportPanel;

/// All panels.
#[derive(Default)]
pub struct Panels {
    /// Slices beside the picture, and what points at them.
    pub slices: Slices,
    /// What cuts.
    pub cutting: CuttingPanel,
    /// What is dragged in the picture.
    pub handles: Handles,
    /// What pictures and films are to be.
    pub export: ExportPanel,
}

impl Panels {
    /// Another document is open; `viewer` is what its scene file kept for a viewer.
    pub fn opened(&mut self, _viewer: Option<&serde_json::Value>) {
        self.slices.opened();
    }

    /// Draws the panels.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, commands: &mut Vec<Command>) {
        egui::ScrollArea::vertical().show(ui, |ui| {
            ui.collapsing("Transfer function", |_ui| {});
            ui.collapsing("Light", |_ui| {});
            ui.collapsing("Cutting", |ui| {
                self.cutting.show(ui, document, commands);
                ui.separator();
                self.handles.controls(ui);
            });
            ui.collapsing("Pictures and films", |ui| self.export.show(ui, commands));
        });
    }

    /// Draws what lies in the picture and is moved there; whether it has the pointer, so that the camera must not move.
    pub fn in_picture(
        &mut self,
        ui: &mut Ui,
        response: &Response,
        projection: &Projection,
        document: &mut Document,
        _commands: &mut Vec<Command>,
    ) -> bool {
        self.handles.show(ui, response, projection, document)
    }

    /// Adds an operand that cuts with a surface.
    pub fn add_solid(&mut self, document: &mut Document, source: ClipSource) {
        document.add_solid(source);
    }

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
