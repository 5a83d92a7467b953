//! `cutaway info` of a transfer function: its points, its unit, and the light that comes with it.

use std::path::Path;

use cutaway_core::lighting::Lighting;
use cutaway_core::transfer_function::ControlPoint;
use cutaway_io::transfer_function::{FunctionFile, FunctionFormat, read_transfer_function};
use serde::Serialize;

use crate::report;
use crate::values::shown;

#[derive(Debug, Serialize)]
struct FunctionInfo {
    file: String,
    /// Always `transfer function`.
    kind: &'static str,
    format: &'static str,
    name: Option<String>,
    /// None: the opacities are for the mean voxel spacing.
    unit_distance: Option<f64>,
    range: [f64; 2],
    has_opacities: bool,
    points: Vec<ControlPoint>,
    lighting: Option<Lighting>,
    notices: Vec<String>,
}

pub(super) fn run(path: &Path, format: FunctionFormat, json: bool) -> anyhow::Result<()> {
    let loaded = read_transfer_function(path)?;
    let info = describe(&path.to_string_lossy(), format, loaded.value, loaded.notices);
    let text = if json { serde_json::to_string_pretty(&info)? + "\n" } else { text(&info) };
    report::print(&text)
}

fn describe(file: &str, format: FunctionFormat, read: FunctionFile, notices: Vec<String>) -> FunctionInfo {
    let points = read.function.points().to_vec();
    FunctionInfo {
        file: file.to_owned(),
        kind: "transfer function",
        format: format.name(),
        name: read.name,
        unit_distance: read.unit_distance,
        range: [points[0].value, points[points.len() - 1].value],
        has_opacities: read.has_opacities,
        points,
        lighting: read.lighting,
        notices,
    }
}

/// Points that are listed; a file may have thousands.
const LISTED: usize = 32;

fn text(info: &FunctionInfo) -> String {
    let unit = info.unit_distance.map_or("the mean voxel spacing".to_owned(), shown);
    let mut lines = vec![("file", info.file.clone()), ("kind", format!("{} ({})", info.kind, info.format))];
    // A name comes from the file: on one line, whatever is in it.
    lines.extend(info.name.iter().map(|name| ("name", name.escape_debug().take(200).collect())));
    lines.push(("values", info.range.map(shown).join(" to ")));
    lines.push(("opacities", format!("for a length of {unit}")));
    if let Some(light) = &info.lighting {
        let factors = [light.ambient, light.diffuse, light.specular, light.specular_power].map(shown);
        let [ambient, diffuse, specular, power] = factors;
        let shade = if light.shade { "on" } else { "off" };
        let factors = format!("ambient {ambient}, diffuse {diffuse}, specular {specular}, power {power}");
        lines.push(("light", format!("{shade}; {factors}")));
    }
    lines.push(("points", info.points.len().to_string()));
    lines.extend(info.points.iter().take(LISTED).map(|p| {
        let [r, g, b] = p.color.map(shown);
        ("", format!("{:>12}  opacity {:<10}  colour {r} {g} {b}", shown(p.value), shown(p.opacity)))
    }));
    if info.points.len() > LISTED {
        lines.push(("", format!("and {} more (--json lists all)", info.points.len() - LISTED)));
    }
    lines.extend(info.notices.iter().map(|notice| ("note", notice.clone())));
    lines.iter().map(|(label, value)| format!("{label:12} {}\n", value.trim_end())).collect()
}
