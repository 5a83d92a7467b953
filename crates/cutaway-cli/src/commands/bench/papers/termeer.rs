//! M. Termeer, *Constructive Solid Geometry and Volume Rendering* (master's thesis, TU Eindhoven, 2005).
//!
//! Its volumes are scans that are not public; here the signal of Marschner and Lobb stands for them, of the same size. It
//! fills its box, so that there is less empty space to skip than in a scan.

use serde_json::json;

use super::{Effort, Section, gpu_engine};
use crate::commands::bench::frames::{Orbit, measure, scene_of_line};
use crate::commands::statistics::StatisticsFile;
use crate::scene::Prepared;

/// Opacity with a step: a surface, behind which no sample is taken.
const STEP_LIKE: &str = "--opacity 0,0,0.49,0,0.5,1,1,1";

/// A high degree of transparency: no ray through the volume becomes opaque.
const TRANSPARENT: &str = "--opacity 0,0,1,0.01";

fn line(engine: &str, size: u32, resolution: u32, opacity: &str) -> String {
    format!(
        "sample:marschner-lobb:{size} --engine {engine} --resolution {resolution},{resolution} --step 1 --shade \
         --colormap viridis --range 0,1 {opacity}"
    )
}

/// Frames a second of the software ray caster.
pub(super) fn software(name: String, effort: Effort) -> anyhow::Result<Section> {
    let (size, resolution) = (effort.size(512), effort.size(256));
    let mut cases = Vec::new();
    let mut prepared: Option<Prepared> = None;
    for (what, opacity) in [("step-like", STEP_LIKE), ("transparent", TRANSPARENT)] {
        let line = line("cpu", size, resolution, opacity);
        let args = scene_of_line(&line)?;
        let scene = match prepared.take() {
            Some(before) => before.again(&args)?,
            None => Prepared::new(&args)?,
        };
        let orbit = Orbit { frames: effort.frames, degrees: 360.0 };
        let statistics = measure(&scene, &args, orbit, |_| Ok(()))?;
        cases.push(Case { what, line, size, statistics, paper: Some([2.0, 8.0]) });
        prepared = Some(scene);
    }
    Ok(Section {
        name,
        paper: "Termeer, Constructive Solid Geometry and Volume Rendering (2005), section 4.1.5",
        paper_says: "2 to 8 frames a second at 256 x 256 for 512 x 512 x 512 voxels on a dual Intel Xeon 3.0 GHz, \
                     step-like transfer functions much faster than transparent ones",
        measured: format!("sample:marschner-lobb:{size}, shaded, a step of one voxel"),
        rows: cases.iter().map(Case::json).collect(),
        text: Case::table(&cases),
    })
}

/// Sides of the images of figure 4.18, in pixels.
const SIDES: [u32; 6] = [128, 256, 384, 512, 768, 1024];

/// Frames a second over image size, on the CPU and on a GPU where there is one (software or real).
pub(super) fn image_size(name: String, effort: Effort) -> anyhow::Result<Section> {
    let size = effort.size(256);
    let mut cases = Vec::new();
    let mut prepared: Option<Prepared> = None;
    let engines = std::iter::once("cpu").chain(gpu_engine());
    for (engine, side) in engines.flat_map(|engine| SIDES.map(|side| (engine, side))) {
        let line = line(engine, size, effort.size(side), TRANSPARENT);
        let args = scene_of_line(&line)?;
        let scene = match prepared.take() {
            Some(before) => before.again(&args)?,
            None => Prepared::new(&args)?,
        };
        let orbit = Orbit { frames: effort.frames, degrees: 360.0 };
        let statistics = measure(&scene, &args, orbit, |_| Ok(()))?;
        cases.push(Case { what: "transparent", line, size, statistics, paper: None });
        prepared = Some(scene);
    }
    Ok(Section {
        name,
        paper: "Termeer, Constructive Solid Geometry and Volume Rendering (2005), figure 4.18",
        paper_says: "frames a second over the square root of the number of pixels, 256 x 256 x 256 voxels, medium to high \
                     transparency, (a) a dual Intel Xeon 2.8 GHz, (b) an NVIDIA GPU of 2005; curves without numbers",
        measured: format!("sample:marschner-lobb:{size}, transparent, shaded, a step of one voxel"),
        rows: cases.iter().map(Case::json).collect(),
        text: Case::table(&cases),
    })
}

/// A scene and what it took.
struct Case {
    what: &'static str,
    /// As `cutaway bench frame` takes it.
    line: String,
    /// Voxels a side.
    size: u32,
    statistics: StatisticsFile,
    /// Least and most frames a second in the paper.
    paper: Option<[f64; 2]>,
}

impl Case {
    fn frames_per_second(&self) -> f64 {
        1e3 / self.statistics.frame_ms.median
    }

    fn json(&self) -> serde_json::Value {
        json!({
            "engine": self.statistics.engine,
            "adapter": self.statistics.adapter,
            "transfer_function": self.what,
            "volume": ([self.size; 3]),
            "resolution": self.statistics.resolution,
            "frame_ms": self.statistics.frame_ms,
            "frames_per_second": self.frames_per_second(),
            "samples": self.statistics.samples,
            "paper_frames_per_second": self.paper,
            "scene": self.line,
        })
    }

    fn table(cases: &[Self]) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let heads = vec!["transfer function", "on", "image", "ms a frame", "frames/s", "paper's frames/s"];
        let row = |case: &Self| {
            let [width, height] = case.statistics.resolution;
            vec![
                case.what.to_owned(),
                case.statistics.adapter.clone().unwrap_or_else(|| case.statistics.engine.to_owned()),
                format!("{width} x {height}"),
                format!("{:.2}", case.statistics.frame_ms.median),
                format!("{:.1}", case.frames_per_second()),
                case.paper.map_or("-".to_owned(), |[least, most]| format!("{least} to {most}")),
            ]
        };
        (heads, cases.iter().map(row).collect())
    }
}
