//! The camera: from a pixel to a ray in the world.
//!
//! Pixels are squares; pixel `(x, y)` covers `[x, x+1) x [y, y+1)` with `(0, 0)` at the top left, and its ray passes
//! through its centre. Azimuth, elevation, roll and zoom mean what they mean in VTK.

use glam::{DMat3, DQuat, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::numbers::exact;

/// A ray in the world: points `origin + t * direction`, `t >= 0` a world distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts: the eye, or the camera plane of an orthographic view.
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
}

/// How a camera looks at the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The eye, in the world.
    pub position: [f64; 3],
    /// The point in the middle of the image, in the world.
    pub focal_point: [f64; 3],
    /// The direction that is up in the image; need not be perpendicular to the view.
    #[serde(default = "superior")]
    pub view_up: [f64; 3],
    /// Vertical angle of view in degrees, above 0 and below 180; unused where `orthographic` is given.
    #[serde(default = "view_angle")]
    pub view_angle: f64,
    /// Half the height of the image in world units; makes the projection orthographic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orthographic: Option<f64>,
}

fn superior() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn view_angle() -> f64 {
    Camera::VIEW_ANGLE
}

/// Why a camera does not show anything.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number that is NaN, infinite or outside its range.
    #[error("camera {field} is {found}; expected {expected}")]
    Field {
        /// Which field.
        field: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// Position and focal point are the same.
    #[error("camera position and focal point are both {at:?}; move one of them")]
    NoDirection {
        /// Where both are.
        at: [f64; 3],
    },
}

/// Axes of the view in the world: right, up, and towards the scene; orthonormal.
#[derive(Clone, Copy, Debug)]
pub struct ViewAxes {
    /// Image x.
    pub right: DVec3,
    /// Against image y.
    pub up: DVec3,
    /// Into the image.
    pub forward: DVec3,
}

impl Camera {
    /// The default vertical angle of view, in degrees (as VTK).
    pub const VIEW_ANGLE: f64 = 30.0;

    /// Checks every number.
    pub fn validate(&self) -> Result<(), CameraError> {
        let triple = |field, v: [f64; 3]| {
            if v.iter().all(|x| x.is_finite()) {
                return Ok(());
            }
            Err(CameraError::Field { field, found: format!("{v:?}"), expected: "three finite numbers" })
        };
        triple("position", self.position)?;
        triple("focal point", self.focal_point)?;
        triple("view up", self.view_up)?;
        if direction_of(self.view_up).is_none() {
            let found = format!("{:?}", self.view_up);
            return Err(CameraError::Field { field: "view up", found, expected: "a direction, not zero" });
        }
        if !(self.view_angle > 0.0 && self.view_angle < 180.0) {
            let found = exact(self.view_angle);
            return Err(CameraError::Field {
                field: "view angle",
                found,
                expected: "more than 0 and less than 180 degrees",
            });
        }
        if let Some(half) = self.orthographic.filter(|h| !(*h > 0.0 && h.is_finite())) {
            let found = exact(half);
            return Err(CameraError::Field {
                field: "orthographic scale",
                found,
                expected: "a length above 0",
            });
        }
        // Closer than rounding of the coordinates.
        let [position, focal_point] = [self.position, self.focal_point].map(DVec3::from_array);
        let size = position.abs().max_element().max(focal_point.abs().max_element());
        if (focal_point - position).abs().max_element() <= 4.0 * f64::EPSILON * size {
            return Err(CameraError::NoDirection { at: self.position });
        }
        Ok(())
    }

    /// The axes of the view. A view along `view_up` takes the next best direction for up.
    pub fn axes(&self) -> ViewAxes {
        let way = DVec3::from_array(self.focal_point) - DVec3::from_array(self.position);
        let forward = direction_of(way.to_array()).unwrap_or(DVec3::NEG_Z);
        let up = direction_of(self.view_up).unwrap_or(DVec3::Y);
        let right = forward.cross(up);
        let right = if right.length() < 1e-6 { forward.any_orthonormal_vector() } else { right.normalize() };
        ViewAxes { right, up: right.cross(forward), forward }
    }

