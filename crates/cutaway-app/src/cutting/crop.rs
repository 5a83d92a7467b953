//! Dragging the crop box by its faces and corners, and trimming it by a rectangle in the picture.
//!
//! The box is one of voxels, so it is as oblique as the volume is. A face keeps to its axis; a corner moves parallel to the
//! picture, and takes three faces along.

#[cfg(test)]
mod tests;

use cutaway_core::camera::Ray;
use cutaway_core::glam::{DAffine3, DVec2, DVec3};
use cutaway_core::volume::Volume;

use super::CropBox;
use super::defaults::main_axis;
use super::lens::Lens;

/// The least that is left along an axis, in voxels.
pub const LEAST: f64 = 1.0;

/// How near to a handle the pointer must be, in points.
const REACH: f64 = 9.0;

/// A part of the crop box that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CropHandle {
    /// The middle of a face: of small (`false`) or large indices along an axis.
    Face {
        /// Which axis.
        axis: usize,
        /// Which end of it.
        high: bool,
    },
    /// A corner: bit `axis` says whether it is at the large index.
    Corner(u8),
}

impl CropHandle {
    /// All of them: corners first, as they are nearer to the eye's idea of a box.
    pub fn all() -> impl Iterator<Item = Self> {
        let corners = (0..8).map(Self::Corner);
        let faces = (0..6).map(|i| Self::Face { axis: i / 2, high: i % 2 == 1 });
        corners.chain(faces)
    }

    /// Where it is, in voxel space.
    pub fn in_voxel(self, crop: &CropBox) -> DVec3 {
        let ends = [crop.min, crop.max];
        match self {
            Self::Corner(bits) => {
                DVec3::from_array(std::array::from_fn(|axis| ends[usize::from(bits >> axis & 1)][axis]))
            }
            Self::Face { axis, high } => {
                let mut middle = 0.5 * (crop.min + crop.max);
                middle[axis] = ends[usize::from(high)][axis];
                middle
            }
        }
    }

    /// What it is called.
    pub fn name(self) -> String {
        match self {
            Self::Corner(_) => "crop corner".to_owned(),
            Self::Face { axis, high } => {
                format!("crop {} {}", ["x", "y", "z"][axis], if high { "max" } else { "min" })
            }
        }
    }
}

/// Where the box is and how it is seen.
#[derive(Clone, Copy, Debug)]
pub struct CropFrame {
    /// The volume's own.
    pub world_from_voxel: DAffine3,
    /// The largest index along each axis.
    pub extent: DVec3,
}

impl CropFrame {
    /// Of a volume.
    pub fn new(volume: &Volume) -> Self {
        Self { world_from_voxel: *volume.world_from_voxel(), extent: volume.extent() }
    }

    /// Where a handle is, in the world.
    pub fn in_world(&self, crop: &CropBox, handle: CropHandle) -> DVec3 {
        self.world_from_voxel.transform_point3(handle.in_voxel(crop))
    }

