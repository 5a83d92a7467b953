//! Spline patches: bicubic Bezier, uniform B-spline, Catmull-Rom and Hermite patches, NURBS surfaces, and triangle
//! meshes of them.
//!
//! What enters: control points. What leaves: positions, derivatives, normals and curvatures anywhere on a patch
//! ([`BezierPatch::at`]), and a [`TriangleMesh`](crate::TriangleMesh) within a tolerance ([`PatchSet::tessellate`]).
//!
//! Every kind becomes rational Bezier patches, exactly: the cubic kinds by their basis matrix ([`Basis`]), NURBS by
//! blossoming over each of their knot spans ([`NurbsSurface`]). One tessellator then serves all, and it can rely on what
//! only the Bezier form gives: bounds from control points (the convex hull), which tighten as a patch is halved, and
//! boundary curves that neighbours share as control points, not merely as shapes. That is also why the NURBS are ours:
//! the crate `curvo` would bring nalgebra and its own tessellation, a surface at a time, whose seams with the next
//! surface do not match; what would be left to use of it is the few lines that blossoming takes.
//!
//! ```
//! use cutaway_core::glam::DVec3;
//! use cutaway_mesh::patches::{Basis, PatchSet, Tessellation};
//!
//! // A sheet over 4 x 4 points, raised in its middle.
//! let height = |k: usize| if [5, 6, 9, 10].contains(&k) { 1.0 } else { 0.0 };
//! let points: Vec<_> = (0..16).map(|k| DVec3::new((k / 4) as f64, (k % 4) as f64, height(k))).collect();
//! let patches = PatchSet::bicubic(Basis::Bezier, &points, &[std::array::from_fn(|k| k as u32)])?;
//! let made = patches.tessellate(&Tessellation::within(0.01))?;
//! assert!(made.error_bound <= 0.01);
//! assert_eq!(made.boundary_loops.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod basis;
mod bezier;
mod differential;
mod nurbs;
mod orientation;
mod refine;
mod tessellate;
mod tessellation;
mod topology;
mod triangulate;

use cutaway_core::glam::DVec3;

pub use basis::{Basis, BicubicPatch};
pub use bezier::{BezierPatch, MAX_DEGREE};
pub use differential::SurfacePoint;
pub use nurbs::{Nurbs, NurbsSurface};
pub use tessellation::{Method, Tessellated, Tessellation, TessellationError};

/// Control points that a set of patches may have, all patches in Bezier form: 262,144 bicubic ones, 128 MiB.
pub const MAX_CONTROL_POINTS: usize = 1 << 22;

/// Coordinates beyond this would overflow the single precision of meshes, or the squares on the way there.
pub const MAX_COORDINATE: f64 = 1e30;

/// How much the largest weight may exceed the smallest. Beyond, the bounds of a rational patch say nothing any more.
pub const MAX_WEIGHT_RATIO: f64 = 1e6;

/// Why control points do not make patches. Everything is counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PatchError {
    /// A patch names a point that is not there.
    #[error(
        "entry {place} of patch {patch} is point {found}; there are {points} points (all counted from 0)"
    )]
    Index {
        /// Which patch.
        patch: usize,
        /// Which of its points.
        place: usize,
        /// The point it names.
        found: u32,
        /// How many points there are.
        points: usize,
    },
    /// A coordinate that is NaN, infinite or enormous.
    #[error("point {point} (counted from 0) is {found:?}; coordinates must be numbers from -1e30 to 1e30")]
    Coordinate {
        /// Which point.
        point: usize,
        /// Its coordinates.
        found: [f64; 3],
    },
    /// A weight that is not a positive number.
    #[error("weight {weight} (counted from 0) is {found}; weights must be positive and finite")]
    Weight {
        /// Which weight.
        weight: usize,
        /// What it is.
        found: f64,
    },
    /// Weights of too different size.
    #[error("weights go from {least} to {most}; the largest may be 1e6 times the smallest")]
    WeightRatio {
        /// The smallest.
        least: f64,
        /// The largest.
        most: f64,
    },
    /// A list is longer or shorter than it must be.
    #[error("found {found} {what}, expected {expected}")]
    Count {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A degree that is not supported.
    #[error("the degree along {axis} is {found}; degrees from 1 to {MAX_DEGREE} are supported")]
    Degree {
        /// `u` or `v`.
        axis: &'static str,
        /// What it is.
        found: usize,
    },
    /// Too few control points for the degree, or a grid that no patches fit into.
    #[error("found {found} points along {axis}, expected {expected}")]
    Grid {
        /// `u` or `v`.
        axis: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be, in words.
        expected: String,
    },
    /// A knot that is smaller than the one before, or not a number.
    #[error("knot {knot} (counted from 0) along {axis} is {found}, expected {expected}")]
    Knot {
        /// `u` or `v`.
        axis: &'static str,
        /// Which knot.
        knot: usize,
        /// What it is.
        found: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// More than the limit.
    #[error(
        "the patches would need {found} control points in Bezier form, more than the limit of {MAX_CONTROL_POINTS}; split the file"
    )]
    TooMany {
        /// How many.
        found: usize,
    },
    /// No patch at all.
    #[error("there are no patches, expected at least one")]
    Empty,
}

/// Patches that together are a surface, closed or not, in object space.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchSet {
    patches: Vec<BezierPatch>,
}

