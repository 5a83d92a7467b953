//! Pre-integrated classification: what a whole step adds, when the field is linear along it.
//!
//! Classifying samples one by one misses whatever the transfer function does between the values of two neighbours. Here
//! a *pair* of values, at the front and at the back of a step, is looked up (Röttger, Kraus and Ertl 2000; Engel, Kraus
//! and Ertl 2001), and what comes back is exact for a field, and a light, that are linear between both, up to
//! interpolation in the table. With `v(u) = v0 + u (v1 - v0)`, `u` from 0 to 1 over a step of world length `d`, and
//! `T(u) = exp(-d ∫ sigma)` up to `u`, the table holds
//!
//! ```text
//! front weights   C_front = ∫ c sigma d T (1 - u) du      A_front = ∫ sigma d T (1 - u) du
//! back weights    C_back  = ∫ c sigma d T u du            A_back  = ∫ sigma d T u du
//! ```
//!
//! Unlit, a step adds colour `C_front + C_back` (premultiplied) and opacity `A_front + A_back` = `1 - T(1)`. Lit by a
//! factor that goes from `l0` to `l1` and white that goes from `w0` to `w1` ([`crate::lighting::Lighting::terms`]), it
//! adds `C_front l0 + C_back l1 + A_front w0 + A_back w1`: light separated from material (Lum, Wilson and Ma 2004).
//!
//! # A look-up
//! Bins turn a stored number into a coordinate among the table's nodes; once a sample, since a step's back is the next
//! one's front. Nodes lie on every knot of the function and densely where that lessens the error; a step of the
//! function is a jump of the coordinate by one, which no look-up ever lands in. Then four entries are interpolated:
//!
//! ```text
//! (origin, scale) = index_map()
//! x = min(max((stored - origin) * scale, 0), bins().len() - 1)     scale may be negative or zero
//! i = trunc(x);  coordinate = bins()[i][0] + (x - i) * bins()[i][1]
//! f = min(trunc(coordinate of the front), size() - 2),  fw = coordinate - f;   b, bw likewise of the back
//! row = entries()[f * size() + b], [.. + b + 1];  next row = entries()[(f + 1) * size() + b], [.. + b + 1]
//! ```
//!
//! The last step of a segment is shorter. Its values must be those at its own ends; the table is that of a whole step,
//! of opacity `A`. The opacity of a share `s` of the length is `A' = 1 - (1 - A)^s`, exactly; all eight entries times
//! `A' / A` are right to first order in the opacity.
//!
//! # How exact
//! - Entries at nodes are within 1e-4 of the integral.
//! - Knots of the function are moved to the nearest edge between bins: by half a bin at most, of which there are up to
//!   65536, and not at all where they are whole stored numbers and so is the range's width. Knots closer than a bin
//!   become one step. More bins are taken until this changes the function by less than 1/4096.
//! - Interpolation, at pairs of values of all distances and over steps of a quarter to one unit distance, puts an entry
//!   or a sum of front and back off by 7e-5 in the mean, 5e-4 at the 99th percentile and 4e-2 at worst, over random
//!   functions of up to ten points. The worst all cross a step up to, or down from, opacity 1. For the CT presets
//!   ([`crate::presets`]) it is 4e-5, 4e-4 and 2e-3. Values on either side of a step and both within a bin of it give
//!   something between both sides.
//! - Opacities interpolate better than the optical depths that they come from, by a third, so they are what is kept.
//! - A function of more than about 190 visible knots has no node for each. Entries are as exact as ever; interpolation
//!   then goes over knots, and over steps, where that does least harm: none to a smooth function of hundreds of points,
//!   but of 600 zigzags between an opacity and twice that, look-ups are off by 2e-2 in the mean.

mod curve;
mod exact;
mod integral;
mod node;
mod nodes;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub use exact::exact_segment;

use crate::transfer_function::TransferFunction;
use crate::volume::Rescale;
use curve::Curve;
use integral::{Entry, Extinction, Integrals};
use node::Node;

/// The table of one transfer function, step length and volume; see the module for what it holds and how it is read.
///
/// It is made anew on an edit or a change of step: in 0.1 to 1 ms for a preset, up to 7 ms for ten points with walls and
/// 10 to 30 ms for hundreds of knots, on two cores. It takes at most 2.5 MiB; a preset's, of 30 to 100 nodes, a tenth of
/// that.
#[derive(Clone, Debug)]
pub struct Preintegration {
    /// Rows of one front value: back value fastest.
    entries: Vec<Entry>,
    size: usize,
    /// Coordinate at a bin's start, and its growth over the bin; one more for the far end of the range.
    bins: Vec<[f32; 2]>,
    origin: f32,
    scale: f32,
}

