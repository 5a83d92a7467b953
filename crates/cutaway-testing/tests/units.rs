//! The unit of values, the unit of length, offsets and the place of the origin change no image: reference and CPU engine.

use cutaway_core::glam::DVec3;
use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Mode, Scene};
use cutaway_cpu::SimdChoice;
use cutaway_testing::engines::cpu;
use cutaway_testing::tolerances::{Tolerance, assert_close};
use cutaway_testing::units::{Cut, Units};
use proptest::prelude::*;

/// Rounding of values, of places and of the camera; a pixel at the border of a cut may be on its other side.
const SAME_SCENE: Tolerance = Tolerance { rmse: 2e-3, bias: 5e-4, outliers: 5e-3 };

fn by_cpu(scene: &Scene) -> Image {
    cpu(scene, SimdChoice::Auto, 0).0
}

/// Both engines' images in other units are those in units of one.
fn assert_same(units: Units, mode: Mode, cut: Cut) {
    let (one, other) = (Units::ONE.scene(mode, cut), units.scene(mode, cut));
    let what = format!("{units:?}, {}, {cut:?}", mode.name());
    assert_close(&format!("cpu: {what}"), &by_cpu(&one), &by_cpu(&other), SAME_SCENE);
    let expected = reference::render(&one);
    assert!(expected.pixels().iter().any(|p| p[3] > 0.05), "{what}: the scene shows something");
    assert_close(&format!("reference: {what}"), &expected, &reference::render(&other), SAME_SCENE);
}

fn modes() -> impl Strategy<Value = Mode> {
    prop::sample::select(vec![Mode::Composite, Mode::Composite, Mode::Iso, Mode::Mip, Mode::Mean])
}

fn cuts() -> impl Strategy<Value = Cut> {
    prop::sample::select(vec![Cut::Nothing, Cut::Sphere, Cut::Mesh])
}

#[test]
fn report_33_light_of_large_and_small_values() {
    for value in [1e21, 1e30, 1e-21, 1e-36, 1e-60, 1e60, 1e200, 1e-300, 1e300] {
        assert_same(Units { value, ..Units::ONE }, Mode::Composite, Cut::Nothing);
    }
}

#[test]
fn report_61_small_variations_on_a_large_offset() {
    for offset in [101_325.0 / 0.01, -1e9, 3e7] {
        assert_same(Units { offset, ..Units::ONE }, Mode::Composite, Cut::Nothing);
    }
}

#[test]
fn report_b5_every_unit_of_length() {
    for length in [1e-15, 1e-12, 1e-9, 3e13, 1e15, 1e16] {
        for cut in [Cut::Nothing, Cut::Sphere, Cut::Mesh] {
            assert_same(Units { length, ..Units::ONE }, Mode::Composite, cut);
        }
        assert_same(Units { length, ..Units::ONE }, Mode::Iso, Cut::Nothing);
    }
}

#[test]
fn depths_are_in_the_units_of_the_world() {
    let depth = |length: f64| {
        let scene = Units { length, ..Units::ONE }.scene(Mode::Iso, Cut::Nothing);
        let (by_cpu, by_reference) = (by_cpu(&scene), reference::render(&scene));
        [by_cpu, by_reference].map(|image| image.depth().expect("a depth")[41 * 16 + 20])
    };
    let [one, same] = depth(1.0);
    assert!(one.is_finite() && (one - same).abs() < 1e-3 * one);
    for length in [1e-15, 1e12] {
        for found in depth(length) {
            let expected = f64::from(one) * length;
            assert!((f64::from(found) - expected).abs() < 1e-3 * expected, "{found} for {expected}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_magnitude_of_values_changes_an_image(exponent in -300.0f64..300.0, mode in modes(), cut in cuts()) {
        assert_same(Units { value: 10f64.powf(exponent), ..Units::ONE }, mode, cut);
    }

    #[test]
    fn no_offset_of_values_changes_an_image(
        offset in -1e9f64..1e9,
        exponent in -280.0f64..280.0,
        mode in modes(),
        cut in cuts(),
    ) {
        assert_same(Units { offset, value: 10f64.powf(exponent), ..Units::ONE }, mode, cut);
    }

    #[test]
    fn no_unit_of_length_and_no_place_changes_an_image(
        exponent in -15.0f64..15.0,
        (x, y, z) in (-1e6f64..1e6, -1e6f64..1e6, -1e6f64..1e6),
        mode in modes(),
        cut in cuts(),
    ) {
        let place = DVec3::new(x, y, z);
        assert_same(Units { length: 10f64.powf(exponent), place, ..Units::ONE }, mode, cut);
    }
}
