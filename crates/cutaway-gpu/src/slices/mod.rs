//! The slice renderer (Rezk-Salama and Kolb 2005): polygons across the view, blended back to front.
//!
//! Enters: a prepared volume, its classification and a scene. Leaves: an image, and what it took.
//!
//! 1. An octree over the volume's blocks (`octree`) hands out the bricks of which something is visible, the farthest first.
//! 2. Each brick is one instanced draw of six vertices a plane; the vertex shader finds from their numbers alone where the
//!    plane cuts the brick (`intersection`, `planes`).
//! 3. A fragment stands for the slab around its plane, which is as long as the pixel's ray is in it, cut where the volume or
//!    what clipping keeps of it ends; it is blended over what lies behind, or into an extreme value or a sum.
//! 4. A last pass makes the image of what was blended.
//!
//! It differs from the paper where that was needed to meet the integral that all engines share: opacity is that of the slab's
//! length, which in perspective grows towards the image's border; the last slab before a border is as thick as what is left
//! of it; and a fragment belongs to the brick in which it is *sampled*, so that bricks neither overlap nor leave seams, be they
//! of 8 cells or the whole volume. Bricks are a matter of the octree alone: where texels lie in memory is the volume's.
//!
//! The depth of a composite pixel that is at least half opaque is the *mean* distance of what is seen in it, weighted by how
//! much of it is seen: blending cannot tell where opacity passes one half. Extreme values have no depth.

mod intersection;
mod octree;
mod pipelines;
mod planes;
mod prepared;
mod targets;

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use cutaway_core::image::Image;
use cutaway_core::scene::{
    Gradient, ImageInterpolation, Mode, RenderSettings, Sampling, Scene, SpaceSkipping,
};
use cutaway_core::transfer_function::ClassificationTable;
use cutaway_core::value_ranges::{BLOCK, ValueRanges};
use cutaway_core::volume::Volume;

use crate::classification::{GpuClassification, visible};
use crate::clipping::{ClipStatistics, Clipping};
use crate::context::{Gpu, Stopwatch};
use crate::error::GpuError;
use crate::frame::{
    self, Finished, Finisher, FrameUniforms, GpuDirections, Inputs, Lattice, Pending, Progress,
    SAMPLES_AT_ONCE, ShownFrame, Targets, cost_of_step,
};
use crate::ranges::BlockPipelines;
use octree::{Brick, Octree};
#[cfg(test)]
pub(crate) use pipelines::{DEVELOP_SHADER, SHADER};
use pipelines::{Made, Pipelines, Variant};
use planes::Planes;
#[cfg(test)]
pub(crate) use planes::{BrickRecord, SliceUniforms};
pub use prepared::{PreparedSlices, SliceClassification, SliceStatistics};
use targets::SliceTargets;

/// Pipelines on a device.
#[derive(Debug)]
pub struct SliceRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    blocks: BlockPipelines,
    finisher: Finisher,
    clip: Mutex<Clipping>,
    targets: Mutex<Option<(Targets, SliceTargets)>>,
    stopwatch: Option<Stopwatch>,
}

/// A box to draw: its vertices begin at six times its place in the list.
struct DrawnBox {
    instances: Range<u32>,
    /// Fragments of one of them, about.
    fragments: f64,
}

