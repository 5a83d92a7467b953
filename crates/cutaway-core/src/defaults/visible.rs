//! The part of a volume that can be seen: its occupied blocks under the transfer function, the mode and the clip.

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use crate::camera::Ray;
use crate::clip::{FlatClip, SegmentLimit, Sweep};
use crate::scene::{Mode, Scene};
use crate::segment::Segment;
use crate::transfer_function::TransferFunction;
use crate::value_ranges::BlockGrid;
use crate::volume::Volume;

/// Blocks along the longest side of the volume, about: enough that half a block is less than the margin of a view.
const BLOCKS: u32 = 96;

/// Opacity per unit distance below which a block counts as empty, as a share of the largest in the volume: haze is not what
/// an image is about.
const HAZE: f64 = 0.02;

/// Rays per side of a row of blocks that look for what a clip leaves of it.
const RAYS: u32 = 2;

/// What decides on the part of a volume that can be seen.
#[derive(Clone, Copy, Debug)]
pub struct Look<'a> {
    /// The volume.
    pub volume: &'a Volume,
    /// What its values look like.
    pub function: &'a TransferFunction,
    /// What a ray makes of the values along it.
    pub mode: Mode,
    /// Values of isosurfaces, for [`Mode::Iso`].
    pub iso: &'a [f64],
    /// What is shown of the volume; none: all of it.
    pub clip: Option<&'a FlatClip>,
}

impl<'a> Look<'a> {
    /// The look of a scene.
    pub fn of(scene: &'a Scene) -> Self {
        Self {
            volume: scene.volume(),
            function: scene.transfer_function(),
            mode: scene.settings().mode,
            iso: &scene.settings().iso,
            clip: scene.clip(),
        }
    }

    /// The same without a clip.
    pub(super) fn unclipped(self) -> Self {
        Self { clip: None, ..self }
    }

