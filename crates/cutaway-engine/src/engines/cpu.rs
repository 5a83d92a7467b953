//! The CPU ray caster.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use cutaway_core::scene::{Data, Mode, Scene};
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, Statistics};

use super::Start;
use crate::abilities::{ALL_MODES, Abilities, COMPOSITE};
use crate::engine::{AnyEngine, Engine, HandOver, Ready, Slot};
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Picture, Rendered};
use crate::refine::{Pace, Partial, Refinement};
use crate::request::Request;
use crate::setting::Setting;

/// Largest distance in pixels between the rays of a first image: what is coarser looks broken.
const FIRST_SPACING: u32 = 8;

/// The share of the first image's budget that is left for casting: making an image and showing it take the rest.
const CASTING_SHARE: f64 = 0.3;

const NOT_ISO: &[Mode] = &[Mode::Composite, Mode::Mip, Mode::Minip, Mode::Mean];

const ABILITIES: Abilities = Abilities {
    name: "cpu",
    modes: ALL_MODES,
    depth: ALL_MODES,
    volumes: true,
    grids: false,
    on_device: false,
    debug: &[],
    settings: &[
        (Setting::Step, NOT_ISO),
        (Setting::EarlyTermination, &[Mode::Composite, Mode::Iso]),
        (Setting::SpaceSkipping, ALL_MODES),
        (Setting::InterpolationFactor, ALL_MODES),
        (Setting::AdaptiveInterpolation, ALL_MODES),
        (Setting::ObjectSampling, COMPOSITE),
        (Setting::AdaptiveThreshold, COMPOSITE),
        (Setting::PreIntegration, COMPOSITE),
        (Setting::Gradient, COMPOSITE),
        (Setting::Layout, ALL_MODES),
        (Setting::ProcessorEvents, ALL_MODES),
    ],
};

#[derive(Debug)]
struct Cpu {
    renderer: CpuRenderer,
}

pub(super) fn start(start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    let renderer = CpuRenderer::new(start.setup.threads, start.setup.simd)?;
    Ok(Box::new(Slot::new(Cpu { renderer })))
}

impl Engine for Cpu {
    type Prepared = CpuVolume;
    type Classified = Classification;

    fn abilities(&self) -> Abilities {
        ABILITIES
    }

    fn machine(&self) -> Machine {
        let (simd, threads) = (Some(self.renderer.simd()), self.renderer.threads());
        Machine { adapter: None, simd, threads }
    }

    fn prepare(&self, data: &Data) -> Result<CpuVolume, EngineError> {
        Ok(self.renderer.prepare(data.lattice())?)
    }

    fn classify(&self, prepared: &CpuVolume, scene: &Scene) -> Result<Classification, EngineError> {
        Ok(self.renderer.classify(prepared, scene))
    }

    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError> {
        let (prepared, classified) = (ready.prepared(), ready.classified());
        let (image, counts) = self.renderer.render(prepared, classified, ready.scene(), request.progress);
        Ok(Rendered { picture: Picture::Image(image), statistics: counts.into() })
    }

    fn refine(
        &self,
        ready: Ready<'_, Self>,
        refinement: &Refinement,
        _pace: &mut Pace,
        hand_over: &mut HandOver,
    ) -> Result<(), EngineError> {
        let mut progressive = self.renderer.progressive(ready.prepared(), ready.classified(), ready.scene());
        // The first image is made whatever else is wanted: a picture that moves is better coarse than never.
        let never = AtomicBool::new(false);
        let budget: Duration = refinement.first.mul_f64(CASTING_SHARE);
        let mut step = progressive.advance(budget, &never);
        if step.spacing > FIRST_SPACING {
            step = progressive.advance(budget, &never);
        }
        let mut stood = false;
        loop {
            let partial = Partial {
                picture: Picture::Image(progressive.image()),
                spacing: if step.done { 1 } else { step.spacing.max(2) },
                statistics: progressive.statistics().into(),
            };
            if hand_over(partial).is_break() {
                return Err(EngineError::Cancelled);
            }
            if step.done {
                return Ok(());
            }
            if !std::mem::replace(&mut stood, true) {
                refinement.stand()?;
            }
            step = progressive.advance(refinement.between, refinement.overtaken);
            if step.cancelled || refinement.is_overtaken() {
                return Err(EngineError::Cancelled);
            }
        }
    }
}

impl From<Statistics> for FrameStatistics {
    fn from(s: Statistics) -> Self {
        Self {
            samples: Some(s.samples),
            rays: Some(s.rays),
            segments: Some(s.segments),
            repaired_lines: Some(s.repaired),
            skipped_fraction: Some(s.skipped_fraction),
            ..Self::default()
        }
    }
}
