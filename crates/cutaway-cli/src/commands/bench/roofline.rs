//! `cutaway bench roofline`: how many samples a second this processor can take, and how near to that frames come.

use std::time::Duration;

use cutaway_core::volume::{VoxelType, Voxels};
use cutaway_cpu::roofline::{Ceiling, Work, read_bandwidth};
use cutaway_cpu::{CpuError, CpuRenderer, SimdChoice};
use serde::Serialize;

use super::frames::{Orbit, measure, scene_of_line};
use super::table;
use crate::args::BenchRooflineArgs;
use crate::report;
use crate::scene::Prepared;

/// What the numbers are, for those who see only them.
const ABOUT: &str = "A ceiling is what the engine's own sampler reaches when it does nothing else: parallel rays a voxel \
apart through a cube of white noise, from three sides, in steps of one voxel; no skipping, no early end, no look at blocks. \
`cache`: the cube fits the caches beside a core; `memory`: it fits none. A frame is held against the ceiling in the cache of \
its own work and voxel type, with all threads. Samples with nothing visible need no colour and no light, so frames with many \
of them may pass the ceiling of `shade` and `composite`.";

/// The best of this many measurements is what counts: whatever disturbs one makes it slower, never faster.
const TRIES: usize = 3;

#[derive(Debug, Serialize)]
struct Report {
    about: &'static str,
    threads: usize,
    simd: &'static str,
    ceilings: Vec<CeilingRow>,
    memory: Vec<MemoryRow>,
    frames: Vec<FrameRow>,
}

#[derive(Debug, Serialize)]
struct CeilingRow {
    work: &'static str,
    simd: &'static str,
    threads: usize,
    resident: &'static str,
    bytes: usize,
    samples_per_second: f64,
}

#[derive(Debug, Serialize)]
struct MemoryRow {
    threads: usize,
    bytes: usize,
    bytes_per_second: f64,
}

#[derive(Debug, Serialize)]
struct FrameRow {
    scene: String,
    /// `scene` without what all of them have in common.
    #[serde(skip)]
    short: &'static str,
    work: &'static str,
    frame_ms: f64,
    samples: u64,
    skipped_fraction: f64,
    samples_per_second: f64,
    ceiling_samples_per_second: f64,
    ratio: f64,
}

/// Scenes as `cutaway bench frame` takes them, without [`COMMON`] options; and the work of a sample in which something is visible.
const SCENES: [(&str, Work); 6] = [
    ("sample:marschner-lobb:256 --mode mean", Work::Sample),
    (
        "sample:marschner-lobb:256 --no-shade --colormap viridis --range 0,1 --opacity 0,0.001,1,0.01",
        Work::Composite,
    ),
    ("sample:bonsai --mode mean", Work::Sample),
    ("sample:bonsai --shade", Work::Shade),
    ("sample:mr-head --no-shade", Work::Composite),
    ("sample:mr-head --shade", Work::Shade),
];

/// A scene that takes an instant.
const SMALL: [(&str, Work); 1] = [("sample:marschner-lobb:16 --mode mean", Work::Sample)];

/// What the scenes have in common, beside the size of their images.
const COMMON: &str = "--step 1 --azimuth 30";

/// Sizes and times.
struct Effort {
    /// Voxels a side of cubes that fit no cache.
    memory_edge: u32,
    /// Bytes to read through.
    memory_bytes: usize,
    slice: Duration,
    frames: u32,
    resolution: u32,
    scenes: &'static [(&'static str, Work)],
}

impl Effort {
    fn new(quick: bool) -> Self {
        if quick {
            let slice = Duration::from_millis(1);
            Self { memory_edge: 32, memory_bytes: 1 << 21, slice, frames: 1, resolution: 32, scenes: &SMALL }
        } else {
            let slice = Duration::from_millis(25);
            Self {
                memory_edge: 512,
                memory_bytes: 512 << 20,
                slice,
                frames: 7,
                resolution: 512,
                scenes: &SCENES,
            }
        }
    }
}

pub(super) fn run(args: &BenchRooflineArgs) -> anyhow::Result<()> {
    let effort = Effort::new(args.quick);
    let renderer = CpuRenderer::new(0, SimdChoice::Auto)?;
    let threads = renderer.threads();
    let report = Report {
        about: ABOUT,
        threads,
        simd: renderer.simd(),
        ceilings: ceilings(&effort, threads)?,
        memory: memory(&effort, threads)?,
        frames: frames(&effort)?,
    };
    let text = if args.json { serde_json::to_string_pretty(&report)? + "\n" } else { text(&report) };
    report::print(&text)
}

/// One thread, and all of them where there are more.
fn thread_counts(threads: usize) -> Vec<usize> {
    if threads > 1 { vec![1, threads] } else { vec![1] }
}

fn best(mut measure: impl FnMut() -> Result<f64, CpuError>) -> Result<f64, CpuError> {
    (0..TRIES).try_fold(0.0, |best, _| Ok(measure()?.max(best)))
}

