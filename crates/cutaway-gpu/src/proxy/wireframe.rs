//! The edges of the proxy's quads, drawn over an image where it does not hide them: to see what rays begin and end at.

use super::geometry::LINES;
use super::pipelines::ProxyPipelines;
use super::ranges::{RangeInputs, pass};
use super::uniforms::ProxyViewUniforms;
use crate::context::Gpu;
use crate::error::GpuError;

/// Draws into `colors`, in straight colour; `depths` is the image's, in world units from the eye.
pub(crate) fn draw(
    gpu: &Gpu,
    pipelines: &ProxyPipelines,
    inputs: &RangeInputs,
    line_color: [f32; 3],
    [colors, depths]: [&wgpu::TextureView; 2],
) -> Result<(), GpuError> {
    let Some(proxy) = inputs.proxy else { return Ok(()) };
    let size = inputs.frame.resolution;
    let view = ProxyViewUniforms::new(inputs.scene, size, proxy.unit_edge(), pipelines.gathering());
    let view = ProxyViewUniforms { line_color, ..view };
    gpu.checked("drawing the wireframe", || {
        let uniform = |contents: &[u8]| gpu.buffer("wireframe", contents, wgpu::BufferUsages::UNIFORM);
        let frame = pipelines.bind_frame(gpu, &uniform(bytemuck::bytes_of(inputs.frame)));
        let group = pipelines.bind_lines(gpu, &uniform(bytemuck::bytes_of(&view)), proxy.quads(), depths);
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = pass(&mut encoder, colors, wgpu::Color::TRANSPARENT, false, None);
            pass.set_pipeline(pipelines.lines());
            pass.set_bind_group(0, &frame, &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.draw_indirect(proxy.draws(), LINES);
        }
        gpu.queue().submit([encoder.finish()]);
    })
}
