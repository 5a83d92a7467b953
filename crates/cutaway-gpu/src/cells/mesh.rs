//! A mesh of tetrahedra on the device: projected one by one, then sorted by the depth of their centroids.

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::{DAffine3, DMat3, DVec3};
use cutaway_core::tetrahedra::TetrahedralMesh;

use super::drawing::{Drawing, indices};
use super::pass::pass;
use super::tables::{BinSpan, Tables};
use super::tiles::TileBuffers;
use super::view::CellCamera;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::Progress;
use crate::plumbing::{bind, bind_buffers};

/// Threads that sort: few of a software adapter, for each has counters of its own; but some of those end a shader's loops
/// after 65,535 rounds, and each thread goes through its keys in one.
fn sort_runs(gpu: &Gpu, cells: u64) -> u32 {
    if gpu.adapter().software && cells < 1 << 22 { 128 } else { 1024 }
}

/// Passes of 8 bits each.
const DIGITS: u32 = 3;

/// Tetrahedra of a draw: of a software adapter, so that one stays near 100 ms, and of a GPU.
const DRAWN_AT_ONCE: [u32; 2] = [1 << 17, 1 << 20];

/// Tetrahedra of a dispatch; a dispatch has at most 65,535 workgroups.
const PROJECTED_AT_ONCE: u32 = 1 << 20;

/// Bytes of a record, as in `record.wgsl`.
const RECORD: u64 = 64;

/// As `MeshTask` in `project_mesh.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct MeshTask {
    pub(crate) first: u32,
    pub(crate) end: u32,
    pub(crate) depth_least: f32,
    pub(crate) depth_scale: f32,
}

/// As `SortTask` in `sort.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SortTask {
    pub(crate) count: u32,
    pub(crate) run: u32,
    pub(crate) shift: u32,
    pub(crate) runs: u32,
}

/// A mesh on the device, with what a frame makes of it.
#[derive(Debug)]
pub(super) struct GpuTetrahedra {
    points: u32,
    cells: u32,
    bounds: [DVec3; 2],
    /// Gradient and value in bins; places from the middle of the box; corners.
    attributes: wgpu::Buffer,
    places: wgpu::Buffer,
    corners: wgpu::Buffer,
    projected: wgpu::Buffer,
    records: wgpu::Buffer,
    keys: [wgpu::Buffer; 2],
    counts: wgpu::Buffer,
    totals: wgpu::Buffer,
    order: wgpu::Buffer,
    draws: wgpu::Buffer,
    indices: wgpu::Buffer,
    nothing: wgpu::Buffer,
    at_once: u32,
    runs: u32,
    /// Which values are in each tetrahedron.
    spans: Vec<BinSpan>,
}

/// The tetrahedra of a mesh that a transfer function shows anything of.
#[derive(Debug)]
pub(super) struct VisibleCells {
    count: u32,
    cells: wgpu::Buffer,
}

impl VisibleCells {
    pub(super) fn bytes(&self) -> u64 {
        self.cells.size()
    }
}

