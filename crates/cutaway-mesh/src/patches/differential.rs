//! A point of a surface and its derivatives: normal and curvature.

use cutaway_core::glam::{DVec3, DVec4, Vec4Swizzles as _};

/// A position and the first and second derivatives by the surface's two parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: DVec3,
    /// First derivative by u.
    pub du: DVec3,
    /// First derivative by v.
    pub dv: DVec3,
    /// Second derivative by u.
    pub duu: DVec3,
    /// Mixed derivative.
    pub duv: DVec3,
    /// Second derivative by v.
    pub dvv: DVec3,
}

/// Sine of the angle between two tangents below which they count as one direction.
const PARALLEL: f64 = 1e-8;

/// Tangents shorter than this much of the surface's size are rounding, not tangents.
const VANISHING: f64 = 1e-10;

impl SurfacePoint {
    /// From homogeneous sums `(w x, w y, w z, w)` in the order of the fields: the quotient rule, twice.
    pub(super) fn from_homogeneous([a, a_u, a_v, a_uu, a_uv, a_vv]: [DVec4; 6]) -> Self {
        let position = a.xyz() / a.w;
        let du = (a_u.xyz() - a_u.w * position) / a.w;
        let dv = (a_v.xyz() - a_v.w * position) / a.w;
        Self {
            position,
            du,
            dv,
            duu: (a_uu.xyz() - 2.0 * a_u.w * du - a_uu.w * position) / a.w,
            duv: (a_uv.xyz() - a_u.w * dv - a_v.w * du - a_uv.w * position) / a.w,
            dvv: (a_vv.xyz() - 2.0 * a_v.w * dv - a_vv.w * position) / a.w,
        }
    }

    /// The unit normal `du x dv` where both tangents exist; `None` at a degenerate point. `size` is the extent of the
    /// surface, against which a tangent counts as none.
    pub fn normal(&self, size: f64) -> Option<DVec3> {
        let (lu, lv) = (self.du.length(), self.dv.length());
        if lu.min(lv) <= VANISHING * size {
            return None;
        }
        let cross = (self.du / lu).cross(self.dv / lv);
        if cross.length() > PARALLEL { cross.try_normalize() } else { None }
    }

    /// The limit of the unit normal at a degenerate point that is approached against `(a, b)`, a direction in the
    /// parameters that leads into the surface: the first-order term of `du x dv` along it. At a collapsed edge, where
    /// `dv` vanishes, that is `du x duv`. `None` where that term vanishes too.
    pub fn limit_normal(&self, a: f64, b: f64, size: f64) -> Option<DVec3> {
        let u_changes = self.duu * a + self.duv * b;
        let v_changes = self.duv * a + self.dvv * b;
        let term = u_changes.cross(self.dv) + self.du.cross(v_changes);
        let scale = self.du.length().max(self.dv.length()) * u_changes.length().max(v_changes.length());
        let noise = VANISHING * size * size;
        if term.length() > (PARALLEL * scale).max(noise) { term.try_normalize() } else { None }
    }

    /// The principal curvatures (per length), larger first: the eigenvalues of the second fundamental form by the
    /// first. A surface that bends towards its normal has positive ones, so a sphere of radius r with its normals
    /// outwards has -1/r twice. `None` at a degenerate point.
    ///
    /// (Termeer 2005 takes the cross product of two second derivatives for a curvature in equation A.12; it is none.)
    pub fn principal_curvatures(&self, size: f64) -> Option<[f64; 2]> {
        let normal = self.normal(size)?;
        let (e, f, g) = (self.du.dot(self.du), self.du.dot(self.dv), self.dv.dot(self.dv));
        let (l, m, n) = (self.duu.dot(normal), self.duv.dot(normal), self.dvv.dot(normal));
        let area = self.du.cross(self.dv).length_squared();
        let mean = (e * n - 2.0 * f * m + g * l) / (2.0 * area);
        let gauss = (l * n - m * m) / area;
        // Real by the spectral theorem; rounding alone can make it negative, at umbilics.
        let spread = (mean * mean - gauss).max(0.0).sqrt();
        Some([mean + spread, mean - spread])
    }
}
