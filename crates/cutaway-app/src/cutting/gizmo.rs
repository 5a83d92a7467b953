//! Dragging an object by handles in the picture.
//!
//! Enters: where the object is (a [`Frame`]), how it is seen (a [`Lens`]), where the pointer was pressed and is. Leaves: which
//! handle that was ([`Frame::pick`]) and what to do to the object in the world ([`Drag::motion`]). A drag is a function of
//! its first and its last point alone, so that it neither drifts nor remembers.

mod drag;
mod pick;
#[cfg(test)]
mod tests;

pub use drag::{Drag, Snap};
pub use pick::is_near_half;

use cutaway_core::glam::{DAffine3, DVec2, DVec3};

use super::lens::Lens;
use super::numbers::rotation_and_triangle;

/// Lengths of handles in units of the picture (points).
pub mod lengths {
    /// Where an arrow begins, from the middle.
    pub const ARROW_FROM: f64 = 20.0;
    /// Where it ends.
    pub const ARROW_TO: f64 = 84.0;
    /// The middle of a box that scales along an axis.
    pub const SCALE_BOX: f64 = 102.0;
    /// The nearer sides of the square of a plane.
    pub const SQUARE_FROM: f64 = 24.0;
    /// Its farther sides.
    pub const SQUARE_TO: f64 = 38.0;
    /// Radius of a ring around an axis.
    pub const RING: f64 = 64.0;
    /// Radius of the ring around the view.
    pub const VIEW_RING: f64 = 118.0;
    /// Half the side of the box in the middle.
    pub const MIDDLE: f64 = 9.0;
}

/// A part of the gizmo that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Handle {
    /// Moves along an axis.
    Axis(usize),
    /// Moves in the plane across an axis.
    Plane(usize),
    /// Turns around an axis.
    Ring(usize),
    /// Turns around the direction of view.
    ViewRing,
    /// Scales, the same along all axes.
    Scale,
    /// Scales along one of the object's own axes.
    ScaleAxis(usize),
}

impl Handle {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Axis(0),
        Self::Axis(1),
        Self::Axis(2),
        Self::Plane(0),
        Self::Plane(1),
        Self::Plane(2),
        Self::Ring(0),
        Self::Ring(1),
        Self::Ring(2),
        Self::ViewRing,
        Self::Scale,
        Self::ScaleAxis(0),
        Self::ScaleAxis(1),
        Self::ScaleAxis(2),
    ];
}

/// Which axes handles go along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// Those of the world.
    #[default]
    World,
    /// The object's own, made square where it leans.
    Object,
}

/// Where the gizmo is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its middle, in the world: that of the object.
    pub center: DVec3,
    /// Unit vectors along which the object is moved and around which it is turned.
    pub axes: [DVec3; 3],
    /// Unit vectors along which it is scaled: always its own, so that scaling does not make it lean.
    pub scale_axes: [DVec3; 3],
}

impl Frame {
    /// Around an object with this transform, whose middle is there.
    pub fn new(center: DVec3, world_from_object: &DAffine3, axes: Axes) -> Self {
        let own = rotation_and_triangle(&world_from_object.matrix3).0;
        let own = if own.is_finite() { [own.x_axis, own.y_axis, own.z_axis] } else { DVec3::AXES };
        Self { center, axes: if axes == Axes::World { DVec3::AXES } else { own }, scale_axes: own }
    }

    /// World units a point of the picture at its middle; none where that is behind the eye.
    pub fn point_size(&self, lens: &Lens) -> Option<f64> {
        lens.size_at(self.center)
    }

    /// The normal of a ring, in the world.
    pub fn ring_normal(&self, handle: Handle, lens: &Lens) -> Option<DVec3> {
        match handle {
            Handle::Ring(axis) => Some(self.axes[axis]),
            Handle::ViewRing => Some(lens.direction_to(self.center)),
            _ => None,
        }
    }

    /// A circle around the middle, in the world, as points of it; the last is the first again.
    pub fn circle(&self, normal: DVec3, radius: f64, parts: usize) -> Vec<DVec3> {
        let (right, up) = normal.any_orthonormal_pair();
        let point = |i: usize| {
            let (sin, cos) = (i as f64 / parts as f64 * std::f64::consts::TAU).sin_cos();
            self.center + (right * cos + up * sin) * radius
        };
        (0..=parts).map(point).collect()
    }

    /// The corners of the square of a plane, in the world.
    pub fn square(&self, across: usize, point_size: f64) -> [DVec3; 4] {
        let (u, v) = (self.axes[(across + 1) % 3], self.axes[(across + 2) % 3]);
        let (near, far) = (lengths::SQUARE_FROM * point_size, lengths::SQUARE_TO * point_size);
        [(near, near), (far, near), (far, far), (near, far)].map(|(a, b)| self.center + u * a + v * b)
    }

    /// Whether a handle can be used as it is seen now: no axis end on, no plane edge on.
    pub fn is_usable(&self, handle: Handle, lens: &Lens) -> bool {
        let forward = lens.direction_to(self.center);
        let end_on = |axis: DVec3| axis.dot(forward).abs() > 0.97;
        match handle {
            Handle::Axis(axis) => !end_on(self.axes[axis]),
            Handle::ScaleAxis(axis) => !end_on(self.scale_axes[axis]),
            Handle::Plane(axis) => self.axes[axis].dot(forward).abs() > 0.15,
            Handle::Ring(_) | Handle::ViewRing | Handle::Scale => true,
        }
    }

    /// The handle under a point of the picture.
    pub fn pick(&self, lens: &Lens, point: DVec2) -> Option<Handle> {
        pick::pick(self, lens, point)
    }
}
