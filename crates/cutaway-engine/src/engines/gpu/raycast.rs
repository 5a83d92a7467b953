//! The GPU ray caster.

use cutaway_core::scene::{Data, Mode, Scene};
use cutaway_gpu::raycast::PreparedVolume;
use cutaway_gpu::{Extras, GpuClassification, RaycastRenderer, RaycastStatistics};

use super::{data_notices, in_memory, machine, rendered};
use crate::abilities::{ALL_MODES, Abilities, COMPOSITE};
use crate::engine::{AnyEngine, Engine, Ready, Slot};
use crate::engines::Start;
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Rendered};
use crate::notice::Notice;
use crate::request::{DebugView, Request};
use crate::setting::Setting;

/// Straight RGB of the proxy geometry's edges: seen against bone, skin and nothing.
const WIREFRAME: [f32; 3] = [0.1, 0.9, 0.4];

const PROXY_MODES: &[Mode] = &[Mode::Composite, Mode::Iso];

const ABILITIES: Abilities = Abilities {
    name: "raycast",
    modes: ALL_MODES,
    depth: ALL_MODES,
    volumes: true,
    grids: false,
    on_device: true,
    debug: &[DebugView::Fetches, DebugView::Wireframe],
    settings: &[
        (Setting::Step, &[Mode::Composite, Mode::Mip, Mode::Minip, Mode::Mean]),
        (Setting::EarlyTermination, &[Mode::Composite, Mode::Iso]),
        (Setting::SpaceSkipping, ALL_MODES),
        (Setting::ProxyGeometry, PROXY_MODES),
        (Setting::InterpolationFactor, ALL_MODES),
        (Setting::ObjectSampling, COMPOSITE),
        (Setting::AdaptiveThreshold, COMPOSITE),
        (Setting::PreIntegration, COMPOSITE),
        (Setting::Gradient, COMPOSITE),
        (Setting::Jitter, COMPOSITE),
        (Setting::DeviceEvents, ALL_MODES),
        (Setting::BufferDepth, ALL_MODES),
    ],
};

#[derive(Debug)]
struct Raycast {
    renderer: RaycastRenderer,
}

pub(in crate::engines) fn start(start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    Ok(Box::new(Slot::new(Raycast { renderer: RaycastRenderer::new(&start.gpu()?)? })))
}

impl Raycast {
    /// Refuses a wireframe of no proxy geometry.
    fn check_proxy(&self, ready: Ready<'_, Self>) -> Result<(), EngineError> {
        let scene = ready.scene();
        if self.renderer.proxy_counts(ready.classified(), scene)?.is_some() {
            return Ok(());
        }
        let settings = scene.settings();
        let (mode, skipping) = (settings.mode.name(), settings.space_skipping.name());
        Err(EngineError::NoProxy { mode, skipping })
    }
}

impl Engine for Raycast {
    type Prepared = PreparedVolume;
    type Classified = GpuClassification;

    fn abilities(&self) -> Abilities {
        ABILITIES
    }

    fn machine(&self) -> Machine {
        machine(self.renderer.gpu())
    }

    fn prepare(&self, data: &Data) -> Result<PreparedVolume, EngineError> {
        Ok(self.renderer.prepare(data.lattice())?)
    }

    fn classify(&self, prepared: &PreparedVolume, scene: &Scene) -> Result<GpuClassification, EngineError> {
        Ok(self.renderer.classify(prepared, scene)?)
    }

    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError> {
        let (volume, classification) = (ready.prepared(), ready.classified());
        if request.debug == DebugView::Fetches {
            // Counts are turned into colours in memory.
            let counted = self.renderer.fetch_counts(volume, classification, ready.scene(), request.progress);
            return in_memory(counted.map(|(counts, s)| (counts.false_color(counts.most()), s)));
        }
        let wireframe = (request.debug == DebugView::Wireframe).then_some(WIREFRAME);
        if wireframe.is_some() {
            self.check_proxy(ready)?;
        }
        let extras = Extras { wireframe, cancel: request.cancel, ..Extras::default() };
        rendered(
            (ready, request),
            |(ready, _)| self.renderer.show(volume, classification, ready.scene(), &extras),
            |(ready, request)| {
                let scene = ready.scene();
                self.renderer.render_with(volume, classification, scene, &extras, request.progress)
            },
        )
    }

    fn notices(&self, prepared: &PreparedVolume) -> Vec<Notice> {
        data_notices(&prepared.notices())
    }
}

impl From<RaycastStatistics> for FrameStatistics {
    fn from(s: RaycastStatistics) -> Self {
        Self {
            samples: Some(s.samples),
            rays: Some(s.rays),
            segments: Some(s.segments),
            repaired_lines: Some(s.clip.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            clip_ms: Some(s.clip.milliseconds),
            gpu_ms: s.gpu_ms,
            gpu_bytes: Some(s.gpu_bytes),
            ..Self::default()
        }
    }
}
