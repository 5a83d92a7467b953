//! Solids with closed forms: half-space, box, sphere.
//!
//! Events come straight from the shape's equation, in f64. Shapes are closed sets: a line that runs within a face is
//! inside; one that only touches (a sphere's tangent, a box's corner) crosses nothing.

use glam::DVec3;

use super::{Crossing, Event, Solid};
use crate::camera::Ray;
use crate::numbers::exact;

/// Why numbers do not make a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field} is {found}; expected {expected}")]
pub struct ShapeError {
    /// Which number, as in a scene file.
    pub field: &'static str,
    /// What it is.
    pub found: String,
    /// What it should be.
    pub expected: &'static str,
}

/// Coordinates beyond this are refused: their squares must stay finite.
pub const LARGEST_COORDINATE: f64 = 1e30;

fn coordinates(field: &'static str, v: DVec3) -> Result<DVec3, ShapeError> {
    if v.is_finite() && v.abs().max_element() <= LARGEST_COORDINATE {
        return Ok(v);
    }
    let found = format!("{:?}", v.to_array());
    Err(ShapeError { field, found, expected: "three numbers between -1e30 and 1e30" })
}

fn event(t: f64, crossing: Crossing, surface: u32) -> Event {
    Event { t, crossing, surface }
}

/// A half-space: `normal · x <= distance`.
///
/// It has no end, so a line may be inside it from `t` = -∞ or to +∞; the events say so, and balance like those of any
/// other solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: DVec3,
    distance: f64,
}

impl Plane {
    /// `normal` need not have unit length; `distance` is in its units.
    pub fn new(normal: DVec3, distance: f64) -> Result<Self, ShapeError> {
        let normal = coordinates("normal", normal)?;
        let length = normal.length();
        if length < 1.0 / LARGEST_COORDINATE {
            let found = format!("{:?}", normal.to_array());
            return Err(ShapeError { field: "normal", found, expected: "a direction, not zero" });
        }
        if !(distance.is_finite() && (distance / length).abs() <= LARGEST_COORDINATE) {
            let found = exact(distance);
            return Err(ShapeError { field: "distance", found, expected: "a number between -1e30 and 1e30" });
        }
        Ok(Self { normal, distance })
    }

    /// Out of the half-space; as given, of any length.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Of the plane from the origin, in units of the normal.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// Whether a point is in it.
    pub fn contains(&self, p_in_object: DVec3) -> bool {
        self.normal.dot(p_in_object) <= self.distance
    }
}

impl Solid for Plane {
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        let slope = self.normal.dot(ray_in_object.direction);
        let gap = self.distance - self.normal.dot(ray_in_object.origin);
        let (enter, leave) = if slope > 0.0 {
            (f64::NEG_INFINITY, gap / slope)
        } else if slope < 0.0 {
            (gap / slope, f64::INFINITY)
        } else if gap >= 0.0 {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            return;
        };
        events.extend([event(enter, Crossing::Entering, 0), event(leave, Crossing::Leaving, 0)]);
    }

    fn normal(&self, _surface: u32, _point_in_object: DVec3) -> DVec3 {
        self.normal.normalize()
    }

    fn bounds(&self) -> [DVec3; 2] {
        [DVec3::NEG_INFINITY, DVec3::INFINITY]
    }
}

/// A box along the axes, its faces included. Surfaces are `2 * axis` for the face of small, `2 * axis + 1` for that of
/// large coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBox {
    min: DVec3,
    max: DVec3,
}

impl AxisBox {
    /// Between two corners; `min` must be less than `max` along each axis.
    pub fn new(min: DVec3, max: DVec3) -> Result<Self, ShapeError> {
        let (min, max) = (coordinates("min", min)?, coordinates("max", max)?);
        if min.cmplt(max).all() {
            return Ok(Self { min, max });
        }
        let found = format!("{:?} with min {:?}", max.to_array(), min.to_array());
        Err(ShapeError { field: "max", found, expected: "more than min along each axis" })
    }

    /// The corner of small coordinates.
    pub fn min(&self) -> DVec3 {
        self.min
    }

    /// The corner of large coordinates.
    pub fn max(&self) -> DVec3 {
        self.max
    }

    /// Whether a point is in it.
    pub fn contains(&self, p_in_object: DVec3) -> bool {
        self.min.cmple(p_in_object).all() && p_in_object.cmple(self.max).all()
    }
}

