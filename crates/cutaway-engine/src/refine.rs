//! Refining: a coarse image within a budget of time, then finer ones until one is whole.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::clock::{self, Moment};
use crate::engine::{Engine, HandOver, Ready};
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Picture};
use crate::request::{DebugView, Request};

/// How a picture is refined.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// Time that the first image may take, while something moves.
    pub first: Duration,
    /// Time between images after the first.
    pub between: Duration,
    /// Time that the first image stands before it is refined.
    pub stand: Duration,
    /// A flag that is set once a newer picture is wanted: what is in hand ends, but never before the first image.
    pub overtaken: &'a AtomicBool,
    /// The view of the engine's work.
    pub debug: DebugView,
    /// If true, images stay on a shared device where the engine can leave them there.
    pub on_device: bool,
}

impl Refinement<'_> {
    /// Returns true once a newer picture is wanted.
    pub fn is_overtaken(&self) -> bool {
        self.overtaken.load(Ordering::Relaxed)
    }

    /// Lets the first image stand for a while.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`] once a newer picture is wanted.
    pub fn stand(&self) -> Result<(), EngineError> {
        if clock::wait(self.stand, || self.is_overtaken()) { Err(EngineError::Cancelled) } else { Ok(()) }
    }
}

/// An image on the way to the whole one.
#[derive(Clone, Debug)]
pub struct Partial {
    /// The image; smaller than asked for where the engine renders smaller images.
    pub picture: Picture,
    /// Largest distance in pixels between rays; 1: whole.
    pub spacing: u32,
    /// Counts so far.
    pub statistics: FrameStatistics,
}

/// The speed of an engine, from which the size of a first image follows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// Seconds per pixel, the newest counting half.
    seconds_per_pixel: Option<f64>,
}

/// Factors that are tried, finest first.
const FACTORS: [u32; 6] = [1, 2, 3, 4, 6, 8];

/// The factor of the first image that an engine makes.
const UNKNOWN: u32 = 4;

impl Pace {
    /// Notes the time that an image of this size took.
    pub fn note(&mut self, size: [u32; 2], took: Duration) {
        let newest = took.as_secs_f64() / (f64::from(size[0]) * f64::from(size[1])).max(1.0);
        self.seconds_per_pixel =
            Some(self.seconds_per_pixel.map_or(newest, |before| 0.5 * (before + newest)));
    }

    /// Returns the smallest factor with which an image of `size` takes no longer than `budget`.
    pub fn factor(&self, size: [u32; 2], budget: Duration) -> u32 {
        let Some(pace) = self.seconds_per_pixel else { return UNKNOWN };
        let fits = |factor: &u32| {
            let [w, h] = reduced(size, *factor);
            f64::from(w) * f64::from(h) * pace <= budget.as_secs_f64()
        };
        FACTORS.into_iter().find(fits).unwrap_or(FACTORS[FACTORS.len() - 1])
    }
}

/// The size of an image that is `factor` times smaller along each side.
fn reduced(size: [u32; 2], factor: u32) -> [u32; 2] {
    size.map(|side| side.div_ceil(factor).max(1))
}

/// A smaller image first, unless a whole one comes in time; then sizes doubled until it is whole.
pub(crate) fn coarse_then_whole<E: Engine + ?Sized>(
    engine: &E,
    ready: Ready<'_, E>,
    refinement: &Refinement,
    pace: &mut Pace,
    hand_over: &mut HandOver,
) -> Result<(), EngineError> {
    let size = ready.scene().settings().resolution;
    let first = pace.factor(size, refinement.first);
    // Each step costs a quarter of the next.
    let mut factors = vec![first];
    while let Some(&last) = factors.last()
        && last > 1
    {
        factors.push(if last > 4 { last / 2 } else { 1 });
    }
    for factor in factors {
        let size = reduced(size, factor);
        let scene = ready.scene().resized(size)?;
        let request = Request {
            debug: refinement.debug,
            on_device: refinement.on_device,
            // The first image is made whatever else is wanted: a picture that moves is better coarse than never.
            cancel: (factor == 1).then_some(refinement.overtaken),
            ..Request::default()
        };
        let began = Moment::now();
        let rendered = engine.render(ready.at(&scene), &request)?;
        pace.note(size, began.elapsed());
        let partial = Partial { picture: rendered.picture, spacing: factor, statistics: rendered.statistics };
        if hand_over(partial) == ControlFlow::Break(()) {
            return Err(EngineError::Cancelled);
        }
        if factor == first && first > 1 {
            refinement.stand()?;
        }
        if factor > 1 && refinement.is_overtaken() {
            return Err(EngineError::Cancelled);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slower_engines_get_smaller_images() {
        let mut pace = Pace::default();
        let budget = Duration::from_millis(33);
        assert_eq!(pace.factor([800, 600], budget), UNKNOWN);
        pace.note([800, 600], Duration::from_millis(20));
        assert_eq!(pace.factor([800, 600], budget), 1);
        (0..20).for_each(|_| pace.note([800, 600], Duration::from_millis(500)));
        let factor = pace.factor([800, 600], budget);
        assert_eq!(factor, 4);
        (0..20).for_each(|_| pace.note([800, 600], Duration::from_secs(500)));
        assert_eq!(pace.factor([800, 600], budget), 8);
    }
}
