//! The GPU ray caster (Termeer 4.2): a ray a pixel, in a fragment shader.
//!
//! Enters: a prepared volume, its classification and a scene. Leaves: an image with depth, and what it took. A frame goes to
//! the device in tiles small enough that none takes long (100 ms is the aim), so that no driver's watchdog bites.

mod notices;
mod pipelines;

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::volume::Volume;

use crate::classification::GpuClassification;
use crate::clipping::{ClipLayer, ClipStatistics, Clipping, PeelSettings};
use crate::context::{Gpu, Stopwatch};
use crate::error::GpuError;
pub use crate::frame::PreparedVolume;
use crate::frame::{
    FORMATS, FetchCounts, Finished, Finisher, FrameUniforms, GpuDirections, Inputs, Lattice, Pending,
    Progress, ShownFrame, Taken, Targets, cost_of_step, tiles,
};
use crate::geometry::{GeometryPipelines, OpaqueGeometry, OpaquePart};
use crate::proxy::{
    Flavour, ProxyCounts, ProxyGeometry, ProxyOptions, ProxyPipelines, RangeInputs, RangeTargets,
    draw_wireframe,
};
use crate::ranges::BlockPipelines;
pub use notices::notices;
#[cfg(test)]
pub(crate) use pipelines::SHADER;
use pipelines::{Pipelines, Variant};

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RaycastStatistics {
    /// Rays that met something.
    pub rays: u64,
    /// Values of the field that were taken: texture fetches, where the adapter filters; cells looked at, for isosurfaces.
    pub samples: u64,
    /// Stretches of occupied blocks.
    pub segments: u64,
    /// Bytes on the device: volume, ranges of blocks, tables, targets, clip.
    pub gpu_bytes: u64,
    /// The share of samples within the volume that were not taken: empty, or behind opaque ones; 0..=1. Isosurfaces have no
    /// samples to skip: 0.
    pub skipped_fraction: f64,
    /// What clipping took; nothing where there is none.
    pub clip: ClipStatistics,
    /// Milliseconds from the first to the last tile's end on the device's own clock, without what comes before (proxy,
    /// clipping) and after (reading back); none where it has no timestamps.
    pub gpu_ms: Option<f64>,
}

impl RaycastStatistics {
    /// With what is known once a frame is there.
    fn completed(self, taken: Taken, gpu_ms: Option<f64>) -> Self {
        Self {
            rays: taken.rays,
            samples: taken.samples,
            segments: taken.stretches,
            skipped_fraction: taken.skipped_fraction,
            gpu_ms,
            ..self
        }
    }
}

/// Pipelines on a device.
#[derive(Debug)]
pub struct RaycastRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    blocks: BlockPipelines,
    targets: Mutex<Option<Targets>>,
    finisher: Finisher,
    clip: Mutex<Clipping>,
    proxy: ProxyPipelines,
    proxy_options: ProxyOptions,
    ranges: Mutex<Option<RangeTargets>>,
    geometry: GeometryPipelines,
    stopwatch: Option<Stopwatch>,
}

/// What is drawn besides the volume.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extras<'a> {
    /// Opaque geometry, which ends rays; the image lies over it. Of the image's size.
    pub geometry: Option<&'a OpaqueGeometry>,
    /// Straight RGB, 0..=1, of the proxy geometry's edges, which are drawn where the image does not hide them.
    pub wireframe: Option<[f32; 3]>,
    /// Once it is set, the frame ends between two tiles, as [`GpuError::Cancelled`].
    pub cancel: Option<&'a AtomicBool>,
}

/// What a frame took before it is read or shown.
struct Drawn {
    gpu_bytes: u64,
    clip: ClipStatistics,
}

