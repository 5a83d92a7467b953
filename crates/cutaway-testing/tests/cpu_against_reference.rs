//! One scene, every renderer: the CPU engine against the reference, and against itself.

use cutaway_core::analytic::AnalyticField;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::reference;
use cutaway_core::scene::{Mode, RenderSettings, SpaceSkipping};
use cutaway_core::volume::Volume;
use cutaway_cpu::{CpuRenderer, SimdChoice};
use cutaway_testing::engines::cpu;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, soft, uniform};
use cutaway_testing::tolerances::{EXACT, SAME_KERNEL, STEPPED, Tolerance, assert_close};

fn settings(mode: Mode, volume: &Volume) -> RenderSettings {
    let [lo, hi] = volume.value_range();
    RenderSettings {
        mode,
        // The signal of Marschner and Lobb turns its normals over within a voxel.
        step: if volume.dimensions() == UVec3::splat(65) { 0.125 } else { 0.25 },
        resolution: SMALL,
        iso: if mode == Mode::Iso { vec![lo + 0.55 * (hi - lo), lo + 0.8 * (hi - lo)] } else { vec![] },
        iso_opacity: if mode == Mode::Iso { 0.7 } else { 1.0 },
        // Crossings are exact, so nothing may be left out behind them.
        early_termination: if mode == Mode::Iso { 1.0 } else { 0.999 },
        ..RenderSettings::default()
    }
}

/// The instruction sets of this processor.
fn choices() -> Vec<SimdChoice> {
    [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Avx512]
        .into_iter()
        .filter(|s| CpuRenderer::new(1, *s).is_ok())
        .collect()
}

fn volumes() -> Vec<(&'static str, Volume)> {
    vec![
        ("marschner-lobb", AnalyticField::MarschnerLobb.volume(65)),
        ("torus", AnalyticField::Torus.volume(60)),
        ("oblique noise", oblique_noise(UVec3::new(37, 25, 19), 11)),
    ]
}

fn tolerance(mode: Mode) -> Tolerance {
    // Isosurfaces have no step: both solve the same cubics.
    if mode == Mode::Iso { EXACT } else { STEPPED }
}

#[test]
fn every_mode_agrees_with_the_reference() {
    for (name, volume) in volumes() {
        for mode in Mode::ALL {
            for shade in [false, true] {
                let lighting = Lighting { shade, ..Lighting::default() };
                let scene = framed(&volume, &soft(volume.value_range()), lighting, settings(mode, &volume));
                let (image, _) = cpu(&scene, SimdChoice::Auto, 0);
                let what = format!("{name}, {}, shaded {shade}", mode.name());
                assert_close(&what, &reference::render(&scene), &image, tolerance(mode));
            }
        }
    }
}

#[test]
fn every_curve_and_light_agrees_with_the_reference() {
    let volume = oblique_noise(UVec3::new(25, 19, 31), 5);
    for diffuse_curve in [DiffuseCurve::Clamped, DiffuseCurve::TwoSided, DiffuseCurve::Wrapped] {
        for light in [None, Some([1.0, -0.5, 2.0])] {
            let lighting = Lighting {
                diffuse_curve,
                light,
                wrap_power: 1.7,
                specular_power: 7.5,
                ..Lighting::default()
            };
            let scene =
                framed(&volume, &soft(volume.value_range()), lighting, settings(Mode::Composite, &volume));
            let what = format!("{diffuse_curve:?}, light {light:?}");
            assert_close(&what, &reference::render(&scene), &cpu(&scene, SimdChoice::Auto, 0).0, STEPPED);
        }
    }
}

#[test]
fn orthographic_views_and_eyes_inside_the_volume_agree_with_the_reference() {
    let volume = AnalyticField::MarschnerLobb.volume(65);
    let function = soft(volume.value_range());
    let mut scene = framed(&volume, &function, Lighting::default(), settings(Mode::Composite, &volume));
    let mut camera = scene.camera().clone();
    camera.orthographic = Some(15.0);
    let mut inside = scene.camera().clone();
    inside.position = volume.center_in_world().to_array();
    inside.focal_point = (volume.center_in_world() + DVec3::new(1.0, 0.2, 0.1)).to_array();
    inside.view_angle = 70.0;
    for (what, camera) in [("orthographic", camera), ("inside", inside)] {
        scene.set_camera(camera).unwrap();
        assert_close(what, &reference::render(&scene), &cpu(&scene, SimdChoice::Auto, 0).0, STEPPED);
    }
}

#[test]
fn every_instruction_set_gives_the_same_image() {
    for (name, volume) in volumes() {
        for mode in Mode::ALL {
            let scene =
                framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
            let (scalar, _) = cpu(&scene, SimdChoice::Scalar, 0);
            for simd in choices() {
                let what = format!("{name}, {}, {simd:?} against scalar", mode.name());
                assert_close(&what, &scalar, &cpu(&scene, simd, 0).0, SAME_KERNEL);
            }
        }
    }
}

