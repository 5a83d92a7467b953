//! A pose as numbers that people type: translation, angles, factors.
//!
//! The matrix of a pose is a rotation times an upper triangle (Gram-Schmidt): the triangle's diagonal are the factors along
//! the object's own axes, what is above it is shear. Editing one number leaves the others, and the shear, as they are.

use cutaway_core::clip::Pose;
use cutaway_core::glam::{DAffine3, DMat3, DVec3, EulerRot};

/// The numbers of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseNumbers {
    /// Where the object's origin is, in the space around it.
    pub translation: DVec3,
    /// Degrees about x, then y, then z, all axes those of the space around it.
    pub rotation: DVec3,
    /// Factors along the object's own axes; the first is negative where the object is mirrored.
    pub scale: DVec3,
    /// What is added to y of x, to z of x and to z of y, in units of the factors: 0 where nothing leans.
    pub shear: DVec3,
}

/// The rotation and the upper triangle whose product a matrix is.
pub(super) fn rotation_and_triangle(matrix: &DMat3) -> (DMat3, DMat3) {
    let mirror = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    let x = matrix.x_axis.normalize() * mirror;
    let y = (matrix.y_axis - x * x.dot(matrix.y_axis)).normalize();
    // What is left, so that the axes are orthonormal however little is left of z.
    let rotation = DMat3::from_cols(x, y, x.cross(y));
    (rotation, rotation.transpose() * *matrix)
}

impl PoseNumbers {
    /// Of a pose.
    pub fn new(pose: &Pose) -> Self {
        let affine = pose.world_from_object();
        let (rotation, triangle) = rotation_and_triangle(&affine.matrix3);
        let (z, y, x) = rotation.to_euler(EulerRot::ZYX);
        let scale = DVec3::new(triangle.x_axis.x, triangle.y_axis.y, triangle.z_axis.z);
        let above = DVec3::new(triangle.y_axis.x, triangle.z_axis.x, triangle.z_axis.y);
        Self {
            translation: affine.translation,
            // Plus 0, so that nothing has no minus in front of it.
            rotation: DVec3::new(x, y, z).map(|angle| angle.to_degrees() + 0.0),
            scale,
            shear: above / DVec3::new(scale.x, scale.x, scale.y),
        }
    }

    /// Whether the object leans.
    pub fn is_sheared(&self) -> bool {
        self.shear.abs().max_element() > 1e-9
    }

    /// The pose; none where a factor is 0, or a number too large.
    pub fn pose(&self) -> Option<Pose> {
        let [x, y, z] = self.rotation.map(f64::to_radians).to_array();
        let rotation = DMat3::from_euler(EulerRot::ZYX, z, y, x);
        let (scale, shear) = (self.scale, self.shear);
        let triangle = DMat3::from_cols(
            DVec3::new(scale.x, 0.0, 0.0),
            DVec3::new(shear.x * scale.x, scale.y, 0.0),
            DVec3::new(shear.y * scale.x, shear.z * scale.y, scale.z),
        );
        Pose::new(DAffine3 { matrix3: rotation * triangle, translation: self.translation }).ok()
    }

    /// The same but turned and scaled around a point of the object's own space, rather than around its origin: that point
    /// stays where `before` has it.
    pub fn around(mut self, pivot_in_object: DVec3, before: &Pose) -> Option<Pose> {
        let place = before.world_from_object().transform_point3(pivot_in_object);
        let turned = self.pose()?;
        self.translation += place - turned.world_from_object().transform_point3(pivot_in_object);
        self.pose()
    }
}
