//! The sweep's pipelines and how it is sent off: from events, whatever their source, to segments.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use cutaway_core::clip::{SegmentCount, SegmentLimit};

use super::buffers::SegmentBuffers;
use super::clip::GpuClip;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{COMPUTE, UNIFORM, bind_buffers, compute_pipeline, flag, group_layout_of, storage};
use crate::shaders::Shader;

/// Events this near to each other, as a fraction of half the volume's diagonal, are one.
///
/// A place on a ray is computed in f32 from numbers of about that size: some five of them, each known to 6e-8 of it, and
/// divided by the cosine between ray and surface. This covers cosines down to 1/6; at 512³ voxels it is a thousandth of one.
pub(crate) const COINCIDENCE: f64 = 2e-6;

/// Words of a state that a pixel holds by itself; as in `expression.wgsl`, which a test holds it against.
pub(crate) const OWN_WORDS: u64 = 64;

/// As `SweepSettings` in `settings.wgsl`, field by field; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SweepUniforms {
    pub(crate) first_pixel: [u32; 2],
    pub(crate) width: u32,
    pub(crate) leaf_count: u32,
    pub(crate) gate_count: u32,
    pub(crate) keeps_outside: u32,
    pub(crate) tolerance: f32,
    pub(crate) segment_limit: u32,
    pub(crate) backmost: u32,
    pub(crate) segment_capacity: u32,
    pub(crate) reserved: [u32; 2],
}

/// What a frame's sweep is about.
pub(crate) struct SweepInputs<'a> {
    /// The frame's uniforms.
    pub(crate) frame: &'a wgpu::Buffer,
    pub(crate) clip: &'a GpuClip,
    pub(crate) limit: SegmentLimit,
    /// Half the volume's diagonal, in world units.
    pub(crate) radius: f64,
    pub(crate) segments: &'a SegmentBuffers,
    /// What group 2 of the source's shader is bound to.
    pub(crate) source: &'a wgpu::BindGroup,
}

/// A sweep over one kind of source of events.
#[derive(Debug)]
pub(crate) struct Sweep {
    shader: wgpu::ShaderModule,
    frame: wgpu::BindGroupLayout,
    own: wgpu::BindGroupLayout,
    source: wgpu::BindGroupLayout,
    /// With states in the pixels' own memory, and in a buffer.
    pipelines: [OnceLock<wgpu::ComputePipeline>; 2],
}

/// Pixels of one dispatch on a software adapter and on a GPU: far less than 100 ms.
const PIXELS_AT_ONCE: [u64; 2] = [1 << 18, 1 << 22];
/// Bytes of states that do not fit in their pixels, at once.
const STATE_BYTES: u64 = 64 << 20;

impl Sweep {
    /// `source`: the types of bindings of group 2, from 0 on.
    pub(crate) fn new(gpu: &Gpu, shader: Shader, source: &[wgpu::BindingType]) -> Result<Self, GpuError> {
        gpu.checked("the clip sweep's shader", || {
            let device = gpu.device();
            let shader = shader.module(device);
            let layout = |types: &[wgpu::BindingType]| group_layout_of(device, "clip sweep", COMPUTE, types);
            let (read, write) = (storage(true), storage(false));
            Self {
                shader,
                frame: layout(&[UNIFORM]),
                own: layout(&[UNIFORM, read, read, write, write, write, write]),
                source: layout(source),
                pipelines: Default::default(),
            }
        })
    }

    /// The layout of what a source's shader is bound to.
    pub(crate) fn source_layout(&self) -> &wgpu::BindGroupLayout {
        &self.source
    }

    fn pipeline(&self, gpu: &Gpu, large: bool) -> Result<&wgpu::ComputePipeline, GpuError> {
        let made = &self.pipelines[usize::from(large)];
        if let Some(pipeline) = made.get() {
            return Ok(pipeline);
        }
        let pipeline = gpu.checked("the clip sweep's pipeline", || {
            let groups = [Some(&self.frame), Some(&self.own), Some(&self.source)];
            let constants = [("LARGE_STATE", flag(large))];
            compute_pipeline(gpu.device(), &self.shader, "sweep_pixel", &groups, &constants)
        })?;
        Ok(made.get_or_init(|| pipeline))
    }

