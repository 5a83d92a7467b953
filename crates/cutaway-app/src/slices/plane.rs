//! Planes through a volume, and what lies in them.

use cutaway_core::camera::{Camera, Ray};
use cutaway_core::clip::{FlatClip, SegmentLimit, Sweep};
use cutaway_core::field;
use cutaway_core::glam::DVec3;
use cutaway_core::segment::Segment;
use cutaway_core::space::WorldFrame;
use cutaway_core::volume::Volume;

/// Which way a slice lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Orientation {
    /// Across the patient: z is constant.
    Axial,
    /// Along the forehead: y is constant.
    Coronal,
    /// Along the nose: x is constant.
    Sagittal,
    /// As the camera looks.
    Oblique,
}

impl Orientation {
    /// Those that do not turn with the camera.
    pub const ORTHOGONAL: [Self; 3] = [Self::Axial, Self::Coronal, Self::Sagittal];

    /// What it is called, of a patient or of anything else.
    pub fn name(self, frame: WorldFrame) -> &'static str {
        let anatomic = frame == WorldFrame::Ras;
        match self {
            Self::Axial if anatomic => "axial",
            Self::Coronal if anatomic => "coronal",
            Self::Sagittal if anatomic => "sagittal",
            Self::Axial => "xy",
            Self::Coronal => "xz",
            Self::Sagittal => "yz",
            Self::Oblique => "oblique",
        }
    }

    /// To the right and up in the slice, in the world. Of a patient as radiologists see them: the patient's right is on the
    /// left, the front above in axial and on the left in sagittal slices. Elsewhere axes grow right and up.
    pub fn axes(self, frame: WorldFrame, camera: &Camera) -> [DVec3; 2] {
        let anatomic = frame == WorldFrame::Ras;
        match self {
            Self::Axial if anatomic => [-DVec3::X, DVec3::Y],
            Self::Coronal if anatomic => [-DVec3::X, DVec3::Z],
            Self::Sagittal if anatomic => [-DVec3::Y, DVec3::Z],
            Self::Axial => [DVec3::X, DVec3::Y],
            Self::Coronal => [DVec3::X, DVec3::Z],
            Self::Sagittal => [DVec3::Y, DVec3::Z],
            Self::Oblique => [camera.axes().right, camera.axes().up],
        }
    }
}

/// A rectangle of a plane, divided into square pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The middle of the rectangle, in the world.
    pub center: DVec3,
    /// To the right, unit length.
    pub right: DVec3,
    /// Up, unit length.
    pub up: DVec3,
    /// World units a pixel.
    pub pixel: f64,
    /// Pixels along right and up.
    pub size: [u32; 2],
}

impl Plane {
    /// Out of the plane, towards whoever looks at it.
    pub fn normal(&self) -> DVec3 {
        self.right.cross(self.up)
    }

    /// Where the middle of a pixel is in the world, from the upper left one, fractions allowed.
    pub fn point(&self, [x, y]: [f64; 2]) -> DVec3 {
        let [w, h] = self.size.map(f64::from);
        let across = (x + 0.5 - 0.5 * w) * self.pixel;
        let along = (0.5 * h - y - 0.5) * self.pixel;
        self.center + self.right * across + self.up * along
    }

    /// Which pixel the foot of a point on the plane is in: the inverse of [`Self::point`].
    pub fn pixel_of(&self, p_in_world: DVec3) -> [f64; 2] {
        let offset = (p_in_world - self.center) / self.pixel;
        let [w, h] = self.size.map(f64::from);
        [offset.dot(self.right) + 0.5 * w - 0.5, 0.5 * h - 0.5 - offset.dot(self.up)]
    }

    /// The values in it, row by row from the top; NaN outside the volume.
    pub fn values(&self, volume: &Volume) -> Vec<f32> {
        let to_voxel = volume.voxel_from_world();
        let first = to_voxel.transform_point3(self.point([0.0, 0.0]));
        let per_x = to_voxel.transform_vector3(self.right * self.pixel);
        let per_y = to_voxel.transform_vector3(-self.up * self.pixel);
        let extent = volume.extent();
        // Voxels are half a voxel wide beyond the outermost centres.
        let inside = |p: DVec3| p.cmpge(DVec3::splat(-0.5)).all() && p.cmple(extent + 0.5).all();
        let at = |x: u32, y: u32| {
            let p = first + per_x * f64::from(x) + per_y * f64::from(y);
            if inside(p) { field::value(volume, p.clamp(DVec3::ZERO, extent)) as f32 } else { f32::NAN }
        };
        (0..self.size[1])
            .flat_map(|y| (0..self.size[0]).map(move |x| (x, y)))
            .map(|(x, y)| at(x, y))
            .collect()
    }

