use super::*;
use crate::compositing::segment_opacity;
use crate::presets;
use crate::transfer_function::{ControlPoint, MAX_OPACITY, extinction};
use proptest::prelude::*;
use proptest::strategy::ValueTree;

const CT: [f32; 2] = [0.0, 4095.0];

fn point(value: f64, color: [f64; 3], opacity: f64) -> ControlPoint {
    ControlPoint { value, color, opacity }
}

fn function(points: &[(f64, f64)]) -> TransferFunction {
    let shade = |i: usize| [0.2, 0.5, (i % 3) as f64 / 2.0];
    TransferFunction::new(points.iter().enumerate().map(|(i, p)| point(p.0, shade(i), p.1)).collect())
        .unwrap()
}

fn table(function: &TransferFunction, step_length: f64) -> Preintegration {
    Preintegration::new(function, 1.0, step_length, Rescale::IDENTITY, CT)
}

/// The largest difference of any entry, and of any sum of front and back.
fn difference(a: [f64; 8], b: [f64; 8]) -> f64 {
    let d: [f64; 8] = std::array::from_fn(|c| a[c] - b[c]);
    let sums = (0..4).map(|c| (d[c] + d[c + 4]).abs());
    d.iter().map(|d| d.abs()).chain(sums).fold(0.0, f64::max)
}

/// Transparent stretches, ramps, plateaus, steps and walls over 0..=4095.
fn functions(most: usize) -> impl Strategy<Value = TransferFunction> {
    let opacity = prop_oneof![3 => Just(0.0), 6 => 0.0f64..0.95, 1 => Just(1.0)];
    let value = prop_oneof![4 => (0u32..=4095).prop_map(f64::from), 1 => -500.0f64..5000.0];
    let color = prop::array::uniform3(0.0f64..=1.0);
    prop::collection::vec((value, color, opacity, any::<bool>()), 1..=most).prop_map(|mut points| {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Some take the value of the one before: a step.
        for i in (1..points.len()).step_by(3) {
            if points[i].3 {
                points[i].0 = points[i - 1].0;
            }
        }
        TransferFunction::new(points.into_iter().map(|p| point(p.0, p.1, p.2)).collect()).unwrap()
    })
}

/// What the table integrates, by edges: the function with its knots on edges.
fn on_edges(curve: &Curve) -> TransferFunction {
    let point = |edge: u32, [r, g, b, opacity]: curve::Side| point(f64::from(edge), [r, g, b], opacity);
    let both = |s: &curve::Stop| [point(s.edge, s.below), point(s.edge, s.above)];
    TransferFunction::new(curve.stops.iter().flat_map(both).collect()).unwrap()
}

#[test]
fn a_constant_function_has_its_closed_form() {
    for (opacity, step) in [(0.0, 1.0), (1e-7, 0.5), (0.3, 0.5), (0.9, 1.0), (1.0, 1.0), (0.5, 20.0)] {
        let f = TransferFunction::new(vec![point(7.0, [0.25, 0.5, 1.0], opacity)]).unwrap();
        let depth = extinction(opacity, 1.0) * step;
        let total = segment_opacity(extinction(opacity, 1.0), step);
        let back = if depth > 1e-5 { total / depth - (-depth).exp() } else { 0.5 * depth };
        let expected = [0.25, 0.5, 1.0, 1.0, 0.25, 0.5, 1.0, 1.0];
        let expected: [f64; 8] =
            std::array::from_fn(|c| expected[c] * if c < 4 { total - back } else { back });
        let preintegration = table(&f, step);
        for (front, end) in [(0.0, 4095.0), (7.0, 7.0), (4000.0, 10.5), (4095.0, 4095.0)] {
            // The series of a panel ends with a relative error of 4e-5, half of which is scaled away.
            let found = preintegration.evaluate(front, end);
            assert!(difference(found, expected) < 1e-5, "{opacity} {step}: {found:?} {expected:?}");
            let exact = exact_segment(&f, 1.0, step, f64::from(front), f64::from(end));
            assert!(difference(exact, expected) < 1e-9, "{opacity} {step}: {exact:?} {expected:?}");
        }
    }
}

