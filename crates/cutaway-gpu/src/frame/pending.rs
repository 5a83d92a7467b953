//! A frame on its way: submitted, its outcome to be learnt.

use cutaway_core::image::Image;

use super::fetches::FetchCounts;
use super::finish::Finished;
use super::readback::{Read, Reading, Taken};
use crate::context::{Gpu, PendingTime};
use crate::error::GpuError;

/// A frame that was submitted. It does not change any more, whatever is drawn after it; what it was made of may be dropped.
///
/// A place that cannot block asks [`Self::is_there`] now and then, and takes the [`Self::outcome`] once it is.
#[derive(Debug)]
pub struct Pending<S> {
    gpu: Gpu,
    reading: Reading,
    time: Option<PendingTime>,
    /// As far as they are known.
    statistics: S,
    /// Adds what is known only once the frame is there: what its rays took, and milliseconds.
    complete: fn(S, Taken, Option<f64>) -> S,
    /// What depths are multiplied by; none: the image has none.
    depth_unit: Option<f64>,
}

impl<S> Pending<S> {
    /// Has a finished frame copied to the host: colours, depths and counts.
    pub(crate) fn new(
        gpu: &Gpu,
        finished: &Finished,
        time: Option<PendingTime>,
        statistics: S,
        complete: fn(S, Taken, Option<f64>) -> S,
    ) -> Result<Self, GpuError> {
        let reading = Reading::begin(gpu, &finished.textures)?;
        Ok(Self { gpu: gpu.clone(), reading, time, statistics, complete, depth_unit: Some(1.0) })
    }

    /// The same of colours alone.
    pub(crate) fn of_colors(gpu: &Gpu, finished: &Finished, statistics: S) -> Result<Self, GpuError> {
        let reading = Reading::begin_colors(gpu, &finished.textures[0])?;
        let complete = |statistics, _, _| statistics;
        Ok(Self { gpu: gpu.clone(), reading, time: None, statistics, complete, depth_unit: None })
    }

    /// The same without the image's depths.
    pub(crate) fn without_depth(self) -> Self {
        Self { depth_unit: None, ..self }
    }

    /// The same with depths in other units, of which one is so many of those that were drawn.
    pub(crate) fn with_depth_unit(self, unit: f64) -> Self {
        Self { depth_unit: Some(unit), ..self }
    }

    /// Whether the frame is there, so that its outcome is learnt without waiting.
    pub fn is_there(&self) -> Result<bool, GpuError> {
        self.gpu.look()?;
        Ok(self.reading.is_there() && self.time.as_ref().is_none_or(PendingTime::is_there))
    }

    /// Waits for the frame: its image, and what it took.
    pub fn outcome(self) -> Result<(Image, S), GpuError> {
        let (image, _, statistics) = self.all()?;
        Ok((image, statistics))
    }

    /// Waits for the frame: what each ray of it took, too.
    pub(crate) fn all(self) -> Result<(Image, FetchCounts, S), GpuError> {
        if !self.is_there()? {
            self.gpu.finish()?;
        }
        let Read { image, taken, fetches } = self.reading.read()?;
        let milliseconds = self.time.map(PendingTime::milliseconds).transpose()?;
        let image = match self.depth_unit {
            Some(unit) => image.with_depth_unit(unit),
            None => image.without_depth(),
        };
        Ok((image, fetches, (self.complete)(self.statistics, taken, milliseconds)))
    }
}
