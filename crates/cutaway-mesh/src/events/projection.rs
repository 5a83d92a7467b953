//! From object space to the pixels of an image, for a camera and a pose.

use cutaway_core::glam::{DMat3, DVec3};

use super::tile::ObjectRays;

/// How far, in pixels, a point of a pixel's ray may be projected from that pixel for a projection to be trusted.
const TOLERANCE: f64 = 1e-4;

/// A projection `(x w, y w, w)` of a point in object space; `(x, y)` is `(0, 0)` at the centre of pixel `(0, 0)`. It
/// holds on both sides of the eye: what is behind it has `w < 0`, and the pixel whose *line* it is on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    eye: DVec3,
    pixels_from_object: DMat3,
    perspective: bool,
}

impl Projection {
    /// `None` where pose and camera are such that pixels and their rays cannot be matched reliably: a pose that
    /// flattens, an eye beyond all reason. `bounds`: corners of a box in object space.
    pub(super) fn new(rays: &ObjectRays, width: u32, height: u32, bounds: [DVec3; 2]) -> Option<Self> {
        let (world, far) = (rays.in_world(), width.max(height).max(1));
        let axes = world.axes();
        let (first, last) = (world.pixel(0, 0), world.pixel(far, far));
        let perspective = first.direction != last.direction;
        // The ray of pixel (x, y) is right * (a + s x) + up * (b - s y) + forward, or starts there.
        let plane = |ray: &cutaway_core::camera::Ray| {
            if perspective {
                ray.direction / ray.direction.dot(axes.forward)
            } else {
                ray.origin - first.origin
            }
        };
        let per_pixel = (plane(&last) - plane(&first)) / f64::from(far);
        let to_object = rays.object_from_world().matrix3;
        let across = to_object * (axes.right * axes.right.dot(per_pixel));
        let along = to_object * (axes.up * axes.up.dot(per_pixel));
        let ahead = to_object * if perspective { plane(&first) } else { axes.forward };
        let pixels_from_object = DMat3::from_cols(across, along, ahead).inverse();
        let projection = Self { eye: rays.pixel(0, 0).origin, pixels_from_object, perspective };
        projection.agrees_with(rays, width, height, bounds).then_some(projection)
    }

    /// Whether points on some pixels' rays, beside the box, come out at those pixels.
    fn agrees_with(&self, rays: &ObjectRays, width: u32, height: u32, [low, high]: [DVec3; 2]) -> bool {
        let (center, radius) = ((low + high) * 0.5, (high - low).length() * 0.5);
        let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
        [(0, 0), (right, 0), (0, bottom), (right, bottom), (right / 2, bottom / 2)].into_iter().all(
            |(x, y)| {
                let ray = rays.pixel(x, y);
                let length = ray.direction.length();
                let nearest = (center - ray.origin).dot(ray.direction) / (length * length);
                let aside = (radius / length).copysign(nearest);
                [nearest + aside, nearest.abs().max(aside.abs())].into_iter().all(|t| {
                    let [xw, yw, w] = self.homogeneous(ray.origin + ray.direction * t);
                    (xw / w - f64::from(x)).abs() < TOLERANCE && (yw / w - f64::from(y)).abs() < TOLERANCE
                })
            },
        )
    }

    /// `(x w, y w, w)`.
    #[inline]
    pub(super) fn homogeneous(&self, point: DVec3) -> [f64; 3] {
        let [x, y, w] = (self.pixels_from_object * (point - self.eye)).to_array();
        [x, y, if self.perspective { w } else { 1.0 }]
    }

    /// Lengths of `w` below this are too near the plane through the eye to divide by: as good as 90 degrees from the
    /// view direction.
    #[inline]
    pub(super) fn grazing(&self, point: DVec3) -> f64 {
        if self.perspective { 1e-6 * (point - self.eye).abs().max_element() } else { 0.0 }
    }

    /// Columns and rows, in pixels `[x0, y0, x1, y1]`, outside which no ray of an image of this size meets a triangle;
    /// `None` where no ray does. For triangles that reach through the plane of the eye.
    pub(super) fn bounds(&self, corners: [DVec3; 3], image: [f64; 2]) -> Option<[f64; 4]> {
        let near = corners.iter().map(|&c| self.grazing(c)).fold(f64::MIN_POSITIVE, f64::max);
        let corners = corners.map(|c| self.homogeneous(c));
        let everything = [0.0, 0.0, image[0], image[1]];
        // What is between the planes w = -near and w = near shows in the image only where it is at the eye.
        let slab = clip(&clip(&corners, 1.0, -near), -1.0, -near);
        if !slab.is_empty() && (0..2).all(|i| reaches(&slab, i, 2.0 * near * (image[i] + 1.0))) {
            return Some(everything);
        }
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for side in [1.0, -1.0] {
            for [x, y, w] in clip(&corners, side, near) {
                let (x, y) = (x / w, y / w);
                let pad = |v: f64| 1e-2 + 1e-6 * v.abs();
                bounds = [
                    bounds[0].min(x - pad(x)),
                    bounds[1].min(y - pad(y)),
                    bounds[2].max(x + pad(x)),
                    bounds[3].max(y + pad(y)),
                ];
            }
        }
        let [x0, y0, x1, y1] = bounds;
        (x0 <= image[0] && y0 <= image[1] && x1 >= 0.0 && y1 >= 0.0)
            .then(|| [x0.max(0.0), y0.max(0.0), x1.min(image[0]), y1.min(image[1])])
    }
}

/// Whether a coordinate of the polygon comes within `distance` of 0.
fn reaches(polygon: &[[f64; 3]], coordinate: usize, distance: f64) -> bool {
    polygon.iter().any(|p| p[coordinate] <= distance) && polygon.iter().any(|p| p[coordinate] >= -distance)
}

/// The part of a polygon with `side * w >= level`.
fn clip(polygon: &[[f64; 3]], side: f64, level: f64) -> Vec<[f64; 3]> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (above_p, above_q) = (side * p[2] - level, side * q[2] - level);
        if above_p >= 0.0 {
            kept.push(*p);
        }
        if (above_p >= 0.0) != (above_q >= 0.0) {
            let f = above_p / (above_p - above_q);
            kept.push(std::array::from_fn(|k| if k == 2 { side * level } else { p[k] + f * (q[k] - p[k]) }));
        }
    }
    kept
}
