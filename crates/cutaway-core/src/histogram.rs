//! Histograms, and the transfer function that a volume gets when nobody gave one.

use crate::defaults::display_range;
use crate::scene::Mode;
use crate::transfer_function::{ControlPoint, TransferFunction};
use crate::volume::{Volume, Voxels};
use rayon::prelude::*;

/// How many voxels have which value.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Values at the lower end of the first bin and the upper end of the last.
    pub range: [f64; 2],
    /// Voxels a bin; bins are equally wide.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Counts every voxel of a volume in `bins` bins over its value range.
    pub fn new(volume: &Volume, bins: usize) -> Self {
        Self::over(volume, volume.value_range(), bins)
    }

    /// Counts every voxel of a volume in `bins` bins over a range of values; voxels outside the range count in the first or
    /// the last bin.
    pub fn over(volume: &Volume, range: [f64; 2], bins: usize) -> Self {
        let bins = bins.max(1);
        // In f64: the range of f32 voxels may be twice the largest f32.
        let [a, b] = range.map(|value| volume.rescale().stored(value));
        let (lo, hi) = (a.min(b), a.max(b));
        let scale = if hi > lo { bins as f64 / (hi - lo) } else { 0.0 };
        let bin = |v: f32| (((f64::from(v) - lo) * scale) as usize).min(bins - 1);
        let mut counts = match volume.voxels() {
            // Whole numbers are counted one by one, then put into bins: no arithmetic a voxel.
            Voxels::U8(v) => rebin(&whole(v, 1 << 8), &bin, bins),
            Voxels::U16(v) => rebin(&whole(v, 1 << 16), &bin, bins),
            Voxels::F32(v) => count(v, &bin, bins),
        };
        // Voxels without a value have none of these.
        for number in volume.missing_numbers() {
            counts[bin(number)] -= 1;
        }
        if volume.rescale().slope < 0.0 {
            counts.reverse();
        }
        Self { range, counts }
    }

    /// The value below which `share` (0..=1) of the voxels in bins `from..` lie.
    pub fn percentile_from(&self, from: usize, share: f64) -> f64 {
        let total: u64 = self.counts[from..].iter().sum();
        let wanted = (total as f64 * share) as u64;
        let mut sum = 0;
        for (i, n) in self.counts.iter().enumerate().skip(from) {
            sum += n;
            if sum > wanted {
                return self.center(i);
            }
        }
        self.range[1]
    }

    /// The value in the middle of a bin.
    pub fn center(&self, bin: usize) -> f64 {
        let [lo, hi] = self.range;
        lo + (bin as f64 + 0.5) / self.counts.len() as f64 * (hi - lo)
    }
}

const CHUNK: usize = 1 << 20;

fn whole<T: Copy + Into<u32> + Sync>(voxels: &[T], values: usize) -> Vec<u64> {
    let count = |chunk: &[T]| {
        let mut counts = vec![0u32; values];
        for &v in chunk {
            counts[v.into() as usize] += 1;
        }
        counts.into_iter().map(u64::from).collect::<Vec<_>>()
    };
    voxels.par_chunks(CHUNK).map(count).reduce(|| vec![0; values], add)
}

fn count(voxels: &[f32], bin: &(impl Fn(f32) -> usize + Sync), bins: usize) -> Vec<u64> {
    let count = |chunk: &[f32]| {
        let mut counts = vec![0u64; bins];
        for &v in chunk {
            counts[bin(v)] += 1;
        }
        counts
    };
    voxels.par_chunks(CHUNK).map(count).reduce(|| vec![0; bins], add)
}

fn add(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}

fn rebin(whole: &[u64], bin: &impl Fn(f32) -> usize, bins: usize) -> Vec<u64> {
    let mut counts = vec![0; bins];
    for (v, n) in whole.iter().enumerate().filter(|(_, n)| **n > 0) {
        counts[bin(v as f32)] += n;
    }
    counts
}

/// How far the object reaches down from Otsu's threshold towards the mean of the background.
const FAINT: f64 = 0.3;

/// Bins of the histogram behind the default transfer function.
const BINS: usize = 256;

/// A transfer function for a volume that nobody described: background (air) transparent, the bulk of the object
/// translucent, its brightest parts dense; opacity per mean voxel spacing.
///
/// Otsu's threshold (1979) splits the values into two classes of least variance: background and object. The object
/// begins a little below it, so that its faint parts stay; above, opacity rises over the percentiles of what is left.
pub fn default_transfer_function(volume: &Volume) -> TransferFunction {
    let histogram = Histogram::over(volume, display_range(volume), BINS);
    let [lo, hi] = histogram.range;
    let otsu = otsu_threshold(&histogram.counts);
    let background = mean_bin(&histogram.counts[..otsu]);
    let foreground = (otsu as f64 - FAINT * (otsu as f64 - background)) as usize;
    let start = histogram.center(foreground);
    let [low, middle, high] = [0.1, 0.5, 0.95].map(|share| histogram.percentile_from(foreground, share));
    let point = |value: f64, color: [f64; 3], opacity: f64| ControlPoint { value, color, opacity };
    let mut points = vec![
        point(lo, [0.25, 0.12, 0.1], 0.0),
        point(start, [0.55, 0.25, 0.18], 0.0),
        point(low, [0.8, 0.5, 0.36], 0.08),
        point(middle, [0.93, 0.74, 0.55], 0.2),
        point(high, [1.0, 0.95, 0.86], 0.6),
        point(hi, [1.0, 1.0, 1.0], 0.8),
    ];
    // Percentiles of a peaked histogram coincide: later points give way upwards.
    let least = ((hi - lo) * 1e-3).max(f64::MIN_POSITIVE);
    for i in 1..points.len() {
        points[i].value = points[i].value.max(points[i - 1].value + least);
    }
    TransferFunction::new(points).expect("values were made to ascend")
}

