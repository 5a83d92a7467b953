//! The transfer function along the index of a look-up: stored numbers in, bins out.
//!
//! The stored range is cut into equal bins, in the order of *values* (a negative rescale slope turns it round). Every
//! knot of the function is moved to the nearest edge between bins. So a map that is linear in each bin can be exact,
//! steps and all.

use crate::transfer_function::{MAX_OPACITY, TransferFunction};
use crate::volume::Rescale;

/// Bins of the smallest and of the largest index.
const MIN_BINS: u32 = 2048;
pub(super) const MAX_BINS: u32 = 65536;

/// A ramp over the whole of a channel gets at least this many bins, if [`MAX_BINS`] suffice for it.
const BINS_PER_RAMP: f64 = 32.0;

/// Moving a knot may change a channel by this much, unless [`MAX_BINS`] force more.
const MOVE_TOLERANCE: f64 = 1.0 / 4096.0;

/// What the function is at one side of an edge: red, green, blue, opacity per unit distance (below its clamp).
pub(super) type Side = [f64; 4];

/// An edge at which the function bends or steps, or the range ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) edge: u32,
    pub(super) below: Side,
    pub(super) above: Side,
}

/// The change from one side to another, as far as it can be seen.
fn change(a: &Side, b: &Side) -> f64 {
    let color = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
    (a[3] - b[3]).abs().max(color * a[3].max(b[3]))
}

impl Stop {
    pub(super) fn is_step(&self) -> bool {
        change(&self.below, &self.above) > 0.0
    }
}

/// The function along the index.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    /// Ascending, at distinct edges; the first at edge 0, the last at edge [`Curve::bins`].
    pub(super) stops: Vec<Stop>,
    pub(super) bins: u32,
    /// `(stored - origin) * scale` is the position in bins.
    pub(super) origin: f32,
    pub(super) scale: f32,
}

impl Curve {
    pub(super) fn new(function: &TransferFunction, rescale: Rescale, [lo, hi]: [f32; 2]) -> Self {
        let width = f64::from(hi) - f64::from(lo);
        let (origin, sign) = if rescale.slope < 0.0 { (hi, -1.0) } else { (lo, 1.0) };
        if !(width > 0.0 && (f64::from(MAX_BINS) / width) < f64::from(f32::MAX)) {
            return Self::constant(side(function, rescale.value(f64::from(lo))), lo);
        }
        // Knots as shares of the range, with both sides.
        let share = |value: f64| (rescale.stored(value) - f64::from(origin)) * sign / width;
        let knots: Vec<(f64, Side, Side)> = function
            .knots()
            .into_iter()
            .map(|value| (share(value), below(function, value), side(function, value)))
            .filter(|knot| (-1e-9..=1.0 + 1e-9).contains(&knot.0))
            .map(|knot| (knot.0.clamp(0.0, 1.0), knot.1, knot.2))
            .collect();
        let ends = [0.0, 1.0].map(|share| {
            let stored = f64::from(origin) + sign * share * width;
            side(function, rescale.value(stored))
        });
        let bins = bins_for(&knots, width);
        let mut scale = (f64::from(bins) / width) as f32;
        // The far end must reach the last edge whatever the rounding.
        while (hi - lo) * scale < bins as f32 {
            scale = scale.next_up();
        }
        Self { stops: stops(&knots, ends, bins), bins, origin, scale: scale * sign as f32 }
    }

    /// A range of one number: every look-up takes the first bin.
    fn constant(side: Side, origin: f32) -> Self {
        let bins = 4;
        let stops = [0, bins].map(|edge| Stop { edge, below: side, above: side });
        Self { stops: stops.to_vec(), bins, origin, scale: 0.0 }
    }

    /// The function between stops `piece` and `piece + 1`, at a position in bins.
    pub(super) fn at(&self, piece: usize, x: f64) -> Side {
        let (a, b) = (&self.stops[piece], &self.stops[piece + 1]);
        let w = (x - f64::from(a.edge)) / f64::from(b.edge - a.edge);
        std::array::from_fn(|c| a.above[c] + (b.below[c] - a.above[c]) * w)
    }

