use super::*;
use proptest::prelude::*;

fn point() -> impl Strategy<Value = ControlPoint> {
    // Few values, so that steps are frequent.
    let value = prop_oneof![(-5..5i32).prop_map(f64::from), -1e4..1e4];
    (value, [0.0..=1.0, 0.0..=1.0, 0.0..=1.0], 0.0..=1.0).prop_map(|(value, color, opacity)| ControlPoint {
        value,
        color,
        opacity,
    })
}

fn function() -> impl Strategy<Value = TransferFunction> {
    prop::collection::vec(point(), 1..12).prop_map(|mut points| {
        points.sort_by(|a, b| a.value.total_cmp(&b.value));
        TransferFunction::new(points).unwrap()
    })
}

fn values(f: &TransferFunction) -> Vec<f64> {
    f.points().iter().map(|p| p.value).collect()
}

fn looks(f: &TransferFunction) -> Vec<([f64; 3], f64)> {
    f.points().iter().map(|p| (p.color, p.opacity)).collect()
}

/// Which neighbours are at one value.
fn steps(f: &TransferFunction) -> Vec<bool> {
    f.points().windows(2).map(|w| w[0].value == w[1].value).collect()
}

fn ramp() -> TransferFunction {
    let gray = |value: f64, gray: f64, opacity: f64| ControlPoint { value, color: [gray; 3], opacity };
    of(vec![gray(-10.0, 0.0, 0.0), gray(0.0, 0.0, 0.0), gray(10.0, 1.0, 0.5), gray(50.0, 1.0, 0.5)]).unwrap()
}

proptest! {
    #[test]
    fn a_moved_point_ends_at_its_neighbours(
        f in function(), index in any::<prop::sample::Index>(), value in -2e4..2e4, opacity in -1.0..2.0
    ) {
        let index = index.index(f.points().len());
        let g = moved(&f, index, value, opacity);
        prop_assert!(values(&g).is_sorted());
        let p = g.points()[index];
        prop_assert_eq!(p.opacity, opacity.clamp(0.0, 1.0));
        let free = (index == 0 || f.points()[index - 1].value <= value)
            && f.points().get(index + 1).is_none_or(|next| value <= next.value);
        prop_assert!(!free || p.value == value);
        for (i, (a, b)) in f.points().iter().zip(g.points()).enumerate() {
            prop_assert!(i == index || a == b, "only one point moves");
        }
        prop_assert_eq!(p.color, f.points()[index].color);
    }

    #[test]
    fn an_added_point_is_on_the_curve_and_can_be_removed_again(f in function(), value in -2e4..2e4) {
        let (g, index) = added(&f, value);
        prop_assert_eq!(g.points()[index].value, value);
        for x in [value, value - 0.5, value + 3.0, -1e3, 1e3] {
            let ((a, b), (c, d)) = (f.evaluate(x), g.evaluate(x));
            prop_assert!((b - d).abs() < 1e-9 && (0..3).all(|i| (a[i] - c[i]).abs() < 1e-9));
        }
        prop_assert_eq!(removed(&g, index), Some(f));
    }

    #[test]
    fn shift_and_stretch_keep_every_look_and_every_step(
        f in function(), by in -1e5..1e5, about in -1e3..1e3, factor in 1e-3..1e3
    ) {
        for g in [shifted(&f, by), scaled(&f, about, factor)] {
            prop_assert_eq!(looks(&g), looks(&f));
            prop_assert!(values(&g).is_sorted());
            for (was, is) in steps(&f).into_iter().zip(steps(&g)) {
                prop_assert!(!was || is, "a step stays one");
            }
        }
        let back = shifted(&shifted(&f, by), -by);
        prop_assert!(values(&back).iter().zip(values(&f)).all(|(a, b)| (a - b).abs() < 1e-9 * by.abs().max(1e5)));
    }

    #[test]
    fn a_window_is_what_was_asked_for(f in function(), width in 1e-2..1e5, level in -1e4..1e4) {
        let g = windowed(&f, width, level);
        prop_assert_eq!(looks(&g), looks(&f));
        let ([lo, hi], [a, b]) = (window(&f), window(&g));
        prop_assert!((0.5 * (a + b) - level).abs() < 1e-6 * (1.0 + level.abs() + width));
        // Of a narrow window the ends are rounded: values here are up to 1e4.
        let rounded = (hi - lo) < 1e-3;
        prop_assert!(lo == hi || rounded || ((b - a) - width).abs() < 1e-6 * (width + level.abs()), "{} {width}", b - a);
    }

    #[test]
    fn nothing_that_can_be_asked_breaks_a_function(
        f in function(), index in 0..15usize, x in any::<f64>(), y in any::<f64>()
    ) {
        for g in [
            moved(&f, index, x, y), added(&f, x).0, shifted(&f, x), scaled(&f, x, y), windowed(&f, x, y),
            colored(&f, index, [x, y, 0.0]), removed(&f, index).unwrap_or_else(|| f.clone()),
        ] {
            prop_assert!(TransferFunction::new(g.points().to_vec()).is_ok());
        }
    }

    #[test]
    fn a_colour_map_keeps_opacities(f in function(), x in -1e4..1e4) {
        for name in ["viridis", "turbo_r"] {
            let g = with_colormap(&f, name, [-1.0, 1.0]).unwrap();
            prop_assert!((g.evaluate(x).1 - f.evaluate(x).1).abs() < 1e-9);
        }
        let g = with_colors_of(&f, &ramp(), [-1.0, 1.0]).unwrap();
        prop_assert!((g.evaluate(x).1 - f.evaluate(x).1).abs() < 1e-9);
        prop_assert_eq!(with_colormap(&f, "no such map", [-1.0, 1.0]), None);
    }
}

