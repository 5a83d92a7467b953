//! The cell renderer, for volumes and unstructured grids.

use cutaway_core::scene::{Data, Mode, Scene};
use cutaway_gpu::cells::{CellClassification, PreparedCells};
use cutaway_gpu::{CellRenderer, CellStatistics};

use super::{data_notices, machine, rendered};
use crate::abilities::{Abilities, COMPOSITE};
use crate::engine::{AnyEngine, Engine, Ready, Slot};
use crate::engines::Start;
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Rendered};
use crate::notice::Notice;
use crate::request::Request;
use crate::setting::Setting;

/// Fragments are blended back to front, and none knows what is in front of it: images have no depth.
const NO_DEPTH: &[Mode] = &[];

const ABILITIES: Abilities = Abilities {
    name: "cells",
    modes: COMPOSITE,
    depth: NO_DEPTH,
    volumes: true,
    grids: true,
    on_device: true,
    debug: &[],
    settings: &[
        (Setting::InterpolationFactor, COMPOSITE),
        (Setting::DeviceEvents, COMPOSITE),
        (Setting::BufferDepth, COMPOSITE),
    ],
};

#[derive(Debug)]
struct Cells {
    renderer: CellRenderer,
}

pub(in crate::engines) fn start(start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    let gpu = start.gpu()?;
    Ok(Box::new(Slot::new(Cells { renderer: CellRenderer::new(&gpu, start.setup.cells)? })))
}

impl Engine for Cells {
    type Prepared = PreparedCells;
    type Classified = CellClassification;

    fn abilities(&self) -> Abilities {
        ABILITIES
    }

    fn machine(&self) -> Machine {
        machine(self.renderer.gpu())
    }

    fn prepare(&self, data: &Data) -> Result<PreparedCells, EngineError> {
        Ok(match data.grid() {
            Some(grid) => self.renderer.prepare_mesh(grid)?,
            None => self.renderer.prepare(data.lattice())?,
        })
    }

    fn classify(&self, prepared: &PreparedCells, scene: &Scene) -> Result<CellClassification, EngineError> {
        Ok(self.renderer.classify(prepared, scene)?)
    }

    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError> {
        let (cells, classification) = (ready.prepared(), ready.classified());
        rendered(
            (ready, request),
            |(ready, request)| self.renderer.show(cells, classification, ready.scene(), request.cancel),
            |(ready, request)| {
                let (scene, Request { cancel, progress, .. }) = (ready.scene(), *request);
                self.renderer.render_with(cells, classification, scene, cancel, progress)
            },
        )
    }

    fn notices(&self, prepared: &PreparedCells) -> Vec<Notice> {
        data_notices(&prepared.notices())
    }
}

impl From<CellStatistics> for FrameStatistics {
    fn from(s: CellStatistics) -> Self {
        Self {
            repaired_lines: Some(s.clip.repaired),
            clip_ms: Some(s.clip.milliseconds),
            gpu_bytes: Some(s.gpu_bytes),
            primitives: Some(s.drawn),
            ..Self::default()
        }
    }
}
