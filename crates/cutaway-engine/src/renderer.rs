//! The renderer: chooses the engine of a scene, keeps it started, and makes frames with it.

use cutaway_core::scene::{Engine as Choice, Scene};
use cutaway_cpu::SimdChoice;
#[cfg(feature = "gpu")]
use cutaway_gpu::{CellOptions, Gpu};

use crate::abilities::Abilities;
use crate::clock::Moment;
use crate::engine::{AnyEngine, ReadyTimes};
use crate::engines::{ENGINES, Entry, GPU_ENGINES, Start};
use crate::error::EngineError;
use crate::frame::{About, Frame, Rendered};
use crate::notice::Notice;
use crate::refine::{Partial, Refinement};
use crate::request::{DebugView, Request};

/// The choices that engines are started with.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// Number of threads of the cpu and reference engines; 0: one per core.
    pub threads: usize,
    /// Instruction set of the cpu engine.
    pub simd: SimdChoice,
    /// Name of the graphics adapter; none: the best one.
    pub adapter: Option<String>,
    /// How the cells engine draws.
    #[cfg(feature = "gpu")]
    pub cells: CellOptions,
}

/// An engine that was started for a choice.
#[derive(Debug)]
struct Running {
    name: &'static str,
    engine: Box<dyn AnyEngine>,
    /// Why it renders instead of the engine that was chosen automatically.
    replaced: Option<Notice>,
}

/// Renders scenes, each with the engine that it asks for. One engine is started at a time, and has one volume ready.
#[derive(Debug)]
pub struct Renderer {
    engines: Vec<Entry>,
    start: Start,
    running: Option<Running>,
    /// The engine that renders every scene.
    choice: Option<&'static str>,
    /// Reason why a graphics device failed that was chosen automatically: the CPU renders from then on.
    gpu_failed: Option<String>,
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new(Setup::default())
    }
}

impl Renderer {
    /// Returns a renderer with nothing started.
    pub fn new(setup: Setup) -> Self {
        Self::from_start(Start::new(setup))
    }

    /// Returns a renderer whose GPU engines use a device of the caller, and can leave images there.
    #[cfg(feature = "gpu")]
    pub fn sharing(setup: Setup, gpu: Gpu) -> Self {
        Self::from_start(Start::sharing(setup, gpu))
    }

    fn from_start(start: Start) -> Self {
        Self { engines: ENGINES.to_vec(), start, running: None, choice: None, gpu_failed: None }
    }

    /// Adds an engine to the list, in front of one of the same name.
    #[must_use]
    pub fn with_engine(mut self, entry: Entry) -> Self {
        self.engines.insert(0, entry);
        self
    }

    /// Renders every scene with the engine of this name, whatever the scene asks for.
    #[must_use]
    pub fn with_choice(mut self, name: &'static str) -> Self {
        self.choice = Some(name);
        self
    }

    /// Stops the engine, so that the next frame starts it again.
    pub fn restart(&mut self) {
        self.running = None;
    }

    /// Returns the abilities of the engine that renders a scene; starts it, but prepares nothing.
    ///
    /// # Errors
    /// An engine that cannot be started.
    pub fn abilities(&mut self, scene: &Scene, debug: DebugView) -> Result<Abilities, EngineError> {
        let name = self.choose(scene, debug);
        Ok(self.run(name)?.engine.abilities())
    }

    /// Makes a scene ready without rendering it.
    ///
    /// # Errors
    /// A scene that the engine does not render, data that do not fit, a device that fails.
    pub fn prepare(&mut self, scene: &Scene) -> Result<ReadyTimes, EngineError> {
        self.with_fallback(scene, DebugView::Off, &mut |running| running.engine.make_ready(scene))
    }

    /// Renders a whole frame.
    ///
    /// # Errors
    /// As [`Self::prepare`]; a frame that was cancelled.
    pub fn render(&mut self, scene: &Scene, request: &Request) -> Result<Frame, EngineError> {
        self.with_fallback(scene, request.debug, &mut |running| {
            let times = running.engine.make_ready(scene)?;
            let started = Moment::now();
            let Rendered { picture, statistics } = running.engine.render(scene, request)?;
            let frame_ms = started.milliseconds();
            Ok(Frame { picture, spacing: 1, statistics, frame_ms, about: running.about(scene, times) })
        })
    }

