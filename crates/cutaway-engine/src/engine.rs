//! The trait that every engine implements, and the slot that keeps what was prepared for it.

use std::fmt::Debug;
use std::ops::ControlFlow;

use cutaway_core::scene::{Data, Scene};

use crate::abilities::Abilities;
use crate::clock::Moment;
use crate::error::EngineError;
use crate::frame::{Machine, Rendered};
use crate::key::{ClassifyKey, PrepareKey};
use crate::notice::Notice;
use crate::refine::{Pace, Partial, Refinement, coarse_then_whole};
use crate::request::Request;

/// An engine. Its preparation and classification are types of its own, so that no other engine can be handed them.
pub trait Engine: Debug {
    /// Data made ready; depends on the data alone.
    type Prepared: Debug;
    /// A transfer function made ready for prepared data.
    type Classified: Debug;

    /// Returns what the engine can do.
    fn abilities(&self) -> Abilities;

    /// Returns the machine that it runs on.
    fn machine(&self) -> Machine;

    /// Makes data ready.
    ///
    /// # Errors
    /// Data that do not fit.
    fn prepare(&self, data: &Data) -> Result<Self::Prepared, EngineError>;

    /// Classifies prepared data for the transfer function, mode and step of a scene.
    ///
    /// # Errors
    /// A device that fails.
    fn classify(&self, prepared: &Self::Prepared, scene: &Scene) -> Result<Self::Classified, EngineError>;

    /// Renders a whole frame.
    ///
    /// # Errors
    /// A frame that was cancelled, or a device that fails.
    fn render(&self, ready: Ready<'_, Self>, request: &Request) -> Result<Rendered, EngineError>;

    /// Returns what was substituted so that the data fit.
    fn notices(&self, _prepared: &Self::Prepared) -> Vec<Notice> {
        Vec::new()
    }

    /// Renders coarse images first and finer ones after, until one is whole. The default renders smaller images.
    ///
    /// # Errors
    /// As [`Self::render`].
    fn refine(
        &self,
        ready: Ready<'_, Self>,
        refinement: &Refinement,
        pace: &mut Pace,
        hand_over: &mut HandOver,
    ) -> Result<(), EngineError> {
        coarse_then_whole(self, ready, refinement, pace, hand_over)
    }
}

/// A function that takes a partial frame and says whether to go on.
pub type HandOver<'a> = dyn FnMut(Partial) -> ControlFlow<()> + 'a;

/// A scene with the preparation and the classification that were made for it, and for nothing else: only a [`Renderer`]
/// makes one, after it has compared their keys with the scene's.
///
/// [`Renderer`]: crate::Renderer
#[derive(Debug)]
pub struct Ready<'a, E: Engine + ?Sized> {
    prepared: &'a E::Prepared,
    classified: &'a E::Classified,
    scene: &'a Scene,
}

impl<E: Engine + ?Sized> Clone for Ready<'_, E> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<E: Engine + ?Sized> Copy for Ready<'_, E> {}

impl<'a, E: Engine + ?Sized> Ready<'a, E> {
    /// The data made ready.
    pub fn prepared(&self) -> &'a E::Prepared {
        self.prepared
    }

    /// The transfer function made ready.
    pub fn classified(&self) -> &'a E::Classified {
        self.classified
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The same for the same scene at another resolution, on which no preparation depends.
    pub(crate) fn at<'b>(&self, scene: &'b Scene) -> Ready<'b, E>
    where
        'a: 'b,
    {
        Ready { prepared: self.prepared, classified: self.classified, scene }
    }
}

/// Milliseconds of making a scene ready.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadyTimes {
    /// Of preparing data; 0 where they were ready.
    pub prepare_ms: f64,
    /// Of classifying; 0 where nothing had changed.
    pub classify_ms: f64,
}

/// An engine with what it has ready, whatever its types: implemented by [`Slot`] alone.
pub trait AnyEngine: Debug {
    /// See [`Engine::abilities`].
    fn abilities(&self) -> Abilities;
    /// See [`Engine::machine`].
    fn machine(&self) -> Machine;
    /// Prepares and classifies what has changed.
    ///
    /// # Errors
    /// As [`Engine::prepare`] and [`Engine::classify`].
    fn make_ready(&mut self, scene: &Scene) -> Result<ReadyTimes, EngineError>;
    /// Notices about the prepared data.
    fn data_notices(&self) -> Vec<Notice>;
    /// Renders a whole frame of a scene, which it makes ready first.
    ///
    /// # Errors
    /// As [`Engine::render`].
    fn render(&mut self, scene: &Scene, request: &Request) -> Result<Rendered, EngineError>;
    /// Renders coarse images of a scene first and finer ones after.
    ///
    /// # Errors
    /// As [`Engine::refine`].
    fn refine(
        &mut self,
        scene: &Scene,
        refinement: &Refinement,
        hand_over: &mut HandOver,
    ) -> Result<(), EngineError>;
}

/// An engine, the data that it has ready and the transfer function that it has classified.
#[derive(Debug)]
pub struct Slot<E: Engine> {
    engine: E,
    prepared: Option<(PrepareKey, E::Prepared)>,
    classified: Option<(ClassifyKey, E::Classified)>,
    pace: Pace,
}

impl<E: Engine> Slot<E> {
    /// Returns a slot with nothing ready.
    pub fn new(engine: E) -> Self {
        Self { engine, prepared: None, classified: None, pace: Pace::default() }
    }

    fn ready<'a>(&'a mut self, scene: &'a Scene) -> Result<(&'a E, Ready<'a, E>, &'a mut Pace), EngineError> {
        self.make_ready(scene)?;
        let (Some((_, prepared)), Some((_, classified))) = (&self.prepared, &self.classified) else {
            unreachable!("`make_ready` fills both or returns an error");
        };
        Ok((&self.engine, Ready { prepared, classified, scene }, &mut self.pace))
    }
}

impl<E: Engine> AnyEngine for Slot<E> {
    fn abilities(&self) -> Abilities {
        self.engine.abilities()
    }

    fn machine(&self) -> Machine {
        self.engine.machine()
    }

    fn make_ready(&mut self, scene: &Scene) -> Result<ReadyTimes, EngineError> {
        let mut times = ReadyTimes::default();
        if !self.prepared.as_ref().is_some_and(|(key, _)| key.serves(scene)) {
            // Two volumes at once are more than may fit.
            self.classified = None;
            self.prepared = None;
            let started = Moment::now();
            self.prepared = Some((PrepareKey::of(scene), self.engine.prepare(scene.data())?));
            times.prepare_ms = started.milliseconds();
        }
        let key = ClassifyKey::of(scene);
        if let Some((_, prepared)) = &self.prepared
            && !self.classified.as_ref().is_some_and(|(old, _)| *old == key)
        {
            let started = Moment::now();
            self.classified = Some((key, self.engine.classify(prepared, scene)?));
            times.classify_ms = started.milliseconds();
        }
        Ok(times)
    }

    fn data_notices(&self) -> Vec<Notice> {
        self.prepared.as_ref().map_or_else(Vec::new, |(_, prepared)| self.engine.notices(prepared))
    }

    fn render(&mut self, scene: &Scene, request: &Request) -> Result<Rendered, EngineError> {
        let (engine, ready, _) = self.ready(scene)?;
        engine.render(ready, request)
    }

    fn refine(
        &mut self,
        scene: &Scene,
        refinement: &Refinement,
        hand_over: &mut HandOver,
    ) -> Result<(), EngineError> {
        let (engine, ready, pace) = self.ready(scene)?;
        engine.refine(ready, refinement, pace, hand_over)
    }
}
