//! A made-up engine: every pixel has one colour.

use cutaway_core::image::Image;
use cutaway_core::scene::{Data, Scene};
use cutaway_engine::{
    ALL_MODES, Abilities, AnyEngine, Engine, EngineError, FrameStatistics, Machine, Picture, Ready, Rendered,
    Request, Slot, Start,
};

/// The colour, premultiplied.
pub(crate) const COLOR: [f32; 4] = [0.25, 0.5, 0.125, 0.5];

#[derive(Debug)]
struct Flat;

pub(crate) fn start(_start: &mut Start) -> Result<Box<dyn AnyEngine>, EngineError> {
    Ok(Box::new(Slot::new(Flat)))
}

impl Engine for Flat {
    type Prepared = [f32; 4];
    type Classified = ();

    fn abilities(&self) -> Abilities {
        Abilities {
            name: "flat",
            modes: ALL_MODES,
            depth: &[],
            volumes: true,
            grids: true,
            on_device: false,
            debug: &[],
            settings: &[],
        }
    }

    fn machine(&self) -> Machine {
        Machine::default()
    }

    fn prepare(&self, _data: &Data) -> Result<[f32; 4], EngineError> {
        Ok(COLOR)
    }

    fn classify(&self, _prepared: &[f32; 4], _scene: &Scene) -> Result<(), EngineError> {
        Ok(())
    }

    fn render(&self, ready: Ready<'_, Self>, _request: &Request) -> Result<Rendered, EngineError> {
        let (width, height) = ready.scene().resolution();
        let image = Image::filled(width, height, *ready.prepared()).map_err(|_| EngineError::Cancelled)?;
        Ok(Rendered { picture: Picture::Image(image), statistics: FrameStatistics::default() })
    }
}
