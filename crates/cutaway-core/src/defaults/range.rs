//! Ranges of values that a few outliers do not move.

use rayon::prelude::*;

use crate::volume::{Volume, Voxels};

/// The share of the voxels at each end of the values that [`robust_range`] leaves out, 0.02 %.
pub const OUTLIERS: f64 = 0.0002;

/// What is left out is further away from the rest than this share of the rest's width: nearer values move a range by little.
const NEAR: f64 = 0.1;

/// Voxels that a thread counts at a time.
const CHUNK: usize = 1 << 20;

/// Returns the range of the values without outliers: a few hot or dead voxels do not move it. Its ends are the least and the
/// greatest value, or, where that is further than a tenth of the range away, the value beyond which [`OUTLIERS`] of the voxels
/// are. Where nearly all voxels have one value, what is rare is all that there is to see, and the range is that of all.
pub fn robust_range(volume: &Volume) -> [f64; 2] {
    let [least, greatest] = volume.value_range();
    let [lo, hi] = stored_quantiles(volume.voxels());
    if lo >= hi {
        return [least, greatest];
    }
    let [a, b] = [lo, hi].map(|stored| volume.rescale().value(f64::from(stored)));
    let (lo, hi) = (a.min(b), a.max(b));
    let near = NEAR * (hi - lo);
    [if lo - least <= near { least } else { lo }, if greatest - hi <= near { greatest } else { hi }]
}

/// Returns the range of values that a default function or colour map is stretched over: [`robust_range`], or, for a volume
/// of one value, a range around it. The lower end is always less than the upper, and their difference is finite.
pub fn display_range(volume: &Volume) -> [f64; 2] {
    let [lo, hi] = robust_range(volume);
    if lo < hi {
        let whole = (hi - lo).is_finite();
        return if whole { [lo, hi] } else { [lo / 2.0, hi / 2.0] };
    }
    // Half a unit to both sides, or a hundredth of the value where half a unit is too little to be told from it.
    let half = (0.01 * lo.abs()).max(0.5);
    [lo - half, lo + half]
}

/// Stored numbers of which [`OUTLIERS`] of the voxels are less, or greater.
fn stored_quantiles(voxels: &Voxels) -> [f32; 2] {
    match voxels {
        Voxels::U8(v) => ends(&counts(v, 1 << 8, |v| Some(usize::from(v)))).map(|i| i as f32),
        Voxels::U16(v) => ends(&counts(v, 1 << 16, |v| Some(usize::from(v)))).map(|i| i as f32),
        Voxels::F32(v) => float_quantiles(v),
    }
}

/// Exact quantiles of floats, whatever their magnitudes: their bits are counted as whole numbers of the same order, first the
/// upper 16, then the lower 16 of those whose upper ones are a quantile's.
fn float_quantiles(voxels: &[f32]) -> [f32; 2] {
    let upper = counts(voxels, 1 << 16, |v| key(v).map(|key| (key >> 16) as usize));
    let skip = skipped(&upper);
    let quantile = |from_above: bool| {
        let (bin, rest) = rank(&upper, skip, from_above);
        let lower = counts(voxels, 1 << 16, |v| {
            key(v).filter(|key| (key >> 16) as usize == bin).map(|key| (key & 0xffff) as usize)
        });
        let (low, _) = rank(&lower, rest, from_above);
        from_key((bin as u32) << 16 | low as u32)
    };
    [quantile(false), quantile(true)]
}

/// A whole number whose order is that of the float; none for one that is not finite.
fn key(v: f32) -> Option<u32> {
    let bits = v.to_bits();
    v.is_finite().then_some(if bits >> 31 == 1 { !bits } else { bits | 1 << 31 })
}

fn from_key(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key })
}

/// The bins of both quantiles.
fn ends(counts: &[u64]) -> [usize; 2] {
    let skip = skipped(counts);
    [rank(counts, skip, false).0, rank(counts, skip, true).0]
}

/// How many voxels are left out at each end.
fn skipped(counts: &[u64]) -> u64 {
    (counts.iter().sum::<u64>() as f64 * OUTLIERS) as u64
}

