//! The cell renderer: projected tetrahedra (Maximo et al. 2007, after Shirley and Tuchman), for grids and for meshes.
//!
//! Enters: a prepared volume or mesh, its classification and a scene. Leaves: an image. The field is *linear in each
//! tetrahedron*: a grid's cell is cut into five (or six), so between its corners it is not the trilinear field of the other
//! engines, only near to it, the nearer the finer the grid; the exact integral of that field is what is drawn.
//!
//! 1. Which tetrahedra can be visible, and in which order, is found by compute shaders (`select.wgsl`; `sort.wgsl`).
//! 2. Each is projected (`project.wgsl`): under parallel rays once for all cells of a grid (`basis`), else one by one.
//! 3. Each is drawn in compute shaders, tile by tile and front to back (`tiles`); or as a fan of triangles by the rasteriser,
//!    whose fragments integrate along their rays (`integral.wgsl`), are cut by clip segments and lit, and are blended back to
//!    front.
//!
//! Order: of grids it is exact, in perspective too. Meshes are sorted by the depth of their centroids, which is right for
//! most pairs of neighbours and wrong for some where sizes or shapes differ much: see `CellRenderer::prepare_mesh`.
//! What is nearer to the eye than a thousandth of its distance to the volume's middle is not drawn: tiles cut cells at that
//! plane, triangles leave out those that reach beyond it. Where pieces of the transfer function meet in one tetrahedron, and a
//! few pixels' rays cross them in the opposite order of their neighbours', tiles take the neighbours' order.
//! Targets are of 32-bit floats where the device blends those; 16-bit ones round each layer to 11 bits: an image of a
//! hundred layers is then off by 0.002 or so.
//!
//! | object | holds | made anew |
//! |---|---|---|
//! | [`CellRenderer`] | pipelines | once |
//! | [`PreparedCells`] | voxels and ranges, or points and corners | for another volume |
//! | [`CellClassification`] | occupancy, pieces of the transfer function | on an edit of it |

mod basis;
mod drawing;
mod grid;
mod layouts;
mod mesh;
pub(crate) mod numbers;
mod options;
mod pass;
mod pipelines;
mod tables;
mod tiles;
mod variant;
mod view;

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::scene::{Mode, Scene};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::Volume;

use crate::classification::GpuClassification;
use crate::clipping::{ClipStatistics, Clipping, PeelSettings};
use crate::clock::Moment;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::{
    Finished, Finisher, FrameUniforms, Lattice, Pending, PreparedVolume, Progress, RayPlane, ShownFrame,
    Targets,
};
use crate::notice::Notice;
use crate::ranges::BlockPipelines;
use drawing::{Drawing, Timing};
use grid::{GridBuffers, GridFrame};
use mesh::{GpuTetrahedra, VisibleCells};
pub use options::{CellDrawing, CellIntegral, CellOptions, Split};
use pass::pass;
use pipelines::Pipelines;
pub use tables::PSI_ERROR;
use tables::Tables;
use tiles::TileBuffers;
use variant::{Source, Variant};
use view::CellCamera;

#[cfg(test)]
pub(crate) use {
    basis::BasisTetrahedron,
    grid::SelectTask,
    mesh::{MeshTask, SortTask},
    pipelines::{
        DRAW_SHADER, PROJECT_GRID_SHADER, PROJECT_MESH_SHADER, SELECT_SHADER, SORT_SHADER, TILES_GRID_SHADER,
        WIDEN_SHADER,
    },
    tables::Piece,
    tiles::{TILES_BIN_SHADER, TILES_COMPOSITE_SHADER, TILES_MESH_SHADER, TILES_SHOW_SHADER, TileTask},
    view::CellViewUniforms,
};

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellStatistics {
    /// Tetrahedra that there are.
    pub nominal: u64,
    /// Tetrahedra that were drawn: visible ones, in front of the eye, that a pixel's centre can be in.
    pub drawn: u64,
    /// Bytes on the device.
    pub gpu_bytes: u64,
    /// What clipping took.
    pub clip: ClipStatistics,
    /// Milliseconds of selecting, projecting and sorting, and of drawing; where [`CellOptions::timed`] asks for them.
    pub setup_ms: f64,
    /// See `setup_ms`.
    pub draw_ms: f64,
}