impl Preintegration {
    /// Most nodes along each side of the table.
    pub const MAX_SIZE: usize = 256;

    /// Integrates `function`, of opacities per `unit_distance`, over steps of `step_length` (both world lengths above
    /// 0), for a volume's stored range.
    pub fn new(
        function: &TransferFunction,
        unit_distance: f64,
        step_length: f64,
        rescale: Rescale,
        stored_range: [f32; 2],
    ) -> Self {
        let curve = Curve::new(function, rescale, stored_range);
        let extinction = Extinction { unit_distance, step_length };
        let nodes = nodes::place(&curve, extinction, Self::MAX_SIZE);
        let integrals = Integrals::new(&curve, extinction, &nodes);
        let size = nodes.len();
        let mut entries = vec![[0.0; 8]; size * size];
        entries.par_chunks_mut(size).enumerate().for_each(|(front, row)| {
            for (back, entry) in row.iter_mut().enumerate() {
                *entry = integrals.entry(front, back);
            }
        });
        Self { entries, size, bins: bins(&nodes), origin: curve.origin, scale: curve.scale }
    }

    /// Nodes along each side of the table; 2 to [`Self::MAX_SIZE`].
    pub fn size(&self) -> usize {
        self.size
    }

    /// `size * size` entries, the back node fastest: front weights (red, green, blue, opacity), then back weights.
    pub fn entries(&self) -> &[[f32; 8]] {
        &self.entries
    }

    /// The entries of unlit steps, in the same order: premultiplied colour, and opacity. Made at each call.
    pub fn unlit_entries(&self) -> Vec<[f32; 4]> {
        self.entries.iter().map(|e| std::array::from_fn(|c| e[c] + e[c + 4])).collect()
    }

    /// Of each bin, the coordinate at its start and its growth over the bin; 5 to 65537 of them.
    pub fn bins(&self) -> &[[f32; 2]] {
        &self.bins
    }

    /// The stored number at the start of bin 0, and bins per stored unit: negative where values fall as stored numbers
    /// rise, zero where the range is a single number.
    pub fn index_map(&self) -> (f32, f32) {
        (self.origin, self.scale)
    }

    /// The coordinate of a stored number among the nodes, `0..=size - 1`; numbers outside the range take its ends'.
    #[inline]
    pub fn coordinate(&self, stored: f32) -> f32 {
        // `max` first: not-a-numbers become 0.
        let x = ((stored - self.origin) * self.scale).max(0.0).min((self.bins.len() - 1) as f32);
        let bin = x as usize;
        let [start, growth] = self.bins[bin];
        start + (x - bin as f32) * growth
    }

    /// A look-up of stored numbers at the front and back of a step, as kernels do it.
    pub fn evaluate(&self, stored_front: f32, stored_back: f32) -> [f64; 8] {
        let (f, fw) = self.cell(stored_front);
        let (b, bw) = self.cell(stored_back);
        let row = |f: usize, c: usize| {
            let at = |b: usize| f64::from(self.entries[f * self.size + b][c]);
            at(b) + (at(b + 1) - at(b)) * bw
        };
        std::array::from_fn(|c| row(f, c) + (row(f + 1, c) - row(f, c)) * fw)
    }

    /// The node below a stored number, with one above it, and the share of the way to that.
    fn cell(&self, stored: f32) -> (usize, f64) {
        let coordinate = self.coordinate(stored);
        let node = (coordinate as usize).min(self.size - 2);
        (node, f64::from(coordinate) - node as f64)
    }
}

/// The map from bins to coordinates.
fn bins(nodes: &[Node]) -> Vec<[f32; 2]> {
    let mut bins = Vec::new();
    for (k, pair) in nodes.windows(2).enumerate() {
        let width = pair[1].edge - pair[0].edge;
        let start = |i: u32| (k as f64 + f64::from(i) / f64::from(width)) as f32;
        bins.extend((0..width).map(|i| [start(i), 1.0 / width as f32]));
    }
    bins.push([(nodes.len() - 1) as f32, 0.0]);
    bins
}