    /// Rays of an image of this size.
    pub fn rays(&self, width: u32, height: u32) -> RayGenerator {
        let axes = self.axes();
        let half_height = self.orthographic.unwrap_or((self.view_angle.to_radians() * 0.5).tan());
        RayGenerator {
            position: DVec3::from_array(self.position),
            axes,
            size: DVec2::new(f64::from(width), f64::from(height)),
            half_height,
            orthographic: self.orthographic.is_some(),
            spacing: 1.0,
        }
    }

    /// A camera that looks along `forward` at a box (or any points) and shows all of it, with `margin` (1.05: a
    /// twentieth) around, in an image of this aspect ratio (width / height).
    pub fn framing(points: &[DVec3], forward: DVec3, up: DVec3, aspect: f64, margin: f64) -> Self {
        let center = points.iter().map(|p| *p / points.len().max(1) as f64).sum::<DVec3>();
        let radius = points.iter().map(|p| (*p - center).abs().max_element()).fold(0.0, f64::max);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let mut camera = Self {
            position: (-forward.normalize()).to_array(),
            focal_point: [0.0; 3],
            view_up: up.to_array(),
            view_angle: Self::VIEW_ANGLE,
            orthographic: None,
        };
        let axes = camera.axes();
        let slope = (Self::VIEW_ANGLE.to_radians() * 0.5).tan() / margin;
        // A point p is inside when |right·p| <= slope * aspect * (distance + forward·p), and so for up.
        let distance = points.iter().map(|p| {
            let p = *p - center;
            let across = (axes.right.dot(p).abs() / aspect).max(axes.up.dot(p).abs());
            across / slope - axes.forward.dot(p)
        });
        let distance = distance.fold(0.0, f64::max).max(1e-9 * radius);
        camera.position = (center - axes.forward * distance).to_array();
        camera.focal_point = center.to_array();
        camera
    }

    /// Turns the camera about the focal point around the view-up direction, by an angle in radians.
    pub fn azimuth(&mut self, angle: f64) {
        self.orbit(DQuat::from_axis_angle(DVec3::from_array(self.view_up).normalize(), angle));
    }

    /// Turns the camera about the focal point around the image's x axis, by an angle in radians; view-up turns along,
    /// so that it never meets the view direction.
    pub fn elevation(&mut self, angle: f64) {
        let rotation = DQuat::from_axis_angle(-self.axes().right, angle);
        self.orbit(rotation);
        self.view_up = (rotation * DVec3::from_array(self.view_up)).to_array();
    }

    /// Turns the camera around the view direction, by an angle in radians.
    pub fn roll(&mut self, angle: f64) {
        let rotation = DQuat::from_axis_angle(self.axes().forward, angle);
        self.view_up = (rotation * DVec3::from_array(self.view_up)).to_array();
    }

    /// Narrows the view by a factor above 0.
    pub fn zoom(&mut self, factor: f64) {
        match &mut self.orthographic {
            Some(half) => *half /= factor,
            None => self.view_angle /= factor,
        }
    }

    fn orbit(&mut self, rotation: DQuat) {
        let focal = DVec3::from_array(self.focal_point);
        self.position = (focal + rotation * (DVec3::from_array(self.position) - focal)).to_array();
    }
}

/// The unit vector along `v`, of any length; none for zero.
fn direction_of(v: [f64; 3]) -> Option<DVec3> {
    let v = DVec3::from_array(v);
    v.try_normalize().or_else(|| {
        // Squares of very long and very short vectors are no numbers.
        let size = v.abs().max_element();
        (size > 0.0).then(|| (v / size).normalize())
    })
}

/// Makes the ray of each pixel of one image.
#[derive(Clone, Copy, Debug)]
pub struct RayGenerator {
    position: DVec3,
    axes: ViewAxes,
    size: DVec2,
    half_height: f64,
    orthographic: bool,
    /// Pixels of the image from one pixel here to the next.
    spacing: f64,
}

impl RayGenerator {
    /// The rays of every `spacing`-th pixel along x and y, from the first one on, also beyond the image's border.
    pub fn every(self, spacing: u32) -> Self {
        Self { spacing: self.spacing * f64::from(spacing), ..self }
    }

