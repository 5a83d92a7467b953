//! Surfaces of patches as JSON.

use cutaway_core::glam::DVec3;
use cutaway_mesh::patches::{Basis, Nurbs, NurbsSurface, PatchError, PatchSet};
use serde::Deserialize;

use super::PatchReadError;

/// What the points of a surface mean.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Bezier,
    BSpline,
    CatmullRom,
    Hermite,
    Nurbs,
}

/// One degree for both parameters, or one for each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a degree, or a list of two: along u (the rows) and along v")]
enum Degree {
    Both(usize),
    Each([usize; 2]),
}

/// A surface as the file has it. Which fields a kind needs is checked after reading.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Surface {
    kind: Kind,
    points: Vec<[f64; 3]>,
    patches: Option<Vec<[u32; 16]>>,
    rows: Option<usize>,
    columns: Option<usize>,
    degree: Option<Degree>,
    knots_u: Option<Vec<f64>>,
    knots_v: Option<Vec<f64>>,
    weights: Option<Vec<f64>>,
}

/// Why a surface is none.
enum Wrong {
    Field(&'static str, &'static str),
    Patches(PatchError),
}

impl From<PatchError> for Wrong {
    fn from(error: PatchError) -> Self {
        Self::Patches(error)
    }
}

pub(super) fn parse(file: String, bytes: &[u8]) -> Result<PatchSet, PatchReadError> {
    // An untagged enum of the two would forget where an error is.
    let list = bytes.trim_ascii_start().first() == Some(&b'[');
    let surfaces: Result<Vec<Surface>, _> =
        if list { serde_json::from_slice(bytes) } else { serde_json::from_slice(bytes).map(|one| vec![one]) };
    let surfaces = match surfaces {
        Ok(surfaces) => surfaces,
        Err(error) => return Err(PatchReadError::Json { file, error }),
    };
    let mut sets = Vec::new();
    for (surface, read) in surfaces.into_iter().enumerate() {
        sets.push(match patches(read) {
            Ok(set) => set,
            Err(Wrong::Field(field, problem)) => {
                return Err(PatchReadError::Field { file, surface, field, problem: problem.to_owned() });
            }
            Err(Wrong::Patches(error)) => {
                return Err(PatchReadError::Patches { file, surface: Some(surface), error });
            }
        });
    }
    PatchSet::joined(sets).map_err(|error| PatchReadError::Patches { file, surface: None, error })
}

fn patches(surface: Surface) -> Result<PatchSet, Wrong> {
    let points: Vec<_> = surface.points.iter().copied().map(DVec3::from_array).collect();
    let basis = match surface.kind {
        Kind::Bezier => Basis::Bezier,
        Kind::BSpline => Basis::BSpline,
        Kind::CatmullRom => Basis::CatmullRom,
        Kind::Hermite => Basis::Hermite,
        Kind::Nurbs => return nurbs(&surface, &points),
    };
    let of_nurbs = [
        ("degree", surface.degree.is_some()),
        ("knots_u", surface.knots_u.is_some()),
        ("knots_v", surface.knots_v.is_some()),
        ("weights", surface.weights.is_some()),
    ];
    if let Some((field, _)) = of_nurbs.into_iter().find(|(_, there)| *there) {
        return Err(Wrong::Field(field, "belongs to the kind \"nurbs\"; leave it out or change the kind"));
    }
    match (surface.patches, surface.rows, surface.columns) {
        (Some(patches), None, None) => Ok(PatchSet::bicubic(basis, &points, &patches)?),
        (None, Some(rows), Some(columns)) => Ok(PatchSet::grid(basis, &points, rows, columns)?),
        _ => Err(Wrong::Field(
            "patches",
            "or else both `rows` and `columns` are expected, to say which points are a patch",
        )),
    }
}

fn nurbs(surface: &Surface, points: &[DVec3]) -> Result<PatchSet, Wrong> {
    if surface.patches.is_some() {
        return Err(Wrong::Field(
            "patches",
            "has no meaning for the kind \"nurbs\": its points are a grid; leave it out",
        ));
    }
    const MISSING: &str = "is missing; the kind \"nurbs\" needs it";
    let missing = |field| Wrong::Field(field, MISSING);
    let degree = match surface.degree.ok_or_else(|| missing("degree"))? {
        Degree::Both(degree) => [degree; 2],
        Degree::Each(degrees) => degrees,
    };
    let nurbs = Nurbs {
        degree,
        rows: surface.rows.ok_or_else(|| missing("rows"))?,
        columns: surface.columns.ok_or_else(|| missing("columns"))?,
        points,
        weights: surface.weights.as_deref(),
        knots_u: surface.knots_u.as_deref().ok_or_else(|| missing("knots_u"))?,
        knots_v: surface.knots_v.as_deref().ok_or_else(|| missing("knots_v"))?,
    };
    Ok(NurbsSurface::new(&nurbs)?.into_patches()?)
}