impl SliceRenderer {
    /// Makes what all frames share.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            gpu: gpu.clone(),
            pipelines: Pipelines::new(gpu)?,
            blocks: BlockPipelines::new(gpu)?,
            finisher: Finisher::new(gpu)?,
            clip: Mutex::default(),
            targets: Mutex::default(),
            stopwatch: Stopwatch::new(gpu)?,
        })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What of these settings it does without or less exactly, in words for whoever asked for it.
    pub fn notices(&self, settings: &RenderSettings) -> Vec<String> {
        let composite = settings.mode == Mode::Composite;
        let all = [
            (
                !self.gpu.capabilities().float_blending,
                "this GPU blends 16-bit floats only: colours are off by up to 0.02, means by up to 3 % of their range",
            ),
            (
                settings.image_interpolation == ImageInterpolation::Adaptive,
                "slices cover every pixel: no adaptive image interpolation (a factor, 2 to 16, works)",
            ),
            (settings.jitter, "slices are not jittered"),
            (settings.adaptive_threshold.is_some(), "slices are equally far apart: no adaptive steps"),
            (
                settings.sampling == Sampling::Object,
                "slices lie across the view, not on the planes of voxels",
            ),
            (
                !composite && (settings.pre_integration || settings.gradient != Gradient::default()),
                "pre-integration and kinds of gradient are of composite mode",
            ),
        ];
        all.into_iter().filter(|(is, _)| *is).map(|(_, notice)| notice.to_owned()).collect()
    }

    /// Makes a volume ready: uploads it, and finds the ranges of its blocks.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedSlices, GpuError> {
        let on_device = frame::PreparedVolume::new(&self.gpu, &self.blocks, volume)?;
        let ranges = on_device.voxels().host_ranges().is_none().then(|| ValueRanges::new(volume));
        Ok(PreparedSlices { on_device, ranges })
    }

    /// Classifies a prepared volume for a scene.
    pub fn classify(&self, volume: &PreparedSlices, scene: &Scene) -> Result<SliceClassification, GpuError> {
        if scene.settings().mode == Mode::Iso {
            return Err(GpuError::NoIsosurfaces);
        }
        let scene = &*scene.normalised();
        let shared = &volume.on_device;
        let on_device =
            GpuClassification::new(&self.gpu, &self.blocks, shared.ranges(), shared.voxels(), scene)?;
        Ok(SliceClassification { on_device, octree: octree(volume, scene) })
    }

    /// Renders a frame of a scene with a classification made for it. `progress` is called with the finished share of the
    /// image, 0..=1.
    pub fn render(
        &self,
        volume: &PreparedSlices,
        classification: &SliceClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, SliceStatistics), GpuError> {
        self.render_with(volume, classification, scene, None, progress)
    }

    /// As [`Self::render`]; once `cancel` is set, the frame ends between two batches of slices, as [`GpuError::Cancelled`].
    pub fn render_with(
        &self,
        volume: &PreparedSlices,
        classification: &SliceClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, SliceStatistics), GpuError> {
        self.submit(volume, classification, scene, cancel, progress)?.outcome()
    }

    /// The first half of [`Self::render_with`]: hands a frame to the device and does not wait for it.
    pub fn submit(
        &self,
        volume: &PreparedSlices,
        classification: &SliceClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
        progress: &dyn Fn(f32),
    ) -> Result<Pending<SliceStatistics>, GpuError> {
        let progress = Progress::new(progress, cancel);
        self.drawn(volume, classification, scene, &progress, |finished, drawn| {
            let time = self.stopwatch.as_ref().map(|watch| watch.submit(&self.gpu)).transpose()?;
            let pending = Pending::new(&self.gpu, finished, time, drawn, SliceStatistics::completed)?;
            // Where extreme values are is not known.
            let extreme = matches!(scene.settings().mode, Mode::Mip | Mode::Minip);
            Ok(if extreme {
                pending.without_depth()
            } else {
                pending.with_depth_unit(scene.normalised().space().unit)
            })
        })
    }

    /// Renders a frame as [`Self::render_with`] does, for a window drawn with the same device: nothing is copied to the host.
    /// Returns when it is there.
    pub fn show(
        &self,
        volume: &PreparedSlices,
        classification: &SliceClassification,
        scene: &Scene,
        cancel: Option<&AtomicBool>,
    ) -> Result<ShownFrame, GpuError> {
        let progress = Progress::new(&|_| {}, cancel);
        self.drawn(volume, classification, scene, &progress, |finished, drawn| {
            self.finisher.show(&self.gpu, finished, drawn.gpu_bytes)
        })
    }

    /// Draws a frame, for `take` to do something with it. What its statistics say of pixels and of time is not known yet.
    fn drawn<T>(
        &self,
        volume: &PreparedSlices,
        classification: &SliceClassification,
        scene: &Scene,
        progress: &Progress,
        take: impl FnOnce(&Finished, SliceStatistics) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let scene = &*scene.normalised();
        let shared = &volume.on_device;
        debug_assert!(shared.voxels().is_of(scene));
        let size = Lattice::of(scene).size;
        let planes = Planes::new(scene, size)?;
        let variant = Variant::of(&self.gpu, scene, shared.voxels());
        let (targets, blended) = self.targets(size, variant)?;
        let uniforms = FrameUniforms::new(scene, shared.voxels(), &classification.on_device, size);
        let mut clipping = self.clip.lock().unwrap_or_else(PoisonError::into_inner);
        let clip = match scene.clip() {
            Some(clip) => clipping.update(&self.gpu, clip, scene, &uniforms)?,
            None => ClipStatistics::default(),
        };
        let directions = shared.directions(&self.gpu, scene)?;
        let inputs = Inputs {
            volume: shared.voxels(),
            classification: &classification.on_device,
            blocks: shared.ranges(),
            range: None,
            directions,
            segments: clipping.segments().filter(|_| scene.clip().is_some()),
        };
        let boxes = classification.octree.back_to_front(&planes.viewpoint());
        let frame =
            Drawing { scene, planes, variant, uniforms, inputs, targets: &targets, blended: &blended };
        let slices = self.draw(&frame, &boxes, progress)?;
        let finished = self.finisher.finish(&self.gpu, scene, &targets)?;
        let [all, visible] = classification.brick_counts();
        let statistics = SliceStatistics {
            bricks: visible,
            skipped_fraction: 1.0 - visible as f64 / all as f64,
            boxes: boxes.len() as u64,
            slices,
            gpu_bytes: shared.voxels().bytes()
                + shared.ranges().bytes()
                + classification.on_device.bytes()
                + targets.bytes()
                + blended.bytes()
                + finished.bytes
                + directions.map_or(0, GpuDirections::bytes)
                + clipping.bytes(),
            clip,
            ..SliceStatistics::default()
        };
        let taken = take(&finished, statistics)?;
        *self.targets.lock().unwrap_or_else(PoisonError::into_inner) = Some((targets, blended));
        Ok(taken)
    }

    /// Those of the last frame where they fit.
    fn targets(&self, size: [u32; 2], variant: Variant) -> Result<(Targets, SliceTargets), GpuError> {
        let kept = self.targets.lock().unwrap_or_else(PoisonError::into_inner).take();
        let (targets, blended) = kept.filter(|(targets, _)| targets.size() == size).unzip();
        let targets = match targets {
            Some(targets) => targets,
            None => Targets::new(&self.gpu, size)?,
        };
        let blended = match blended.filter(|blended: &SliceTargets| blended.is(size, variant.blending())) {
            Some(blended) => blended,
            None => SliceTargets::new(&self.gpu, size, variant.blending())?,
        };
        Ok((targets, blended))
    }

    /// Draws all slices and makes the image of them; how many slices there are.
    fn draw(&self, frame: &Drawing, boxes: &[Brick], progress: &Progress) -> Result<u64, GpuError> {
        progress.check()?;
        let made = self.pipelines.get(&self.gpu, frame.variant)?;
        let inputs = &frame.inputs;
        let clipped = frame.scene.clip().is_some();
        let (mut records, drawn): (Vec<_>, Vec<_>) = (boxes.iter())
            .map(|brick| {
                let (record, instances) = frame.planes.brick(brick, clipped);
                (record, DrawnBox { instances, fragments: frame.planes.pixels_of_slice(brick) })
            })
            .unzip();
        // A buffer of nothing cannot be bound.
        records.resize(records.len().max(1), bytemuck::Zeroable::zeroed());
        // Until everything is submitted no other scene may change which bricks of the atlas are there.
        let resident =
            inputs.volume.resident(&self.gpu, frame.scene.volume(), inputs.classification.wanted())?;
        let groups = self.gpu.checked("a frame's inputs", || {
            let uniforms = frame.planes.uniforms(kind(frame.scene));
            let uniforms =
                self.gpu.buffer("slices", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
            let records =
                self.gpu.buffer("bricks", bytemuck::cast_slice(&records), wgpu::BufferUsages::STORAGE);
            let scene = self.pipelines.bindings().bind(&self.gpu, inputs, &resident, &frame.uniforms);
            let slices = self.pipelines.bind_slices(&self.gpu, &uniforms, &records);
            Groups {
                scene,
                slices,
                blended: self.pipelines.bind_blended(&self.gpu, &uniforms, frame.blended),
            }
        })?;
        let batches = batches(&drawn, self.fragments_at_once(frame.scene));
        for (i, batch) in batches.iter().enumerate() {
            self.gpu.checked("drawing slices", || {
                self.blend(&made, &groups, frame, batch, [i == 0, i + 1 == batches.len()])
            })?;
            progress.advance(&self.gpu, (i + 1) as f32 / batches.len() as f32)?;
        }
        self.gpu.checked("the image of slices", || self.develop(&made, &groups, frame.targets))?;
        Ok(drawn.iter().map(|d| d.instances.len() as u64).sum())
    }

    fn fragments_at_once(&self, scene: &Scene) -> f64 {
        SAMPLES_AT_ONCE[usize::from(!self.gpu.adapter().software)] / cost_of_step(scene)
    }

    fn blend(
        &self,
        made: &Made,
        groups: &Groups,
        frame: &Drawing,
        batch: &[(u32, Range<u32>)],
        [first, last]: [bool; 2],
    ) {
        let mut encoder =
            self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let writes = self.stopwatch.as_ref().and_then(|watch| watch.writes(first, last));
            let mut pass = frame.blended.pass(&mut encoder, first, writes);
            pass.set_pipeline(&made.slices);
            groups.set(&mut pass, &groups.slices);
            for (brick, instances) in batch {
                pass.draw(6 * brick..6 * brick + 6, instances.clone());
            }
        }
        self.gpu.queue().submit([encoder.finish()]);
    }

    fn develop(&self, made: &Made, groups: &Groups, targets: &Targets) {
        let mut encoder =
            self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = targets.pass(&mut encoder, true, None);
            pass.set_pipeline(&made.develop);
            groups.set(&mut pass, &groups.blended);
            pass.draw(0..3, 0..1);
        }
        self.gpu.queue().submit([encoder.finish()]);
    }
}

