//! The rays of a frame on the host: where they begin, and where the world lies in the image's clip space.

use cutaway_core::camera::{PixelPlane, RayGenerator};
use cutaway_core::glam::{DMat4, DVec3, DVec4};
use cutaway_core::scene::Scene;

use super::lattice::Lattice;

/// The points of rays from which distances along them are measured: a plane in front of the eye, near the volume's middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayPlane {
    pub(crate) rays: RayGenerator,
    /// Of the plane before the camera, in world units.
    pub(crate) depth: f64,
    /// One a pixel, in the world.
    pub(crate) points: PixelPlane,
    /// Half the volume's diagonal, in world units.
    pub(crate) radius: f64,
}

impl RayPlane {
    /// Of an image of so many pixels, or of the lattice that a scene casts.
    pub(crate) fn new(scene: &Scene, size: [u32; 2]) -> Self {
        let corners = scene.volume().corners_in_world();
        let radius = 0.5 * corners[0].distance(corners[7]);
        let rays = rays_of(scene, size);
        // In front of the eye, wherever that is: the plane's points may lie before or behind the volume's middle.
        let depth = rays.depth_of(scene.volume().center_in_world()).max(radius);
        Self { rays, depth, points: rays.plane(depth), radius }
    }
}

/// The rays of an image of this size, or of the lattice that a scene casts, of which this is the size.
pub(crate) fn rays_of(scene: &Scene, size: [u32; 2]) -> RayGenerator {
    let lattice = Lattice::of(scene);
    if lattice.spacing > 1 && lattice.size == size {
        let (width, height) = scene.resolution();
        return scene.camera().rays(width, height).every(lattice.spacing);
    }
    scene.camera().rays(size[0], size[1])
}

/// How far the middle of an image is from the camera's axis along x and y of its clip space, in halves of its size: none
/// but of a lattice, whose last pixels may lie beyond the border of the image.
pub(crate) fn off_axis(rays: &RayGenerator, [width, height]: [u32; 2]) -> [f64; 2] {
    let plane = rays.plane(1.0);
    let middle =
        |first: f64, per_pixel: f64, pixels: u32| (1.0 - 2.0 * first / per_pixel) / f64::from(pixels) - 1.0;
    let axes = rays.axes();
    // The point of the axis at depth 1 is where a pixel's would be if it lay half an image from the corner.
    let first = plane.first - rays.on_axis(1.0);
    let x = middle(first.dot(axes.right), plane.per_x.length(), width);
    let y = middle(-first.dot(axes.up), plane.per_y.length(), height);
    [x, -y]
}

/// To the clip space of an image. `far`: a depth that nothing to be drawn is behind.
///
/// Only what is behind the eye is clipped: where depth in clip space is negative, or w.
pub(crate) fn clip_from_world(scene: &Scene, [width, height]: [u32; 2], far: f64) -> DMat4 {
    let camera = scene.camera();
    let rays = rays_of(scene, [width, height]);
    let plane = rays.plane(1.0);
    let half = |per_pixel: DVec3, pixels: u32| 0.5 * per_pixel.length() * f64::from(pixels);
    let (axes, position) = (rays.axes(), DVec3::from_array(camera.position));
    let row = |axis: DVec3| axis.extend(-axis.dot(position));
    let x = row(axes.right) / half(plane.per_x, width);
    let y = row(axes.up) / half(plane.per_y, height);
    let depth = row(axes.forward) / far;
    let w = if rays.eye().is_some() { depth } else { DVec4::W };
    let scale = if rays.eye().is_some() { far } else { 1.0 };
    let [off_x, off_y] = off_axis(&rays, [width, height]);
    let rows = [x / scale + w * off_x, y / scale + w * off_y, 0.5 * depth, w];
    DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
}

/// In single precision, as shaders compute.
pub(crate) fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}
