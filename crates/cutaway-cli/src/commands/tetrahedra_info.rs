//! `cutaway info` of an unstructured grid: counts, box, arrays, values where it has any.

use std::path::Path;

use cutaway_core::glam::{DMat3, DVec3};
use cutaway_core::histogram::Histogram;
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_io::tetrahedra::{ArrayInfo, Grid, TetrahedraReadOptions, read_grid};
use serde::Serialize;

use super::info::sparkline;
use crate::report;
use crate::values::{shown, shown_range};

/// Bins of the histogram.
const BINS: usize = 64;

/// Arrays that are listed; a file may have many.
const LISTED: usize = 32;

#[derive(Debug, Serialize)]
struct TetrahedraInfo {
    file: String,
    /// Always `tetrahedra`.
    kind: &'static str,
    points: usize,
    tetrahedra: usize,
    /// Tetrahedra without volume.
    flat: usize,
    /// Lowest and highest corner of the box, in world units; none: there are no points.
    bounds: Option<[[f64; 3]; 2]>,
    /// The array that the values come from; none: there are no values.
    values: Option<String>,
    /// `point` or `cell`.
    values_on: Option<&'static str>,
    range: Option<[f64; 2]>,
    arrays: Vec<Array>,
    time: Option<f64>,
    notices: Vec<String>,
}

/// An array of the file.
#[derive(Debug, Serialize)]
struct Array {
    name: String,
    on: &'static str,
    /// Numbers per point or cell; 0: text.
    components: u64,
}

impl Array {
    fn new(array: &ArrayInfo) -> Self {
        Self { name: array.name.clone(), on: array.on.name(), components: array.components }
    }

    fn text(&self) -> String {
        // A name comes from the file: on one line, whatever is in it.
        let name: String = self.name.escape_debug().take(200).collect();
        match self.components {
            0 => format!("{name} ({} data of text)", self.on),
            1 => format!("{name} ({} data)", self.on),
            n => format!("{name} ({} data of {n} components)", self.on),
        }
    }
}

pub(super) fn run(path: &Path, time_step: Option<usize>, json: bool) -> anyhow::Result<()> {
    let grid = read_grid(path, &TetrahedraReadOptions { time_step, ..TetrahedraReadOptions::default() })?;
    let mut info = describe(&path.to_string_lossy(), &grid);
    let mesh = mesh(grid, &mut info);
    info.range = mesh.as_ref().map(|mesh| mesh.lattice().value_range());
    if json {
        return report::print(&(serde_json::to_string_pretty(&info)? + "\n"));
    }
    report::print(&text(&info, mesh.as_ref()))
}

fn describe(file: &str, grid: &Grid) -> TetrahedraInfo {
    TetrahedraInfo {
        file: file.to_owned(),
        kind: "tetrahedra",
        points: grid.points().len(),
        tetrahedra: grid.tetrahedra().len(),
        flat: grid.tetrahedra().iter().filter(|corners| is_flat(grid.points(), corners)).count(),
        bounds: bounds(grid),
        values: grid.values().map(|(name, _)| name.to_owned()),
        values_on: grid.values().map(|(_, on)| on.name()),
        range: None,
        arrays: grid.arrays().iter().map(Array::new).collect(),
        time: grid.time(),
        notices: grid.notices(),
    }
}

/// The grid as it is rendered, or a notice that says why it is not.
fn mesh(grid: Grid, info: &mut TetrahedraInfo) -> Option<TetrahedralMesh> {
    if grid.values().is_none() {
        info.notices.push("there are no values, so that it cannot be rendered".to_owned());
        return None;
    }
    match grid.into_loaded() {
        Ok(loaded) => {
            info.notices = loaded.notices;
            Some(loaded.value)
        }
        Err(error) => {
            info.notices.push(format!("it cannot be rendered: {error}"));
            None
        }
    }
}

/// The box of the points that tetrahedra use; of all points where there are no tetrahedra.
fn bounds(grid: &Grid) -> Option<[[f64; 3]; 2]> {
    let points = grid.points();
    let box_of = |used: &mut dyn Iterator<Item = DVec3>| {
        let first = used.next()?;
        let [lo, hi] = used.fold([first; 2], |[lo, hi], p| [lo.min(p), hi.max(p)]);
        (lo.is_finite() && hi.is_finite()).then(|| [lo.to_array(), hi.to_array()])
    };
    if grid.tetrahedra().is_empty() {
        return box_of(&mut points.iter().copied());
    }
    box_of(&mut grid.tetrahedra().as_flattened().iter().map(|corner| points[*corner as usize]))
}

/// Whether a tetrahedron has no volume but for rounding of its coordinates.
fn is_flat(points: &[DVec3], corners: &[u32; 4]) -> bool {
    let [p, a, b, c] = corners.map(|corner| points[corner as usize]);
    let edges = DMat3::from_cols(a - p, b - p, c - p);
    let longest = edges.x_axis.length().max(edges.y_axis.length()).max(edges.z_axis.length());
    edges.determinant().abs() <= 1e-12 * longest.powi(3)
}

fn text(info: &TetrahedraInfo, mesh: Option<&TetrahedralMesh>) -> String {
    let bounds = info.bounds.map(|ends| ends.map(|corner| corner.map(shown).join(", ")).join(" to "));
    let mut lines = vec![
        ("file", info.file.clone()),
        ("kind", "unstructured grid (rendered by `--engine cells`)".to_owned()),
        ("points", info.points.to_string()),
        ("tetrahedra", format!("{} ({} of them without volume)", info.tetrahedra, info.flat)),
        ("box", bounds.unwrap_or_else(|| "none".to_owned())),
    ];
    lines.extend(info.time.map(|time| ("time", shown(time))));
    let labels = std::iter::once("arrays").chain(std::iter::repeat(""));
    lines.extend(labels.zip(info.arrays.iter().take(LISTED).map(Array::text)));
    if info.arrays.len() > LISTED {
        lines.push(("", format!("and {} more (--json lists all)", info.arrays.len() - LISTED)));
    }
    match (&info.values, info.range, mesh) {
        (Some(name), Some(range), Some(mesh)) => {
            let name: String = name.escape_debug().take(200).collect();
            lines.push(("values", format!("{} ({name})", shown_range(range))));
            lines.push(("histogram", sparkline(&Histogram::new(mesh.lattice(), BINS).counts)));
        }
        _ => lines.push(("values", "none".to_owned())),
    }
    lines.extend(info.notices.iter().map(|notice| ("note", notice.clone())));
    lines.iter().map(|(label, value)| format!("{label:12} {}\n", value.trim_end())).collect()
}