/// What a frame is drawn from and into.
struct Drawing<'a> {
    scene: &'a Scene,
    planes: Planes,
    variant: Variant,
    uniforms: FrameUniforms,
    inputs: Inputs<'a>,
    targets: &'a Targets,
    blended: &'a SliceTargets,
}

/// What a frame's passes are bound to.
struct Groups {
    scene: [wgpu::BindGroup; 3],
    slices: wgpu::BindGroup,
    blended: wgpu::BindGroup,
}

impl Groups {
    fn set(&self, pass: &mut wgpu::RenderPass, own: &wgpu::BindGroup) {
        for (i, group) in (0u32..).zip(self.scene.iter().chain([own])) {
            pass.set_bind_group(i, group, &[]);
        }
    }
}

/// The blocks that a scene makes visible.
fn octree(volume: &PreparedSlices, scene: &Scene) -> Octree {
    let settings = scene.settings();
    let source = scene.volume();
    let Some(ranges) = volume.ranges() else {
        return Octree::whole(source.dimensions());
    };
    let table = ClassificationTable::new(scene.transfer_function(), source.rescale(), source.stored_range());
    // A pre-integrated stretch depends on values beside its middle, as far as a slab reaches.
    let reaches = settings.pre_integration;
    let reach = scene.step_length() / source.spacing().min_element();
    // Overlaid clip surfaces show where nothing else does.
    let overlaid = scene.clip().is_some() && scene.clip_shading().overlay > 0.0;
    let all =
        overlaid || settings.space_skipping == SpaceSkipping::Off || (reaches && reach > f64::from(BLOCK));
    let visible = |lo, hi| all || visible(&table, scene, lo, hi);
    Octree::new(source.dimensions(), ranges, settings.brick_size, visible, reaches)
}

