//! Converts numbers that 8 and 16 bits do not hold to 32-bit floats, with the offset and the factor that keep most of them.
//!
//! `stored = (number - offset) / scale`, both kept in the volume's [`Rescale`](super::Rescale):
//!
//! - The steps of an f32 grow with its distance from zero. Where small variations lie on a large number, that number is
//!   subtracted first, in the file's own type. It is not subtracted where that would not help: most volumes keep offset 0.
//! - Kernels multiply stored numbers with each other. Numbers so large or so small that products would leave the range of
//!   f32 are divided by a power of two, which changes no digit.
//!
//! A single number out of all proportion to the rest (such as `1.8e308`, a mark for "no data") would leave no digits to
//! the others. It is replaced like an infinity.

use std::borrow::Cow;

use rayon::prelude::*;

use super::{CHUNK, MissingVoxels, Stored, Voxel, Voxels};

/// What was lost when numbers were stored as 32-bit floats; see [`super::Volume::loss`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StorageLoss {
    /// Largest difference between a value and its stored one, in units of the value.
    pub largest: f64,
}

/// Differences of neighbours below this share of their distance from the offset have too few digits in f32.
const FEW_DIGITS: f64 = 1.0 / 65536.0;

/// An offset is looked for if more than one in so many pairs of neighbours has too few digits.
const MANY: u64 = 100;

/// Stored numbers are brought into 2 to the power of these exponents: squares of gradients are then far from both ends of
/// f32, whose exponents are -126 to 127.
const EXPONENTS: [f64; 2] = [-30.0, 50.0];

/// A mark for missing data is at least this large (a convention of many programs) and 2^100 times as large as the rest.
const LARGE_MARK: f64 = 1e30;
const OUT_OF_PROPORTION: f64 = (1u128 << 100) as f64;

/// At most so many different marks are recognised.
const MOST_MARKS: usize = 4;

/// Voxels that candidates for the median are taken from.
const SAMPLE: usize = 4096;

/// Stores numbers as f32. Those that are stored as they are, and that the caller gives away, are not copied.
pub(super) fn to_floats<T: Voxel>(given: Cow<'_, [T]>) -> Stored {
    let voxels: &[T] = &given;
    let mut limit = f64::INFINITY;
    let mut usable = Usable::survey(voxels, limit);
    for _ in 0..MOST_MARKS {
        let Some(mark) = usable.mark(voxels, limit) else { break };
        limit = mark;
        usable = Usable::survey(voxels, limit);
    }
    let Some([lo, hi]) = usable.range else {
        let zeros = Voxels::F32(vec![0.0; voxels.len()]);
        return Stored { replaced: voxels.len(), missing: nans(voxels), ..Stored::exact(zeros, 0.0) };
    };
    let offset = offset(voxels, limit, [lo, hi], &usable);
    let greatest = lo.minus(offset).abs().max(hi.minus(offset).abs());
    let form = Form { offset, scale: scale(greatest), range: [lo, hi], limit };
    let same = T::TYPE == super::VoxelType::F32 && usable.replaced == 0;
    let same = same && offset.to_f64() == 0.0 && form.scale == 1.0;
    let missing = if usable.replaced > 0 { nans(voxels) } else { None };
    let (floats, loss) = match given {
        Cow::Owned(voxels) if same => (as_they_are(voxels), None),
        voxels => {
            let floats: Vec<f32> = voxels.par_iter().map(|v| form.stored(*v)).collect();
            let loss = form.loss(&voxels, &floats);
            (floats, loss)
        }
    };
    Stored {
        range: [form.stored(lo), form.stored(hi)],
        numbers: [lo.to_f64(), hi.to_f64()],
        offset: offset.to_f64(),
        scale: form.scale,
        replaced: usable.replaced,
        loss,
        missing,
        voxels: Voxels::F32(floats),
    }
}

/// A vector of f32 whose type the compiler does not know.
fn as_they_are<T: Voxel>(voxels: Vec<T>) -> Vec<f32> {
    let any: Box<dyn std::any::Any> = Box::new(voxels);
    *any.downcast::<Vec<f32>>().expect("callers have checked the type")
}

fn nans<T: Voxel>(voxels: &[T]) -> Option<MissingVoxels> {
    MissingVoxels::find(voxels, |v: T| v.to_f64().is_nan())
}

/// Whether a number takes part: finite and below a limit.
fn is_usable<T: Voxel>(v: T, limit: f64) -> bool {
    v.to_f64().abs() < limit
}

/// What a pass over all voxels finds of the usable ones.
struct Usable<T> {
    /// Least and greatest.
    range: Option<[T; 2]>,
    /// Voxels that are not usable.
    replaced: usize,
    /// Pairs of neighbours in memory that differ, and those of them with too few digits.
    pairs: u64,
    poor: u64,
}

