//! The engines behind one door: whichever a state asks for, prepared for its volume and classified for its transfer
//! function, both only when they changed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Engine, RenderSettings, Scene};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, SimdChoice};
use cutaway_gpu::cells::{CellClassification, PreparedCells};
use cutaway_gpu::context::adapters;
use cutaway_gpu::raycast::{self, PreparedVolume};
use cutaway_gpu::slices::{self, SliceClassification};
use cutaway_gpu::{
    CellOptions, CellRenderer, Extras, Gpu, GpuClassification, GpuError, GpuOptions, RaycastRenderer,
    ShownFrame, SliceRenderer,
};

use super::quality::{Pace, reduced};
use super::{DebugView, Frame, MOVING_BUDGET, Pixels, Request, Shown, Took};
use crate::document::OpenVolume;

/// Why a picture was not finished.
#[derive(Clone, Debug, PartialEq)]
pub enum Interrupt {
    /// Something newer is wanted.
    Overtaken,
    /// It cannot be made: one line.
    Failed(String),
}

impl<E: std::error::Error> From<E> for Interrupt {
    fn from(error: E) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Where frames go.
pub type HandOver<'a> = dyn FnMut(Frame) -> Result<(), Interrupt> + 'a;

/// Time between the frames of a picture that is being refined.
const REFINING_BUDGET: Duration = Duration::from_millis(150);

/// How long a coarse picture stands before it is refined. While something moves the next request comes sooner, and the window
/// needs the processor to draw itself.
const STANDING: Duration = Duration::from_millis(70);

/// Distance in pixels of the rays of a first frame, at most: beside what is finer, what is coarser looks broken.
const MOVING_SPACING: u32 = 8;

/// What of the moving budget is left for casting: making an image of what was cast and showing it takes the rest.
const CASTING_SHARE: f64 = 0.3;

/// Straight RGB of the proxy geometry's edges: seen against bone, skin and nothing.
const WIREFRAME: [f32; 3] = [0.1, 0.9, 0.4];

/// The engine in use, and the device once there is one.
#[derive(Debug, Default)]
pub struct Engines {
    gpu: Option<Result<Gpu, String>>,
    /// Whether there is a real GPU, once that was asked: to look takes as long as a coarse picture.
    real_gpu: Option<bool>,
    /// Whether the device is the window's: pictures stay there.
    shared: bool,
    running: Option<Running>,
}

/// An engine with a volume made ready.
#[derive(Debug)]
struct Running {
    volume: Arc<OpenVolume>,
    kind: Engine,
    engine: Prepared,
    /// What the classification was made for.
    classified_for: Classified,
    pace: Pace,
    notices: Vec<String>,
}

/// What a classification depends on.
#[derive(Clone, Debug, PartialEq)]
struct Classified {
    function: TransferFunction,
    unit_distance: Option<f64>,
    lighting: Lighting,
    settings: RenderSettings,
}

impl Classified {
    fn of(request: &Request) -> Self {
        let state = &request.state;
        // Neither the image's size nor how it is filled in has a part in it.
        let settings = RenderSettings { resolution: [1, 1], ..state.settings.clone() };
        let (function, unit_distance) = (state.function.clone(), state.unit_distance);
        Self { function, unit_distance, lighting: state.lighting.clone(), settings }
    }
}

#[derive(Debug)]
enum Prepared {
    Cpu {
        renderer: CpuRenderer,
        volume: CpuVolume,
        classification: Box<Classification>,
    },
    Raycast {
        renderer: Box<RaycastRenderer>,
        volume: Box<PreparedVolume>,
        classification: Box<GpuClassification>,
    },
    Slices {
        renderer: Box<SliceRenderer>,
        volume: Box<slices::PreparedVolume>,
        classification: Box<SliceClassification>,
    },
    Cells {
        renderer: Box<CellRenderer>,
        cells: Box<PreparedCells>,
        classification: Box<CellClassification>,
    },
    Reference,
}

impl DebugView {
    /// What is drawn besides the volume.
    fn extras(self) -> Extras<'static> {
        Extras { wireframe: (self == Self::Wireframe).then_some(WIREFRAME), ..Extras::default() }
    }
}

