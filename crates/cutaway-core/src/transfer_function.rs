//! Transfer functions: what a value looks like.
//!
//! A [`TransferFunction`] is a list of points (value, colour, opacity), linear between them. Opacity is *per unit
//! distance*; renderers turn it into extinction, `sigma = -ln(1 - opacity) / unit_distance`, so that an image does not
//! depend on the sampling step. A [`ClassificationTable`] is the same function sampled for kernels, with a bounded error.
//!
//! Colours are display values, straight (not premultiplied), and are composited as they are.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The largest opacity a unit distance can have: opacity 1 would be an infinite extinction. At this clamp a unit
/// distance still lets through one millionth of the light, and `sigma * unit_distance` is at most 13.8.
pub const MAX_OPACITY: f64 = 1.0 - 1e-6;

/// Extinction (per world length) of an opacity per `unit_distance` (world length).
#[inline]
pub fn extinction(opacity: f64, unit_distance: f64) -> f64 {
    -f64::ln_1p(-opacity.clamp(0.0, MAX_OPACITY)) / unit_distance
}

/// One point of a transfer function.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlPoint {
    /// The value, in the volume's units (after its rescale).
    pub value: f64,
    /// Red, green, blue, each in 0..=1.
    pub color: [f64; 3],
    /// Opacity per unit distance, in 0..=1.
    pub opacity: f64,
}

/// Why points do not make a transfer function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransferFunctionError {
    /// No point at all.
    #[error("a transfer function needs at least one point")]
    Empty,
    /// A number outside its range, or not a number.
    #[error("transfer function point {index}: {field} is {found}, expected {expected}")]
    OutOfRange {
        /// Which point, from 0.
        index: usize,
        /// `value`, `color` or `opacity`.
        field: &'static str,
        /// The number found.
        found: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// Values must not decrease.
    #[error(
        "transfer function point {index}: value {found} comes after {previous}; values must not decrease"
    )]
    Order {
        /// Which point, from 0.
        index: usize,
        /// Its value.
        found: f64,
        /// The value before it.
        previous: f64,
    },
}

/// A piecewise-linear map from value to colour and opacity per unit distance.
///
/// Values outside the points take the nearest point's colour and opacity. Two points at one value make a step; the
/// step's own value belongs to its upper side.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    points: Vec<ControlPoint>,
}

