//! The reference renderer, in threads of its own.

use cutaway_core::reference::{self, Statistics};
use cutaway_core::scene::{Data, Scene};

use super::Start;
use crate::abilities::{ALL_MODES, Abilities};
use crate::engine::{AnyEngine, Engine, Ready, Slot};
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Picture, Rendered};
use crate::request::Request;
use crate::setting::Setting;

const ABILITIES: Abilities = Abilities {
    name: "reference",
    modes: ALL_MODES,
    depth: ALL_MODES,
    volumes: true,
    grids: false,
    on_device: false,
    debug: &[],
    settings: &[(Setting::ProcessorEvents, ALL_MODES)],
};

#[derive(Debug)]
struct Reference {
    pool: rayon::ThreadPool,
}

pub(super) fn start(start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    let threads = start.setup.threads;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| EngineError::Threads { threads, reason: e.to_string() })?;
    Ok(Box::new(Slot::new(Reference { pool })))
}

impl Engine for Reference {
    type Prepared = ();
    type Classified = ();

    fn abilities(&self) -> Abilities {
        ABILITIES
    }

    fn machine(&self) -> Machine {
        Machine { threads: self.pool.current_num_threads(), ..Machine::default() }
    }

    fn prepare(&self, _data: &Data) -> Result<(), EngineError> {
        Ok(())
    }

    fn classify(&self, _prepared: &(), _scene: &Scene) -> Result<(), EngineError> {
        Ok(())
    }

    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError> {
        let render = || reference::render_with_progress(ready.scene(), request.progress);
        let (image, counts) = self.pool.install(render);
        Ok(Rendered { picture: Picture::Image(image), statistics: counts.into() })
    }
}

impl From<Statistics> for FrameStatistics {
    fn from(s: Statistics) -> Self {
        let (rays, segments, repaired_lines) = (Some(s.rays), Some(s.segments), Some(s.repaired));
        Self { rays, segments, repaired_lines, ..Self::default() }
    }
}