#[test]
fn skipping_space_changes_no_pixel_and_takes_fewer_samples() {
    for (name, volume) in volumes() {
        for mode in [Mode::Composite, Mode::Iso, Mode::Mip, Mode::Minip, Mode::Mean] {
            let with = settings(mode, &volume);
            let without = RenderSettings { space_skipping: SpaceSkipping::Off, ..with.clone() };
            let [lo, hi] = volume.value_range();
            // Only the top of the range is visible.
            let function = soft([lo + 0.75 * (hi - lo), hi]);
            let scene = |s| framed(&volume, &function, Lighting::default(), s);
            let (skipped, few) = cpu(&scene(with), SimdChoice::Auto, 0);
            let (full, many) = cpu(&scene(without), SimdChoice::Auto, 0);
            assert_eq!(skipped.pixels(), full.pixels(), "{name}, {}", mode.name());
            assert!(few.samples <= many.samples);
            if name == "torus" && mode == Mode::Composite {
                // Packets of this small image are as wide as blocks: a third less is what can be had.
                assert!(few.samples * 3 < many.samples * 2, "{} of {}", few.samples, many.samples);
            }
        }
    }
}

#[test]
fn skipping_space_changes_no_pixel_from_any_side() {
    // A thin shell that reaches the volume's faces: rays of a packet enter at very different depths.
    let volume = AnalyticField::MarschnerLobb.volume(100);
    let gray = |value, opacity| cutaway_testing::scenes::point(value, [value; 3], opacity);
    let points = vec![gray(0.0, 0.0), gray(0.6, 0.0), gray(0.601, 0.5), gray(1.0, 0.5)];
    let function = cutaway_core::transfer_function::TransferFunction::new(points).unwrap();
    let with = RenderSettings { resolution: [105, 86], ..RenderSettings::default() };
    let without = RenderSettings { space_skipping: SpaceSkipping::Off, ..with.clone() };
    for view in 0..60 {
        let mut scenes =
            [&with, &without].map(|s| framed(&volume, &function, Lighting::default(), s.clone()));
        let mut camera = scenes[0].camera().clone();
        camera.azimuth(f64::from(view) * 2.4);
        camera.elevation((f64::from(view) * 1.7).sin() * 1.5);
        camera.zoom([1.0, 3.0, 0.4][view as usize % 3]);
        camera.orthographic = (view % 4 == 3).then_some(40.0);
        for scene in &mut scenes {
            scene.set_camera(camera.clone()).unwrap();
        }
        let [skipped, full] = scenes.map(|scene| cpu(&scene, SimdChoice::Auto, 0).0);
        assert_eq!(skipped.pixels(), full.pixels(), "view {view}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_image() {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 3);
    let scene = framed(
        &volume,
        &soft(volume.value_range()),
        Lighting::default(),
        RenderSettings { resolution: [133, 97], ..settings(Mode::Composite, &volume) },
    );
    let (one, _) = cpu(&scene, SimdChoice::Auto, 1);
    for threads in [2, 3, 7] {
        assert_eq!(one, cpu(&scene, SimdChoice::Auto, threads).0);
    }
}

#[test]
fn halving_the_step_converges_at_second_order_and_keeps_the_brightness() {
    let torus = (AnalyticField::Torus.volume(24), false, vec![2.0, 1.0, 0.5]);
    // Shaded ripples, as fine as a grid can hold: the order shows once a step is finer than a crest, and until the
    // error meets that of the classification table.
    let ripples = (AnalyticField::MarschnerLobb.volume(41), true, vec![0.25, 0.125]);
    for (volume, shade, steps) in [torus, ripples] {
        let function = soft(volume.value_range());
        let scene = |step: f64| {
            let settings =
                RenderSettings { step, early_termination: 1.0, ..settings(Mode::Composite, &volume) };
            framed(&volume, &function, Lighting { shade, ..Lighting::default() }, settings)
        };
        let exact = reference::render(&scene(1.0));
        let images: Vec<Image> = steps.iter().map(|&step| cpu(&scene(step), SimdChoice::Auto, 0).0).collect();
        let errors: Vec<f64> = images.iter().map(|image| rmse(&exact, image)).collect();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!(order > 1.6, "shaded {shade}: errors {errors:?}");
        }
        let mean = |i: &Image| i.pixels().iter().map(|p| f64::from(p[3])).sum::<f64>();
        for (step, image) in steps.iter().zip(&images) {
            let brightness = mean(image) / mean(&exact);
            assert!((brightness - 1.0).abs() < 2e-3, "step {step}: {brightness}");
        }
    }
}

fn rmse(a: &Image, b: &Image) -> f64 {
    cutaway_core::image::compare::compare(a, b).unwrap().rmse
}

#[test]
fn a_uniform_volume_is_exact_at_any_step() {
    // The partial last step has its own length: no step divides the volume.
    let volume = uniform(UVec3::new(9, 8, 7), 1.0, DVec3::new(1.0, 1.3, 0.7));
    for step in [0.3, 0.77, 1.9, 30.0] {
        let settings = RenderSettings { step, early_termination: 1.0, ..settings(Mode::Composite, &volume) };
        let function =
            cutaway_core::transfer_function::TransferFunction::new(vec![cutaway_testing::scenes::point(
                1.0,
                [0.2, 0.6, 1.0],
                0.1,
            )])
            .unwrap();
        let scene = framed(&volume, &function, Lighting { shade: false, ..Lighting::default() }, settings);
        assert_close(
            &format!("step {step}"),
            &reference::render(&scene),
            &cpu(&scene, SimdChoice::Auto, 0).0,
            Tolerance { rmse: 2e-6, bias: 2e-6, outliers: 0.0 },
        );
    }
}
