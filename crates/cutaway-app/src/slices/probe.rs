//! What is at a point: value, place, voxel; and the point of the volume that a ray shows.

use cutaway_core::camera::{Camera, Ray};
use cutaway_core::field;
use cutaway_core::glam::DVec3;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::volume::Volume;

use crate::document::Document;

/// What is at a point of the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Where it is in the world.
    pub point: DVec3,
    /// The nearest voxel.
    pub voxel: [u32; 3],
    /// The interpolated value there, in the volume's units.
    pub value: f64,
}

impl Probe {
    /// What is at a point of the world; none outside the volume.
    pub fn at(volume: &Volume, point: DVec3) -> Option<Self> {
        let p = volume.voxel_from_world().transform_point3(point);
        let inside = p.cmpge(DVec3::splat(-0.5)).all() && p.cmple(volume.extent() + 0.5).all();
        inside.then(|| {
            let p = p.clamp(DVec3::ZERO, volume.extent());
            let voxel = p.round().as_uvec3().to_array();
            Self { point, voxel, value: field::value(volume, p) }
        })
    }

    /// It as a line.
    pub fn text(&self, unit: &str) -> String {
        let Self { point: p, voxel: [i, j, k], value } = self;
        format!("{value:.4}   {:.1} {:.1} {:.1} {unit}   voxel {i} {j} {k}", p.x, p.y, p.z)
    }
}

/// The first point of a ray at which the opacity passes a half; none where it does not.
pub fn pick(document: &Document, ray: &Ray) -> Option<DVec3> {
    let volume = document.volume().lattice();
    // A picture of one pixel, along the ray.
    let size = volume.spacing().min_element() * 1e-3;
    let up = ray.direction.any_orthonormal_vector();
    let mut state = document.state().clone();
    state.camera = Camera {
        position: ray.origin.to_array(),
        focal_point: (ray.origin + ray.direction).to_array(),
        view_up: up.to_array(),
        view_angle: Camera::VIEW_ANGLE,
        orthographic: Some(size),
    };
    // Light changes no depth.
    state.lighting = Lighting { shade: false, ..state.lighting };
    state.settings.blur = 0.0;
    let clip = document.clip();
    let scene = state.scene(&document.volume().data, clip.as_ref(), [1, 1]).ok()?;
    let depth = reference::render(&scene).depth_at(0, 0)?;
    depth.is_finite().then(|| ray.origin + ray.direction * f64::from(depth))
}

/// Two points and how far apart they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    points: [Option<DVec3>; 2],
}

impl Measure {
    /// Takes the next point: the first, the second, or the first of another measure.
    pub fn take(&mut self, point: DVec3) {
        self.points = match self.points {
            [Some(first), None] => [Some(first), Some(point)],
            _ => [Some(point), None],
        };
    }

    /// The points that were taken.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        self.points.into_iter().flatten()
    }

    /// World units from one to the other.
    pub fn length(&self) -> Option<f64> {
        let [first, second] = self.points;
        Some(first?.distance(second?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{OpenVolume, SceneState, Solids};
    use cutaway_core::glam::UVec3;
    use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
    use cutaway_core::volume::{Geometry, Rescale};
    use cutaway_io::scene_file::VolumeReference;
    use std::sync::Arc;

    /// A cube whose value is its z, opaque from 10 on.
    fn document() -> Document {
        let voxels: Vec<f32> = (0..21u32.pow(3)).map(|i| (i / 441) as f32).collect();
        let volume =
            Volume::new(UVec3::splat(21), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
                .unwrap();
        let point = |value, opacity| ControlPoint { value, color: [1.0; 3], opacity };
        let mut state = SceneState::of_volume(&volume);
        let points = vec![point(10.0, 0.0), point(10.0, 1.0)];
        state.function = TransferFunction::new(points).unwrap();
        let open = Arc::new(OpenVolume::new(volume, VolumeReference::Path("test".to_owned())));
        Document::new(open, state, Solids::default(), None)
    }

    #[test]
    fn a_ray_is_picked_where_it_becomes_opaque() {
        let document = document();
        for (origin, direction) in [
            (DVec3::new(7.0, 9.0, -30.0), DVec3::Z),
            (DVec3::new(2.0, 3.0, -5.0), DVec3::new(0.3, 0.2, 1.0).normalize()),
        ] {
            let found = pick(&document, &Ray { origin, direction }).unwrap();
            // The most opaque is one in a million that passes, a unit deep: a half is ln 2 / ln 1e6 below the surface.
            assert!((10.0..10.051).contains(&found.z), "{found}");
        }
        let beside = Ray { origin: DVec3::new(-7.0, 9.0, -30.0), direction: DVec3::Z };
        assert_eq!(pick(&document, &beside), None);
    }

    #[test]
    fn values_are_found_where_they_are() {
        let document = document();
        let volume = document.volume().lattice();
        let probe = Probe::at(volume, DVec3::new(3.2, 4.7, 6.25)).unwrap();
        assert_eq!((probe.voxel, probe.value), ([3, 5, 6], 6.25));
        assert_eq!(Probe::at(volume, DVec3::new(3.0, 4.0, 21.0)), None);
    }

    #[test]
    fn a_third_point_begins_another_measure() {
        let mut measure = Measure::default();
        measure.take(DVec3::ZERO);
        assert_eq!(measure.length(), None);
        measure.take(DVec3::new(3.0, 4.0, 0.0));
        assert_eq!(measure.length(), Some(5.0));
        measure.take(DVec3::ONE);
        assert_eq!((measure.length(), measure.points().count()), (None, 1));
    }
}
