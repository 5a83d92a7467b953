//! What a ray makes of values, and how samples are lit: mode, isovalues, light, sampling.

mod direction;

use cutaway_core::histogram;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::scene::{Gradient, Mode, RenderSettings, Sampling};
use egui::{ComboBox, DragValue, Slider, Ui};

use super::numbers;
use crate::command::Command;
use crate::document::Document;
use crate::function::FARTHEST;

/// The panel's own state: none but whether something is dragged.
#[derive(Debug, Default)]
pub struct LightPanel {
    sphere: direction::Sphere,
}

/// The most isovalues that the panel adds: more surfaces than can be told apart.
const MOST_ISOVALUES: usize = 16;

impl LightPanel {
    /// Draws the panel and edits the document.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, _commands: &mut Vec<Command>) {
        mode(ui, document);
        if document.state().settings.mode == Mode::Iso {
            isovalues(ui, document);
        }
        ui.separator();
        let lit = matches!(document.state().settings.mode, Mode::Composite | Mode::Iso);
        ui.add_enabled_ui(lit, |ui| self.light(ui, document));
        ui.separator();
        ui.collapsing("Sampling", |ui| sampling(ui, document));
    }

    fn light(&mut self, ui: &mut Ui, document: &mut Document) {
        let mut l = document.state().lighting.clone();
        ui.checkbox(&mut l.shade, "Shade");
        let shade = l.shade;
        ui.add_enabled_ui(shade, |ui| {
            numbers::slider(ui, "Ambient", &mut l.ambient, 0.0..=1.0);
            numbers::slider(ui, "Diffuse", &mut l.diffuse, 0.0..=2.0);
            numbers::slider(ui, "Specular", &mut l.specular, 0.0..=2.0);
            numbers::logarithmic(ui, "Specular power", &mut l.specular_power, 0.0..=200.0);
            curve(ui, &mut l);
            self.direction(ui, document, &mut l);
        });
        if l != document.state().lighting {
            document.edit("light", |s| s.lighting = l);
        }
    }

    /// A headlight, or a direction in the world: dragged on a sphere seen from the camera, or in numbers.
    fn direction(&mut self, ui: &mut Ui, document: &Document, l: &mut Lighting) {
        let axes = document.state().camera.axes();
        let mut headlight = l.light.is_none();
        let hint = "The light is where the eye is; else it stays in the world";
        if ui.checkbox(&mut headlight, "Headlight").on_hover_text(hint).changed() {
            // From above the left shoulder, where readers of maps expect it.
            let towards = direction::in_world(&axes, [-0.4, 0.5]);
            l.light = (!headlight).then_some(towards);
        }
        let Some(light) = &mut l.light else { return };
        ui.horizontal(|ui| {
            if let Some(towards) = self.sphere.show(ui, &axes, *light) {
                *light = towards;
            }
            ui.vertical(|ui| {
                let before = *light;
                let names = ["Light x", "Light y", "Light z"];
                for (name, component) in names.into_iter().zip(&mut *light) {
                    ui.horizontal(|ui| numbers::field(ui, name, component, -1e3..=1e3, 0.01));
                }
                // Zero is no direction.
                if light.iter().all(|c| *c == 0.0) {
                    *light = before;
                }
            });
        });
    }
}

fn mode(ui: &mut Ui, document: &mut Document) {
    let current = document.state().settings.mode;
    let mut mode = current;
    ComboBox::from_label("Mode").selected_text(title(current)).show_ui(ui, |ui| {
        for each in Mode::ALL {
            ui.selectable_value(&mut mode, each, title(each)).on_hover_text(explained(each));
        }
    });
    if mode != current {
        let volume = document.volume().clone();
        document.settle();
        document.edit("mode", |s| {
            s.settings.mode = mode;
            if mode == Mode::Iso && s.settings.iso.is_empty() {
                s.settings.iso.push(first_isovalue(volume.lattice()));
            }
        });
        document.settle();
    }
}

fn title(mode: Mode) -> &'static str {
    match mode {
        Mode::Composite => "Composite",
        Mode::Iso => "Isosurfaces",
        Mode::Mip => "Maximum",
        Mode::Minip => "Minimum",
        Mode::Mean => "Mean",
    }
}

fn explained(mode: Mode) -> &'static str {
    match mode {
        Mode::Composite => "Emission and absorption, front to back",
        Mode::Iso => "Surfaces of constant value",
        Mode::Mip => "The largest value along each ray",
        Mode::Minip => "The smallest value along each ray",
        Mode::Mean => "The mean of the values along each ray",
    }
}

/// Where the object begins, as the default transfer function has it.
fn first_isovalue(volume: &cutaway_core::volume::Volume) -> f64 {
    let function = histogram::default_for_mode(volume, Mode::Composite);
    let [lo, hi] = crate::function::window(&function);
    0.5 * lo + 0.5 * hi
}

