//! Blinn-Phong on many lanes; the theory is in [`cutaway_core::lighting`].

use cutaway_core::field::vanishing_gradient;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::scene::Scene;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use crate::packet::{Packet, vector3};

/// A scene's light, ready for kernels.
pub(super) struct Shading {
    lighting: Lighting,
    /// World gradient from twice the gradient of stored numbers in voxel space, row by row.
    world_from_stored: [[f32; 3]; 3],
    /// Square of the gradient length below which there is no normal.
    vanishing_squared: f32,
    /// D and S where there is none.
    mean: (f32, f32),
    specular_power: Power,
    wrap_power: Power,
}

/// The light of one packet: directions towards the light and half-way to the eye, per lane.
pub(super) struct PacketLight<S: Simd> {
    l: [S::f32s; 3],
    h: [S::f32s; 3],
    /// Whether `h` equals `l`: a headlight.
    headlight: bool,
}

impl Shading {
    pub(super) fn new(scene: &Scene) -> Self {
        let volume = scene.volume();
        let lighting = scene.lighting().clone();
        let m = volume.voxel_from_world().matrix3.transpose() * (0.5 * volume.rescale().slope);
        let row = |i: usize| m.row(i).as_vec3().to_array();
        let vanishing = vanishing_gradient(volume) as f32;
        let (d, s) = lighting.mean_curves();
        Self {
            world_from_stored: [row(0), row(1), row(2)],
            vanishing_squared: vanishing * vanishing,
            mean: (d as f32, s as f32),
            specular_power: Power::new(lighting.specular_power),
            wrap_power: Power::new(lighting.wrap_power),
            lighting,
        }
    }

    #[inline(always)]
    pub(super) fn packet_light<S: Simd>(&self, simd: S, packet: &Packet<S>) -> PacketLight<S> {
        let directions = packet.lanes.map(|lane| self.lighting.directions(lane.direction));
        PacketLight {
            l: vector3(simd, directions.map(|d| d.0.as_vec3())),
            h: vector3(simd, directions.map(|d| d.1.as_vec3())),
            headlight: self.lighting.light.is_none(),
        }
    }

    /// The factor of the colour and the white that is added, from the sampler's gradient.
    #[inline(always)]
    pub(super) fn terms<S: Simd>(
        &self,
        simd: S,
        light: &PacketLight<S>,
        gradient: [S::f32s; 3],
    ) -> (S::f32s, S::f32s) {
        let [rx, ry, rz] = self.world_from_stored;
        let g = [dot_row::<S>(gradient, rx), dot_row::<S>(gradient, ry), dot_row::<S>(gradient, rz)];
        let squared = dot::<S>(g, g);
        // n = -g / |g|; where there is no gradient the division's result is not used.
        let inverse = S::f32s::splat(simd, -1.0) / squared.sqrt();
        let n_dot_l = dot::<S>(g, light.l) * inverse;
        let n_dot_h = if light.headlight { n_dot_l } else { dot::<S>(g, light.h) * inverse };
        let (d, s) = self.curves::<S>(n_dot_l, n_dot_h);
        let has_normal = squared.simd_gt(self.vanishing_squared);
        let d = has_normal.select(d, S::f32s::splat(simd, self.mean.0));
        let s = has_normal.select(s, S::f32s::splat(simd, self.mean.1));
        (d * self.lighting.diffuse as f32 + self.lighting.ambient as f32, s * self.lighting.specular as f32)
    }

    #[inline(always)]
    fn curves<S: Simd>(&self, n_dot_l: S::f32s, n_dot_h: S::f32s) -> (S::f32s, S::f32s) {
        match self.lighting.diffuse_curve {
            DiffuseCurve::Clamped => (n_dot_l.max(0.0), self.specular_power.of::<S>(n_dot_h.max(0.0))),
            DiffuseCurve::TwoSided => (n_dot_l.abs(), self.specular_power.of::<S>(n_dot_h.abs())),
            DiffuseCurve::Wrapped => {
                let wrapped = (n_dot_l * 0.5 + 0.5).max(0.0);
                (self.wrap_power.of::<S>(wrapped), self.specular_power.of::<S>(n_dot_h.max(0.0)))
            }
        }
    }
}

#[inline(always)]
fn dot<S: Simd>(a: [S::f32s; 3], b: [S::f32s; 3]) -> S::f32s {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
fn dot_row<S: Simd>(v: [S::f32s; 3], row: [f32; 3]) -> S::f32s {
    v[0].mul_add(row[0], v[1].mul_add(row[1], v[2] * row[2]))
}

/// An exponent: small whole ones by squaring, others lane by lane.
#[derive(Clone, Copy)]
enum Power {
    Whole(u32),
    Any(f32),
}

impl Power {
    fn new(power: f64) -> Self {
        if power.fract() == 0.0 && power <= 256.0 {
            Self::Whole(power as u32)
        } else {
            Self::Any(power as f32)
        }
    }

    /// `x` to this power, for `x` of 0 or more.
    #[inline(always)]
    fn of<S: Simd>(self, x: S::f32s) -> S::f32s {
        match self {
            Self::Whole(mut n) => {
                let (mut result, mut square) = (x * 0.0 + 1.0, x);
                while n > 0 {
                    if n & 1 == 1 {
                        result *= square;
                    }
                    square *= square;
                    n >>= 1;
                }
                result
            }
            Self::Any(power) => {
                let mut result = x;
                for v in result.as_mut_slice() {
                    *v = v.powf(power);
                }
                result
            }
        }
    }
}