    /// Returns the smallest box of blocks that holds everything visible, in voxels: its least and greatest corner. None
    /// where nothing is visible.
    pub fn visible_box(&self) -> Option<[DVec3; 2]> {
        let edge = (self.volume.dimensions().max_element() / BLOCKS).clamp(2, 8);
        let ranges = BlockGrid::of_values(self.volume, edge);
        let d = ranges.dimensions;
        let least = self.least_opacity();
        let rows = 0..d.y * d.z;
        let found = rows.into_par_iter().filter_map(|row| {
            let (y, z) = (row % d.y, row / d.y);
            let mut occupied: Vec<bool> =
                (0..d.x).map(|x| self.is_occupied(ranges.get(UVec3::new(x, y, z)), least)).collect();
            if let Some(clip) = self.clip.filter(|_| occupied.contains(&true)) {
                let kept = self.kept(clip, edge, (y, z), d.x);
                occupied.iter_mut().zip(kept).for_each(|(occupied, kept)| *occupied &= kept);
            }
            let first = occupied.iter().position(|o| *o)? as u32;
            let last = occupied.iter().rposition(|o| *o)? as u32;
            Some([UVec3::new(first, y, z), UVec3::new(last, y, z)])
        });
        let [least, most] = found.reduce_with(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        let corner = |block: UVec3| (block * edge).as_dvec3().min(self.volume.extent());
        Some([corner(least), corner(most + UVec3::ONE)])
    }

    /// The opacity from which on a block counts.
    fn least_opacity(&self) -> f64 {
        let [lo, hi] = self.volume.value_range();
        HAZE * self.function.max_opacity(lo, hi)
    }

    fn is_occupied(&self, stored: [f32; 2], least: f64) -> bool {
        let [a, b] = stored.map(|v| self.volume.rescale().value(f64::from(v)));
        let (lo, hi) = (a.min(b), a.max(b));
        match self.mode {
            Mode::Iso => self.iso.iter().any(|iso| (lo..=hi).contains(iso)),
            // A mean of values may be one that no voxel has: all that is not cut away counts.
            Mode::Mean => true,
            Mode::Composite | Mode::Mip | Mode::Minip => {
                let opacity = self.function.max_opacity(lo, hi);
                opacity > 0.0 && opacity >= least
            }
        }
    }

    /// Which blocks of a row along x the clip leaves something of, as far as a few rays along the row meet it.
    fn kept(&self, clip: &FlatClip, edge: u32, (y, z): (u32, u32), blocks: u32) -> Vec<bool> {
        let mut kept = vec![false; blocks as usize];
        let mut sweep = Sweep::new();
        let to_world = self.volume.world_from_voxel();
        let along = to_world.transform_vector3(DVec3::X);
        let (voxel, extent) = (along.length(), self.volume.extent());
        let Some(range) = Segment::new(0.0, extent.x * voxel) else { return kept };
        for ray in 0..RAYS * RAYS {
            let inside = |block: u32, ray: u32, end: f64| {
                let at = f64::from(block) + (f64::from(ray) + 0.5) / f64::from(RAYS);
                (at * f64::from(edge)).min(end)
            };
            let (at_y, at_z) = (inside(y, ray % RAYS, extent.y), inside(z, ray / RAYS, extent.z));
            let origin = to_world.transform_point3(DVec3::new(0.0, at_y, at_z));
            let ray = Ray { origin, direction: along / voxel };
            for segment in sweep.cast(clip, &ray, range, SegmentLimit::default()) {
                let block = |t: f64| ((t / voxel / f64::from(edge)) as usize).min(kept.len() - 1);
                let (first, last) = (block(segment.segment.t_near()), block(segment.segment.t_far()));
                kept[first..=last].fill(true);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Clip, ObjectId, Sphere};
    use crate::transfer_function::ControlPoint;
    use crate::volume::{Geometry, Rescale};
    use std::sync::Arc;

    /// A cube of 32 voxels in a corner of 96, the value 200 in the value 0, with spacing 2.
    fn corner() -> Volume {
        let d = UVec3::splat(96);
        let inside = |i: u32, from: u32| (from..from + 32).contains(&i);
        let voxel = |i: u32| {
            let (x, y, z) = (i % 96, i / 96 % 96, i / 96 / 96);
            if inside(x, 56) && inside(y, 8) && inside(z, 56) { 200u8 } else { 0 }
        };
        let voxels = (0..d.element_product()).map(voxel).collect();
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::splat(2.0))).unwrap()
    }

    fn ramp() -> TransferFunction {
        let point = |value, opacity| ControlPoint { value, color: [1.0; 3], opacity };
        TransferFunction::new(vec![point(50.0, 0.0), point(200.0, 0.5)]).unwrap()
    }

    fn look<'a>(volume: &'a Volume, function: &'a TransferFunction) -> Look<'a> {
        Look { volume, function, mode: Mode::Composite, iso: &[], clip: None }
    }

    #[test]
    fn the_box_is_that_of_what_is_visible() {
        let (volume, function) = (corner(), ramp());
        let [lo, hi] = look(&volume, &function).visible_box().unwrap();
        let (least, most) = (DVec3::new(56.0, 8.0, 56.0), DVec3::new(87.0, 39.0, 87.0));
        assert!(lo.cmple(least).all() && hi.cmpge(most).all(), "{lo} {hi}");
        assert!(
            (lo - least).abs().max_element() <= 4.0 && (hi - most).abs().max_element() <= 4.0,
            "{lo} {hi}"
        );
        let iso = Look { mode: Mode::Iso, iso: &[100.0], ..look(&volume, &function) };
        assert_eq!(iso.visible_box(), Some([lo, hi]));
        let nothing = Look { iso: &[300.0], ..iso };
        assert_eq!(nothing.visible_box(), None);
    }

    #[test]
    fn what_is_cut_away_does_not_count() {
        let (volume, function) = (corner(), ramp());
        let sphere = |at: DVec3, radius| {
            let solid = Arc::new(Sphere::new(at, radius).unwrap());
            FlatClip::new(&Clip::everything().probe(Clip::object(ObjectId(0), solid))).unwrap()
        };
        // In world units: the middle of the cube is at voxel (71.5, 23.5, 71.5).
        let within = sphere(DVec3::new(143.0, 47.0, 143.0), 16.0);
        let [lo, hi] = Look { clip: Some(&within), ..look(&volume, &function) }.visible_box().unwrap();
        assert!((hi - lo).max_element() <= 16.0 + 4.0 && (hi - lo).min_element() >= 14.0, "{lo} {hi}");
        let elsewhere = sphere(DVec3::new(900.0, 0.0, 0.0), 20.0);
        assert_eq!(Look { clip: Some(&elsewhere), ..look(&volume, &function) }.visible_box(), None);
    }
}