impl Engines {
    /// Engines on the window's device: pictures stay on it.
    pub fn sharing(gpu: Gpu) -> Self {
        Self { gpu: Some(Ok(gpu)), shared: true, ..Self::default() }
    }

    /// Renders what is wanted, coarse first, and hands over every frame; ends early once `overtaken` is set.
    ///
    /// # Errors
    /// Why the picture is not complete.
    pub fn render(
        &mut self,
        request: &Request,
        overtaken: &AtomicBool,
        hand_over: &mut HandOver<'_>,
    ) -> Result<(), Interrupt> {
        let started = Instant::now();
        let scene = request.state.scene(&request.volume.data, request.clip.as_ref(), request.size)?;
        self.prepare(request, &scene)?;
        let running = self
            .running
            .as_mut()
            .ok_or_else(|| Interrupt::Failed("no engine could be started".to_owned()))?;
        let took = Took {
            engine: running.kind.name(),
            preparing_milliseconds: milliseconds(started),
            notices: running.notices.clone(),
            adapter: running.engine.adapter(),
            ..Took::default()
        };
        let view = View { request, scene: &scene, overtaken, started, took, on_device: self.shared };
        running.engine.render(&view, &mut running.pace, hand_over)
    }

    /// Has what is on the GPU made anew for the next picture: its shaders are others.
    #[cfg(feature = "watch-shaders")]
    pub(super) fn restart(&mut self) {
        self.running.take_if(|running| running.engine.adapter().is_some());
    }

    /// A whole picture, as good as it gets. `progress` is called with the finished share, 0..=1.
    ///
    /// # Errors
    /// Why there is none, in a line.
    pub fn still(&mut self, request: &Request, progress: &(dyn Fn(f32) + Sync)) -> Result<Image, Interrupt> {
        let scene = request.state.scene(&request.volume.data, request.clip.as_ref(), request.size)?;
        self.prepare(request, &scene)?;
        let running = self
            .running
            .as_ref()
            .ok_or_else(|| Interrupt::Failed("no engine could be started".to_owned()))?;
        Ok(running.engine.whole(&scene, request.debug, None, progress)?.0)
    }

    /// Makes the engine, the volume and the classification ready for a request, as far as they are not.
    fn prepare(&mut self, request: &Request, scene: &Scene) -> Result<(), Interrupt> {
        let kind = self.kind(request);
        let fits = |r: &Running| Arc::ptr_eq(&r.volume, &request.volume) && r.kind == kind;
        if self.running.as_ref().is_some_and(|r| !fits(r)) {
            // Two volumes at once are more than may fit.
            self.running = None;
        }
        let classified_for = Classified::of(request);
        match &mut self.running {
            Some(running) if running.classified_for == classified_for => {}
            Some(running) => {
                running.engine.classify(scene)?;
                running.notices = running.engine.notices(scene);
                running.classified_for = classified_for;
            }
            None => {
                let engine = self.start(kind, request, scene)?;
                let notices = engine.notices(scene);
                let volume = request.volume.clone();
                self.running =
                    Some(Running { volume, kind, engine, classified_for, pace: Pace::default(), notices });
            }
        }
        Ok(())
    }

    /// The engine that a state asks for: of itself a real GPU where there is one.
    fn kind(&mut self, request: &Request) -> Engine {
        match request.state.settings.engine {
            Engine::Auto if request.volume.data.grid().is_some() => Engine::Cells,
            Engine::Auto if request.debug != DebugView::Off => Engine::Raycast,
            Engine::Auto => {
                let real = match &self.gpu {
                    Some(Ok(gpu)) => !gpu.adapter().software,
                    Some(Err(_)) => false,
                    None => {
                        let look = || adapters().first().is_some_and(|adapter| !adapter.software);
                        if !*self.real_gpu.get_or_insert_with(look) {
                            return Engine::Cpu;
                        }
                        self.gpu().is_ok()
                    }
                };
                if real { Engine::Raycast } else { Engine::Cpu }
            }
            engine => engine,
        }
    }

