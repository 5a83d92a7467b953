//! The crop box in numbers, and what cut surfaces look like.

use cutaway_core::clip::{ClipShading, Impregnation};
use cutaway_core::glam::DVec3;
use egui::{ComboBox, Grid, Slider, Ui};

use super::numbers::Numbers;
use crate::cutting::CropBox;
use crate::cutting::crop::LEAST;
use crate::document::Document;

/// The crop box: on or off, and from where to where.
pub(super) fn crop(ui: &mut Ui, document: &mut Document) {
    let whole = CropBox::whole(document.volume().lattice());
    let now = document.state().cutting.crop;
    ui.horizontal(|ui| {
        let mut on = now.is_some();
        if ui.checkbox(&mut on, "Crop box").changed() {
            document.cut("crop box", |cutting| cutting.crop = on.then_some(whole));
        }
        let reset = ui.add_enabled(now.is_some_and(|crop| crop != whole), egui::Button::new("Reset"));
        if reset.accessible_name("reset crop box").on_hover_text("All of the volume").clicked() {
            document.cut("reset crop box", |cutting| cutting.crop = Some(whole));
        }
    });
    let Some(mut crop) = now else { return };
    let mut changed = false;
    Grid::new("crop box").num_columns(4).show(ui, |ui| {
        for high in [false, true] {
            ui.label(if high { "To voxel" } else { "From voxel" });
            for axis in 0..3 {
                let name = format!("crop {} {}", if high { "to" } else { "from" }, ["x", "y", "z"][axis]);
                changed |= end(ui, &name, &mut crop, whole.max, axis, high);
            }
            ui.end_row();
        }
    });
    if changed {
        document.edit("crop box in numbers", |state| state.cutting.crop = Some(crop));
    }
}

fn end(ui: &mut Ui, name: &str, crop: &mut CropBox, extent: DVec3, axis: usize, high: bool) -> bool {
    let least = LEAST.min(extent[axis]);
    let range = if high {
        (crop.min[axis] + least).min(extent[axis])..=extent[axis]
    } else {
        0.0..=(crop.max[axis] - least).max(0.0)
    };
    let value = if high { &mut crop.max[axis] } else { &mut crop.min[axis] };
    Numbers { range, ..Numbers::any(0.25) }.one(ui, name, value)
}

/// What cut surfaces look like.
pub(super) fn surfaces(ui: &mut Ui, document: &mut Document) {
    let now = document.state().cutting.shading.clone();
    let mut shading = now.clone();
    Grid::new("cut surfaces").num_columns(2).show(ui, |ui| {
        let label = ui.label("Light below cuts");
        let combo = ComboBox::from_id_salt("impregnation").selected_text(name(shading.impregnation));
        let shown = combo.show_ui(ui, |ui| {
            for how in [Impregnation::None, Impregnation::Step, Impregnation::Linear] {
                ui.selectable_value(&mut shading.impregnation, how, name(how));
            }
        });
        shown.response.labelled_by(label.id).on_hover_text("How the light on a cut reaches below it");
        ui.end_row();
        let label = ui.label("Thickness");
        let voxels =
            egui::DragValue::new(&mut shading.thickness).range(0.0..=1e6).speed(0.05).suffix(" voxels");
        ui.add_enabled(shading.impregnation != Impregnation::None, voxels).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("Surface opacity");
        let overlay = ui.add(Slider::new(&mut shading.overlay, 0.0..=1.0)).labelled_by(label.id);
        overlay.on_hover_text("The cut surface itself, drawn over what it cuts");
        ui.end_row();
    });
    ui.checkbox(&mut shading.cap, "Close cut isosurfaces");
    if shading != now && shading.validate().is_ok() {
        document.edit(key(&shading, &now), |state| state.cutting.shading = shading);
    }
}

/// Each control has steps of its own.
fn key(shading: &ClipShading, now: &ClipShading) -> &'static str {
    if shading.overlay != now.overlay {
        "surface opacity"
    } else if shading.thickness != now.thickness {
        "impregnation thickness"
    } else {
        "cut surfaces"
    }
}

fn name(how: Impregnation) -> &'static str {
    match how {
        Impregnation::None => "none",
        Impregnation::Step => "step",
        Impregnation::Linear => "linear",
    }
}
