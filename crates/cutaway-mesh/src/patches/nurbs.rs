//! NURBS surfaces: non-uniform rational B-splines of any degree, as the Bezier patches that they are made of.
//!
//! Over a span between two knots a B-spline is one polynomial. Its Bezier points are values of the span's *blossom*,
//! the symmetric multi-affine function `f` with `f(t, .., t) = C(t)`: `b_k = f(a, .., a, b, .., b)` with k times the
//! span's end b (Ramshaw 1989). De Boor's algorithm computes any of them, with one argument a step. Weights are a
//! fourth coordinate.

use cutaway_core::glam::{DVec3, DVec4};

use super::{
    BezierPatch, MAX_CONTROL_POINTS, PatchError, PatchSet, SurfacePoint, check_degree, check_points,
    check_weights,
};

/// Knots closer than this much of the knots' range are one knot: a rounding, which would make a span of rounding too.
const KNOT_NOISE: f64 = 1e-9;

/// What a NURBS surface is given by. u runs from row to row, v along a row.
#[derive(Clone, Copy, Debug)]
pub struct Nurbs<'a> {
    /// Along u and v.
    pub degree: [usize; 2],
    /// Control points along u.
    pub rows: usize,
    /// Control points along v.
    pub columns: usize,
    /// Row by row.
    pub points: &'a [DVec3],
    /// One a point, positive; all one if there are none.
    pub weights: Option<&'a [f64]>,
    /// Knots along u, never decreasing: `rows + degree + 1`.
    pub knots_u: &'a [f64],
    /// Knots along v: `columns + degree + 1`.
    pub knots_v: &'a [f64],
}

/// A NURBS surface, as a rational Bezier patch for each pair of knot spans.
#[derive(Clone, Debug, PartialEq)]
pub struct NurbsSurface {
    /// Ends of the spans, rising.
    breaks: [Vec<f64>; 2],
    /// For each span along u those along v.
    patches: Vec<BezierPatch>,
}

impl NurbsSurface {
    /// Checks, and splits at the knots.
    pub fn new(nurbs: &Nurbs<'_>) -> Result<Self, PatchError> {
        let [p, q] = nurbs.degree;
        let along_u = Axis::new("u", p, nurbs.rows, nurbs.knots_u)?;
        let along_v = Axis::new("v", q, nurbs.columns, nurbs.knots_v)?;
        let expected = nurbs.rows.saturating_mul(nurbs.columns);
        if nurbs.points.len() != expected {
            return Err(PatchError::Count { what: "points", found: nurbs.points.len(), expected });
        }
        check_points(nurbs.points)?;
        let weights =
            nurbs.weights.map_or_else(|| Ok(vec![1.0; expected]), |w| check_weights(w, expected))?;
        // What is held on the way, and in the end.
        let rows = along_u.spans.len() * (p + 1);
        let most = rows.saturating_mul((along_v.spans.len() * (q + 1)).max(nurbs.columns));
        if most > MAX_CONTROL_POINTS {
            return Err(PatchError::TooMany { found: most });
        }
        let net: Vec<_> = nurbs.points.iter().zip(weights).map(|(p, w)| (*p * w).extend(w)).collect();
        let patches = split(&net, nurbs.columns, &along_u, &along_v);
        Ok(Self { breaks: [along_u.breaks(), along_v.breaks()], patches })
    }

    /// The range of u and of v.
    pub fn domain(&self) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| [self.breaks[axis][0], self.breaks[axis][self.breaks[axis].len() - 1]])
    }

    /// The Bezier patches, those along v together.
    pub fn patches(&self) -> &[BezierPatch] {
        &self.patches
    }

    /// The patches as a set, for tessellation.
    pub fn into_patches(self) -> Result<PatchSet, PatchError> {
        PatchSet::new(self.patches)
    }

    /// Position and derivatives at `(u, v)` in the range of the knots; outside, those of the nearest span, continued.
    pub fn at(&self, u: f64, v: f64) -> SurfacePoint {
        let [(i, s, by_u), (j, t, by_v)] = [(0, u), (1, v)].map(|(axis, x)| locate(&self.breaks[axis], x));
        let point = self.patches[i * (self.breaks[1].len() - 1) + j].at(s, t);
        SurfacePoint {
            position: point.position,
            du: point.du * by_u,
            dv: point.dv * by_v,
            duu: point.duu * (by_u * by_u),
            duv: point.duv * (by_u * by_v),
            dvv: point.dvv * (by_v * by_v),
        }
    }
}

