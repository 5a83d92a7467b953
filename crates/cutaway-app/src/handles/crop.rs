//! The crop box in the picture.

use cutaway_core::glam::DVec2;
use egui::{Color32, Response, Stroke, Ui};

use super::{COLORS, Dragging, Grip, HIGHLIGHT, Seen, announce, stroke_over};
use crate::cutting::CropBox;
use crate::cutting::crop::{CropFrame, CropHandle};
use crate::document::Document;
use crate::picture::Projection;

/// The undo step of a drag.
const STEP: &str = "drag crop box";

/// Draws the crop box, while there is one, with handles on its faces and corners. Escape takes a drag back.
#[derive(Clone, Debug, Default)]
pub struct CropHandles {
    dragging: Dragging<CropDrag>,
    hovered: Option<CropHandle>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct CropDrag {
    handle: CropHandle,
    before: CropBox,
    start: DVec2,
}

impl CropHandles {
    /// Paints them and lets them be dragged; whether they have the pointer.
    /// Where something else has it already, nothing here `listens`.
    pub(super) fn show(
        &mut self,
        listens: bool,
        ui: &mut Ui,
        response: &Response,
        projection: &Projection,
        document: &mut Document,
    ) -> bool {
        let seen = Seen::new(projection);
        let held = self.dragging.has_pointer();
        let grip = Grip::new(ui, response, &seen, held, listens);
        let frame = CropFrame::new(document.volume().lattice());
        match (grip, self.dragging, document.state().cutting.crop) {
            (Grip::Released(_), ..) => {
                self.dragging = Dragging::No;
                document.settle();
            }
            (Grip::Cancelled, ..) => {
                document.cancel(STEP);
                self.dragging = Dragging::Over;
            }
            (Grip::Held(at), Dragging::Yes(drag), Some(_)) => {
                if let Some(crop) = frame.drag(&drag.before, drag.handle, &seen.lens, [drag.start, at]) {
                    document.edit(STEP, |state| state.cutting.crop = Some(crop));
                }
            }
            (Grip::Held(_), ..) => {}
            (Grip::Hover(at), _, crop) => {
                self.hovered = at.zip(crop).and_then(|(at, crop)| frame.pick(&crop, &seen.lens, at));
            }
            (Grip::Pressed(at), _, crop) => {
                self.hovered = crop.and_then(|crop| frame.pick(&crop, &seen.lens, at));
                if let (Some(handle), Some(before)) = (self.hovered, crop) {
                    self.dragging = Dragging::Yes(CropDrag { handle, before, start: at });
                    document.settle();
                }
            }
        }
        if let Some(crop) = document.state().cutting.crop {
            self.paint(ui, response, &seen, &frame, &crop);
        }
        held || self.dragging.has_pointer()
    }

    pub(super) fn has_pointer(&self) -> bool {
        self.dragging.has_pointer()
    }

    fn paint(&self, ui: &Ui, response: &Response, seen: &Seen, frame: &CropFrame, crop: &CropBox) {
        let painter = ui.painter().with_clip_rect(response.rect);
        let corner = |bits: u8| seen.place(frame.in_world(crop, CropHandle::Corner(bits)));
        for bits in 0..8u8 {
            for other in [1u8, 2, 4].map(|axis| bits | axis).into_iter().filter(|other| *other != bits) {
                if let (Some(a), Some(b)) = (corner(bits), corner(other)) {
                    stroke_over(&painter, vec![a, b], 1.0, COLORS[3].gamma_multiply(0.8));
                }
            }
        }
        for handle in CropHandle::all().filter(|h| frame.is_usable(crop, &seen.lens, *h)) {
            let Some(at) = seen.place(frame.in_world(crop, handle)) else { continue };
            let (radius, color) = match handle {
                CropHandle::Corner(_) => (3.5, COLORS[3]),
                CropHandle::Face { axis, .. } => (5.5, COLORS[axis]),
            };
            let color = if self.hovered == Some(handle) { HIGHLIGHT } else { color };
            painter.circle(at, radius, color, Stroke::new(1.5, Color32::from_black_alpha(160)));
            if response.rect.contains(at) {
                announce(ui, response, at, &handle.name());
            }
        }
        if self.hovered.is_some() {
            ui.ctx().set_cursor_icon(if self.dragging.has_pointer() {
                egui::CursorIcon::Grabbing
            } else {
                egui::CursorIcon::Grab
            });
        }
    }
}
