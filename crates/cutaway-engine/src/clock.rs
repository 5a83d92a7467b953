//! The clock: the only place of this crate that reads it, so that a platform without `Instant` needs one change.

use std::time::{Duration, Instant};

/// A moment to measure from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment(Instant);

impl Moment {
    pub(crate) fn now() -> Self {
        Self(Instant::now())
    }

    pub(crate) fn elapsed(self) -> Duration {
        self.0.elapsed()
    }

    pub(crate) fn milliseconds(self) -> f64 {
        self.elapsed().as_secs_f64() * 1e3
    }
}

/// Waits until `duration` is over; returns early, with true, once `ended` says so.
pub(crate) fn wait(duration: Duration, ended: impl Fn() -> bool) -> bool {
    let start = Moment::now();
    while start.elapsed() < duration {
        if ended() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    ended()
}
