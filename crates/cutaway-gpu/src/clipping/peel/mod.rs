//! Front/back-face culling and depth peeling: the events of meshes as layers (Termeer 3.2.3 and 3.2.4, after Everitt 2001).
//!
//! Of each mesh its front faces and its back faces are peeled apart, each layer by layer: one pass keeps, of every pixel, the
//! nearest fragment behind what the pass before it kept. With a limit of one segment that is Termeer's front/back-face
//! culling, two passes; `backmost` makes the last of the layers that segments end at the farthest of all.
//!
//! - Where in the volume a ray begins and ends to be inside a mesh is summed up by blending, so only crossings within the
//!   volume are layers.
//! - N segments of one mesh alone need N layers that rays enter through and N that they leave through. Where a mesh overlaps
//!   itself, the N-th of the latter may end another segment than the N-th of the former began (Termeer, figure 3.5): without
//!   a limit it is exact. Of several objects, which of their layers the first N segments need depends on all of them: all
//!   layers are peeled, and the sweep limits. Each object costs passes and layers of its own; for many of them, lists are
//!   the right tool.
//! - Coincident triangles of one mesh are peeled one by one, in their order in the mesh.
//! - Layers are counted. Without a limit, more are peeled until the last of each kind covers fewer pixels than a tolerance
//!   ([`PeelSettings`]); the next frame begins with as many as this one needed, so that what moves slowly is peeled once.
//! - 16 bits keep a crossing as a place between the ends of its ray in the volume: rounded to the nearest it is off by at
//!   most 1/8192 of that stretch, and by 1/4096 where an adapter rounds towards zero. What order crossings are in is decided
//!   before they are rounded.

mod pipelines;
mod plan;
mod read;
mod textures;

use cutaway_core::clip::{BufferDepth, Crossing, SegmentLimit};

use super::lists::FrameInputs;
use super::sweep::{Sweep, SweepInputs};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{bind, bind_buffers, bind_in_order};
use crate::shaders::{Shader, shader};
#[cfg(test)]
pub(crate) use pipelines::{PEEL_COUNT_SHADER, PEEL_SHADER};
use pipelines::{PassKind, Pipelines, sweep_bindings};
#[cfg(test)]
pub(crate) use plan::PeeledMesh;
use plan::{LayerCounts, LayerRun, Plan, PlanSettings};
pub use read::ClipLayer;
use textures::{Pass, Textures};

/// The linked shader that sweeps over layers.
pub(crate) const SWEEP_PEEL_SHADER: Shader = shader!(clipping::sweep_peel);

/// How far peeling goes without a limit on segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeelSettings {
    /// The share of an image's pixels that may go without what lies behind the last layer, 0..=1. What is not a number is 0.
    pub tolerance: f64,
}

impl Default for PeelSettings {
    /// One pixel in ten thousand.
    fn default() -> Self {
        Self { tolerance: 1e-4 }
    }
}

/// How a frame is peeled.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeelFrame {
    pub(super) size: [u32; 2],
    pub(super) depth: BufferDepth,
    pub(super) settings: PeelSettings,
    pub(super) limit: SegmentLimit,
}

/// Triangles of one submission on a software adapter and on a GPU: far less than 100 ms.
const TRIANGLES_AT_ONCE: [u32; 2] = [1 << 18, 1 << 22];

/// Peels meshes and sweeps over their layers.
#[derive(Debug)]
pub(super) struct Peeler {
    pipelines: Pipelines,
    sweep: Sweep,
    textures: Option<Textures>,
    /// What the last frame needed.
    needed: Vec<LayerCounts>,
    /// The layers of the last frame, and the leaves of its meshes.
    peeled: Option<Plan>,
    leaves: Vec<u32>,
}

/// What a mesh's passes are bound to.
struct MeshGroups {
    /// Frame, leaf, mesh.
    shared: [wgpu::BindGroup; 3],
    leaf: u32,
    triangles: u32,
    mirrored: bool,
}

