//! Where an object is: an affine transform that can be undone.

use glam::{DAffine3, DMat3, DVec3};

/// Columns whose box has less than this of the volume that their lengths allow count as lying in a plane.
const LEAST_SKEWNESS: f64 = 1e-9;

/// An invertible `world_from_object`: translations, rotations, scales, shears, reflections and their products.
///
/// Given to a node of a clip tree it moves the node and all below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    world_from_object: DAffine3,
    object_from_world: DAffine3,
}

/// Why a matrix is no pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// NaN, infinity, or so near to it that the inverse is not finite.
    #[error("the pose has a number that is not finite, or too large or small to be undone")]
    NotFinite,
    /// It flattens space.
    #[error("the pose is singular: it flattens the object, and cannot be undone")]
    Singular,
    /// The last row of the 4x4 matrix.
    #[error("the last row of the pose is {found:?}; expected [0, 0, 0, 1]")]
    LastRow {
        /// What it is.
        found: [f64; 4],
    },
}

impl Pose {
    /// The world's own place.
    pub const IDENTITY: Self =
        Self { world_from_object: DAffine3::IDENTITY, object_from_world: DAffine3::IDENTITY };

    /// Checks that it can be undone.
    pub fn new(world_from_object: DAffine3) -> Result<Self, PoseError> {
        let m = world_from_object.matrix3;
        let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        if !world_from_object.is_finite() || !lengths.is_finite() {
            return Err(PoseError::NotFinite);
        }
        // Relative to the columns' lengths, so that the unit of length does not matter.
        let skewness = m.determinant() / lengths;
        if skewness.is_nan() || skewness.abs() < LEAST_SKEWNESS {
            return Err(PoseError::Singular);
        }
        let object_from_world = world_from_object.inverse();
        if !object_from_world.is_finite() {
            return Err(PoseError::NotFinite);
        }
        Ok(Self { world_from_object, object_from_world })
    }

    /// From the rows of a 4x4 matrix, as scene files have it.
    pub fn from_rows(rows: [[f64; 4]; 4]) -> Result<Self, PoseError> {
        let [x, y, z, last] = rows;
        if last != [0.0, 0.0, 0.0, 1.0] {
            return Err(PoseError::LastRow { found: last });
        }
        let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
        Self::new(DAffine3 { matrix3, translation: column(3) })
    }

    /// The rows of the 4x4 matrix.
    pub fn to_rows(&self) -> [[f64; 4]; 4] {
        let (m, t) = (self.world_from_object.matrix3, self.world_from_object.translation);
        let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// From object space to that of the node above, or the world.
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.world_from_object
    }

    /// Back.
    pub fn object_from_world(&self) -> &DAffine3 {
        &self.object_from_world
    }

    /// `self` after `inner`: the pose of something posed within something posed.
    pub fn after(&self, inner: &Self) -> Result<Self, PoseError> {
        if *self == Self::IDENTITY {
            return Ok(*inner);
        }
        if *inner == Self::IDENTITY {
            return Ok(*self);
        }
        Self::new(self.world_from_object * inner.world_from_object)
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_go_in_and_out() {
        let rows =
            [[0.0, -2.0, 0.0, 5.0], [1.0, 0.5, 0.0, -3.0], [0.0, 0.0, -1.0, 7.0], [0.0, 0.0, 0.0, 1.0]];
        let pose = Pose::from_rows(rows).unwrap();
        assert_eq!(pose.to_rows(), rows);
        let p = pose.world_from_object().transform_point3(DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(p, DVec3::new(1.0, -1.0, 4.0));
        assert!((pose.object_from_world().transform_point3(p) - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-14);
    }

    #[test]
    fn what_cannot_be_undone_is_refused_at_any_scale() {
        for scale in [1e-9, 1.0, 1e9] {
            assert!(Pose::new(DAffine3::from_scale(DVec3::splat(scale))).is_ok());
            let flat = DAffine3::from_scale(DVec3::new(scale, scale, 0.0));
            assert_eq!(Pose::new(flat), Err(PoseError::Singular));
            let mut leaning = DAffine3::from_scale(DVec3::splat(scale));
            leaning.matrix3.z_axis = leaning.matrix3.x_axis + leaning.matrix3.y_axis;
            assert_eq!(Pose::new(leaning), Err(PoseError::Singular));
        }
        assert_eq!(Pose::new(DAffine3::from_translation(DVec3::NAN)), Err(PoseError::NotFinite));
        assert_eq!(Pose::new(DAffine3::from_scale(DVec3::splat(1e200))), Err(PoseError::NotFinite));
        let row = [0.0, 0.0, 0.5, 1.0];
        let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], row];
        assert_eq!(Pose::from_rows(rows), Err(PoseError::LastRow { found: row }));
    }
}