    fn gpu(&mut self) -> Result<Gpu, Interrupt> {
        let opened =
            self.gpu.get_or_insert_with(|| Gpu::new(&GpuOptions::default()).map_err(|e| e.to_string()));
        opened.clone().map_err(Interrupt::Failed)
    }

    fn start(&mut self, kind: Engine, request: &Request, scene: &Scene) -> Result<Prepared, Interrupt> {
        let mesh = request.volume.data.grid();
        if mesh.is_some() && kind != Engine::Cells {
            let line = "an unstructured grid is rendered by the cells engine alone; choose cells or auto";
            return Err(Interrupt::Failed(line.to_owned()));
        }
        Ok(match kind {
            Engine::Raycast => {
                let renderer = Box::new(RaycastRenderer::new(&self.gpu()?)?);
                let volume = Box::new(renderer.prepare(scene.volume())?);
                let classification = Box::new(renderer.classify(&volume, scene)?);
                Prepared::Raycast { renderer, volume, classification }
            }
            Engine::Slices => {
                let renderer = Box::new(SliceRenderer::new(&self.gpu()?)?);
                let volume = Box::new(renderer.prepare(scene.volume())?);
                let classification = Box::new(renderer.classify(&volume, scene)?);
                Prepared::Slices { renderer, volume, classification }
            }
            Engine::Cells => {
                let renderer = Box::new(CellRenderer::new(&self.gpu()?, CellOptions::default())?);
                let cells = match mesh {
                    Some(mesh) => renderer.prepare_mesh(mesh)?,
                    None => renderer.prepare(scene.volume())?,
                };
                let classification = Box::new(renderer.classify(&cells, scene)?);
                Prepared::Cells { renderer, cells: Box::new(cells), classification }
            }
            Engine::Reference => Prepared::Reference,
            Engine::Auto | Engine::Cpu => {
                let renderer = CpuRenderer::new(0, SimdChoice::Auto)?;
                let volume = renderer.prepare(scene.volume())?;
                let classification = Box::new(renderer.classify(&volume, scene));
                Prepared::Cpu { renderer, volume, classification }
            }
        })
    }
}

/// A request on its way through an engine.
struct View<'a> {
    request: &'a Request,
    scene: &'a Scene,
    overtaken: &'a AtomicBool,
    started: Instant,
    took: Took,
    /// Whether pictures stay on the device, where the engine can leave them there.
    on_device: bool,
}

impl View<'_> {
    fn frame(&self, shown: Shown, spacing: u32, counts: Counts) -> Frame {
        let milliseconds = milliseconds(self.started);
        let Counts { samples, gpu_bytes } = counts;
        Frame {
            serial: 0,
            shown,
            done: spacing <= 1,
            spacing,
            took: Took { milliseconds, samples, gpu_bytes, ..self.took.clone() },
        }
    }

    fn is_overtaken(&self) -> bool {
        self.overtaken.load(Ordering::Relaxed)
    }

    /// Lets a coarse picture stand for a while, unless something newer is wanted.
    fn stand(&self) -> Result<(), Interrupt> {
        let until = Instant::now() + STANDING;
        while Instant::now() < until {
            if self.is_overtaken() {
                return Err(Interrupt::Overtaken);
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }
}

/// What engines count.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    samples: u64,
    gpu_bytes: u64,
}

impl Prepared {
    fn adapter(&self) -> Option<String> {
        let gpu = match self {
            Self::Raycast { renderer, .. } => renderer.gpu(),
            Self::Slices { renderer, .. } => renderer.gpu(),
            Self::Cells { renderer, .. } => renderer.gpu(),
            Self::Cpu { .. } | Self::Reference => return None,
        };
        Some(gpu.adapter().name.clone())
    }

