//! Rational Bezier patches of any degree: what every kind of patch becomes before it is tessellated.

use cutaway_core::glam::{DVec3, DVec4, Vec4Swizzles as _};

use super::{PatchError, SurfacePoint, check_points, check_weights};

/// The largest degree of a surface, in either direction.
pub const MAX_DEGREE: usize = 15;

/// A rational tensor-product Bezier patch over `(u, v)` in the unit square. With all weights equal it is polynomial.
///
/// Its weights are positive, so it lies in the convex hull of its control points, as do its halves in theirs: bounds
/// from control points hold, and tighten as a patch is split.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPatch {
    /// Along u and v. An edge is kept as a patch whose second degree is zero.
    degree: [usize; 2],
    /// `(w x, w y, w z, w)`; `degree[0] + 1` rows (u) of `degree[1] + 1` (v).
    net: Vec<DVec4>,
}

/// Upper bounds of the lengths of a patch's second derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) uu: f64,
    pub(super) uv: f64,
    pub(super) vv: f64,
}

impl Bounds {
    /// How far the patch is at most from any triangulation of its unit square whose corners are on the patch.
    ///
    /// Let triangle corners `x_i` have mean `x = sum(l_i x_i)`. Taylor's theorem around x gives `S(x) - sum(l_i S(x_i))`
    /// as `-1/2 sum(l_i S''[x_i - x, x_i - x])`. A quantity in an interval of length 1 has at most the variance 1/4
    /// (Popoviciu), and the covariance of two is no larger, whence `(|Suu| + 2 |Suv| + |Svv|) / 8`: the bound of
    /// Filip, Magedson and Markot (1986), for triangles of any shape.
    pub(super) fn deviation(self) -> f64 {
        (self.uu + 2.0 * self.uv + self.vv) / 8.0
    }
}

impl BezierPatch {
    /// Checks and takes over: `degree_u + 1` rows of `degree_v + 1` points; without weights they are all one.
    pub fn new(degree: [usize; 2], points: &[DVec3], weights: Option<&[f64]>) -> Result<Self, PatchError> {
        for (axis, degree) in ["u", "v"].into_iter().zip(degree) {
            super::check_degree(axis, degree)?;
        }
        let expected = (degree[0] + 1) * (degree[1] + 1);
        if points.len() != expected {
            return Err(PatchError::Count { what: "points", found: points.len(), expected });
        }
        check_points(points)?;
        let weights = weights.map_or_else(|| Ok(vec![1.0; expected]), |w| check_weights(w, expected))?;
        Ok(Self::from_net(degree, points.iter().zip(weights).map(|(p, w)| (*p * w).extend(w)).collect()))
    }

    /// From homogeneous points that are known to be finite, with positive weights, and as many as the degrees say.
    pub(super) fn from_net(degree: [usize; 2], net: Vec<DVec4>) -> Self {
        debug_assert_eq!(net.len(), (degree[0] + 1) * (degree[1] + 1));
        Self { degree, net }
    }

    /// Degrees along u and v.
    pub fn degree(&self) -> [usize; 2] {
        self.degree
    }

