//! A. Maximo, R. Marroquim, R. Farias, C. Esperança, *GPU-based cell projection for large structured data sets* (2007): tables
//! 1 and 2, frames and tetrahedra a second, and how a frame divides into setting up and drawing.
//!
//! Bundled samples stand for the paper's volumes. As a mesh, a head is cut into as many tetrahedra as other renderers of
//! meshes are tried on: 149 thousand and 1.25 million.

use std::time::Instant;

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::histogram::default_for_mode;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_gpu::{CellOptions, CellRenderer, CellStatistics, Gpu, GpuOptions};
use cutaway_io::samples::read_sample;
use cutaway_io::volume::ReadOptions;
use serde_json::json;

use super::{Effort, Section, gpu_engine};

/// Samples, as they are.
const GRIDS: [&str; 3] = ["mr-head", "bonsai", "marschner-lobb:64"];

/// Points a side of the head as a mesh.
const SIDES: [u32; 2] = [32, 64];

/// Regular grids under parallel rays.
pub(super) fn regular(name: String, effort: Effort) -> anyhow::Result<Section> {
    let mut cases = Vec::new();
    if gpu_engine().is_some() {
        for sample in GRIDS {
            let mut volume = read_sample(sample, &ReadOptions::default())?.value;
            if effort.quick {
                volume = resampled(&volume, 16)?;
            }
            cases.push(measure(sample.to_owned(), &volume, None, true, effort)?);
        }
    }
    let measured = "bundled samples, unlit, parallel rays, a rotating view; only visible tetrahedra that meet a pixel's centre \
                    are drawn (effective)";
    Ok(section(name, measured, &cases))
}

/// Meshes of tetrahedra in perspective.
pub(super) fn unstructured(name: String, effort: Effort) -> anyhow::Result<Section> {
    let mut cases = Vec::new();
    if gpu_engine().is_some() {
        let head = read_sample("mr-head", &ReadOptions::default())?.value;
        for side in SIDES {
            let volume = resampled(&head, effort.size(side))?;
            let mesh = TetrahedralMesh::from_volume(&volume)?;
            let case = format!("head, {side} points a side");
            cases.push(measure(case, mesh.lattice(), Some(&mesh), false, effort)?);
        }
    }
    let measured = "the bundled head as a mesh of tetrahedra, sorted by centroids, unlit, in perspective, a rotating view";
    Ok(section(name, measured, &cases))
}

/// Every so many-th voxel, so many a side.
fn resampled(volume: &Volume, side: u32) -> anyhow::Result<Volume> {
    let far = (volume.dimensions() - UVec3::ONE).as_dvec3();
    let share = |i: u32| f64::from(i) / f64::from(side - 1);
    let mut values = Vec::new();
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                let p = (far * DVec3::new(share(x), share(y), share(z))).round().as_i64vec3();
                values.push(volume.value_clamped(p.x, p.y, p.z) as f32);
            }
        }
    }
    let spacing = volume.spacing() * far / f64::from(side - 1);
    Ok(Volume::new(UVec3::splat(side), values, Rescale::IDENTITY, Geometry::from_spacing(spacing))?)
}

/// A volume or mesh, and what a frame of it takes.
struct Case {
    what: String,
    vertices: u64,
    statistics: CellStatistics,
    /// The median frame of those that are not timed apart.
    frame_ms: f64,
    adapter: String,
}

fn measure(
    what: String,
    volume: &Volume,
    mesh: Option<&TetrahedralMesh>,
    parallel: bool,
    effort: Effort,
) -> anyhow::Result<Case> {
    let side = effort.size(512);
    let settings = RenderSettings { resolution: [side, side], ..RenderSettings::default() };
    let mut camera = default_camera(volume, 1.0);
    if parallel {
        let [lo, .., hi] = volume.corners_in_world();
        camera.orthographic = Some(0.4 * lo.distance(hi));
    }
    let lighting = Lighting { shade: false, ..Lighting::default() };
    let function = default_for_mode(volume, Mode::Composite);
    let mut scene =
        Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings)?;
    let mut renderer = CellRenderer::new(&Gpu::new(&GpuOptions::default())?, CellOptions::default())?;
    let cells = match mesh {
        Some(mesh) => renderer.prepare_mesh(mesh)?,
        None => renderer.prepare(volume)?,
    };
    let classification = renderer.classify(&cells, &scene)?;
    // The first frame makes pipelines.
    renderer.render(&cells, &classification, &scene, &|_| {})?;
    let mut times = Vec::new();
    for _ in 0..effort.frames {
        let mut camera = scene.camera().clone();
        camera.azimuth(std::f64::consts::TAU / f64::from(effort.frames));
        scene.set_camera(camera)?;
        let started = Instant::now();
        renderer.render(&cells, &classification, &scene, &|_| {})?;
        times.push(started.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    let frame_ms = times[times.len() / 2];
    renderer.set_options(CellOptions { timed: true, ..CellOptions::default() });
    let (_, statistics) = renderer.render(&cells, &classification, &scene, &|_| {})?;
    let vertices = mesh.map_or(volume.voxels().len(), |mesh| mesh.points().len()) as u64;
    Ok(Case { what, vertices, statistics, frame_ms, adapter: renderer.gpu().adapter().name.clone() })
}

impl Case {
    /// Millions a second.
    fn rate(&self, tetrahedra: u64) -> f64 {
        tetrahedra as f64 / self.frame_ms / 1e3
    }

    fn draw_share(&self) -> f64 {
        self.statistics.draw_ms / (self.statistics.setup_ms + self.statistics.draw_ms).max(1e-9)
    }
}

fn section(name: String, measured: &str, cases: &[Case]) -> Section {
    let rows = cases.iter().map(|case| {
        json!({
            "data_set": case.what,
            "adapter": case.adapter,
            "vertices": case.vertices,
            "tetrahedra": case.statistics.nominal,
            "drawn": case.statistics.drawn,
            "frame_ms": case.frame_ms,
            "mtet_per_s_nominal": case.rate(case.statistics.nominal),
            "mtet_per_s_effective": case.rate(case.statistics.drawn),
            "setup_ms": case.statistics.setup_ms,
            "draw_ms": case.statistics.draw_ms,
            "draw_share": case.draw_share(),
        })
    });
    let heads = vec![
        "data set",
        "vertices",
        "tetrahedra",
        "fps",
        "M tet/s",
        "effective",
        "setup ms",
        "draw ms",
        "drawing",
    ];
    let cells = cases.iter().map(|case| {
        vec![
            case.what.clone(),
            case.vertices.to_string(),
            case.statistics.nominal.to_string(),
            format!("{:.2}", 1e3 / case.frame_ms),
            format!("{:.2}", case.rate(case.statistics.nominal)),
            format!("{:.2}", case.rate(case.statistics.drawn)),
            format!("{:.1}", case.statistics.setup_ms),
            format!("{:.1}", case.statistics.draw_ms),
            format!("{:.0} %", 100.0 * case.draw_share()),
        ]
    });
    Section {
        name,
        paper: "Maximo et al. 2007, tables 1 and 2",
        paper_says: "5.35 to 6.61 million tetrahedra a second effective at 512 x 512 on a GeForce 6800; 51 to 82 % of a frame \
                     is drawing",
        measured: measured.to_owned(),
        rows: rows.collect(),
        text: (heads, cells.collect()),
    }
}