impl Solid for AxisBox {
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        let (mut near, mut far) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for axis in 0..3 {
            let (o, d) = (ray_in_object.origin[axis], ray_in_object.direction[axis]);
            if d == 0.0 {
                if !(self.min[axis]..=self.max[axis]).contains(&o) {
                    return;
                }
                continue;
            }
            let low = ((self.min[axis] - o) / d, 2 * axis as u32);
            let high = ((self.max[axis] - o) / d, 2 * axis as u32 + 1);
            let (first, last) = if d > 0.0 { (low, high) } else { (high, low) };
            if first.0 > near.0 {
                near = first;
            }
            if last.0 < far.0 {
                far = last;
            }
        }
        // No direction at all: a line that is a point.
        if near.0 < far.0 && near.0 > f64::NEG_INFINITY {
            let enter = event(near.0, Crossing::Entering, near.1);
            events.extend([enter, event(far.0, Crossing::Leaving, far.1)]);
        }
    }

    fn normal(&self, surface: u32, _point_in_object: DVec3) -> DVec3 {
        let mut normal = DVec3::ZERO;
        normal[(surface as usize / 2).min(2)] = if surface % 2 == 1 { 1.0 } else { -1.0 };
        normal
    }

    fn bounds(&self) -> [DVec3; 2] {
        [self.min, self.max]
    }
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    center: DVec3,
    radius: f64,
}

impl Sphere {
    /// Radius above 0.
    pub fn new(center: DVec3, radius: f64) -> Result<Self, ShapeError> {
        let center = coordinates("center", center)?;
        if radius > 0.0 && radius <= LARGEST_COORDINATE {
            return Ok(Self { center, radius });
        }
        let found = exact(radius);
        Err(ShapeError { field: "radius", found, expected: "a length above 0 and at most 1e30" })
    }

    /// Its middle.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Its radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether a point is in it.
    pub fn contains(&self, p_in_object: DVec3) -> bool {
        p_in_object.distance(self.center) <= self.radius
    }
}

