//! The entries of segments between nodes, all of them fast.
//!
//! With `x` the position in bins and `S` the integral of extinction over `x`, a segment from `x0` to `x1` lets through
//! `T = exp(-k |S(x) - S(x0)|)` as far as `x`, where `k = 1 / |x1 - x0|`: only `k` knows the segment. So the index is cut
//! into leaves once, and for each leaf, each pair of leaves, each four... (panels) the moments
//!
//! ```text
//! ∫ c sigma t^m dx / m!,   ∫ c sigma y t^m dx / m!,   t and y from -1 to 1 in S and x over the panel
//! ```
//!
//! are kept; a panel that is not too dense for the segment adds the exponential's power series in them. A segment takes
//! few panels, however many knots it crosses.

use super::curve::{Curve, Side};
use super::node::Node;
use crate::transfer_function::extinction;

/// Powers of the series.
const ORDER: usize = 6;

/// A panel is used where its optical depth is at most this: the series then is off by at most
/// `(DENSE / 2)^ORDER / ORDER!` = 2.5e-4 of the panel's own share, 4e-5 on average, half of which scaling takes away.
const DENSE: f64 = 1.5;

/// A leaf is cut into at most this many; only steps of several unit distances through a wall need more.
const MAX_CUTS: f64 = 64.0;

/// A leaf whose share of every segment is less than one in so many need not be cut where its logarithm bends.
const SMALL_SHARE: f64 = 16.0;

/// Optical depth behind which nothing is added.
const OPAQUE: f64 = 12.0;

/// Nodes and weights of five-point Gauss-Legendre quadrature on -1..1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Turns opacity per unit distance into the optical depth of a whole step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extinction {
    pub(super) unit_distance: f64,
    pub(super) step_length: f64,
}

impl Extinction {
    pub(super) fn of(self, opacity: f64) -> f64 {
        extinction(opacity, self.unit_distance) * self.step_length
    }

    /// The mean while opacity goes from `a` to `b` linearly: of `-ln q`, in closed form.
    pub(super) fn mean(self, a: f64, b: f64) -> f64 {
        let (p, q) = (1.0 - a, 1.0 - b);
        let r = (p - q) / (p + q);
        if r.abs() < SERIES {
            let r = r * r;
            let more = r * (1.0 / 6.0 + r * (1.0 / 20.0 + r / 42.0));
            return self.of(0.5 * (a + b)) + more * self.step_length / self.unit_distance;
        }
        let mean = 1.0 - (p * p.ln() - q * q.ln()) / (p - q);
        mean * self.step_length / self.unit_distance
    }

    /// The mean of extinction times `y`, while `y` goes from -1 to 1 and opacity from `a` to `b` linearly.
    pub(super) fn tilt(self, a: f64, b: f64) -> f64 {
        let (p, q) = (1.0 - a, 1.0 - b);
        let r = (p - q) / (p + q);
        let tilt = if r.abs() < SERIES {
            let r2 = r * r;
            r * (1.0 / 3.0 + r2 * (1.0 / 15.0 + r2 * (1.0 / 35.0 + r2 / 63.0)))
        } else {
            // y = (p + q - 2 t) / (p - q) for t = 1 - opacity, and the integrals of ln t and t ln t.
            let zeroth = |t: f64| t * t.ln() - t;
            let first = |t: f64| t * t * (0.5 * t.ln() - 0.25);
            let d = p - q;
            (2.0 * (first(p) - first(q)) - (p + q) * (zeroth(p) - zeroth(q))) / (d * d)
        };
        tilt * self.step_length / self.unit_distance
    }
}

/// Where closed forms cancel, below this relative change, their series are taken: to 1e-12.
const SERIES: f64 = 0.05;

/// Front weights, then back weights: red, green, blue, opacity.
pub(super) type Entry = [f32; 8];

/// Moments of a stretch of the index.
#[derive(Clone, Copy, Default)]
struct Panel {
    /// Ends in `x` and in `S`.
    x: [f64; 2],
    s: [f64; 2],
    /// By power: of red, green, blue, opacity, then of the same times `y`; as shares of the panel's `S`.
    moments: [[f32; 8]; ORDER],
}