fn ceilings(effort: &Effort, threads: usize) -> anyhow::Result<Vec<CeilingRow>> {
    let cached = Ceiling::new(cached_edge(VoxelType::U16), VoxelType::U16);
    let large = Ceiling::new(effort.memory_edge, VoxelType::U16);
    let mut rows = Vec::new();
    let mut measure = |resident, ceiling: &Ceiling, simd, name| -> anyhow::Result<()> {
        for threads in thread_counts(threads) {
            for work in Work::ALL {
                let samples_per_second =
                    best(|| ceiling.samples_per_second(simd, threads, work, effort.slice))?;
                let bytes = ceiling.bytes();
                let work = work.name();
                rows.push(CeilingRow { work, simd: name, threads, resident, bytes, samples_per_second });
            }
        }
        Ok(())
    };
    for simd in [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Avx512] {
        // What this processor does not have is left out.
        if let Ok(renderer) = CpuRenderer::new(1, simd) {
            measure("cache", &cached, simd, renderer.simd())?;
        }
    }
    let auto = CpuRenderer::new(1, SimdChoice::Auto)?.simd();
    if auto == "neon" {
        measure("cache", &cached, SimdChoice::Auto, auto)?;
    }
    measure("memory", &large, SimdChoice::Auto, auto)?;
    Ok(rows)
}

fn memory(effort: &Effort, threads: usize) -> anyhow::Result<Vec<MemoryRow>> {
    let bytes = effort.memory_bytes;
    let measure = |threads| -> anyhow::Result<MemoryRow> {
        let bytes_per_second = read_bandwidth(threads, bytes, TRIES as u32 * effort.slice)?;
        Ok(MemoryRow { threads, bytes, bytes_per_second })
    };
    thread_counts(threads).into_iter().map(measure).collect()
}

fn frames(effort: &Effort) -> anyhow::Result<Vec<FrameRow>> {
    let mut rows = Vec::new();
    let mut known: Vec<(VoxelType, Work, f64)> = Vec::new();
    for (short, work) in effort.scenes {
        let scene = format!("{short} {COMMON} --resolution {0},{0}", effort.resolution);
        let args = scene_of_line(&scene)?;
        let prepared = Prepared::new(&args)?;
        let voxel_type = held_type(prepared.loaded.lattice().voxels());
        let ceiling = match known.iter().find(|(t, w, _)| (*t, *w) == (voxel_type, *work)) {
            Some((.., ceiling)) => *ceiling,
            None => {
                let cube = Ceiling::new(cached_edge(voxel_type), voxel_type);
                let ceiling = best(|| cube.samples_per_second(SimdChoice::Auto, 0, *work, effort.slice))?;
                known.push((voxel_type, *work, ceiling));
                ceiling
            }
        };
        // Every frame from the same side: all of them take the samples that the last one is said to have taken.
        let orbit = Orbit { frames: effort.frames, degrees: 0.0 };
        let statistics = measure(&prepared, &args, orbit, |_| Ok(()))?;
        let samples = statistics.samples.unwrap_or(0);
        let samples_per_second = samples as f64 / (1e-3 * statistics.frame_ms.median);
        rows.push(FrameRow {
            scene,
            short,
            work: work.name(),
            frame_ms: statistics.frame_ms.median,
            samples,
            skipped_fraction: statistics.skipped_fraction.unwrap_or(0.0),
            samples_per_second,
            ceiling_samples_per_second: ceiling,
            ratio: samples_per_second / ceiling,
        });
    }
    Ok(rows)
}

fn held_type(voxels: &Voxels) -> VoxelType {
    match voxels {
        Voxels::U8(_) => VoxelType::U8,
        Voxels::U16(_) => VoxelType::U16,
        Voxels::F32(_) => VoxelType::F32,
    }
}

/// Voxels a side of a cube of at most 512 KiB, which is what the second cache of most cores holds.
fn cached_edge(voxel_type: VoxelType) -> u32 {
    if voxel_type == VoxelType::F32 { 48 } else { 64 }
}

fn text(report: &Report) -> String {
    let million = |v: f64| format!("{:.0}", v * 1e-6);
    let mib = |bytes: usize| format!("{:.1}", bytes as f64 / f64::from(1 << 20));
    let ceiling = |r: &CeilingRow| {
        let threads = r.threads.to_string();
        vec![
            r.work.into(),
            r.simd.into(),
            threads,
            r.resident.into(),
            mib(r.bytes),
            million(r.samples_per_second),
        ]
    };
    let memory = |r: &MemoryRow| {
        vec![
            format!("{} MiB", mib(r.bytes)),
            r.threads.to_string(),
            format!("{:.1}", r.bytes_per_second * 1e-9),
        ]
    };
    let frame = |r: &FrameRow| {
        vec![
            r.short.to_owned(),
            r.work.into(),
            format!("{:.1}", r.frame_ms),
            format!("{:.0} %", 100.0 * r.skipped_fraction),
            million(r.samples_per_second),
            million(r.ceiling_samples_per_second),
            format!("{:.2}", r.ratio),
        ]
    };
    let rows: Vec<_> = report.ceilings.iter().map(ceiling).collect();
    let mut text = "Ceilings, 16-bit voxels\n".to_owned();
    text += &table::text(&["work", "simd", "threads", "resident", "MiB", "million samples/s"], &rows);
    text += "\nReading memory\n";
    let rows: Vec<_> = report.memory.iter().map(memory).collect();
    text += &table::text(&["of", "threads", "GB/s"], &rows);
    text += &format!("\nFrames, {}, {} threads, each with {COMMON}\n", report.simd, report.threads);
    let heads = ["scene", "work", "ms", "skipped", "million samples/s", "ceiling", "ratio"];
    let rows: Vec<_> = report.frames.iter().map(frame).collect();
    text + &table::text(&heads, &rows) + "\n" + &wrapped(report.about, 100)
}

/// Words in lines of at most `width` characters.
fn wrapped(words: &str, width: usize) -> String {
    let mut lines = vec![String::new()];
    for word in words.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines.join("\n") + "\n"
}
