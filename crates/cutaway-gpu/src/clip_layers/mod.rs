//! Clipping on the GPU: from a scene's clip to the segments that are kept of each pixel's ray.
//!
//! What enters: a `FlatClip` and a camera. What leaves: two buffers, a range a pixel and a list of segments, which
//! `shared/segments.wgsl` reads. Between them (Termeer 3.2, with per-pixel lists in place of a fixed number of layers):
//!
//! 1. Every triangle of every mesh is rasterised, without a depth test, and adds an event to the lists of the pixels it covers.
//! 2. A compute pass takes each pixel's events, adds those of planes, boxes and balls from their equations, and sweeps over
//!    them as `cutaway_core::clip::Sweep` does.
//!
//! | object | holds | made anew |
//! |---|---|---|
//! | [`ClipLayers`] | pipelines, meshes seen lately | once |
//! | meshes | triangles, normals | for a mesh not seen before |
//! | `GpuClip` | poses under a camera, the expression | each frame |
//! | lists, segments | of each pixel | for another size, or when they are full |
//!
//! Lists and segments are counted as they are made, also those that do not fit; where some did not, the buffers grow and
//! the frame's clipping is done again. Perspective shows only what is before the eye: what a ray crosses behind it counts by
//! its sum, how many times the eye is inside each object, which the host finds.

mod buffers;
mod clip;
mod leaf;
mod lists;
mod mesh;
mod sweep;

use std::time::Instant;

use cutaway_core::clip::FlatClip;
use cutaway_core::scene::Scene;
use wgpu::util::DeviceExt;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::raycast::{FrameUniforms, RayPlane};
use buffers::{ListBuffers, SegmentBuffers};
use clip::GpuClip;
use leaf::View;
use lists::{FrameInputs, Lists};
use mesh::MeshCache;

#[cfg(test)]
pub(crate) use {leaf::Leaf, sweep::OWN_WORDS, sweep::SweepUniforms};

/// The linked shader that makes event lists.
pub(crate) const LISTS_SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/clip_layers_lists.wgsl"));
/// The linked shader that sweeps over them.
pub(crate) const SWEEP_SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/clip_layers_sweep_lists.wgsl"));

/// What clipping a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClipStatistics {
    /// Segments that are kept of all rays.
    pub segments: u64,
    /// Crossings of rays and meshes.
    pub crossings: u64,
    /// Lines whose events did not balance and were repaired: one for each object and ray.
    pub repaired: u64,
    /// Bytes of meshes that had to be uploaded: none for a mesh that has only moved.
    pub uploaded: u64,
    /// Wall time in milliseconds, waiting for the device included.
    pub milliseconds: f64,
}

/// Pipelines, meshes and buffers of clipping.
#[derive(Debug, Default)]
pub(crate) struct ClipLayers {
    lists: Option<Lists>,
    meshes: MeshCache,
    buffers: Option<(ListBuffers, SegmentBuffers)>,
}

impl ClipLayers {
    /// Finds the segments of a frame; they stay until the next one.
    pub(crate) fn update(
        &mut self,
        gpu: &Gpu,
        clip: &FlatClip,
        scene: &Scene,
        uniforms: &FrameUniforms,
    ) -> Result<ClipStatistics, GpuError> {
        let begun = Instant::now();
        let size = uniforms.resolution;
        let view = View::new(RayPlane::new(scene, size), size);
        let clip = GpuClip::new(gpu, clip, &view, &mut self.meshes)?;
        let lists = match self.lists.take() {
            Some(lists) => lists,
            None => Lists::new(gpu)?,
        };
        let lists = self.lists.insert(lists);
        let kept = self.buffers.take().filter(|(_, segments)| segments.size() == size);
        let (mut events, mut segments) = match kept {
            Some(kept) => kept,
            None => (ListBuffers::new(gpu, size)?, SegmentBuffers::new(gpu, size)?),
        };
        let frame = gpu.checked("a frame's inputs", || {
            gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("frame"),
                contents: bytemuck::bytes_of(uniforms),
                usage: wgpu::BufferUsages::UNIFORM,
            })
        })?;
        let counts = loop {
            let inputs = FrameInputs {
                frame: &frame,
                clip: &clip,
                limit: scene.segment_limit(),
                radius: view.radius(),
                segments: &segments,
            };
            lists.submit(gpu, &events, &inputs)?;
            let counts = segments.read_counters(gpu)?;
            // Where lists were cut short, there may be more segments than were counted: then once more.
            if !(events.grow(gpu, counts.nodes)? | segments.grow(gpu, counts.segments)?) {
                break counts;
            }
        };
        self.buffers = Some((events, segments));
        Ok(ClipStatistics {
            segments: counts.kept_segments.into(),
            crossings: counts.nodes.into(),
            repaired: counts.repaired.into(),
            uploaded: clip.uploaded,
            milliseconds: begun.elapsed().as_secs_f64() * 1e3,
        })
    }

    /// The ranges and the list of the last frame's segments.
    pub(crate) fn segments(&self) -> Option<[&wgpu::Buffer; 2]> {
        self.buffers.as_ref().map(|(_, segments)| [&segments.ranges, &segments.list])
    }

    /// What it takes of the device's memory.
    pub(crate) fn bytes(&self) -> u64 {
        let buffers = self.buffers.as_ref();
        self.meshes.bytes() + buffers.map_or(0, |(events, segments)| events.bytes() + segments.bytes())
    }
}

fn binding(
    binding: u32,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn storage(read_only: bool) -> wgpu::BindingType {
    let ty = wgpu::BufferBindingType::Storage { read_only };
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}
