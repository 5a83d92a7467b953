//! `cutaway info`: what a volume file is.

use cutaway_core::histogram::Histogram;
use cutaway_core::volume::{Volume, Voxels};
use serde::Serialize;

use crate::args::InfoArgs;
use crate::load::from_argument;

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
    let loaded = from_argument(&args.file, &args.raw)?;
    let info = describe(&args.file, &loaded.volume, loaded.notices.clone());
    if args.json {
        println!("{}", serde_json::to_string_pretty(&info)?);
    } else {
        print(&info);
    }
    Ok(())
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

fn print(info: &Info) {
    let [x, y, z] = info.dims;
    println!("file         {}", info.file);
    println!("dimensions   {x} x {y} x {z}");
    println!("type         {} (held as {}, {})", info.voxel_type, info.stored_as, size(info.bytes));
    println!("spacing      {}", numbers(&info.spacing));
    match &info.orientation {
        Some(letters) => {
            println!("orientation  {letters} (where the voxel axes point; the world is RAS, in mm)")
        }
        None => println!("orientation  not stated by the file"),
    }
    if info.left_handed {
        println!("handedness   left-handed grid");
    }
    for (r, row) in info.world_from_voxel.iter().take(3).enumerate() {
        let label = if r == 0 { "affine" } else { "" };
        println!("{label:12} [{}]", row.map(|v| format!("{:>11}", number(v))).join(" "));
    }
    println!("values       {} to {}", number(info.range[0]), number(info.range[1]));
    if info.replaced_voxels > 0 {
        println!("replaced     {} voxels were not finite", info.replaced_voxels);
    }
    println!("histogram    {}", sparkline(&info.histogram.counts));
    for notice in &info.notices {
        println!("note         {notice}");
    }
}

/// Bars on a logarithmic scale.
fn sparkline(counts: &[u64]) -> String {
    const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = counts.iter().max().map_or(0.0, |n| (*n as f64).ln_1p()).max(1.0);
    counts.iter().map(|n| BARS[((*n as f64).ln_1p() / most * 8.0).ceil() as usize]).collect()
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(" x ")
}

/// Six decimals, no trailing zeros.
fn number(v: f64) -> String {
    let text = format!("{v:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn size(bytes: usize) -> String {
    let mib = bytes as f64 / (1 << 20) as f64;
    if mib >= 1.0 { format!("{mib:.1} MiB") } else { format!("{:.1} KiB", mib * 1024.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!([1.0, 0.5, -0.0, 1e-9, 0.957031].map(number), ["1", "0.5", "0", "0", "0.957031"]);
        assert_eq!(sparkline(&[0, 1, 1000]).chars().count(), 3);
    }
}