    /// Which pixels are kept by a clip, row by row from the top.
    pub fn kept(&self, clip: &FlatClip) -> Vec<bool> {
        let mut sweep = Sweep::new();
        let mut kept = vec![false; (self.size[0] * self.size[1]) as usize];
        let length = f64::from(self.size[0]) * self.pixel;
        let Some(range) = Segment::new(0.0, length) else { return kept };
        for (y, row) in kept.chunks_exact_mut(self.size[0].max(1) as usize).enumerate() {
            let origin = self.point([-0.5, y as f64]);
            let ray = Ray { origin, direction: self.right };
            for segment in sweep.cast(clip, &ray, range, SegmentLimit::default()) {
                // Pixels whose middle is within.
                let first = (segment.segment.t_near() / self.pixel - 0.5).ceil().max(0.0) as usize;
                let end = (segment.segment.t_far() / self.pixel - 0.5).ceil().max(0.0) as usize;
                let end = end.min(row.len());
                if first < end {
                    row[first..end].fill(true);
                }
            }
        }
        kept
    }
}

/// The pixels beside which another is kept, or not kept, unlike them: the outline of a cut.
pub fn outline(kept: &[bool], width: usize) -> Vec<bool> {
    let at = |i: usize| {
        let right = i + 1;
        let below = i + width;
        let beside = !right.is_multiple_of(width) && kept[right] != kept[i];
        beside || (below < kept.len() && kept[below] != kept[i])
    };
    if width == 0 { Vec::new() } else { (0..kept.len()).map(at).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::clip::{Clip, ObjectId, Sphere};
    use cutaway_core::glam::{DAffine3, UVec3};
    use cutaway_core::volume::{Geometry, Rescale};
    use std::sync::Arc;

    /// A volume whose value is x + 10 y + 100 z of the world.
    fn linear() -> Volume {
        let n = 9u32;
        let world_from_voxel =
            DAffine3::from_rotation_z(0.4) * DAffine3::from_scale(DVec3::new(1.0, 2.0, 0.5));
        let at = |i: u32| {
            let p = UVec3::new(i % n, i / n % n, i / n / n).as_dvec3();
            let w = world_from_voxel.transform_point3(p);
            (w.x + 10.0 * w.y + 100.0 * w.z) as f32
        };
        let geometry = Geometry { world_from_voxel, frame: WorldFrame::Unknown };
        let voxels: Vec<f32> = (0..n.pow(3)).map(at).collect();
        Volume::new(UVec3::splat(n), voxels, Rescale::IDENTITY, geometry).unwrap()
    }

    fn plane(volume: &Volume, right: DVec3, up: DVec3) -> Plane {
        Plane { center: volume.center_in_world(), right, up, pixel: 0.3, size: [31, 25] }
    }

    #[test]
    fn a_linear_field_is_found_on_any_plane() {
        let volume = linear();
        let (a, b) = (DVec3::new(1.0, 2.0, 0.5).normalize(), DVec3::new(-0.3, 0.4, 1.0));
        let planes = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (a, (b - a * b.dot(a)).normalize())];
        for (right, up) in planes {
            let plane = plane(&volume, right, up);
            let mut found = 0;
            for (i, value) in plane.values(&volume).into_iter().enumerate() {
                let p = plane.point([(i % 31) as f64, (i / 31) as f64]);
                let in_voxel = volume.voxel_from_world().transform_point3(p);
                // The outermost half voxel repeats what is at its inner side.
                if in_voxel.cmpge(DVec3::ZERO).all() && in_voxel.cmple(volume.extent()).all() {
                    let expected = p.x + 10.0 * p.y + 100.0 * p.z;
                    assert!(
                        (f64::from(value) - expected).abs() < 1e-3 * expected.abs().max(1.0),
                        "{value} {expected}"
                    );
                    found += 1;
                }
            }
            assert!(found > 100, "{found}");
        }
    }

    #[test]
    fn pixels_and_points_are_each_others_inverse() {
        let plane = plane(&linear(), DVec3::Y, DVec3::Z);
        for pixel in [[0.0, 0.0], [30.0, 24.0], [11.25, 3.5]] {
            let back = plane.pixel_of(plane.point(pixel));
            assert!((back[0] - pixel[0]).abs() < 1e-9 && (back[1] - pixel[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_cut_is_outlined_where_it_is() {
        let volume = linear();
        let plane = plane(&volume, DVec3::X, DVec3::Y);
        let sphere = Arc::new(Sphere::new(plane.center, 2.0).unwrap());
        let clip = Clip::everything().cut(Clip::object(ObjectId(0), sphere));
        let kept = plane.kept(&FlatClip::new(&clip).unwrap());
        for (i, kept) in kept.iter().enumerate() {
            let distance = plane.point([(i % 31) as f64, (i / 31) as f64]).distance(plane.center);
            assert_eq!(*kept, distance > 2.0, "{distance}");
        }
        let outline = outline(&kept, 31);
        for (i, on) in outline.iter().enumerate().filter(|(_, on)| **on) {
            let distance = plane.point([(i % 31) as f64, (i / 31) as f64]).distance(plane.center);
            assert!((distance - 2.0).abs() < 0.5 && *on);
        }
        assert!(outline.iter().filter(|on| **on).count() > 20);
    }
}
