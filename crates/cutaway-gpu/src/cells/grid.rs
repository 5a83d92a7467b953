//! A grid's tetrahedra: which are drawn and in which order is found on the device, chunk by chunk of its blocks.

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::UVec3;

use super::basis::basis;
use super::drawing::{Drawing, indices};
use super::numbers::{EDGE, OFFSETS};
use super::options::Split;
use super::pass::pass;
use super::pipelines::{GridPipelines, Pipelines};
use super::tiles::TileBuffers;
use super::variant::Source;
use super::view::CellCamera;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::Progress;
use crate::plumbing::bind_buffers;

/// Blocks of a chunk: of a software adapter, so that drawing one stays near 100 ms, and of a GPU, for memory.
const CHUNK: [u32; 2] = [64, 256];

/// Indices of a tetrahedron: four triangles.
const INDICES: u32 = 12;

/// As `SelectTask` in `select.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SelectTask {
    pub(crate) blocks: [u32; 3],
    pub(crate) first: u32,
    pub(crate) block_pivot: [u32; 3],
    pub(crate) count: u32,
    pub(crate) cell_pivot: [i32; 3],
    pub(crate) indices: u32,
    pub(crate) known_edge: u32,
    pub(crate) reserved_x: u32,
    pub(crate) reserved_y: u32,
    pub(crate) reserved_z: u32,
}

/// Buffers that chunks share, of a grid of one size.
#[derive(Debug)]
pub(super) struct GridBuffers {
    blocks: UVec3,
    split: Split,
    projects: bool,
    ordered: wgpu::Buffer,
    kept: wgpu::Buffer,
    work: wgpu::Buffer,
    list: wgpu::Buffer,
    records: wgpu::Buffer,
    indices: wgpu::Buffer,
    nothing: wgpu::Buffer,
    chunk: u32,
}

/// Blocks along each axis of a grid of so many cells.
fn blocks_of(cells: UVec3) -> UVec3 {
    UVec3::new(cells.x.div_ceil(EDGE), cells.y.div_ceil(EDGE), cells.z.div_ceil(EDGE))
}

impl GridBuffers {
    pub(super) fn fits(&self, cells: UVec3, split: Split, source: Source) -> bool {
        let projects = source == Source::Grid;
        self.blocks == blocks_of(cells) && self.split == split && (self.projects || !projects)
    }

