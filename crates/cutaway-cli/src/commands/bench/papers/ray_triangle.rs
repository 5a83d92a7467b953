//! Termeer 2005, table 3.1: algorithms that tell whether a ray meets a triangle.

use std::time::Duration;

use cutaway_mesh::papers::ray_triangle::table_3_1;
use cutaway_mesh::shapes;
use serde_json::json;

use super::{Effort, Section};

/// Measures all of them on the triangles of a sphere.
pub(super) fn ray_triangle(name: String, effort: Effort) -> Section {
    let mesh = shapes::icosphere(if effort.quick { 2 } else { 5 });
    let time = Duration::from_millis(if effort.quick { 20 } else { 2000 });
    let rows = table_3_1(&mesh, time);
    let paper = |speed: Option<f64>| speed.map_or("-".to_owned(), |s| format!("{s:.2}"));
    let cells = rows.iter().map(|row| {
        vec![
            row.algorithm.name().to_owned(),
            format!("{:.2}", row.nanoseconds),
            format!("{:.2}", row.relative),
            paper(row.paper),
        ]
    });
    Section {
        name,
        paper: "Termeer 2005, table 3.1",
        paper_says: "relative speed of seven algorithms, where variant 2 is 1",
        measured: format!(
            "{} triangles of a sphere, f64, rays aimed around each of them; watertight is what events are found with, \
             the set-up of its line not counted",
            mesh.triangles().len()
        ),
        text: (vec!["algorithm", "ns a test", "relative", "paper"], cells.collect()),
        rows: rows
            .iter()
            .map(|row| {
                json!({
                    "algorithm": row.algorithm.name(),
                    "nanoseconds": row.nanoseconds,
                    "relative_speed": row.relative,
                    "paper_relative_speed": row.paper,
                })
            })
            .collect(),
    }
}
