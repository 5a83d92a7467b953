//! What the tables approximate, slow and obvious: one segment by adaptive quadrature.

use crate::transfer_function::{TransferFunction, extinction};

/// A stretch is halved until that changes no entry by more than this.
const STEP_ERROR: f64 = 1e-11;

/// No stretch is shorter than one part in two to this power of a smooth piece.
const DEEPEST_HALVING: u32 = 24;

/// Transmittance below which nothing behind changes an entry.
const OPAQUE: f64 = 1e-13;

/// Nodes, weights and integration matrix of three-point Gauss-Legendre collocation on 0..1.
const ROOT15: f64 = 3.872_983_346_207_417;
const GAUSS_NODES: [f64; 3] = [0.5 - ROOT15 / 10.0, 0.5, 0.5 + ROOT15 / 10.0];
const GAUSS_WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
const GAUSS_PARTIAL: [[f64; 3]; 3] = [
    [5.0 / 36.0, 2.0 / 9.0 - ROOT15 / 15.0, 5.0 / 36.0 - ROOT15 / 30.0],
    [5.0 / 36.0 + ROOT15 / 24.0, 2.0 / 9.0, 5.0 / 36.0 - ROOT15 / 24.0],
    [5.0 / 36.0 + ROOT15 / 30.0, 2.0 / 9.0 + ROOT15 / 15.0, 5.0 / 36.0],
];

/// The entries of a segment of `length` (world units) along which the *value* runs linearly from `front` to `back`, by
/// adaptive quadrature: front weights (red, green, blue, opacity), then back weights, as in [`super::Preintegration`].
///
/// Orders of magnitude slower than a look-up; exact to about 1e-9.
pub fn exact_segment(
    function: &TransferFunction,
    unit_distance: f64,
    length: f64,
    front: f64,
    back: f64,
) -> [f64; 8] {
    let segment = Segment { function, unit_distance, length, front, back };
    let mut ends = vec![0.0, 1.0];
    if front != back {
        let crossings = function.knots().into_iter().map(|knot| (knot - front) / (back - front));
        ends.extend(crossings.filter(|u| (0.0..=1.0).contains(u)));
        ends.sort_by(f64::total_cmp);
    }
    let start = Sums { entries: [0.0; 8], transmittance: 1.0 };
    let whole = ends.windows(2).filter(|w| w[0] < w[1]);
    whole.fold(start, |sums, w| segment.integrate(sums, w[0], w[1], 0)).entries
}

struct Segment<'a> {
    function: &'a TransferFunction,
    unit_distance: f64,
    length: f64,
    front: f64,
    back: f64,
}

#[derive(Clone, Copy)]
struct Sums {
    entries: [f64; 8],
    transmittance: f64,
}

impl Segment<'_> {
    fn integrate(&self, sums: Sums, from: f64, to: f64, level: u32) -> Sums {
        if sums.transmittance < OPAQUE {
            return sums;
        }
        let middle = 0.5 * (from + to);
        let whole = self.step(sums, from, to);
        let halves = self.step(self.step(sums, from, middle), middle, to);
        let difference = whole.entries.iter().zip(halves.entries).map(|(a, b)| (a - b).abs());
        let difference = difference.fold((whole.transmittance - halves.transmittance).abs(), f64::max);
        // Three nodes alone may agree by chance, and do in a stretch so dense that all of them are behind a wall.
        let dense = halves.transmittance < 0.6 * sums.transmittance;
        if level > 1 && !dense && difference < STEP_ERROR || level == DEEPEST_HALVING {
            return halves;
        }
        let sums = self.integrate(sums, from, middle, level + 1);
        self.integrate(sums, middle, to, level + 1)
    }

    /// One stretch of three Gauss nodes.
    fn step(&self, mut sums: Sums, from: f64, to: f64) -> Sums {
        let nodes = GAUSS_NODES.map(|w| from + (to - from) * w);
        let samples = nodes.map(|u| {
            let (color, opacity) = self.function.evaluate(self.front + u * (self.back - self.front));
            (color, extinction(opacity, self.unit_distance) * self.length * (to - from))
        });
        for i in 0..3 {
            let before: f64 = (0..3).map(|j| GAUSS_PARTIAL[i][j] * samples[j].1).sum();
            let weight = sums.transmittance * (-before).exp() * GAUSS_WEIGHTS[i] * samples[i].1;
            let [r, g, b] = samples[i].0;
            for (channel, value) in [r, g, b, 1.0].into_iter().enumerate() {
                sums.entries[channel] += weight * value * (1.0 - nodes[i]);
                sums.entries[channel + 4] += weight * value * nodes[i];
            }
        }
        let depth: f64 = (0..3).map(|i| GAUSS_WEIGHTS[i] * samples[i].1).sum();
        sums.transmittance *= (-depth).exp();
        sums
    }
}