#[test]
fn a_ramp_of_opacity_has_its_closed_form() {
    let f = function(&[(0.0, 0.0), (4095.0, 0.8)]);
    // The mean of -ln q, q from 1 to 0.2.
    let depth = 1.0 + 0.2 * 0.2f64.ln() / 0.8;
    for step in [0.25, 1.0, 4.0] {
        let opacity = -f64::exp_m1(-depth * step);
        for (front, back) in [(0.0, 4095.0), (4095.0, 0.0)] {
            let found = table(&f, step).evaluate(front, back);
            assert!((found[3] + found[7] - opacity).abs() < 1e-6);
            let exact = exact_segment(&f, 1.0, step, f64::from(front), f64::from(back));
            assert!((exact[3] + exact[7] - opacity).abs() < 1e-10);
        }
    }
}

/// Thin and with extinction rising linearly from zero, a third of the light comes with front weight: the integral of
/// `u (1 - u)` against that of `u²`. Its colour, linear too, adds a power of `u`.
#[test]
fn a_thin_ramp_has_the_weights_of_polynomials() {
    let points = vec![point(0.0, [0.0, 0.0, 1.0], 0.0), point(4095.0, [1.0, 0.0, 1.0], 1e-3)];
    let preintegration = table(&TransferFunction::new(points).unwrap(), 1e-2);
    let sigma = 1e-5;
    let expected = [1.0 / 12.0, 0.0, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 4.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];
    let rising = preintegration.evaluate(0.0, 4095.0).map(|e| e / sigma);
    let falling = preintegration.evaluate(4095.0, 0.0).map(|e| e / sigma);
    // The logarithm bends by half a thousandth.
    assert!(difference(rising, expected) < 1e-3, "{rising:?}");
    let [fr, fg, fb, fa, br, bg, bb, ba] = falling;
    assert!(difference([br, bg, bb, ba, fr, fg, fb, fa], expected) < 1e-3, "{falling:?}");
}

#[test]
fn a_step_belongs_to_its_upper_value_whichever_way_stored_numbers_run() {
    let f = function(&[(100.0, 0.0), (100.0, 0.5), (200.0, 0.5), (200.0, 0.0)]);
    let (upright, turned) = (Rescale::IDENTITY, Rescale { slope: -1.0, intercept: 255.0 });
    let half = segment_opacity(extinction(0.5, 1.0), 1.0);
    for rescale in [upright, turned] {
        let preintegration = Preintegration::new(&f, 1.0, 1.0, rescale, [0.0, 255.0]);
        for (value, opacity) in [(99.0, 0.0), (100.0, half), (150.0, half), (199.0, half), (200.0, 0.0)] {
            let stored = rescale.stored(value) as f32;
            let found = preintegration.evaluate(stored, stored);
            assert!((found[3] + found[7] - opacity).abs() < 1e-6, "{value}: {found:?}");
        }
        // From far below to far above, it is a box.
        let (lo, hi) = (rescale.stored(0.0) as f32, rescale.stored(255.0) as f32);
        let found = preintegration.evaluate(lo, hi);
        assert!(difference(found, exact_segment(&f, 1.0, 1.0, 0.0, 255.0)) < 1e-4);
    }
}

#[test]
fn steps_at_the_ends_of_the_range_are_kept() {
    let f = function(&[(0.0, 1.0), (0.0, 0.0), (4095.0, 0.0), (4095.0, 0.75)]);
    let preintegration = table(&f, 1.0);
    let opacity = |a, b| preintegration.evaluate(a, b)[3] + preintegration.evaluate(a, b)[7];
    assert_eq!(opacity(0.0, 0.0), 0.0);
    assert_eq!(opacity(0.0, 4094.9), 0.0);
    assert!((opacity(4095.0, 4095.0) - 0.75).abs() < 1e-6);
    assert!((opacity(1e9, f32::INFINITY) - 0.75).abs() < 1e-6);
}

