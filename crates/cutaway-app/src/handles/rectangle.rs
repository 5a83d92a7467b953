//! A rectangle that is drawn over the picture and trims the crop box.

use cutaway_core::glam::DVec2;
use egui::{Rect, Response, Stroke, StrokeKind, Ui};

use super::{Dragging, Grip, HIGHLIGHT, SHADOW, Seen};
use crate::cutting::CropBox;
use crate::cutting::crop::CropFrame;
use crate::document::Document;
use crate::picture::Projection;

/// The undo step of a rectangle.
const STEP: &str = "rectangle clip";

/// A drag of less than this, in points, is a click, and trims nothing.
const LEAST: f64 = 4.0;

/// Trims the crop box (of nothing cropped: all of the volume) by a rectangle, while it is on; the rule is that of
/// [`CropFrame::trim`]. One rectangle, and it is off again; Escape leaves it without.
#[derive(Clone, Debug, Default)]
pub struct RectangleClip {
    /// Whether the next drag in the picture is a rectangle.
    pub on: bool,
    dragging: Dragging<DVec2>,
}

impl RectangleClip {
    /// The switch, for a row of tools.
    pub fn controls(&mut self, ui: &mut Ui) {
        let button = ui.toggle_value(&mut self.on, "Rectangle").accessible_name("rectangle clip");
        button.on_hover_text("Drag a rectangle in the picture: what is beside it is cropped");
    }

    /// Paints the rectangle and, once it is drawn, trims; whether it has the pointer.
    /// Where something else has it already, nothing here `listens`.
    pub(super) fn show(
        &mut self,
        listens: bool,
        ui: &mut Ui,
        response: &Response,
        projection: &Projection,
        document: &mut Document,
    ) -> bool {
        if !self.on && !self.dragging.has_pointer() {
            return false;
        }
        let seen = Seen::new(projection);
        let held = self.dragging.has_pointer();
        match (Grip::new(ui, response, &seen, held, listens), self.dragging) {
            (Grip::Hover(_), _) => {
                if ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, egui::Key::Escape)) {
                    self.on = false;
                }
            }
            (Grip::Pressed(at), _) => self.dragging = Dragging::Yes(at),
            (Grip::Held(at), Dragging::Yes(start)) => paint(ui, response, &seen, [start, at]),
            (Grip::Held(_), _) => {}
            (Grip::Cancelled, _) => {
                (self.on, self.dragging) = (false, Dragging::Over);
            }
            (Grip::Released(at), dragging) => {
                if let (Dragging::Yes(start), Some(at)) = (dragging, at) {
                    self.trim(document, &seen, [start, at]);
                }
                self.dragging = Dragging::No;
            }
        }
        if self.on && response.hovered() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
        }
        held || self.on || self.dragging.has_pointer()
    }

    fn trim(&mut self, document: &mut Document, seen: &Seen, rectangle: [DVec2; 2]) {
        let [a, b] = rectangle;
        if (b - a).abs().min_element() < LEAST {
            return;
        }
        self.on = false;
        let volume = document.volume().lattice();
        let crop = document.state().cutting.crop.unwrap_or_else(|| CropBox::whole(volume));
        if let Some(trimmed) = CropFrame::new(volume).trim(&crop, &seen.lens, rectangle) {
            document.settle();
            document.edit(STEP, |state| state.cutting.crop = Some(trimmed));
            document.settle();
        }
    }
}

fn paint(ui: &Ui, response: &Response, seen: &Seen, [a, b]: [DVec2; 2]) {
    let painter = ui.painter().with_clip_rect(response.rect);
    let rect = Rect::from_two_pos(seen.screen(a), seen.screen(b));
    painter.rect_stroke(rect, 0.0, Stroke::new(3.0, SHADOW), StrokeKind::Middle);
    painter.rect(rect, 0.0, HIGHLIGHT.gamma_multiply(0.12), Stroke::new(1.0, HIGHLIGHT), StrokeKind::Middle);
}