impl<T: Voxel> Usable<T> {
    fn survey(voxels: &[T], limit: f64) -> Self {
        let nothing = || Self { range: None, replaced: 0, pairs: 0, poor: 0 };
        voxels.par_chunks(CHUNK).map(|chunk| Self::of_chunk(chunk, limit)).reduce(nothing, Self::join)
    }

    fn of_chunk(chunk: &[T], limit: f64) -> Self {
        let mut found = Self { range: None, replaced: 0, pairs: 0, poor: 0 };
        let mut before: Option<T> = None;
        for &v in chunk {
            if !is_usable(v, limit) {
                found.replaced += 1;
                before = None;
                continue;
            }
            let [lo, hi] = found.range.get_or_insert([v, v]);
            if v.to_f64() < lo.to_f64() {
                *lo = v;
            }
            if v.to_f64() > hi.to_f64() {
                *hi = v;
            }
            if let Some(before) = before.replace(v) {
                let [differ, poor] = pair(before, v, T::ZERO);
                found.pairs += u64::from(differ);
                found.poor += u64::from(poor);
            }
        }
        found
    }

    fn join(self, other: Self) -> Self {
        let range = match (self.range, other.range) {
            (Some([a, b]), Some([c, d])) => {
                let lo = if c.to_f64() < a.to_f64() { c } else { a };
                Some([lo, if d.to_f64() > b.to_f64() { d } else { b }])
            }
            (one, None) | (None, one) => one,
        };
        Self {
            range,
            replaced: self.replaced + other.replaced,
            pairs: self.pairs + other.pairs,
            poor: self.poor + other.poor,
        }
    }

    /// The magnitude of a lone number (of either sign) out of all proportion to the rest.
    fn mark(&self, voxels: &[T], limit: f64) -> Option<f64> {
        let [lo, hi] = self.range?.map(T::to_f64);
        let mark = hi.abs().max(lo.abs());
        if mark < LARGE_MARK {
            return None;
        }
        let near = mark / OUT_OF_PROPORTION;
        // The others, zeros left out: zeros alone lose nothing.
        let others = |v: &T| {
            let v = v.to_f64().abs();
            v < limit && v != mark && v != 0.0
        };
        let alone = voxels.par_iter().all(|v| !others(v) || v.to_f64().abs() < near);
        (alone && voxels.par_iter().any(others)).then_some(mark)
    }
}

/// Whether two neighbours differ, and whether too few digits of the difference are left in f32 after an offset.
#[inline]
fn pair<T: Voxel>(a: T, b: T, offset: T) -> [bool; 2] {
    let difference = b.minus(a).abs();
    let far = a.minus(offset).abs().max(b.minus(offset).abs());
    [difference > 0.0, difference > 0.0 && difference < FEW_DIGITS * far]
}

/// The number that is subtracted before numbers become f32; zero wherever that serves.
fn offset<T: Voxel>(voxels: &[T], limit: f64, [lo, hi]: [T; 2], usable: &Usable<T>) -> T {
    if usable.pairs == 0 {
        // One number: exact as an f32, or else as its own offset.
        let number = lo.to_f64();
        return if f64::from(number as f32) == number { T::ZERO } else { lo };
    }
    if T::TYPE.is_integer() {
        // Whole numbers of 24 bits are exact.
        let fits = |v: f64| v.abs() <= f64::from(1u32 << 24);
        return if !(fits(lo.to_f64()) && fits(hi.to_f64())) && fits(hi.minus(lo)) { lo } else { T::ZERO };
    }
    if usable.poor * MANY <= usable.pairs {
        return T::ZERO;
    }
    let candidates = [lo, median(voxels, limit).unwrap_or(lo), hi];
    let poor = |offset: T| -> u64 {
        let of_chunk = |chunk: &[T]| {
            let pairs = chunk.windows(2).filter(|w| w.iter().all(|v| is_usable(*v, limit)));
            pairs.filter(|w| pair(w[0], w[1], offset)[1]).count() as u64
        };
        voxels.par_chunks(CHUNK).map(of_chunk).sum()
    };
    let best = candidates.into_iter().map(|offset| (poor(offset), offset)).min_by_key(|(poor, _)| *poor);
    match best {
        Some((poor, offset)) if poor < usable.poor / 2 => offset,
        _ => T::ZERO,
    }
}

/// A number near the middle of the sorted ones.
fn median<T: Voxel>(voxels: &[T], limit: f64) -> Option<T> {
    let stride = voxels.len().div_ceil(SAMPLE);
    let mut sample: Vec<T> =
        voxels.iter().step_by(stride).copied().filter(|v| is_usable(*v, limit)).collect();
    sample.sort_by(|a, b| a.to_f64().total_cmp(&b.to_f64()));
    sample.get(sample.len() / 2).copied()
}

