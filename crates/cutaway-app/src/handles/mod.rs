//! What is dragged in the picture: the gizmo of the selected operand, the crop box, a rectangle that trims it.
//!
//! Here is only what draws and listens; where things are and what a drag does is [`crate::cutting`]'s. Each `show` is called
//! once a frame with the response of the picture, paints over it, and says whether it has the pointer: then nothing else
//! may follow it.

mod crop;
mod gizmo;
mod rectangle;
#[cfg(test)]
mod tests;

use cutaway_core::camera::ViewAxes;
use cutaway_core::glam::{DVec2, DVec3};
use egui::{Color32, Pos2, Response, Role, Stroke, Ui, WidgetInfo};

pub use crop::CropHandles;
pub use gizmo::Gizmo;
pub use rectangle::RectangleClip;

use crate::cutting::lens::Lens;
use crate::document::Document;
use crate::picture::Projection;

/// All handles of the picture; of those that lie over each other only one is dragged.
#[derive(Clone, Debug, Default)]
pub struct Handles {
    /// A rectangle that trims the crop box.
    pub rectangle: RectangleClip,
    /// The crop box.
    pub crop: CropHandles,
    /// The selected operand's.
    pub gizmo: Gizmo,
}

impl Handles {
    /// Switches, in a row of tools.
    pub fn controls(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label("Handles along");
            self.gizmo.controls(ui);
            ui.separator();
            self.rectangle.controls(ui);
        });
    }

    /// Paints them and lets them be dragged; whether one of them has the pointer, so that the camera must not move.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        response: &Response,
        projection: &Projection,
        document: &mut Document,
    ) -> bool {
        // Whichever has the pointer keeps it; else the gizmo, which is asked for by a selection, comes before the box.
        let mut taken = self.rectangle.show(true, ui, response, projection, document);
        let free = !taken && !self.crop.has_pointer();
        taken |= self.gizmo.show(free, ui, response, projection, document);
        taken |= self.crop.show(!taken, ui, response, projection, document);
        taken
    }
}

/// Colours of the axes x, y and z, and of what belongs to none.
const COLORS: [Color32; 4] = [
    Color32::from_rgb(0xe5, 0x48, 0x4d),
    Color32::from_rgb(0x46, 0xa7, 0x58),
    Color32::from_rgb(0x4a, 0x90, 0xf0),
    Color32::from_rgb(0xe0, 0xe0, 0xe0),
];

/// What is under the pointer, or follows it.
const HIGHLIGHT: Color32 = Color32::from_rgb(0xff, 0xd6, 0x0a);

/// Behind lines, so that they are seen on any picture.
const SHADOW: Color32 = Color32::from_black_alpha(140);

/// The picture: where the world is on the screen.
#[derive(Clone, Copy, Debug)]
struct Seen {
    lens: Lens,
    origin: Pos2,
}

impl Seen {
    fn new(projection: &Projection) -> Self {
        let rect = projection.rect();
        let size = DVec2::new(f64::from(rect.width()), f64::from(rect.height()));
        let eye = projection.ray(rect.center()).origin;
        let [right, up, forward] = projection.axes();
        let scale = projection.pixel_size_at(eye + forward);
        let axes = ViewAxes { right, up, forward };
        Self { lens: Lens::of_view(eye, axes, size, scale, projection.is_orthographic()), origin: rect.min }
    }

    /// A point of the screen in the picture.
    fn point(&self, screen: Pos2) -> DVec2 {
        let from = screen - self.origin;
        DVec2::new(f64::from(from.x), f64::from(from.y))
    }

    /// A point of the picture on the screen.
    fn screen(&self, point: DVec2) -> Pos2 {
        // Beyond the largest screen lines lose nothing.
        let point = point.clamp(DVec2::splat(-1e6), DVec2::splat(1e6));
        self.origin + egui::vec2(point.x as f32, point.y as f32)
    }

    /// A point of the world on the screen; none behind the eye.
    fn place(&self, world: DVec3) -> Option<Pos2> {
        self.lens.point(world).map(|point| self.screen(point))
    }

    /// A line through points of the world, where all of them are in front of the eye.
    fn line(&self, world: &[DVec3]) -> Option<Vec<Pos2>> {
        world.iter().map(|p| self.place(*p)).collect()
    }
}

/// What the pointer does with a handle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Grip {
    /// It is over the picture, or away.
    Hover(Option<DVec2>),
    /// It was pressed on the picture.
    Pressed(DVec2),
    /// It is still pressed.
    Held(DVec2),
    /// It was released, or is gone.
    Released(Option<DVec2>),
    /// Escape was pressed while it was held.
    Cancelled,
}

impl Grip {
    /// `holding`: whether it was pressed on a handle before; `listens`: whether it may be, nothing else having it.
    fn new(ui: &Ui, response: &Response, seen: &Seen, holding: bool, listens: bool) -> Self {
        let (pressed, down, at) = ui.input(|input| {
            let pointer = &input.pointer;
            (pointer.primary_pressed(), pointer.primary_down(), pointer.interact_pos())
        });
        let at = at.map(|at| seen.point(at));
        if holding {
            if ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, egui::Key::Escape)) {
                return Self::Cancelled;
            }
            return match at.filter(|_| down) {
                Some(at) => Self::Held(at),
                None => Self::Released(at),
            };
        }
        match at.filter(|_| pressed && listens && response.contains_pointer()) {
            Some(at) => Self::Pressed(at),
            None if !listens => Self::Hover(None),
            None => Self::Hover(response.hover_pos().map(|at| seen.point(at))),
        }
    }
}

/// A drag of something, once it was grabbed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Dragging<T> {
    #[default]
    No,
    /// It follows the pointer.
    Yes(T),
    /// It was cancelled, but the pointer is still pressed, and nobody else's.
    Over,
}

impl<T> Dragging<T> {
    fn has_pointer(&self) -> bool {
        !matches!(self, Self::No)
    }
}

/// Tells assistive technology (and tests) that there is a handle here. It listens to nothing: the picture does.
fn announce(ui: &Ui, response: &Response, at: Pos2, name: &str) {
    let rect = egui::Rect::from_center_size(at, egui::Vec2::splat(12.0));
    let handle = ui.interact(rect, response.id.with(name), egui::Sense::hover());
    handle.widget_info(|| WidgetInfo::labeled(Role::GraphicsObject, true, name));
}

/// A line that is seen on any picture.
fn stroke_over(painter: &egui::Painter, line: Vec<Pos2>, width: f32, color: Color32) {
    let under = SHADOW.gamma_multiply(f32::from(color.a()) / 255.0);
    painter.line(line.clone(), Stroke::new(width + 2.0, under));
    painter.line(line, Stroke::new(width, color));
}
