//! The scalar field of a volume: trilinear interpolation and its gradient, in f64.
//!
//! This is the meaning that every kernel approximates. Positions are in voxel space, within the volume's box.

use glam::DVec3;

use crate::volume::Volume;

/// The cell that holds a position, and the position within it (0..=1 along each axis). The last cell of an axis holds
/// its far face.
#[inline]
pub fn cell_of(volume: &Volume, p_in_voxel: DVec3) -> ([i64; 3], DVec3) {
    let last = volume.extent() - 1.0;
    let cell = p_in_voxel.floor().min(last).max(DVec3::ZERO);
    ([cell.x as i64, cell.y as i64, cell.z as i64], p_in_voxel - cell)
}

/// Interpolates corner values (x fastest) at a position within their cell.
#[inline]
pub fn trilinear(corners: &[f64; 8], f: DVec3) -> f64 {
    let lerp = |a: f64, b: f64, w: f64| a + (b - a) * w;
    let x = |c: usize| lerp(corners[c], corners[c + 1], f.x);
    lerp(lerp(x(0), x(2), f.y), lerp(x(4), x(6), f.y), f.z)
}

/// Values at the corners of a cell, x fastest.
#[inline]
pub fn corner_values(volume: &Volume, cell: [i64; 3]) -> [f64; 8] {
    let [i, j, k] = cell;
    std::array::from_fn(|c| {
        volume.value_clamped(i + (c as i64 & 1), j + (c as i64 >> 1 & 1), k + (c as i64 >> 2 & 1))
    })
}

/// Value at a position.
pub fn value(volume: &Volume, p_in_voxel: DVec3) -> f64 {
    let (cell, f) = cell_of(volume, p_in_voxel);
    trilinear(&corner_values(volume, cell), f)
}

/// Central difference at a voxel, in value per voxel: `(v[i+1] - v[i-1]) / 2`, indices clamped to the volume.
pub fn voxel_gradient(volume: &Volume, i: i64, j: i64, k: i64) -> DVec3 {
    let v = |i, j, k| volume.value_clamped(i, j, k);
    DVec3::new(
        v(i + 1, j, k) - v(i - 1, j, k),
        v(i, j + 1, k) - v(i, j - 1, k),
        v(i, j, k + 1) - v(i, j, k - 1),
    ) * 0.5
}

/// World-space gradients at the corners of a cell, x fastest: the voxels' central differences, transformed by the
/// transpose of `voxel_from_world`, which is right for anisotropic and sheared grids too. Value per world length.
pub fn corner_gradients_in_world(volume: &Volume, cell: [i64; 3]) -> [DVec3; 8] {
    let world_from_voxel = volume.voxel_from_world().matrix3.transpose();
    let [i, j, k] = cell;
    std::array::from_fn(|c| {
        let c = c as i64;
        world_from_voxel * voxel_gradient(volume, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1))
    })
}

/// Interpolates corner vectors (x fastest) at a position within their cell.
#[inline]
pub fn trilinear_vector(corners: &[DVec3; 8], f: DVec3) -> DVec3 {
    let x = |c: usize| corners[c].lerp(corners[c + 1], f.x);
    x(0).lerp(x(2), f.y).lerp(x(4).lerp(x(6), f.y), f.z)
}

/// Gradient in world space (value per world length): the corners' gradients, interpolated.
pub fn gradient_in_world(volume: &Volume, p_in_voxel: DVec3) -> DVec3 {
    let (cell, f) = cell_of(volume, p_in_voxel);
    trilinear_vector(&corner_gradients_in_world(volume, cell), f)
}

/// The length of a world-space gradient below which it counts as vanishing, for a volume: a millionth of its value
/// range a voxel, along its largest spacing.
pub fn vanishing_gradient(volume: &Volume) -> f64 {
    let [lo, hi] = volume.value_range();
    crate::lighting::VANISHING_GRADIENT * (hi - lo) / volume.spacing().max_element()
}
