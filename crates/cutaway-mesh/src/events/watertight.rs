//! The one function that says whether a line crosses a triangle, and where.
//!
//! Enters: a [`Line`] made of a ray in object space, relative to the mesh's origin, once a ray, and corners in f32. Leaves: `t` and the sense of the
//! crossing. Every finder calls it, so that all of them give the same events, bit for bit.
//!
//! The line is sheared onto its dominant axis (Woop, Benthin and Wald, "Watertight ray/triangle intersection", JCGT
//! 2013): with `z` that axis, the line is `x = foot_x + slope_x z`, `y = foot_y + slope_y z`, and a vertex becomes the
//! point `(x - foot_x - slope_x z, y - foot_y - slope_y z)` of a plane in which the line is the origin. A vertex is the
//! same point in all triangles around it, whatever was rounded on the way there.
//!
//! From there on nothing is rounded that decides. A triangle is hit when the origin is inside its image: when the three
//! cross products of neighbouring corners have one sign. The f64 difference of two rounded products is zero or has the
//! right sign, because rounding is monotone; where it is zero the errors of the products are compared, exactly. Where
//! the product really is zero (the line meets an edge or a vertex) the origin is thought moved by `(e, e^2)` for an `e`
//! smaller than everything: the sign is then that of the edge's direction. The moved origin lies on no edge at all, so
//! that on any closed surface it is inside as many images that turn left as images that turn right: entering and
//! leaving events balance on *every* line.

use cutaway_core::camera::Ray;
use cutaway_core::clip::{Crossing, Event};
use cutaway_core::glam::{DVec3, Vec3};

/// Smaller slopes and feet are taken as 0, so that no product and no error of a product ever underflows: the vertices,
/// being f32, are 0 or above 1e-45.
const NOTHING: f64 = 1e-50;

/// Larger coordinates of a ray make no line, so that no product overflows.
const FAR: f64 = 1e100;

/// A line in object space, ready for [`Line::crossing`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// The dominant axis of the direction, `z` below: 0, 1 or 2. `x` and `y` are the next two, cyclically.
    axis: u8,
    /// Whether the direction is along `+z`.
    forward: bool,
    /// `dx/dz`, `dy/dz`; at most 1.
    slope: [f64; 2],
    /// Where the line meets the plane `z = 0`.
    foot: [f64; 2],
    /// The `z` of the ray's origin.
    start: f64,
    /// `dt/dz`.
    rate: f64,
}