    /// The handle under a point of the picture: of those in reach the one nearest to the viewer.
    pub fn pick(&self, crop: &CropBox, lens: &Lens, point: DVec2) -> Option<CropHandle> {
        let in_reach = CropHandle::all().filter_map(|handle| {
            let world = self.in_world(crop, handle);
            let far = (lens.point(world)? - point).length();
            let depth = (world - lens.ray(point).origin).dot(lens.forward());
            (far <= REACH && self.is_usable(crop, lens, handle)).then_some((handle, depth))
        });
        in_reach.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(handle, _)| handle)
    }

    /// Whether a handle can be dragged as it is seen now: a face whose axis is seen end on cannot.
    pub fn is_usable(&self, crop: &CropBox, lens: &Lens, handle: CropHandle) -> bool {
        match handle {
            CropHandle::Corner(_) => true,
            CropHandle::Face { axis, .. } => {
                let direction = self.world_from_voxel.matrix3.col(axis).normalize_or_zero();
                direction.dot(lens.direction_to(self.in_world(crop, handle))).abs() < 0.97
            }
        }
    }

    /// The box when a handle of `before` is dragged from one point of the picture to another; none where it cannot follow
    /// there.
    pub fn drag(
        &self,
        before: &CropBox,
        handle: CropHandle,
        lens: &Lens,
        [from, to]: [DVec2; 2],
    ) -> Option<CropBox> {
        let at = self.in_world(before, handle);
        let mut crop = *before;
        match handle {
            CropHandle::Face { axis, high } => {
                let direction = self.world_from_voxel.matrix3.col(axis);
                let way = lens.along_line(to, at, direction)? - lens.along_line(from, at, direction)?;
                self.move_face(&mut crop, axis, high, way);
            }
            CropHandle::Corner(bits) => {
                let on_plane = |point| lens.on_plane(point, at, lens.forward());
                let way = on_plane(to)? - on_plane(from)?;
                let way = self.world_from_voxel.matrix3.inverse() * way;
                for axis in 0..3 {
                    self.move_face(&mut crop, axis, bits >> axis & 1 == 1, way[axis]);
                }
            }
        }
        Some(crop)
    }

    /// Moves a face, within the volume and not past the one opposite.
    fn move_face(&self, crop: &mut CropBox, axis: usize, high: bool, way: f64) {
        let extent = self.extent[axis];
        let least = LEAST.min(extent);
        if high {
            let lowest = (crop.min[axis] + least).min(extent);
            crop.max[axis] = (crop.max[axis] + way).clamp(lowest, extent);
        } else {
            let highest = (crop.max[axis] - least).max(0.0);
            crop.min[axis] = (crop.min[axis] + way).clamp(0.0, highest);
        }
    }

    /// The axis of the volume that looks most at the viewer, and whether its face of large indices does.
    pub fn facing(&self, crop: &CropBox, lens: &Lens) -> (usize, bool) {
        let middle = self.world_from_voxel.transform_point3(0.5 * (crop.min + crop.max));
        let towards = -lens.direction_to(middle);
        // Normals of faces, which in a sheared grid are not its axes.
        let normals = self.world_from_voxel.matrix3.inverse().transpose();
        let look =
            DVec3::from_array([0, 1, 2].map(|axis| normals.col(axis).normalize_or_zero().dot(towards)));
        let axis = main_axis(look);
        (axis, look[axis] > 0.0)
    }

    /// The box trimmed by a rectangle in the picture, between two opposite corners; none where nothing of the box would be
    /// left, or nothing of it is trimmed.
    ///
    /// The rule: of the axes of the volume one looks most at the viewer, and of the two faces across it one is nearer. The
    /// rays through the rectangle's four corners meet the plane of that face (where the eye is behind it: of the other
    /// one). Along the two other axes, what is beyond the least and the greatest of those four points is trimmed; along
    /// the axis that looks at the viewer nothing is, so what is kept is a shaft straight into the volume.
    pub fn trim(&self, crop: &CropBox, lens: &Lens, [a, b]: [DVec2; 2]) -> Option<CropBox> {
        let (axis, high) = self.facing(crop, lens);
        let ends = if high { [crop.max, crop.min] } else { [crop.min, crop.max] };
        let corners = [a, DVec2::new(a.x, b.y), b, DVec2::new(b.x, a.y)];
        let voxel_from_world = self.world_from_voxel.inverse();
        let met = ends.iter().find_map(|end| {
            let on_face =
                |point| on_plane_of_axis(&lens.ray(point), &voxel_from_world, axis, end[axis], lens);
            let [p, q, r, s] = corners.map(on_face);
            Some([p?, q?, r?, s?])
        })?;
        let mut trimmed = *crop;
        for other in (0..3).filter(|other| *other != axis) {
            let values = met.map(|p| p[other]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min);
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
            trimmed.min[other] = crop.min[other].max(low);
            trimmed.max[other] = crop.max[other].min(high);
            let least = LEAST.min(crop.max[other] - crop.min[other]);
            if trimmed.max[other] - trimmed.min[other] < least {
                return None;
            }
        }
        (trimmed != *crop).then_some(trimmed)
    }
}

/// Where a ray is at an index along an axis, in voxel space.
fn on_plane_of_axis(
    ray: &Ray,
    voxel_from_world: &DAffine3,
    axis: usize,
    index: f64,
    lens: &Lens,
) -> Option<DVec3> {
    let origin = voxel_from_world.transform_point3(ray.origin);
    let direction = voxel_from_world.transform_vector3(ray.direction);
    let t = (index - origin[axis]) / direction[axis];
    let met = origin + direction * t;
    (met.is_finite() && (t > 0.0 || lens.is_orthographic())).then_some(met)
}