    /// Renders a coarse image first and finer ones after, each of which goes to `hand_over`, until one is whole.
    ///
    /// # Errors
    /// As [`Self::render`]; [`EngineError::Cancelled`] once a newer picture is wanted.
    pub fn refine(
        &mut self,
        scene: &Scene,
        refinement: &Refinement,
        hand_over: &mut dyn FnMut(Frame) -> std::ops::ControlFlow<()>,
    ) -> Result<(), EngineError> {
        self.with_fallback(scene, refinement.debug, &mut |running| {
            let started = Moment::now();
            let times = running.engine.make_ready(scene)?;
            let about = running.about(scene, times);
            running.engine.refine(scene, refinement, &mut |Partial { picture, spacing, statistics }| {
                let frame_ms = started.milliseconds();
                hand_over(Frame { picture, spacing, statistics, frame_ms, about: about.clone() })
            })
        })
    }

    /// Runs `work` on the engine of a scene. If that engine was chosen automatically and its device fails, the cpu engine
    /// does the work.
    fn with_fallback<T>(
        &mut self,
        scene: &Scene,
        debug: DebugView,
        work: &mut dyn FnMut(&mut Running) -> Result<T, EngineError>,
    ) -> Result<T, EngineError> {
        let name = self.choose(scene, debug);
        let automatic = self.choice.is_none()
            && scene.settings().engine == Choice::Auto
            && scene.data().volume().is_some();
        let result = self.run(name).and_then(|running| {
            running.engine.abilities().check(scene, debug)?;
            work(running)
        });
        match result {
            Err(error) if automatic && debug == DebugView::Off && is_of_device(&error) => {
                self.gpu_failed = Some(error.to_string());
                work(self.run("cpu")?)
            }
            result => result,
        }
    }

    /// Returns the name of the engine that a scene asks for. This is the automatic rule: cells for an unstructured grid,
    /// raycast for a view of its work or on a hardware GPU, otherwise cpu.
    fn choose(&mut self, scene: &Scene, debug: DebugView) -> &'static str {
        if let Some(name) = self.choice {
            return name;
        }
        match scene.settings().engine {
            Choice::Auto if scene.data().grid().is_some() => "cells",
            Choice::Auto if debug != DebugView::Off => "raycast",
            Choice::Auto if self.gpu_failed.is_none() && self.start.prefers_gpu() => "raycast",
            Choice::Auto => "cpu",
            engine => engine.name(),
        }
    }

    /// The engine of this name, started.
    fn run(&mut self, name: &str) -> Result<&mut Running, EngineError> {
        let running = match self.running.take() {
            Some(running) if running.name == name => running,
            // One engine at a time: two volumes made ready are more than may fit.
            _ => self.started(name)?,
        };
        Ok(self.running.insert(running))
    }

    fn started(&mut self, name: &str) -> Result<Running, EngineError> {
        let Some(entry) = self.engines.iter().find(|entry| entry.name == name).copied() else {
            if let Some(engine) = GPU_ENGINES.into_iter().find(|engine| *engine == name) {
                return Err(EngineError::NotBuilt { engine });
            }
            let known = self.engines.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ");
            return Err(EngineError::Unknown { name: name.to_owned(), known });
        };
        let engine = (entry.start)(&mut self.start)?;
        let reason = self.gpu_failed.clone().filter(|_| name == "cpu");
        let replaced = reason.map(|reason| Notice::Replaced { reason, engine: "cpu" });
        Ok(Running { name: entry.name, engine, replaced })
    }
}

/// True for errors of a graphics device, in whose place the CPU can render.
fn is_of_device(error: &EngineError) -> bool {
    #[cfg(feature = "gpu")]
    {
        let unknown =
            |error: &cutaway_gpu::GpuError| matches!(error, cutaway_gpu::GpuError::UnknownAdapter { .. });
        matches!(error, EngineError::Gpu(error) if !unknown(error))
    }
    #[cfg(not(feature = "gpu"))]
    {
        let _ = error;
        false
    }
}

impl Running {
    fn about(&self, scene: &Scene, times: ReadyTimes) -> About {
        let notices = self.replaced.iter().cloned();
        let notices = notices.chain(self.engine.abilities().notices(scene)).chain(self.engine.data_notices());
        About {
            engine: self.name,
            machine: self.engine.machine(),
            prepare_ms: times.prepare_ms,
            classify_ms: times.classify_ms,
            notices: notices.collect(),
        }
    }
}