    pub(super) fn new(gpu: &Gpu, cells: UVec3, split: Split, source: Source) -> Result<Self, GpuError> {
        let blocks = blocks_of(cells);
        // Places of blocks are kept in 10 bits an axis.
        if blocks.max_element() > 1024 {
            let reason = "the cell renderer takes up to 8192 cells along an axis; take `--engine raycast`";
            return Err(GpuError::TooLarge { dimensions: cells + 1, reason: reason.to_owned() });
        }
        let count = u64::from(blocks.x) * u64::from(blocks.y) * u64::from(blocks.z);
        let chunk = CHUNK[usize::from(!gpu.adapter().software)].min(count.max(1) as u32);
        let most = u64::from(chunk) * u64::from(EDGE.pow(3)) * u64::from(split.count());
        let projects = source == Source::Grid;
        gpu.checked("the buffers of cells", || {
            use wgpu::BufferUsages as Usage;
            let make = |label, words: u64, usage| {
                gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size: 4 * words,
                    usage: Usage::STORAGE | usage,
                    mapped_at_creation: false,
                })
            };
            let of_work = Usage::INDIRECT | Usage::COPY_SRC | Usage::COPY_DST;
            Self {
                blocks,
                split,
                projects,
                ordered: make("blocks in order", count + 1, Usage::COPY_SRC),
                kept: make("kept cells", u64::from(chunk) * 512, Usage::empty()),
                work: make("work", OFFSETS + u64::from(chunk), of_work),
                list: make("tetrahedra", most, Usage::empty()),
                records: make("records", if projects { 16 * most } else { 16 }, Usage::empty()),
                indices: indices(gpu, most),
                nothing: make("nothing", 16, Usage::empty()),
                chunk,
            }
        })
    }

    pub(super) fn bytes(&self) -> u64 {
        let all = [&self.ordered, &self.kept, &self.work, &self.list, &self.records, &self.indices];
        all.iter().map(|b| b.size()).sum()
    }

    /// Draws all tetrahedra; returns how many.
    pub(super) fn draw(
        &self,
        drawing: &Drawing,
        frame: &GridFrame,
        progress: &Progress,
    ) -> Result<u64, GpuError> {
        let gpu = drawing.gpu;
        let steps = drawing.pipelines.grid(gpu, drawing.variant)?;
        let pipeline = drawing.pipelines.drawing(gpu, drawing.variant)?;
        let basis = basis(frame.view, self.split);
        let basis = gpu.checked("the basis cell", || {
            gpu.buffer("basis", bytemuck::cast_slice(&basis), wgpu::BufferUsages::UNIFORM)
        })?;
        let (task, occupied) = self.order(drawing, &steps, frame)?;
        for first in (0..occupied).step_by(self.chunk as usize) {
            let count = self.chunk.min(occupied - first);
            let task = SelectTask { first, count, ..task };
            self.draw_chunk(drawing, &steps, &pipeline, &basis, &task)?;
            progress.advance(gpu, (first + count) as f32 / occupied as f32)?;
        }
        self.drawn(gpu)
    }

    /// Draws all tetrahedra in tiles; returns how many.
    pub(super) fn draw_tiles(
        &self,
        drawing: &Drawing,
        frame: &GridFrame,
        tiles: &mut TileBuffers,
        progress: &Progress,
    ) -> Result<u64, GpuError> {
        let gpu = drawing.gpu;
        let steps = drawing.pipelines.grid(gpu, drawing.variant)?;
        let (task, occupied) = self.order(drawing, &steps, frame)?;
        // Chunks from the eye on; the tetrahedra of each are listed from back to front.
        for chunk in (0..occupied.div_ceil(self.chunk)).rev() {
            let first = chunk * self.chunk;
            let count = self.chunk.min(occupied - first);
            let task = SelectTask { first, count, ..task };
            self.draw_chunk_in_tiles(drawing, &steps, &task, count == occupied, tiles, progress)?;
            progress.advance(gpu, 1.0 - first as f32 / occupied as f32)?;
        }
        self.drawn(gpu)
    }

    fn draw_chunk_in_tiles(
        &self,
        drawing: &Drawing,
        steps: &GridPipelines,
        task: &SelectTask,
        alone: bool,
        tiles: &mut TileBuffers,
        progress: &Progress,
    ) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let chunk = gpu.checked("selecting cells", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.select(&mut encoder, drawing, steps, task);
            gpu.queue().submit([encoder.finish()]);
            gpu.buffer("chunk", bytemuck::bytes_of(&[task.first, 0, 0, 0]), wgpu::BufferUsages::UNIFORM)
        })?;
        let total = crate::ranges::read_words(gpu, &self.work, 44..48)?[0];
        drawing.end_of_setup()?;
        let keep = |pass: &mut wgpu::ComputePass, entries: &[wgpu::BindGroupEntry]| {
            let own = [(3, &chunk), (4, &self.ordered), (5, &self.list)];
            let own = own.map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            let group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &drawing.pipelines.tiles.layouts.keep_grid,
                entries: &[entries, &own].concat(),
            });
            pass.set_pipeline(&steps.keep);
            pass.set_bind_group(0, drawing.scene, &[]);
            pass.set_bind_group(1, &group, &[]);
        };
        tiles.draw(drawing, total, alone, &keep, &progress.silent())?;
        drawing.end_of_drawing()
    }

    /// Tetrahedra of all chunks.
    fn drawn(&self, gpu: &Gpu) -> Result<u64, GpuError> {
        Ok(u64::from(crate::ranges::read_words(gpu, &self.work, 64..68)?[0]))
    }

    /// Puts the blocks in order; returns what chunks have in common, and how many blocks are drawn.
    fn order(
        &self,
        drawing: &Drawing,
        steps: &GridPipelines,
        frame: &GridFrame,
    ) -> Result<(SelectTask, u32), GpuError> {
        let gpu = drawing.gpu;
        let task = frame.task(self.blocks);
        gpu.checked("ordering cells", || {
            let uniform = gpu.buffer("task", bytemuck::bytes_of(&task), wgpu::BufferUsages::UNIFORM);
            let group = self.bind_select(gpu, drawing.pipelines, &uniform);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.work, 0, None);
            compute(&mut encoder, drawing, &group, |pass| {
                pass.set_pipeline(&steps.order);
                pass.dispatch_workgroups(1, 1, 1);
            });
            gpu.queue().submit([encoder.finish()]);
        })?;
        // The one number that the host waits for: how many chunks there are.
        let occupied = crate::ranges::read_words(gpu, &self.ordered, 0..4)?[0];
        Ok((task, occupied))
    }

    /// Lists the tetrahedra of a chunk.
    fn select(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        drawing: &Drawing,
        steps: &GridPipelines,
        task: &SelectTask,
    ) {
        let gpu = drawing.gpu;
        let uniform = gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM);
        let select = self.bind_select(gpu, drawing.pipelines, &uniform);
        compute(encoder, drawing, &select, |pass| {
            for (step, groups) in [(&steps.count, task.count), (&steps.sum, 1), (&steps.list, task.count)] {
                pass.set_pipeline(step);
                pass.dispatch_workgroups(groups, 1, 1);
            }
        });
    }

    fn draw_chunk(
        &self,
        drawing: &Drawing,
        steps: &GridPipelines,
        pipeline: &wgpu::RenderPipeline,
        basis: &wgpu::Buffer,
        task: &SelectTask,
    ) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let layouts = &drawing.pipelines.layouts;
        let chunk = gpu.checked("selecting cells", || {
            gpu.buffer("chunk", bytemuck::bytes_of(&[task.first, 0, 0, 0]), wgpu::BufferUsages::UNIFORM)
        })?;
        gpu.checked("selecting cells", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.select(&mut encoder, drawing, steps, task);
            if drawing.variant.source == Source::Grid {
                let buffers = [&chunk, &self.ordered, &self.list, &self.work, &self.records];
                let project = bind_buffers(gpu.device(), &layouts.project_grid, &buffers);
                compute(&mut encoder, drawing, &project, |pass| {
                    pass.set_pipeline(&steps.project);
                    pass.dispatch_workgroups_indirect(&self.work, 32);
                });
            }
            gpu.queue().submit([encoder.finish()]);
        })?;
        drawing.end_of_setup()?;
        gpu.checked("drawing cells", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let buffers =
                [&chunk, basis, &self.ordered, &self.list, &self.records, &self.nothing, &self.nothing];
            let group = bind_buffers(gpu.device(), &layouts.draw, &buffers);
            {
                let mut pass = pass(&mut encoder, drawing.target, None);
                drawing.set(&mut pass, pipeline, &group);
                pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed_indirect(&self.work, 0);
            }
            gpu.queue().submit([encoder.finish()]);
        })?;
        drawing.end_of_drawing()
    }

    fn bind_select(&self, gpu: &Gpu, pipelines: &Pipelines, task: &wgpu::Buffer) -> wgpu::BindGroup {
        let buffers = [task, &self.ordered, &self.kept, &self.work, &self.list];
        bind_buffers(gpu.device(), &pipelines.layouts.select, &buffers)
    }
}