impl TransferFunction {
    /// Checks and takes over the points; values must not decrease.
    pub fn new(points: Vec<ControlPoint>) -> Result<Self, TransferFunctionError> {
        if points.is_empty() {
            return Err(TransferFunctionError::Empty);
        }
        for (index, p) in points.iter().enumerate() {
            let out =
                |field, found, expected| TransferFunctionError::OutOfRange { index, field, found, expected };
            if !p.value.is_finite() {
                return Err(out("value", p.value, "a finite number"));
            }
            if let Some(&c) = p.color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
                return Err(out("color", c, "0 to 1"));
            }
            if !(0.0..=1.0).contains(&p.opacity) {
                return Err(out("opacity", p.opacity, "0 to 1"));
            }
            if index > 0 && p.value < points[index - 1].value {
                let previous = points[index - 1].value;
                return Err(TransferFunctionError::Order { index, found: p.value, previous });
            }
        }
        Ok(Self { points })
    }

    /// Joins separate colour and opacity functions (as VTK, ParaView and Slicer keep them) without loss: the result
    /// has a point wherever either has one. Each must be ordered by value.
    pub fn from_color_and_opacity(
        colors: &[(f64, [f64; 3])],
        opacities: &[(f64, f64)],
    ) -> Result<Self, TransferFunctionError> {
        let color_points = colors.iter().map(|&(value, color)| ControlPoint { value, color, opacity: 0.0 });
        let opacity_points =
            opacities.iter().map(|&(value, opacity)| ControlPoint { value, color: [0.0; 3], opacity });
        let color = Self::new(color_points.collect())?;
        let opacity = Self::new(opacity_points.collect())?;
        let mut values: Vec<f64> = color.points.iter().chain(&opacity.points).map(|p| p.value).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let mut points = Vec::new();
        for value in values {
            let below = ControlPoint { value, color: color.below(value).0, opacity: opacity.below(value).1 };
            let at =
                ControlPoint { value, color: color.evaluate(value).0, opacity: opacity.evaluate(value).1 };
            points.push(below);
            if at != below {
                points.push(at);
            }
        }
        Self::new(points)
    }

    /// The points, ordered by value.
    pub fn points(&self) -> &[ControlPoint] {
        &self.points
    }

    /// Colour and opacity per unit distance at a value.
    #[inline]
    pub fn evaluate(&self, value: f64) -> ([f64; 3], f64) {
        let upper = self.points.partition_point(|p| p.value <= value);
        self.between(upper, value)
    }

    /// As [`TransferFunction::evaluate`], but a step's own value belongs to its lower side.
    fn below(&self, value: f64) -> ([f64; 3], f64) {
        let upper = self.points.partition_point(|p| p.value < value);
        self.between(upper, value)
    }

    fn between(&self, upper: usize, value: f64) -> ([f64; 3], f64) {
        let last = self.points.len() - 1;
        let (a, b) = (&self.points[upper.saturating_sub(1)], &self.points[upper.min(last)]);
        let width = b.value - a.value;
        let w = if width > 0.0 { (value - a.value) / width } else { 0.0 };
        let mix = |p: f64, q: f64| p + (q - p) * w;
        (std::array::from_fn(|c| mix(a.color[c], b.color[c])), mix(a.opacity, b.opacity))
    }

    /// Every opacity multiplied by `factor` (global brightness) and clamped to 1; a point is added where a ramp
    /// reaches 1 between two points, so that the result stays exactly piecewise linear.
    pub fn with_brightness(&self, factor: f64) -> Self {
        if factor == 1.0 {
            return self.clone();
        }
        let scaled = |p: &ControlPoint| ControlPoint { opacity: (p.opacity * factor).min(1.0), ..*p };
        let mut points = Vec::with_capacity(self.points.len());
        for (index, p) in self.points.iter().enumerate() {
            if let Some(q) = index.checked_sub(1).map(|i| self.points[i]) {
                let (a, b) = (q.opacity * factor, p.opacity * factor);
                if (a - 1.0) * (b - 1.0) < 0.0 {
                    let value = q.value + (p.value - q.value) * (1.0 - a) / (b - a);
                    let (color, _) = self.evaluate(value);
                    points.push(ControlPoint { value, color, opacity: 1.0 });
                }
            }
            points.push(scaled(p));
        }
        Self { points }
    }

    /// The values at which the function bends or steps, or its extinction meets the clamp; ascending, distinct.
    pub fn knots(&self) -> Vec<f64> {
        let mut knots: Vec<f64> = self.points.iter().map(|p| p.value).collect();
        for pair in self.points.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            if (a.opacity - MAX_OPACITY) * (b.opacity - MAX_OPACITY) < 0.0 {
                let w = (MAX_OPACITY - a.opacity) / (b.opacity - a.opacity);
                knots.push(a.value + w * (b.value - a.value));
            }
        }
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        knots
    }

    /// The largest opacity that any value in `lo..=hi` has.
    pub fn max_opacity(&self, lo: f64, hi: f64) -> f64 {
        let inside = self.points.iter().filter(|p| (lo..=hi).contains(&p.value)).map(|p| p.opacity);
        inside.fold(self.evaluate(lo).1.max(self.evaluate(hi).1), f64::max)
    }

    /// The steepest change of any channel per unit of value, steps left out.
    fn max_slope(&self) -> f64 {
        let slope = |pair: &[ControlPoint]| {
            let width = pair[1].value - pair[0].value;
            let rise = (0..3).map(|c| (pair[1].color[c] - pair[0].color[c]).abs());
            let rise = rise.fold((pair[1].opacity - pair[0].opacity).abs(), f64::max);
            if width > 0.0 { rise / width } else { 0.0 }
        };
        self.points.windows(2).map(slope).fold(0.0, f64::max)
    }
}

/// A transfer function sampled for kernels, indexed by *stored* numbers (see [`crate::volume::Rescale`]).
///
/// Entry `i` is the function at `lo + i * bin`; a look-up takes the nearest entry. So a look-up equals the function
/// at a value that is off by at most half a bin: for 16-bit data and [`ClassificationTable::MAX_ENTRIES`] entries by
/// at most half a stored unit. Where no step is near, colour and opacity are off by at most
/// [`ClassificationTable::TOLERANCE`], or by half a bin's slope when the table has reached its largest size.
#[derive(Clone, Debug)]
pub struct ClassificationTable {
    /// Red, green, blue and *opacity per unit distance* of each entry.
    entries: Vec<[f32; 4]>,
    lo: f32,
    bins_per_unit: f32,
    /// `visible_before[i]`: how many of the entries before `i` have an opacity above zero.
    visible_before: Vec<u32>,
}

