//! The slice renderer.

use cutaway_core::scene::{Data, Mode, Scene};
use cutaway_gpu::SliceRenderer;
use cutaway_gpu::slices::{PreparedSlices, SliceClassification, SliceStatistics};

use super::{data_notices, machine, rendered};
use crate::abilities::{Abilities, COMPOSITE};
use crate::engine::{AnyEngine, Engine, Ready, Slot};
use crate::engines::Start;
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Rendered};
use crate::notice::Notice;
use crate::request::Request;
use crate::setting::Setting;

const MODES: &[Mode] = &[Mode::Composite, Mode::Mip, Mode::Minip, Mode::Mean];

const ABILITIES: Abilities = Abilities {
    name: "slices",
    modes: MODES,
    depth: &[Mode::Composite, Mode::Mean],
    volumes: true,
    grids: false,
    on_device: true,
    debug: &[],
    settings: &[
        (Setting::Step, MODES),
        (Setting::SpaceSkipping, MODES),
        (Setting::InterpolationFactor, MODES),
        (Setting::PreIntegration, COMPOSITE),
        (Setting::Gradient, COMPOSITE),
        (Setting::BrickSize, MODES),
        (Setting::DeviceEvents, MODES),
        (Setting::BufferDepth, MODES),
    ],
};

#[derive(Debug)]
struct Slices {
    renderer: SliceRenderer,
}

pub(in crate::engines) fn start(start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    Ok(Box::new(Slot::new(Slices { renderer: SliceRenderer::new(&start.gpu()?)? })))
}

impl Engine for Slices {
    type Prepared = PreparedSlices;
    type Classified = SliceClassification;

    fn abilities(&self) -> Abilities {
        ABILITIES
    }

    fn machine(&self) -> Machine {
        machine(self.renderer.gpu())
    }

    fn prepare(&self, data: &Data) -> Result<PreparedSlices, EngineError> {
        Ok(self.renderer.prepare(data.lattice())?)
    }

    fn classify(&self, prepared: &PreparedSlices, scene: &Scene) -> Result<SliceClassification, EngineError> {
        Ok(self.renderer.classify(prepared, scene)?)
    }

    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError> {
        let (volume, classification) = (ready.prepared(), ready.classified());
        rendered(
            (ready, request),
            |(ready, request)| self.renderer.show(volume, classification, ready.scene(), request.cancel),
            |(ready, request)| {
                let (scene, Request { cancel, progress, .. }) = (ready.scene(), *request);
                self.renderer.render_with(volume, classification, scene, cancel, progress)
            },
        )
    }

    fn notices(&self, prepared: &PreparedSlices) -> Vec<Notice> {
        let mut notices = data_notices(&prepared.notices());
        if !self.renderer.gpu().capabilities().float_blending {
            let coarse = "this GPU blends 16-bit floats only: colours are off by up to 0.02, means by up to 3 % of their range";
            notices.push(Notice::Data(coarse.to_owned()));
        }
        notices
    }
}

impl From<SliceStatistics> for FrameStatistics {
    fn from(s: SliceStatistics) -> Self {
        Self {
            rays: Some(s.rays),
            repaired_lines: Some(s.clip.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            clip_ms: Some(s.clip.milliseconds),
            gpu_ms: s.gpu_ms,
            gpu_bytes: Some(s.gpu_bytes),
            primitives: Some(s.triangles()),
            ..Self::default()
        }
    }
}