/// Pipelines on a device.
#[derive(Debug)]
pub struct CellRenderer {
    gpu: Gpu,
    options: CellOptions,
    blocks: BlockPipelines,
    pipelines: Pipelines,
    finisher: Finisher,
    targets: Mutex<Option<Targets>>,
    grid: Mutex<Option<GridBuffers>>,
    tiles: Mutex<Option<TileBuffers>>,
    clip: Mutex<Clipping>,
}

/// A volume or a mesh made ready.
#[derive(Debug)]
pub struct PreparedCells {
    /// The volume, or the lattice of a mesh.
    volume: PreparedVolume,
    cells: UVec3,
    mesh: Option<GpuTetrahedra>,
}

impl PreparedCells {
    /// Tetrahedra that there are, of a grid cut into so many a cell.
    pub fn tetrahedra(&self, split: Split) -> u64 {
        let cells = || self.cells.to_array().iter().map(|n| u64::from(*n)).product::<u64>();
        self.mesh.as_ref().map_or_else(|| cells() * u64::from(split.count()), GpuTetrahedra::cells)
    }

    /// What was substituted so that it fits.
    pub fn notices(&self) -> Vec<Notice> {
        if self.mesh.is_some() { Vec::new() } else { self.volume.notices() }
    }
}

/// What a scene makes visible.
#[derive(Debug)]
pub struct CellClassification {
    classification: GpuClassification,
    tables: Tables,
    /// Of a mesh.
    visible: Option<VisibleCells>,
}

impl CellRenderer {
    /// Makes what all frames share.
    pub fn new(gpu: &Gpu, options: CellOptions) -> Result<Self, GpuError> {
        Ok(Self {
            gpu: gpu.clone(),
            options,
            blocks: BlockPipelines::new(gpu)?,
            pipelines: Pipelines::new(gpu)?,
            finisher: Finisher::new(gpu)?,
            targets: Mutex::default(),
            grid: Mutex::default(),
            tiles: Mutex::default(),
            clip: Mutex::default(),
        })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// How cells are drawn.
    pub fn options(&self) -> CellOptions {
        self.options
    }

    /// The same pipelines, drawing otherwise from now on.
    pub fn set_options(&mut self, options: CellOptions) {
        self.options = options;
    }

    /// How far the meshes of clips are peeled, where a scene's `clip_events` say so.
    pub fn set_peeling(&self, settings: PeelSettings) {
        self.clip.lock().unwrap_or_else(PoisonError::into_inner).peel_settings = settings;
    }

    /// Makes a volume ready: uploads it, and finds the ranges of its blocks.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedCells, GpuError> {
        let cells = volume.dimensions().saturating_sub(UVec3::ONE);
        Ok(PreparedCells { volume: PreparedVolume::new(&self.gpu, &self.blocks, volume)?, cells, mesh: None })
    }

    /// Makes a mesh ready; scenes show it as a [`Data::Grid`](cutaway_core::scene::Data::Grid).
    ///
    /// Its tetrahedra are drawn by the depth of their centroids. Of two that overlap in the image the one behind can have the
    /// nearer centroid, where it is large or long; their colours are then blended in the wrong order, which two like ones do
    /// not show. `cutaway-testing/tests/gpu_cells.rs` measures what that makes of an image.
    pub fn prepare_mesh(&self, mesh: &TetrahedralMesh) -> Result<PreparedCells, GpuError> {
        let volume = PreparedVolume::new(&self.gpu, &self.blocks, mesh.lattice())?;
        let [lo, hi] = mesh.lattice().stored_range().map(f64::from);
        let scale = if hi > lo { tables::BINS_OF_RANGE / (hi - lo) } else { 0.0 };
        let bin_of = |stored: f32| ((f64::from(stored) - lo) * scale) as f32;
        let gpu_mesh = GpuTetrahedra::new(&self.gpu, mesh, bin_of)?;
        Ok(PreparedCells { volume, cells: UVec3::ZERO, mesh: Some(gpu_mesh) })
    }

