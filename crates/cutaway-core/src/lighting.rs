//! Lighting: Blinn-Phong from the gradient, with three diffuse curves and a rule for where the gradient vanishes.
//!
//! `n = -gradient / |gradient|`, `l` towards the light, `v` towards the eye, `h` between `l` and `v`:
//! `colour' = colour * (ambient + diffuse * D(n·l)) + specular * S(n·h)`, with a white light.
//! Where there is no gradient there is no normal; D and S are then their means over all directions (Termeer 4.2.2), so
//! that a homogeneous region is lit like the average of its surroundings instead of going black.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gradients below this fraction of the value range per voxel count as vanishing.
pub const VANISHING_GRADIENT: f64 = 1e-6;

/// How brightness falls off with the angle between normal and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DiffuseCurve {
    /// `max(0, n·l)`: surfaces turned away are dark.
    Clamped,
    /// `|n·l|`: both sides of a surface are lit; the default, as in VTK.
    #[default]
    TwoSided,
    /// `((n·l + 1) / 2)^wrap_power`: light reaches around.
    Wrapped,
}

/// Light and material of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Lighting {
    /// Whether composite and isosurface images are shaded at all.
    pub shade: bool,
    /// Fraction of the colour that needs no light; 0 or more.
    pub ambient: f64,
    /// Factor of the diffuse term; 0 or more.
    pub diffuse: f64,
    /// Factor of the specular term; 0 or more.
    pub specular: f64,
    /// Exponent of the specular term; 0 or more.
    pub specular_power: f64,
    /// The curve of the diffuse and specular terms.
    pub diffuse_curve: DiffuseCurve,
    /// Exponent of the `wrapped` curve; above 0.
    pub wrap_power: f64,
    /// World direction towards the light (any length above zero); none is a headlight: each pixel is lit along its own
    /// ray.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<[f64; 3]>,
}

impl Default for Lighting {
    fn default() -> Self {
        Self {
            shade: true,
            ambient: 0.1,
            diffuse: 0.9,
            specular: 0.2,
            specular_power: 10.0,
            diffuse_curve: DiffuseCurve::default(),
            wrap_power: 1.0,
            light: None,
        }
    }
}

impl Lighting {
    /// Directions towards the light and half-way between light and eye, for a ray along `direction` (unit length).
    pub fn directions(&self, direction: DVec3) -> (DVec3, DVec3) {
        let v = -direction;
        let l = self.light.and_then(|l| DVec3::from_array(l).try_normalize()).unwrap_or(v);
        // Light from exactly behind the surface has no half-way vector; the specular term is then that of the eye.
        (l, (l + v).try_normalize().unwrap_or(v))
    }

    /// The curves D(n·l) and S(n·h).
    pub fn curves(&self, n_dot_l: f64, n_dot_h: f64) -> (f64, f64) {
        let clamped_specular = n_dot_h.max(0.0).powf(self.specular_power);
        match self.diffuse_curve {
            DiffuseCurve::Clamped => (n_dot_l.max(0.0), clamped_specular),
            DiffuseCurve::TwoSided => (n_dot_l.abs(), n_dot_h.abs().powf(self.specular_power)),
            DiffuseCurve::Wrapped => ((0.5 * n_dot_l + 0.5).max(0.0).powf(self.wrap_power), clamped_specular),
        }
    }

    /// The means of D and S over all directions of the normal: what is used where the gradient vanishes.
    pub fn mean_curves(&self) -> (f64, f64) {
        let lobe = 1.0 / (self.specular_power + 1.0);
        match self.diffuse_curve {
            DiffuseCurve::Clamped => (0.25, 0.5 * lobe),
            DiffuseCurve::TwoSided => (0.5, lobe),
            DiffuseCurve::Wrapped => (1.0 / (self.wrap_power + 1.0), 0.5 * lobe),
        }
    }

    /// The factor of the colour and the white that is added to it, at a world-space `gradient`; vanishing ones are
    /// those shorter than `vanishing` (value per world length).
    pub fn terms(&self, gradient: DVec3, vanishing: f64, l: DVec3, h: DVec3) -> (f64, f64) {
        let length = gradient.length();
        let (d, s) = if length > vanishing {
            let n = -gradient / length;
            self.curves(n.dot(l), n.dot(h))
        } else {
            self.mean_curves()
        };
        (self.ambient + self.diffuse * d, self.specular * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vanishing-gradient values of the design are the curves' means over the sphere.
    #[test]
    fn mean_curves_are_the_means_over_all_directions() {
        for curve in [DiffuseCurve::Clamped, DiffuseCurve::TwoSided, DiffuseCurve::Wrapped] {
            let lighting = Lighting {
                diffuse_curve: curve,
                wrap_power: 3.0,
                specular_power: 7.0,
                ..Lighting::default()
            };
            // cos(angle) is uniform on [-1, 1] over the sphere (Archimedes); midpoint rule, error ~ 1e-9.
            let n = 20_000;
            let (mut d, mut s) = (0.0, 0.0);
            for i in 0..n {
                let x = -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n);
                let (di, si) = lighting.curves(x, x);
                d += di / f64::from(n);
                s += si / f64::from(n);
            }
            let mean = lighting.mean_curves();
            assert!(
                (d - mean.0).abs() < 1e-6 && (s - mean.1).abs() < 1e-6,
                "{curve:?}: {d} {s} against {mean:?}"
            );
        }
    }

    #[test]
    fn the_default_light_is_a_headlight() {
        let ray = DVec3::new(0.0, 0.6, -0.8);
        assert_eq!(Lighting::default().directions(ray), (-ray, -ray));
    }

    #[test]
    fn two_sided_light_does_not_know_front_from_back() {
        let lighting = Lighting::default();
        let (l, h) = lighting.directions(DVec3::NEG_Z);
        let g = DVec3::new(0.3, -0.2, 2.0);
        assert_eq!(lighting.terms(g, 0.0, l, h), lighting.terms(-g, 0.0, l, h));
    }
}
