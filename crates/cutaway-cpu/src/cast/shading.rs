//! Blinn-Phong on many lanes; the theory is in [`cutaway_core::lighting`].

use cutaway_core::field::vanishing_gradient;
use cutaway_core::glam::DVec3;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::scene::Scene;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use crate::packet::Packet;

/// What light makes of a colour, lane by lane: a factor, and white that is added.
pub(crate) type Terms<S> = (<S as Simd>::f32s, <S as Simd>::f32s);

/// A scene's light, ready for kernels.
///
/// Gradients come as *twice the gradient of stored numbers in voxel space*, `g`; the world gradient is `M g`. A product of
/// the world gradient with a direction `w` is then `g · (Mᵀ w)`, so directions are brought to the gradient's space once and
/// only its length is computed in the world.
pub(crate) struct Shading {
    lighting: Lighting,
    /// `M`, row by row.
    world_from_stored: [[f32; 3]; 3],
    /// `Mᵀ direction = along * stride`: gradient and ray are both in voxel space.
    along: f32,
    /// A fixed light: `-Mᵀ l`, and the vector whose product with a stride is `l · direction`.
    fixed: Option<([f32; 3], [f32; 3])>,
    /// Square of the gradient length below which there is no normal.
    vanishing_squared: f32,
    /// D and S where there is none.
    mean: (f32, f32),
    specular_power: Power,
    wrap_power: Power,
}

/// The light of one packet: what the gradient is multiplied with to give `|gradient| n·l` and `|gradient| n·h`, per lane.
pub(crate) struct PacketLight<S: Simd> {
    l: [S::f32s; 3],
    h: [S::f32s; 3],
    /// Whether `h` equals `l`: a headlight.
    headlight: bool,
}

impl Shading {
    pub(crate) fn new(scene: &Scene) -> Self {
        let volume = scene.volume();
        let lighting = scene.lighting().clone();
        let to_world = 0.5 * volume.rescale().slope;
        let m = volume.voxel_from_world().matrix3.transpose() * to_world;
        let row = |i: usize| m.row(i).as_vec3().to_array();
        let vanishing = vanishing_gradient(volume) as f32;
        let (d, s) = lighting.mean_curves();
        let fixed = lighting.light.map(|_| {
            let (l, _) = lighting.directions(DVec3::Z);
            let world_from_voxel = volume.world_from_voxel().matrix3;
            let product = world_from_voxel.transpose() * l / scene.step_length();
            ((m.transpose() * -l).as_vec3().to_array(), product.as_vec3().to_array())
        });
        Self {
            world_from_stored: [row(0), row(1), row(2)],
            along: (to_world / scene.step_length()) as f32,
            fixed,
            vanishing_squared: vanishing * vanishing,
            mean: (d as f32, s as f32),
            specular_power: Power::new(lighting.specular_power),
            wrap_power: Power::new(lighting.wrap_power),
            lighting,
        }
    }

    #[inline(always)]
    pub(crate) fn packet_light<S: Simd>(&self, simd: S, packet: &Packet<S>) -> PacketLight<S> {
        // Strides of the scene's steps, whatever steps this packet takes.
        let scale = S::f32s::splat(simd, 1.0) / packet.opacity_scale;
        let stride = [packet.stride[0] * scale, packet.stride[1] * scale, packet.stride[2] * scale];
        let [x, y, z] = stride;
        // -Mᵀ v, for v is against the ray.
        let v = [x * self.along, y * self.along, z * self.along];
        let Some((l, product)) = self.fixed else { return PacketLight { l: v, h: v, headlight: true } };
        let l_dot_v = dot_row::<S>(stride, product) * -1.0;
        let squared = l_dot_v * 2.0 + 2.0;
        let splat = |v: f32| S::f32s::splat(simd, v);
        // Light from exactly behind the surface has no half-way vector; the specular term is then that of the eye.
        let has_half_way = squared.simd_gt(1e-12);
        let scale = splat(1.0) / squared.sqrt();
        let half_way = |v: S::f32s, l: f32| has_half_way.select((v + l) * scale, v);
        PacketLight {
            l: [splat(l[0]), splat(l[1]), splat(l[2])],
            h: [half_way(v[0], l[0]), half_way(v[1], l[1]), half_way(v[2], l[2])],
            headlight: false,
        }
    }

    /// The factor of the colour and the white that is added, from the sampler's gradient.
    #[inline(always)]
    pub(crate) fn terms<S: Simd>(
        &self,
        simd: S,
        light: &PacketLight<S>,
        gradient: [S::f32s; 3],
    ) -> (S::f32s, S::f32s) {
        let [rx, ry, rz] = self.world_from_stored;
        let g = [dot_row::<S>(gradient, rx), dot_row::<S>(gradient, ry), dot_row::<S>(gradient, rz)];
        let squared = dot::<S>(g, g);
        // Where there is no gradient the division's result is not used.
        let inverse = S::f32s::splat(simd, 1.0) / squared.sqrt();
        let n_dot_l = dot::<S>(gradient, light.l) * inverse;
        let n_dot_h = if light.headlight { n_dot_l } else { dot::<S>(gradient, light.h) * inverse };
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
        if power.fract() == 0.0 && power < 256.0 {
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