    /// Classifies what is prepared for a scene.
    pub fn classify(&self, cells: &PreparedCells, scene: &Scene) -> Result<CellClassification, GpuError> {
        check_mode(scene)?;
        let scene = &*scene.normalised();
        let (ranges, voxels) = (cells.volume.ranges(), cells.volume.voxels());
        let classification = GpuClassification::new(&self.gpu, &self.blocks, ranges, voxels, scene)?;
        let tables = Tables::new(&self.gpu, scene, voxels.texels())?;
        let visible = cells.mesh.as_ref().map(|mesh| mesh.visible(&self.gpu, &tables)).transpose()?;
        Ok(CellClassification { classification, tables, visible })
    }

    /// Renders a frame of a scene with a classification made for it. `progress` is called with the finished share of the
    /// image, 0..=1. The image has no depth: fragments come back to front, and none knows what is before it.
    pub fn render(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, CellStatistics), GpuError> {
        self.render_with(cells, classification, scene, None, progress)
    }

    /// As [`Self::render`]; once `cancel` is set, the frame ends between two parts of it, as [`GpuError::Cancelled`].
    pub fn render_with(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, CellStatistics), GpuError> {
        self.submit(cells, classification, scene, cancel, progress)?.outcome()
    }

    /// The first half of [`Self::render_with`]: hands a frame to the device and does not wait for its last part.
    pub fn submit(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
        progress: &dyn Fn(f32),
    ) -> Result<Pending<CellStatistics>, GpuError> {
        let progress = Progress::new(progress, cancel);
        self.drawn(cells, classification, scene, &progress, |finished, statistics| {
            Pending::of_colors(&self.gpu, finished, statistics)
        })
    }

    /// Renders a frame as [`Self::render_with`] does, for a window drawn with the same device: nothing is copied to the host.
    /// Returns when it is there.
    pub fn show(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
    ) -> Result<ShownFrame, GpuError> {
        let progress = Progress::new(&|_| {}, cancel);
        self.drawn(cells, classification, scene, &progress, |finished, statistics| {
            self.finisher.show(&self.gpu, finished, statistics.gpu_bytes)
        })
    }

    /// Draws a frame, for `take` to do something with it.
    fn drawn<T>(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        progress: &Progress,
        take: impl FnOnce(&Finished, CellStatistics) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        check_mode(scene)?;
        let scene = &*scene.normalised();
        let size = Lattice::of(scene).size;
        let mut kept = self.targets.lock().unwrap_or_else(PoisonError::into_inner);
        let targets = match kept.take() {
            Some(targets) if targets.size() == size => targets,
            _ => Targets::new(&self.gpu, size)?,
        };
        let mut statistics = self.draw(cells, classification, scene, &targets, progress)?;
        let finished = self.finisher.finish(&self.gpu, scene, &targets)?;
        statistics.gpu_bytes += targets.bytes() + finished.bytes;
        let taken = take(&finished, statistics)?;
        *kept = Some(targets);
        Ok(taken)
    }