impl ClassificationTable {
    /// Entries of the smallest table.
    pub const MIN_ENTRIES: usize = 1024;
    /// Entries of the largest table.
    pub const MAX_ENTRIES: usize = 65536;
    /// Largest error of colour and opacity away from steps, if [`Self::MAX_ENTRIES`] suffice for it.
    pub const TOLERANCE: f64 = 1.0 / 1024.0;

    /// Samples `function` over a volume's stored range.
    pub fn new(function: &TransferFunction, rescale: crate::volume::Rescale, stored_range: [f32; 2]) -> Self {
        let [lo, hi] = stored_range;
        let width = f64::from(hi) - f64::from(lo);
        let slope = function.max_slope() * rescale.slope.abs();
        let mut size = Self::MIN_ENTRIES;
        while size < Self::MAX_ENTRIES && slope * width / (size - 1) as f64 / 2.0 > Self::TOLERANCE {
            size *= 2;
        }
        let bin = width / (size - 1) as f64;
        let entries: Vec<[f32; 4]> = (0..size)
            .map(|i| {
                let (c, opacity) = function.evaluate(rescale.value(f64::from(lo) + i as f64 * bin));
                [c[0] as f32, c[1] as f32, c[2] as f32, opacity as f32]
            })
            .collect();
        let mut visible_before = Vec::with_capacity(size + 1);
        let mut count = 0u32;
        visible_before.push(count);
        for e in &entries {
            count += u32::from(e[3] > 0.0);
            visible_before.push(count);
        }
        let bins_per_unit = if width > 0.0 { (1.0 / bin) as f32 } else { 0.0 };
        Self { entries, lo, bins_per_unit, visible_before }
    }

    /// Red, green, blue and opacity per unit distance of each entry.
    pub fn entries(&self) -> &[[f32; 4]] {
        &self.entries
    }

    /// The stored number of the first entry and the entries per stored unit: `index = (stored - lo) * scale + 0.5`,
    /// truncated and clamped.
    pub fn index_map(&self) -> (f32, f32) {
        (self.lo, self.bins_per_unit)
    }

    /// The entry that a look-up of `stored` takes.
    #[inline]
    pub fn index(&self, stored: f32) -> usize {
        let i = (stored - self.lo) * self.bins_per_unit + 0.5;
        (i.max(0.0) as usize).min(self.entries.len() - 1)
    }

    /// Whether any look-up of a stored number in `lo..=hi` is visible. One entry more on either side is taken in, for
    /// the rounding of interpolation.
    #[inline]
    pub fn visible(&self, lo: f32, hi: f32) -> bool {
        let (first, end) = self.entries_of(lo, hi);
        self.visible_before[end] > self.visible_before[first]
    }

    /// Whether every look-up of a stored number in `lo..=hi` is visible.
    #[inline]
    pub fn all_visible(&self, lo: f32, hi: f32) -> bool {
        let (first, end) = self.entries_of(lo, hi);
        (self.visible_before[end] - self.visible_before[first]) as usize == end - first
    }

