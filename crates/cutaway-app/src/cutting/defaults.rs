//! Shapes for a volume that nothing cuts yet, where operands reach to, and fitting them to the volume.

use std::sync::Arc;

use cutaway_core::clip::{
    AxisBox, FitError, Plane, Pose, ShapeError, Solid, Sphere, box_corners, extremes, fit,
};
use cutaway_core::glam::{DAffine3, DVec3};
use cutaway_core::volume::Volume;
use cutaway_io::scene_file::ClipSource;

use super::{Content, CropBox, Cutting, Operand, OperandId};

/// Gives the solid of a source; none where it is not there (yet).
pub type FindSolid<'a> = dyn Fn(&ClipSource) -> Option<Arc<dyn Solid>> + 'a;

/// A shape that needs no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    /// A ball.
    Sphere,
    /// A box along the axes of the world.
    Box,
    /// A half-space.
    Plane,
}

impl Shape {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Sphere, Self::Box, Self::Plane];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Box => "box",
            Self::Plane => "plane",
        }
    }

    /// One that opens the volume where it is seen: `towards` points from the volume to the viewer. A ball in the middle of
    /// the face that is looked at, the nearest eighth, or the nearer half.
    ///
    /// # Errors
    /// A volume so large, or so small, that no shape can be of its size.
    pub fn for_volume(self, volume: &Volume, towards: DVec3) -> Result<ClipSource, ShapeError> {
        let [min, max] = extremes(&volume.corners_in_world());
        let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
        let axis = main_axis(towards);
        let side = if towards[axis] < 0.0 { -1.0 } else { 1.0 };
        let outward = DVec3::AXES[axis] * side;
        match self {
            Self::Sphere => {
                let face = center + outward * half[axis];
                Sphere::new(face, 0.6 * half.min_element()).map(ClipSource::Sphere)
            }
            Self::Box => {
                let corner = center + half * towards.signum();
                AxisBox::new(center.min(corner), center.max(corner)).map(ClipSource::Box)
            }
            Self::Plane => Plane::new(-outward, -outward.dot(center)).map(ClipSource::Plane),
        }
    }
}

/// The axis along which a direction goes most.
pub(super) fn main_axis(direction: DVec3) -> usize {
    let size = direction.abs();
    (1..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best })
}

impl CropBox {
    /// All of a volume.
    pub fn whole(volume: &Volume) -> Self {
        Self { min: DVec3::ZERO, max: volume.extent() }
    }
}

impl Operand {
    /// The corners of all that is in it, in the world: `world_from_list` is from the space of its list. Objects that are
    /// not there, and what has no end, have none.
    fn corners(&self, world_from_list: &DAffine3, find: &FindSolid<'_>, corners: &mut Vec<DVec3>) {
        let world = *world_from_list * *self.pose.world_from_object();
        if let Content::Object(source) = &self.content
            && let Some(solid) = find(source)
        {
            corners.extend(box_corners(solid.bounds()).map(|p| world.transform_point3(p)));
        }
        for operand in self.operands() {
            operand.corners(&world, find, corners);
        }
    }
}

impl Cutting {
    /// The point that an operand turns around, in the world: the middle of its bounds; of what has no end, the point
    /// nearest to `center`, which is the volume's.
    pub fn center(&self, id: OperandId, find: &FindSolid<'_>, center: DVec3) -> Option<DVec3> {
        let operand = self.get(id)?;
        let world_from_list = self.world_from_list_of(id);
        if let Content::Object(ClipSource::Plane(plane)) = &operand.content {
            let world = world_from_list * *operand.pose.world_from_object();
            let here = world.inverse().transform_point3(center);
            let normal = plane.normal();
            let above = (normal.dot(here) - plane.distance()) / normal.length_squared();
            return Some(world.transform_point3(here - normal * above));
        }
        let mut corners = Vec::new();
        operand.corners(&world_from_list, find, &mut corners);
        corners.retain(|p| p.is_finite());
        if corners.is_empty() {
            return Some(center);
        }
        let [min, max] = extremes(&corners);
        Some(0.5 * (min + max))
    }

    /// The pose with which an operand is in the middle of the volume, and as large as it can be there; none where there is
    /// no such operand, or its files are not read.
    ///
    /// # Errors
    /// A half-space, or what has no size.
    pub fn fitted(
        &self,
        id: OperandId,
        find: &FindSolid<'_>,
        volume: &Volume,
    ) -> Result<Option<Pose>, FitError> {
        let Some(operand) = self.get(id) else { return Ok(None) };
        let world_from_list = self.world_from_list_of(id);
        let mut corners = Vec::new();
        operand.corners(&world_from_list, find, &mut corners);
        if corners.is_empty() {
            return Ok(None);
        }
        let fit = fit(&corners, &volume.corners_in_world())?;
        Ok(moved(&operand.pose, &world_from_list, &fit))
    }
}

/// A pose after something was done to it in the world; none where that could not be undone.
pub fn moved(pose: &Pose, world_from_list: &DAffine3, in_world: &DAffine3) -> Option<Pose> {
    let pose = *pose.world_from_object();
    Pose::new(world_from_list.inverse() * *in_world * *world_from_list * pose).ok()
}
