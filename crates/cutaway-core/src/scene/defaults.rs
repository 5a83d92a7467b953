//! What a scene has unless it says otherwise.

use glam::DVec3;

use crate::camera::Camera;
use crate::space::WorldFrame;
use crate::volume::Volume;

/// The unit distance that a scene has unless it says otherwise: the mean voxel spacing, in world units.
pub fn default_unit_distance(volume: &Volume) -> f64 {
    volume.spacing().element_sum() / 3.0
}

/// The view of a volume that nobody asked for another one of: all of it, from the front, a little from the side and
/// from above. Front is the patient's where the file tells, else the side of small y. `aspect`: width / height.
pub fn default_camera(volume: &Volume, aspect: f64) -> Camera {
    let forward = match volume.geometry().frame {
        WorldFrame::Ras => DVec3::new(0.42, -0.85, -0.25),
        WorldFrame::Unknown => DVec3::new(0.42, 0.85, -0.3),
    };
    Camera::framing(&volume.corners_in_world(), forward, DVec3::Z, aspect, 1.05)
}