    /// The piece that holds the bin above `edge`; the last one for the last edge.
    pub(super) fn piece(&self, edge: u32) -> usize {
        let after = self.stops.partition_point(|s| s.edge <= edge);
        after.saturating_sub(1).min(self.stops.len() - 2)
    }

    /// The function at an edge's upper or lower side.
    pub(super) fn side(&self, edge: u32, upper: bool) -> Side {
        match self.stops.binary_search_by_key(&edge, |s| s.edge) {
            Ok(i) if upper => self.stops[i].above,
            Ok(i) => self.stops[i].below,
            Err(_) => self.at(self.piece(edge), f64::from(edge)),
        }
    }
}

fn side(function: &TransferFunction, value: f64) -> Side {
    let ([r, g, b], opacity) = function.evaluate(value);
    [r, g, b, opacity.clamp(0.0, MAX_OPACITY)]
}

/// The function just below a value: of several points at one value, the first one's.
fn below(function: &TransferFunction, value: f64) -> Side {
    let points = function.points();
    match points.get(points.partition_point(|p| p.value < value)) {
        Some(p) if p.value == value => {
            [p.color[0], p.color[1], p.color[2], p.opacity.clamp(0.0, MAX_OPACITY)]
        }
        _ => side(function, value),
    }
}

/// How many bins a function needs. Whole stored numbers lie on edges if the range has a whole width.
fn bins_for(knots: &[(f64, Side, Side)], width: f64) -> u32 {
    let whole = width.fract() == 0.0 && width <= f64::from(MAX_BINS);
    let mut bins = if whole {
        let width = width as u32;
        width * MIN_BINS.div_ceil(width)
    } else {
        MIN_BINS
    };
    while bins * 2 <= MAX_BINS && !resolves(bins, knots) {
        bins *= 2;
    }
    bins
}

fn resolves(bins: u32, knots: &[(f64, Side, Side)]) -> bool {
    let at = |knot: &(f64, Side, Side)| knot.0 * f64::from(bins);
    let moved = |knot: &(f64, Side, Side)| (at(knot) - at(knot).round()).abs();
    let ramp = |pair: &[(f64, Side, Side)]| {
        let (rise, run) = (change(&pair[0].2, &pair[1].1), at(&pair[1]) - at(&pair[0]));
        let moved = moved(&pair[0]).max(moved(&pair[1]));
        run >= BINS_PER_RAMP * rise && moved * rise <= MOVE_TOLERANCE * run
    };
    let step = |knot: &(f64, Side, Side)| moved(knot) * change(&knot.1, &knot.2) <= MOVE_TOLERANCE;
    knots.windows(2).all(ramp) && knots.iter().all(step)
}

/// Knots on edges. Those that fall on one edge become one step; those around which nothing is visible are left out.
fn stops(knots: &[(f64, Side, Side)], ends: [Side; 2], bins: u32) -> Vec<Stop> {
    let mut stops = vec![Stop { edge: 0, below: ends[0], above: ends[0] }];
    for (share, below, above) in knots {
        let edge = (share * f64::from(bins)).round() as u32;
        match stops.last_mut() {
            Some(last) if last.edge == edge => last.above = *above,
            _ => stops.push(Stop { edge, below: *below, above: *above }),
        }
    }
    if stops.last().is_some_and(|last| last.edge < bins) {
        stops.push(Stop { edge: bins, below: ends[1], above: ends[1] });
    }
    // Nothing is looked up below the first edge.
    stops[0].below = stops[0].above;
    let kept = |i: usize| {
        i == 0 || i + 1 == stops.len() || {
            let around = [stops[i - 1].above, stops[i].below, stops[i].above, stops[i + 1].below];
            around.iter().any(|side| side[3] > 0.0)
        }
    };
    (0..stops.len()).filter(|&i| kept(i)).map(|i| stops[i]).collect()
}
