//! Pictures and films: how large, how many frames.

use cutaway_core::scene::RenderSettings;
use egui::{DragValue, Ui};

use crate::command::{Command, Purpose};
use crate::document::Document;
use crate::render::{DebugView, Request};

/// What pictures and films are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportPanel {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Frames of a film in which the camera turns once about the volume.
    pub frames: u32,
}

impl Default for ExportPanel {
    fn default() -> Self {
        Self { size: [1024, 1024], frames: 72 }
    }
}

/// The largest side of a picture that is offered.
const LARGEST: u32 = 16_384;

impl ExportPanel {
    /// Draws the panel.
    pub fn show(&mut self, ui: &mut Ui, commands: &mut Vec<Command>) {
        egui::Grid::new("export").num_columns(2).show(ui, |ui| {
            for (name, side) in ["Width", "Height"].into_iter().zip(&mut self.size) {
                let label = ui.label(name);
                ui.add(DragValue::new(side).range(1..=LARGEST).suffix(" px")).labelled_by(label.id);
                ui.end_row();
            }
            let label = ui.label("Frames of a turn");
            ui.add(DragValue::new(&mut self.frames).range(2..=3600)).labelled_by(label.id);
            ui.end_row();
        });
        ui.horizontal(|ui| {
            if ui.button("Save a picture...").clicked() {
                commands.push(Command::PickFile(Purpose::SaveImage));
            }
            if ui.button("Save a film...").clicked() {
                commands.push(Command::PickFile(Purpose::SaveFilm));
            }
        });
    }

    /// What is open, as a picture of this size: at full quality, whatever the window shows.
    pub fn request(&self, document: &Document, debug: DebugView) -> Request {
        let mut state = document.state().clone();
        state.settings = RenderSettings { resolution: self.size, ..state.settings };
        Request { volume: document.volume().clone(), state, clip: document.clip(), size: self.size, debug }
    }
}
