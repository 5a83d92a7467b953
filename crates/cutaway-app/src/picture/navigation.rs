//! Moving the camera: what drags, scrolls and keys in the picture do to it.
//!
//! All of it is functions of a camera, tested without a window. The focal point is what the camera turns about.

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DQuat, DVec3};
use cutaway_core::space::WorldFrame;
use cutaway_core::volume::Volume;

/// Radians that the camera turns while the pointer crosses the picture's height.
const TURN: f64 = std::f64::consts::PI;

/// The view angles that zooming stays within, in degrees.
const ANGLES: [f64; 2] = [0.05, 150.0];

/// Turns the camera about its focal point as if the volume were pushed by the pointer: `[across, down]` in heights of the
/// picture. There is no pole: the view's own axes turn along.
pub fn orbit(camera: &mut Camera, [across, down]: [f64; 2]) {
    let axes = camera.axes();
    let turn =
        DQuat::from_axis_angle(axes.up, -across * TURN) * DQuat::from_axis_angle(axes.right, -down * TURN);
    let focal = DVec3::from_array(camera.focal_point);
    camera.position = (focal + turn * (DVec3::from_array(camera.position) - focal)).to_array();
    camera.view_up = (turn * axes.up).to_array();
}

/// Turns the camera about the view's axis, by an angle in radians.
pub fn roll(camera: &mut Camera, angle: f64) {
    camera.roll(angle);
}

/// World units a height of the picture, at the focal point.
pub fn height_at_focus(camera: &Camera) -> f64 {
    let distance = DVec3::from_array(camera.position).distance(DVec3::from_array(camera.focal_point));
    let slope = (camera.view_angle.to_radians() * 0.5).tan();
    2.0 * camera.orthographic.unwrap_or(slope * distance)
}

/// Moves camera and focal point so that what is at the focal point's depth follows the pointer: `[across, down]` in
/// heights of the picture.
pub fn pan(camera: &mut Camera, [across, down]: [f64; 2]) {
    let axes = camera.axes();
    let by = (axes.up * down - axes.right * across) * height_at_focus(camera);
    camera.position = (DVec3::from_array(camera.position) + by).to_array();
    camera.focal_point = (DVec3::from_array(camera.focal_point) + by).to_array();
}

/// Comes nearer by a factor above 1, or goes back by one below: what is at `at` (from the picture's middle, in heights of
/// it, right and down) at the focal point's depth stays where it is.
pub fn zoom(camera: &mut Camera, factor: f64, at: [f64; 2]) {
    if !(factor > 0.0 && factor.is_finite()) {
        return;
    }
    let before = camera.clone();
    let focal = DVec3::from_array(camera.focal_point);
    let height = height_at_focus(camera);
    match &mut camera.orthographic {
        Some(half) => *half /= factor,
        None => {
            let offset = DVec3::from_array(camera.position) - focal;
            camera.position = (focal + offset / factor).to_array();
        }
    }
    // The point under the pointer moved away from the middle by the factor: the camera follows it.
    let axes = camera.axes();
    let under = (axes.right * at[0] - axes.up * at[1]) * height;
    let by = under * (1.0 - 1.0 / factor);
    camera.position = (DVec3::from_array(camera.position) + by).to_array();
    camera.focal_point = (focal + by).to_array();
    if camera.validate().is_err() || height_at_focus(camera) < 1e-9 {
        *camera = before;
    }
}

/// Moves the eye and what it looks at along the view: into the volume, where the near plane cuts it open.
/// `by` is in distances between eye and focal point.
pub fn fly(camera: &mut Camera, by: f64) {
    let (position, focal) = (DVec3::from_array(camera.position), DVec3::from_array(camera.focal_point));
    let step = (focal - position) * by;
    camera.position = (position + step).to_array();
    camera.focal_point = (focal + step).to_array();
}

/// Narrows the angle of view by a factor, as a longer lens does.
pub fn narrow(camera: &mut Camera, factor: f64) {
    match &mut camera.orthographic {
        Some(half) => *half /= factor,
        None => camera.view_angle = (camera.view_angle / factor).clamp(ANGLES[0], ANGLES[1]),
    }
}

/// Between perspective and orthographic: what is at the focal point's depth keeps its size.
pub fn toggle_orthographic(camera: &mut Camera) {
    camera.orthographic = match camera.orthographic {
        Some(_) => {
            let half = height_at_focus(camera) * 0.5;
            let focal = DVec3::from_array(camera.focal_point);
            let slope = (camera.view_angle.to_radians() * 0.5).tan();
            camera.position = (focal - camera.axes().forward * (half / slope)).to_array();
            None
        }
        None => Some(height_at_focus(camera) * 0.5),
    };
}

/// A direction that a volume is commonly seen from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From the front (A), or from small y.
    Anterior,
    /// From the back (P), or from large y.
    Posterior,
    /// From the patient's left (L), or from small x.
    Left,
    /// From the patient's right (R), or from large x.
    Right,
    /// From above (S), or from large z.
    Superior,
    /// From below (I), or from small z.
    Inferior,
}

