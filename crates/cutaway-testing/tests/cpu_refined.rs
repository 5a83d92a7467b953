//! The settings of the CPU engine that make a step more than the value in its middle, or read voxels otherwise: each
//! against the reference, and against the plain engine.

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::image::compare::compare_with;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Gradient, Layout, Mode, RenderSettings, Sampling, Scene, SpaceSkipping};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_cpu::{CpuRenderer, SimdChoice};
use cutaway_testing::engines::cpu;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, soft};
use cutaway_testing::tolerances::{OUTLIER, SAME_KERNEL, STEPPED, Tolerance, assert_close};

fn noise() -> Volume {
    oblique_noise(UVec3::new(37, 25, 19), 11)
}

fn scene(volume: &Volume, shade: bool, settings: RenderSettings) -> Scene {
    framed(volume, &soft(volume.value_range()), Lighting { shade, ..Lighting::default() }, settings)
}

fn at_step(step: f64) -> RenderSettings {
    RenderSettings { step, resolution: SMALL, ..RenderSettings::default() }
}

fn image(scene: &Scene) -> Image {
    cpu(scene, SimdChoice::Auto, 0).0
}

fn error(expected: &Image, actual: &Image) -> f64 {
    compare_with(expected, actual, OUTLIER).unwrap().rmse
}

/// Every setting by itself.
fn all(step: f64) -> Vec<(&'static str, RenderSettings)> {
    let plain = at_step(step);
    vec![
        ("bricks", RenderSettings { layout: Layout::Bricks, ..plain.clone() }),
        ("pre-integration", RenderSettings { pre_integration: true, ..plain.clone() }),
        ("adaptive", RenderSettings { adaptive_threshold: Some(0.02), ..plain.clone() }),
        ("object-aligned", RenderSettings { sampling: Sampling::Object, ..plain.clone() }),
        ("sobel", RenderSettings { gradient: Gradient::Sobel, ..plain.clone() }),
        ("precomputed", RenderSettings { gradient: Gradient::Precomputed, ..plain.clone() }),
        (
            "sobel in bricks",
            RenderSettings { gradient: Gradient::Sobel, layout: Layout::Bricks, ..plain.clone() },
        ),
        ("planes in bricks", RenderSettings { sampling: Sampling::Object, layout: Layout::Bricks, ..plain }),
    ]
}

#[test]
fn bricks_change_nothing_but_where_voxels_lie() {
    for dimensions in [UVec3::new(37, 25, 19), UVec3::new(85, 12, 50), UVec3::new(2, 3, 2)] {
        let volume = oblique_noise(dimensions, 4);
        for mode in [Mode::Composite, Mode::Mip, Mode::Mean] {
            let linear = RenderSettings { mode, ..at_step(0.5) };
            let bricks = RenderSettings { layout: Layout::Bricks, ..linear.clone() };
            let what = format!("{dimensions}, {}", mode.name());
            let (linear, bricks) =
                (image(&scene(&volume, true, linear)), image(&scene(&volume, true, bricks)));
            assert_close(&what, &linear, &bricks, SAME_KERNEL);
        }
    }
}

#[test]
fn refined_steps_agree_with_the_reference() {
    let volume = noise();
    for shade in [false, true] {
        let expected = reference::render(&scene(&volume, shade, at_step(0.25)));
        for (name, settings) in &all(0.25)[1..3] {
            let what = format!("{name}, shaded {shade}");
            assert_close(&what, &expected, &image(&scene(&volume, shade, settings.clone())), STEPPED);
        }
    }
}

/// What each is for: at a coarse step it is nearer to the reference than the plain engine.
#[test]
fn coarse_steps_gain_from_refinement() {
    let volume = noise();
    let expected = reference::render(&scene(&volume, false, at_step(1.0)));
    let plain = error(&expected, &image(&scene(&volume, false, at_step(1.0))));
    for (name, settings) in &all(1.0)[1..3] {
        let refined = error(&expected, &image(&scene(&volume, false, settings.clone())));
        assert!(refined < 0.5 * plain, "{name}: {refined} against {plain}");
    }
}

/// On planes the step is that between planes: as far from the reference as steps of that length.
#[test]
fn object_aligned_samples_are_as_good_as_their_step() {
    let volume = noise();
    let expected = reference::render(&scene(&volume, false, at_step(1.0)));
    let on_planes = RenderSettings { sampling: Sampling::Object, ..at_step(1.0) };
    let (aligned, viewed) = (
        error(&expected, &image(&scene(&volume, false, on_planes))),
        error(&expected, &image(&scene(&volume, false, at_step(1.0)))),
    );
    // Planes are up to the square root of three voxels apart along a ray, and anisotropic voxels farther; errors go with the square.
    assert!(aligned < 12.0 * viewed && aligned < 0.05, "{aligned} against {viewed}");
}

/// On a linear field all gradients are the same.
#[test]
fn gradients_of_a_linear_field_are_one() {
    let d = UVec3::new(24, 20, 28);
    let value = |i: u32| {
        let (x, y, z) = (i % d.x, i / d.x % d.y, i / (d.x * d.y));
        (10 * x + 23 * y + 7 * z) as u16
    };
    let voxels: Vec<u16> = (0..d.x * d.y * d.z).map(value).collect();
    let geometry = Geometry::from_spacing(DVec3::ONE);
    let volume = Volume::new(d, voxels, Rescale::IDENTITY, geometry).unwrap();
    let of = |gradient| image(&scene(&volume, true, RenderSettings { gradient, ..at_step(0.5) }));
    let central = of(Gradient::Central);
    for gradient in [Gradient::Sobel, Gradient::Precomputed] {
        // At the border the voxels repeat, and the smoother kernel sees more of that.
        let tolerance = Tolerance { rmse: 0.02, bias: 0.01, outliers: 0.5 };
        assert_close(&format!("{gradient:?}"), &central, &of(gradient), tolerance);
    }
}

#[test]
fn threads_skipping_and_instruction_sets_change_nothing() {
    let volume = noise();
    for (name, settings) in all(0.7) {
        let plain = scene(&volume, true, settings.clone());
        let (expected, counts) = cpu(&plain, SimdChoice::Auto, 1);
        assert_eq!(expected, cpu(&plain, SimdChoice::Auto, 3).0, "{name}: threads");
        let off = RenderSettings { space_skipping: SpaceSkipping::Off, ..settings };
        let unskipped = scene(&volume, true, off);
        let (all, all_counts) = cpu(&unskipped, SimdChoice::Auto, 0);
        assert_close(&format!("{name}: skipping"), &expected, &all, SAME_KERNEL);
        assert!(counts.samples <= all_counts.samples, "{name}");
        for choice in [SimdChoice::Scalar, SimdChoice::Avx2] {
            if CpuRenderer::new(1, choice).is_ok() {
                assert_close(name, &expected, &cpu(&plain, choice, 0).0, SAME_KERNEL);
            }
        }
    }
}
