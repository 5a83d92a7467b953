//! Lists of looks: presets and colour maps, each with a picture of this volume.

use cutaway_core::colormaps;
use cutaway_core::presets::{self, Preset};
use egui::epaint::Mesh;
use egui::{Color32, Rect, ScrollArea, Sense, TextEdit, Ui, pos2, vec2};

use crate::document::Document;
use crate::function;
use crate::render::thumbnails::{Subject, Thumbnails};

/// Side of a thumbnail in the list, in points of the screen.
const SIDE: f32 = 44.0;

/// What is looked for.
#[derive(Debug, Default)]
pub(super) struct Looks {
    search: String,
    reversed: bool,
}

impl Looks {
    pub(super) fn show(&mut self, ui: &mut Ui, document: &mut Document, thumbnails: &mut Thumbnails) {
        ui.collapsing("Presets", |ui| {
            let field = TextEdit::singleline(&mut self.search).hint_text("Search presets");
            ui.add(field).accessible_name("Search presets");
            let words = self.search.to_lowercase();
            let found: Vec<&Preset> = presets::all().iter().filter(|p| matches(p, &words)).collect();
            if found.is_empty() {
                ui.weak("No preset is called or described so.");
            }
            rows(ui, "presets", found.len(), |ui, row| {
                let preset = found[row];
                thumbnail(ui, thumbnails, &Subject::Preset(preset.name.to_owned()));
                let button = ui.button(preset.name);
                if button.on_hover_text(preset.description).clicked() {
                    take_preset(document, preset);
                }
            });
        });
        ui.collapsing("Colour maps", |ui| {
            ui.checkbox(&mut self.reversed, "Reversed");
            let names = colormaps::NAMES;
            rows(ui, "colour maps", names.len(), |ui, row| {
                let name = if self.reversed { format!("{}_r", names[row]) } else { names[row].to_owned() };
                thumbnail(ui, thumbnails, &Subject::Colormap(name.clone()));
                ui.vertical(|ui| {
                    if ui.button(&name).clicked() {
                        take_colormap(document, &name);
                    }
                    gradient(ui, &name);
                });
            });
        });
    }
}

fn matches(preset: &Preset, words: &str) -> bool {
    let text = format!("{} {}", preset.name, preset.description).to_lowercase();
    words.split_whitespace().all(|word| text.contains(word))
}

/// Rows of a list, of which only those in view are drawn: pictures are made of what is looked at.
fn rows(ui: &mut Ui, name: &str, count: usize, mut row: impl FnMut(&mut Ui, usize)) {
    ScrollArea::vertical().id_salt(name).max_height(260.0).auto_shrink([false, true]).show_rows(
        ui,
        SIDE,
        count,
        |ui, range| {
            for index in range {
                ui.horizontal(|ui| {
                    ui.set_height(SIDE);
                    row(ui, index);
                });
            }
        },
    );
}

fn thumbnail(ui: &mut Ui, thumbnails: &mut Thumbnails, subject: &Subject) {
    thumbnails.want(subject, ui.ctx());
    let (rect, _) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, Color32::from_gray(12));
    if let Some(texture) = thumbnails.get(subject) {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture.id(), rect, whole, Color32::WHITE);
    }
}

/// A strip of a map's colours.
fn gradient(ui: &mut Ui, name: &str) {
    let (rect, _) = ui.allocate_exact_size(vec2(120.0, 10.0), Sense::hover());
    let Some(points) = colormaps::by_name(name) else { return };
    let mut mesh = Mesh::default();
    for (position, color) in &points {
        let [r, g, b] = color.map(|c| (c * 255.0).round() as u8);
        let x = rect.left() + *position as f32 * rect.width();
        mesh.colored_vertex(pos2(x, rect.top()), Color32::from_rgb(r, g, b));
        mesh.colored_vertex(pos2(x, rect.bottom()), Color32::from_rgb(r, g, b));
    }
    for pair in 0..points.len().saturating_sub(1) as u32 {
        mesh.add_triangle(2 * pair, 2 * pair + 1, 2 * pair + 2);
        mesh.add_triangle(2 * pair + 1, 2 * pair + 2, 2 * pair + 3);
    }
    ui.painter().add(mesh);
}

/// A preset is a function, its unit distance, a mode, and whether it is lit; one step.
fn take_preset(document: &mut Document, preset: &Preset) {
    let function = preset.transfer_function(document.volume().lattice());
    document.settle();
    document.edit("preset", |s| {
        s.function = function;
        s.unit_distance = preset.unit_distance();
        s.settings.mode = preset.mode;
        s.lighting.shade = preset.shade;
    });
    document.settle();
}

fn take_colormap(document: &mut Document, name: &str) {
    let range = document.volume().lattice().value_range();
    let Some(function) = function::with_colormap(&document.state().function, name, range) else { return };
    document.settle();
    document.edit("colour map", |s| s.function = function);
    document.settle();
}
