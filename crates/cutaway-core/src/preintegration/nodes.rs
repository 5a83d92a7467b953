//! Where the table's nodes lie: placed where they lessen the error of interpolation most.
//!
//! The error of a cell is estimated from a model that needs no integration along a ray: opacity in closed form, colour
//! and centre of a segment's emission without its attenuation of itself.

use super::curve::{Curve, Side, Stop};
use super::integral::Extinction;
use super::node::Node;

/// Errors that are worth a node, one after the other, until there are no more nodes to give; for steps of [`USUAL_STEP`] and
/// longer. Shorter steps are more steps, over which errors add up: they get smaller ones, in proportion.
const TOLERANCES: [f64; 7] = [0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.00015];

/// The step, in unit distances, below which errors must shrink with the step.
const USUAL_STEP: f64 = 0.25;

/// A node and the integrals up to it.
#[derive(Clone, Copy)]
struct Sample {
    node: Node,
    x: f64,
    side: Side,
    /// Extinction at the node, of a whole step.
    sigma: f64,
    /// Integral of extinction, and of extinction times red, green, blue and position.
    s: f64,
    g: [f64; 4],
}

struct Placement<'a> {
    curve: &'a Curve,
    extinction: Extinction,
    /// Integrals at each stop.
    at_stops: Vec<(f64, [f64; 4])>,
}

/// At most `most` nodes, ascending; two at least.
pub(super) fn place(curve: &Curve, extinction: Extinction, most: usize) -> Vec<Node> {
    let placement = Placement::new(curve, extinction);
    let sides = |stop: &Stop| if stop.is_step() { 2 } else { 1 };
    let needed: usize = curve.stops.iter().map(sides).sum();
    let ends = [curve.stops[0], curve.stops[curve.stops.len() - 1]];
    // So many knots that they leave too little for what is between them compete like any other edge.
    let first: &[Stop] = if needed <= most * 3 / 4 { &curve.stops } else { &ends };
    let mut samples: Vec<Sample> = first.iter().flat_map(|stop| placement.samples(stop.edge)).collect();
    let mut errors: Vec<Option<f64>> = vec![None; samples.len() - 1];
    let scale = (extinction.step_length / extinction.unit_distance / USUAL_STEP).clamp(1e-6, 1.0);
    for tolerance in TOLERANCES.map(|tolerance| tolerance * scale) {
        while samples.len() < most {
            for (i, error) in errors.iter_mut().enumerate() {
                error.get_or_insert_with(|| placement.error(&samples, i));
            }
            let mut worst: Vec<(f64, usize)> = errors
                .iter()
                .enumerate()
                .filter_map(|(i, e)| e.filter(|e| *e > tolerance).map(|e| (e, i)))
                .collect();
            if worst.is_empty() {
                break;
            }
            worst.sort_by(|a, b| b.0.total_cmp(&a.0));
            let before = samples.len();
            (samples, errors) = placement.split(&samples, &errors, &worst, most);
            if samples.len() == before {
                break;
            }
        }
    }
    samples.iter().map(|s| s.node).collect()
}

impl<'a> Placement<'a> {
    fn new(curve: &'a Curve, extinction: Extinction) -> Self {
        let mut this = Self { curve, extinction, at_stops: vec![(0.0, [0.0; 4])] };
        for piece in 0..curve.stops.len() - 1 {
            let upto = this.integrals(piece, curve.stops[piece + 1].edge);
            this.at_stops.push(upto);
        }
        this
    }

    /// The integrals up to an edge of a piece.
    fn integrals(&self, piece: usize, edge: u32) -> (f64, [f64; 4]) {
        let (s, mut g) = self.at_stops[piece];
        let stop = &self.curve.stops[piece];
        let (from, to) = (f64::from(stop.edge), f64::from(edge));
        let (a, b) = (stop.above, self.curve.at(piece, to));
        let sum = self.extinction.mean(a[3], b[3]) * (to - from);
        let tilt = self.extinction.tilt(a[3], b[3]) * (to - from);
        let ends = [(a[0], b[0]), (a[1], b[1]), (a[2], b[2]), (from, to)];
        for (g, (a, b)) in g.iter_mut().zip(ends) {
            *g += 0.5 * ((a + b) * sum + (b - a) * tilt);
        }
        (s + sum, g)
    }

    fn sample(&self, edge: u32, upper: bool) -> Sample {
        let piece = self.curve.piece(edge);
        let (s, g) = self.integrals(piece, edge);
        let side = self.curve.side(edge, upper);
        Sample {
            node: Node { edge, upper },
            x: f64::from(edge),
            side,
            sigma: self.extinction.of(side[3]),
            s,
            g,
        }
    }