impl RaycastRenderer {
    /// Makes what all frames share.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let pipelines = Pipelines::new(gpu)?;
        let proxy = ProxyPipelines::new(gpu, FORMATS[0])?;
        let geometry = GeometryPipelines::new(gpu)?;
        let proxy_options = ProxyOptions::default();
        let (targets, ranges, clip) = (Mutex::new(None), Mutex::new(None), Mutex::default());
        let blocks = BlockPipelines::new(gpu)?;
        let finisher = Finisher::new(gpu)?;
        let stopwatch = Stopwatch::new(gpu)?;
        Ok(Self {
            gpu: gpu.clone(),
            pipelines,
            blocks,
            targets,
            finisher,
            clip,
            proxy,
            proxy_options,
            ranges,
            geometry,
            stopwatch,
        })
    }

    /// The same with other proxy geometry.
    #[must_use]
    pub fn with_proxy_options(mut self, options: ProxyOptions) -> Self {
        self.proxy_options = options;
        self
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes a volume ready: uploads it, and finds the ranges of its blocks.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedVolume, GpuError> {
        PreparedVolume::new(&self.gpu, &self.blocks, volume)
    }

    /// Classifies a prepared volume for a scene.
    pub fn classify(&self, volume: &PreparedVolume, scene: &Scene) -> Result<GpuClassification, GpuError> {
        let scene = &*scene.normalised();
        GpuClassification::new(&self.gpu, &self.blocks, volume.ranges(), volume.voxels(), scene)
    }

    /// How far the meshes of clips are peeled, where a scene's `clip_events` say so.
    pub fn set_peeling(&self, settings: PeelSettings) {
        self.clip.lock().unwrap_or_else(std::sync::PoisonError::into_inner).peel_settings = settings;
    }

    /// The layers that the frame rendered last was peeled into, which was one of this scene; none where it was not peeled.
    pub fn peeled_layers(&self, scene: &Scene) -> Result<Vec<ClipLayer>, GpuError> {
        self.clip
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .layers(&self.gpu, &scene.normalised())
    }

    /// Renders a frame of a scene with a classification made for it. `progress` is called with the finished share of the
    /// image, 0..=1.
    pub fn render(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, RaycastStatistics), GpuError> {
        self.render_with(volume, classification, scene, &Extras::default(), progress)
    }

    /// As [`Self::render`], with what is drawn besides the volume.
    pub fn render_with(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        extras: &Extras,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, RaycastStatistics), GpuError> {
        self.submit(volume, classification, scene, extras, progress)?.outcome()
    }

    /// The first half of [`Self::render_with`]: hands a frame to the device and does not wait for it.
    pub fn submit(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        extras: &Extras,
        progress: &dyn Fn(f32),
    ) -> Result<Pending<RaycastStatistics>, GpuError> {
        self.drawn(volume, classification, scene, extras, progress, |finished, drawn| {
            let time = self.stopwatch.as_ref().map(|watch| watch.submit(&self.gpu)).transpose()?;
            let statistics = RaycastStatistics {
                gpu_bytes: drawn.gpu_bytes,
                clip: drawn.clip,
                ..RaycastStatistics::default()
            };
            let pending = Pending::new(&self.gpu, finished, time, statistics, RaycastStatistics::completed)?;
            Ok(pending.with_depth_unit(scene.normalised().space().unit))
        })
    }

    /// Renders a frame as [`Self::render`] does, for what each ray of it took, and all of them.
    pub fn fetch_counts(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(FetchCounts, RaycastStatistics), GpuError> {
        let pending = self.submit(volume, classification, scene, &Extras::default(), progress)?;
        let (_, fetches, statistics) = pending.all()?;
        Ok((fetches, statistics))
    }

    /// Renders a frame as [`Self::render_with`] does, for a window drawn with the same device: nothing is copied to the
    /// host. Returns when it is there.
    pub fn show(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        extras: &Extras,
    ) -> Result<ShownFrame, GpuError> {
        self.drawn(volume, classification, scene, extras, &|_| {}, |finished, drawn| {
            self.finisher.show(&self.gpu, finished, drawn.gpu_bytes)
        })
    }

    /// Draws a frame, for `take` to do something with it.
    fn drawn<T>(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        extras: &Extras,
        progress: &dyn Fn(f32),
        take: impl FnOnce(&Finished, &Drawn) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let scene = &*scene.normalised();
        debug_assert!(volume.voxels().is_of(scene));
        let resolution = Lattice::of(scene).size;
        let mut kept = self.targets.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let targets = match kept.take() {
            Some(targets) if targets.size() == resolution => targets,
            _ => Targets::new(&self.gpu, resolution)?,
        };
        let frame = FrameUniforms::new(scene, volume.voxels(), classification, resolution);
        if let Some(geometry) = extras.geometry.filter(|geometry| geometry.size() != resolution) {
            return Err(GpuError::GeometrySize { expected: resolution, found: geometry.size() });
        }
        let opaque = extras.geometry.map(OpaqueGeometry::distances);
        let proxy = self.proxy_of(classification, scene)?;
        let found = RangeInputs { scene, frame: &frame, proxy: proxy.as_deref(), opaque };
        let ranges = self.ranges(&found)?;
        let range = ranges.as_ref().map(RangeTargets::range);
        let mut clipping = self.clip.lock().unwrap_or_else(PoisonError::into_inner);
        let clip = match scene.clip() {
            Some(clip) => clipping.update(&self.gpu, clip, scene, &frame)?,
            None => ClipStatistics::default(),
        };
        let segments = clipping.segments().filter(|_| scene.clip().is_some());
        let directions = volume.directions(&self.gpu, scene)?;
        let inputs = Inputs {
            volume: volume.voxels(),
            classification,
            blocks: volume.ranges(),
            range,
            directions,
            segments,
        };
        self.draw(&inputs, scene, &frame, &targets, &Progress::new(progress, extras.cancel))?;
        self.draw_extras(&found, extras, &targets)?;
        let finished = self.finisher.finish(&self.gpu, scene, &targets)?;
        let gpu_bytes = volume.voxels().bytes()
            + volume.ranges().bytes()
            + classification.bytes()
            + targets.bytes()
            + finished.bytes
            + directions.map_or(0, GpuDirections::bytes)
            + clipping.bytes()
            + proxy.map_or(0, |proxy| proxy.bytes())
            + ranges.as_ref().map_or(0, RangeTargets::bytes);
        let taken = take(&finished, &Drawn { gpu_bytes, clip })?;
        *self.ranges.lock().unwrap_or_else(PoisonError::into_inner) = ranges;
        *kept = Some(targets);
        Ok(taken)
    }

    /// Draws meshes as the camera of a scene sees them, for [`Self::render_with`].
    pub fn draw_geometry(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        parts: &[OpaquePart],
    ) -> Result<OpaqueGeometry, GpuError> {
        let scene = &*scene.normalised();
        let frame = FrameUniforms::new(scene, volume.voxels(), classification, scene.settings().resolution);
        self.geometry.draw(&self.gpu, scene, &frame, parts)
    }

    /// How many quads the proxy geometry of a scene has, which is read back for this; none: it has no proxy.
    pub fn proxy_counts(
        &self,
        classification: &GpuClassification,
        scene: &Scene,
    ) -> Result<Option<ProxyCounts>, GpuError> {
        self.proxy_of(classification, &scene.normalised())?.map(|proxy| proxy.counts(&self.gpu)).transpose()
    }

    fn proxy_of(
        &self,
        classification: &GpuClassification,
        scene: &Scene,
    ) -> Result<Option<Arc<ProxyGeometry>>, GpuError> {
        Flavour::of(scene)
            .map(|flavour| classification.proxy(&self.gpu, &self.proxy, flavour, &self.proxy_options))
            .transpose()
    }

    /// Where rays begin and end; none: at the volume's box.
    fn ranges(&self, inputs: &RangeInputs) -> Result<Option<RangeTargets>, GpuError> {
        if inputs.proxy.is_none() && inputs.opaque.is_none() {
            return Ok(None);
        }
        let kept = self.ranges.lock().unwrap_or_else(PoisonError::into_inner).take();
        let ranges = match kept.filter(|ranges| ranges.size() == inputs.frame.resolution) {
            Some(ranges) => ranges,
            None => RangeTargets::new(&self.gpu, &self.proxy, inputs.frame.resolution)?,
        };
        ranges.fill(&self.gpu, &self.proxy, inputs)?;
        Ok(Some(ranges))
    }

    fn draw_extras(&self, inputs: &RangeInputs, extras: &Extras, targets: &Targets) -> Result<(), GpuError> {
        let (views, textures) = (targets.views(), targets.textures());
        if let Some(geometry) = extras.geometry {
            let (textures, views) = ([&textures[0], &textures[1]], [&views[0], &views[1]]);
            self.geometry.put_over(&self.gpu, geometry, textures, views)?;
        }
        if let Some(color) = extras.wireframe {
            draw_wireframe(&self.gpu, &self.proxy, inputs, color, [&views[0], &views[1]])?;
        }
        Ok(())
    }

    /// Draws a frame into targets, tile by tile.
    fn draw(
        &self,
        inputs: &Inputs,
        scene: &Scene,
        frame: &FrameUniforms,
        targets: &Targets,
        progress: &Progress,
    ) -> Result<(), GpuError> {
        progress.check()?;
        let variant = Variant::of(scene, inputs, self.gpu.capabilities(), self.proxy_options.image_order);
        let pipeline = self.pipelines.get(&self.gpu, variant)?;
        // Until all tiles are submitted no other scene may change which bricks are there.
        let resident = inputs.volume.resident(&self.gpu, scene.volume(), inputs.classification.wanted())?;
        let groups = self.gpu.checked("a frame's inputs", || {
            self.pipelines.bindings().bind(&self.gpu, inputs, &resident, frame)
        })?;
        let tiles =
            tiles(targets.size(), most_steps(scene) * cost_of_step(scene), self.gpu.adapter().software);
        for (i, tile) in tiles.iter().enumerate() {
            self.gpu.checked("drawing a tile", || {
                let mut encoder =
                    self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let (first, last) = (i == 0, i + 1 == tiles.len());
                    let writes = self.stopwatch.as_ref().and_then(|watch| watch.writes(first, last));
                    let mut pass = targets.pass(&mut encoder, first, writes);
                    pass.set_pipeline(&pipeline);
                    pass.set_bind_group(0, &groups[0], &[]);
                    pass.set_bind_group(1, &groups[1], &[]);
                    pass.set_bind_group(2, &groups[2], &[]);
                    pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
                    pass.draw(0..3, 0..1);
                }
                self.gpu.queue().submit([encoder.finish()]);
            })?;
            progress.advance(&self.gpu, (i + 1) as f32 / tiles.len() as f32)?;
        }
        Ok(())
    }
}

/// Steps of a ray through the whole volume, from corner to corner.
fn most_steps(scene: &Scene) -> f64 {
    let corners = scene.volume().corners_in_world();
    let diagonal = (0..4).map(|c| corners[c].distance(corners[7 - c])).fold(0.0, f64::max);
    diagonal / scene.step_length()
}