impl GpuTetrahedra {
    /// Uploads a mesh. `bin_of` is where a value stands in the tables of integrals.
    pub(super) fn new(
        gpu: &Gpu,
        mesh: &TetrahedralMesh,
        bin_of: impl Fn(f32) -> f32,
    ) -> Result<Self, GpuError> {
        let (points, cells) = (mesh.points().len() as u64, mesh.cells().len() as u64);
        let most = gpu.capabilities().max_buffer;
        let needed = (cells * RECORD).max(points * 16);
        if needed > most {
            return Err(GpuError::MeshTooLarge { cells, most: most / RECORD });
        }
        let attributes = attributes(mesh, &bin_of);
        let span_of = |corners: &[u32; 4]| {
            let values = corners.map(|corner| bin_of(mesh.values()[corner as usize]));
            let least = values.into_iter().fold(f32::INFINITY, f32::min);
            BinSpan::of(least, values.into_iter().fold(f32::NEG_INFINITY, f32::max))
        };
        let spans = mesh.cells().iter().map(span_of).collect();
        let (middle, unit) = (middle(mesh.bounds()), unit(mesh.bounds()));
        let values = mesh.values().iter().map(|v| bin_of(*v));
        let places: Vec<[f32; 4]> = mesh
            .points()
            .iter()
            .zip(values)
            .map(|(p, v)| ((*p - middle) / unit).as_vec3().extend(v).to_array())
            .collect();
        let runs = sort_runs(gpu, cells);
        let at_once = DRAWN_AT_ONCE[usize::from(!gpu.adapter().software)].min(cells as u32);
        gpu.checked("the mesh of cells", || {
            use wgpu::BufferUsages as Usage;
            let make = |label, size: u64, usage| {
                gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size,
                    usage: Usage::STORAGE | usage,
                    mapped_at_creation: false,
                })
            };
            let draws = cells.div_ceil(u64::from(at_once));
            let upload = |label, bytes: &[u8]| gpu.buffer(label, bytes, Usage::STORAGE);
            Self {
                points: points as u32,
                cells: cells as u32,
                bounds: mesh.bounds(),
                attributes: upload("attributes", bytemuck::cast_slice(&attributes)),
                places: upload("places", bytemuck::cast_slice(&places)),
                corners: upload("corners", bytemuck::cast_slice(mesh.cells())),
                projected: make("projected points", 16 * points, Usage::empty()),
                records: make("records", RECORD * cells, Usage::empty()),
                keys: [0, 1].map(|_| make("keys", 8 * cells, Usage::empty())),
                counts: make("digits of runs", 4 * 256 * u64::from(runs), Usage::empty()),
                totals: make("digits", 4 * 256, Usage::empty()),
                order: make("order", 4 * cells, Usage::empty()),
                draws: make("draws", 16 + 20 * draws, Usage::INDIRECT | Usage::COPY_SRC | Usage::COPY_DST),
                indices: indices(gpu, u64::from(at_once)),
                nothing: make("nothing", 12 * 64, Usage::UNIFORM),
                at_once,
                runs,
                spans,
            }
        })
    }

    /// The tetrahedra that a transfer function shows anything of.
    pub(super) fn visible(&self, gpu: &Gpu, tables: &Tables) -> Result<VisibleCells, GpuError> {
        let mut visible: Vec<u32> = (0u32..)
            .zip(&self.spans)
            .filter(|(_, span)| tables.shows(**span))
            .map(|(cell, _)| cell)
            .collect();
        let count = visible.len() as u32;
        // A buffer of nothing cannot be bound.
        visible.resize(visible.len().max(1), 0);
        let bytes = bytemuck::cast_slice(&visible);
        let cells =
            gpu.checked("visible cells", || gpu.buffer("visible", bytes, wgpu::BufferUsages::STORAGE))?;
        Ok(VisibleCells { count, cells })
    }

    /// Where the space of its points is.
    pub(super) fn world_from_cells(&self) -> DAffine3 {
        let scale = DVec3::splat(unit(self.bounds));
        DAffine3 { matrix3: DMat3::from_diagonal(scale), translation: middle(self.bounds) }
    }

    /// The box around it, in that space.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        self.bounds.map(|corner| (corner - middle(self.bounds)) / unit(self.bounds))
    }

    pub(super) fn cells(&self) -> u64 {
        u64::from(self.cells)
    }

    pub(super) fn bytes(&self) -> u64 {
        let [a, b] = &self.keys;
        let all = [&self.attributes, &self.places, &self.corners, &self.projected, &self.records, a, b];
        let others = [&self.counts, &self.totals, &self.order, &self.draws, &self.indices];
        all.iter().chain(&others).map(|b| b.size()).sum()
    }

    /// Draws all tetrahedra; returns how many.
    pub(super) fn draw(
        &self,
        drawing: &Drawing,
        view: &CellCamera,
        progress: &Progress,
    ) -> Result<u64, GpuError> {
        let gpu = drawing.gpu;
        self.project(drawing, view)?;
        self.sort(drawing, self.cells)?;
        drawing.end_of_setup()?;
        let pipeline = drawing.pipelines.drawing(gpu, drawing.variant)?;
        let draws = self.cells.div_ceil(self.at_once);
        for draw in 0..draws {
            gpu.checked("drawing cells", || {
                let buffers = [
                    &self.nothing,
                    &self.nothing,
                    &self.draws,
                    &self.order,
                    &self.records,
                    &self.projected,
                    &self.attributes,
                ];
                let group = bind_buffers(gpu.device(), &drawing.pipelines.layouts.draw, &buffers);
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = pass(&mut encoder, drawing.target, None);
                    drawing.set(&mut pass, &pipeline, &group);
                    pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed_indirect(&self.draws, 16 + 20 * u64::from(draw));
                }
                gpu.queue().submit([encoder.finish()]);
            })?;
            progress.advance(gpu, (draw + 1) as f32 / draws as f32)?;
        }
        let words = crate::ranges::read_words(gpu, &self.draws, 0..4)?;
        Ok(u64::from(words[0]))
    }

    /// Draws all tetrahedra in tiles; returns how many.
    pub(super) fn draw_tiles(
        &self,
        drawing: &Drawing,
        view: &CellCamera,
        visible: &VisibleCells,
        tiles: &mut TileBuffers,
        progress: &Progress,
    ) -> Result<u64, GpuError> {
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.tiles;
        let [least, greatest] = self.depths(view);
        let depth_scale = 1.0 / (greatest - least).max(f64::MIN_POSITIVE);
        for first in (0..visible.count).step_by(PROJECTED_AT_ONCE as usize) {
            let end = visible.count.min(first + PROJECTED_AT_ONCE);
            let task = MeshTask { first, end, depth_least: least as f32, depth_scale: depth_scale as f32 };
            gpu.checked("ordering cells", || {
                let task = gpu.buffer("task", bytemuck::bytes_of(&task), wgpu::BufferUsages::UNIFORM);
                let buffers = [&self.corners, &self.places, &self.keys[0], &task, &visible.cells];
                let bindings = [3, 4, 6, 7, 8].into_iter().zip(buffers.map(|b| b.as_entire_binding()));
                let resources: Vec<_> = bindings.collect();
                let group = bind(gpu.device(), &steps.layouts.key_mesh, &resources);
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                    pass.set_pipeline(&steps.key_mesh);
                    pass.set_bind_group(1, &group, &[]);
                    pass.set_bind_group(2, drawing.tables, &[]);
                    pass.dispatch_workgroups((end - first).div_ceil(64), 1, 1);
                }
                gpu.queue().submit([encoder.finish()]);
            })?;
        }
        self.sort(drawing, visible.count)?;
        let total = crate::ranges::read_words(gpu, &self.draws, 0..4)?[0];
        drawing.end_of_setup()?;
        let keep = |pass: &mut wgpu::ComputePass, entries: &[wgpu::BindGroupEntry]| {
            let own = [(3, &self.corners), (4, &self.places), (5, &self.order)];
            let own = own.map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            let group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &steps.layouts.keep_mesh,
                entries: &[entries, &own].concat(),
            });
            pass.set_pipeline(&steps.keep_mesh);
            pass.set_bind_group(1, &group, &[]);
        };
        tiles.draw(drawing, total, true, &keep, progress)?;
        Ok(u64::from(total))
    }

    fn project(&self, drawing: &Drawing, view: &CellCamera) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let [least, greatest] = self.depths(view);
        let depth_scale = 1.0 / (greatest - least).max(f64::MIN_POSITIVE);
        let steps = &drawing.pipelines.mesh;
        for (step, count) in [(&steps.points, self.points), (&steps.tetrahedra, self.cells)] {
            for first in (0..count).step_by(PROJECTED_AT_ONCE as usize) {
                let end = count.min(first + PROJECTED_AT_ONCE);
                let task =
                    MeshTask { first, end, depth_least: least as f32, depth_scale: depth_scale as f32 };
                gpu.checked("projecting cells", || {
                    let task = gpu.buffer("task", bytemuck::bytes_of(&task), wgpu::BufferUsages::UNIFORM);
                    let buffers = [
                        &task,
                        &self.attributes,
                        &self.places,
                        &self.projected,
                        &self.corners,
                        &self.records,
                        &self.keys[0],
                    ];
                    let group = bind_buffers(gpu.device(), &drawing.pipelines.layouts.project_mesh, &buffers);
                    let mut encoder =
                        gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    {
                        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                        pass.set_pipeline(step);
                        pass.set_bind_group(1, &group, &[]);
                        pass.set_bind_group(2, drawing.tables, &[]);
                        pass.dispatch_workgroups((end - first).div_ceil(64), 1, 1);
                    }
                    gpu.queue().submit([encoder.finish()]);
                })?;
            }
        }
        Ok(())
    }

    /// The depths between which all points are.
    fn depths(&self, view: &CellCamera) -> [f64; 2] {
        let half = 0.5 * (self.bounds[1] - self.bounds[0]) / unit(self.bounds);
        let row = view.rows[2];
        let reach = row.truncate().abs().dot(half);
        [row.w - reach, row.w + reach]
    }

    /// Sorts the first `count` keys.
    fn sort(&self, drawing: &Drawing, count: u32) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.mesh.sort;
        let runs = self.runs;
        gpu.checked("sorting cells", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.draws, 0, None);
            let mut run = |task: SortTask, from: usize, work: &[(usize, u32)]| {
                let task = gpu.buffer("task", bytemuck::bytes_of(&task), wgpu::BufferUsages::UNIFORM);
                let (from, to) = (&self.keys[from], &self.keys[1 - from]);
                let buffers = [&task, from, to, &self.counts, &self.totals, &self.order, &self.draws];
                let group = bind_buffers(gpu.device(), &drawing.pipelines.layouts.sort, &buffers);
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_bind_group(0, &group, &[]);
                for &(step, threads) in work {
                    pass.set_pipeline(&steps[step]);
                    pass.dispatch_workgroups(threads.div_ceil(64), 1, 1);
                }
            };
            let sorting = SortTask { count, run: count.div_ceil(runs), shift: 0, runs };
            for digit in 0..DIGITS {
                let task = SortTask { shift: 8 * digit, ..sorting };
                run(task, digit as usize % 2, &[(0, runs), (1, 256), (2, runs)]);
            }
            let from = DIGITS as usize % 2;
            run(sorting, from, &[(3, runs)]);
            let draws = self.cells.div_ceil(self.at_once);
            run(SortTask { run: self.at_once, shift: draws, ..sorting }, from, &[(4, draws)]);
            gpu.queue().submit([encoder.finish()]);
        })
    }
}

fn middle([lo, hi]: [DVec3; 2]) -> DVec3 {
    0.5 * (lo + hi)
}

/// World units of one unit of its points' space: 1 for sizes that 32-bit floats compute well with, else a power of two.
fn unit([lo, hi]: [DVec3; 2]) -> f64 {
    let exponent = (hi - lo).max_element().log2().floor();
    if exponent.abs() > 20.0 { exponent.exp2() } else { 1.0 }
}

/// Gradients in the unit that those of grids have: the range of stored numbers per largest spacing (of the lattice).
fn attributes(mesh: &TetrahedralMesh, bin_of: impl Fn(f32) -> f32) -> Vec<[f32; 4]> {
    let lattice = mesh.lattice();
    let [lo, hi] = lattice.stored_range().map(f64::from);
    let unit = lattice.spacing().max_element() / if hi > lo { hi - lo } else { 1.0 };
    let gradients = mesh.point_gradients();
    mesh.values()
        .iter()
        .zip(gradients)
        .map(|(v, g)| (g * unit).as_vec3().extend(bin_of(*v)).to_array())
        .collect()
}