impl Panel {
    fn leaf(x: [f64; 2], sides: [Side; 2], s0: f64, extinction: Extinction) -> Self {
        let [a, b] = sides;
        let depth = extinction.mean(a[3], b[3]) * (x[1] - x[0]);
        let mut panel = Self { x, s: [s0, s0 + depth], moments: [[0.0; 8]; ORDER] };
        if depth <= 0.0 {
            return panel;
        }
        let mut moments = [[0.0f64; 8]; ORDER];
        for (y, weight) in GAUSS {
            let w = 0.5 + 0.5 * y;
            let side: Side = std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w);
            let upto = extinction.mean(a[3], side[3]) * (x[1] - x[0]) * w;
            let t = 2.0 * upto / depth - 1.0;
            let mut power = extinction.of(side[3]) * weight;
            for (m, row) in moments.iter_mut().enumerate() {
                for (c, v) in [side[0], side[1], side[2], 1.0].into_iter().enumerate() {
                    row[c] += power * v;
                    row[c + 4] += power * v * y;
                }
                power *= t / (m + 1) as f64;
            }
        }
        let scale = 1.0 / moments[0][3];
        panel.moments = moments.map(|row| row.map(|m| (m * scale) as f32));
        panel
    }

    /// Two neighbours as one.
    fn join(a: &Self, b: &Self) -> Self {
        let (x, s) = ([a.x[0], b.x[1]], [a.s[0], b.s[1]]);
        let mut panel = Self { x, s, moments: [[0.0; 8]; ORDER] };
        let (width, depth) = (x[1] - x[0], s[1] - s[0]);
        if depth <= 0.0 {
            return panel;
        }
        for child in [a, b] {
            let share = ((child.s[1] - child.s[0]) / depth) as f32;
            if share <= 0.0 {
                continue;
            }
            // t = scale * child's t + offset, and so for y.
            let (t_scale, t_offset) = (share, ((child.s[0] - s[0] + child.s[1] - s[1]) / depth) as f32);
            let y_scale = ((child.x[1] - child.x[0]) / width) as f32;
            let y_offset = ((child.x[0] - x[0] + child.x[1] - x[1]) / width) as f32;
            let (mut scales, mut offsets) = ([share; ORDER], [1.0f32; ORDER]);
            for m in 1..ORDER {
                scales[m] = scales[m - 1] * t_scale;
                offsets[m] = offsets[m - 1] * t_offset / m as f32;
            }
            for m in 0..ORDER {
                for k in 0..=m {
                    let factor = scales[k] * offsets[m - k];
                    let from = &child.moments[k];
                    for c in 0..4 {
                        panel.moments[m][c] += factor * from[c];
                        panel.moments[m][c + 4] += factor * (y_scale * from[c + 4] + y_offset * from[c]);
                    }
                }
            }
        }
        panel
    }
}

/// What is known of the index before any segment is.
pub(super) struct Integrals {
    /// Leaves, pairs, fours, ...
    levels: Vec<Vec<Panel>>,
    /// The function at both ends of each leaf.
    sides: Vec<[Side; 2]>,
    /// Of each node: the first leaf above it, position, `S`, and the function.
    nodes: Vec<NodePlace>,
    extinction: Extinction,
}

#[derive(Clone, Copy)]
struct NodePlace {
    leaf: usize,
    x: f64,
    s: f64,
    side: Side,
}

impl Integrals {
    pub(super) fn new(curve: &Curve, extinction: Extinction, nodes: &[Node]) -> Self {
        let mut this = Self { levels: vec![Vec::new()], sides: Vec::new(), nodes: Vec::new(), extinction };
        let place = |this: &Self, node: &Node| {
            let s = this.levels[0].last().map_or(0.0, |panel| panel.s[1]);
            let (x, side) = (f64::from(node.edge), curve.side(node.edge, node.upper));
            NodePlace { leaf: this.sides.len(), x, s, side }
        };
        for (i, node) in nodes.iter().enumerate() {
            let at = place(&this, node);
            this.nodes.push(at);
            if let Some(next) = nodes.get(i + 1) {
                this.add_leaves(curve, node.edge, next.edge);
            }
        }
        while this.levels[this.levels.len() - 1].len() > 1 {
            let finest = &this.levels[this.levels.len() - 1];
            let joined = finest.chunks_exact(2).map(|pair| Panel::join(&pair[0], &pair[1])).collect();
            this.levels.push(joined);
        }
        this
    }