    fn notices(&self, scene: &Scene) -> Vec<String> {
        let settings = scene.settings();
        match self {
            Self::Cpu { .. } => cutaway_cpu::notices(settings),
            Self::Raycast { volume, .. } => {
                let of_volume = volume.notices().into_iter().map(|notice| notice.to_string());
                raycast::notices(settings).into_iter().chain(of_volume).collect()
            }
            Self::Slices { renderer, volume, .. } => {
                let of_volume = volume.notices().into_iter().map(|notice| notice.to_string());
                renderer.notices(settings).into_iter().chain(of_volume).collect()
            }
            Self::Cells { cells, .. } => cells.notices().iter().map(ToString::to_string).collect(),
            Self::Reference => Vec::new(),
        }
    }

    fn classify(&mut self, scene: &Scene) -> Result<(), GpuError> {
        match self {
            Self::Cpu { renderer, volume, classification } => {
                **classification = renderer.classify(volume, scene)
            }
            Self::Raycast { renderer, volume, classification } => {
                **classification = renderer.classify(volume, scene)?;
            }
            Self::Slices { renderer, volume, classification } => {
                **classification = renderer.classify(volume, scene)?;
            }
            Self::Cells { renderer, cells, classification } => {
                **classification = renderer.classify(cells, scene)?;
            }
            Self::Reference => {}
        }
        Ok(())
    }

    fn render(
        &self,
        view: &View<'_>,
        pace: &mut Pace,
        hand_over: &mut HandOver<'_>,
    ) -> Result<(), Interrupt> {
        match self {
            Self::Cpu { renderer, volume, classification } => {
                progressively(renderer, volume, classification, view, hand_over)
            }
            _ => self.coarse_then_whole(view, pace, hand_over),
        }
    }

    /// A smaller image first, unless a whole one comes in time.
    fn coarse_then_whole(
        &self,
        view: &View<'_>,
        pace: &mut Pace,
        hand_over: &mut HandOver<'_>,
    ) -> Result<(), Interrupt> {
        let size = view.request.size;
        let first = pace.factor(size, MOVING_BUDGET);
        // From the first to the whole in steps of two: each costs a quarter of the next.
        let mut factors = vec![first];
        while let Some(&last) = factors.last()
            && last > 1
        {
            factors.push(if last > 4 { last / 2 } else { 1 });
        }
        for factor in factors {
            let size = reduced(size, factor);
            let state = &view.request.state;
            let scene = state.scene(view.scene.data(), view.request.clip.as_ref(), size)?;
            let began = Instant::now();
            let (shown, counts) = self.shown(&scene, view, factor > 1)?;
            pace.note(size, began.elapsed());
            hand_over(view.frame(shown, factor, counts))?;
            if factor == first && first > 1 {
                view.stand()?;
            }
            if view.is_overtaken() {
                return Err(Interrupt::Overtaken);
            }
        }
        Ok(())
    }

    /// A whole image at once, wherever it is. All but the `first` is given up once something newer is wanted.
    fn shown(&self, scene: &Scene, view: &View<'_>, first: bool) -> Result<(Shown, Counts), Interrupt> {
        let cancel = (!first).then_some(view.overtaken);
        let given_up = |error: GpuError| match error {
            GpuError::Cancelled => Interrupt::Overtaken,
            error => error.into(),
        };
        let extras = Extras { cancel, ..view.request.debug.extras() };
        // Counts are made into colours on the host.
        if view.on_device
            && view.request.debug != DebugView::Fetches
            && let Some(frame) = self.show(scene, &extras)
        {
            let ShownFrame { texture, gpu_bytes } = frame.map_err(given_up)?;
            return Ok((Shown::OnDevice(texture), Counts { samples: 0, gpu_bytes }));
        }
        let (image, counts) = self.whole(scene, view.request.debug, cancel, &|_| {}).map_err(given_up)?;
        Ok((Shown::Pixels(Pixels::of(&image)), counts))
    }

