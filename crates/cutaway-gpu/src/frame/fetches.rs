//! What each pixel of a frame took, as numbers and as a picture: where the work is.

use cutaway_core::colormaps::{ColorPoint, by_name};
use cutaway_core::image::Image;

/// The colour map of pictures of counts: even to the eye, also for those who see few colours.
const COLORMAP: &str = "viridis";

/// Texture fetches of every pixel of a frame: the field's values that its ray took (an interpolated value counts as one, a
/// gradient as six), or the cells that it looked at, for isosurfaces. At most 4,194,303 a pixel are counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FetchCounts {
    size: [u32; 2],
    counts: Vec<u32>,
}

impl FetchCounts {
    pub(super) fn new(size: [u32; 2], counts: Vec<u32>) -> Self {
        Self { size, counts }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Fetches a pixel, top row first.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// The greatest of them, which the brightest colour stands for.
    pub fn most(&self) -> u32 {
        self.counts.iter().copied().max().unwrap_or(0)
    }

    /// Their mean.
    pub fn mean(&self) -> f64 {
        let sum: u64 = self.counts.iter().map(|c| u64::from(*c)).sum();
        sum as f64 / self.counts.len().max(1) as f64
    }

    /// An opaque picture: from dark blue for none over green to yellow for `most` (those beyond it, too).
    pub fn false_color(&self, most: u32) -> Image {
        let points = by_name(COLORMAP).unwrap_or_default();
        let pixels = self
            .counts
            .iter()
            .map(|count| {
                let [r, g, b] = color(&points, f64::from(*count) / f64::from(most.max(1)));
                [r as f32, g as f32, b as f32, 1.0]
            })
            .collect();
        Image::new(self.size[0], self.size[1], pixels).expect("one count a pixel of a frame")
    }
}

/// A colour map at a position; beyond its ends the colour there.
fn color(points: &[ColorPoint], at: f64) -> [f64; 3] {
    let after = points.partition_point(|p| p.0 < at);
    let Some(&(upper, above)) = points.get(after) else { return points.last().map_or([0.0; 3], |p| p.1) };
    let Some(&(lower, below)) = after.checked_sub(1).and_then(|i| points.get(i)) else { return above };
    let share = (at - lower) / (upper - lower);
    [0, 1, 2].map(|c: usize| below[c] + share * (above[c] - below[c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_fetches_are_brighter() {
        let counts = FetchCounts::new([2, 2], vec![0, 10, 20, 40]);
        assert_eq!((counts.most(), counts.mean()), (40, 17.5));
        let image = counts.false_color(counts.most());
        let light = |i: usize| image.pixels()[i][..3].iter().sum::<f32>();
        assert!(light(0) < light(1) && light(1) < light(2) && light(2) < light(3));
        // Beyond the end of the scale there is one colour.
        let clipped = counts.false_color(20);
        assert_eq!(clipped.pixels()[2], clipped.pixels()[3]);
        assert!(clipped.pixels().iter().all(|p| p[3] == 1.0));
        let nothing = FetchCounts::new([1, 1], vec![0]);
        assert_eq!(nothing.false_color(nothing.most()).pixels()[0], image.pixels()[0]);
    }
}
