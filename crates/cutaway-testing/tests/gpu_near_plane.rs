//! A camera that flies through a hollow ball: outside, on the volume's face, inside, in the wall, in the cavity. What lies
//! before the eye is cut away by the eye itself, and nothing behind it shows. The reference says what is right.

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::compare::compare;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, SpaceSkipping};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_testing::engines::raycast;
use cutaway_testing::gpus::{best, there_is_an_adapter};
use cutaway_testing::scenes::point;
use libtest_mimic::{Arguments, Failed, Trial};

/// At a quarter of a voxel, as `tolerances::STEPPED`.
const LARGEST_RMSE: f64 = 0.002;

/// Of depths that are there, the share that may be off by more than half a voxel: at a rim, and where opacity only just
/// passes one half.
const LARGEST_SHARE_OFF: f64 = 0.02;

const SIZE: [u32; 2] = [101, 67];

/// Where the eye is, in voxels along the way in from the middle of a face, and its name.
const EYES: [(&str, f64); 9] = [
    ("far outside", -400.0),
    ("outside", -20.0),
    ("just before the face", -1e-4),
    ("on the face", 0.0),
    ("just behind the face", 1e-4),
    ("before the wall", 3.0),
    ("in the wall", 7.5),
    ("in the cavity", 17.0),
    ("behind it all", 45.0),
];

fn main() {
    let arguments = Arguments::from_args();
    let there = there_is_an_adapter();
    let trials = EYES.map(|(name, depth)| {
        let test = name.replace(' ', "_");
        Trial::test(test, move || fly_to(name, depth)).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

/// Dense between two radii, in a box with more room along z.
fn hollow_ball() -> Volume {
    let dimensions = UVec3::new(34, 34, 46);
    let center = (dimensions.as_dvec3() - 1.0) * 0.5;
    let mut voxels = Vec::new();
    for k in 0..dimensions.z {
        for j in 0..dimensions.y {
            for i in 0..dimensions.x {
                let r = (UVec3::new(i, j, k).as_dvec3() - center).length();
                // 1 in the middle of the wall, 0 four voxels away, and smooth: a ridge would need a finer step.
                let wall = ((r - 10.0).abs() / 4.0).min(1.0) * std::f64::consts::FRAC_PI_2;
                voxels.push((wall.cos().powi(2) * 60_000.0) as u16);
            }
        }
    }
    let geometry = Geometry::from_spacing(DVec3::new(1.0, 1.0, 0.8));
    let rescale = Rescale { slope: 1.0 / 60_000.0, intercept: 0.0 };
    Volume::new(dimensions, voxels, rescale, geometry).expect("a valid volume")
}

/// The eye at a depth behind the face of small y, looking inwards and, unless it is far off, a little aside.
fn eye_at(volume: &Volume, depth: f64) -> Camera {
    let mut position = volume.center_in_world();
    position.y = depth;
    let aside = position + DVec3::new(0.15, 1.0, 0.1);
    let focal_point = if depth < -100.0 { volume.center_in_world() } else { aside };
    Camera {
        position: position.to_array(),
        focal_point: focal_point.to_array(),
        view_up: [0.0, 0.0, 1.0],
        // Far off, what can be seen is as small as that.
        view_angle: if depth < -100.0 { 6.0 } else { 80.0 },
        orthographic: None,
    }
}

fn scene(volume: &Volume, mode: Mode, camera: Camera, space_skipping: SpaceSkipping) -> Scene {
    let function = TransferFunction::new(vec![
        point(0.1, [0.2, 0.4, 0.9], 0.0),
        point(0.6, [0.9, 0.6, 0.3], 0.2),
        point(1.0, [1.0, 1.0, 0.9], 0.4),
    ]);
    let settings = RenderSettings {
        mode,
        iso: if mode == Mode::Iso { vec![0.3, 0.8] } else { vec![] },
        iso_opacity: if mode == Mode::Iso { 0.6 } else { 1.0 },
        step: 0.25,
        resolution: SIZE,
        space_skipping,
        ..RenderSettings::default()
    };
    let function = function.expect("ordered points");
    // Where the wall is thickest, normals turn over within a voxel: light would need a finer step, except on surfaces.
    let lighting = Lighting { shade: mode == Mode::Iso, ..Lighting::default() };
    Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings)
        .expect("a valid scene")
}

fn fly_to(name: &str, depth: f64) -> Result<(), Failed> {
    let renderer = best()?;
    let volume = hollow_ball();
    for mode in [Mode::Composite, Mode::Iso, Mode::Mip] {
        let expected = reference::render(&scene(&volume, mode, eye_at(&volume, depth), SpaceSkipping::Auto));
        for space_skipping in [SpaceSkipping::Auto, SpaceSkipping::Off] {
            let what = format!("{name}, {}, skipping {space_skipping:?}", mode.name());
            let scene = scene(&volume, mode, eye_at(&volume, depth), space_skipping);
            let image = raycast(&scene, &renderer).0;
            let c = compare(&expected, &image)?;
            if c.exceeds(LARGEST_RMSE) {
                return Err(format!("{what}: {c}; at most {LARGEST_RMSE}").into());
            }
            if mode != Mode::Mip {
                depths_agree(&what, &expected, &image)?;
            }
        }
    }
    // From behind it all there is nothing to see.
    let seen =
        reference::render(&scene(&volume, Mode::Composite, eye_at(&volume, depth), SpaceSkipping::Auto));
    let seen = seen.pixels().iter().any(|p| p[3] > 0.1);
    if seen == (depth > 40.0) { Err("the camera is not where it should be".into()) } else { Ok(()) }
}

fn depths_agree(
    what: &str,
    expected: &cutaway_core::image::Image,
    actual: &cutaway_core::image::Image,
) -> Result<(), Failed> {
    let (Some(expected), Some(actual)) = (expected.depth(), actual.depth()) else {
        return Err("there are no depths".into());
    };
    let pairs = || expected.iter().zip(actual).filter(|(a, b)| a.is_finite() || b.is_finite());
    let off = pairs().filter(|(a, b)| a.is_finite() != b.is_finite() || (**a - **b).abs() > 0.5).count();
    if off as f64 > LARGEST_SHARE_OFF * pairs().count() as f64 {
        return Err(format!("{what}: {off} of {} depths are off", pairs().count()).into());
    }
    // Nothing is seen that lies behind the eye.
    if let Some(behind) = actual.iter().find(|d| **d < 0.0) {
        return Err(format!("{what}: something is seen at {behind}").into());
    }
    Ok(())
}
