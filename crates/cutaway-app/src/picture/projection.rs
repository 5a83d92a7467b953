//! Between the world and the points of the window.

use cutaway_core::camera::{Camera, Ray, RayGenerator};
use cutaway_core::glam::DVec3;
use egui::{Pos2, Rect, Vec2};

/// A camera and the rectangle of the window that its picture fills.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    rays: RayGenerator,
    rect: Rect,
    half_height: f64,
    orthographic: bool,
}

impl Projection {
    /// The picture of `camera` in `rect`, in points of the window.
    pub fn new(camera: &Camera, rect: Rect) -> Self {
        let half_height = camera.orthographic.unwrap_or((camera.view_angle.to_radians() * 0.5).tan());
        let rays = camera.rays(rect.width().max(1.0) as u32, rect.height().max(1.0) as u32);
        Self { rays, rect, half_height, orthographic: camera.orthographic.is_some() }
    }

    /// The rectangle.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Whether all rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        self.orthographic
    }

    /// Right, up and into the picture, in the world.
    pub fn axes(&self) -> [DVec3; 3] {
        let axes = self.rays.axes();
        [axes.right, axes.up, axes.forward]
    }

    /// World units a point of the window, at depth 1 of a perspective and anywhere of an orthographic view.
    fn scale(&self) -> f64 {
        2.0 * self.half_height / f64::from(self.rect.height().max(1.0))
    }

    /// The ray through a point of the window.
    pub fn ray(&self, at: Pos2) -> Ray {
        let offset = at - self.rect.center();
        let [right, up, forward] = self.axes();
        let across = (right * f64::from(offset.x) - up * f64::from(offset.y)) * self.scale();
        if self.orthographic {
            Ray { origin: self.rays.on_axis(0.0) + across, direction: forward }
        } else {
            Ray { origin: self.rays.on_axis(0.0), direction: (forward + across).normalize() }
        }
    }

    /// Where a point of the world is in the window; none behind the eye.
    pub fn point(&self, p_in_world: DVec3) -> Option<Pos2> {
        let depth = self.rays.depth_of(p_in_world);
        if !self.orthographic && depth <= 1e-9 {
            return None;
        }
        let [right, up, _] = self.axes();
        let offset = p_in_world - self.rays.on_axis(0.0);
        let scale = self.pixel_size_at(p_in_world);
        let (x, y) = (offset.dot(right) / scale, -offset.dot(up) / scale);
        let far = f64::from(f32::MAX).sqrt();
        (x.abs() < far && y.abs() < far).then(|| self.rect.center() + Vec2::new(x as f32, y as f32))
    }

    /// World units a point of the window, where `p_in_world` is.
    pub fn pixel_size_at(&self, p_in_world: DVec3) -> f64 {
        let depth = if self.orthographic { 1.0 } else { self.rays.depth_of(p_in_world).max(1e-9) };
        self.scale() * depth
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 2] {
        let perspective = Camera {
            position: [3.0, -9.0, 4.0],
            focal_point: [0.5, 1.0, 0.2],
            view_up: [0.0, 0.1, 1.0],
            view_angle: 35.0,
            orthographic: None,
        };
        [perspective.clone(), Camera { orthographic: Some(4.0), ..perspective }]
    }

    #[test]
    fn a_ray_passes_through_what_is_drawn_there() {
        let rect = Rect::from_min_size(Pos2::new(40.0, 30.0), Vec2::new(300.0, 200.0));
        for camera in cameras() {
            let projection = Projection::new(&camera, rect);
            for p in [DVec3::ZERO, DVec3::new(1.0, 2.0, -0.7), DVec3::new(-1.5, 0.3, 1.1)] {
                let ray = projection.ray(projection.point(p).unwrap());
                let along = (p - ray.origin).dot(ray.direction);
                let off = (ray.origin + ray.direction * along).distance(p);
                assert!(off < 1e-4, "{off} {p}");
            }
        }
    }

    #[test]
    fn what_is_behind_the_eye_is_nowhere() {
        let [camera, _] = cameras();
        let rect = Rect::from_min_size(Pos2::ZERO, Vec2::splat(100.0));
        assert_eq!(Projection::new(&camera, rect).point(DVec3::new(6.0, -20.0, 8.0)), None);
    }
}