impl StandardView {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Anterior, Self::Posterior, Self::Left, Self::Right, Self::Superior, Self::Inferior];

    /// What it is called where directions are those of a patient, or not.
    pub fn name(self, frame: WorldFrame) -> &'static str {
        let anatomic = frame == WorldFrame::Ras;
        match self {
            Self::Anterior => {
                if anatomic {
                    "anterior"
                } else {
                    "from -y"
                }
            }
            Self::Posterior => {
                if anatomic {
                    "posterior"
                } else {
                    "from +y"
                }
            }
            Self::Left => {
                if anatomic {
                    "left"
                } else {
                    "from -x"
                }
            }
            Self::Right => {
                if anatomic {
                    "right"
                } else {
                    "from +x"
                }
            }
            Self::Superior => {
                if anatomic {
                    "superior"
                } else {
                    "from +z"
                }
            }
            Self::Inferior => {
                if anatomic {
                    "inferior"
                } else {
                    "from -z"
                }
            }
        }
    }

    /// Into the picture, and up, in the world. A patient's left is -x in the world of RAS, front is +y.
    fn directions(self, frame: WorldFrame) -> [DVec3; 2] {
        let front = if frame == WorldFrame::Ras { -DVec3::Y } else { DVec3::Y };
        match self {
            Self::Anterior => [front, DVec3::Z],
            Self::Posterior => [-front, DVec3::Z],
            Self::Left => [DVec3::X, DVec3::Z],
            Self::Right => [-DVec3::X, DVec3::Z],
            // Radiologists look from the feet: anterior is up in both.
            Self::Superior => [-DVec3::Z, -front],
            Self::Inferior => [DVec3::Z, -front],
        }
    }

    /// The camera that sees the whole volume from there; perspective or not as `like` is.
    pub fn camera(self, volume: &Volume, aspect: f64, like: &Camera) -> Camera {
        let [forward, up] = self.directions(volume.geometry().frame);
        let mut camera = Camera::framing(&volume.corners_in_world(), forward, up, aspect, 1.05);
        if like.orthographic.is_some() {
            camera.orthographic = Some(height_at_focus(&camera) * 0.5);
        }
        camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Projection;
    use egui::{Pos2, Rect, Vec2};

    fn camera(orthographic: bool) -> Camera {
        let mut camera = Camera {
            position: [3.0, -9.0, 4.0],
            focal_point: [0.5, 1.0, 0.2],
            view_up: [0.0, 0.1, 1.0],
            view_angle: 35.0,
            orthographic: None,
        };
        if orthographic {
            toggle_orthographic(&mut camera);
        }
        camera
    }

    fn rect() -> Rect {
        Rect::from_min_size(Pos2::new(10.0, 20.0), Vec2::new(400.0, 200.0))
    }

    /// The point at the focal depth under a point of the window.
    fn under(camera: &Camera, at: Pos2) -> DVec3 {
        let ray = Projection::new(camera, rect()).ray(at);
        let (focal, forward) = (DVec3::from_array(camera.focal_point), camera.axes().forward);
        ray.origin + ray.direction * ((focal - ray.origin).dot(forward) / ray.direction.dot(forward))
    }

    #[test]
    fn zooming_keeps_what_is_under_the_pointer() {
        for orthographic in [false, true] {
            for factor in [0.5, 1.3, 4.0] {
                let mut camera = camera(orthographic);
                let at = Pos2::new(123.0, 171.0);
                let before = under(&camera, at);
                let middle = rect().center();
                let from_middle = [(at.x - middle.x) / 200.0, (at.y - middle.y) / 200.0].map(f64::from);
                let height = height_at_focus(&camera);
                zoom(&mut camera, factor, from_middle);
                assert!((height_at_focus(&camera) * factor / height - 1.0).abs() < 1e-9);
                let off = under(&camera, at).distance(before);
                assert!(off < 1e-5, "{off} {orthographic} {factor}");
            }
        }
    }

    #[test]
    fn panning_takes_what_was_grabbed_along() {
        for orthographic in [false, true] {
            let mut camera = camera(orthographic);
            let grabbed = under(&camera, Pos2::new(100.0, 100.0));
            pan(&mut camera, [0.25, -0.1]);
            let off = under(&camera, Pos2::new(150.0, 80.0)).distance(grabbed);
            assert!(off < 1e-5, "{off}");
        }
    }

    #[test]
    fn orbits_keep_the_distance_and_come_round() {
        let mut camera = camera(false);
        let (before, height) = (camera.clone(), height_at_focus(&camera));
        for _ in 0..40 {
            orbit(&mut camera, [0.05, 0.0]);
            assert!((height_at_focus(&camera) - height).abs() < 1e-9);
            camera.validate().unwrap();
        }
        let off = DVec3::from_array(camera.position).distance(DVec3::from_array(before.position));
        assert!(off < 1e-9, "{off}");
    }

    #[test]
    fn the_projection_changes_and_the_size_does_not() {
        let mut camera = camera(false);
        let (before, height) = (camera.clone(), height_at_focus(&camera));
        toggle_orthographic(&mut camera);
        assert!((height_at_focus(&camera) - height).abs() < 1e-9);
        narrow(&mut camera, 2.0);
        narrow(&mut camera, 0.5);
        toggle_orthographic(&mut camera);
        let off = DVec3::from_array(camera.position).distance(DVec3::from_array(before.position));
        assert!(camera.orthographic.is_none() && off < 1e-9);
    }

    #[test]
    fn no_zoom_leaves_a_camera_that_shows_nothing() {
        for orthographic in [false, true] {
            let mut camera = camera(orthographic);
            for factor in [1e300, 0.0, f64::NAN, f64::INFINITY, 1e-300, -1.0] {
                zoom(&mut camera, factor, [0.1, 0.2]);
                camera.validate().unwrap();
            }
        }
    }
}
