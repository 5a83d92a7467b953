//! Nearest and farthest distance of the proxy along each pixel's ray, and where opaque geometry ends it.

use super::ProxyGeometry;
use super::pipelines::{DEPTH_FORMAT, ProxyPipelines, RANGE_FORMAT, gathered_format};
use super::uniforms::{Gathering, LimitsUniforms, ProxyViewUniforms};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::{FrameUniforms, tiles};
use cutaway_core::scene::Scene;

/// Fragments over one pixel that a tile is made for, counted as steps of a ray.
const LAYERS: f64 = 64.0;

/// What ranges are found from.
pub(crate) struct RangeInputs<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) frame: &'a FrameUniforms,
    /// None: all of the volume.
    pub(crate) proxy: Option<&'a ProxyGeometry>,
    /// World distance from the eye of opaque geometry, a pixel.
    pub(crate) opaque: Option<&'a wgpu::TextureView>,
}

/// Textures of one size.
#[derive(Debug)]
pub(crate) struct RangeTargets {
    size: [u32; 2],
    range: wgpu::TextureView,
    /// Blended: one. Sorted: nearest and farthest.
    gathered: Vec<wgpu::TextureView>,
    /// Of depth tests: depth and stencil together, and the stencil alone.
    depth: Option<[wgpu::TextureView; 2]>,
    nothing: Nothing,
    bytes: u64,
}

/// What is bound where there is nothing to bind.
#[derive(Debug)]
struct Nothing {
    distances: wgpu::TextureView,
    counts: wgpu::TextureView,
    boxes: wgpu::Buffer,
}

