//! A small sphere on which the direction towards the light is dragged, as the camera sees it.

use cutaway_core::camera::ViewAxes;
use cutaway_core::glam::DVec3;
use egui::{Color32, Pos2, Response, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, vec2};

/// Side of the sphere's square, in points of the screen.
const SIDE: f32 = 72.0;

/// The control; its state is the light's.
#[derive(Debug, Default)]
pub(super) struct Sphere;

impl Sphere {
    /// Draws the sphere; a new direction in the world where it is dragged or clicked.
    pub(super) fn show(&mut self, ui: &mut Ui, axes: &ViewAxes, light: [f64; 3]) -> Option<[f64; 3]> {
        let (rect, response) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), "Direction of the light"));
        let radius = 0.5 * SIDE - 3.0;
        if ui.is_rect_visible(rect) {
            paint(ui, &response, rect.center(), radius, in_view(axes, light));
        }
        let place = response.interact_pointer_pos().filter(|_| response.dragged() || response.clicked())?;
        let offset: Vec2 = (place - rect.center()) / radius;
        Some(in_world(axes, [f64::from(offset.x), -f64::from(offset.y)]))
    }
}

fn paint(ui: &Ui, response: &Response, center: Pos2, radius: f32, light: DVec3) {
    let visuals = ui.style().interact(response);
    let painter = ui.painter();
    painter.circle(center, radius, Color32::from_gray(60), visuals.fg_stroke);
    let place = |x: f64, y: f64| center + vec2(x as f32, -y as f32) * radius;
    // What is lit: discs ever smaller and brighter towards the light, inside the sphere.
    let steps = 12;
    for step in 0..steps {
        let share = f64::from(step) / f64::from(steps);
        if light.z > 0.0 {
            let (at, size) = (place(light.x * share, light.y * share), (1.0 - share) as f32 * radius);
            painter.circle_filled(at, size * 0.98, Color32::from_gray(60 + (130.0 * share) as u8));
        }
    }
    let at = place(light.x, light.y);
    // A ring where the light is behind.
    if light.z >= 0.0 {
        painter.circle(at, 5.0, Color32::from_rgb(255, 225, 120), Stroke::new(1.0, Color32::BLACK));
    } else {
        painter.circle_stroke(at, 5.0, Stroke::new(2.0, Color32::from_rgb(255, 225, 120)));
    }
}

/// A direction of the world as the camera sees it: right, up, towards the eye; unit length.
pub(super) fn in_view(axes: &ViewAxes, light: [f64; 3]) -> DVec3 {
    let light = DVec3::from_array(light).normalize_or(-axes.forward);
    DVec3::new(light.dot(axes.right), light.dot(axes.up), -light.dot(axes.forward))
}

/// The direction of the world at a place of the sphere's front: right and up, -1..=1; outside it, on its rim. Unit length.
pub(super) fn in_world(axes: &ViewAxes, [x, y]: [f64; 2]) -> [f64; 3] {
    let length = x.hypot(y);
    let (x, y) = if length > 1.0 { (x / length, y / length) } else { (x, y) };
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    (axes.right * x + axes.up * y - axes.forward * z).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::camera::Camera;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_place_of_the_sphere_is_a_direction_and_back(
            x in -1.0..1.0, y in -1.0..1.0, px in -9.0..9.0, py in -9.0..9.0, pz in 1.0..9.0
        ) {
            let corners = [DVec3::ZERO, DVec3::ONE];
            let axes = Camera::framing(&corners, DVec3::new(px, py, pz), DVec3::Z, 1.0, 1.0).axes();
            let world = in_world(&axes, [x, y]);
            prop_assert!((DVec3::from_array(world).length() - 1.0).abs() < 1e-9);
            let view = in_view(&axes, world);
            let length = f64::hypot(x, y).max(1.0);
            prop_assert!((view.x - x / length).abs() < 1e-6 && (view.y - y / length).abs() < 1e-6);
            prop_assert!(view.z >= -1e-9);
        }
    }
}