    /// The leaves between two nodes: cut at knots, and so finely that the densest segment can use them.
    fn add_leaves(&mut self, curve: &Curve, from: u32, to: u32) {
        let mut edge = from;
        while edge < to {
            let piece = curve.piece(edge);
            let end = curve.stops[piece + 1].edge.min(to);
            let (a, b) = (f64::from(edge), f64::from(end));
            let densest = curve.at(piece, a)[3].max(curve.at(piece, b)[3]);
            let depth = self.extinction.of(densest) * (b - a) / f64::from(to - from);
            let cuts = (depth / DENSE).ceil().clamp(1.0, MAX_CUTS);
            let mut cuts: Vec<f64> = (0..=cuts as u32).map(|k| f64::from(k) / cuts).collect();
            // Of a small share of every segment, two or three digits are enough.
            if (b - a) * SMALL_SHARE > f64::from(to - from) {
                cuts.extend(logarithm_cuts(curve.at(piece, a)[3], curve.at(piece, b)[3]));
                cuts.sort_by(f64::total_cmp);
            }
            for cut in cuts.windows(2) {
                let x = [cut[0], cut[1]].map(|w| a + (b - a) * w);
                let sides = x.map(|x| curve.at(piece, x));
                let s = self.levels[0].last().map_or(0.0, |panel| panel.s[1]);
                self.levels[0].push(Panel::leaf(x, sides, s, self.extinction));
                self.sides.push(sides);
            }
            edge = end;
        }
    }

    /// The entry of the segment from one node to another.
    pub(super) fn entry(&self, front: usize, back: usize) -> Entry {
        let (a, b) = (&self.nodes[front], &self.nodes[back]);
        if a.x == b.x {
            return self.constant(&a.side, &b.side);
        }
        let (k, sign) = (1.0 / (b.x - a.x).abs(), if b.x > a.x { 1.0 } else { -1.0 });
        let mut sums = Sums { a, k, sign, total: [0.0; 4], back: [0.0; 4] };
        let mut at = a.leaf;
        while at != b.leaf {
            let far = if sign > 0.0 { b.leaf - at } else { at - b.leaf };
            let mut level = (at.trailing_zeros().min(far.ilog2()) as usize).min(self.levels.len() - 1);
            let panel = loop {
                let index = if sign > 0.0 { at >> level } else { (at >> level) - 1 };
                let panel = &self.levels[level][index];
                if level == 0 || k * (panel.s[1] - panel.s[0]) <= DENSE {
                    break panel;
                }
                level -= 1;
            };
            if k * (panel.s[1] - panel.s[0]) > DENSE {
                sums.add_dense(panel, &self.sides[if sign > 0.0 { at } else { at - 1 }]);
            } else {
                sums.add(panel);
            }
            at = if sign > 0.0 { at + (1 << level) } else { at - (1 << level) };
            let end = if sign > 0.0 { panel.s[1] } else { panel.s[0] };
            if k * (end - a.s).abs() > OPAQUE {
                break;
            }
        }
        sums.entry(-f64::exp_m1(-k * (b.s - a.s).abs()))
    }

    /// Half a segment of one value, then half of another: nodes at one edge.
    fn constant(&self, a: &Side, b: &Side) -> Entry {
        let mut weights = [0.0; 8];
        let mut transmittance = 1.0;
        for (start, side) in [(0.0, a), (0.5, b)] {
            let depth = 0.5 * self.extinction.of(side[3]);
            let opacity = -f64::exp_m1(-depth) * transmittance;
            // The mean position of what a half adds: where 1 / depth - 1 / (e^depth - 1) cancels, its series.
            let middle =
                if depth < 1e-3 { 0.5 - depth / 12.0 } else { 1.0 / depth - 1.0 / f64::exp_m1(depth) };
            let u = start + 0.5 * middle;
            for (c, v) in [side[0], side[1], side[2], 1.0].into_iter().enumerate() {
                weights[c] += opacity * (1.0 - u) * v;
                weights[c + 4] += opacity * u * v;
            }
            transmittance *= (-depth).exp();
        }
        weights.map(|w| w as f32)
    }
}