    /// Submits the sweep of an image, part by part. Counters must have been cleared.
    pub(crate) fn submit(&self, gpu: &Gpu, inputs: &SweepInputs) -> Result<(), GpuError> {
        let words = inputs.clip.state_words();
        let large = words > OWN_WORDS;
        let pipeline = self.pipeline(gpu, large)?;
        let parts = parts(gpu, inputs.segments.size(), if large { words } else { 0 })?;
        let bytes = if large { parts.pixels() * words * 4 } else { 4 };
        let (states, frame) = gpu.checked("the clip sweep's memory", || {
            let states = gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("clip states"),
                size: bytes,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            });
            (states, bind_buffers(gpu.device(), &self.frame, &[inputs.frame]))
        })?;
        for (part, [width, height]) in parts.all(inputs.segments.size()) {
            gpu.checked("the clip sweep", || {
                let own = self.bind_own(gpu, inputs, &states, part, width);
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, &frame, &[]);
                    pass.set_bind_group(1, &own, &[]);
                    pass.set_bind_group(2, inputs.source, &[]);
                    pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
                }
                gpu.queue().submit([encoder.finish()]);
            })?;
        }
        Ok(())
    }

    fn bind_own(
        &self,
        gpu: &Gpu,
        inputs: &SweepInputs,
        states: &wgpu::Buffer,
        first_pixel: [u32; 2],
        width: u32,
    ) -> wgpu::BindGroup {
        let clip = inputs.clip;
        let segment_limit = match inputs.limit.count {
            SegmentCount::Auto => u32::MAX,
            SegmentCount::AtMost(n) => n.get(),
        };
        let uniforms = SweepUniforms {
            first_pixel,
            width,
            leaf_count: clip.leaf_count,
            gate_count: clip.gate_count,
            keeps_outside: u32::from(clip.keeps_outside),
            tolerance: (COINCIDENCE * inputs.radius) as f32,
            segment_limit,
            backmost: u32::from(inputs.limit.backmost),
            segment_capacity: inputs.segments.capacity(),
            reserved: [0; 2],
        };
        let uniforms = gpu.buffer("clip sweep", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
        let segments = inputs.segments;
        let buffers = [
            &uniforms,
            &clip.leaves,
            &clip.gates,
            &segments.ranges,
            &segments.list,
            &segments.counters,
            states,
        ];
        bind_buffers(gpu.device(), &self.own, &buffers)
    }
}

/// Width and height of the parts that an image is swept in: multiples of a workgroup's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Parts {
    width: u32,
    height: u32,
}

impl Parts {
    fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The first pixel and the size of each.
    fn all(self, [width, height]: [u32; 2]) -> impl Iterator<Item = ([u32; 2], [u32; 2])> {
        let rows = (0..height).step_by(self.height as usize);
        rows.flat_map(move |y| (0..width).step_by(self.width as usize).map(move |x| [x, y]))
            .map(move |[x, y]| ([x, y], [self.width.min(width - x), self.height.min(height - y)]))
    }
}

/// `words`: what a pixel needs of the states' buffer.
fn parts(gpu: &Gpu, [width, height]: [u32; 2], words: u64) -> Result<Parts, GpuError> {
    let mut most = PIXELS_AT_ONCE[usize::from(!gpu.adapter().software)];
    if words > 0 {
        let fit = gpu.capabilities().max_buffer / (4 * words);
        if fit < 64 {
            let most = gpu.capabilities().max_buffer / 256;
            return Err(GpuError::ClipTooLarge { of: "objects and operations", needed: words, most });
        }
        most = most.min((STATE_BYTES / (4 * words)).max(64)).min(fit);
    }
    let side = |n: u64, all: u32| {
        let n = u32::try_from(n).unwrap_or(u32::MAX);
        (n / 8 * 8).clamp(8, all.next_multiple_of(8))
    };
    let width = side(most / 8, width);
    Ok(Parts { width, height: side(most / u64::from(width), height) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_every_pixel_once() {
        for (parts, size) in [
            (Parts { width: 8, height: 8 }, [67, 45]),
            (Parts { width: 72, height: 16 }, [67, 45]),
            (Parts { width: 64, height: 48 }, [512, 512]),
        ] {
            let covered: u64 = parts.all(size).map(|(_, [w, h])| u64::from(w) * u64::from(h)).sum();
            assert_eq!(covered, u64::from(size[0]) * u64::from(size[1]));
            assert!(parts.all(size).all(|([x, y], [w, h])| x + w <= size[0] && y + h <= size[1]));
        }
    }
}
