//! C. Rezk Salama and A. Kolb, *A Vertex Program for Efficient Box-Plane Intersection* (VMV 2005).
//!
//! Their volume is an angiography of a head that is not public; here a tree of vessels in noisy tissue stands for it, of the
//! same size and type, the same every time (`sample:angiography:512`).

use std::time::Instant;

use cutaway_core::angiography::{ANGIOGRAPHY_WHITE, angiography};
use cutaway_core::camera::Camera;
use cutaway_core::glam::DVec3;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Engine, Layer, RenderSettings, Scene};
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::Volume;
use cutaway_gpu::slices::{PreparedSlices, SliceStatistics};
use cutaway_gpu::{Gpu, GpuOptions, SliceRenderer};
use serde_json::json;

use super::{Effort, Section, gpu_engine};
use crate::commands::statistics::FrameTimes;

/// Cells along an edge of a brick; 0: the volume is one.
const BRICKS: [u32; 5] = [0, 64, 32, 16, 8];

/// Up to which share of the range nothing is visible.
const THRESHOLDS: [(&str, f64); 2] = [("a third", 1.0 / 3.0), ("a half", 0.5)];

/// The gain that the paper tells of, shaded, for 16 x 16 x 8 and 32 x 32 x 8 voxels.
const PAPER_GAIN: f64 = 2.5;

/// Frames a second over the size of bricks.
pub(super) fn bricks(name: String, effort: Effort) -> anyhow::Result<Section> {
    let (volume, side) = (angiography(effort.size(512)), effort.size(512));
    let dimensions = volume.dimensions();
    let mut cases: Vec<Case> = Vec::new();
    let mut adapter = String::new();
    if gpu_engine().is_some() {
        let renderer = SliceRenderer::new(&Gpu::new(&GpuOptions::default())?)?;
        adapter = renderer.gpu().adapter().name.clone();
        let prepared = renderer.prepare(&volume)?;
        for shaded in [false, true] {
            for (threshold, share) in THRESHOLDS {
                for brick_size in BRICKS {
                    let look = Look { shaded, share, brick_size, side };
                    let (frame_ms, statistics) = measure(&renderer, &prepared, &volume, &look, effort)?;
                    let unbricked = cases.iter().rfind(|c| c.brick_size == 0).map(|c| c.frame_ms.median);
                    let unbricked = unbricked.filter(|_| brick_size > 0).unwrap_or(frame_ms.median);
                    let gain = unbricked / frame_ms.median;
                    cases.push(Case { shaded, threshold, brick_size, frame_ms, statistics, gain });
                }
            }
        }
    }
    Ok(Section {
        name,
        paper: "Rezk Salama and Kolb, A Vertex Program for Efficient Box-Plane Intersection (2005), figures 4 and 5",
        paper_says: "frames a second over the size of bricks, 512 x 512 x 96 voxels, on an NVIDIA GeForce 6: without shading \
                     no gain from large bricks and the best frame rate with 32 x 32 x 8; with shading 2.5 times the frame \
                     rate with 16 x 16 x 8 and 32 x 32 x 8",
        measured: format!(
            "a synthetic angiography of {} x {} x {} voxels, {side} x {side} pixels, a step of one voxel, on {adapter}; bricks \
             are cubes",
            dimensions.x, dimensions.y, dimensions.z
        ),
        rows: cases.iter().map(|case| case.json(&adapter)).collect(),
        text: Case::table(&cases),
    })
}

/// How the volume is looked at.
struct Look {
    shaded: bool,
    /// Of the range, up to which nothing is visible.
    share: f64,
    brick_size: u32,
    /// Pixels.
    side: u32,
}

fn measure(
    renderer: &SliceRenderer,
    prepared: &PreparedSlices,
    volume: &Volume,
    look: &Look,
    effort: Effort,
) -> anyhow::Result<(FrameTimes, SliceStatistics)> {
    let at = |share: f64| share * f64::from(ANGIOGRAPHY_WHITE);
    let point = |value, color, opacity| ControlPoint { value, color, opacity };
    let function = TransferFunction::new(vec![
        point(at(look.share), [0.7, 0.1, 0.05], 0.0),
        point(at(look.share + 0.3), [1.0, 0.75, 0.5], 0.4),
    ])?;
    let settings = RenderSettings {
        engine: Engine::Slices,
        brick_size: look.brick_size,
        step: 1.0,
        resolution: [look.side; 2],
        ..RenderSettings::default()
    };
    let camera = Camera::framing(&volume.corners_in_world(), DVec3::new(0.3, 0.6, -0.7), DVec3::Z, 1.0, 1.05);
    let lighting = Lighting { shade: look.shaded, ..Lighting::default() };
    let mut scene =
        Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera.clone(), settings)?;
    let classification = renderer.classify(prepared, &scene)?;
    let mut times = Vec::new();
    let (_, mut last) = renderer.render(prepared, &classification, &scene, &|_| {})?;
    for frame in 0..effort.frames {
        let mut camera = camera.clone();
        camera.azimuth((360.0 * f64::from(frame) / f64::from(effort.frames)).to_radians());
        scene.set_camera(camera)?;
        let started = Instant::now();
        (_, last) = renderer.render(prepared, &classification, &scene, &|_| {})?;
        times.push(started.elapsed().as_secs_f64() * 1e3);
    }
    Ok((FrameTimes::of(times), last))
}

/// A brick size with one look, and what it took.
struct Case {
    shaded: bool,
    threshold: &'static str,
    brick_size: u32,
    frame_ms: FrameTimes,
    statistics: SliceStatistics,
    /// How many times as fast as without bricks.
    gain: f64,
}

impl Case {
    fn frames_per_second(&self) -> f64 {
        1e3 / self.frame_ms.median
    }

    /// What the paper tells of: bricks of 16 and 32 cells, shaded.
    fn paper_gain(&self) -> Option<f64> {
        (self.shaded && [16, 32].contains(&self.brick_size)).then_some(PAPER_GAIN)
    }

    fn json(&self, adapter: &str) -> serde_json::Value {
        json!({
            "engine": "slices",
            "adapter": adapter,
            "shaded": self.shaded,
            "transparent_below": self.threshold,
            "brick_size": self.brick_size,
            "frame_ms": self.frame_ms,
            "gpu_ms": self.statistics.gpu_ms,
            "frames_per_second": self.frames_per_second(),
            "skipped_fraction": self.statistics.skipped_fraction,
            "boxes": self.statistics.boxes,
            "slices": self.statistics.slices,
            "times_as_fast_as_without_bricks": self.gain,
            "paper_times_as_fast": self.paper_gain(),
        })
    }

    fn table(cases: &[Self]) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let heads = vec![
            "shaded",
            "transparent below",
            "bricks",
            "skipped",
            "slices",
            "ms a frame",
            "frames/s",
            "times as fast",
            "paper",
        ];
        let row = |case: &Self| {
            vec![
                if case.shaded { "yes" } else { "no" }.to_owned(),
                case.threshold.to_owned(),
                if case.brick_size == 0 { "none".to_owned() } else { case.brick_size.to_string() },
                format!("{:.0} %", 100.0 * case.statistics.skipped_fraction),
                case.statistics.slices.to_string(),
                format!("{:.1}", case.frame_ms.median),
                format!("{:.2}", case.frames_per_second()),
                format!("{:.2}", case.gain),
                case.paper_gain().map_or("-".to_owned(), |gain| format!("{gain}")),
            ]
        };
        (heads, cases.iter().map(row).collect())
    }
}