impl Line {
    /// The line of a ray; `None` where its direction is zero, or where a number is not finite or beyond all reason.
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.origin, ray.direction);
        let length = d.abs();
        let axis = if length.x >= length.y && length.x >= length.z {
            0
        } else if length.y >= length.z {
            1
        } else {
            2
        };
        let ([ox, oy, oz], [dx, dy, dz]) = (swizzle(axis, o.to_array()), swizzle(axis, d.to_array()));
        // NaN fails these, too.
        if !(o.abs().max_element() <= FAR && dz.abs() >= 1.0 / FAR && dz.abs() <= FAR && o.is_finite()) {
            return None;
        }
        let rate = 1.0 / dz;
        let flush = |v: f64| if v.abs() < NOTHING { 0.0 } else { v };
        let slope = [flush(dx * rate), flush(dy * rate)];
        let foot = [flush(ox - slope[0] * oz), flush(oy - slope[1] * oz)];
        (slope[0].is_finite() && slope[1].is_finite()).then_some(Self {
            axis,
            forward: dz > 0.0,
            slope,
            foot,
            start: oz,
            rate,
        })
    }

    /// The point of the line nearest to `center`, and its direction with the largest component 1. Structures are walked
    /// along these, which are what [`Line::crossing`] works with, not along the ray.
    pub(crate) fn near(&self, center: DVec3) -> (DVec3, DVec3) {
        let [cx, cy, cz] = swizzle(self.axis, center.to_array());
        let z = cz
            + ((cx - self.foot[0] - self.slope[0] * cz) * self.slope[0]
                + (cy - self.foot[1] - self.slope[1] * cz) * self.slope[1])
                / (1.0 + self.slope[0] * self.slope[0] + self.slope[1] * self.slope[1]);
        let point = [self.foot[0] + self.slope[0] * z, self.foot[1] + self.slope[1] * z, z];
        let direction = [self.slope[0], self.slope[1], 1.0];
        (unswizzle(self.axis, point).into(), unswizzle(self.axis, direction).into())
    }

    /// The image of a vertex: the plane point relative to the line, and its `z`.
    #[inline(always)]
    fn image(&self, vertex: Vec3) -> [f64; 3] {
        let [x, y, z] = swizzle(self.axis, vertex.to_array()).map(f64::from);
        [x - (self.foot[0] + self.slope[0] * z), y - (self.foot[1] + self.slope[1] * z), z]
    }

    /// Where the line crosses a triangle, and in which sense; corners counter-clockwise seen from outside.
    #[inline(always)]
    pub(crate) fn crossing(&self, corners: [Vec3; 3]) -> Option<(f64, Crossing)> {
        let [a, b, c] = corners.map(|corner| self.image(corner));
        let weights = [cross(b, c), cross(c, a), cross(a, b)];
        // Signs that are not zero are right: two that differ decide.
        let any_below = weights[0].min(weights[1]).min(weights[2]) < 0.0;
        let any_above = weights[0].max(weights[1]).max(weights[2]) > 0.0;
        if any_below && any_above {
            return None;
        }
        if weights[0] == 0.0 || weights[1] == 0.0 || weights[2] == 0.0 {
            return self.tie([a, b, c]);
        }
        Some(self.at(weights, [a, b, c], any_above))
    }

    /// `crossing` for a line through, or as good as through, an edge or a vertex.
    #[cold]
    #[inline(never)]
    fn tie(&self, [a, b, c]: [[f64; 3]; 3]) -> Option<(f64, Crossing)> {
        let edges = [exact_cross(b, c), exact_cross(c, a), exact_cross(a, b)];
        let left = edges[0].1;
        if left == 0 || edges[1].1 != left || edges[2].1 != left {
            return None;
        }
        Some(self.at(edges.map(|e| e.0), [a, b, c], left > 0))
    }

    /// The crossing at the point with these barycentric weights, all of one sign, at least one of them not 0.
    #[inline(always)]
    fn at(&self, [u, v, w]: [f64; 3], [a, b, c]: [[f64; 3]; 3], left: bool) -> (f64, Crossing) {
        let z = (u * a[2] + v * b[2] + w * c[2]) / (u + v + w);
        // An image that turns left has a normal along +z.
        let crossing = if left == self.forward { Crossing::Leaving } else { Crossing::Entering };
        ((z - self.start) * self.rate, crossing)
    }

    /// The event of a triangle, where there is one.
    #[inline(always)]
    pub(crate) fn event(&self, corners: [Vec3; 3], surface: u32) -> Option<Event> {
        self.crossing(corners).map(|(t, crossing)| Event { t, crossing, surface })
    }
}

/// `[x, y, z]` with `z` the dominant axis.
#[inline(always)]
fn swizzle<T: Copy>(axis: u8, [x, y, z]: [T; 3]) -> [T; 3] {
    match axis {
        0 => [y, z, x],
        1 => [z, x, y],
        _ => [x, y, z],
    }
}

/// The inverse of [`swizzle`].
fn unswizzle<T: Copy>(axis: u8, [x, y, z]: [T; 3]) -> [T; 3] {
    match axis {
        0 => [z, x, y],
        1 => [y, z, x],
        _ => [x, y, z],
    }
}

