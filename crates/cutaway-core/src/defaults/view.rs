//! Views: the sides from which a volume is looked at, and the camera that frames what can be seen from there.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use super::visible::Look;
use crate::camera::Camera;
use crate::clip::box_corners;
use crate::scene::default_camera;

/// The side from which a volume is looked at. The world is RAS: x to the patient's right, y to the front, z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum View {
    /// The camera looks along -y.
    Front,
    /// Along +y.
    Back,
    /// Along +x.
    Left,
    /// Along -x.
    Right,
    /// Along -z, with +y up in the image.
    Above,
    /// Along +z, with +y up in the image.
    Below,
}

/// A word that is not the name of a view.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not a view; choose from front, back, left, right, above, below")]
pub struct UnknownView {
    /// The word.
    pub name: String,
}

impl View {
    /// Every view.
    pub const ALL: [Self; 6] = [Self::Front, Self::Back, Self::Left, Self::Right, Self::Above, Self::Below];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Above => "above",
            Self::Below => "below",
        }
    }

    /// Returns the direction in which the camera looks, in the world; unit length.
    pub fn forward(self) -> DVec3 {
        match self {
            Self::Front => DVec3::NEG_Y,
            Self::Back => DVec3::Y,
            Self::Left => DVec3::X,
            Self::Right => DVec3::NEG_X,
            Self::Above => DVec3::NEG_Z,
            Self::Below => DVec3::Z,
        }
    }

    /// Returns the direction that is up in the image, in the world; unit length.
    pub fn up(self) -> DVec3 {
        match self {
            Self::Above | Self::Below => DVec3::Y,
            _ => DVec3::Z,
        }
    }
}

impl fmt::Display for View {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for View {
    type Err = UnknownView;

    fn from_str(name: &str) -> Result<Self, UnknownView> {
        let found = Self::ALL.into_iter().find(|view| view.name() == name);
        found.ok_or_else(|| UnknownView { name: name.to_owned() })
    }
}

/// A camera and what it frames.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedView {
    /// The camera.
    pub camera: Camera,
    /// Least and greatest corner of the box that it frames, in voxels; none where nothing is visible and it frames the
    /// whole volume.
    pub visible: Option<[DVec3; 2]>,
}

/// Room around what a view frames: a twentieth.
const MARGIN: f64 = 1.05;

/// Returns the camera that nobody asked for another one of: it frames what can be seen, from `view` or, without one, from the
/// front, a little from the side and from above. `aspect`: width / height of the image.
pub fn default_view(look: &Look<'_>, view: Option<View>, aspect: f64) -> FramedView {
    let whole = default_camera(look.volume, aspect);
    let axes = whole.axes();
    let (forward, up) =
        view.map_or((axes.forward, DVec3::from_array(whole.view_up)), |v| (v.forward(), v.up()));
    let visible = look.visible_box();
    let framed = visible.unwrap_or([DVec3::ZERO, look.volume.extent()]);
    let corners = box_corners(framed).map(|corner| look.volume.world_from_voxel().transform_point3(corner));
    FramedView { camera: Camera::framing(&corners, forward, up, aspect, MARGIN), visible }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mode;
    use crate::transfer_function::{ControlPoint, TransferFunction};
    use crate::volume::{Geometry, Rescale, Volume};
    use glam::UVec3;

    fn volume() -> Volume {
        let voxels = (0..10 * 12 * 14).map(|i| if i % 10 < 4 { 200u8 } else { 0 }).collect();
        let geometry = Geometry::from_spacing(DVec3::ONE);
        Volume::new(UVec3::new(10, 12, 14), voxels, Rescale::IDENTITY, geometry).unwrap()
    }

    fn function(opacity: f64) -> TransferFunction {
        let point = |value, opacity| ControlPoint { value, color: [1.0; 3], opacity };
        TransferFunction::new(vec![point(100.0, 0.0), point(200.0, opacity)]).unwrap()
    }

    #[test]
    fn report_58_views_look_along_the_axes_of_a_body() {
        let (volume, function) = (volume(), function(1.0));
        let look = Look { volume: &volume, function: &function, mode: Mode::Composite, iso: &[], clip: None };
        let right = |view| default_view(&look, Some(view), 1.0).camera.axes().right;
        let expected = [DVec3::NEG_X, DVec3::X, DVec3::NEG_Y, DVec3::Y, DVec3::X, DVec3::NEG_X];
        for (view, expected) in View::ALL.into_iter().zip(expected) {
            assert!(right(view).distance(expected) < 1e-12, "{view}: {}", right(view));
            assert_eq!(view.name().parse(), Ok(view));
        }
        // The front, turned by half a turn, is the back.
        let mut turned = default_view(&look, Some(View::Front), 1.0).camera;
        turned.azimuth(std::f64::consts::PI);
        assert!(turned.axes().forward.distance(View::Back.forward()) < 1e-12);
    }

    #[test]
    fn views_frame_what_is_visible_and_all_where_nothing_is() {
        let (volume, visible, hidden) = (volume(), function(1.0), function(0.0));
        let look = Look { volume: &volume, function: &visible, mode: Mode::Composite, iso: &[], clip: None };
        let framed = default_view(&look, None, 1.0);
        assert_eq!(framed.visible, Some([DVec3::ZERO, DVec3::new(4.0, 11.0, 13.0)]));
        assert_eq!(framed.camera.focal_point, [2.0, 5.5, 6.5]);
        let framed = default_view(&Look { function: &hidden, ..look }, None, 1.5);
        let (found, whole) = (framed.camera, default_camera(&volume, 1.5));
        let apart = DVec3::from_array(found.position).distance(DVec3::from_array(whole.position));
        assert!(framed.visible.is_none() && apart < 1e-9, "{found:?} {whole:?}");
        assert_eq!(found.focal_point, whole.focal_point);
    }
}