/// The bin of the voxel that has `skip` others below it (or above it), and how many of these are in its bin.
fn rank(counts: &[u64], skip: u64, from_above: bool) -> (usize, u64) {
    let mut left = skip;
    let place = |i: usize| if from_above { counts.len() - 1 - i } else { i };
    for bin in (0..counts.len()).map(place) {
        if counts[bin] > left {
            return (bin, left);
        }
        left -= counts[bin];
    }
    (0, 0)
}

fn counts<T: Copy + Sync>(voxels: &[T], bins: usize, bin: impl Fn(T) -> Option<usize> + Sync) -> Vec<u64> {
    let count = |chunk: &[T]| {
        let mut counts = vec![0u32; bins];
        for bin in chunk.iter().filter_map(|v| bin(*v)) {
            counts[bin] += 1;
        }
        counts
    };
    let mut total = vec![0u64; bins];
    // As many chunks at a time as there are threads: their counts are in memory together.
    for group in voxels.chunks(CHUNK * rayon::current_num_threads().max(1)) {
        let parts: Vec<Vec<u32>> = group.par_chunks(CHUNK).map(count).collect();
        for part in parts {
            total.iter_mut().zip(part).for_each(|(sum, n)| *sum += u64::from(n));
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Geometry, Rescale, Voxel};
    use glam::{DVec3, UVec3};
    use proptest::prelude::*;

    fn volume<T: Voxel>(voxels: Vec<T>, slope: f64) -> Volume {
        let d = UVec3::new(voxels.len() as u32, 1, 1);
        let geometry = Geometry::from_spacing(DVec3::ONE);
        Volume::new(d, voxels, Rescale { slope, intercept: 0.0 }, geometry).unwrap()
    }

    #[test]
    fn report_52_two_hot_voxels_do_not_move_the_range() {
        let mut voxels: Vec<u16> = (0..32_768).map(|i| (i % 901) as u16).collect();
        voxels[5] = 65_535;
        voxels[20_000] = 65_535;
        assert_eq!(robust_range(&volume(voxels.clone(), 1.0)), [0.0, 900.0]);
        assert_eq!(robust_range(&volume(voxels.clone(), -2.0)), [-1800.0, 0.0]);
        let floats = voxels.iter().map(|v| if *v == 65_535 { 1e30 } else { f32::from(*v) - 450.0 }).collect();
        assert_eq!(robust_range(&volume::<f32>(floats, 1.0)), [-450.0, 450.0]);
    }

    #[test]
    fn values_near_the_rest_are_no_outliers() {
        let mut voxels: Vec<u16> = (0..32_768).map(|i| (i % 901) as u16).collect();
        voxels[5] = 950;
        assert_eq!(robust_range(&volume(voxels.clone(), 1.0)), [0.0, 950.0]);
        voxels[6] = 1100;
        assert_eq!(robust_range(&volume(voxels, 1.0)), [0.0, 900.0]);
    }

    #[test]
    fn what_is_rare_is_shown_where_there_is_nothing_else() {
        let mut voxels = vec![0u8; 100_000];
        voxels[77] = 9;
        assert_eq!(robust_range(&volume(voxels, 1.0)), [0.0, 9.0]);
    }

    #[test]
    fn report_53_a_constant_has_a_range_around_it() {
        for value in [0.0, 7.0, -3e-20, 1e30, -3e38] {
            let [lo, hi] = display_range(&volume(vec![value as f32; 30], 1.0));
            assert!(lo < f64::from(value as f32) && f64::from(value as f32) < hi, "{value}: {lo} to {hi}");
        }
        let [lo, hi] = display_range(&volume(vec![-3e38f32, 3e38], 1.0));
        assert!(lo < hi && (hi - lo).is_finite());
    }

    proptest! {
        #[test]
        fn the_ends_are_those_of_the_sorted_values(
            mut voxels in prop::collection::vec(any::<f32>().prop_filter("finite", |v| v.is_finite()), 1..12_000),
        ) {
            let found = float_quantiles(&voxels);
            voxels.sort_by(f32::total_cmp);
            let skip = (voxels.len() as f64 * OUTLIERS) as usize;
            prop_assert_eq!(found, [voxels[skip], voxels[voxels.len() - 1 - skip]]);
        }
    }
}