    fn draw(
        &self,
        cells: &PreparedCells,
        classification: &CellClassification,
        scene: &Scene,
        targets: &Targets,
        progress: &Progress,
    ) -> Result<CellStatistics, GpuError> {
        progress.check()?;
        let gpu = &self.gpu;
        let size = targets.size();
        let voxels = cells.volume.voxels();
        let frame = FrameUniforms::new(scene, voxels, &classification.classification, size);
        let mut clipping = self.clip.lock().unwrap_or_else(PoisonError::into_inner);
        let clip = match scene.clip() {
            Some(clip) => clipping.update(gpu, clip, scene, &frame)?,
            None => ClipStatistics::default(),
        };
        let segments = clipping.segments().filter(|_| scene.clip().is_some());
        let world_from_cells = match &cells.mesh {
            Some(mesh) => scene.space().scene_from_world() * mesh.world_from_cells(),
            None => *scene.volume().world_from_voxel(),
        };
        let view = CellCamera::new(&RayPlane::new(scene, size), &world_from_cells, size);
        let source = match &cells.mesh {
            Some(_) => Source::Mesh,
            None if view.is_parallel() => Source::Basis,
            None => Source::Grid,
        };
        // An overlay is seen in cells that are not.
        let draw_all = scene.clip().is_some() && scene.clip_shading().overlay > 0.0;
        let mut uniforms = view.uniforms();
        classification.tables.describe(&mut uniforms);
        [uniforms.cells_x, uniforms.cells_y, uniforms.cells_z] = cells.cells.to_array();
        uniforms.draw_all = u32::from(draw_all);
        let in_tiles = self.in_tiles(scene, cells, &view, size);
        uniforms.keeps_behind = u32::from(in_tiles);
        // Until all is submitted no other scene may change which bricks are there.
        let resident = voxels.resident(gpu, scene.volume(), classification.classification.wanted())?;
        let target = self.target(targets)?;
        let [scene_group, image_group, tables_group] = gpu.checked("a frame's inputs", || {
            let frame = gpu.buffer("frame", bytemuck::bytes_of(&frame), wgpu::BufferUsages::UNIFORM);
            let view = gpu.buffer("view", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
            let nothing = gpu.buffer("no segments", &[0; 16], wgpu::BufferUsages::STORAGE);
            [
                self.pipelines.bind_scene(gpu, &frame, voxels, &classification.classification, &resident),
                self.pipelines.bind_image(gpu, segments.unwrap_or([&nothing; 2])),
                self.pipelines.bind_tables(gpu, &view, &classification.tables),
            ]
        })?;
        self.clear(targets, &target)?;
        let timing = Mutex::new(Timing { since: Moment::now(), setup_ms: 0.0, draw_ms: 0.0 });
        if self.options.timed {
            gpu.finish()?;
        }
        let drawing = Drawing {
            gpu,
            pipelines: &self.pipelines,
            variant: Variant::of(gpu, scene, voxels, source, self.options),
            target: &target,
            colors: &targets.views()[0],
            scene: &scene_group,
            image: &image_group,
            tables: &tables_group,
            piece_texels: &classification.tables.piece_texels,
            timing: self.options.timed.then_some(&timing),
        };
        drawing.restart();
        let (drawn, bytes) = match (&cells.mesh, &classification.visible) {
            (Some(mesh), Some(visible)) if in_tiles => {
                let (drawn, bytes) = self.draw_tiles(&drawing, size, |tiles| {
                    mesh.draw_tiles(&drawing, &view, visible, tiles, progress)
                })?;
                (drawn, bytes + mesh.bytes() + visible.bytes())
            }
            (Some(mesh), _) => (mesh.draw(&drawing, &view, progress)?, mesh.bytes()),
            (None, _) => self.draw_grid(&drawing, &view, cells, classification, |grid, frame| {
                if !in_tiles {
                    return Ok((grid.draw(&drawing, frame, progress)?, 0));
                }
                self.draw_tiles(&drawing, size, |tiles| grid.draw_tiles(&drawing, frame, tiles, progress))
            })?,
        };
        if self.pipelines.target() != wgpu::TextureFormat::Rgba32Float && !in_tiles {
            self.pipelines.widen(gpu, &target, &targets.views()[0])?;
        }
        drawing.end_of_drawing()?;
        let timing = timing.into_inner().unwrap_or_else(PoisonError::into_inner);
        let held = voxels.bytes() + cells.volume.ranges().bytes() + classification.classification.bytes();
        Ok(CellStatistics {
            nominal: cells.tetrahedra(self.options.split),
            drawn,
            gpu_bytes: held + classification.tables.bytes() + bytes + clipping.bytes(),
            clip,
            setup_ms: timing.setup_ms,
            draw_ms: timing.draw_ms,
        })
    }

    /// Whether a scene is drawn in tiles.
    fn in_tiles(&self, scene: &Scene, cells: &PreparedCells, view: &CellCamera, size: [u32; 2]) -> bool {
        let [lo, hi] = match &cells.mesh {
            Some(mesh) => mesh.bounds(),
            None => [DVec3::ZERO, cells.cells.as_dvec3()],
        };
        let wanted = match self.options.drawing {
            CellDrawing::Auto => self.gpu.adapter().software || view.reaches_behind(lo, hi),
            CellDrawing::Triangles => false,
            CellDrawing::Tiles => true,
        };
        let plain =
            self.options.integral == CellIntegral::Exact && !scene.is_shaded() && scene.clip().is_none();
        wanted && plain && TileBuffers::can_draw(size)
    }

    fn draw_tiles(
        &self,
        drawing: &Drawing,
        size: [u32; 2],
        draw: impl FnOnce(&mut TileBuffers) -> Result<u64, GpuError>,
    ) -> Result<(u64, u64), GpuError> {
        let mut kept = self.tiles.lock().unwrap_or_else(PoisonError::into_inner);
        let mut tiles = match kept.take().filter(|tiles| tiles.fits(size)) {
            Some(tiles) => tiles,
            None => TileBuffers::new(&self.gpu, size)?,
        };
        tiles.begin();
        let drawn = draw(&mut tiles).and_then(|drawn| {
            tiles.show(drawing)?;
            Ok((drawn, tiles.bytes()))
        });
        // Of a frame that was given up, too.
        *kept = Some(tiles);
        drawn
    }

    fn draw_grid(
        &self,
        drawing: &Drawing,
        view: &CellCamera,
        cells: &PreparedCells,
        classification: &CellClassification,
        draw: impl FnOnce(&GridBuffers, &GridFrame) -> Result<(u64, u64), GpuError>,
    ) -> Result<(u64, u64), GpuError> {
        let (split, source) = (self.options.split, drawing.variant.source);
        let mut kept = self.grid.lock().unwrap_or_else(PoisonError::into_inner);
        let buffers = match kept.take().filter(|buffers| buffers.fits(cells.cells, split, source)) {
            Some(buffers) => buffers,
            None => GridBuffers::new(&self.gpu, cells.cells, split, source)?,
        };
        let known_edge = classification.classification.blocks().fine_edge;
        let frame = GridFrame { view, cells: cells.cells, known_edge };
        let drawn = draw(&buffers, &frame).map(|(drawn, bytes)| (drawn, bytes + buffers.bytes()));
        *kept = Some(buffers);
        drawn
    }

    /// What is drawn into: the image itself, or a narrower one.
    fn target(&self, targets: &Targets) -> Result<wgpu::TextureView, GpuError> {
        if self.pipelines.target() == wgpu::TextureFormat::Rgba32Float {
            return Ok(targets.views()[0].clone());
        }
        let [width, height] = targets.size();
        self.gpu.checked("the image of cells", || {
            let texture = self.gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("cells"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: self.pipelines.target(),
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        })
    }

    /// Makes everything empty.
    fn clear(&self, targets: &Targets, target: &wgpu::TextureView) -> Result<(), GpuError> {
        self.gpu.checked("clearing the image", || {
            let mut encoder =
                self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            drop(targets.pass(&mut encoder, true, None));
            drop(pass(&mut encoder, target, Some(wgpu::Color::TRANSPARENT)));
            self.gpu.queue().submit([encoder.finish()]);
        })
    }
}

/// Cells are emission and absorption: an extremum along a ray is no sum over them.
fn check_mode(scene: &Scene) -> Result<(), GpuError> {
    match scene.settings().mode {
        Mode::Composite => Ok(()),
        mode => Err(GpuError::CellsMode { mode: mode.name() }),
    }
}
