//! Tetrahedra drawn by compute shaders, tile by tile, front to back: what a rasteriser would do a triangle at a time.
//!
//! 1. A stretch of tetrahedra in order becomes records (`record.wgsl`), and each tile's list of them is made by a stable
//!    counting sort (`keep.wgsl`, `bin.wgsl`).
//! 2. Each tile is composited in registers (`composite.wgsl`), and goes on where the last stretch left it; a single stretch goes
//!    straight to the image.
//!
//! There are no triangles to set up, nothing is interpolated or blended, and a tile that is opaque is done. Software adapters
//! spend nearly all of a frame on the former. They give each thread one stretch of the workgroups, and run both sides of every
//! `if`: hence the order of workgroups, and loops where one would branch.

mod pipelines;

use bytemuck::{Pod, Zeroable};

pub(super) use pipelines::TilePipelines;
#[cfg(test)]
pub(crate) use pipelines::{TILES_BIN_SHADER, TILES_COMPOSITE_SHADER, TILES_MESH_SHADER, TILES_SHOW_SHADER};

use super::drawing::Drawing;
use super::numbers::{LIST_PARTS, ROW, RUNS_OF_GROUP, TEXELS, TILE, WINDOW};
use super::pass::pass;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::Progress;
use crate::plumbing::{bind, bind_buffers};
use crate::ranges::read_words;

/// Pixels along a side of the image at most: references are kept in 14 bits.
const MOST_PIXELS: u32 = 1 << 14;

/// Tetrahedra of a stretch.
const AT_ONCE: u32 = 1 << 18;

/// Entries of lists: at first and at most.
const ENTRIES: [u64; 2] = [1 << 20, 1 << 24];

/// Entries that a thread makes on average, at most: some drivers end a shader's loops after 65,535 rounds.
const ENTRIES_A_RUN: u64 = 8192;

/// As `TileTask` in `task.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct TileTask {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) total: u32,
    pub(crate) runs: u32,
    pub(crate) run: u32,
    pub(crate) tiles_x: u32,
    pub(crate) tiles: u32,
    pub(crate) window: u32,
}

/// What stretches share, for images of one size.
#[derive(Debug)]
pub(super) struct TileBuffers {
    size: [u32; 2],
    tiles: [u32; 2],
    runs: u32,
    counts: wgpu::Buffer,
    spans: wgpu::Buffer,
    live: wgpu::Buffer,
    totals: wgpu::Buffer,
    image: wgpu::Buffer,
    /// Whether the image has something of this frame in it.
    begun: bool,
    records: wgpu::Texture,
    lists: wgpu::Texture,
}

/// What is known of a stretch once its tetrahedra are counted: entries of the longest list and of all, and lists that are not
/// empty.
struct Binned {
    longest: u32,
    entries: u32,
    live: u32,
}

/// Keeps the records of a stretch: the source of tetrahedra binds what it needs, the task, counts and records first.
pub(super) type Keep<'a> = &'a dyn Fn(&mut wgpu::ComputePass, &[wgpu::BindGroupEntry]);

impl TileBuffers {
    /// Whether images of a size can be drawn in tiles.
    pub(super) fn can_draw(size: [u32; 2]) -> bool {
        size[0].max(size[1]) <= MOST_PIXELS
    }