impl PatchSet {
    /// Takes over patches; they need not be connected.
    pub fn new(patches: Vec<BezierPatch>) -> Result<Self, PatchError> {
        let points = patches.iter().map(|p| p.net().len()).sum();
        match points {
            0 => Err(PatchError::Empty),
            found if found > MAX_CONTROL_POINTS => Err(PatchError::TooMany { found }),
            _ => Ok(Self { patches }),
        }
    }

    /// Bicubic patches of one kind, each by the indices (from 0) of its 16 points: four rows of four, u from row to row.
    /// See [`BicubicPatch`] for what a point means.
    pub fn bicubic(basis: Basis, points: &[DVec3], patches: &[[u32; 16]]) -> Result<Self, PatchError> {
        check_points(points)?;
        if patches.len() > MAX_CONTROL_POINTS / 16 {
            return Err(PatchError::TooMany { found: patches.len().saturating_mul(16) });
        }
        let mut made = Vec::with_capacity(patches.len());
        for (patch, indices) in patches.iter().enumerate() {
            if let Some(place) = indices.iter().position(|&k| k as usize >= points.len()) {
                return Err(PatchError::Index { patch, place, found: indices[place], points: points.len() });
            }
            let bicubic = BicubicPatch { basis, points: indices.map(|k| points[k as usize]) };
            made.push(BezierPatch::from(&bicubic));
        }
        Self::new(made)
    }

    /// Bicubic patches of one kind over a grid of `rows` x `columns` points: Bezier patches next to each other (every
    /// third row and column is shared), the windows of 4 x 4 points of the other kinds (a Hermite patch has its own 16).
    pub fn grid(basis: Basis, points: &[DVec3], rows: usize, columns: usize) -> Result<Self, PatchError> {
        let expected = rows.saturating_mul(columns);
        if points.len() != expected {
            return Err(PatchError::Count { what: "points", found: points.len(), expected });
        }
        let (step, text) = match basis {
            Basis::Bezier => (3, "4, 7, 10 or another multiple of 3, plus 1"),
            Basis::BSpline | Basis::CatmullRom => (1, "at least 4"),
            Basis::Hermite => (4, "a multiple of 4"),
        };
        // A Hermite grid is a table of blocks; the others overlap.
        let along = |axis, found: usize| {
            let overlap = 4 - step;
            let fits = found >= 4 && (found - overlap).is_multiple_of(step);
            let count = (found.max(overlap) - overlap) / step;
            if fits { Ok(count) } else { Err(PatchError::Grid { axis, found, expected: text.to_owned() }) }
        };
        let (by_u, by_v) = (along("u", rows)?, along("v", columns)?);
        let found = by_u.saturating_mul(by_v).saturating_mul(16);
        if found > MAX_CONTROL_POINTS {
            return Err(PatchError::TooMany { found });
        }
        let index = |i: usize, j: usize, k: usize| ((i * step + k / 4) * columns + j * step + k % 4) as u32;
        let places = (0..by_u).flat_map(|i| (0..by_v).map(move |j| (i, j)));
        let patches: Vec<_> = places.map(|(i, j)| std::array::from_fn(|k| index(i, j, k))).collect();
        Self::bicubic(basis, points, &patches)
    }

    /// The patches of several sets as one.
    pub fn joined(sets: impl IntoIterator<Item = Self>) -> Result<Self, PatchError> {
        Self::new(sets.into_iter().flat_map(|set| set.patches).collect())
    }

    /// The same surface elsewhere.
    fn moved(&self, by: DVec3) -> Self {
        let mut moved = self.clone();
        for patch in &mut moved.patches {
            let points: Vec<DVec3> = patch.points().map(|point| point + by).collect();
            patch.set_points(points.into_iter());
        }
        moved
    }

    /// The patches.
    pub fn patches(&self) -> &[BezierPatch] {
        &self.patches
    }

    /// The control points' bounding box: lowest and highest corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.patches.iter().map(BezierPatch::bounds).fold(empty, |[a, b], [c, d]| [a.min(c), b.max(d)])
    }
}

fn check_degree(axis: &'static str, found: usize) -> Result<(), PatchError> {
    if (1..=MAX_DEGREE).contains(&found) { Ok(()) } else { Err(PatchError::Degree { axis, found }) }
}

fn check_points(points: &[DVec3]) -> Result<(), PatchError> {
    // A comparison with NaN is false.
    let good = |p: &DVec3| p.to_array().iter().all(|x| x.abs() <= MAX_COORDINATE);
    match points.iter().position(|p| !good(p)) {
        Some(point) => Err(PatchError::Coordinate { point, found: points[point].to_array() }),
        None => Ok(()),
    }
}

/// Positive weights, scaled so that the largest is one: a common factor changes nothing.
fn check_weights(weights: &[f64], expected: usize) -> Result<Vec<f64>, PatchError> {
    if weights.len() != expected {
        return Err(PatchError::Count { what: "weights", found: weights.len(), expected });
    }
    if let Some(weight) = weights.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        return Err(PatchError::Weight { weight, found: weights[weight] });
    }
    let [least, most] = weights.iter().fold([f64::INFINITY, 0.0_f64], |[a, b], &w| [a.min(w), b.max(w)]);
    if most / least > MAX_WEIGHT_RATIO {
        return Err(PatchError::WeightRatio { least, most });
    }
    Ok(weights.iter().map(|w| w / most).collect())
}
