//! `cutaway info` of an unstructured grid: counts, box, values.

use cutaway_core::histogram::Histogram;
use cutaway_core::tetrahedra::TetrahedralMesh;
use serde::Serialize;

use super::info::sparkline;
use crate::load::LoadedVolume;
use crate::report;
use crate::values::{shown, shown_range};

/// Bins of the histogram.
const BINS: usize = 64;

#[derive(Debug, Serialize)]
struct TetrahedraInfo {
    file: String,
    /// Always `tetrahedra`.
    kind: &'static str,
    points: usize,
    tetrahedra: usize,
    /// Tetrahedra without volume.
    flat: usize,
    /// Lowest and highest corner of the box, in world units.
    bounds: [[f64; 3]; 2],
    range: [f64; 2],
    notices: Vec<String>,
}

pub(super) fn run(loaded: &LoadedVolume, mesh: &TetrahedralMesh, json: bool) -> anyhow::Result<()> {
    let info = TetrahedraInfo {
        file: loaded.name.clone(),
        kind: "tetrahedra",
        points: mesh.points().len(),
        tetrahedra: mesh.cells().len(),
        flat: (0..mesh.cells().len()).filter(|cell| mesh.gradient(*cell).is_none()).count(),
        bounds: mesh.bounds().map(|corner| corner.to_array()),
        range: mesh.lattice().value_range(),
        notices: loaded.notices.clone(),
    };
    if json {
        return report::print(&(serde_json::to_string_pretty(&info)? + "\n"));
    }
    let [lo, hi] = info.bounds.map(|corner| corner.map(shown).join(", "));
    let mut lines = vec![
        ("file", info.file.clone()),
        ("kind", "unstructured grid (rendered by `--engine cells`)".to_owned()),
        ("points", info.points.to_string()),
        ("tetrahedra", format!("{} ({} of them without volume)", info.tetrahedra, info.flat)),
        ("box", format!("{lo} to {hi}")),
        ("values", shown_range(info.range)),
        ("histogram", sparkline(&Histogram::new(mesh.lattice(), BINS).counts)),
    ];
    lines.extend(info.notices.iter().map(|notice| ("note", notice.clone())));
    let text: String =
        lines.iter().map(|(label, value)| format!("{label:12} {}\n", value.trim_end())).collect();
    report::print(&text)
}
