//! Clipping on the GPU: from a scene's clip to the segments that are kept of each pixel's ray.
//!
//! What enters: a `FlatClip` and a camera. What leaves: two buffers, a range a pixel and a list of segments, which
//! `shared/segments.wgsl` reads. Between them (Termeer 3.2, with per-pixel lists in place of a fixed number of layers):
//!
//! 1. Every triangle of every mesh is rasterised, without a depth test, and adds an event to the lists of the pixels it covers;
//!    or meshes are peeled, layer by layer ([`peel`]).
//! 2. A compute pass takes each pixel's events, adds those of planes, boxes and balls from their equations, and sweeps over
//!    them as `cutaway_core::clip::Sweep` does.
//!
//! | object | holds | made anew |
//! |---|---|---|
//! | [`Clipping`] | pipelines, meshes seen lately | once |
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
mod peel;
mod sweep;

use cutaway_core::clip::{ClipEvents, FlatClip};
use cutaway_core::scene::Scene;

use crate::clock::Moment;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::{FrameUniforms, RayPlane};
use buffers::{ListBuffers, SegmentBuffers, SweepCounts};
use clip::GpuClip;
use leaf::ClipCamera;
use lists::{FrameInputs, Lists};
use mesh::MeshCache;
pub use peel::{ClipLayer, PeelSettings};
use peel::{PeelFrame, Peeler};

#[cfg(test)]
pub(crate) use {
    leaf::Leaf,
    lists::{LISTS_SHADER, SWEEP_SHADER},
    peel::{PEEL_COUNT_SHADER, PEEL_SHADER, PeeledMesh, SWEEP_PEEL_SHADER},
    sweep::{OWN_WORDS, SweepUniforms},
};

/// What clipping a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClipStatistics {
    /// Segments that are kept of all rays.
    pub segments: u64,
    /// Crossings of rays and meshes in event lists.
    pub crossings: u64,
    /// Layers that were peeled instead.
    pub layers: u32,
    /// Lines whose events did not balance and were repaired: one for each object and ray.
    pub repaired: u64,
    /// Bytes of meshes that had to be uploaded: none for a mesh that has only moved.
    pub uploaded: u64,
    /// Wall time in milliseconds, waiting for the device included.
    pub milliseconds: f64,
}

/// Pipelines, meshes and buffers of clipping.
#[derive(Debug, Default)]
pub(crate) struct Clipping {
    lists: Option<Lists>,
    peeler: Option<Peeler>,
    pub(crate) peel_settings: PeelSettings,
    meshes: MeshCache,
    /// Of an image of the size of the segments.
    events: Option<ListBuffers>,
    segments: Option<SegmentBuffers>,
}

impl Clipping {
    /// Finds the segments of a frame; they stay until the next one.
    pub(crate) fn update(
        &mut self,
        gpu: &Gpu,
        clip: &FlatClip,
        scene: &Scene,
        uniforms: &FrameUniforms,
    ) -> Result<ClipStatistics, GpuError> {
        let begun = Moment::now();
        let size = uniforms.resolution;
        let view = ClipCamera::new(RayPlane::new(scene, size), size);
        let clip = GpuClip::new(gpu, clip, &view, &mut self.meshes)?;
        let mut segments = match self.segments.take().filter(|segments| segments.size() == size) {
            Some(segments) => segments,
            None => {
                self.events = None;
                SegmentBuffers::new(gpu, size)?
            }
        };
        let frame = gpu.checked("a frame's inputs", || {
            gpu.buffer("frame", bytemuck::bytes_of(uniforms), wgpu::BufferUsages::UNIFORM)
        })?;
        let of_frame = OfFrame { frame: &frame, clip: &clip, scene, radius: view.radius() };
        // Without a mesh there is nothing to peel, and lists are empty.
        let peels = scene.settings().clip_events == ClipEvents::Peel && !clip.meshes.is_empty();
        let (counts, layers) = if peels {
            self.peel(gpu, &of_frame, &mut segments)?
        } else {
            (self.list(gpu, &of_frame, &mut segments)?, 0)
        };
        self.segments = Some(segments);
        Ok(ClipStatistics {
            segments: counts.kept_segments.into(),
            crossings: counts.nodes.into(),
            layers,
            repaired: counts.repaired.into(),
            uploaded: clip.uploaded,
            milliseconds: begun.milliseconds(),
        })
    }

    /// By event lists.
    fn list(
        &mut self,
        gpu: &Gpu,
        of: &OfFrame,
        segments: &mut SegmentBuffers,
    ) -> Result<SweepCounts, GpuError> {
        let lists = match self.lists.take() {
            Some(lists) => lists,
            None => Lists::new(gpu)?,
        };
        let lists = self.lists.insert(lists);
        let mut events = match self.events.take() {
            Some(events) => events,
            None => ListBuffers::new(gpu, segments.size())?,
        };
        loop {
            lists.submit(gpu, &events, &of.inputs(segments))?;
            let counts = segments.read_counters(gpu)?;
            // Where lists were cut short, there may be more segments than were counted: then once more.
            if !(events.grow(gpu, counts.nodes)? | segments.grow(gpu, counts.segments)?) {
                self.events = Some(events);
                return Ok(counts);
            }
        }
    }

    /// By peeled layers, of which there are so many.
    fn peel(
        &mut self,
        gpu: &Gpu,
        of: &OfFrame,
        segments: &mut SegmentBuffers,
    ) -> Result<(SweepCounts, u32), GpuError> {
        let peeler = match self.peeler.take() {
            Some(peeler) => peeler,
            None => Peeler::new(gpu)?,
        };
        let peeler = self.peeler.insert(peeler);
        let frame = PeelFrame {
            size: segments.size(),
            depth: of.scene.settings().buffer_depth,
            settings: self.peel_settings,
            limit: of.scene.segment_limit(),
        };
        let layers = peeler.peel(gpu, &of.inputs(segments), &frame)?;
        loop {
            peeler.sweep(gpu, &of.inputs(segments))?;
            let counts = segments.read_counters(gpu)?;
            if !segments.grow(gpu, counts.segments)? {
                return Ok((counts, layers));
            }
        }
    }

    /// The layers that the last frame peeled, which was of this scene.
    pub(crate) fn layers(&self, gpu: &Gpu, scene: &Scene) -> Result<Vec<ClipLayer>, GpuError> {
        match &self.peeler {
            Some(peeler) => peeler.read(gpu, scene),
            None => Ok(Vec::new()),
        }
    }

    /// The ranges and the list of the last frame's segments.
    pub(crate) fn segments(&self) -> Option<[&wgpu::Buffer; 2]> {
        self.segments.as_ref().map(|segments| [&segments.ranges, &segments.list])
    }

    /// What it takes of the device's memory.
    pub(crate) fn bytes(&self) -> u64 {
        let events = self.events.as_ref().map_or(0, ListBuffers::bytes);
        let segments = self.segments.as_ref().map_or(0, SegmentBuffers::bytes);
        self.meshes.bytes() + events + segments + self.peeler.as_ref().map_or(0, Peeler::bytes)
    }
}

/// What a frame's segments are made from.
struct OfFrame<'a> {
    frame: &'a wgpu::Buffer,
    clip: &'a GpuClip,
    scene: &'a Scene,
    radius: f64,
}

impl OfFrame<'_> {
    fn inputs<'a>(&'a self, segments: &'a SegmentBuffers) -> FrameInputs<'a> {
        let limit = self.scene.segment_limit();
        FrameInputs { frame: self.frame, clip: self.clip, limit, radius: self.radius, segments }
    }
}
