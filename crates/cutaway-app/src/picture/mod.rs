//! The picture: what was rendered, what lies over it, and how the pointer moves the camera.

mod canvas;
pub mod navigation;
mod overlays;
mod projection;

use cutaway_core::camera::Camera;
use eframe::egui_wgpu::RenderState;
use egui::{Color32, PointerButton, Pos2, Rect, Response, Sense, TextureHandle, TextureOptions, Ui};

pub use crate::document::notes::Overlays;
pub use overlays::cube_face;
pub use projection::Projection;

use crate::render::{Frame, Pixels, Shown};
use canvas::Canvas;

/// The picture area.
#[derive(Default)]
pub struct Picture {
    /// What draws it in a window.
    canvas: Option<Canvas>,
    /// Where there is no window to draw it in, as in tests: what egui draws it with.
    texture: Option<TextureHandle>,
    /// What lies over the picture.
    pub overlays: Overlays,
}

/// What the pointer did to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// Nothing.
    No,
    /// It moved.
    Yes,
}

impl Picture {
    /// Draws in this window from now on.
    pub fn draw_in(&mut self, window: RenderState) {
        self.canvas = Some(Canvas::new(window));
    }

    /// Takes a frame to be shown from now on.
    pub fn take(&mut self, context: &egui::Context, frame: &Frame) {
        match (&frame.shown, &mut self.canvas) {
            (Shown::Pixels(pixels), Some(canvas)) => canvas.upload(pixels),
            (Shown::OnDevice(texture), Some(canvas)) => canvas.take(texture),
            (Shown::Pixels(Pixels { size, rgba }), None) => {
                let size = size.map(|side| side as usize);
                let image = egui::ColorImage::from_rgba_premultiplied(size, rgba);
                match &mut self.texture {
                    Some(texture) => texture.set(image, TextureOptions::LINEAR),
                    None => {
                        self.texture = Some(context.load_texture("picture", image, TextureOptions::LINEAR));
                    }
                }
            }
            // Engines have a window's device from the window alone.
            (Shown::OnDevice(_), None) => {}
        }
    }

    /// Forgets what was shown.
    pub fn clear(&mut self) {
        self.texture = None;
        if let Some(canvas) = &mut self.canvas {
            canvas.clear();
        }
    }

    /// Draws it over all that is left of `ui`; its response and rectangle.
    pub fn show(&self, ui: &mut Ui, background: Color32) -> Response {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "picture of the volume"));
        let painter = ui.painter_at(rect);
        if self.canvas.as_ref().is_some_and(|canvas| canvas.paint(&painter, rect, background)) {
            return response;
        }
        painter.rect_filled(rect, 0.0, background);
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
        response
    }
}

/// Moves a camera as the pointer says.
///
/// | input | does |
/// |---|---|
/// | drag | orbit |
/// | shift and drag, middle drag | pan |
/// | ctrl and drag | roll |
/// | scroll, pinch | zoom to the pointer |
/// | alt and scroll | fly in |
pub fn navigate(ui: &Ui, response: &Response, camera: &mut Camera) -> Moved {
    let before = camera.clone();
    let rect = response.rect;
    let height = f64::from(rect.height().max(1.0));
    let modifiers = ui.input(|i| i.modifiers);
    let delta = response.drag_delta();
    let in_heights = [f64::from(delta.x) / height, f64::from(delta.y) / height];
    let primary = response.dragged_by(PointerButton::Primary);
    if response.dragged_by(PointerButton::Middle) || (primary && modifiers.shift) {
        navigation::pan(camera, in_heights);
    } else if primary && modifiers.command {
        if let Some(at) = response.interact_pointer_pos() {
            let middle = rect.center();
            let angle = |p: Pos2| f64::from((p - middle).angle());
            navigation::roll(camera, angle(at) - angle(at - delta));
        }
    } else if primary {
        navigation::orbit(camera, in_heights);
    }
    if let Some(at) = response.hover_pos() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta()));
        let from_middle = at - rect.center();
        let at = [f64::from(from_middle.x) / height, f64::from(from_middle.y) / height];
        if modifiers.alt {
            if scroll.y != 0.0 {
                navigation::fly(camera, f64::from(scroll.y) / 1000.0);
            }
        } else {
            let factor = f64::from(pinch) * (f64::from(scroll.y) / 300.0).exp();
            if factor != 1.0 {
                navigation::zoom(camera, factor, at);
            }
        }
    }
    if *camera == before { Moved::No } else { Moved::Yes }
}