#[test]
fn the_window_is_where_the_function_changes() {
    assert_eq!(window(&ramp()), [0.0, 10.0]);
    let g = windowed(&ramp(), 20.0, 100.0);
    assert_eq!(values(&g), [70.0, 90.0, 110.0, 190.0]);
    let flat = of(vec![ramp().points()[2], ramp().points()[3]]).unwrap();
    assert_eq!(window(&flat), [10.0, 50.0]);
}

#[test]
fn a_drag_over_the_picture_widens_and_lowers() {
    let range = [-100.0, 100.0];
    let [lo, hi] = window(&dragged_window(&ramp(), [0.5, 0.0], range));
    assert!(hi - lo > 10.0 && (lo + hi - 10.0).abs() < 1e-9);
    let [lo, hi] = window(&dragged_window(&ramp(), [0.0, 0.5], range));
    assert!((hi - lo - 10.0).abs() < 1e-9 && lo == -5.0);
    // However far it goes, something of the volume is left within reach.
    let mut function = ramp();
    (0..100).for_each(|_| function = dragged_window(&function, [-2.0, 2.0], range));
    let [lo, hi] = window(&function);
    assert!(lo >= -301.0 && hi > lo);
}

#[test]
fn the_last_point_stays() {
    let one = of(vec![ramp().points()[0]]).unwrap();
    assert_eq!(removed(&one, 0), None);
    assert_eq!(removed(&ramp(), 4), None);
    assert_eq!(removed(&ramp(), 1).unwrap().points().len(), 3);
}

#[test]
fn a_map_lies_over_the_window() {
    let f = with_colormap(&ramp(), "gray", [0.0, 1.0]).unwrap();
    let (color, opacity) = f.evaluate(5.0);
    assert!(color.iter().all(|c| (c - 0.5).abs() < 1e-9) && (opacity - 0.25).abs() < 1e-12);
    let g = with_colors_of(&ramp(), &f, [0.0, 1.0]).unwrap();
    // The other's points go from -10 to 50; its window does not matter.
    assert_eq!(g.evaluate(0.0).0, [0.0; 3]);
    assert_eq!(g.evaluate(10.0).0, [1.0; 3]);
}