fn isovalues(ui: &mut Ui, document: &mut Document) {
    let [lo, hi] = document.volume().lattice().value_range();
    let mut iso = document.state().settings.iso.clone();
    let mut removed = None;
    let several = iso.len() > 1;
    for (index, value) in iso.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            let name = format!("Isovalue {}", index + 1);
            // Values outside the volume's range may be in a scene file: they stay until they are moved.
            let slider = Slider::new(value, lo..=hi).clamping(egui::SliderClamping::Edits).text(&name);
            ui.add(slider.max_decimals(4));
            let remove = ui.add_enabled(several, egui::Button::new("x").small());
            if remove.accessible_name(format!("Remove isovalue {}", index + 1)).clicked() {
                removed = Some(index);
            }
        });
    }
    if iso != document.state().settings.iso {
        document.edit("isovalues", |s| s.settings.iso = iso.clone());
    }
    let room = iso.len() < MOST_ISOVALUES;
    if ui.add_enabled(room, egui::Button::new("Add isovalue")).clicked() {
        let last = iso.last().copied().unwrap_or(lo).clamp(lo, hi);
        // Half-way from the last to the end: another surface, most likely within the object.
        iso.push((0.5 * last + 0.5 * hi).clamp(-FARTHEST, FARTHEST));
        document.settle();
        document.edit("isovalues", |s| s.settings.iso = iso);
        document.settle();
    } else if let Some(index) = removed {
        iso.remove(index);
        document.settle();
        document.edit("isovalues", |s| s.settings.iso = iso);
        document.settle();
    }
    let mut opacity = document.state().settings.iso_opacity;
    if numbers::slider(ui, "Surface opacity", &mut opacity, 0.01..=1.0).changed() {
        document.edit("surface opacity", |s| s.settings.iso_opacity = opacity.clamp(0.01, 1.0));
    }
}

fn curve(ui: &mut Ui, l: &mut Lighting) {
    let names = [
        (DiffuseCurve::TwoSided, "Two-sided", "Both sides of a surface are lit"),
        (DiffuseCurve::Clamped, "Clamped", "Surfaces turned away are dark"),
        (DiffuseCurve::Wrapped, "Wrapped", "Light reaches around"),
    ];
    let current = names.iter().find(|(curve, ..)| *curve == l.diffuse_curve).map_or("", |(_, name, _)| name);
    ComboBox::from_label("Falloff").selected_text(current).show_ui(ui, |ui| {
        for (curve, name, hint) in names {
            ui.selectable_value(&mut l.diffuse_curve, curve, name).on_hover_text(hint);
        }
    });
    if l.diffuse_curve == DiffuseCurve::Wrapped {
        numbers::slider(ui, "Wrap power", &mut l.wrap_power, 0.1..=8.0);
    }
}

fn sampling(ui: &mut Ui, document: &mut Document) {
    let mut s = document.state().settings.clone();
    let hint = "In voxels along the ray. Smaller is more accurate and slower.";
    ui.add(Slider::new(&mut s.step, 0.05..=4.0).text("Step").logarithmic(true).max_decimals(3))
        .on_hover_text(hint);
    let hint = "A step stands for the integral between its ends instead of the value in its middle";
    if ui.checkbox(&mut s.pre_integration, "Pre-integration").on_hover_text(hint).changed() {
        exclude(&mut s);
    }
    gradient(ui, &mut s);
    let hint = "Accumulated opacity at which a ray ends";
    ui.horizontal(|ui| {
        let label = ui.label("Early termination");
        let field = DragValue::new(&mut s.early_termination).range(0.5..=1.0).speed(0.001).max_decimals(4);
        ui.add(field).labelled_by(label.id).on_hover_text(hint);
    });
    let hint = "Rings become noise; GPU engines only";
    ui.checkbox(&mut s.jitter, "Jitter").on_hover_text(hint);
    if s != document.state().settings {
        document.edit("sampling", |state| state.settings = s);
    }
}

/// Pre-integration stands alone: what else decides where samples lie is switched off with it, as a scene demands.
fn exclude(s: &mut RenderSettings) {
    if s.pre_integration {
        s.sampling = Sampling::View;
        s.adaptive_threshold = None;
    }
}

fn gradient(ui: &mut Ui, s: &mut RenderSettings) {
    let names = [
        (Gradient::Central, "Central differences", "Sharpest"),
        (Gradient::Sobel, "Sobel", "Calmer on noisy data, softer on fine detail"),
        (Gradient::Precomputed, "Precomputed", "Directions kept with the volume: four more bytes a voxel"),
    ];
    let current = names.iter().find(|(gradient, ..)| *gradient == s.gradient).map_or("", |(_, name, _)| name);
    ComboBox::from_label("Gradient").selected_text(current).show_ui(ui, |ui| {
        for (gradient, name, hint) in names {
            ui.selectable_value(&mut s.gradient, gradient, name).on_hover_text(hint);
        }
    });
}

#[cfg(test)]
mod tests;
