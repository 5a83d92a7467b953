//! Small scenes that every renderer is tried on.

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DAffine3, DMat3, DVec3, UVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Layer, RenderSettings, Scene};
use cutaway_core::space::WorldFrame;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume};

/// Width and height of small test images: odd, so that no tile or packet is full at the border.
pub const SMALL: [u32; 2] = [67, 45];

/// A point of a transfer function.
pub fn point(value: f64, color: [f64; 3], opacity: f64) -> ControlPoint {
    ControlPoint { value, color, opacity }
}

/// A soft transfer function over a range: transparent below a fifth, a translucent shell, then denser.
pub fn soft(range: [f64; 2]) -> TransferFunction {
    let at = |share: f64| range[0] + share * (range[1] - range[0]);
    TransferFunction::new(vec![
        point(at(0.2), [0.2, 0.3, 0.9], 0.0),
        point(at(0.4), [0.9, 0.5, 0.3], 0.15),
        point(at(0.6), [0.9, 0.9, 0.5], 0.05),
        point(at(0.9), [1.0, 1.0, 1.0], 0.5),
    ])
    .expect("ordered points")
}

/// A scene of a volume seen from a side, framed.
pub fn framed(
    volume: &Volume,
    function: &TransferFunction,
    lighting: Lighting,
    settings: RenderSettings,
) -> Scene {
    let aspect = f64::from(settings.resolution[0]) / f64::from(settings.resolution[1]);
    let camera =
        Camera::framing(&volume.corners_in_world(), DVec3::new(0.4, 0.8, -0.3), DVec3::Z, aspect, 1.05);
    Scene::new(Layer::new(volume.clone(), function).with_lighting(lighting), camera, settings)
        .expect("a valid scene")
}

/// A volume of one value.
pub fn uniform(dimensions: UVec3, value: f32, spacing: DVec3) -> Volume {
    let voxels = vec![value; (dimensions.x * dimensions.y * dimensions.z) as usize];
    Volume::new(dimensions, voxels, Rescale::IDENTITY, Geometry::from_spacing(spacing))
        .expect("a valid volume")
}

/// Band-limited noise as unsigned 16-bit voxels on an oblique, anisotropic, sheared, left-handed grid.
pub fn oblique_noise(dimensions: UVec3, seed: u32) -> Volume {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    let waves: Vec<(DVec3, f64)> = (0..12)
        .map(|_| {
            (
                DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 1.6,
                random() * std::f64::consts::TAU,
            )
        })
        .collect();
    let mut voxels = Vec::new();
    for k in 0..dimensions.z {
        for j in 0..dimensions.y {
            for i in 0..dimensions.x {
                let p = UVec3::new(i, j, k).as_dvec3();
                let sum: f64 = waves.iter().map(|(w, phase)| (w.dot(p) + phase).sin()).sum();
                voxels.push((sum / 12.0 * 20_000.0 + 30_000.0) as u16);
            }
        }
    }
    let columns =
        DMat3::from_cols(DVec3::new(-0.9, 0.1, 0.2), DVec3::new(0.2, 1.1, -0.1), DVec3::new(0.3, 0.0, 2.1));
    let world_from_voxel = DAffine3 { matrix3: columns, translation: DVec3::new(-40.0, 12.0, 7.0) };
    let geometry = Geometry { world_from_voxel, frame: WorldFrame::Ras };
    Volume::new(dimensions, voxels, Rescale { slope: -0.25, intercept: 100.0 }, geometry)
        .expect("a valid volume")
}
