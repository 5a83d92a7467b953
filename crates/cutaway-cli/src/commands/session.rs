//! A scene on the engine that renders it: prepared once, then frame after frame.

use std::time::Instant;

use cutaway_core::camera::Camera;
use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Engine, Scene};
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, SimdChoice, Statistics};

use super::statistics::{FrameTimes, StatisticsFile, peak_rss_bytes};
use crate::args::{SceneArgs, Simd};
use crate::scene::Prepared;

pub(crate) struct Session<'a> {
    scene: Scene<'a>,
    engine: Running,
    load_ms: f64,
    prepare_ms: f64,
    classify_ms: f64,
}

/// What a frame took, as far as its engine counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    samples: Option<u64>,
    rays: Option<u64>,
    segments: Option<u64>,
    repaired_lines: Option<u64>,
    skipped_fraction: Option<f64>,
}

impl From<Statistics> for Counts {
    fn from(s: Statistics) -> Self {
        Self {
            samples: Some(s.samples),
            rays: Some(s.rays),
            segments: Some(s.segments),
            repaired_lines: Some(s.repaired),
            skipped_fraction: Some(s.skipped_fraction),
        }
    }
}

impl From<reference::Statistics> for Counts {
    fn from(s: reference::Statistics) -> Self {
        let (rays, segments, repaired_lines) = (Some(s.rays), Some(s.segments), Some(s.repaired));
        Self { rays, segments, repaired_lines, ..Self::default() }
    }
}

enum Running {
    Cpu { renderer: CpuRenderer, volume: CpuVolume, classification: Box<Classification> },
    Reference { pool: rayon::ThreadPool },
}

impl<'a> Session<'a> {
    pub(crate) fn new(prepared: &'a Prepared, args: &SceneArgs) -> anyhow::Result<Self> {
        let scene = prepared.scene()?;
        let started = Instant::now();
        let mut classify_ms = 0.0;
        let engine = match scene.settings().engine {
            Engine::Reference => Running::Reference {
                pool: rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?,
            },
            Engine::Auto | Engine::Cpu => {
                let renderer = CpuRenderer::new(args.threads, simd(args.simd))?;
                let volume = renderer.prepare(scene.volume())?;
                let classified = Instant::now();
                let classification = Box::new(renderer.classify(&volume, &scene));
                classify_ms = milliseconds(classified);
                Running::Cpu { renderer, volume, classification }
            }
        };
        let prepare_ms = milliseconds(started) - classify_ms;
        Ok(Self { scene, engine, load_ms: prepared.loaded.load_ms, prepare_ms, classify_ms })
    }

    pub(crate) fn set_camera(&mut self, camera: Camera) -> anyhow::Result<()> {
        Ok(self.scene.set_camera(camera)?)
    }

    /// Renders a frame; also its time in milliseconds.
    pub(crate) fn frame(&self, progress: &(dyn Fn(f32) + Sync)) -> (Image, Counts, f64) {
        let started = Instant::now();
        let (image, statistics) = match &self.engine {
            Running::Cpu { renderer, volume, classification } => {
                let (image, counts) = renderer.render(volume, classification, &self.scene, progress);
                (image, counts.into())
            }
            Running::Reference { pool } => {
                let (image, counts) = pool.install(|| reference::render_with_progress(&self.scene, progress));
                (image, counts.into())
            }
        };
        (image, statistics, milliseconds(started))
    }

    pub(crate) fn statistics(&self, frame: Counts, times: Vec<f64>) -> StatisticsFile {
        let (engine, simd, threads) = match &self.engine {
            Running::Cpu { renderer, .. } => ("cpu", Some(renderer.simd()), renderer.threads()),
            Running::Reference { pool } => ("reference", None, pool.current_num_threads()),
        };
        StatisticsFile {
            engine,
            adapter: None,
            simd,
            threads,
            resolution: self.scene.settings().resolution,
            load_ms: self.load_ms,
            prepare_ms: self.prepare_ms,
            classify_ms: self.classify_ms,
            clip_ms: 0.0,
            frame_ms: FrameTimes::of(times),
            samples: frame.samples,
            rays: frame.rays,
            segments: frame.segments,
            repaired_lines: frame.repaired_lines,
            skipped_fraction: frame.skipped_fraction,
            peak_rss_bytes: peak_rss_bytes(),
            gpu_bytes: None,
            triangles_or_tetrahedra: None,
        }
    }
}

fn simd(choice: Simd) -> SimdChoice {
    match choice {
        Simd::Auto => SimdChoice::Auto,
        Simd::Scalar => SimdChoice::Scalar,
        Simd::Avx2 => SimdChoice::Avx2,
        Simd::Avx512 => SimdChoice::Avx512,
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