fn mean_bin(counts: &[u64]) -> f64 {
    let total: u64 = counts.iter().sum();
    let sum: f64 = counts.iter().enumerate().map(|(i, n)| i as f64 * *n as f64).sum();
    if total == 0 { 0.0 } else { sum / total as f64 }
}

/// The first bin of the upper of two classes with the largest variance between them.
pub(crate) fn otsu_threshold(counts: &[u64]) -> usize {
    let total: f64 = counts.iter().map(|n| *n as f64).sum();
    let sum: f64 = counts.iter().enumerate().map(|(i, n)| i as f64 * *n as f64).sum();
    let (mut below, mut sum_below, mut best) = (0.0, 0.0, (0.0, 0));
    for (i, n) in counts.iter().enumerate() {
        below += *n as f64;
        sum_below += i as f64 * *n as f64;
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let difference = sum_below / below - (sum - sum_below) / above;
            let between = below * above * difference * difference;
            if between > best.0 {
                best = (between, i + 1);
            }
        }
    }
    best.1
}

/// The transfer function of a volume that nobody described, for a mode: projections show the value itself as grey, over a
/// range that a few outliers do not move ([`display_range`]).
pub fn default_for_mode(volume: &Volume, mode: Mode) -> TransferFunction {
    if matches!(mode, Mode::Mip | Mode::Minip | Mode::Mean) {
        gray_ramp(display_range(volume))
    } else {
        default_transfer_function(volume)
    }
}

/// Black to white over a range of values (a radiologist's window), opaque: for projections.
pub fn gray_ramp(range: [f64; 2]) -> TransferFunction {
    ramp(range, [1.0, 1.0])
}

/// Black to white over a range of values, opacity rising along with it to a half: for compositing.
pub fn translucent_ramp(range: [f64; 2]) -> TransferFunction {
    ramp(range, [0.0, 0.5])
}

fn ramp([lo, hi]: [f64; 2], opacity: [f64; 2]) -> TransferFunction {
    let points = vec![
        ControlPoint { value: lo, color: [0.0; 3], opacity: opacity[0] },
        ControlPoint { value: hi.max(lo), color: [1.0; 3], opacity: opacity[1] },
    ];
    TransferFunction::new(points).expect("two ordered points")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::AnalyticField;
    use crate::volume::{Geometry, Rescale};
    use glam::{DVec3, UVec3};

    fn volume(voxels: Vec<u8>, rescale: Rescale) -> Volume {
        let d = UVec3::new(voxels.len() as u32, 1, 1);
        Volume::new(d, voxels, rescale, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn every_voxel_is_counted_once_and_falling_rescales_are_turned() {
        let rising = Histogram::new(&volume(vec![0, 0, 0, 10, 20], Rescale::IDENTITY), 2);
        assert_eq!((rising.range, rising.counts.as_slice()), ([0.0, 20.0], &[3, 2][..]));
        let falling =
            Histogram::new(&volume(vec![0, 0, 0, 10, 20], Rescale { slope: -1.0, intercept: 0.0 }), 2);
        assert_eq!((falling.range, falling.counts.as_slice()), ([-20.0, 0.0], &[2, 3][..]));
        assert_eq!(Histogram::new(&AnalyticField::Torus.volume(20), 64).counts.iter().sum::<u64>(), 8000);
    }

    #[test]
    fn the_default_hides_the_air_and_shows_the_object() {
        let mut voxels = vec![3u8; 700];
        voxels.extend([90, 100, 110].iter().cycle().take(250));
        voxels.extend([220; 50]);
        let f = default_transfer_function(&volume(voxels, Rescale::IDENTITY));
        assert_eq!(f.evaluate(3.0).1, 0.0);
        assert!(f.evaluate(110.0).1 > 0.02 && f.evaluate(220.0).1 > 0.3);
    }

    #[test]
    fn the_widest_range_of_floats_has_bins() {
        let d = UVec3::new(4, 1, 1);
        let voxels = vec![-3e38f32, -1e38, 1e38, 3e38];
        let volume = Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap();
        assert_eq!(Histogram::new(&volume, 4).counts, [1, 1, 1, 1]);
    }

    #[test]
    fn a_volume_of_one_value_has_a_default_too() {
        let constant = volume(vec![7; 30], Rescale::IDENTITY);
        assert!(default_transfer_function(&constant).evaluate(7.0).1 > 0.02);
        let gray = default_for_mode(&constant, Mode::Mip).evaluate(7.0).0[0];
        assert!((gray - 0.5).abs() < 0.01, "{gray}");
    }

    #[test]
    fn report_52_two_hot_voxels_do_not_change_the_defaults() {
        let clean: Vec<u16> = (0..32_768u32).map(|i| (i * i % 901) as u16).collect();
        let mut hot = clean.clone();
        (hot[7], hot[9_000]) = (65_535, 65_535);
        let made = |voxels: Vec<u16>| {
            let geometry = Geometry::from_spacing(DVec3::ONE);
            Volume::new(UVec3::splat(32), voxels, Rescale::IDENTITY, geometry).unwrap()
        };
        let (clean, hot) = (made(clean), made(hot));
        for mode in [Mode::Composite, Mode::Mip, Mode::Mean] {
            let [a, b] = [&clean, &hot].map(|volume| default_for_mode(volume, mode));
            for value in [0.0, 200.0, 450.0, 700.0, 900.0] {
                let (a, b) = (a.evaluate(value), b.evaluate(value));
                assert!((a.1 - b.1).abs() < 0.02 && (a.0[0] - b.0[0]).abs() < 0.02, "{value}: {a:?} {b:?}");
            }
        }
    }
}