#[test]
fn odd_ranges_and_numbers_do_no_harm() {
    let f = function(&[(-1e30, 0.1), (0.5, 0.0), (0.5, 0.4), (1.0, 1.0), (1e300, 0.2)]);
    let (tiny, huge) = (f32::from_bits(1), f32::MAX);
    let ranges =
        [[0.5, 0.5], [0.0, tiny], [-huge, huge], [0.0, huge], [1.0, 0.0], [f32::NAN, 1.0], [0.0, 65536.0]];
    for range in ranges {
        for (unit, step) in [(1.0, 1.0), (1e-30, 1e3), (1e30, 1e-3), (1.0, f64::NAN)] {
            for slope in [1.0, -1.0, 1e-300, 1e300] {
                let p = Preintegration::new(&f, unit, step, Rescale { slope, intercept: 0.0 }, range);
                assert!(p.size() >= 2 && p.size() <= Preintegration::MAX_SIZE);
                assert!(p.bins().len() >= 5 && p.bins().len() <= 65537);
                for stored in [0.0, 0.5, -1.0, huge, -huge, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
                    let found = p.evaluate(stored, 0.25);
                    assert!(step.is_nan() || found.iter().all(|e| (0.0..=1.0).contains(e)), "{found:?}");
                }
            }
        }
    }
    let single = Preintegration::new(&f, 1.0, 1.0, Rescale::IDENTITY, [0.75, 0.75]);
    let expected = exact_segment(&f, 1.0, 1.0, 0.75, 0.75);
    assert!(difference(single.evaluate(0.75, 0.75), expected) < 1e-6);
}

#[test]
fn far_points_do_not_take_nodes() {
    let near = function(&[(1000.0, 0.0), (1200.0, 0.5)]);
    let mut points: Vec<_> = (0..500).map(|i| (-1e4 - f64::from(500 - i), 0.1)).collect();
    points.extend([(-1e4, 0.0), (1000.0, 0.0), (1200.0, 0.5), (1e4, 0.5), (1e5, 0.0)]);
    let (near, far) = (table(&near, 0.5), table(&function(&points), 0.5));
    for (a, b) in [(0.0, 4095.0), (1010.0, 1190.0), (1199.0, 900.0)] {
        let opacity = |p: &Preintegration| p.evaluate(a, b)[3] + p.evaluate(a, b)[7];
        assert!((opacity(&near) - opacity(&far)).abs() < 1e-3);
    }
}

/// Statistics of the error of look-ups, at pairs of values of all distances.
struct Errors(Vec<f64>);