    /// The point of the camera's axis at this depth in front of it.
    pub fn on_axis(&self, depth: f64) -> DVec3 {
        self.position + self.axes.forward * depth
    }

    /// The ray through the centre of pixel `(x, y)`.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> Ray {
        let scale = 2.0 * self.half_height / self.size.y;
        let across = (f64::from(x) * self.spacing + 0.5 - 0.5 * self.size.x) * scale;
        let along = (0.5 * self.size.y - f64::from(y) * self.spacing - 0.5) * scale;
        let offset = self.axes.right * across + self.axes.up * along;
        if self.orthographic {
            Ray { origin: self.position + offset, direction: self.axes.forward }
        } else {
            Ray { origin: self.position, direction: (self.axes.forward + offset).normalize() }
        }
    }

    /// The points at which the rays pass a plane at this depth in front of the camera.
    pub fn plane(&self, depth: f64) -> PixelPlane {
        let scale = 2.0 * self.half_height / self.size.y * if self.orthographic { 1.0 } else { depth };
        let (per_x, per_y) = (self.axes.right * scale, self.axes.up * -scale);
        let middle = self.position + self.axes.forward * depth;
        let plane = Self::plane_around(middle, per_x, per_y, self.size);
        PixelPlane { per_x: per_x * self.spacing, per_y: per_y * self.spacing, ..plane }
    }

    fn plane_around(middle: DVec3, per_x: DVec3, per_y: DVec3, size: DVec2) -> PixelPlane {
        let first = middle + per_x * (0.5 - 0.5 * size.x) + per_y * (0.5 - 0.5 * size.y);
        PixelPlane { first, per_x, per_y }
    }

    /// Where all rays begin, unless they are parallel.
    pub fn eye(&self) -> Option<DVec3> {
        (!self.orthographic).then_some(self.position)
    }

    /// How far in front of the camera a point is, along the view.
    pub fn depth_of(&self, point: DVec3) -> f64 {
        (point - self.position).dot(self.axes.forward)
    }

    /// The axes of the view.
    pub fn axes(&self) -> &ViewAxes {
        &self.axes
    }

    /// The rotation from view to world: columns right, up, backward.
    pub fn world_from_view(&self) -> DMat3 {
        DMat3::from_cols(self.axes.right, self.axes.up, -self.axes.forward)
    }
}

/// Points of a plane parallel to the image, one a pixel: an affine function, for code that makes many rays at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelPlane {
    /// The point of pixel (0, 0), in the world.
    pub first: DVec3,
    /// From a pixel's point to that of the pixel right of it.
    pub per_x: DVec3,
    /// From a pixel's point to that of the pixel below it.
    pub per_y: DVec3,
}

impl PixelPlane {
    /// The point of a pixel.
    pub fn at(&self, x: u32, y: u32) -> DVec3 {
        self.first + self.per_x * f64::from(x) + self.per_y * f64::from(y)
    }
}