/// What texels are multiplied by so that the one that is looked for is the greatest.
fn kind(scene: &Scene) -> f64 {
    let sign = scene.volume().rescale().slope.signum();
    if scene.settings().mode == Mode::Minip { -sign } else { sign }
}

/// Draws in order, as many at a time as make about so many fragments; a box with more is drawn in several goes.
fn batches(drawn: &[DrawnBox], fragments_at_once: f64) -> Vec<Vec<(u32, Range<u32>)>> {
    let mut batches = vec![Vec::new()];
    let mut room = fragments_at_once;
    for (brick, d) in (0u32..).zip(drawn) {
        let mut begin = d.instances.start;
        while begin < d.instances.end {
            let fit = (room / d.fragments.max(1.0)).max(1.0) as u32;
            let end = begin.saturating_add(fit).min(d.instances.end);
            let last = batches.len() - 1;
            batches[last].push((brick, begin..end));
            room -= f64::from(end - begin) * d.fragments;
            begin = end;
            if room < d.fragments {
                batches.push(Vec::new());
                room = fragments_at_once;
            }
        }
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_have_every_slice_once_and_in_order() {
        let drawn: Vec<DrawnBox> = [(0..5, 10.0), (3..3, 10.0), (2..100, 1000.0), (0..40, 3.0), (7..9, 1e9)]
            .map(|(instances, fragments)| DrawnBox { instances, fragments })
            .into();
        for at_once in [1.0, 50.0, 4000.0, 1e12] {
            let all: Vec<(u32, u32)> = batches(&drawn, at_once)
                .iter()
                .flatten()
                .flat_map(|(brick, instances)| instances.clone().map(|i| (*brick, i)))
                .collect();
            let expected: Vec<(u32, u32)> =
                (0u32..).zip(&drawn).flat_map(|(b, d)| d.instances.clone().map(move |i| (b, i))).collect();
            assert_eq!(all, expected);
        }
    }
}
