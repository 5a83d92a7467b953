//! C. Rezk Salama and A. Kolb, *A Vertex Program for Efficient Box-Plane Intersection* (VMV 2005).
//!
//! Their volume is an angiography of a head that is not public; here a tree of vessels in noisy tissue stands for it, of the
//! same size and type, the same every time.

use std::time::Instant;

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Engine, RenderSettings, Scene};
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_gpu::slices::{PreparedVolume, Statistics};
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

/// The greatest value, as of the scanners of that time.
const WHITE: f32 = 4095.0;

/// Frames a second over the size of bricks.
pub(super) fn bricks(name: String, effort: Effort) -> anyhow::Result<Section> {
    let dimensions = UVec3::new(effort.size(512), effort.size(512), effort.size(96));
    let side = effort.size(512);
    let mut cases: Vec<Case> = Vec::new();
    let mut adapter = String::new();
    if gpu_engine().is_some() {
        let volume = angiography(dimensions)?;
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
    prepared: &PreparedVolume,
    volume: &Volume,
    look: &Look,
    effort: Effort,
) -> anyhow::Result<(FrameTimes, Statistics)> {
    let at = |share: f64| share * f64::from(WHITE);
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
    let mut scene = Scene::new(volume, &function, None, camera.clone(), lighting, settings)?;
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

/// Random numbers of 0 to 1 that are the same every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }
}

/// Noisy tissue below a third of the range in an ellipsoid, with patches of denser tissue below a half, and in it a tree of
/// vessels up to the greatest value; 16 bits, spacings as of a scanner.
fn angiography(dimensions: UVec3) -> anyhow::Result<Volume> {
    let mut random = Random(20_050_512);
    let size = dimensions.as_dvec3();
    let mut voxels = Vec::with_capacity(dimensions.element_product() as usize);
    for z in 0..dimensions.z {
        for y in 0..dimensions.y {
            for x in 0..dimensions.x {
                let p = (UVec3::new(x, y, z).as_dvec3() / (size - 1.0)) * 2.0 - 1.0;
                let inside = p.x * p.x + p.y * p.y < 0.85;
                let noise = random.next();
                let tissue = if inside { 0.16 + 0.12 * noise } else { 0.03 * noise };
                voxels.push((tissue * f64::from(WHITE)) as u16);
            }
        }
    }
    let mut canvas = Canvas { dimensions, voxels, scale: size.x / 512.0 };
    for _ in 0..40 {
        let middle = DVec3::new(random.signed() * 0.6, random.signed() * 0.6, random.signed() * 0.9);
        let middle = (middle * 0.5 + 0.5) * size;
        canvas.blob(middle, (8.0 + 10.0 * random.next()) * canvas.scale, 0.38 + 0.08 * random.next());
    }
    for trunk in 0..6 {
        let angle = f64::from(trunk) * 1.05;
        let foot = DVec3::new(0.5 + 0.16 * angle.cos(), 0.5 + 0.16 * angle.sin(), 0.02) * size;
        let way = DVec3::new(0.3 * random.signed(), 0.3 * random.signed(), 0.35);
        canvas.vessel(&mut random, foot, way, 4.5, 4);
    }
    Ok(Volume::new(
        dimensions,
        canvas.voxels,
        Rescale::IDENTITY,
        Geometry::from_spacing(DVec3::new(0.45, 0.45, 1.0)),
    )?)
}

/// Voxels that vessels are painted into.
struct Canvas {
    dimensions: UVec3,
    voxels: Vec<u16>,
    /// Voxels along x of one of the full size.
    scale: f64,
}

impl Canvas {
    /// A ball of a radius in voxels along x, of a share of the greatest value, with an edge of a voxel's width.
    fn blob(&mut self, middle: DVec3, radius: f64, share: f64) {
        // Slices lie about twice as far apart as voxels within them.
        let stretch = DVec3::new(1.0, 1.0, 1.0 / 0.45);
        let reach = (radius + 1.0) / stretch;
        let last = self.dimensions.as_dvec3() - 1.0;
        let lo = (middle - reach).clamp(DVec3::ZERO, last).as_uvec3();
        let hi = (middle + reach).clamp(DVec3::ZERO, last).as_uvec3();
        for z in lo.z..=hi.z {
            for y in lo.y..=hi.y {
                for x in lo.x..=hi.x {
                    let away = ((UVec3::new(x, y, z).as_dvec3() - middle) * stretch).length();
                    let value = (share * (radius + 0.5 - away).clamp(0.0, 1.0) * f64::from(WHITE)) as u16;
                    let d = self.dimensions;
                    let voxel = &mut self.voxels[((z * d.y + y) * d.x + x) as usize];
                    *voxel = value.max(*voxel);
                }
            }
        }
    }

    /// A vessel that winds, narrows and forks.
    fn vessel(&mut self, random: &mut Random, foot: DVec3, way: DVec3, radius: f64, forks: u32) {
        let (mut at, mut way) = (foot, way.normalize());
        let steps = (40.0 + 50.0 * random.next()) as u32;
        for step in 0..steps {
            let narrowed = radius * (1.0 - 0.35 * f64::from(step) / f64::from(steps));
            self.blob(at, narrowed * self.scale, 0.55 + 0.1 * radius.min(4.5));
            let turn = DVec3::new(random.signed(), random.signed(), random.signed());
            way = (way + 0.25 * turn).normalize();
            at += way * DVec3::new(1.0, 1.0, 0.45) * (narrowed * self.scale).max(0.7);
        }
        if forks > 0 {
            for _ in 0..2 {
                let turn = DVec3::new(random.signed(), random.signed(), random.signed());
                self.vessel(random, at, way + 0.8 * turn, 0.65 * radius, forks - 1);
            }
        }
    }
}

/// A brick size with one look, and what it took.
struct Case {
    shaded: bool,
    threshold: &'static str,
    brick_size: u32,
    frame_ms: FrameTimes,
    statistics: Statistics,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angiography_is_sparse_and_the_same_every_time() {
        let volume = angiography(UVec3::new(128, 128, 24)).unwrap();
        let count = volume.voxels().len();
        let above = |share: f64| {
            let level = (share * f64::from(WHITE)) as f32;
            (0..count).filter(|i| volume.voxels().get(*i) > level).count() as f64 / count as f64
        };
        // Tissue is below a third; above a half there are vessels alone.
        assert!(
            above(1.0 / 3.0) < 0.1 && above(0.5) < 0.5 * above(1.0 / 3.0),
            "{} {}",
            above(1.0 / 3.0),
            above(0.5)
        );
        assert!(above(0.5) > 0.001, "{}", above(0.5));
        let again = angiography(UVec3::new(128, 128, 24)).unwrap();
        assert!((0..count).all(|i| volume.voxels().get(i) == again.voxels().get(i)));
    }
}
