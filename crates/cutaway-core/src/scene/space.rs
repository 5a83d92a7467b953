//! The unit of length and the origin of a scene's coordinates.

use glam::{DAffine3, DMat3, DVec3};

use crate::camera::Camera;
use crate::volume::Volume;

/// The smallest spacing and the slope of values may have binary exponents of minus this to this.
pub(super) const ORDINARY_EXPONENT: f64 = 16.0;

/// The volume may be so many of its diagonals away from the origin.
const ORDINARY_DISTANCE: f64 = 4096.0;

/// Where a scene's coordinates are in the world: `world = unit * scene + origin`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSpace {
    /// World units of one unit of length of the scene; a power of two.
    pub unit: f64,
    /// World position of the scene's origin.
    pub origin: DVec3,
}

impl SceneSpace {
    /// The world itself.
    pub const WORLD: Self = Self { unit: 1.0, origin: DVec3::ZERO };

    pub(super) fn of(volume: &Volume) -> Self {
        let exponent = volume.spacing().min_element().log2().floor();
        let unit = if exponent.abs() > ORDINARY_EXPONENT { exponent.exp2() } else { 1.0 };
        let corners = volume.corners_in_world().map(|p| p / unit);
        let center = volume.center_in_world();
        let diagonal = corners[0].distance(corners[7]);
        let far = (center / unit).length() > ORDINARY_DISTANCE * diagonal;
        Self { unit, origin: if far { center } else { DVec3::ZERO } }
    }

    /// From positions in the world to positions in the scene.
    pub fn scene_from_world(&self) -> DAffine3 {
        let translation = -self.origin / self.unit;
        DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(self.unit.recip())), translation }
    }

    pub(super) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        ((DVec3::from_array(p) - self.origin) / self.unit).to_array()
    }

    pub(super) fn camera(&self, camera: &Camera) -> Camera {
        Camera {
            position: self.point(camera.position),
            focal_point: self.point(camera.focal_point),
            orthographic: camera.orthographic.map(|half| half / self.unit),
            ..camera.clone()
        }
    }

    pub(super) fn affine(&self, world_from_voxel: &DAffine3) -> DAffine3 {
        let m = world_from_voxel.matrix3;
        DAffine3 {
            matrix3: DMat3::from_cols(m.x_axis / self.unit, m.y_axis / self.unit, m.z_axis / self.unit),
            translation: (world_from_voxel.translation - self.origin) / self.unit,
        }
    }
}
