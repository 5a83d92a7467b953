//! The cubic kinds: one polynomial, four ways of saying it, told apart by a basis matrix.

use cutaway_core::glam::DVec3;

use super::{BezierPatch, SurfacePoint};

/// What the 16 control points of a bicubic patch mean.
///
/// Matrices after Termeer 2005, equations A.7 and A.15 to A.17; the factor 1/6 that is printed with the Hermite matrix
/// belongs to the B-spline's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Basis {
    /// Corner points are interpolated, the others pull. The patch lies in the convex hull of its points.
    Bezier,
    /// Uniform B-spline: nothing is interpolated, neighbours that share 12 points join with equal second derivatives.
    /// The patch lies in the convex hull of its points.
    BSpline,
    /// Interpolates the four inner points; neighbours that share 12 points join with equal first derivatives.
    CatmullRom,
    /// End points and derivatives: a curve is given by `P(0), P(1), P'(0), P'(1)`. A patch has corner points in the
    /// upper left 2 x 2 of its 4 x 4 entries, derivatives along v to their right, along u below, twists in the rest.
    Hermite,
}

impl Basis {
    /// The basis matrix: rows belong to `t³, t², t, 1`, columns to the four control points.
    pub const fn matrix(self) -> [[f64; 4]; 4] {
        const S: f64 = 1.0 / 6.0;
        match self {
            Self::Bezier => {
                [[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
            }
            Self::BSpline => [
                [-S, 3.0 * S, -3.0 * S, S],
                [3.0 * S, -6.0 * S, 3.0 * S, 0.0],
                [-3.0 * S, 0.0, 3.0 * S, 0.0],
                [S, 4.0 * S, S, 0.0],
            ],
            Self::CatmullRom => {
                [[-0.5, 1.5, -1.5, 0.5], [1.0, -2.5, 2.0, -0.5], [-0.5, 0.0, 0.5, 0.0], [0.0, 1.0, 0.0, 0.0]]
            }
            Self::Hermite => {
                [[2.0, -2.0, 1.0, 1.0], [-3.0, 3.0, -2.0, -1.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
            }
        }
    }

    /// What each control point counts at `t` in 0..=1. They add up to one (in a Hermite basis: those of the points).
    pub fn weights(self, t: f64) -> [f64; 4] {
        self.apply([t * t * t, t * t, t, 1.0])
    }

    /// The first derivatives of [`weights`](Self::weights) by `t`.
    pub fn first_derivatives(self, t: f64) -> [f64; 4] {
        self.apply([3.0 * t * t, 2.0 * t, 1.0, 0.0])
    }

    /// The second derivatives of [`weights`](Self::weights) by `t`.
    pub fn second_derivatives(self, t: f64) -> [f64; 4] {
        self.apply([6.0 * t, 2.0, 0.0, 0.0])
    }

    fn apply(self, powers: [f64; 4]) -> [f64; 4] {
        let m = self.matrix();
        std::array::from_fn(|k| (0..4).map(|row| powers[row] * m[row][k]).sum())
    }

    /// Bezier points as sums of this kind's points: whole numbers, and what to divide them by. This is the inverse of
    /// the Bezier matrix times this one, in closed form, so that neighbours come to the same points but for rounding.
    const fn bezier_points(self) -> ([[f64; 4]; 4], f64) {
        match self {
            Self::Bezier => (
                [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
                1.0,
            ),
            Self::BSpline => (
                [[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]],
                6.0,
            ),
            Self::CatmullRom => (
                [[0.0, 6.0, 0.0, 0.0], [-1.0, 6.0, 1.0, 0.0], [0.0, 1.0, 6.0, -1.0], [0.0, 0.0, 6.0, 0.0]],
                6.0,
            ),
            Self::Hermite => (
                [[3.0, 0.0, 0.0, 0.0], [3.0, 0.0, 1.0, 0.0], [0.0, 3.0, 0.0, -1.0], [0.0, 3.0, 0.0, 0.0]],
                3.0,
            ),
        }
    }

    /// The Bezier points of the curve that four points of this kind describe.
    pub fn to_bezier(self, points: [DVec3; 4]) -> [DVec3; 4] {
        let (matrix, divisor) = self.bezier_points();
        matrix.map(|row| (0..4).fold(DVec3::ZERO, |sum, k| sum + row[k] * points[k]) / divisor)
    }
}

/// A patch of one of the cubic kinds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BicubicPatch {
    /// What the points mean.
    pub basis: Basis,
    /// Four rows of four: u runs from row to row, v along a row.
    pub points: [DVec3; 16],
}

impl BicubicPatch {
    /// Position and derivatives at `(u, v)`, each in 0..=1 (Termeer 2005, equation A.10).
    pub fn at(&self, u: f64, v: f64) -> SurfacePoint {
        let by_u = self.weights_at(u);
        let by_v = self.weights_at(v);
        let sum = |du: usize, dv: usize| {
            (0..16).fold(DVec3::ZERO, |sum, k| sum + by_u[du][k / 4] * by_v[dv][k % 4] * self.points[k])
        };
        SurfacePoint {
            position: sum(0, 0),
            du: sum(1, 0),
            dv: sum(0, 1),
            duu: sum(2, 0),
            duv: sum(1, 1),
            dvv: sum(0, 2),
        }
    }

    fn weights_at(&self, t: f64) -> [[f64; 4]; 3] {
        [self.basis.weights(t), self.basis.first_derivatives(t), self.basis.second_derivatives(t)]
    }

    /// The Bezier points of the same surface.
    pub fn to_bezier(&self) -> [DVec3; 16] {
        let mut points = self.points;
        for row in points.chunks_exact_mut(4) {
            row.copy_from_slice(&self.basis.to_bezier([row[0], row[1], row[2], row[3]]));
        }
        for column in 0..4 {
            let converted = self.basis.to_bezier(std::array::from_fn(|row| points[4 * row + column]));
            for (row, point) in converted.into_iter().enumerate() {
                points[4 * row + column] = point;
            }
        }
        points
    }
}

impl From<&BicubicPatch> for BezierPatch {
    fn from(patch: &BicubicPatch) -> Self {
        Self::from_net([3, 3], patch.to_bezier().iter().map(|p| p.extend(1.0)).collect())
    }
}