/// The power of two that brings numbers up to `greatest` into the range in which kernels can multiply.
fn scale(greatest: f64) -> f64 {
    let exponent = greatest.log2().floor();
    let [least, most] = EXPONENTS;
    if exponent > most {
        (exponent - most).exp2()
    } else if exponent < least && greatest > 0.0 {
        // Not below the least f64.
        exponent.max(-1074.0).exp2()
    } else {
        1.0
    }
}

/// How numbers are stored.
#[derive(Clone, Copy)]
struct Form<T> {
    offset: T,
    scale: f64,
    range: [T; 2],
    limit: f64,
}

impl<T: Voxel> Form<T> {
    /// Infinities and marks become the nearest usable number, NaN the least until its neighbours are known.
    #[inline]
    fn stored(&self, v: T) -> f32 {
        let [lo, hi] = self.range;
        let usable = if is_usable(v, self.limit) {
            v
        } else if v.to_f64() > 0.0 {
            hi
        } else {
            lo
        };
        (usable.minus(self.offset) / self.scale) as f32
    }

    /// What was lost, if it can be noticed.
    fn loss(&self, voxels: &[T], floats: &[f32]) -> Option<StorageLoss> {
        if T::TYPE == super::VoxelType::F32 {
            return None;
        }
        let chunks = voxels.par_chunks(CHUNK).zip(floats.par_chunks(CHUNK));
        let nothing = || (0.0, 0, 0);
        let join = |a: (f64, u64, u64), b: (f64, u64, u64)| (a.0.max(b.0), a.1 + b.1, a.2 + b.2);
        let (largest, pairs, wrong) = chunks.map(|(v, f)| self.loss_of_chunk(v, f)).reduce(nothing, join);
        let [lo, hi] = self.range.map(|v| v.to_f64().abs());
        // Beyond 2^53 the values themselves, which are f64, are rounded.
        let rounded = if T::TYPE.is_integer() { lo.max(hi) * f64::EPSILON } else { 0.0 };
        let largest = if rounded >= 2.0 { largest.max(0.5 * rounded) } else { largest };
        let noticed = if T::TYPE.is_integer() { largest > 0.0 } else { wrong * MANY > pairs };
        (noticed && largest > 0.0).then_some(StorageLoss { largest })
    }

