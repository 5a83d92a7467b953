//! A scene on the engine that renders it: prepared once, then frame after frame.

use cutaway_core::camera::Camera;
use cutaway_core::scene::Scene;
use cutaway_cpu::SimdChoice;
use cutaway_engine::{
    Abilities, About, DebugView, EngineError, Frame, FrameStatistics, Notice, ReadyTimes, Renderer, Request,
    Setup,
};

use super::statistics::{FrameTimes, StatisticsFile, peak_rss_bytes};
use crate::args::{self, SceneArgs, Simd};
use crate::options::as_options;
use crate::report::{Verbosity, wrong_use};
use crate::scene::Prepared;

pub(crate) struct Session {
    scene: Scene,
    renderer: Renderer,
    debug: DebugView,
    verbosity: Verbosity,
    /// Notices that were printed.
    said: Vec<Notice>,
    file: String,
    load_ms: f64,
    ready: ReadyTimes,
    /// About the last frame.
    about: About,
}

impl Session {
    pub(crate) fn new(prepared: &Prepared, args: &SceneArgs, verbosity: Verbosity) -> anyhow::Result<Self> {
        let setup = Setup {
            threads: args.threads,
            simd: simd(args.simd),
            adapter: args.gpu.clone(),
            ..Setup::default()
        };
        let mut session = Self {
            scene: prepared.scene()?,
            renderer: Renderer::new(setup),
            debug: DebugView::Off,
            verbosity,
            said: Vec::new(),
            file: prepared.loaded.name.clone(),
            load_ms: prepared.loaded.load_ms,
            ready: ReadyTimes::default(),
            about: About::default(),
        };
        session.ready = session.renderer.prepare(&session.scene).map_err(|e| session.blame(e))?;
        Ok(session)
    }

    /// The abilities of the engine that renders the scene.
    pub(crate) fn abilities(&mut self) -> anyhow::Result<Abilities> {
        self.renderer.abilities(&self.scene, self.debug).map_err(|e| self.blame(e))
    }

    pub(crate) fn set_camera(&mut self, camera: Camera) -> anyhow::Result<()> {
        Ok(self.scene.set_camera(camera)?)
    }

    /// Shows how the engine works, from the next frame on; an error where it is not the one that can.
    pub(crate) fn set_debug(&mut self, view: args::DebugView) -> anyhow::Result<()> {
        self.debug = match view {
            args::DebugView::Fetches => DebugView::Fetches,
            args::DebugView::Wireframe => DebugView::Wireframe,
        };
        let checked = self.renderer.abilities(&self.scene, self.debug);
        let checked = checked.and_then(|abilities| abilities.check(&self.scene, self.debug));
        checked.map_err(|e| self.blame(e))
    }

    /// Renders a frame, and prints what is new of its notices.
    pub(crate) fn frame(&mut self, progress: &(dyn Fn(f32) + Sync)) -> anyhow::Result<Frame> {
        let request = Request { debug: self.debug, progress, ..Request::default() };
        let frame = self.renderer.render(&self.scene, &request).map_err(|e| self.blame(e))?;
        for notice in &frame.about.notices {
            if !self.said.contains(notice) {
                self.verbosity.notice(&as_options(&notice.to_string()));
                self.said.push(notice.clone());
            }
        }
        self.ready.prepare_ms += frame.about.prepare_ms;
        self.ready.classify_ms += frame.about.classify_ms;
        self.about = frame.about.clone();
        Ok(frame)
    }

    pub(crate) fn statistics(&self, frame: FrameStatistics, times: Vec<f64>) -> StatisticsFile {
        let machine = self.about.machine.clone();
        StatisticsFile {
            engine: self.about.engine,
            adapter: machine.adapter,
            simd: machine.simd,
            threads: machine.threads,
            resolution: self.scene.settings().resolution,
            load_ms: self.load_ms,
            prepare_ms: self.ready.prepare_ms,
            classify_ms: self.ready.classify_ms,
            clip_ms: frame.clip_ms.unwrap_or(0.0),
            frame_ms: FrameTimes::of(times),
            gpu_ms: frame.gpu_ms,
            samples: frame.samples,
            rays: frame.rays,
            segments: frame.segments,
            repaired_lines: frame.repaired_lines,
            skipped_fraction: frame.skipped_fraction,
            visible_fraction: None,
            peak_rss_bytes: peak_rss_bytes(),
            gpu_bytes: frame.gpu_bytes,
            triangles_or_tetrahedra: frame.primitives,
        }
    }

    /// An engine's error in the words of the command line: wrong use where an option makes it right.
    fn blame(&self, error: EngineError) -> anyhow::Error {
        let file = &self.file;
        match error {
            EngineError::Data { .. } => wrong_use(format!("{file}: {}", as_options(&error.to_string()))),
            EngineError::Debug { .. } | EngineError::NoProxy { .. } => {
                wrong_use(format!("--debug {}: {}", self.debug.name(), as_options(&error.to_string())))
            }
            error => anyhow::anyhow!("{}", as_options(&error.to_string())),
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