/// The span of `x`, the place in it (0 to 1), and the factor of a derivative.
fn locate(breaks: &[f64], x: f64) -> (usize, f64, f64) {
    let span = breaks.partition_point(|b| *b <= x).clamp(1, breaks.len() - 1) - 1;
    let width = breaks[span + 1] - breaks[span];
    (span, (x - breaks[span]) / width, 1.0 / width)
}

/// Degree and knots along a parameter.
struct Axis {
    degree: usize,
    knots: Vec<f64>,
    /// The knots that begin a span of more than no length, inside the domain.
    spans: Vec<usize>,
}

impl Axis {
    fn new(axis: &'static str, degree: usize, points: usize, knots: &[f64]) -> Result<Self, PatchError> {
        check_degree(axis, degree)?;
        if points <= degree {
            let expected = format!("at least {} for degree {degree}", degree + 1);
            return Err(PatchError::Grid { axis, found: points, expected });
        }
        let expected = points.saturating_add(degree + 1);
        if knots.len() != expected {
            let what = if axis == "u" { "knots along u" } else { "knots along v" };
            return Err(PatchError::Count { what, found: knots.len(), expected });
        }
        let knots = snapped(axis, knots)?;
        let spans: Vec<_> = (degree..points).filter(|&k| knots[k + 1] > knots[k]).collect();
        if spans.is_empty() {
            let expected = "a knot that is larger than the ones before";
            return Err(PatchError::Knot { axis, knot: points, found: knots[points], expected });
        }
        Ok(Self { degree, knots, spans })
    }

    fn breaks(&self) -> Vec<f64> {
        let last = self.spans[self.spans.len() - 1] + 1;
        self.spans.iter().copied().chain([last]).map(|k| self.knots[k]).collect()
    }

    /// The Bezier points of one span of the curve whose control points `point` gives.
    fn bezier(&self, span: usize, point: impl Fn(usize) -> DVec4, out: impl FnMut((usize, DVec4))) {
        let p = self.degree;
        let [a, b] = [self.knots[span], self.knots[span + 1]];
        let points = (0..=p).map(|k| {
            let mut d: [DVec4; super::MAX_DEGREE + 1] =
                std::array::from_fn(|j| if j <= p { point(span - p + j) } else { DVec4::ZERO });
            for step in 1..=p {
                let x = if step <= p - k { a } else { b };
                for j in (step..=p).rev() {
                    // The interval holds the span, so its length is not zero.
                    let (low, high) = (self.knots[span - p + j], self.knots[span + 1 + j - step]);
                    d[j] = d[j - 1] + (d[j] - d[j - 1]) * ((x - low) / (high - low));
                }
            }
            (k, d[p])
        });
        points.for_each(out);
    }
}

/// Knots that never decrease, those that differ by rounding made equal.
fn snapped(axis: &'static str, knots: &[f64]) -> Result<Vec<f64>, PatchError> {
    let wrong = |knot: usize, expected| PatchError::Knot { axis, knot, found: knots[knot], expected };
    if let Some(knot) = knots.iter().position(|k| !k.is_finite() || k.abs() > super::MAX_COORDINATE) {
        return Err(wrong(knot, "a number from -1e30 to 1e30"));
    }
    if let Some(knot) = (1..knots.len()).find(|&k| knots[k] < knots[k - 1]) {
        return Err(wrong(knot, "no less than the knot before"));
    }
    let noise = KNOT_NOISE * (knots[knots.len() - 1] - knots[0]);
    let mut snapped = knots.to_vec();
    for k in 1..snapped.len() {
        if snapped[k] - snapped[k - 1] <= noise {
            snapped[k] = snapped[k - 1];
        }
    }
    Ok(snapped)
}

/// First along u, column by column, then along v.
fn split(net: &[DVec4], columns: usize, along_u: &Axis, along_v: &Axis) -> Vec<BezierPatch> {
    let [p, q] = [along_u.degree, along_v.degree];
    let mut patches = Vec::with_capacity(along_u.spans.len() * along_v.spans.len());
    let mut band = vec![DVec4::ZERO; (p + 1) * columns];
    for &u_span in &along_u.spans {
        for column in 0..columns {
            let point = |k: usize| net[k * columns + column];
            along_u.bezier(u_span, point, |(k, value)| band[k * columns + column] = value);
        }
        for &v_span in &along_v.spans {
            let mut points = vec![DVec4::ZERO; (p + 1) * (q + 1)];
            for (row, out) in band.chunks_exact(columns).zip(points.chunks_exact_mut(q + 1)) {
                along_v.bezier(v_span, |k| row[k], |(k, value)| out[k] = value);
            }
            patches.push(BezierPatch::from_net([p, q], points));
        }
    }
    patches
}