impl RangeTargets {
    pub(crate) fn new(gpu: &Gpu, pipelines: &ProxyPipelines, size: [u32; 2]) -> Result<Self, GpuError> {
        let gathering = pipelines.gathering();
        gpu.checked("the proxy's ranges", || {
            let target = |size: [u32; 2], format| {
                gpu.device().create_texture(&wgpu::TextureDescriptor {
                    label: Some("proxy range"),
                    size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                    view_formats: &[],
                })
            };
            let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
            let format = gathered_format(gathering);
            let sorted = gathering == Gathering::Sorted;
            let gathered: Vec<_> =
                (0..if sorted { 2 } else { 1 }).map(|_| view(&target(size, format))).collect();
            let depth = sorted.then(|| {
                let texture = target(size, DEPTH_FORMAT);
                let aspect = wgpu::TextureAspect::StencilOnly;
                let stencil = wgpu::TextureViewDescriptor { aspect, ..Default::default() };
                [view(&texture), texture.create_view(&stencil)]
            });
            let boxes = gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("no boxes"),
                size: 8,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            });
            let nothing = Nothing {
                distances: view(&target([1, 1], wgpu::TextureFormat::R32Float)),
                counts: view(&target([1, 1], wgpu::TextureFormat::R8Uint)),
                boxes,
            };
            let pixel = format.block_copy_size(None).unwrap_or(16) * gathered.len() as u32
                + if sorted { 4 } else { 0 }
                + 16;
            let bytes = u64::from(pixel) * u64::from(size[0]) * u64::from(size[1]);
            Self { size, range: view(&target(size, RANGE_FORMAT)), gathered, depth, nothing, bytes }
        })
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// What the ray caster reads.
    pub(crate) fn range(&self) -> &wgpu::TextureView {
        &self.range
    }

    /// Draws the proxy, then the range of each pixel.
    pub(crate) fn fill(
        &self,
        gpu: &Gpu,
        pipelines: &ProxyPipelines,
        inputs: &RangeInputs,
    ) -> Result<(), GpuError> {
        let gathering = pipelines.gathering();
        let unit_edge = inputs.proxy.map_or(1.0, ProxyGeometry::unit_edge);
        let view = ProxyViewUniforms::new(inputs.scene, self.size, unit_edge, gathering);
        let uniform = |contents: &[u8]| gpu.buffer("proxy frame", contents, wgpu::BufferUsages::UNIFORM);
        let (frame, limits, view_buffer) = gpu.checked("the proxy's view", || {
            let limits = self.limits(inputs, &view, gathering);
            (
                pipelines.bind_frame(gpu, &uniform(bytemuck::bytes_of(inputs.frame))),
                uniform(bytemuck::bytes_of(&limits)),
                uniform(bytemuck::bytes_of(&view)),
            )
        })?;
        if let Some(proxy) = inputs.proxy {
            let view = gpu.checked("the proxy", || pipelines.bind_view(gpu, &view_buffer, proxy.quads()))?;
            self.gather(gpu, pipelines, proxy, [&frame, &view])?;
        }
        gpu.checked("the proxy's ranges", || {
            let nothing = &self.nothing;
            let textures = [
                inputs.opaque.unwrap_or(&nothing.distances),
                &self.gathered[0],
                self.gathered.get(1).unwrap_or(&nothing.distances),
                self.depth.as_ref().map_or(&nothing.counts, |[_, stencil]| stencil),
            ];
            let boxes = inputs.proxy.map_or(&nothing.boxes, ProxyGeometry::boxes);
            let group = pipelines.bind_range(gpu, &limits, textures, boxes);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = pass(&mut encoder, &self.range, wgpu::Color::TRANSPARENT, true, None);
                pass.set_pipeline(match inputs.proxy {
                    Some(_) => pipelines.range_of_gathered(),
                    None => pipelines.range_of_all(),
                });
                pass.set_bind_group(0, &frame, &[]);
                pass.set_bind_group(1, &group, &[]);
                pass.draw(0..3, 0..1);
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }

    fn limits(&self, inputs: &RangeInputs, view: &ProxyViewUniforms, gathering: Gathering) -> LimitsUniforms {
        let (cells, cell_edge) = inputs.proxy.map_or(([0; 3], 1.0), ProxyGeometry::cells);
        let sorted = gathering == Gathering::Sorted;
        LimitsUniforms {
            distance_unit: view.distance_unit,
            // Depths have 24 bits over two units: of two that are as deep, the wrong one may be kept.
            slack: view.slack + view.distance_unit * 2.0f32.powi(-22),
            opaque: u32::from(inputs.opaque.is_some()),
            nothing_above: if sorted { 1e29 } else { 0.5 * gathering.nothing() as f32 },
            cells,
            cell_edge,
        }
    }

    /// Draws the proxy's quads, a tile at a time.
    fn gather(
        &self,
        gpu: &Gpu,
        pipelines: &ProxyPipelines,
        proxy: &ProxyGeometry,
        groups: [&wgpu::BindGroup; 2],
    ) -> Result<(), GpuError> {
        let nothing = pipelines.gathering().nothing();
        for (i, pipeline) in pipelines.gather().iter().enumerate() {
            // Of farthest distances none is the least.
            let sign = if i == 1 { -1.0 } else { 1.0 };
            let clear = wgpu::Color { r: sign * nothing, g: nothing, b: 0.0, a: 0.0 };
            let depth = self.depth.as_ref().map(|[view, _]| (view, if i == 0 { 1.0 } else { 0.0 }, i == 0));
            for (k, tile) in tiles(self.size, LAYERS, gpu.adapter().software).iter().enumerate() {
                gpu.checked("drawing the proxy geometry", || {
                    let mut encoder =
                        gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    {
                        let mut pass = pass(&mut encoder, &self.gathered[i], clear, k == 0, depth);
                        pass.set_pipeline(pipeline);
                        pass.set_bind_group(0, groups[0], &[]);
                        pass.set_bind_group(1, groups[1], &[]);
                        pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
                        pass.draw_indirect(proxy.draws(), 0);
                    }
                    gpu.queue().submit([encoder.finish()]);
                })?;
            }
        }
        Ok(())
    }
}

/// A pass into one target, cleared in the first one. `depth`: the target, what it is cleared to, and whether its stencil is
/// cleared too.
pub(super) fn pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
    clear: wgpu::Color,
    first: bool,
    depth: Option<(&wgpu::TextureView, f32, bool)>,
) -> wgpu::RenderPass<'e> {
    let load = if first { wgpu::LoadOp::Clear(clear) } else { wgpu::LoadOp::Load };
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let attachment =
        wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
    let depth = depth.map(|(view, clear, stencil)| {
        let load = |first| if first { wgpu::LoadOp::Clear(clear) } else { wgpu::LoadOp::Load };
        let stencil_load = if first && stencil { wgpu::LoadOp::Clear(0) } else { wgpu::LoadOp::Load };
        wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations { load: load(first), store: wgpu::StoreOp::Store }),
            stencil_ops: Some(wgpu::Operations { load: stencil_load, store: wgpu::StoreOp::Store }),
        }
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("proxy"),
        color_attachments: &[Some(attachment)],
        depth_stencil_attachment: depth,
        ..wgpu::RenderPassDescriptor::default()
    })
}