/// Where a ray is inside the box `[0, extent]` of voxel space: entry and exit distance, not before the ray's origin.
///
/// `origin`, `direction`: the ray in voxel space, parametrised as in the world.
pub fn intersect_box(origin: DVec3, direction: DVec3, extent: DVec3) -> Option<crate::segment::Segment> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        if direction[axis] == 0.0 {
            if !(0.0..=extent[axis]).contains(&origin[axis]) {
                return None;
            }
        } else {
            let (a, b) = (-origin[axis] / direction[axis], (extent[axis] - origin[axis]) / direction[axis]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
    }
    crate::segment::Segment::new(near, far)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: [0.0, -10.0, 0.0],
            focal_point: [0.0; 3],
            view_up: [0.0, 0.0, 1.0],
            view_angle: 90.0,
            orthographic: None,
        }
    }

    #[test]
    fn every_ray_passes_through_its_point_of_a_plane() {
        for orthographic in [None, Some(7.0)] {
            let rays = Camera { orthographic, ..camera() }.rays(31, 17);
            let plane = rays.plane(6.5);
            for (x, y) in [(0, 0), (30, 0), (4, 16), (15, 8)] {
                let (ray, point) = (rays.pixel(x, y), plane.at(x, y));
                assert!((rays.depth_of(point) - 6.5).abs() < 1e-12);
                let off = (point - ray.origin).cross(ray.direction).length();
                assert!(off < 1e-12, "{off} from the ray of ({x}, {y})");
                assert!(rays.eye().is_none_or(|eye| eye == ray.origin));
            }
        }
    }

    #[test]
    fn every_so_many_rays_are_those_of_their_pixels() {
        for orthographic in [None, Some(7.0)] {
            let rays = Camera { orthographic, ..camera() }.rays(31, 17);
            let some = rays.every(3);
            for (x, y) in [(0, 0), (10, 5), (12, 7)] {
                assert_eq!(some.pixel(x, y), rays.pixel(3 * x, 3 * y));
                let (a, b) = (some.plane(2.0).at(x, y), rays.plane(2.0).at(3 * x, 3 * y));
                assert!((a - b).length() < 1e-12);
            }
        }
    }

    #[test]
    fn the_image_is_upright_and_not_mirrored() {
        let rays = camera().rays(2, 2);
        // Looking along +y with +z up, +x is to the right.
        let (left_top, right_bottom) = (rays.pixel(0, 0).direction, rays.pixel(1, 1).direction);
        assert!(left_top.x < 0.0 && left_top.z > 0.0 && right_bottom.x > 0.0 && right_bottom.z < 0.0);
        assert!((left_top.x / left_top.y + 0.5).abs() < 1e-12, "90 degrees: half a pixel is at slope 1/2");
    }

    #[test]
    fn framing_shows_every_corner_and_touches_the_border() {
        let corners: Vec<DVec3> = (0..8)
            .map(|c| DVec3::new((c & 1) as f64 * 9.0, (c >> 1 & 1) as f64 * 2.0, (c >> 2) as f64 * 4.0))
            .collect();
        for aspect in [0.5, 1.0, 3.0] {
            let camera = Camera::framing(&corners, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, aspect, 1.0);
            let axes = camera.axes();
            let slope = (camera.view_angle.to_radians() / 2.0).tan();
            let reach = corners.iter().map(|c| {
                let p = *c - DVec3::from_array(camera.position);
                let depth = p.dot(axes.forward);
                assert!(depth > 0.0);
                (p.dot(axes.right) / depth / slope / aspect).abs().max((p.dot(axes.up) / depth / slope).abs())
            });
            let reach = reach.fold(0.0, f64::max);
            assert!((reach - 1.0).abs() < 1e-9, "{reach}");
        }
    }

    #[test]
    fn azimuth_and_elevation_keep_the_distance() {
        let mut c = camera();
        c.azimuth(0.5);
        // Seen from above, a positive azimuth moves the camera anti-clockwise.
        assert!(c.position[0] > 0.0);
        c.elevation(0.3);
        assert!(c.position[2] > 0.0, "a positive elevation raises the camera");
        assert!((DVec3::from_array(c.position).length() - 10.0).abs() < 1e-12);
        c.roll(std::f64::consts::FRAC_PI_2);
        c.zoom(2.0);
        assert_eq!(c.view_angle, 45.0);
    }

    #[test]
    fn a_ray_inside_the_box_starts_at_its_origin() {
        let s = intersect_box(DVec3::splat(0.5), DVec3::X, DVec3::ONE).unwrap();
        assert_eq!((s.t_near(), s.t_far()), (0.0, 0.5));
        assert!(intersect_box(DVec3::new(2.0, 0.5, 0.5), DVec3::Y, DVec3::ONE).is_none());
        assert!(intersect_box(DVec3::new(2.0, 0.5, 0.5), DVec3::X, DVec3::ONE).is_none());
    }

    #[test]
    fn nonsense_cameras_are_refused() {
        let mut c = camera();
        c.focal_point = c.position;
        assert!(matches!(c.validate(), Err(CameraError::NoDirection { .. })));
        let c = Camera { view_angle: 180.0, ..camera() };
        assert!(c.validate().is_err());
        let c = Camera { position: [f64::NAN, 0.0, 0.0], ..camera() };
        assert!(c.validate().is_err());
        assert!(camera().validate().is_ok());
    }
}
