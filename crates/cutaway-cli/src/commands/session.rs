//! A scene on the engine that renders it: prepared once, then frame after frame.

use std::time::Instant;

use cutaway_core::camera::Camera;
use cutaway_core::clip::ClipEventsHome;
use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Engine, Mode, Scene};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, SimdChoice, Statistics};
use cutaway_gpu::cells::{CellClassification, PreparedCells};
use cutaway_gpu::context::{AdapterChoice, adapters};
use cutaway_gpu::raycast::{self, PreparedVolume};
use cutaway_gpu::slices::{self, SliceClassification};
use cutaway_gpu::{
    CellOptions, CellRenderer, CellStatistics, Extras, Gpu, GpuClassification, GpuError, GpuOptions,
    RaycastRenderer, SliceRenderer,
};

use super::statistics::{FrameTimes, StatisticsFile, peak_rss_bytes};
use crate::args::{DebugView, SceneArgs, Simd};
use crate::report::{Verbosity, wrong_use};
use crate::scene::Prepared;

pub(crate) struct Session {
    scene: Scene,
    engine: Running,
    /// How the cpu engine would be started, where it stands in for a GPU that fails.
    cpu: CpuChoice,
    verbosity: Verbosity,
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
    clip_ms: Option<f64>,
    gpu_ms: Option<f64>,
    gpu_bytes: Option<u64>,
    triangles: Option<u64>,
    tetrahedra: Option<u64>,
}

impl From<CellStatistics> for Counts {
    fn from(s: CellStatistics) -> Self {
        Self {
            repaired_lines: Some(s.clip.repaired),
            clip_ms: Some(s.clip.milliseconds),
            gpu_bytes: Some(s.gpu_bytes),
            tetrahedra: Some(s.drawn),
            ..Self::default()
        }
    }
}