    pub(super) fn fits(&self, size: [u32; 2]) -> bool {
        self.size == size
    }

    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        let tiles = size.map(|n| n.div_ceil(TILE));
        let count = u64::from(tiles[0]) * u64::from(tiles[1]);
        // Enough runs for many threads, few enough for their counters to be small.
        let runs = ((1 << 19) / count).clamp(16, 128) as u32;
        gpu.checked("the tiles of cells", || {
            use wgpu::BufferUsages as Usage;
            let make = |label, size: u64, usage| {
                gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size,
                    usage: Usage::STORAGE | usage,
                    mapped_at_creation: false,
                })
            };
            Self {
                size,
                tiles,
                runs,
                counts: make("counts of tiles", 4 * count * u64::from(runs), Usage::COPY_DST),
                spans: make("spans of tiles", 8 * count, Usage::empty()),
                live: make("tiles", 4 * count, Usage::empty()),
                totals: make("totals of tiles", 32, Usage::COPY_SRC),
                begun: false,
                image: make("image in tiles", 16 * u64::from(TILE * TILE) * count, Usage::COPY_DST),
                records: texture(
                    gpu,
                    "records",
                    wgpu::TextureFormat::Rgba32Uint,
                    u64::from(AT_ONCE) * TEXELS,
                ),
                lists: texture(gpu, "lists", wgpu::TextureFormat::R32Uint, ENTRIES[0]),
            }
        })
    }

    pub(super) fn bytes(&self) -> u64 {
        let buffers = [&self.counts, &self.spans, &self.live, &self.totals, &self.image];
        let texels = |t: &wgpu::Texture| u64::from(t.width()) * u64::from(t.height());
        buffers.iter().map(|b| b.size()).sum::<u64>() + 16 * texels(&self.records) + 4 * texels(&self.lists)
    }

    /// Begins a frame.
    pub(super) fn begin(&mut self) {
        self.begun = false;
    }

    /// Makes the image empty, once a frame.
    fn clear(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        if self.begun {
            return Ok(());
        }
        self.begun = true;
        gpu.checked("clearing the tiles", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.image, 0, None);
            gpu.queue().submit([encoder.finish()]);
        })
    }

    /// Draws tetrahedra in their order from the eye on, behind those that are drawn. `alone`: no others are, before or after.
    pub(super) fn draw(
        &mut self,
        drawing: &Drawing,
        total: u32,
        alone: bool,
        keep: Keep,
        progress: &Progress,
    ) -> Result<(), GpuError> {
        let mut first = 0;
        let mut at_once = AT_ONCE;
        while first < total {
            let count = at_once.min(total - first);
            let task = self.task(first, count, total);
            let Binned { longest, entries, live } = self.bin(drawing, &task, keep)?;
            if u64::from(entries) > ENTRIES_A_RUN * u64::from(self.runs) && count > 1 {
                at_once = count / 2;
                continue;
            }
            let entries = u64::from(entries);
            // Tetrahedra that cover the image fill lists sooner than records; the lists grow, or fewer are drawn at once. One
            // always fits: an image has fewer tiles than the lists may have entries.
            if entries > self.entries() && entries <= ENTRIES[1] {
                let rows = entries.next_power_of_two();
                self.lists = drawing.gpu.checked("the lists of tiles", || {
                    texture(drawing.gpu, "lists", wgpu::TextureFormat::R32Uint, rows)
                })?;
            }
            if entries > self.entries() {
                at_once = (count / 2).max(1);
                continue;
            }
            self.list(drawing, &task)?;
            let whole = alone && count == total && longest <= WINDOW;
            if !whole {
                self.clear(drawing.gpu)?;
            }
            for window in (0..longest).step_by(WINDOW as usize) {
                self.composite(drawing, &TileTask { window, ..task }, live, whole)?;
            }
            first += count;
            progress.advance(drawing.gpu, first as f32 / total as f32)?;
        }
        Ok(())
    }

    fn entries(&self) -> u64 {
        u64::from(self.lists.width()) * u64::from(self.lists.height())
    }

    fn task(&self, first: u32, count: u32, total: u32) -> TileTask {
        let tiles = self.tiles[0] * self.tiles[1];
        let run = count.div_ceil(self.runs);
        TileTask { first, count, total, runs: self.runs, run, tiles_x: self.tiles[0], tiles, window: 0 }
    }

    /// Makes the records of a stretch and counts them.
    fn bin(&self, drawing: &Drawing, task: &TileTask, keep: Keep) -> Result<Binned, GpuError> {
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.tiles;
        gpu.checked("binning cells", || {
            let uniform = gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM);
            let records = view(&self.records);
            let group = self.bind_lists(gpu, steps, &uniform);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.counts, 0, None);
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                let resources = [
                    (0, uniform.as_entire_binding()),
                    (1, self.counts.as_entire_binding()),
                    (2, wgpu::BindingResource::TextureView(&records)),
                ];
                let entries = resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
                pass.set_bind_group(2, drawing.tables, &[]);
                keep(&mut pass, &entries);
                pass.dispatch_workgroups(self.runs.div_ceil(RUNS_OF_GROUP), 1, 1);
            }
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_bind_group(0, &group, &[]);
                pass.set_pipeline(&steps.sum_runs);
                pass.dispatch_workgroups(task.tiles.div_ceil(64), 1, 1);
                pass.set_pipeline(&steps.sum_tiles);
                pass.dispatch_workgroups(1, 1, 1);
            }
            gpu.queue().submit([encoder.finish()]);
        })?;
        let words = read_words(gpu, &self.totals, 0..20)?;
        Ok(Binned { longest: words[0], entries: words[3], live: words[4] })
    }

    /// Fills the lists.
    fn list(&self, drawing: &Drawing, task: &TileTask) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.tiles;
        gpu.checked("binning cells", || {
            let uniform = gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM);
            let group = self.bind_lists(gpu, steps, &uniform);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_bind_group(0, &group, &[]);
                pass.set_pipeline(&steps.list_runs);
                pass.dispatch_workgroups(self.runs.div_ceil(RUNS_OF_GROUP), 1, 1);
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }

    /// Draws what the lists hold, from a window on.
    fn composite(&self, drawing: &Drawing, task: &TileTask, live: u32, whole: bool) -> Result<(), GpuError> {
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.tiles;
        gpu.checked("drawing cells", || {
            let uniform = gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM);
            let (records, list) = (view(&self.records), view(&self.lists));
            let group = bind(
                gpu.device(),
                &steps.layouts.composite,
                &[
                    (0, uniform.as_entire_binding()),
                    (1, self.spans.as_entire_binding()),
                    (2, self.live.as_entire_binding()),
                    (3, self.totals.as_entire_binding()),
                    (4, wgpu::BindingResource::TextureView(&records)),
                    (5, wgpu::BindingResource::TextureView(&list)),
                    (6, wgpu::BindingResource::TextureView(drawing.piece_texels)),
                    (7, self.image.as_entire_binding()),
                    (8, wgpu::BindingResource::TextureView(drawing.colors)),
                ],
            );
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_bind_group(0, drawing.scene, &[]);
                pass.set_bind_group(1, &group, &[]);
                pass.set_bind_group(2, drawing.tables, &[]);
                pass.set_pipeline(steps.composite(drawing.variant, whole));
                pass.dispatch_workgroups(live.div_ceil(8 << LIST_PARTS), 1 << LIST_PARTS, 1);
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }

    /// Copies what is drawn to the frame's colours, unless it is there.
    pub(super) fn show(&self, drawing: &Drawing) -> Result<(), GpuError> {
        if !self.begun {
            return Ok(());
        }
        let gpu = drawing.gpu;
        let steps = &drawing.pipelines.tiles;
        gpu.checked("the image of tiles", || {
            let task = self.task(0, 0, 0);
            let uniform = gpu.buffer("task", bytemuck::bytes_of(&task), wgpu::BufferUsages::UNIFORM);
            let group = bind_buffers(gpu.device(), &steps.layouts.show, &[&uniform, &self.image]);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = pass(&mut encoder, drawing.colors, Some(wgpu::Color::TRANSPARENT));
                pass.set_pipeline(&steps.show);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..3, 0..1);
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }

    fn bind_lists(&self, gpu: &Gpu, steps: &TilePipelines, task: &wgpu::Buffer) -> wgpu::BindGroup {
        let (records, lists) = (view(&self.records), view(&self.lists));
        bind(
            gpu.device(),
            &steps.layouts.lists,
            &[
                (0, task.as_entire_binding()),
                (1, self.counts.as_entire_binding()),
                (2, self.spans.as_entire_binding()),
                (3, self.live.as_entire_binding()),
                (4, self.totals.as_entire_binding()),
                (5, wgpu::BindingResource::TextureView(&records)),
                (6, wgpu::BindingResource::TextureView(&lists)),
            ],
        )
    }
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// So many texels in rows of [`ROW`].
fn texture(gpu: &Gpu, label: &str, format: wgpu::TextureFormat, texels: u64) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width: ROW,
            height: texels.div_ceil(u64::from(ROW)).max(1) as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}
