//! Reasons for an image that shows nothing.

use std::fmt;

use glam::DVec3;

use super::visible::Look;
use crate::camera::Camera;
use crate::clip::{box_corners, extremes};
use crate::numbers::short;
use crate::scene::{Mode, Scene};
use crate::transfer_function::TransferFunction;

/// The reason for an image that shows nothing. Its text names what is to blame and what was found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum EmptyCause {
    /// The transfer function has no opacity at any value of the volume.
    Function {
        /// Values that the function shows, infinite where it shows all from or up to the other end; none: it shows nothing.
        shown: Option<[f64; 2]>,
        /// Least and greatest value of the volume.
        values: [f64; 2],
    },
    /// No isosurface is within the values of the volume.
    Isosurfaces {
        /// Values of the isosurfaces.
        iso: Vec<f64>,
        /// Least and greatest value of the volume.
        values: [f64; 2],
    },
    /// The clip leaves nothing of the volume.
    Clip {
        /// The volume's box in the world.
        volume: [DVec3; 2],
    },
    /// The clip cuts away all that the transfer function or the isosurfaces show.
    ClipOfVisible {
        /// The box of what could be seen without the clip, in the world.
        visible: [DVec3; 2],
    },
    /// The camera looks elsewhere.
    Camera {
        /// The box of what could be seen, in the world.
        visible: [DVec3; 2],
    },
    /// All that could be seen is too faint.
    Faint {
        /// The largest opacity per unit distance at any value of the volume.
        opacity: f64,
    },
}

/// Returns why the image of a scene shows nothing. Only to be asked where it does: a scene that shows something has a cause
/// of no meaning.
pub fn empty_cause(scene: &Scene) -> EmptyCause {
    let look = Look::of(scene);
    let values = look.volume.value_range();
    let by_values = match look.mode {
        Mode::Iso => no_isosurface(look.iso, values),
        _ => no_opacity(look.function, values),
    };
    if let Some(cause) = by_values {
        return cause;
    }
    let in_world = |corners: [DVec3; 2]| {
        extremes(&box_corners(corners).map(|corner| look.volume.world_from_voxel().transform_point3(corner)))
    };
    let whole = [DVec3::ZERO, look.volume.extent()];
    let kept = Look { mode: Mode::Mean, ..look }.visible_box();
    if kept.is_none() {
        return EmptyCause::Clip { volume: in_world(whole) };
    }
    let Some(visible) = look.visible_box() else {
        let visible = look.unclipped().visible_box().unwrap_or(whole);
        return EmptyCause::ClipOfVisible { visible: in_world(visible) };
    };
    let (width, height) = scene.resolution();
    let corners = box_corners(visible).map(|corner| look.volume.world_from_voxel().transform_point3(corner));
    if misses(scene.camera(), &corners, f64::from(width) / f64::from(height)) {
        return EmptyCause::Camera { visible: in_world(visible) };
    }
    EmptyCause::Faint { opacity: look.function.max_opacity(values[0], values[1]) }
}

fn no_isosurface(iso: &[f64], values: [f64; 2]) -> Option<EmptyCause> {
    let within = iso.iter().any(|iso| (values[0]..=values[1]).contains(iso));
    (!within).then(|| EmptyCause::Isosurfaces { iso: iso.to_vec(), values })
}

fn no_opacity(function: &TransferFunction, values: [f64; 2]) -> Option<EmptyCause> {
    if function.max_opacity(values[0], values[1]) > 0.0 {
        return None;
    }
    Some(EmptyCause::Function { shown: shown_values(function), values })
}

/// The values from the least to the greatest at which a function has opacity.
fn shown_values(function: &TransferFunction) -> Option<[f64; 2]> {
    let points = function.points();
    let first = points.iter().position(|p| p.opacity > 0.0)?;
    let last = points.iter().rposition(|p| p.opacity > 0.0)?;
    let lo = if first == 0 { f64::NEG_INFINITY } else { points[first - 1].value };
    let hi = points.get(last + 1).map_or(f64::INFINITY, |p| p.value);
    Some([lo, hi])
}

/// True if all of these points are on the outer side of one plane of the view: the box that they are the corners of is not
/// in the image.
fn misses(camera: &Camera, corners: &[DVec3; 8], aspect: f64) -> bool {
    let axes = camera.axes();
    let eye = DVec3::from_array(camera.position);
    let slope = (camera.view_angle.to_radians() * 0.5).tan();
    let outside = |side: &dyn Fn(f64, f64, f64, f64) -> bool| {
        corners.iter().all(|corner| {
            let p = *corner - eye;
            let depth = axes.forward.dot(p);
            let half = camera.orthographic.unwrap_or(slope * depth);
            side(axes.right.dot(p), axes.up.dot(p), depth, half)
        })
    };
    outside(&|_, _, depth, _| depth <= 0.0)
        || outside(&|right, _, _, half| right > half * aspect)
        || outside(&|right, _, _, half| right < -half * aspect)
        || outside(&|_, up, _, half| up > half)
        || outside(&|_, up, _, half| up < -half)
}

