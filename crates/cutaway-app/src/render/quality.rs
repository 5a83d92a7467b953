//! How coarse a first frame is, so that it comes in time.

use std::time::Duration;

/// Chooses by what factor an image is made smaller while something moves, from what images took before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    /// Seconds a pixel, the newest counting half.
    seconds_a_pixel: Option<f64>,
}

/// Factors that are tried, finest first.
const FACTORS: [u32; 6] = [1, 2, 3, 4, 6, 8];

/// The first frame that an engine makes.
const UNKNOWN: u32 = 4;

impl Pace {
    /// Notes what an image of so many pixels took.
    pub(super) fn note(&mut self, size: [u32; 2], took: Duration) {
        let newest = took.as_secs_f64() / (f64::from(size[0]) * f64::from(size[1])).max(1.0);
        self.seconds_a_pixel = Some(self.seconds_a_pixel.map_or(newest, |before| 0.5 * (before + newest)));
    }

    /// The least factor with which an image of `size` takes no longer than `budget`.
    pub(super) fn factor(&self, size: [u32; 2], budget: Duration) -> u32 {
        let Some(pace) = self.seconds_a_pixel else { return UNKNOWN };
        let fits = |factor: &u32| {
            let [w, h] = reduced(size, *factor);
            f64::from(w) * f64::from(h) * pace <= budget.as_secs_f64()
        };
        FACTORS.into_iter().find(fits).unwrap_or(FACTORS[FACTORS.len() - 1])
    }
}

/// An image's size, so many times smaller.
pub(super) fn reduced(size: [u32; 2], factor: u32) -> [u32; 2] {
    size.map(|side| side.div_ceil(factor).max(1))
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