/// Cross product of two images: zero or of the right sign.
#[inline(always)]
fn cross(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

/// Cross product of two images, and its sign after the origin was moved by `(e, e^2)`; the sign is 0 only where both
/// images are one point.
fn exact_cross(p: [f64; 3], q: [f64; 3]) -> (f64, i32) {
    let (left, right) = (p[0] * q[1], p[1] * q[0]);
    let mut value = left - right;
    if value == 0.0 {
        // Equal when rounded: what rounding took away decides. A fused multiply-add gives it without error.
        value = p[0].mul_add(q[1], -left) - p[1].mul_add(q[0], -right);
    }
    let sign = |positive: bool| if positive { 1 } else { -1 };
    if value != 0.0 {
        (value, sign(value > 0.0))
    } else if p[1] != q[1] {
        (0.0, sign(p[1] > q[1]))
    } else if p[0] != q[0] {
        (0.0, sign(q[0] > p[0]))
    } else {
        (0.0, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn line(origin: [f64; 3], direction: [f64; 3]) -> Line {
        Line::new(&Ray { origin: origin.into(), direction: direction.into() }).expect("a line")
    }

    const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    #[test]
    fn a_line_against_the_normal_enters() {
        let (t, crossing) = line([0.25, 0.25, 2.0], [0.0, 0.0, -1.0]).crossing(TRIANGLE).expect("a hit");
        assert_eq!((t, crossing), (2.0, Crossing::Entering));
        let (t, crossing) = line([0.25, 0.25, 2.0], [0.0, 0.0, 4.0]).crossing(TRIANGLE).expect("behind");
        assert_eq!((t, crossing), (-0.5, Crossing::Leaving));
        assert!(line([0.75, 0.75, 2.0], [0.0, 0.0, 1.0]).crossing(TRIANGLE).is_none());
    }

    #[test]
    fn rays_that_are_none_make_no_line() {
        let ray = |origin: [f64; 3], direction: [f64; 3]| {
            Line::new(&Ray { origin: origin.into(), direction: direction.into() })
        };
        assert!(ray([0.0; 3], [0.0; 3]).is_none());
        assert!(ray([f64::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]).is_none());
        assert!(ray([0.0, f64::INFINITY, 0.0], [0.0, 0.0, 1.0]).is_none());
        assert!(ray([0.0; 3], [f64::NAN, 0.0, 1.0]).is_none());
        assert!(ray([0.0; 3], [0.0, f64::INFINITY, 1.0]).is_none());
        assert!(ray([0.0; 3], [1e-200, 0.0, 0.0]).is_none());
    }

    #[test]
    fn a_line_through_the_hub_of_a_fan_crosses_one_triangle() {
        let rim = |i: usize| {
            let angle = i as f32 * 0.7;
            Vec3::new(angle.cos(), angle.sin(), 0.1 * i as f32)
        };
        let hub = Vec3::new(0.3, -0.1, 0.2);
        for direction in [[0.0, 0.0, 1.0], [0.1, 0.2, -1.0], [-0.3, 0.1, 0.9]] {
            let line = line(hub.as_dvec3().to_array(), direction);
            let hits: Vec<_> =
                (0..9).filter_map(|i| line.crossing([hub, rim(i), rim((i + 1) % 9)])).collect();
            assert_eq!(hits.len(), 1, "{hits:?}");
            assert_eq!(hits[0].0, 0.0, "the hub is the ray's origin");
        }
    }

    #[test]
    fn a_product_that_only_rounds_to_zero_has_its_exact_sign() {
        let e = f64::EPSILON;
        // (1 + e)(1 - e) = 1 - e^2 rounds to 1.
        let (value, sign) = exact_cross([1.0 + e, 1.0, 0.0], [1.0, 1.0 - e, 0.0]);
        assert_eq!((1.0 + e) * (1.0 - e) - 1.0, 0.0);
        assert!(value < 0.0 && sign == -1, "{value}");
    }

    proptest! {
        #[test]
        fn the_sign_of_an_edge_turns_with_the_edge(
            p in prop::array::uniform2(-2i32..=2), q in prop::array::uniform2(-2i32..=2),
        ) {
            let point = |v: [i32; 2]| [f64::from(v[0]), f64::from(v[1]), 0.0];
            let (there, back) = (exact_cross(point(p), point(q)), exact_cross(point(q), point(p)));
            prop_assert_eq!(there.1, -back.1);
            prop_assert_eq!(there.1 == 0, p == q);
        }

        #[test]
        fn the_hit_point_is_on_line_and_plane(
            v in prop::array::uniform9(-1f32..1.0), o in prop::array::uniform3(-4f64..4.0),
            u in 0.05f64..0.45, w in 0.05f64..0.45,
        ) {
            let corners = [Vec3::from_slice(&v[0..3]), Vec3::from_slice(&v[3..6]), Vec3::from_slice(&v[6..9])];
            let [a, b, c] = corners.map(|c| c.as_dvec3());
            let normal = (b - a).cross(c - a);
            prop_assume!(normal.length() > 0.05);
            let target = a * (1.0 - u - w) + b * u + c * w;
            let origin = DVec3::from_array(o);
            let direction = target - origin;
            prop_assume!(normal.normalize().dot(direction.normalize()).abs() > 0.05);
            let (t, crossing) = line(o, direction.to_array()).crossing(corners).expect("aimed at the inside");
            prop_assert!((t - 1.0).abs() < 1e-10);
            prop_assert_eq!(crossing == Crossing::Leaving, normal.dot(direction) > 0.0);
        }
    }
}
