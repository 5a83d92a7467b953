//! Volumes with missing values, seen along z, and how much of their images is covered.

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, NanMeaning, Rescale, Volume};

use crate::scenes::point;

/// Voxels along x, y and z: a square of 8 x 8 cells, seen along z.
const SIZE: UVec3 = UVec3::new(9, 9, 3);

/// Which voxels are missing, by x and y.
pub type Holes = fn(u32, u32) -> bool;

/// The column in the middle: it touches 2 x 2 of the cells.
pub fn middle(x: u32, y: u32) -> bool {
    [x, y] == [4, 4]
}

/// All around: the outer ring of cells is missing, 6 x 6 are left.
pub fn border(x: u32, y: u32) -> bool {
    [x, y].iter().any(|v| *v == 0 || *v == 8)
}

/// Where there is a value, it is 1 to 2; opaque everywhere from 0.5 on.
///
/// # Panics
/// Never: the volume and the scene are valid.
pub fn scene(holes: Holes, meaning: NanMeaning, mode: Mode, shade: bool) -> Scene {
    let value = |i: u32| {
        let (x, y) = (i % SIZE.x, i / SIZE.x % SIZE.y);
        if holes(x, y) { f32::NAN } else { 1.0 + f32::from((x + y) as u8) / 16.0 }
    };
    let voxels: Vec<f32> = (0..SIZE.element_product()).map(value).collect();
    let geometry = Geometry::from_spacing(DVec3::ONE);
    let volume = Volume::new(SIZE, voxels, Rescale::IDENTITY, geometry).expect("a valid volume");
    let function =
        TransferFunction::new(vec![point(0.5, [0.2; 3], 1.0), point(2.0, [1.0; 3], 1.0)]).expect("points");
    let camera = Camera {
        position: [4.0, 4.0, -40.0],
        focal_point: [4.0, 4.0, 1.0],
        view_up: [0.0, 1.0, 0.0],
        view_angle: Camera::VIEW_ANGLE,
        orthographic: Some(4.0),
    };
    let iso = if mode == Mode::Iso { vec![1.5] } else { Vec::new() };
    let settings = RenderSettings { mode, iso, resolution: [80, 80], ..RenderSettings::default() };
    let lighting = Lighting { shade, ..Lighting::default() };
    let layer = Layer::new(volume.with_nan(meaning), &function).with_lighting(lighting);
    Scene::new(layer, camera, settings).expect("a valid scene")
}

/// How many units of area are covered; the whole image has 64.
pub fn covered(image: &Image) -> f64 {
    image.pixels().iter().filter(|p| p[3] > 0.5).count() as f64 / 100.0
}