impl Peeler {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let pipelines = Pipelines::new(gpu)?;
        let sweep = Sweep::new(gpu, SWEEP_PEEL_SHADER, &sweep_bindings())?;
        Ok(Self { pipelines, sweep, textures: None, needed: Vec::new(), peeled: None, leaves: Vec::new() })
    }

    /// Peels all meshes of a clip, of which there must be one; how many layers that took.
    pub(super) fn peel(
        &mut self,
        gpu: &Gpu,
        inputs: &FrameInputs,
        frame: &PeelFrame,
    ) -> Result<u32, GpuError> {
        let clip = inputs.clip;
        let pixels = f64::from(frame.size[0]) * f64::from(frame.size[1]);
        let settings = PlanSettings {
            limit: frame.limit,
            alone: clip.leaf_count == 1,
            keeps_outside: clip.keeps_outside,
            tolerance: (frame.settings.tolerance.clamp(0.0, 1.0) * pixels) as u32,
        };
        let meshes = self.bind_meshes(gpu, inputs)?;
        let mut plan = Plan::new(settings, meshes.len(), &self.needed);
        loop {
            let layers = plan.layers()?;
            self.make_textures(gpu, frame, layers, meshes.len() as u32)?;
            self.draw(gpu, &meshes, &plan, frame.depth)?;
            if plan.is_complete() {
                break;
            }
            let covered = self.count(gpu, layers)?;
            let needed = plan.needed(&covered);
            if !plan.grow(&covered) {
                self.needed = needed;
                break;
            }
        }
        let layers = plan.layers()?;
        self.peeled = Some(plan);
        self.leaves = clip.meshes.iter().map(|(leaf, _)| *leaf).collect();
        Ok(layers)
    }

    /// Submits the sweep over what was peeled last.
    pub(super) fn sweep(&self, gpu: &Gpu, inputs: &FrameInputs) -> Result<(), GpuError> {
        let (Some(textures), Some(plan)) = (&self.textures, &self.peeled) else { return Ok(()) };
        let meshes = plan.meshes(&self.leaves, textures.depth());
        let source = gpu.checked("layers of clip surfaces", || {
            let meshes =
                gpu.buffer("peeled meshes", bytemuck::cast_slice(&meshes), wgpu::BufferUsages::STORAGE);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&inputs.segments.counters, 0, None);
            gpu.queue().submit([encoder.finish()]);
            let views = [&textures.all_layers, &textures.all_ends].map(wgpu::BindingResource::TextureView);
            let [layers, ends] = views;
            let resources = [layers, ends, meshes.as_entire_binding()];
            bind_in_order(gpu.device(), self.sweep.source_layout(), &resources)
        })?;
        let FrameInputs { frame, clip, limit, radius, segments } = *inputs;
        self.sweep.submit(gpu, &SweepInputs { frame, clip, limit, radius, segments, source: &source })
    }

    /// What the layers take of the device's memory.
    pub(super) fn bytes(&self) -> u64 {
        self.textures.as_ref().map_or(0, Textures::bytes)
    }

    fn make_textures(
        &mut self,
        gpu: &Gpu,
        frame: &PeelFrame,
        layers: u32,
        meshes: u32,
    ) -> Result<(), GpuError> {
        let (size, depth) = (frame.size, frame.depth);
        if !self.textures.as_ref().is_some_and(|t| t.are_for(size, depth, layers, meshes)) {
            // The old ones go first: both together may be too much.
            self.textures = None;
            self.textures = Some(Textures::new(gpu, size, depth, layers, meshes)?);
        }
        Ok(())
    }

    fn bind_meshes(&self, gpu: &Gpu, inputs: &FrameInputs) -> Result<Vec<MeshGroups>, GpuError> {
        let [frame, leaves, mesh, _] = self.pipelines.layouts();
        gpu.checked("meshes to peel", || {
            let device = gpu.device();
            let leaves = bind(device, leaves, &[(1, inputs.clip.leaves.as_entire_binding())]);
            let frame = bind_buffers(device, frame, &[inputs.frame]);
            let group = |(leaf, of): &(u32, std::sync::Arc<super::mesh::GpuMesh>)| MeshGroups {
                shared: [frame.clone(), leaves.clone(), bind_buffers(device, mesh, &of.buffers().each_ref())],
                leaf: *leaf,
                triangles: of.triangles(),
                mirrored: inputs.clip.mirrored.get(*leaf as usize).copied().unwrap_or(false),
            };
            inputs.clip.meshes.iter().map(group).collect()
        })
    }

    /// Draws every layer of a plan, and the ends of every mesh.
    fn draw(
        &self,
        gpu: &Gpu,
        meshes: &[MeshGroups],
        plan: &Plan,
        depth: BufferDepth,
    ) -> Result<(), GpuError> {
        let Some(textures) = &self.textures else { return Ok(()) };
        let passes = gpu.checked("passes of depth peeling", || {
            [0, 1].map(|i: usize| self.bind_pass(gpu, &textures.passes[i]))
        })?;
        let ends = self.pipelines.get(gpu, PassKind::Ends)?;
        for (mesh, view) in meshes.iter().zip(&textures.each_ends) {
            let target = Target { colors: &[view], depth: None };
            submit(gpu, mesh, &ends, None, &target)?;
        }
        for run in plan.runs() {
            self.draw_run(gpu, &meshes[run.mesh], &run, textures, &passes, depth)?;
        }
        Ok(())
    }

    /// Draws the layers of one kind of a mesh, each behind the one before; the pass before the first has kept nothing.
    fn draw_run(
        &self,
        gpu: &Gpu,
        mesh: &MeshGroups,
        run: &LayerRun,
        textures: &Textures,
        passes: &[wgpu::BindGroup; 2],
        depth: BufferDepth,
    ) -> Result<(), GpuError> {
        let front = (run.crossing == Crossing::Entering) != mesh.mirrored;
        clear(gpu, &textures.passes[1])?;
        for k in 0..run.count {
            let farthest = run.backmost && k + 1 == run.count;
            let pipeline = self.pipelines.get(gpu, PassKind::Layer { front, farthest, depth })?;
            let (this, before) = (k as usize % 2, (k as usize + 1) % 2);
            let Pass { depth, triangle } = &textures.passes[this];
            let layer = &textures.each_layer[(run.first + k) as usize];
            let clear_depth = if farthest { 0.0 } else { 1.0 };
            let target = Target { colors: &[layer, triangle], depth: Some((depth, clear_depth)) };
            submit(gpu, mesh, &pipeline, Some(&passes[before]), &target)?;
        }
        Ok(())
    }

    fn bind_pass(&self, gpu: &Gpu, pass: &Pass) -> wgpu::BindGroup {
        let views = [&pass.depth, &pass.triangle].map(wgpu::BindingResource::TextureView);
        bind_in_order(gpu.device(), &self.pipelines.layouts()[3], &views)
    }

    /// How many pixels each layer covers.
    fn count(&self, gpu: &Gpu, layers: u32) -> Result<Vec<u32>, GpuError> {
        let Some(textures) = &self.textures else { return Ok(Vec::new()) };
        let [width, height] = textures.size();
        // Bindings begin at multiples of 256 bytes.
        let bytes = 256 * u64::from(layers);
        let read = gpu.checked("counting layers", || {
            let buffer = |usage| {
                let label = Some("pixels of layers");
                let descriptor =
                    wgpu::BufferDescriptor { label, size: bytes, usage, mapped_at_creation: false };
                gpu.device().create_buffer(&descriptor)
            };
            let counts = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
            let read = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(&self.pipelines.count);
                for (i, view) in (0u64..).zip(&textures.each_layer[..layers as usize]) {
                    pass.set_bind_group(0, &self.bind_count(gpu, view, &counts, 256 * i), &[]);
                    pass.dispatch_workgroups(width.div_ceil(16), height.div_ceil(16), 1);
                }
            }
            encoder.copy_buffer_to_buffer(&counts, 0, &read, 0, bytes);
            gpu.queue().submit([encoder.finish()]);
            read
        })?;
        read.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.finish()?;
        let mapped = read
            .get_mapped_range(..)
            .map_err(|e| GpuError::Refused { what: "counting layers".to_owned(), reason: e.to_string() })?;
        Ok(mapped.chunks(256).map(|slot| bytemuck::pod_read_unaligned(&slot[..4])).collect())
    }

    fn bind_count(
        &self,
        gpu: &Gpu,
        layer: &wgpu::TextureView,
        counts: &wgpu::Buffer,
        offset: u64,
    ) -> wgpu::BindGroup {
        let slot = wgpu::BufferBinding { buffer: counts, offset, size: wgpu::BufferSize::new(4) };
        gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("count layers"),
            layout: &self.pipelines.count_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(layer) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Buffer(slot) },
            ],
        })
    }
}

