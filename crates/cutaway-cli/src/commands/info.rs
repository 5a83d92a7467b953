//! `cutaway info`: what a volume file is; meshes, transfer functions and GPUs have files of their own.

use cutaway_core::histogram::Histogram;
use cutaway_core::volume::{Volume, Voxels};
use serde::Serialize;

use super::{function_info, gpu_info, mesh_info, tetrahedra_info};
use crate::args::InfoArgs;
use crate::load::{from_argument, function_format, is_grid, is_mesh};
use crate::report::{self, wrong_use};
use crate::values::{shown, shown_range};

/// Bins of the histogram.
const BINS: usize = 64;

#[derive(Debug, Serialize)]
struct Info {
    file: String,
    dims: [u32; 3],
    #[serde(rename = "type")]
    voxel_type: &'static str,
    stored_as: &'static str,
    spacing: [f64; 3],
    /// Rows of the 4 x 4 matrix from voxel indices to the world.
    world_from_voxel: [[f64; 4]; 4],
    /// Directions in which voxel indices grow, where the file tells.
    orientation: Option<String>,
    /// `RAS` or `unknown`.
    world: &'static str,
    left_handed: bool,
    range: [f64; 2],
    histogram: HistogramInfo,
    replaced_voxels: usize,
    bytes: usize,
    notices: Vec<String>,
}

#[derive(Debug, Serialize)]
struct HistogramInfo {
    range: [f64; 2],
    counts: Vec<u64>,
}

pub(crate) fn run(args: &InfoArgs) -> anyhow::Result<()> {
    let file = match &args.file {
        Some(file) => file,
        None => return gpu_info::run(args.json),
    };
    if let Some(format) = function_format(file, &args.raw) {
        return function_info::run(file.as_ref(), format, args.json);
    }
    if is_mesh(file, &args.raw) {
        return mesh_info::run(file.as_ref(), args.mesh_space.unwrap_or_default(), args.json);
    }
    if args.mesh_space.is_some() {
        let file = file.display();
        return Err(wrong_use(format!("--mesh-space is for meshes; {file} is not recognized as a mesh")));
    }
    if is_grid(file, &args.raw) {
        return tetrahedra_info::run(file.as_ref(), args.raw.volume_index, args.json);
    }
    let loaded = from_argument(file, &args.raw)?;
    let info = describe(&loaded.name, loaded.lattice(), loaded.notices.clone());
    let text = if args.json { serde_json::to_string_pretty(&info)? + "\n" } else { text(&info) };
    report::print(&text)
}

fn describe(file: &str, volume: &Volume, notices: Vec<String>) -> Info {
    let m = volume.world_from_voxel();
    let row = |r: usize| {
        let [x, y, z] = m.matrix3.row(r).to_array();
        [x, y, z, m.translation[r]]
    };
    let histogram = Histogram::new(volume, BINS);
    Info {
        file: file.to_owned(),
        dims: volume.dimensions().to_array(),
        voxel_type: volume.source_type().name(),
        stored_as: match volume.voxels() {
            Voxels::U8(_) => "uint8",
            Voxels::U16(_) => "uint16",
            Voxels::F32(_) => "float32",
        },
        spacing: volume.spacing().to_array(),
        world_from_voxel: [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
        orientation: volume.orientation().map(|letters| letters.iter().collect()),
        world: if volume.orientation().is_some() { "RAS" } else { "unknown" },
        left_handed: m.matrix3.determinant() < 0.0,
        range: volume.value_range(),
        histogram: HistogramInfo { range: histogram.range, counts: histogram.counts },
        replaced_voxels: volume.replaced(),
        bytes: volume.voxels().bytes(),
        notices,
    }
}

fn text(info: &Info) -> String {
    let [x, y, z] = info.dims;
    let affine = info.world_from_voxel.iter().take(3);
    let affine = affine.map(|row| format!("[{}]", row.map(|v| format!("{:>11}", shown(v))).join(" ")));
    let mut lines = vec![
        ("file", info.file.clone()),
        ("dimensions", format!("{x} x {y} x {z}")),
        ("type", format!("{} (held as {}, {})", info.voxel_type, info.stored_as, size(info.bytes))),
        ("spacing", info.spacing.map(shown).join(" x ")),
        (
            "orientation",
            match &info.orientation {
                Some(letters) => {
                    format!("{letters} (where the voxel axes point; the world is RAS, in mm)")
                }
                None => "not stated by the file".to_owned(),
            },
        ),
    ];
    if info.left_handed {
        lines.push(("handedness", "left-handed grid".to_owned()));
    }
    lines.extend(["affine", "", ""].into_iter().zip(affine));
    lines.push(("values", shown_range(info.range)));
    if info.replaced_voxels > 0 {
        lines.push(("replaced", format!("{} voxels were not finite", info.replaced_voxels)));
    }
    lines.push(("histogram", sparkline(&info.histogram.counts)));
    lines.extend(info.notices.iter().map(|notice| ("note", notice.clone())));
    lines.iter().map(|(label, value)| format!("{label:12} {}\n", value.trim_end())).collect()
}

/// Bars on a logarithmic scale.
pub(super) fn sparkline(counts: &[u64]) -> String {
    const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = counts.iter().max().map_or(0.0, |n| (*n as f64).ln_1p()).max(1.0);
    counts.iter().map(|n| BARS[((*n as f64).ln_1p() / most * 8.0).ceil() as usize]).collect()
}

fn size(bytes: usize) -> String {
    let (kib, mib) = (bytes as f64 / 1024.0, bytes as f64 / f64::from(1 << 20));
    match bytes {
        0..10_240 => format!("{bytes} bytes"),
        10_240..1_048_576 => format!("{kib:.1} KiB"),
        _ => format!("{mib:.1} MiB"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histograms_have_a_bar_a_bin() {
        assert_eq!(sparkline(&[0, 1, 1000]), " ▁█");
        assert_eq!(sparkline(&[0, 0]), "  ");
    }
}
