//! The camera of a scene: options over the scene file over the default view.

use cutaway_core::camera::Camera;
use cutaway_core::defaults::{FramedView, Look, default_view};
use cutaway_core::scene::{RenderSettings, default_camera};
use cutaway_io::scene_file::SceneFile;

use super::Origins;
use crate::args::CameraArgs;
use crate::report::wrong_use;
use crate::values::shown;

/// The camera, and the box that it frames where it is a default view.
pub(super) fn camera(
    args: &CameraArgs,
    file: Option<&SceneFile>,
    look: &Look<'_>,
    settings: &RenderSettings,
    origins: &Origins,
) -> anyhow::Result<FramedView> {
    let aspect = f64::from(settings.resolution[0]) / f64::from(settings.resolution[1]);
    let in_file = file.and_then(|file| file.camera.clone()).filter(|_| args.view.is_none());
    let placed = args.camera_position.is_some() && args.camera_focal_point.is_some();
    let FramedView { mut camera, visible } = match in_file {
        Some(camera) => FramedView { camera, visible: None },
        // Of the default view nothing but the direction that is up is used.
        None if placed && args.view.is_none() => {
            FramedView { camera: default_camera(look.volume, aspect), visible: None }
        }
        None => default_view(look, args.view, aspect),
    };
    place(&mut camera, args)?;
    turn(&mut camera, args, origins)?;
    Ok(FramedView { camera, visible })
}

/// Puts the camera where options say.
fn place(camera: &mut Camera, args: &CameraArgs) -> anyhow::Result<()> {
    if let Some(p) = &args.camera_position {
        camera.position = p.exactly("--camera-position")?;
    }
    if let Some(p) = &args.camera_focal_point {
        camera.focal_point = p.exactly("--camera-focal-point")?;
    }
    if let Some(p) = &args.camera_view_up {
        camera.view_up = p.exactly("--camera-view-up")?;
    }
    camera.view_angle = args.camera_view_angle.unwrap_or(camera.view_angle);
    camera.orthographic = args.camera_orthographic.or(camera.orthographic);
    Ok(())
}

/// Turns and zooms it from there.
fn turn(camera: &mut Camera, args: &CameraArgs, origins: &Origins) -> anyhow::Result<()> {
    if [args.azimuth, args.elevation, args.roll, args.zoom].iter().all(Option::is_none) {
        return Ok(());
    }
    // Turning a camera without a direction would make NaN of it.
    camera.validate().map_err(|e| origins.blame(&e.into()))?;
    camera.azimuth(args.azimuth.unwrap_or(0.0).to_radians());
    camera.elevation(args.elevation.unwrap_or(0.0).to_radians());
    camera.roll(args.roll.unwrap_or(0.0).to_radians());
    let zoom = args.zoom.unwrap_or(1.0);
    if zoom <= 0.0 {
        return Err(wrong_use(format!("--zoom is {}; expected a factor above 0", shown(zoom))));
    }
    camera.zoom(zoom);
    if camera.validate().is_err() {
        return Err(wrong_use(format!(
            "--zoom is {}; with it the angle of view is no longer between 0 and 180 degrees",
            shown(zoom)
        )));
    }
    Ok(())
}