impl Solid for Sphere {
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        let d = ray_in_object.direction;
        let length = d.length();
        let unit = d / length;
        // The line's nearest point to the centre. Taking the discriminant from there keeps a small sphere far from the
        // origin exact, where b² - 4ac would cancel (Haines et al., Ray Tracing Gems, chapter 7).
        let from_center = ray_in_object.origin - self.center;
        let along = -from_center.dot(unit);
        let nearest = from_center + unit * along;
        let half = ((self.radius - nearest.length()) * (self.radius + nearest.length())).sqrt();
        let (enter, leave) = ((along - half) / length, (along + half) / length);
        // NaN, of a line that passes by or has no direction, is not less than anything.
        if enter < leave {
            events.extend([event(enter, Crossing::Entering, 0), event(leave, Crossing::Leaving, 0)]);
        }
    }

    fn normal(&self, _surface: u32, point_in_object: DVec3) -> DVec3 {
        (point_in_object - self.center).try_normalize().unwrap_or(DVec3::Z)
    }

    fn bounds(&self) -> [DVec3; 2] {
        [self.center - self.radius, self.center + self.radius]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Crossing::{Entering, Leaving};
    use proptest::prelude::*;

    fn along(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: DVec3::from_array(origin), direction: DVec3::from_array(direction) }
    }

    fn events(solid: &dyn Solid, ray: Ray) -> Vec<(f64, Crossing, u32)> {
        let mut found = Vec::new();
        solid.events(&ray, &mut found);
        found.iter().map(|e| (e.t, e.crossing, e.surface)).collect()
    }

    #[test]
    fn a_half_space_has_an_inside_at_infinity() {
        let plane = Plane::new(DVec3::new(0.0, 0.0, 2.0), 6.0).unwrap();
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        let up = along([5.0, 1.0, 0.0], [0.0, 0.0, 0.5]);
        assert_eq!(events(&plane, up), [(low, Entering, 0), (6.0, Leaving, 0)]);
        let down = along([5.0, 1.0, 0.0], [0.0, 0.0, -0.5]);
        assert_eq!(events(&plane, down), [(-6.0, Entering, 0), (high, Leaving, 0)]);
        for (z, inside) in [(2.9, true), (3.0, true), (3.1, false)] {
            let found = events(&plane, along([0.0, 0.0, z], [1.0, 0.0, 0.0]));
            assert_eq!(!found.is_empty(), inside, "{z}");
            assert!(!inside || found == [(low, Entering, 0), (high, Leaving, 0)]);
        }
    }

    #[test]
    fn a_line_within_a_face_or_an_edge_of_a_box_is_inside() {
        let cube = AxisBox::new(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)).unwrap();
        let through = |origin| events(&cube, along(origin, [0.0, 0.0, 1.0]));
        let whole = [(1.0, Entering, 4), (4.0, Leaving, 5)];
        for origin in [[0.5, 1.0, -1.0], [0.0, 1.0, -1.0], [1.0, 2.0, -1.0], [-0.0, 2.0, -1.0]] {
            assert_eq!(through(origin), whole, "{origin:?}");
        }
        for origin in [[-1e-300, 1.0, -1.0], [1.0, 2.0000001, -1.0]] {
            assert_eq!(through(origin), [], "{origin:?}");
        }
        // Only a corner, only an edge: nothing between enter and leave.
        assert_eq!(events(&cube, along([-1.0, 1.0, 0.0], [1.0, -1.0, 0.0])), []);
        assert_eq!(events(&cube, along([-1.0, 1.0, 1.0], [1.0, -1.0, 0.0])), []);
        assert_eq!(events(&cube, along([0.5; 3], [0.0; 3])), []);
    }

    #[test]
    fn a_sphere_is_met_exactly_and_its_tangent_is_not() {
        let ball = Sphere::new(DVec3::new(1.0, 2.0, 3.0), 2.0).unwrap();
        let chord = events(&ball, along([1.0, 2.0, -10.0], [0.0, 0.0, 2.0]));
        assert_eq!(chord, [(5.5, Entering, 0), (7.5, Leaving, 0)]);
        assert_eq!(events(&ball, along([3.0, 2.0, -10.0], [0.0, 0.0, 1.0])), []);
        assert_eq!(events(&ball, along([3.5, 2.0, -10.0], [0.0, 0.0, 1.0])), []);
        assert_eq!(events(&ball, along([1.0, 2.0, 3.0], [0.0; 3])), []);
    }

    /// b² - 4ac of this sphere is the difference of numbers near 1e22, known to 1e6.
    #[test]
    fn a_small_sphere_far_away_keeps_its_size() {
        let ball = Sphere::new(DVec3::new(0.0, 0.0, 1e11), 0.5).unwrap();
        let chord = events(&ball, along([0.3, 0.0, 0.0], [0.0, 0.0, 1.0]));
        assert!((chord[1].0 - chord[0].0 - 0.8).abs() < 1e-4, "{chord:?}");
    }

    #[test]
    fn numbers_that_make_no_shape_are_refused() {
        assert_eq!(Plane::new(DVec3::ZERO, 1.0).unwrap_err().field, "normal");
        assert_eq!(Plane::new(DVec3::NAN, 1.0).unwrap_err().field, "normal");
        assert_eq!(Plane::new(DVec3::X, f64::INFINITY).unwrap_err().field, "distance");
        assert_eq!(Plane::new(DVec3::X * 1e-20, 1e20).unwrap_err().field, "distance");
        assert_eq!(AxisBox::new(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)).unwrap_err().field, "max");
        assert_eq!(AxisBox::new(DVec3::NAN, DVec3::ONE).unwrap_err().field, "min");
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Sphere::new(DVec3::ZERO, radius).unwrap_err().field, "radius");
        }
    }

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-3.0f64..3.0).prop_map(DVec3::from_array)
    }

    proptest! {
        /// Between entering and leaving a line is inside, elsewhere outside, and normals face out.
        #[test]
        fn events_are_where_a_line_changes_sides(origin in point(), to in point(), t in -3.0f64..3.0) {
            let plane = Plane::new(DVec3::new(1.0, -2.0, 0.3), 0.4).unwrap();
            let cube = AxisBox::new(DVec3::new(-1.0, -0.5, -2.0), DVec3::new(0.5, 1.0, 1.5)).unwrap();
            let ball = Sphere::new(DVec3::new(0.2, -0.3, 0.5), 1.4).unwrap();
            let ray = Ray { origin, direction: to - origin };
            prop_assume!(ray.direction.length() > 1e-3);
            let solids: [&dyn Solid; 3] = [&plane, &cube, &ball];
            for (i, solid) in solids.into_iter().enumerate() {
                let contains = |p| [plane.contains(p), cube.contains(p), ball.contains(p)][i];
                let mut found = Vec::new();
                solid.events(&ray, &mut found);
                prop_assert!(found.is_empty() || found.len() == 2);
                let inside = found.len() == 2 && (found[0].t..found[1].t).contains(&t);
                if found.iter().all(|e| (e.t - t).abs() > 1e-9) {
                    prop_assert_eq!(inside, contains(ray.origin + ray.direction * t));
                }
                for e in found.iter().filter(|e| e.t.is_finite()) {
                    let n = solid.normal(e.surface, ray.origin + ray.direction * e.t);
                    let against = n.dot(ray.direction) < 0.0;
                    prop_assert_eq!(against, e.crossing == Entering);
                    prop_assert!((n.length() - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}
