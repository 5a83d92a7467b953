//! The panels beside the picture. They hold how they are drawn, and no part of the scene.

pub mod cutting;
mod export;
mod function;
mod light;
mod numbers;

use cutaway_io::scene_file::ClipSource;

use egui::containers::scroll_area::ScrollSource;
use egui::{CollapsingHeader, Response, Ui};

use crate::command::Command;
use crate::document::{Document, ViewerNotes};
use crate::handles::Handles;
use crate::picture::{Overlays, Projection};
use crate::slices::Slices;
pub use cutting::CuttingPanel;
pub use export::ExportPanel;
pub use function::FunctionPanel;
pub use light::LightPanel;

/// All panels.
#[derive(Default)]
pub struct Panels {
    /// Slices beside the picture, and what points at them.
    pub slices: Slices,
    /// The editor of the transfer function.
    pub function: FunctionPanel,
    /// Mode, light, sampling.
    pub light: LightPanel,
    /// What cuts.
    pub cutting: CuttingPanel,
    /// What is dragged in the picture.
    pub handles: Handles,
    /// What pictures and films are to be.
    pub export: ExportPanel,
}

impl Panels {
    /// Another document is open; `notes` is what its scene file kept for a viewer.
    pub fn opened(&mut self, notes: Option<&ViewerNotes>) {
        self.slices.opened(notes.map(|notes| &notes.slices));
    }

    /// Draws the panels.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, commands: &mut Vec<Command>) {
        // Over the plot the wheel zooms.
        let wheel = !self.function.takes_wheel();
        let source = ScrollSource { mouse_wheel: wheel, ..ScrollSource::default() };
        egui::ScrollArea::vertical().auto_shrink(false).scroll_source(source).show(ui, |ui| {
            let function = CollapsingHeader::new("Transfer function").default_open(true);
            if function.show(ui, |ui| self.function.show(ui, document, commands)).fully_closed() {
                self.function.hidden();
            }
            ui.collapsing("Light", |ui| self.light.show(ui, document, commands));
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
        self.handles.show(ui, response, projection, document) || self.function.in_picture(response, document)
    }

    /// Adds an operand that cuts with a surface.
    pub fn add_solid(&mut self, document: &mut Document, source: ClipSource) {
        document.add_solid(source);
    }

    /// What a scene file keeps for a viewer.
    pub fn notes(&self, overlays: Overlays) -> ViewerNotes {
        ViewerNotes { overlays, slices: self.slices.notes() }
    }

    /// Shows three slices beside the picture, or no longer.
    pub fn toggle_slices(&mut self) {
        self.slices.visible ^= true;
    }
}