impl From<Statistics> for Counts {
    fn from(s: Statistics) -> Self {
        Self {
            samples: Some(s.samples),
            rays: Some(s.rays),
            segments: Some(s.segments),
            repaired_lines: Some(s.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            ..Self::default()
        }
    }
}

impl From<cutaway_gpu::Statistics> for Counts {
    fn from(s: cutaway_gpu::Statistics) -> Self {
        Self {
            samples: Some(s.samples),
            rays: Some(s.rays),
            segments: Some(s.segments),
            repaired_lines: Some(s.clip.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            clip_ms: Some(s.clip.milliseconds),
            gpu_ms: s.gpu_ms,
            gpu_bytes: Some(s.gpu_bytes),
            ..Self::default()
        }
    }
}

impl From<slices::Statistics> for Counts {
    fn from(s: slices::Statistics) -> Self {
        Self {
            rays: Some(s.rays),
            repaired_lines: Some(s.clip.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            clip_ms: Some(s.clip.milliseconds),
            gpu_ms: s.gpu_ms,
            gpu_bytes: Some(s.gpu_bytes),
            triangles: Some(s.triangles()),
            ..Self::default()
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
    Cpu { renderer: CpuRenderer, volume: Box<CpuVolume>, classification: Box<Classification> },
    Raycast(Box<OnGpu>),
    Cells(Box<InCells>),
    Slices(Box<Sliced>),
    Reference { pool: rayon::ThreadPool },
}

/// Straight RGB of the proxy geometry's edges: seen against bone, skin and nothing.
const WIREFRAME: [f32; 3] = [0.1, 0.9, 0.4];

/// The GPU ray caster with a volume made ready.
struct OnGpu {
    renderer: RaycastRenderer,
    volume: PreparedVolume,
    classification: GpuClassification,
    /// Whether nobody asked for a GPU: the cpu engine may take its place.
    chosen_by_itself: bool,
    debug: Option<DebugView>,
}

/// The slice renderer with a volume made ready.
struct Sliced {
    renderer: SliceRenderer,
    volume: slices::PreparedVolume,
    classification: SliceClassification,
}

/// The cell renderer with a volume or an unstructured grid made ready.
struct InCells {
    renderer: CellRenderer,
    cells: PreparedCells,
    classification: CellClassification,
}

#[derive(Clone, Copy, Debug)]
struct CpuChoice {
    threads: usize,
    simd: Simd,
}

/// An engine, and milliseconds to prepare and to classify.
type Started = (Running, f64, f64);

impl Session {
    pub(crate) fn new(prepared: &Prepared, args: &SceneArgs, verbosity: Verbosity) -> anyhow::Result<Self> {
        let scene = prepared.scene()?;
        let cpu = CpuChoice { threads: args.threads, simd: args.simd };
        let mesh = prepared.loaded.data.grid().map(|grid| &**grid);
        let (engine, prepare_ms, classify_ms) = match scene.settings().engine {
            Engine::Cells => start_cells(&scene, mesh, args.gpu.as_deref(), verbosity)?,
            Engine::Auto if mesh.is_some() => start_cells(&scene, mesh, args.gpu.as_deref(), verbosity)?,
            engine if mesh.is_some() => {
                let (file, engine) = (&prepared.loaded.name, engine.name());
                return Err(wrong_use(format!(
                    "{file} is an unstructured grid, which the {engine} engine does not render; take `--engine cells`"
                )));
            }
            Engine::Reference => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build()?;
                (Running::Reference { pool }, 0.0, 0.0)
            }
            Engine::Cpu => cpu.start(&scene)?,
            Engine::Raycast => start_raycast(&scene, args.gpu.as_deref(), false, verbosity)?,
            Engine::Slices => start_slices(&scene, args.gpu.as_deref(), verbosity)?,
            Engine::Auto => start_auto(&scene, args.gpu.as_deref(), cpu, verbosity)?,
        };
        let load_ms = prepared.loaded.load_ms;
        Ok(Self { scene, engine, cpu, verbosity, load_ms, prepare_ms, classify_ms })
    }

    /// Which ways of finding clip events the engine has.
    pub(crate) fn clip_events_home(&self) -> ClipEventsHome {
        match &self.engine {
            Running::Cpu { .. } | Running::Reference { .. } => ClipEventsHome::Cpu,
            Running::Raycast(_) | Running::Slices(_) | Running::Cells(_) => ClipEventsHome::Gpu,
        }
    }

    /// Why images come without depths, if they do.
    pub(crate) fn lacks_depth(&self) -> Option<&'static str> {
        let extreme = matches!(self.scene.settings().mode, Mode::Mip | Mode::Minip);
        match &self.engine {
            Running::Slices(_) if extreme => Some("slices do not know where a ray has its extreme value"),
            Running::Cells(_) => Some("cells blend colours alone"),
            _ => None,
        }
    }

    pub(crate) fn set_camera(&mut self, camera: Camera) -> anyhow::Result<()> {
        Ok(self.scene.set_camera(camera)?)
    }

    /// Shows how the engine works, from the next frame on; an error where it is not the one that can.
    pub(crate) fn set_debug(&mut self, view: DebugView) -> anyhow::Result<()> {
        let Running::Raycast(on_gpu) = &mut self.engine else {
            return Err(wrong_use("--debug shows how the raycast engine works; add --engine raycast"));
        };
        let proxy = on_gpu.renderer.proxy_counts(&on_gpu.classification, &self.scene)?;
        if view == DebugView::Wireframe && proxy.is_none() {
            return Err(wrong_use(format!(
                "--debug wireframe shows proxy geometry, of which there is none in {} mode with --space-skipping {}; take \
                 cells, fitted, boundary, contour or fitted-contour, and composite or iso mode",
                self.scene.settings().mode.name(),
                self.scene.settings().space_skipping.name()
            )));
        }
        on_gpu.debug = Some(view);
        Ok(())
    }

    /// Renders a frame; also its time in milliseconds.
    pub(crate) fn frame(&mut self, progress: &(dyn Fn(f32) + Sync)) -> anyhow::Result<(Image, Counts, f64)> {
        let started = Instant::now();
        let (image, statistics) = match &self.engine {
            Running::Cpu { renderer, volume, classification } => {
                let (image, counts) = renderer.render(volume, classification, &self.scene, progress);
                (image, counts.into())
            }
            Running::Raycast(on_gpu) => match on_gpu.render(&self.scene, progress) {
                Ok((image, counts)) => (image, counts.into()),
                Err(error) if on_gpu.chosen_by_itself => {
                    self.verbosity.notice(&instead(&error));
                    (self.engine, self.prepare_ms, self.classify_ms) = self.cpu.start(&self.scene)?;
                    return self.frame(progress);
                }
                Err(error) => return Err(error.into()),
            },
            Running::Cells(c) => {
                let (image, counts) =
                    c.renderer.render(&c.cells, &c.classification, &self.scene, progress)?;
                (image, counts.into())
            }
            Running::Slices(on_gpu) => {
                let Sliced { renderer, volume, classification } = &**on_gpu;
                let (image, counts) = renderer.render(volume, classification, &self.scene, progress)?;
                (image, counts.into())
            }
            Running::Reference { pool } => {
                let (image, counts) = pool.install(|| reference::render_with_progress(&self.scene, progress));
                (image, counts.into())
            }
        };
        Ok((image, statistics, milliseconds(started)))
    }

    pub(crate) fn statistics(&self, frame: Counts, times: Vec<f64>) -> StatisticsFile {
        let (engine, simd, threads) = match &self.engine {
            Running::Cpu { renderer, .. } => ("cpu", Some(renderer.simd()), renderer.threads()),
            Running::Raycast(_) => ("raycast", None, 1),
            Running::Cells(_) => ("cells", None, 1),
            Running::Slices(_) => ("slices", None, 1),
            Running::Reference { pool } => ("reference", None, pool.current_num_threads()),
        };
        let gpu = match &self.engine {
            Running::Raycast(on_gpu) => Some(on_gpu.renderer.gpu()),
            Running::Slices(on_gpu) => Some(on_gpu.renderer.gpu()),
            Running::Cells(in_cells) => Some(in_cells.renderer.gpu()),
            _ => None,
        };
        StatisticsFile {
            engine,
            adapter: gpu.map(|gpu| gpu.adapter().name.clone()),
            simd,
            threads,
            resolution: self.scene.settings().resolution,
            load_ms: self.load_ms,
            prepare_ms: self.prepare_ms,
            classify_ms: self.classify_ms,
            clip_ms: frame.clip_ms.unwrap_or(0.0),
            frame_ms: FrameTimes::of(times),
            gpu_ms: frame.gpu_ms,
            samples: frame.samples,
            rays: frame.rays,
            segments: frame.segments,
            repaired_lines: frame.repaired_lines,
            skipped_fraction: frame.skipped_fraction,
            peak_rss_bytes: peak_rss_bytes(),
            gpu_bytes: frame.gpu_bytes,
            triangles_or_tetrahedra: frame.triangles.or(frame.tetrahedra),
        }
    }
}

impl CpuChoice {
    fn start(self, scene: &Scene) -> anyhow::Result<Started> {
        let started = Instant::now();
        let renderer = CpuRenderer::new(self.threads, simd(self.simd))?;
        let volume = Box::new(renderer.prepare(scene.volume())?);
        let prepare_ms = milliseconds(started);
        let classified = Instant::now();
        let classification = Box::new(renderer.classify(&volume, scene));
        Ok((Running::Cpu { renderer, volume, classification }, prepare_ms, milliseconds(classified)))
    }
}

impl OnGpu {
    fn render(
        &self,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, cutaway_gpu::Statistics), GpuError> {
        let (volume, classification) = (&self.volume, &self.classification);
        match self.debug {
            None => self.renderer.render(volume, classification, scene, progress),
            Some(DebugView::Fetches) => {
                let (counts, statistics) =
                    self.renderer.fetch_counts(volume, classification, scene, progress)?;
                Ok((counts.false_color(counts.most()), statistics))
            }
            Some(DebugView::Wireframe) => {
                let extras = Extras { wireframe: Some(WIREFRAME), ..Extras::default() };
                self.renderer.render_with(volume, classification, scene, &extras, progress)
            }
        }
    }
}

fn start_raycast(
    scene: &Scene,
    name: Option<&str>,
    chosen_by_itself: bool,
    verbosity: Verbosity,
) -> Result<Started, GpuError> {
    let started = Instant::now();
    let renderer = RaycastRenderer::new(&gpu(name)?)?;
    let volume = renderer.prepare(scene.volume())?;
    let prepare_ms = milliseconds(started);
    let classified = Instant::now();
    let classification = renderer.classify(&volume, scene)?;
    raycast::notices(scene.settings()).iter().for_each(|notice| verbosity.notice(notice));
    volume.notices().iter().for_each(|notice| verbosity.notice(&notice.to_string()));
    let on_gpu = OnGpu { renderer, volume, classification, chosen_by_itself, debug: None };
    Ok((Running::Raycast(Box::new(on_gpu)), prepare_ms, milliseconds(classified)))
}

fn start_cells(
    scene: &Scene,
    mesh: Option<&TetrahedralMesh>,
    name: Option<&str>,
    verbosity: Verbosity,
) -> Result<Started, GpuError> {
    let started = Instant::now();
    let renderer = CellRenderer::new(&gpu(name)?, CellOptions::default())?;
    let cells = match mesh {
        Some(mesh) => renderer.prepare_mesh(mesh)?,
        None => renderer.prepare(scene.volume())?,
    };
    let prepare_ms = milliseconds(started);
    let classified = Instant::now();
    let classification = renderer.classify(&cells, scene)?;
    cells.notices().iter().for_each(|notice| verbosity.notice(&notice.to_string()));
    let in_cells = InCells { renderer, cells, classification };
    Ok((Running::Cells(Box::new(in_cells)), prepare_ms, milliseconds(classified)))
}

fn start_slices(scene: &Scene, name: Option<&str>, verbosity: Verbosity) -> Result<Started, GpuError> {
    let started = Instant::now();
    let renderer = SliceRenderer::new(&gpu(name)?)?;
    let volume = renderer.prepare(scene.volume())?;
    let prepare_ms = milliseconds(started);
    let classified = Instant::now();
    let classification = renderer.classify(&volume, scene)?;
    renderer.notices(scene.settings()).iter().for_each(|notice| verbosity.notice(notice));
    volume.notices().iter().for_each(|notice| verbosity.notice(&notice.to_string()));
    let sliced = Sliced { renderer, volume, classification };
    Ok((Running::Slices(Box::new(sliced)), prepare_ms, milliseconds(classified)))
}

/// The GPU of this name, or the best one.
fn gpu(name: Option<&str>) -> Result<Gpu, GpuError> {
    let adapter = name.map_or(AdapterChoice::Best, |name| AdapterChoice::Named(name.to_owned()));
    Gpu::new(&GpuOptions { adapter, ..GpuOptions::default() })
}

/// A real GPU where there is one; a processor that plays GPU is slower than the cpu engine.
fn start_auto(
    scene: &Scene,
    name: Option<&str>,
    cpu: CpuChoice,
    verbosity: Verbosity,
) -> anyhow::Result<Started> {
    let real = name.is_some() || adapters().first().is_some_and(|adapter| !adapter.software);
    if !real {
        return cpu.start(scene);
    }
    match start_raycast(scene, name, true, verbosity) {
        Ok(started) => Ok(started),
        Err(error @ GpuError::UnknownAdapter { .. }) => Err(error.into()),
        Err(error) => {
            verbosity.notice(&instead(&error));
            cpu.start(scene)
        }
    }
}

fn instead(error: &GpuError) -> String {
    format!("{error}; the cpu engine renders instead")
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