    fn entries_of(&self, lo: f32, hi: f32) -> (usize, usize) {
        (self.index(lo).saturating_sub(1), (self.index(hi) + 2).min(self.entries.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Rescale;
    use proptest::prelude::*;

    fn point(value: f64, gray: f64, opacity: f64) -> ControlPoint {
        ControlPoint { value, color: [gray; 3], opacity }
    }

    #[test]
    fn values_outside_take_the_nearest_point_and_steps_belong_to_their_upper_side() {
        let f = TransferFunction::new(vec![
            point(10.0, 0.0, 0.25),
            point(20.0, 1.0, 0.75),
            point(20.0, 0.5, 0.0),
            point(30.0, 0.5, 1.0),
        ])
        .unwrap();
        assert_eq!(f.evaluate(-5.0), ([0.0; 3], 0.25));
        assert_eq!(f.evaluate(15.0), ([0.5; 3], 0.5));
        assert_eq!(f.evaluate(20.0), ([0.5; 3], 0.0));
        assert_eq!(f.evaluate(99.0), ([0.5; 3], 1.0));
        assert_eq!(f.max_opacity(0.0, 20.0), 0.75);
    }

    #[test]
    fn points_out_of_order_or_range_are_refused() {
        assert_eq!(TransferFunction::new(vec![]), Err(TransferFunctionError::Empty));
        let order = TransferFunction::new(vec![point(2.0, 0.0, 0.0), point(1.0, 0.0, 0.0)]);
        assert!(matches!(order, Err(TransferFunctionError::Order { index: 1, .. })));
        for bad in [point(f64::NAN, 0.0, 0.0), point(0.0, 1.5, 0.0), point(0.0, 0.0, f64::NAN)] {
            let found = TransferFunction::new(vec![bad]);
            assert!(matches!(found, Err(TransferFunctionError::OutOfRange { index: 0, .. })));
        }
    }

    #[test]
    fn separate_colour_and_opacity_join_without_loss() {
        let colors =
            [(0.0, [0.0, 0.0, 1.0]), (50.0, [1.0, 0.0, 0.0]), (50.0, [0.0, 1.0, 0.0]), (100.0, [1.0; 3])];
        let opacities = [(20.0, 0.0), (80.0, 0.6)];
        let f = TransferFunction::from_color_and_opacity(&colors, &opacities).unwrap();
        assert_eq!(f.points().len(), 6);
        assert_eq!(f.evaluate(25.0).0, [0.5, 0.0, 0.5]);
        assert_eq!(f.evaluate(50.0).0, [0.0, 1.0, 0.0]);
        assert!((f.evaluate(50.0).1 - 0.3).abs() < 1e-12);
    }

    #[test]
    fn brightness_clamps_at_one_with_a_point_of_its_own() {
        let f = TransferFunction::new(vec![point(0.0, 0.0, 0.0), point(10.0, 1.0, 1.0)]).unwrap();
        let bright = f.with_brightness(2.0);
        assert_eq!(bright.points()[1], point(5.0, 0.5, 1.0));
        for v in [0.0, 2.0, 4.9, 5.0, 7.5, 10.0] {
            assert!((bright.evaluate(v).1 - (f.evaluate(v).1 * 2.0).min(1.0)).abs() < 1e-12, "at {v}");
        }
    }

    #[test]
    fn extinction_inverts_opacity_and_is_clamped() {
        let sigma = extinction(0.5, 2.0);
        assert!((-f64::exp_m1(-sigma * 2.0) - 0.5).abs() < 1e-15);
        assert!(extinction(1.0, 1.0) < 13.9 && extinction(1.0, 1.0) > 13.8);
    }

    proptest! {
        /// The bound of the docs: a look-up is the function at a value at most half a bin away.
        #[test]
        fn a_look_up_is_the_function_within_half_a_bin(
            rises in prop::collection::vec((0.0f64..3000.0, 0.0f64..=1.0, 0.0f64..=1.0), 1..12),
            stored in 0.0f32..65535.0,
        ) {
            let mut value = -500.0;
            let points = rises.iter().map(|&(d, gray, opacity)| { value += d; point(value, gray, opacity) });
            let f = TransferFunction::new(points.collect()).unwrap();
            let rescale = Rescale { slope: 0.5, intercept: -1024.0 };
            let table = ClassificationTable::new(&f, rescale, [0.0, 65535.0]);
            let bin = 65535.0 / (table.entries().len() - 1) as f64;
            let entry = table.entries()[table.index(stored)];
            // f32 rounding of the index moves the value by a little more than half a bin.
            let reach = 0.5 * bin + 0.01;
            let (lo, hi) = (f64::from(stored) - reach, f64::from(stored) + reach);
            let candidates = (0..=64).map(|i| f.evaluate(rescale.value(lo + (hi - lo) * f64::from(i) / 64.0)).1);
            let knots = f.points().iter().filter(|p| (rescale.value(lo)..=rescale.value(hi)).contains(&p.value)).map(|p| p.opacity);
            let (least, most) = candidates.chain(knots).fold((f64::MAX, f64::MIN), |(a, b), o| (a.min(o), b.max(o)));
            prop_assert!((least - 1e-6..=most + 1e-6).contains(&f64::from(entry[3])));
            if table.entries().len() < ClassificationTable::MAX_ENTRIES {
                let exact = f.evaluate(rescale.value(f64::from(stored))).1;
                let steps = f.points().windows(2).any(|w| w[0].value == w[1].value);
                prop_assert!(steps || (exact - f64::from(entry[3])).abs() <= ClassificationTable::TOLERANCE * 1.01);
            }
        }

        #[test]
        fn visible_never_misses_a_look_up(
            lo in 0.0f32..255.0, width in 0.0f32..40.0, at in 0.0f32..=1.0, ramp in 0.0f64..255.0,
        ) {
            let f = TransferFunction::new(vec![point(ramp, 0.0, 0.0), point(ramp + 3.0, 1.0, 0.5), point(ramp + 6.0, 1.0, 0.0)]).unwrap();
            let table = ClassificationTable::new(&f, Rescale::IDENTITY, [0.0, 255.0]);
            let stored = lo + width * at;
            if table.entries()[table.index(stored)][3] > 0.0 {
                prop_assert!(table.visible(lo, lo + width));
            }
        }
    }
}
