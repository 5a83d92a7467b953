//! The spaces of cutaway, defined once.
//!
//! ```text
//!   voxel ──world_from_voxel──► world ──view_from_world──► view ──► pixel
//!   (i, j, k); voxel centres    mm, RAS axes:              camera at the origin,
//!   at integers; the volume     +x right (of the           looking down -z, +y up
//!   is the box [0, n-1]         patient), +y anterior,
//!                               +z superior
//!
//!            k                        z (S)                    y
//!            │  j                     │  y (A)                 │
//!            │ /                      │ /                      │
//!            │/                       │/                       │
//!            └───── i                 └───── x (R)             └───── x
//!                                                             /
//!   object ──world_from_object──► world                      z (towards the eye)
//!   (of a clip mesh)
//! ```
//!
//! Transforms are named `target_from_source`, so that the spaces meet in the middle of a product:
//! `p_in_voxel = voxel_from_world * (world_from_view * p_in_view)`. Values whose space is not obvious say it:
//! `ray_in_world`. Transforms are f64 on the host; kernels use f32.

use glam::{DAffine3, DMat3, DVec3};

/// Which way the world axes point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WorldFrame {
    /// +x to the patient's right, +y to the front, +z to the head. Readers convert LPS files once, at the border.
    Ras,
    /// The file says nothing of a patient: axes mean what its author meant.
    Unknown,
}

/// For each voxel axis (i, j, k), the anatomical direction in which its index grows, as nibabel's `aff2axcodes`:
/// one of R, L, A, P, S, I. The assignment is the one that maximises the agreement over all three axes at once, so
/// that no letter pair occurs twice even in oblique and sheared grids.
pub fn orientation_letters(world_from_voxel: &DAffine3) -> [char; 3] {
    let directions = nearest_rotation(&world_from_voxel.matrix3);
    let mut best = ([0usize, 1, 2], f64::NEG_INFINITY);
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let agreement: f64 = (0..3).map(|i| directions.col(i)[order[i]].abs()).sum();
        if agreement > best.1 + 1e-9 {
            best = (order, agreement);
        }
    }
    let letters = [['R', 'L'], ['A', 'P'], ['S', 'I']];
    [0, 1, 2].map(|i| letters[best.0[i]][usize::from(directions.col(i)[best.0[i]] < 0.0)])
}

/// The orthogonal matrix nearest to `matrix` with normalised columns: its polar factor, by Newton's iteration
/// (Higham 1986). Reflections stay reflections. A singular matrix is returned with its columns normalised.
fn nearest_rotation(matrix: &DMat3) -> DMat3 {
    let columns = [0, 1, 2].map(|i| matrix.col(i).normalize_or_zero());
    let normalised = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let mut rotation = normalised;
    for _ in 0..32 {
        if rotation.determinant().abs() < 1e-12 {
            return normalised;
        }
        rotation = (rotation + rotation.inverse().transpose()) * 0.5;
    }
    rotation
}

/// Converts between LPS and RAS world coordinates (its own inverse): DICOM, NRRD and MetaImage say LPS.
pub fn ras_from_lps() -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_name_axis_aligned_and_oblique_grids() {
        assert_eq!(orientation_letters(&DAffine3::IDENTITY), ['R', 'A', 'S']);
        assert_eq!(orientation_letters(&ras_from_lps()), ['L', 'P', 'S']);
        let sagittal =
            DAffine3::from_cols_array(&[0.0, -1.0, 0.0, 0.0, 0.0, -2.0, 3.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!(orientation_letters(&sagittal), ['P', 'I', 'R']);
        let oblique = DAffine3::from_rotation_x(0.6);
        assert_eq!(orientation_letters(&oblique), ['R', 'A', 'S']);
    }

    #[test]
    fn strong_shear_still_uses_each_letter_pair_once() {
        // Two columns both lean towards x; each axis must still get a direction of its own.
        let sheared =
            DAffine3::from_cols_array(&[1.0, 0.0, 0.0, 0.9, 0.8, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(orientation_letters(&sheared), ['R', 'A', 'S']);
    }
}
