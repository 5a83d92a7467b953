//! From the pointer's way to a motion in the world.

use cutaway_core::clip::Pose;
use cutaway_core::glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::{Frame, Handle, lengths};
use crate::cutting::defaults::moved;
use crate::cutting::lens::Lens;

/// The least and the greatest factor of one drag.
const FACTORS: [f64; 2] = [0.01, 100.0];

/// Steps to which a drag keeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snap {
    /// Of a move, in world units.
    pub length: f64,
    /// Of a turn, in radians.
    pub angle: f64,
    /// Of a factor.
    pub factor: f64,
}

impl Snap {
    fn to(value: f64, step: Option<f64>) -> f64 {
        match step.filter(|step| *step > 0.0) {
            Some(step) => (value / step).round() * step,
            None => value,
        }
    }
}

/// A drag of a handle: all but where the pointer is now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Which handle.
    pub handle: Handle,
    /// Where the gizmo was when it was grabbed.
    pub frame: Frame,
    /// Where the object was, in its list.
    pub pose: Pose,
    /// From the space of its list to the world.
    pub world_from_list: DAffine3,
    /// Where the pointer was pressed.
    pub start: DVec2,
}

impl Drag {
    /// The object's pose with the pointer at `to`; none where the handle cannot follow there (beyond the horizon, say), or
    /// where the pose could not be undone.
    pub fn pose(&self, lens: &Lens, to: DVec2, snap: Option<Snap>) -> Option<Pose> {
        moved(&self.pose, &self.world_from_list, &self.motion(lens, to, snap)?)
    }

    /// What is done to the object in the world.
    pub fn motion(&self, lens: &Lens, to: DVec2, snap: Option<Snap>) -> Option<DAffine3> {
        match self.handle {
            Handle::Axis(axis) => self.slide(lens, to, self.frame.axes[axis], snap),
            Handle::Plane(across) => self.shift(lens, to, across, snap),
            Handle::Ring(_) | Handle::ViewRing => self.turn(lens, to, snap),
            Handle::Scale => {
                let way = to - self.start;
                // Right and up is larger; a drag as long as an arrow doubles.
                let factor = ((way.x - way.y) / lengths::ARROW_TO).exp2();
                Some(self.around_center(DMat3::from_diagonal(DVec3::splat(limited(factor, snap)))))
            }
            Handle::ScaleAxis(axis) => self.stretch(lens, to, self.frame.scale_axes[axis], snap),
        }
    }

    /// How far along an axis through the middle the start and the end of the drag are.
    fn along(&self, lens: &Lens, to: DVec2, axis: DVec3) -> Option<[f64; 2]> {
        let center = self.frame.center;
        Some([lens.along_line(self.start, center, axis)?, lens.along_line(to, center, axis)?])
    }

    fn slide(&self, lens: &Lens, to: DVec2, axis: DVec3, snap: Option<Snap>) -> Option<DAffine3> {
        let [from, to] = self.along(lens, to, axis)?;
        let way = Snap::to(to - from, snap.map(|s| s.length));
        self.near_enough(lens, axis * way)
    }

    fn shift(&self, lens: &Lens, to: DVec2, across: usize, snap: Option<Snap>) -> Option<DAffine3> {
        let normal = self.frame.axes[across];
        let on_plane = |point| lens.on_plane(point, self.frame.center, normal);
        let way = on_plane(to)? - on_plane(self.start)?;
        let (u, v) = (self.frame.axes[(across + 1) % 3], self.frame.axes[(across + 2) % 3]);
        let step = snap.map(|s| s.length);
        self.near_enough(lens, u * Snap::to(way.dot(u), step) + v * Snap::to(way.dot(v), step))
    }

    /// A translation, unless it leads so far towards the horizon that a point of the picture is a hundred times as large
    /// there.
    fn near_enough(&self, lens: &Lens, way: DVec3) -> Option<DAffine3> {
        let (here, there) = (lens.size_at(self.frame.center)?, lens.size_at(self.frame.center + way)?);
        (there <= 100.0 * here).then(|| DAffine3::from_translation(way))
    }

    fn turn(&self, lens: &Lens, to: DVec2, snap: Option<Snap>) -> Option<DAffine3> {
        let normal = self.frame.ring_normal(self.handle, lens)?;
        let angle = if normal.dot(lens.direction_to(self.frame.center)).abs() > 0.2 {
            self.angle_in_plane(lens, to, normal)?
        } else {
            self.angle_edge_on(lens, to, normal)?
        };
        let rotation = DQuat::from_axis_angle(normal, Snap::to(angle, snap.map(|s| s.angle)));
        Some(self.around_center(DMat3::from_quat(rotation)))
    }

    /// The angle in the ring's plane between where the rays through both points meet it.
    fn angle_in_plane(&self, lens: &Lens, to: DVec2, normal: DVec3) -> Option<f64> {
        let center = self.frame.center;
        let spoke = |point| Some(lens.on_plane(point, center, normal)? - center);
        let (from, to) = (spoke(self.start)?, spoke(to)?);
        Some(normal.dot(from.cross(to)).atan2(from.dot(to)))
    }

    /// Of a ring that is seen edge on the pointer pulls a string that is wound around it.
    fn angle_edge_on(&self, lens: &Lens, to: DVec2, normal: DVec3) -> Option<f64> {
        let center = self.frame.center;
        // The ring's point nearest to the viewer moves this way.
        let tangent = normal.cross(-lens.direction_to(center));
        let image = lens.image_of_line(center, tangent)?;
        Some((to - self.start).dot(image.direction) / lengths::RING)
    }

    fn stretch(&self, lens: &Lens, to: DVec2, axis: DVec3, snap: Option<Snap>) -> Option<DAffine3> {
        let [from, to] = self.along(lens, to, axis)?;
        let factor = limited(to / from, snap);
        // Stretches by `factor` along the axis: I + (factor - 1) a aᵀ.
        let a = axis * (factor - 1.0);
        let outer = DMat3::from_cols(a * axis.x, a * axis.y, a * axis.z);
        Some(self.around_center(DMat3::IDENTITY + outer))
    }

    fn around_center(&self, matrix: DMat3) -> DAffine3 {
        let center = self.frame.center;
        DAffine3 { matrix3: matrix, translation: center - matrix * center }
    }
}

/// A factor above 0.
fn limited(factor: f64, snap: Option<Snap>) -> f64 {
    let [least, most] = FACTORS;
    let step = snap.map(|s| s.factor);
    let factor = if factor.is_nan() { 1.0 } else { factor.clamp(least, most) };
    Snap::to(factor, step).clamp(step.unwrap_or(least).max(least), most)
}