/// Where to cut a ramp of opacity so that `-ln(1 - opacity)` is smooth within each part: as shares, any order.
fn logarithm_cuts(a: f64, b: f64) -> impl Iterator<Item = f64> {
    let (from, to) = ((1.0 - a).max(1.0 - b), (1.0 - a).min(1.0 - b));
    let factors = std::iter::successors(Some(0.25), |f| Some(f * 0.25));
    factors.map(move |f| from * f).take_while(move |q| *q > to * 1.5).map(move |q| (1.0 - q - a) / (b - a))
}

/// A segment's sums on its way.
struct Sums<'a> {
    a: &'a NodePlace,
    k: f64,
    sign: f64,
    /// Red, green, blue, opacity, without weights and with back weights.
    total: [f32; 4],
    back: [f32; 4],
}

impl Sums<'_> {
    /// A panel by its moments.
    #[inline]
    fn add(&mut self, panel: &Panel) {
        let Self { a, k, sign, .. } = *self;
        let depth = k * (panel.s[1] - panel.s[0]);
        if depth <= 0.0 {
            return;
        }
        let before = k * (0.5 * (panel.s[0] + panel.s[1]) - a.s).abs();
        let u = (k * (0.5 * (panel.x[0] + panel.x[1]) - a.x).abs()) as f32;
        let u_reach = (0.5 * k * sign * (panel.x[1] - panel.x[0])) as f32;
        let z = (-0.5 * sign * depth) as f32;
        let mut weight = (depth as f32) * (-before as f32).exp();
        let mut sums = [0.0f32; 8];
        for row in &panel.moments {
            for c in 0..8 {
                sums[c] += weight * row[c];
            }
            weight *= z;
        }
        for c in 0..4 {
            self.total[c] += sums[c];
            self.back[c] += u * sums[c] + u_reach * sums[c + 4];
        }
    }

    /// A leaf too dense for its moments: colour and position taken as linear in optical depth.
    #[cold]
    fn add_dense(&mut self, panel: &Panel, sides: &[Side; 2]) {
        let Self { a, k, sign, .. } = *self;
        let [near, far] = if sign > 0.0 { [0, 1] } else { [1, 0] };
        let depth = k * (panel.s[1] - panel.s[0]);
        let before = (-k * (panel.s[near] - a.s).abs()).exp();
        let through = (-depth).exp();
        // Integrals of 1, w and w² times e^-depth over a depth that w shares out.
        let i0 = before * -f64::exp_m1(-depth);
        let i1 = before * (1.0 - through * (1.0 + depth)) / depth;
        let i2 = before * (2.0 - through * (depth * depth + 2.0 * depth + 2.0)) / (depth * depth);
        let u = k * (panel.x[near] - a.x).abs();
        let du = k * (panel.x[far] - panel.x[near]).abs();
        let [start, end] = [near, far].map(|side| [sides[side][0], sides[side][1], sides[side][2], 1.0]);
        for c in 0..4 {
            let (q, dq) = (start[c], end[c] - start[c]);
            self.total[c] += (q * i0 + dq * i1) as f32;
            self.back[c] += (u * q * i0 + (u * dq + du * q) * i1 + du * dq * i2) as f32;
        }
    }

    /// The entry, scaled so that front and back opacity add up to `opacity`.
    fn entry(&self, opacity: f64) -> Entry {
        if self.total[3] <= 0.0 {
            return [0.0; 8];
        }
        let scale = (opacity / f64::from(self.total[3])) as f32;
        let mut entry = [0.0; 8];
        for c in 0..4 {
            entry[c + 4] = (self.back[c] * scale).max(0.0);
            entry[c] = (self.total[c] * scale - entry[c + 4]).max(0.0);
        }
        entry
    }
}
