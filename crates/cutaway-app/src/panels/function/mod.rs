//! The editor of the transfer function: a plot over the histogram, numbers, and lists of looks.

mod list;
mod plot;

use std::sync::{Arc, Weak};

use cutaway_core::scene::default_unit_distance;
use egui::{PointerButton, Response, Ui};

use super::numbers;
use crate::command::{Command, Purpose};
use crate::document::{Document, OpenVolume};
use crate::function::{self, FARTHEST, Opacities};
use crate::render::thumbnails::Thumbnails;

/// The panel's own state: what is selected and how the plot is zoomed.
#[derive(Debug, Default)]
pub struct FunctionPanel {
    plot: plot::PlotView,
    list: list::Looks,
    thumbnails: Thumbnails,
    /// The volume that all of it is for.
    volume: Weak<OpenVolume>,
}

impl FunctionPanel {
    /// Draws the panel and edits the document.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, commands: &mut Vec<Command>) {
        self.see(ui, document);
        ui.horizontal_wrapped(|ui| self.buttons(ui, document, commands));
        self.plot.show(ui, document);
        self.point(ui, document);
        ui.separator();
        whole(ui, document);
        ui.separator();
        self.list.show(ui, document, &mut self.thumbnails);
    }

    /// Window and level by dragging with the right button in the picture; whether that has the pointer.
    pub fn in_picture(&self, response: &Response, document: &mut Document) -> bool {
        if !response.dragged_by(PointerButton::Secondary) {
            return false;
        }
        let delta = response.drag_delta() / response.rect.height().max(1.0);
        let range = document.volume().lattice().value_range();
        document.edit("function: window", |s| {
            let by = [f64::from(delta.x), f64::from(delta.y)];
            s.function = function::dragged_window(&s.function, by, range);
        });
        true
    }

    /// Whether the pointer is over the plot, where the wheel zooms: the panel must not be scrolled by it.
    pub fn takes_wheel(&self) -> bool {
        self.plot.is_hovered()
    }

    /// Says that the panel is not shown: nothing is under the pointer.
    pub fn hidden(&mut self) {
        self.plot.hidden();
    }

    /// Forgets what belongs to another volume.
    fn see(&mut self, ui: &Ui, document: &Document) {
        let volume = document.volume();
        if !std::ptr::eq(self.volume.as_ptr(), Arc::as_ptr(volume)) {
            self.volume = Arc::downgrade(volume);
            self.plot = plot::PlotView::default();
        }
        self.thumbnails.see(volume, ui.ctx());
    }

    fn buttons(&mut self, ui: &mut Ui, document: &Document, commands: &mut Vec<Command>) {
        let hint = "A transfer function of cutaway, ParaView (.json) or Slicer (.vp, .vp.json)";
        if ui.button("Open function...").on_hover_text(hint).clicked() {
            commands.push(Command::PickFile(Purpose::OpenFunction));
        }
        if ui.button("Save function...").on_hover_text(hint).clicked() {
            commands.push(Command::PickFile(Purpose::SaveFunction));
        }
        if ui.button("Fit").on_hover_text("Show all values (scroll over the plot to zoom)").clicked() {
            self.plot.fit(document);
        }
        let mut root = self.plot.opacities == Opacities::Root;
        let hint = "Opacities by their square root: room for small ones";
        if ui.checkbox(&mut root, "Root axis").on_hover_text(hint).changed() {
            self.plot.opacities = if root { Opacities::Root } else { Opacities::Linear };
        }
    }

    /// The numbers of the selected point.
    fn point(&mut self, ui: &mut Ui, document: &mut Document) {
        let function = &document.state().function;
        let selected = self.plot.selected.filter(|i| *i < function.points().len());
        let Some(index) = selected else {
            ui.weak("Click a point to select it, double-click to add one, right-click to remove one.");
            return;
        };
        let point = function.points()[index];
        let (mut value, mut opacity) = (point.value, point.opacity);
        let [lo, hi] = document.volume().lattice().value_range();
        ui.horizontal_wrapped(|ui| {
            let moved = numbers::field(ui, "Value", &mut value, -FARTHEST..=FARTHEST, (hi - lo) / 500.0)
                .changed()
                | numbers::field(ui, "Opacity", &mut opacity, 0.0..=1.0, 0.002).changed();
            if moved {
                document.edit("function: point", |s| {
                    s.function = function::moved(&s.function, index, value, opacity);
                });
            }
            let byte = |c: f64| (c * 255.0).round() as u8;
            let before = point.color.map(byte);
            let mut color = before;
            ui.color_edit_button_srgb(&mut color).accessible_name("Colour of the point");
            if color != before {
                let color = color.map(|c| f64::from(c) / 255.0);
                document
                    .edit("function: colour", |s| s.function = function::colored(&s.function, index, color));
            }
            let removable = document.state().function.points().len() > 1;
            if ui.add_enabled(removable, egui::Button::new("Remove point")).clicked() {
                self.plot.remove(document, index);
            }
        });
    }
}

/// What moves the whole function: window and level, brightness, the unit distance.
fn whole(ui: &mut Ui, document: &mut Document) {
    let [lo, hi] = function::window(&document.state().function);
    let (mut width, mut level) = (hi - lo, 0.5 * lo + 0.5 * hi);
    let [least, most] = document.volume().lattice().value_range();
    let speed = (most - least) / 500.0;
    ui.horizontal_wrapped(|ui| {
        let width_changed = numbers::field(ui, "Window", &mut width, 0.0..=FARTHEST, speed).changed();
        let level_changed = numbers::field(ui, "Level", &mut level, -FARTHEST..=FARTHEST, speed).changed();
        if width_changed || level_changed {
            // A level that is typed leaves the width to the last digit, and the other way round.
            document.edit("function: window", |s| {
                s.function = if width_changed {
                    function::windowed(&s.function, width, level)
                } else {
                    function::shifted(&s.function, level - (0.5 * lo + 0.5 * hi))
                };
            });
        }
    });
    let mut brightness = document.state().settings.brightness;
    let hint = "Factor of every opacity";
    if numbers::logarithmic(ui, "Brightness", &mut brightness, 0.0..=100.0).on_hover_text(hint).changed() {
        document.edit("brightness", |s| s.settings.brightness = brightness.max(0.0));
    }
    unit_distance(ui, document);
}

fn unit_distance(ui: &mut Ui, document: &mut Document) {
    let of_volume = default_unit_distance(document.volume().lattice());
    let stated = document.state().unit_distance;
    ui.horizontal_wrapped(|ui| {
        let mut own = stated.is_some();
        let hint = format!("The length that opacities are for; else the mean voxel spacing, {of_volume:.4}");
        if ui.checkbox(&mut own, "Unit distance").on_hover_text(hint).changed() {
            document.edit("unit distance", |s| s.unit_distance = own.then_some(of_volume));
        }
        let mut unit = stated.unwrap_or(of_volume);
        ui.add_enabled_ui(own, |ui| {
            let field = egui::DragValue::new(&mut unit).range(1e-6..=1e6).speed(of_volume / 50.0);
            if ui.add(field.max_decimals(6)).accessible_name("Length that opacities are for").changed() {
                document.edit("unit distance", |s| s.unit_distance = Some(unit));
            }
        });
    });
}

#[cfg(test)]
mod tests;