    /// The largest error; how many neighbours differ; and how many of their differences are off by a sixteenth.
    fn loss_of_chunk(&self, voxels: &[T], floats: &[f32]) -> (f64, u64, u64) {
        let (mut largest, mut pairs, mut wrong) = (0.0f64, 0, 0);
        let mut before: Option<(T, f64)> = None;
        for (&v, &stored) in voxels.iter().zip(floats) {
            if !is_usable(v, self.limit) {
                before = None;
                continue;
            }
            let stored = f64::from(stored) * self.scale;
            largest = largest.max((v.minus(self.offset) - stored).abs());
            if let Some((number, other)) = before.replace((v, stored)) {
                let difference = v.minus(number);
                pairs += u64::from(difference != 0.0);
                wrong += u64::from(((stored - other) - difference).abs() > difference.abs() / 16.0);
            }
        }
        (largest, pairs, wrong)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, UVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::volume::{Geometry, Rescale, Volume};

    fn line<T: Voxel>(voxels: Vec<T>) -> Volume {
        let d = UVec3::new(voxels.len() as u32, 1, 1);
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn report_b4_floats_that_stay_as_they_are_are_not_copied() {
        let voxels: Vec<f32> = (0..1000).map(|i| i as f32 - 500.0).collect();
        let place = voxels.as_ptr();
        let volume = line(voxels);
        let Voxels::F32(stored) = volume.voxels() else { panic!("not stored as floats") };
        assert_eq!(stored.as_ptr(), place);
        let replaced = line(vec![1.0f32, f32::NAN, 3.0]);
        assert_eq!((value(&replaced, 1), replaced.replaced()), (2.0, 1));
    }

    fn value(volume: &Volume, i: usize) -> f64 {
        volume.value_clamped(i as i64, 0, 0)
    }

    /// A ramp of 64 values, `variation` high.
    fn ramp(offset: f64, variation: f64) -> Vec<f64> {
        (0..64).map(|i| offset + variation * f64::from(i) / 63.0).collect()
    }

    #[test]
    fn report_61_small_variations_on_a_large_offset_are_kept() {
        let volume = line(ramp(101_325.0, 0.01));
        for (i, expected) in ramp(101_325.0, 0.01).into_iter().enumerate() {
            assert!((value(&volume, i) - expected).abs() < 1e-9);
        }
        assert_eq!(volume.value_range(), [101_325.0, 101_325.01]);
        assert_eq!(volume.loss(), None);
    }

    #[test]
    fn a_fill_value_far_away_takes_no_digits_from_the_rest() {
        let mut values = ramp(101_325.0, 0.01);
        values[5] = -9999.0;
        let volume = line(values.clone());
        for i in (0..64).filter(|i| *i != 5) {
            assert!((value(&volume, i) - values[i]).abs() < 1e-9);
        }
        assert_eq!(volume.value_range()[0], -9999.0);
        assert_eq!(volume.loss(), None);
    }

    #[test]
    fn what_no_offset_can_keep_is_said() {
        let mut values = ramp(101_325.0, 0.001);
        values.extend(ramp(-505_000.0, 0.001));
        let loss = line(values).loss().unwrap();
        assert!(loss.largest > 0.001 && loss.largest < 0.1, "{loss:?}");
        // Ordinary doubles lose less than anybody sees.
        assert_eq!(line((0..4096).map(|i| f64::from(i).sin()).collect()).loss(), None);
    }

    #[test]
    fn whole_numbers_beyond_24_bits_stay_apart_where_their_range_allows() {
        let first = 4_000_000_000u32;
        let labels: Vec<u32> = [0, 1, 2, 70_000, 1 << 24].map(|n| first + n).to_vec();
        let volume = line(labels.clone());
        assert!((0..5).all(|i| value(&volume, i) == f64::from(labels[i])));
        assert_eq!(volume.loss(), None);
        let merged = line(vec![0u32, 16_777_217, 33_554_433]);
        assert_eq!(merged.loss(), Some(StorageLoss { largest: 1.0 }));
        // Doubles that are whole numbers.
        let doubles: Vec<f64> = (0..10).map(|n| 16_777_216.0 + f64::from(n)).collect();
        let volume = line(doubles.clone());
        assert!((0..10).all(|i| value(&volume, i) == doubles[i]));
    }

    #[test]
    fn whole_numbers_that_doubles_do_not_hold_are_stored_apart_and_said() {
        let volume = line((0..100).map(|n| (1i64 << 60) + n).collect());
        let stored: Vec<f32> = (0..100).map(|i| volume.voxels().get(i)).collect();
        assert!(stored.windows(2).all(|w| w[1] - w[0] == 1.0));
        assert!(volume.loss().unwrap().largest >= 64.0);
    }

    #[test]
    fn ordinary_floats_are_stored_as_they_are() {
        for values in
            [vec![0.0f32, 1.0, -5.5], vec![1000.0, 1001.0, 1010.0], vec![7.0; 3], vec![1e-5, 3e8, 2.0]]
        {
            let volume = line(values.clone());
            assert_eq!(volume.rescale(), Rescale::IDENTITY);
            assert!((0..3).all(|i| volume.voxels().get(i) == values[i]));
        }
    }

    #[test]
    fn a_mark_out_of_all_proportion_is_replaced() {
        for mark in [1.7e308, -1.7e308, 1e300] {
            let volume = line(vec![1.0, mark, 3.0, 2.0]);
            assert_eq!((volume.replaced(), volume.value_range()), (1, [1.0, 3.0]), "{mark}");
        }
        let volume = line(vec![1.0f32, f32::MAX, f32::MIN, 3.0]);
        assert_eq!((volume.replaced(), volume.value_range()), (2, [1.0, 3.0]));
        // Not out of proportion: values of a simulation that decay.
        let decay: Vec<f64> = (0..600).map(|i| 10f64.powi(300 - i)).collect();
        assert_eq!(line(decay).replaced(), 0);
        // Nor where there is nothing else.
        assert_eq!(line(vec![0.0, 1e200, 1e200]).replaced(), 0);
    }

    #[test]
    fn values_beyond_doubles_are_refused() {
        let rescale = Rescale { slope: 1e200, intercept: 0.0 };
        let d = UVec3::new(2, 1, 1);
        let made = Volume::new(d, vec![1e190, 1e200], rescale, Geometry::from_spacing(DVec3::ONE));
        assert!(matches!(made, Err(crate::volume::VolumeError::Range { .. })));
    }

    proptest! {
        /// Doubles come back to a millionth of their variation, whatever is added to them and whatever they are
        /// multiplied with.
        #[test]
        fn report_61_offsets_change_nothing(
            values in prop::collection::vec(0.0f64..1.0, 16..200),
            ratio in 0.0f64..1e9,
            exponent in -290i32..290,
        ) {
            let unit = 10f64.powi(exponent);
            let moved: Vec<f64> = values.iter().map(|v| (v + ratio) * unit).collect();
            let volume = line(moved.clone());
            prop_assert_eq!(volume.loss(), None);
            for (i, expected) in moved.iter().enumerate() {
                prop_assert!((value(&volume, i) - expected).abs() <= 1e-6 * unit);
            }
            // And what is stored, kernels can square.
            for i in 0..moved.len() {
                let stored = volume.voxels().get(i).abs();
                prop_assert!(stored < 1e16);
            }
        }
    }
}