fn compute(
    encoder: &mut wgpu::CommandEncoder,
    drawing: &Drawing,
    group: &wgpu::BindGroup,
    work: impl FnOnce(&mut wgpu::ComputePass),
) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_bind_group(0, drawing.scene, &[]);
    pass.set_bind_group(1, group, &[]);
    pass.set_bind_group(2, drawing.tables, &[]);
    work(&mut pass);
}

/// A grid as a camera sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridFrame<'a> {
    pub(super) view: &'a CellCamera,
    pub(super) cells: UVec3,
    /// Cells along an edge of the blocks that occupancy is known of.
    pub(super) known_edge: u32,
}

impl GridFrame<'_> {
    fn task(&self, blocks: UVec3) -> SelectTask {
        let cells = self.view.pivot(self.cells);
        let block_pivot = if self.view.is_parallel() {
            // All or none of an axis.
            self.view.pivot(blocks)
        } else {
            (cells / EDGE).min(blocks)
        };
        // Beyond the grid's last block's end too, so that all of its cells ascend.
        let cell_pivot = UVec3::select(cells.cmpge(self.cells), blocks * EDGE, cells);
        SelectTask {
            blocks: blocks.to_array(),
            block_pivot: block_pivot.to_array(),
            cell_pivot: cell_pivot.as_ivec3().to_array(),
            indices: INDICES,
            known_edge: self.known_edge,
            ..SelectTask::zeroed()
        }
    }
}
