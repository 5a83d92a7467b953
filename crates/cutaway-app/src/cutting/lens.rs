//! From points of the picture to rays in the world and back, in whatever unit the picture is measured.
//!
//! The picture has its origin at the top left, y down; the camera's vertical angle of view fills its height.

use cutaway_core::camera::{Camera, Ray, ViewAxes};
use cutaway_core::glam::{DVec2, DVec3};

/// What the picture shows of the world.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    eye: DVec3,
    axes: ViewAxes,
    size: DVec2,
    /// World units a unit of the picture; in perspective: a unit of depth.
    scale: f64,
    orthographic: bool,
}

impl Lens {
    /// A valid camera and the size of the picture, above 0.
    pub fn new(camera: &Camera, size: DVec2) -> Self {
        let half = camera.orthographic.unwrap_or_else(|| (camera.view_angle.to_radians() * 0.5).tan());
        let (eye, scale) = (DVec3::from_array(camera.position), 2.0 * half / size.y.max(1e-9));
        Self::of_view(eye, camera.axes(), size, scale, camera.orthographic.is_some())
    }

    /// A view whose numbers are known: `scale` is world units a unit of the picture, in perspective at a depth of 1.
    pub fn of_view(eye: DVec3, axes: ViewAxes, size: DVec2, scale: f64, orthographic: bool) -> Self {
        Self { eye, axes, size, scale, orthographic }
    }

    /// The ray through a point of the picture.
    pub fn ray(&self, point: DVec2) -> Ray {
        let from_middle = (point - 0.5 * self.size) * self.scale;
        let offset = self.axes.right * from_middle.x - self.axes.up * from_middle.y;
        if self.orthographic {
            Ray { origin: self.eye + offset, direction: self.axes.forward }
        } else {
            Ray { origin: self.eye, direction: (self.axes.forward + offset).normalize() }
        }
    }

    /// Where a point of the world is seen; none behind the eye.
    pub fn point(&self, world: DVec3) -> Option<DVec2> {
        let from_eye = world - self.eye;
        let scale = self.size_at(world)?;
        let across = DVec2::new(from_eye.dot(self.axes.right), -from_eye.dot(self.axes.up));
        Some(across / scale + 0.5 * self.size)
    }

    /// World units a unit of the picture, where a point of the world is; none behind the eye.
    pub fn size_at(&self, world: DVec3) -> Option<f64> {
        if self.orthographic {
            return Some(self.scale);
        }
        let depth = (world - self.eye).dot(self.axes.forward);
        let nearest = 1e-6 * (world - self.eye).length();
        (depth > nearest).then_some(self.scale * depth)
    }

    /// From the viewer to a point of the world; unit length.
    pub fn direction_to(&self, world: DVec3) -> DVec3 {
        if self.orthographic {
            return self.axes.forward;
        }
        (world - self.eye).try_normalize().unwrap_or(self.axes.forward)
    }

    /// Whether all rays go the same way.
    pub fn is_orthographic(&self) -> bool {
        self.orthographic
    }

    /// Into the picture, in its middle.
    pub fn forward(&self) -> DVec3 {
        self.axes.forward
    }

    /// Where the ray through a point of the picture meets a plane; none where it does not, or meets it behind the eye.
    pub fn on_plane(&self, point: DVec2, of_plane: DVec3, normal: DVec3) -> Option<DVec3> {
        let ray = self.ray(point);
        let slope = ray.direction.dot(normal);
        let t = (of_plane - ray.origin).dot(normal) / slope;
        // The origin of an orthographic ray is nowhere in particular.
        let in_front = t > 0.0 || self.orthographic;
        (slope.abs() > 1e-6 * normal.length() && in_front && t.is_finite())
            .then(|| ray.origin + ray.direction * t)
    }

    /// How far along a line the point is that is seen nearest to a point of the picture, in units of `direction`; none
    /// where the line is seen end on, or that point is behind the eye.
    ///
    /// Nearest in the picture: where the line's image is met at a right angle, so that what was grabbed on the line stays
    /// under the pointer as far as the line lets it.
    pub fn along_line(&self, point: DVec2, origin: DVec3, direction: DVec3) -> Option<f64> {
        let image = self.image_of_line(origin, direction)?;
        let foot = image.through + image.direction * image.direction.dot(point - image.through);
        let ray = self.ray(foot);
        // The ray and the line lie in a plane; its normal within that plane's view of the line finds where they meet.
        let across = ray.direction.cross(direction);
        let t = (origin - ray.origin).cross(direction).dot(across) / across.length_squared();
        let s = (origin - ray.origin).cross(ray.direction).dot(across) / across.length_squared();
        let met = origin + direction * s;
        (s.is_finite() && (t > 0.0 || self.orthographic) && self.size_at(met).is_some()).then_some(s)
    }

    /// What is seen of a line: a point of its image and the unit direction in which it goes; none where it is seen end on.
    pub fn image_of_line(&self, origin: DVec3, direction: DVec3) -> Option<ImageOfLine> {
        let through = self.point(origin)?;
        let per_unit = self.image_of_step(origin, direction)?;
        let length = per_unit.length();
        // A step that is seen more from its end than a hundredth of it.
        let seen = length * self.size_at(origin)?;
        (seen > 0.01 * direction.length()).then(|| ImageOfLine { through, direction: per_unit / length })
    }

    /// How a point of the picture moves as the point of the world that it shows makes a small step, a unit of the step's
    /// length.
    fn image_of_step(&self, at: DVec3, step: DVec3) -> Option<DVec2> {
        let size = self.size_at(at)?;
        let across = DVec2::new(step.dot(self.axes.right), -step.dot(self.axes.up)) / size;
        if self.orthographic {
            return Some(across);
        }
        let depth = (at - self.eye).dot(self.axes.forward);
        let from_middle = self.point(at)? - 0.5 * self.size;
        Some(across - from_middle * (step.dot(self.axes.forward) / depth))
    }
}

/// What is seen of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageOfLine {
    /// A point of it.
    pub through: DVec2,
    /// Where it goes; unit length.
    pub direction: DVec2,
}