impl Errors {
    fn of(cases: impl Iterator<Item = (TransferFunction, f64)>, rescale: Rescale, pairs: u32) -> Self {
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        let mut random = move || {
            // Xorshift (Marsaglia 2003).
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut errors = Vec::new();
        for (f, step) in cases {
            let preintegration = Preintegration::new(&f, 1.0, step, rescale, CT);
            for _ in 0..pairs {
                let front = random() * 4095.0;
                let distance = 4095.0 * (-7.0 * random()).exp() * if random() < 0.5 { 1.0 } else { -1.0 };
                let back = (front + distance).clamp(0.0, 4095.0) as f32;
                let front = front as f32;
                let [a, b] = [front, back].map(|stored| rescale.value(f64::from(stored)));
                let exact = exact_segment(&f, 1.0, step, a, b);
                errors.push(difference(preintegration.evaluate(front, back), exact));
            }
        }
        errors.sort_by(f64::total_cmp);
        Self(errors)
    }

    /// Mean, 99th percentile and worst.
    fn summary(&self) -> [f64; 3] {
        let n = self.0.len();
        [self.0.iter().sum::<f64>() / n as f64, self.0[n * 99 / 100], self.0[n - 1]]
    }
}

fn sampled(strategy: impl Strategy<Value = TransferFunction>, count: usize) -> Vec<TransferFunction> {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut tree = || strategy.new_tree(&mut runner).unwrap().current();
    (0..count).map(|_| tree()).collect()
}

/// The numbers of the module's docs.
#[test]
fn look_ups_are_as_near_as_the_docs_say() {
    let steps = [0.25, 0.5, 1.0].into_iter().cycle();
    let random = sampled(functions(10), 48).into_iter().zip(steps);
    let [mean, p99, worst] = Errors::of(random, Rescale::IDENTITY, 150).summary();
    assert!(
        mean < 7.5e-5 && p99 < 5e-4 && worst < 4e-2,
        "mean {mean:.1e}, 99 % {p99:.1e}, worst {worst:.1e}"
    );
}

#[test]
fn look_ups_of_presets_are_nearer_still() {
    let volume = crate::analytic::AnalyticField::Sphere.volume(8);
    let ct = presets::all().iter().filter(|p| p.modality == presets::Modality::Ct);
    let functions = ct.map(|p| (p.transfer_function(&volume), 0.5));
    let hounsfield = Rescale { slope: 1.0, intercept: -1024.0 };
    let [mean, p99, worst] = Errors::of(functions, hounsfield, 150).summary();
    assert!(mean < 4e-5 && p99 < 4e-4 && worst < 2e-3, "mean {mean:.1e}, 99 % {p99:.1e}, worst {worst:.1e}");
}

#[test]
fn more_knots_than_nodes_are_a_matter_of_degree() {
    // A zigzag within an envelope: 600 knots, no two alike.
    let envelope = |i: u32| (f64::from(i) / 600.0 * std::f64::consts::PI).sin() * 0.4;
    let points: Vec<_> = (0..600).map(|i| (f64::from(i) * 6.8, envelope(i) * f64::from(1 + i % 2))).collect();
    let f = function(&points);
    assert_eq!(table(&f, 0.5).size(), Preintegration::MAX_SIZE);
    let [mean, p99, worst] = Errors::of(std::iter::once((f, 0.5)), Rescale::IDENTITY, 2000).summary();
    assert!(mean < 2e-2, "mean {mean:.1e}, 99 % {p99:.1e}, worst {worst:.1e}");
}

#[test]
fn a_smooth_function_of_hundreds_of_points_needs_no_node_for_each() {
    let smooth = |i: u32| {
        let t = f64::from(i) / 500.0;
        let wave = |k: f64| 0.5 + 0.5 * (k * t).sin();
        point(t * 4095.0, [wave(5.0), wave(7.0), wave(3.0)], 0.3 * (t * 9.0).sin().powi(2))
    };
    let f = TransferFunction::new((0..=500).map(smooth).collect()).unwrap();
    assert!(table(&f, 0.5).size() < Preintegration::MAX_SIZE);
    let [mean, p99, worst] = Errors::of(std::iter::once((f, 0.5)), Rescale::IDENTITY, 2000).summary();
    assert!(mean < 2e-4 && p99 < 5e-4 && worst < 2e-3, "mean {mean:.1e}, 99 % {p99:.1e}, worst {worst:.1e}");
}

/// A ray along which the field is linear is cut into steps: together they are one long segment.
#[test]
fn steps_in_a_row_are_one_segment() {
    let f =
        function(&[(500.0, 0.0), (700.0, 0.6), (700.0, 0.02), (2000.0, 0.02), (2300.0, 0.9), (2400.0, 0.0)]);
    for steps in [3u32, 10, 37, 150] {
        let length = 6.0 / f64::from(steps);
        let preintegration = table(&f, length);
        let value = |k: u32| (f64::from(k) / f64::from(steps) * 4000.0) as f32;
        let (mut color, mut transmittance) = ([0.0; 3], 1.0);
        for k in 0..steps {
            let e = preintegration.evaluate(value(k), value(k + 1));
            for c in 0..3 {
                color[c] += transmittance * (e[c] + e[c + 4]);
            }
            transmittance *= 1.0 - e[3] - e[7];
        }
        let exact = exact_segment(&f, 1.0, 6.0, 0.0, 4000.0);
        assert!(
            (1.0 - transmittance - exact[3] - exact[7]).abs() < 2e-3,
            "{steps}: {transmittance} {exact:?}"
        );
        for c in 0..3 {
            assert!((color[c] - exact[c] - exact[c + 4]).abs() < 2e-3, "{steps}: {color:?} {exact:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The first bound of the docs, against quadrature that shares nothing with the table.
    #[test]
    fn entries_at_nodes_are_the_integral(
        f in functions(12),
        step in prop_oneof![0.05f64..2.0, 2.0f64..100.0],
        picks in prop::collection::vec((0.0f64..1.0, 0.0f64..1.0), 40),
    ) {
        let curve = Curve::new(&f, Rescale::IDENTITY, CT);
        let extinction = Extinction { unit_distance: 1.0, step_length: step };
        let nodes = nodes::place(&curve, extinction, Preintegration::MAX_SIZE);
        let integrals = Integrals::new(&curve, extinction, &nodes);
        let on_edges = on_edges(&curve);
        for (a, b) in picks {
            let [a, b] = [a, b].map(|p| (p * nodes.len() as f64) as usize);
            // From one side of a step to the other there is no one answer.
            if nodes[a].edge == nodes[b].edge {
                continue;
            }
            let entry = integrals.entry(a, b).map(f64::from);
            let [front, back] = [a, b].map(|n| f64::from(nodes[n].edge));
            let exact = exact_segment(&on_edges, 1.0, step, front, back);
            prop_assert!(difference(entry, exact) < 1e-4, "{front} to {back}: {entry:?} {exact:?}");
        }
    }

    #[test]
    fn front_and_back_opacity_add_up_and_colour_keeps_within_them(f in functions(12), step in 0.01f64..4.0) {
        let curve = Curve::new(&f, Rescale::IDENTITY, CT);
        let preintegration = table(&f, step);
        let extinction = Extinction { unit_distance: 1.0, step_length: step };
        let nodes = nodes::place(&curve, extinction, Preintegration::MAX_SIZE);
        let n = preintegration.size();
        prop_assert_eq!(nodes.len(), n);
        for a in (0..n).step_by(7) {
            for b in (0..n).step_by(5) {
                let e = preintegration.entries()[a * n + b];
                let swapped = preintegration.entries()[b * n + a];
                // Opacity does not know front from back; rounding of two numbers below 1.
                prop_assert!((e[3] + e[7] - swapped[3] - swapped[7]).abs() <= 2.0 * f32::EPSILON);
                prop_assert!(e.iter().all(|v| (0.0..=1.0).contains(v)));
                for c in 0..3 {
                    prop_assert!(e[c] <= e[3] * 1.0001 + 1e-6 && e[c + 4] <= e[7] * 1.0001 + 1e-6, "{:?}", e);
                }
                // Opacity is that of the optical depth, in closed form from knot to knot.
                let (x, y) = (nodes[a].edge, nodes[b].edge);
                if x < y {
                    let mut edges: Vec<u32> = curve.stops.iter().map(|s| s.edge).collect();
                    edges.retain(|e| (x + 1..y).contains(e));
                    edges.insert(0, x);
                    edges.push(y);
                    let depth = edges.windows(2).map(|w| {
                        let (p, q) = (curve.side(w[0], true)[3], curve.side(w[1], false)[3]);
                        extinction.mean(p, q) * f64::from(w[1] - w[0])
                    });
                    let opacity = -f64::exp_m1(-depth.sum::<f64>() / f64::from(y - x));
                    prop_assert!((f64::from(e[3] + e[7]) - opacity).abs() < 3e-7);
                }
            }
        }
    }

    /// Kernels work in f32 and read entries in one of two layouts; both give the look-up of the f64 twin.
    #[test]
    fn the_layouts_of_kernels_agree_with_the_twin(
        f in functions(8),
        pairs in prop::collection::vec((-50.0f32..4200.0, -50.0f32..4200.0), 50),
        turned: bool,
    ) {
        let rescale = if turned { Rescale { slope: -1.0, intercept: 4095.0 } } else { Rescale::IDENTITY };
        let preintegration = Preintegration::new(&f, 1.0, 0.5, rescale, CT);
        let unlit = preintegration.unlit_entries();
        let n = preintegration.size();
        let (origin, scale) = preintegration.index_map();
        let cell = |stored: f32| {
            let x = ((stored - origin) * scale).max(0.0).min((preintegration.bins().len() - 1) as f32);
            let [start, growth] = preintegration.bins()[x as usize];
            let coordinate = (x - x.trunc()).mul_add(growth, start);
            let node = (coordinate as usize).min(n - 2);
            (node, coordinate - node as f32)
        };
        for (front, back) in pairs {
            let ((f, fw), (b, bw)) = (cell(front), cell(back));
            let lerp = |a: f32, b: f32, w: f32| (b - a).mul_add(w, a);
            let value = |at: &dyn Fn(usize) -> f32| {
                let row = |f: usize| lerp(at(f * n + b), at(f * n + b + 1), bw);
                lerp(row(f), row(f + 1), fw)
            };
            let twin = preintegration.evaluate(front, back);
            // A coordinate of up to 255 is rounded by 1.5e-5 at most, and a cell changes by 1 at most.
            for (c, twin) in twin.iter().enumerate() {
                let found = value(&|i| preintegration.entries()[i][c]);
                prop_assert!((f64::from(found) - twin).abs() < 6e-5);
            }
            for c in 0..4 {
                let found = value(&|i| unlit[i][c]);
                prop_assert!((f64::from(found) - twin[c] - twin[c + 4]).abs() < 6e-5);
            }
        }
    }

    #[test]
    fn knots_have_whole_coordinates_and_no_look_up_lands_within_a_step(f in functions(12), stored in 0.0f32..4095.0) {
        let (curve, preintegration) = (Curve::new(&f, Rescale::IDENTITY, CT), table(&f, 0.5));
        let per_bin = 4095.0 / f64::from(curve.bins);
        for stop in &curve.stops {
            // An edge as a stored number, and as f32 rounds it: a little more, so as not to be in the bin before.
            let at = ((f64::from(stop.edge) * per_bin) as f32).next_up().next_up();
            let coordinate = preintegration.coordinate(at);
            prop_assert!((coordinate - coordinate.round()).abs() < 0.02, "{} at {}", coordinate, at);
        }
        let extinction = Extinction { unit_distance: 1.0, step_length: 0.5 };
        let nodes = nodes::place(&curve, extinction, Preintegration::MAX_SIZE);
        let coordinate = preintegration.coordinate(stored);
        let (node, share) = (coordinate as usize, coordinate.fract());
        // Rounding may reach in by as much as it is.
        let in_step = node + 1 < nodes.len() && nodes[node].edge == nodes[node + 1].edge;
        prop_assert!(!in_step || !(4e-5..1.0 - 4e-5).contains(&share), "{}", coordinate);
        // The map rises.
        prop_assert!(preintegration.coordinate(stored.next_up()) >= coordinate - 4e-5);
    }

    /// Quadrature in one go, and cut in two where nothing happens.
    #[test]
    fn the_exact_segment_is_its_halves(f in functions(6), front in 0.0f64..4095.0, back in 0.0f64..4095.0) {
        let whole = exact_segment(&f, 1.0, 1.0, front, back);
        let middle = 0.5 * (front + back);
        let (a, b) = (exact_segment(&f, 1.0, 0.5, front, middle), exact_segment(&f, 1.0, 0.5, middle, back));
        let through = 1.0 - a[3] - a[7];
        for c in 0..4 {
            // Weights of the halves in those of the whole: u / 2, and (1 + u) / 2.
            let behind = a[c + 4] / 2.0 + through * (b[c] / 2.0 + b[c + 4]);
            let total = a[c] + a[c + 4] + through * (b[c] + b[c + 4]);
            prop_assert!((whole[c + 4] - behind).abs() < 1e-8);
            prop_assert!((whole[c] + whole[c + 4] - total).abs() < 1e-8);
        }
        prop_assert!(whole[3] + whole[7] <= -f64::exp_m1(-extinction(MAX_OPACITY, 1.0)) + 1e-9);
    }
}