    /// A whole image at once, left on the device; none of engines that have none.
    fn show(&self, scene: &Scene, extras: &Extras) -> Option<Result<ShownFrame, GpuError>> {
        match self {
            Self::Raycast { renderer, volume, classification } => {
                Some(renderer.show(volume, classification, scene, extras))
            }
            Self::Slices { renderer, volume, classification } => {
                Some(renderer.show(volume, classification, scene, extras.cancel))
            }
            Self::Cells { renderer, cells, classification } => {
                Some(renderer.show(cells, classification, scene, extras.cancel))
            }
            Self::Cpu { .. } | Self::Reference => None,
        }
    }

    /// A whole image at once; GPU engines give it up once `cancel` is set.
    fn whole(
        &self,
        scene: &Scene,
        debug: DebugView,
        cancel: Option<&AtomicBool>,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<(Image, Counts), GpuError> {
        match self {
            Self::Cpu { renderer, volume, classification } => {
                let (image, s) = renderer.render(volume, classification, scene, progress);
                Ok((image, Counts { samples: s.samples, gpu_bytes: 0 }))
            }
            Self::Raycast { renderer, volume, classification } => {
                let (image, s) = match debug {
                    DebugView::Fetches => {
                        let (counts, s) = renderer.fetch_counts(volume, classification, scene, progress)?;
                        (counts.false_color(counts.most()), s)
                    }
                    DebugView::Off | DebugView::Wireframe => {
                        let extras = Extras { cancel, ..debug.extras() };
                        renderer.render_with(volume, classification, scene, &extras, progress)?
                    }
                };
                Ok((image, Counts { samples: s.samples, gpu_bytes: s.gpu_bytes }))
            }
            Self::Slices { renderer, volume, classification } => {
                let (image, s) = renderer.render_with(volume, classification, scene, cancel, progress)?;
                Ok((image, Counts { samples: 0, gpu_bytes: s.gpu_bytes }))
            }
            Self::Cells { renderer, cells, classification } => {
                let (image, s) = renderer.render_with(cells, classification, scene, cancel, progress)?;
                Ok((image, Counts { samples: 0, gpu_bytes: s.gpu_bytes }))
            }
            Self::Reference => {
                let (image, _) = reference::render_with_progress(scene, progress);
                Ok((image, Counts::default()))
            }
        }
    }
}

/// A frame within the budget, then finer ones.
fn progressively(
    renderer: &CpuRenderer,
    volume: &CpuVolume,
    classification: &Classification,
    view: &View<'_>,
    hand_over: &mut HandOver<'_>,
) -> Result<(), Interrupt> {
    let mut progressive = renderer.progressive(volume, classification, view.scene);
    // The first frame is made whoever waits: a picture that moves is better coarse than never.
    let never = AtomicBool::new(false);
    let budget = MOVING_BUDGET.mul_f64(CASTING_SHARE);
    let mut step = progressive.advance(budget, &never);
    if step.spacing > MOVING_SPACING {
        step = progressive.advance(budget, &never);
    }
    let mut stood = false;
    loop {
        let counts = Counts { samples: progressive.statistics().samples, gpu_bytes: 0 };
        let spacing = if step.done { 1 } else { step.spacing.max(2) };
        let shown = Shown::Pixels(Pixels::of(&progressive.image()));
        hand_over(view.frame(shown, spacing, counts))?;
        if step.done {
            return Ok(());
        }
        if !std::mem::replace(&mut stood, true) {
            view.stand()?;
        }
        step = progressive.advance(REFINING_BUDGET, view.overtaken);
        if step.cancelled || view.is_overtaken() {
            return Err(Interrupt::Overtaken);
        }
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