/// What a pass draws into: colours, which it clears to 0, and a depth with what that is cleared to.
struct Target<'a> {
    colors: &'a [&'a wgpu::TextureView],
    depth: Option<(&'a wgpu::TextureView, f32)>,
}

impl Target<'_> {
    fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, first: bool) -> wgpu::RenderPass<'e> {
        let load = if first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let color = |view| {
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        let colors: Vec<_> = self.colors.iter().copied().map(color).collect();
        let depth = self.depth.map(|(view, clear)| {
            let load = if first { wgpu::LoadOp::Clear(clear) } else { wgpu::LoadOp::Load };
            let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
            wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
        });
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("peel"),
            color_attachments: &colors,
            depth_stencil_attachment: depth,
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}

/// Draws a mesh into a target, so many triangles at a time.
fn submit(
    gpu: &Gpu,
    mesh: &MeshGroups,
    pipeline: &wgpu::RenderPipeline,
    before: Option<&wgpu::BindGroup>,
    target: &Target,
) -> Result<(), GpuError> {
    let at_once = TRIANGLES_AT_ONCE[usize::from(!gpu.adapter().software)];
    let mut first = 0;
    loop {
        let end = mesh.triangles.min(first + at_once);
        gpu.checked("peeling a layer", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = target.begin(&mut encoder, first == 0);
                pass.set_pipeline(pipeline);
                for (i, group) in (0u32..).zip(mesh.shared.iter().chain(before)) {
                    pass.set_bind_group(i, group, &[]);
                }
                pass.draw(3 * first..3 * end, mesh.leaf..mesh.leaf + 1);
            }
            gpu.queue().submit([encoder.finish()]);
        })?;
        first = end;
        // Also a mesh without triangles clears its target.
        if first >= mesh.triangles {
            return Ok(());
        }
    }
}

/// Makes a pass one that has kept nothing.
fn clear(gpu: &Gpu, pass: &Pass) -> Result<(), GpuError> {
    gpu.checked("peeling a layer", || {
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        Target { colors: &[&pass.triangle], depth: Some((&pass.depth, 0.0)) }.begin(&mut encoder, true);
        gpu.queue().submit([encoder.finish()]);
    })
}