    /// The nodes of an edge: one, or two at a step.
    fn samples(&self, edge: u32) -> impl Iterator<Item = Sample> + use<> {
        let stop = self.curve.stops.binary_search_by_key(&edge, |s| s.edge).map(|i| self.curve.stops[i]);
        let lower = stop.is_ok_and(|s| s.is_step()).then(|| self.sample(edge, false));
        lower.into_iter().chain([self.sample(edge, true)])
    }

    /// Where an interval is split: at the knot nearest to its middle, or there.
    fn split_edge(&self, a: &Sample, b: &Sample) -> Option<u32> {
        let (from, to) = (a.node.edge, b.node.edge);
        let middle = from + (to - from) / 2;
        let stops = &self.curve.stops;
        let first = stops.partition_point(|s| s.edge <= from);
        let inside = &stops[first..stops.partition_point(|s| s.edge < to).max(first)];
        let nearest = inside.iter().map(|s| s.edge).min_by_key(|e| e.abs_diff(middle));
        nearest.or((middle > from).then_some(middle))
    }

    /// The error of leaving interval `i` unsplit. It is weighed by the interval's width, and so by how often segments end
    /// there; the fourth root of it does best (mean and worst error over random functions): around a step the error
    /// itself never falls, only the stretch that has it shrinks.
    fn error(&self, samples: &[Sample], i: usize) -> f64 {
        let (a, b) = (&samples[i], &samples[i + 1]);
        let Some(edge) = self.split_edge(a, b) else { return 0.0 };
        let middle = self.sample(edge, true);
        let w = (middle.x - a.x) / (b.x - a.x);
        let mut worst = 0.0f64;
        let mut check = |exact: [f64; 5], from: [f64; 5], to: [f64; 5]| {
            for c in 0..5 {
                worst = worst.max((exact[c] - from[c] - (to[c] - from[c]) * w).abs());
            }
        };
        let mut offset = 0;
        while offset < samples.len() {
            for j in [i.checked_sub(offset), Some(i + 1 + offset)].into_iter().flatten() {
                if let Some(other) = samples.get(j) {
                    check(model(&middle, other), model(a, other), model(b, other));
                }
            }
            offset = (offset * 2).max(offset + 1);
        }
        let mix = |p: [f64; 5], q: [f64; 5]| std::array::from_fn(|c| p[c] + (q[c] - p[c]) * w);
        check(model(&middle, &middle), mix(model(a, a), model(a, b)), mix(model(b, a), model(b, b)));
        worst * ((b.x - a.x) / f64::from(self.curve.bins)).powf(0.25)
    }

    /// Splits the `worst` intervals (worst first) as far as there are nodes to give.
    fn split(
        &self,
        samples: &[Sample],
        errors: &[Option<f64>],
        worst: &[(f64, usize)],
        most: usize,
    ) -> (Vec<Sample>, Vec<Option<f64>>) {
        let mut room = most - samples.len();
        let mut new: Vec<(usize, Vec<Sample>)> = Vec::new();
        for &(_, i) in worst {
            let Some(edge) = self.split_edge(&samples[i], &samples[i + 1]) else { continue };
            let nodes: Vec<Sample> = self.samples(edge).collect();
            if nodes.len() <= room {
                room -= nodes.len();
                new.push((i, nodes));
            }
        }
        new.sort_by_key(|n| n.0);
        let mut new = new.into_iter().peekable();
        let (mut all, mut all_errors) = (Vec::with_capacity(most), Vec::with_capacity(most));
        for (i, sample) in samples.iter().enumerate() {
            all.push(*sample);
            match new.next_if(|n| n.0 == i) {
                Some((_, nodes)) => {
                    all_errors.resize(all_errors.len() + nodes.len() + 1, None);
                    all.extend(nodes);
                }
                None => all_errors.extend(errors.get(i)),
            }
        }
        (all, all_errors)
    }
}

/// Opacity of a segment between two nodes, its colour and its share of back weight, as the model has them.
fn model(a: &Sample, b: &Sample) -> [f64; 5] {
    let width = b.x - a.x;
    let (depth, mean) = if width == 0.0 {
        let sigma = 0.5 * (a.sigma + b.sigma);
        let color = |c: usize| 0.5 * (a.side[c] * a.sigma + b.side[c] * b.sigma) / sigma;
        (sigma, [color(0), color(1), color(2), 0.5])
    } else {
        let sum = b.s - a.s;
        let mean: [f64; 4] = std::array::from_fn(|c| (b.g[c] - a.g[c]) / sum);
        (sum / width, [mean[0], mean[1], mean[2], (mean[3] - a.x) / width])
    };
    if depth > 0.0 {
        let opacity = -f64::exp_m1(-depth);
        let [r, g, b, u] = mean.map(|m| m * opacity);
        [opacity, r, g, b, u]
    } else {
        [0.0; 5]
    }
}
