//! Analytic volumes: fields with a known value and gradient everywhere, sampled on a grid.
//!
//! For tests, and for users without data at hand (`sample:marschner-lobb`, `sample:sphere`, ...). Each field lives on
//! the cube `[-1, 1]³`; the grid's outermost voxel centres lie on its faces. World units are voxels.

use glam::{DVec3, UVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

use crate::volume::{Geometry, Rescale, Volume};

/// A field with a closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnalyticField {
    /// The test signal of Marschner and Lobb (1994), in 0..=1: as high a frequency as a 41³ grid can carry.
    MarschnerLobb,
    /// `1 - |p|`: its isosurfaces are spheres, its gradient has length 1.
    Sphere,
    /// `1 - distance to a circle of radius 0.6 in the xy plane`: its isosurfaces are tori.
    Torus,
    /// `direction · p`: linear, so that trilinear interpolation is exact.
    Ramp {
        /// Its gradient.
        direction: DVec3,
    },
    /// Cubes of alternating 0 and 1, `per_side` along each axis: a field of steps.
    Checkerboard {
        /// Cubes along each axis.
        per_side: u32,
    },
}

/// Frequency and depth of the Marschner-Lobb signal's ripples.
const ML_FREQUENCY: f64 = 6.0;
const ML_DEPTH: f64 = 0.25;

impl AnalyticField {
    /// The names that [`AnalyticField::from_name`] knows.
    pub const NAMES: [&str; 5] = ["marschner-lobb", "sphere", "torus", "ramp", "checkerboard"];

    /// The field of a name, with default parameters.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "marschner-lobb" => Self::MarschnerLobb,
            "sphere" => Self::Sphere,
            "torus" => Self::Torus,
            "ramp" => Self::Ramp { direction: DVec3::new(0.0, 0.0, 1.0) },
            "checkerboard" => Self::Checkerboard { per_side: 4 },
            _ => return None,
        })
    }

    /// Its value at a point of the cube.
    pub fn value(&self, p: DVec3) -> f64 {
        match *self {
            Self::MarschnerLobb => {
                let ripple = (2.0 * PI * ML_FREQUENCY * (PI * p.truncate().length() / 2.0).cos()).cos();
                (1.0 - (PI * p.z / 2.0).sin() + ML_DEPTH * (1.0 + ripple)) / (2.0 * (1.0 + ML_DEPTH))
            }
            Self::Sphere => 1.0 - p.length(),
            Self::Torus => 1.0 - DVec3::new(p.truncate().length() - 0.6, p.z, 0.0).length(),
            Self::Ramp { direction } => direction.dot(p),
            Self::Checkerboard { per_side } => {
                let cube = ((p + 1.0) * 0.5 * f64::from(per_side))
                    .floor()
                    .min(DVec3::splat(f64::from(per_side) - 1.0));
                (cube.x + cube.y + cube.z).rem_euclid(2.0)
            }
        }
    }

    /// Its gradient at a point of the cube; zero where it is not defined.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::MarschnerLobb => {
                let r = p.truncate().length();
                let phase = 2.0 * PI * ML_FREQUENCY * (PI * r / 2.0).cos();
                let along_r = ML_DEPTH * phase.sin() * PI * PI * ML_FREQUENCY * (PI * r / 2.0).sin();
                let out = p.truncate().normalize_or_zero() * along_r;
                DVec3::new(out.x, out.y, -(PI / 2.0) * (PI * p.z / 2.0).cos()) / (2.0 * (1.0 + ML_DEPTH))
            }
            Self::Sphere => -p.normalize_or_zero(),
            Self::Torus => {
                let out = p.truncate().normalize_or_zero();
                let to = DVec3::new(p.x - 0.6 * out.x, p.y - 0.6 * out.y, p.z);
                -to.normalize_or_zero()
            }
            Self::Ramp { direction } => direction,
            Self::Checkerboard { .. } => DVec3::ZERO,
        }
    }

    /// The field on a grid of `size` voxels a side (at least 2), as f32; world units are voxels, from the origin.
    pub fn volume(&self, size: u32) -> Volume {
        let size = size.max(2);
        let step = 2.0 / f64::from(size - 1);
        let at = |i: u32| f64::from(i) * step - 1.0;
        let mut voxels = vec![0.0f32; (size as usize).pow(3)];
        let plane = (size as usize).pow(2);
        voxels.par_chunks_mut(plane).enumerate().for_each(|(k, plane)| {
            for (i, v) in plane.iter_mut().enumerate() {
                let (i, j) = (i as u32 % size, i as u32 / size);
                *v = self.value(DVec3::new(at(i), at(j), at(k as u32))) as f32;
            }
        });
        Volume::new(UVec3::splat(size), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
            .expect("a cube of voxels with unit spacing")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradients_are_the_derivatives_of_the_values(p in prop::array::uniform3(-0.95f64..0.95)) {
            let p = DVec3::from_array(p);
            prop_assume!(p.length() > 0.05 && (p.truncate().length() - 0.6).abs() > 0.01 && p.truncate().length() > 0.01);
            let ramp = AnalyticField::Ramp { direction: DVec3::new(1.0, -2.0, 0.5) };
            for field in [AnalyticField::MarschnerLobb, AnalyticField::Sphere, AnalyticField::Torus, ramp] {
                let h = 1e-6;
                let difference = DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|e| {
                    (field.value(p + e * h) - field.value(p - e * h)) / (2.0 * h)
                }));
                prop_assert!((difference - field.gradient(p)).length() < 1e-5, "{:?}", field);
            }
        }
    }

    #[test]
    fn grids_reach_the_faces_of_the_cube() {
        let ramp = AnalyticField::Ramp { direction: DVec3::new(1.0, 10.0, 100.0) }.volume(5);
        assert_eq!(ramp.value_range(), [-111.0, 111.0]);
        assert_eq!(ramp.value_clamped(4, 0, 2), -9.0);
        for name in AnalyticField::NAMES {
            assert!(AnalyticField::from_name(name).is_some(), "{name}");
        }
    }
}
