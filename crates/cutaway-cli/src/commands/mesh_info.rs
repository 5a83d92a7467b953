//! `cutaway info` of a mesh: counts, whether its surface is closed, and what closing it would take.

use std::path::Path;

use cutaway_core::glam::DVec3;
use cutaway_io::mesh::{MeshReadOptions, MeshSpace, read_mesh, recognize};
use cutaway_mesh::{RepairOptions, Topology, TriangleMesh, repair};
use serde::Serialize;

use crate::report;
use crate::values::shown;

#[derive(Debug, Serialize)]
struct MeshInfo {
    file: String,
    /// Always `mesh`.
    kind: &'static str,
    format: &'static str,
    vertices: usize,
    /// Vertices that triangles use.
    used_vertices: usize,
    triangles: usize,
    /// Lowest and highest coordinates, if there are triangles.
    bounds: Option<[[f64; 3]; 2]>,
    area: f64,
    /// Signed; positive where windings are outward. Of a closed surface only it means something.
    volume: f64,
    euler: i64,
    shells: usize,
    boundary_edges: usize,
    boundary_loops: usize,
    non_manifold_edges: usize,
    inconsistent_edges: usize,
    degenerate_triangles: usize,
    /// `outward`, `inward`, `inconsistent`, or `none` where there is no volume.
    winding: &'static str,
    closed: bool,
    repair: Repair,
    notices: Vec<String>,
}

/// What `cutaway convert --repair`, and clipping, make of it.
#[derive(Debug, Serialize)]
struct Repair {
    /// What would be done, in order; nothing where the mesh is closed and outward as it is.
    changes: Vec<String>,
    /// Why it cannot be closed.
    refused: Option<String>,
    /// The mesh afterwards.
    vertices: Option<usize>,
    triangles: Option<usize>,
    volume: Option<f64>,
}

pub(crate) fn run(path: &Path, space: MeshSpace, json: bool) -> anyhow::Result<()> {
    let loaded = read_mesh(path, &MeshReadOptions { space, ..MeshReadOptions::default() })?;
    let format = recognize(path).map_or("", |format| format.name());
    let info = describe(&path.to_string_lossy(), format, &loaded.value, loaded.notices);
    let text = if json { serde_json::to_string_pretty(&info)? + "\n" } else { text(&info) };
    report::print(&text)
}

fn describe(file: &str, format: &'static str, mesh: &TriangleMesh, notices: Vec<String>) -> MeshInfo {
    let t = Topology::new(mesh);
    let winding = match t.volume {
        _ if t.inconsistent_edges > 0 => "inconsistent",
        v if v > 0.0 => "outward",
        v if v < 0.0 => "inward",
        _ => "none",
    };
    MeshInfo {
        file: file.to_owned(),
        kind: "mesh",
        format,
        vertices: t.vertices,
        used_vertices: t.used_vertices,
        triangles: t.triangles,
        bounds: t.bounds.map(|ends| ends.map(|v| v.to_array().map(|c| told(c, t.bounds)))),
        area: t.area,
        volume: t.volume,
        euler: t.euler,
        shells: t.shells,
        boundary_edges: t.boundary_edges,
        boundary_loops: t.boundary_loops,
        non_manifold_edges: t.non_manifold_edges,
        inconsistent_edges: t.inconsistent_edges,
        degenerate_triangles: t.degenerate_triangles,
        winding,
        closed: t.is_closed(),
        repair: describe_repair(mesh),
        notices,
    }
}

/// A coordinate with the digits that a mesh between these bounds has: those of single precision, or down to 1e-7 of its
/// size.
fn told(coordinate: f64, bounds: Option<[DVec3; 2]>) -> f64 {
    let single = coordinate as f32;
    if f64::from(single) == coordinate {
        return single.to_string().parse().unwrap_or(coordinate);
    }
    let size = bounds.map_or(0.0, |[low, high]| (high - low).max_element());
    let digits = (1e-7 * size).log10().ceil();
    if !(-17.0..0.0).contains(&digits) {
        return coordinate;
    }
    format!("{coordinate:.*}", -digits as usize).parse().unwrap_or(coordinate)
}

fn describe_repair(mesh: &TriangleMesh) -> Repair {
    match repair(mesh, &RepairOptions::default()) {
        Ok(repaired) => {
            let t = Topology::new(repaired.mesh.mesh());
            Repair {
                changes: repaired.notices.iter().map(ToString::to_string).collect(),
                refused: None,
                vertices: Some(t.vertices),
                triangles: Some(t.triangles),
                volume: Some(t.volume),
            }
        }
        Err(error) => Repair {
            changes: vec![],
            refused: Some(error.to_string()),
            vertices: None,
            triangles: None,
            volume: None,
        },
    }
}

fn text(info: &MeshInfo) -> String {
    let unused = info.vertices - info.used_vertices;
    let mut lines = vec![
        ("file", info.file.clone()),
        ("format", format!("{} (mesh)", info.format)),
        (
            "vertices",
            if unused > 0 {
                format!("{} ({unused} unused)", info.vertices)
            } else {
                info.vertices.to_string()
            },
        ),
        (
            "triangles",
            match info.degenerate_triangles {
                0 => info.triangles.to_string(),
                n => format!("{} ({n} degenerate)", info.triangles),
            },
        ),
    ];
    if let Some([low, high]) = info.bounds {
        let ends = (0..3).map(|i| format!("{} to {}", shown(low[i]), shown(high[i])));
        lines.push(("bounds", ends.collect::<Vec<_>>().join(", ")));
    }
    let closed = if info.closed { "yes" } else { "no" };
    lines.extend([
        ("area", shown(info.area)),
        ("volume", shown(info.volume) + if info.closed { "" } else { " (of a surface that is not closed)" }),
        ("winding", info.winding.to_owned()),
        ("shells", format!("{} (Euler number {})", info.shells, info.euler)),
        ("boundary", many(info.boundary_edges, "edge") + " in " + &many(info.boundary_loops, "loop")),
        ("non-manifold", many(info.non_manifold_edges, "edge")),
        ("inconsistent", many(info.inconsistent_edges, "edge")),
        ("closed", closed.to_owned()),
    ]);
    match (&info.repair.refused, info.repair.changes.as_slice()) {
        (Some(error), _) => lines.push(("repair", error.clone())),
        (None, []) => lines.push(("repair", "none needed".to_owned())),
        (None, changes) => {
            let labels = std::iter::once("repair").chain(std::iter::repeat(""));
            lines.extend(labels.zip(changes.iter().cloned()));
            let after = (info.repair.vertices, info.repair.triangles, info.repair.volume);
            if let (Some(vertices), Some(triangles), Some(volume)) = after {
                let volume = shown(volume);
                let after =
                    format!("then closed: {vertices} vertices, {triangles} triangles, volume {volume}");
                lines.push(("", after));
            }
        }
    }
    lines.extend(info.notices.iter().map(|notice| ("note", notice.clone())));
    lines.iter().map(|(label, value)| format!("{label:12} {}\n", value.trim_end())).collect()
}

fn many(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