impl fmt::Display for EmptyCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Function { shown: Some(shown), values } => {
                let (shown, values) = (interval(*shown), range(*values));
                write!(f, "the transfer function shows values {shown}, and the volume has {values}")
            }
            Self::Function { shown: None, .. } => {
                f.write_str("the transfer function has no opacity at any value")
            }
            Self::Isosurfaces { iso, values } => {
                let s = if iso.len() == 1 { "" } else { "s" };
                let iso = iso.iter().map(|v| short(*v)).collect::<Vec<_>>().join(", ");
                let verb = if s.is_empty() { "is" } else { "are" };
                write!(
                    f,
                    "the isosurface{s} {iso} {verb} beyond the values of the volume, {}",
                    range(*values)
                )
            }
            Self::Clip { volume } => {
                write!(
                    f,
                    "the clip (cuts and probes) leaves nothing of the volume, which is {}",
                    corners(volume)
                )
            }
            Self::ClipOfVisible { visible } => {
                write!(
                    f,
                    "the clip (cuts and probes) removes all that could be seen, which is {}",
                    corners(visible)
                )
            }
            Self::Camera { visible } => {
                write!(f, "the camera looks elsewhere; what could be seen is {}", corners(visible))
            }
            Self::Faint { opacity } => {
                write!(f, "all that could be seen is too faint; opacities are at most {}", short(*opacity))
            }
        }
    }
}

fn range([lo, hi]: [f64; 2]) -> String {
    if lo == hi { short(lo) } else { format!("{} to {}", short(lo), short(hi)) }
}

fn interval([lo, hi]: [f64; 2]) -> String {
    match (lo.is_finite(), hi.is_finite()) {
        (true, true) => format!("from {} to {}", short(lo), short(hi)),
        (true, false) => format!("from {} on", short(lo)),
        (false, true) => format!("up to {}", short(hi)),
        (false, false) => "of every size".to_owned(),
    }
}

fn corners([least, most]: &[DVec3; 2]) -> String {
    let text = |p: &DVec3| p.to_array().map(short).join(", ");
    format!("between ({}) and ({})", text(least), text(most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Clip, ClipShading, ObjectId, Sphere};
    use crate::scene::{Layer, RenderSettings, default_camera};
    use crate::transfer_function::ControlPoint;
    use crate::volume::{Geometry, Rescale, Volume};
    use glam::UVec3;
    use std::sync::Arc;

    fn volume() -> Volume {
        let voxels = (0..20 * 20 * 20).map(|i| i16::try_from(i % 20 * 100 - 1000).unwrap()).collect();
        let geometry = Geometry::from_spacing(DVec3::ONE);
        Volume::new(UVec3::splat(20), voxels, Rescale::IDENTITY, geometry).unwrap()
    }

    fn function(points: &[(f64, f64)]) -> TransferFunction {
        let points = points.iter().map(|&(value, opacity)| ControlPoint { value, color: [1.0; 3], opacity });
        TransferFunction::new(points.collect()).unwrap()
    }

    fn cause(
        function: &TransferFunction,
        change: impl Fn(&mut Camera, &mut RenderSettings),
        clip: Option<&Clip>,
    ) -> String {
        let volume = volume();
        let (mut camera, mut settings) = (default_camera(&volume, 1.0), RenderSettings::default());
        change(&mut camera, &mut settings);
        let scene = Scene::new(Layer::new(volume, function), camera, settings).unwrap();
        let scene = match clip {
            Some(clip) => scene.with_clip(clip, ClipShading::default()).unwrap(),
            None => scene,
        };
        empty_cause(&scene).to_string()
    }

    fn probe(at: DVec3, radius: f64) -> Clip {
        Clip::everything().probe(Clip::object(ObjectId(0), Arc::new(Sphere::new(at, radius).unwrap())))
    }

    #[test]
    fn report_54_the_function_is_to_blame() {
        let text = |points: &[(f64, f64)]| cause(&function(points), |_, _| {}, None);
        let on = text(&[(5000.0, 0.0), (9000.0, 1.0)]);
        assert_eq!(on, "the transfer function shows values from 5000 on, and the volume has -1000 to 900");
        let between = text(&[(5000.0, 0.0), (6000.0, 1.0), (7000.0, 0.0)]);
        assert!(between.contains("from 5000 to 7000"), "{between}");
        assert!(text(&[(-3000.0, 1.0), (-2000.0, 0.0)]).contains("up to -2000"));
        assert!(text(&[(0.0, 0.0)]).contains("no opacity at any value"));
    }

    #[test]
    fn report_54_isosurfaces_clips_and_cameras_are_to_blame() {
        let all = function(&[(-2000.0, 0.5)]);
        let iso = |_: &mut Camera, s: &mut RenderSettings| {
            (s.mode, s.iso) = (Mode::Iso, vec![5000.0]);
        };
        let text = cause(&all, iso, None);
        assert_eq!(text, "the isosurface 5000 is beyond the values of the volume, -1000 to 900");
        let text = cause(&all, |_, _| {}, Some(&probe(DVec3::new(900.0, 0.0, 0.0), 20.0)));
        assert!(
            text.starts_with("the clip (cuts and probes) leaves nothing") && text.contains("(19, 19, 19)"),
            "{text}"
        );
        // Values grow along x: a function of the largest ones shows nothing at small x.
        let large = function(&[(800.0, 0.0), (900.0, 1.0)]);
        let text = cause(&large, |_, _| {}, Some(&probe(DVec3::new(4.0, 9.0, 9.0), 4.0)));
        assert!(text.starts_with("the clip (cuts and probes) removes all that could be seen"), "{text}");
        let away = |camera: &mut Camera, _: &mut RenderSettings| {
            camera.focal_point = camera.position.map(|x| 2.0 * x)
        };
        assert!(cause(&all, away, None).starts_with("the camera looks elsewhere"));
        let faint = function(&[(-2000.0, 1e-9)]);
        assert!(cause(&faint, |_, _| {}, None).contains("at most 1e-9"));
    }
}