    /// Control points, u from row to row, v along a row.
    pub fn points(&self) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        self.net.iter().map(|p| p.xyz() / p.w)
    }

    pub(super) fn net(&self) -> &[DVec4] {
        &self.net
    }

    /// Moves the control points, weights staying as they are.
    pub(super) fn set_points(&mut self, points: impl Iterator<Item = DVec3>) {
        for (old, new) in self.net.iter_mut().zip(points) {
            *old = (new * old.w).extend(old.w);
        }
    }

    /// Whether all control points are one.
    pub(super) fn is_point(&self) -> bool {
        let [low, high] = self.bounds();
        low == high
    }

    /// The control points' bounding box: lowest and highest corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.points().fold(empty, |[low, high], p| [low.min(p), high.max(p)])
    }

    /// Position and derivatives at `(u, v)`, each in 0..=1.
    pub fn at(&self, u: f64, v: f64) -> SurfacePoint {
        let by_u = bernstein(self.degree[0], u);
        let by_v = bernstein(self.degree[1], v);
        let mut sums = [DVec4::ZERO; 6];
        for (i, row) in self.net.chunks_exact(self.degree[1] + 1).enumerate() {
            let along = |k: usize| row.iter().zip(&by_v[k]).fold(DVec4::ZERO, |sum, (p, b)| sum + *p * *b);
            let [s, s_v, s_vv] = [along(0), along(1), along(2)];
            let [b, b_u, b_uu] = [by_u[0][i], by_u[1][i], by_u[2][i]];
            let terms = [s * b, s * b_u, s_v * b, s * b_uu, s_v * b_u, s_vv * b];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        SurfacePoint::from_homogeneous(sums)
    }

    /// The unit normal `du x dv` at `(u, v)`; at a point where the patch degenerates (a collapsed edge, parallel
    /// tangents) its limit from inside. `None` only where the patch has no inside: a line or a point.
    pub fn normal(&self, u: f64, v: f64) -> Option<DVec3> {
        self.normal_of(&self.at(u, v), u, v)
    }

    /// As [`normal`](Self::normal), of a point that was evaluated at `(u, v)`.
    pub(super) fn normal_of(&self, point: &SurfacePoint, u: f64, v: f64) -> Option<DVec3> {
        let [low, high] = self.bounds();
        let size = (high - low).length();
        if let Some(normal) = point.normal(size) {
            return Some(normal);
        }
        // From the middle, or (at the middle itself) from another place.
        for (u_inside, v_inside) in [(0.5, 0.5), (0.25, 0.4), (0.7, 0.8)] {
            let (a, b) = (u_inside - u, v_inside - v);
            if let Some(normal) = point.limit_normal(a, b, size) {
                return Some(normal);
            }
            // Flat to second order: from points ever farther inside.
            for part in [1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0] {
                if let Some(normal) = self.at(u + part * a, v + part * b).normal(size) {
                    return Some(normal);
                }
            }
        }
        None
    }

    /// The principal curvatures at `(u, v)`; see [`SurfacePoint::principal_curvatures`].
    pub fn principal_curvatures(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let [low, high] = self.bounds();
        self.at(u, v).principal_curvatures((high - low).length())
    }

    /// The patches over `u <= at` and `u >= at` (de Casteljau), each over a unit square of its own.
    pub fn split_u(&self, at: f64) -> [Self; 2] {
        self.split(at, self.degree[0], self.degree[1] + 1, |line, stride, k| k * stride + line)
    }

    /// The patches over `v <= at` and `v >= at`.
    pub fn split_v(&self, at: f64) -> [Self; 2] {
        let stride = self.degree[1] + 1;
        self.split(at, self.degree[1], self.degree[0] + 1, |line, _, k| line * stride + k)
    }

    fn split(
        &self,
        at: f64,
        degree: usize,
        lines: usize,
        index: impl Fn(usize, usize, usize) -> usize,
    ) -> [Self; 2] {
        let [mut before, mut after] = [self.clone(), self.clone()];
        let mut work = [DVec4::ZERO; MAX_DEGREE + 1];
        for line in 0..lines {
            let index = |k| index(line, lines, k);
            (0..=degree).for_each(|k| work[k] = self.net[index(k)]);
            for step in 0..=degree {
                before.net[index(step)] = work[0];
                after.net[index(degree - step)] = work[degree - step];
                for k in 0..degree - step {
                    work[k] = work[k] + (work[k + 1] - work[k]) * at;
                }
            }
        }
        [before, after]
    }

    /// How far the patch is at most from any triangulation of its unit square whose corners are on it.
    pub fn flatness(&self) -> f64 {
        self.second_derivatives().deviation()
    }

    /// Bounds of the second derivatives from differences of control points.
    ///
    /// With the origin at the middle of the points, `S = A / w`, `|S| <= r` (convex hull), and the quotient rule bounds
    /// `|Su|` by `(|Au| + r |wu|) / w`, `|Suu|` by `(|Auu| + r |wuu| + 2 |Su| |wu|) / w`, `|Suv|` likewise. Halving a
    /// patch halves r and `wu`, so the bound falls as fast as the derivative itself.
    pub(super) fn second_derivatives(&self) -> Bounds {
        let [low, high] = self.bounds();
        let middle = 0.5 * (low + high);
        let radius = self.points().map(|p| (p - middle).length()).fold(0.0, f64::max);
        let least = self.net.iter().map(|p| p.w).fold(f64::INFINITY, f64::min);
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| self.net[i * (q + 1) + j];
        // Largest length of a difference, in space (about the middle) and in weight.
        let largest =
            |rows: usize, columns: usize, factor: usize, difference: &dyn Fn(usize, usize) -> DVec4| {
                let mut most = [0.0_f64; 2];
                for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
                    let d = difference(i, j);
                    most[0] = most[0].max((d.xyz() - middle * d.w).length());
                    most[1] = most[1].max(d.w.abs());
                }
                most.map(|m| m * factor as f64)
            };
        let [a_u, w_u] = largest(p, q + 1, p, &|i, j| at(i + 1, j) - at(i, j));
        let [a_v, w_v] = largest(p + 1, q, q, &|i, j| at(i, j + 1) - at(i, j));
        let twice = |n: usize| n * n.saturating_sub(1);
        let (p2, q2) = (p.saturating_sub(1), q.saturating_sub(1));
        let [a_uu, w_uu] = largest(p2, q + 1, twice(p), &|i, j| at(i + 2, j) - 2.0 * at(i + 1, j) + at(i, j));
        let [a_vv, w_vv] = largest(p + 1, q2, twice(q), &|i, j| at(i, j + 2) - 2.0 * at(i, j + 1) + at(i, j));
        let mixed = |i, j| at(i + 1, j + 1) - at(i + 1, j) - at(i, j + 1) + at(i, j);
        let [a_uv, w_uv] = largest(p, q, p * q, &mixed);
        let (s_u, s_v) = ((a_u + radius * w_u) / least, (a_v + radius * w_v) / least);
        Bounds {
            uu: (a_uu + radius * w_uu + 2.0 * s_u * w_u) / least,
            uv: (a_uv + radius * w_uv + s_u * w_v + s_v * w_u) / least,
            vv: (a_vv + radius * w_vv + 2.0 * s_v * w_v) / least,
        }
    }
}

/// Bernstein polynomials of a degree at `t`, and their first and second derivatives.
fn bernstein(degree: usize, t: f64) -> [[f64; MAX_DEGREE + 1]; 3] {
    let mut b = [0.0; MAX_DEGREE + 1];
    b[0] = 1.0;
    let mut lower = [b, b];
    for n in 0..degree {
        lower = [b, lower[0]];
        for j in (0..=n + 1).rev() {
            b[j] = (1.0 - t) * b[j] + if j > 0 { t * b[j - 1] } else { 0.0 };
        }
    }
    let n = degree as f64;
    let [once, twice] = lower;
    let below = |b: &[f64], j: usize, k: usize| if j >= k { b[j - k] } else { 0.0 };
    let mut first = [0.0; MAX_DEGREE + 1];
    let mut second = [0.0; MAX_DEGREE + 1];
    for j in 0..=degree {
        if degree > 0 {
            first[j] = n * (below(&once, j, 1) - below(&once, j, 0));
        }
        if degree > 1 {
            let difference = below(&twice, j, 2) - 2.0 * below(&twice, j, 1) + below(&twice, j, 0);
            second[j] = n * (n - 1.0) * difference;
        }
    }
    [b, first, second]
}
