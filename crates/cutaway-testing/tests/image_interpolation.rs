//! Images of which not every pixel is cast, against those of which every one is.

use cutaway_core::analytic::AnalyticField;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::histogram::{Histogram, default_for_mode};
use cutaway_core::image::Image;
use cutaway_core::image::compare::compare;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{ImageInterpolation, Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_cpu::{CpuRenderer, SimdChoice, Statistics};
use cutaway_io::samples::read_sample;
use cutaway_io::volume::ReadOptions;
use cutaway_testing::engines::cpu;
use cutaway_testing::scenes::{framed, oblique_noise, point, soft, uniform};
use cutaway_testing::tolerances::INTERPOLATED;

/// Larger than small scenes, so that cells are as small beside what is seen as they are in use; no multiple of a cell.
const SIZE: [u32; 2] = [251, 203];

fn settings(mode: Mode, how: ImageInterpolation) -> RenderSettings {
    RenderSettings { mode, image_interpolation: how, resolution: SIZE, ..RenderSettings::default() }
}

fn volumes() -> Vec<(&'static str, Volume)> {
    vec![
        ("marschner-lobb", AnalyticField::MarschnerLobb.volume(65)),
        ("torus", AnalyticField::Torus.volume(60)),
        ("oblique noise", oblique_noise(UVec3::new(37, 25, 19), 11)),
        ("mr-head", read_sample("mr-head", &ReadOptions::default()).unwrap().value),
        ("bonsai", read_sample("bonsai", &ReadOptions::default()).unwrap().value),
    ]
}

/// A scene as nobody asked for another, in a mode.
fn scene(volume: &Volume, mode: Mode, shade: bool, how: ImageInterpolation) -> Scene {
    let iso = vec![Histogram::new(volume, 256).percentile_from(64, 0.5)];
    let settings =
        RenderSettings { iso: if mode == Mode::Iso { iso } else { vec![] }, ..settings(mode, how) };
    let camera = default_camera(volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let lighting = Lighting { shade, ..Lighting::default() };
    Scene::new(
        Layer::new(volume.clone(), &default_for_mode(volume, mode)).with_lighting(lighting),
        camera,
        settings,
    )
    .unwrap()
}

fn render(scene: &Scene) -> (Image, Statistics) {
    cpu(scene, SimdChoice::Auto, 0)
}

#[test]
fn adaptive_interpolation_keeps_its_bound_in_every_mode() {
    for (name, volume) in volumes() {
        for mode in Mode::ALL {
            for shade in [false, true] {
                let (full, all) = render(&scene(&volume, mode, shade, ImageInterpolation::Off));
                let (image, some) = render(&scene(&volume, mode, shade, ImageInterpolation::Adaptive));
                let c = compare(&full, &image).unwrap();
                let share = some.rays as f64 / all.rays as f64;
                println!("{name}, {}, shaded {shade}: rmse {:.5}, rays {share:.2}", mode.name(), c.rmse);
                assert!(c.rmse <= INTERPOLATED.rmse, "{name}, {}: {:.5}", mode.name(), c.rmse);
                assert!(c.bias.iter().all(|b| b.abs() <= INTERPOLATED.bias), "{name}: {:?}", c.bias);
                // One ray in eight is the lattice and its middles, should every cell be cast in full.
                assert!(share <= 1.15, "{name}, {}: {share}", mode.name());
            }
        }
    }
}

#[test]
fn what_is_smooth_is_filled_and_what_is_cast_keeps_its_bits() {
    let volume = AnalyticField::Torus.volume(60);
    let of = |how| {
        render(&framed(
            &volume,
            &soft(volume.value_range()),
            Lighting::default(),
            settings(Mode::Composite, how),
        ))
    };
    let (full, all) = of(ImageInterpolation::Off);
    let (image, some) = of(ImageInterpolation::Adaptive);
    let same = full.pixels().iter().zip(image.pixels()).filter(|(a, b)| a == b).count();
    let not_filled = same as f64 / full.pixels().len() as f64;
    assert!(some.rays < all.rays, "{} of {}", some.rays, all.rays);
    assert!(some.samples < all.samples, "{} of {}", some.samples, all.samples);
    assert!(not_filled > 0.1 && not_filled < 1.0, "{not_filled}");
}

#[test]
fn a_factor_casts_a_lattice() {
    let volume = AnalyticField::Torus.volume(60);
    let of = |how| render(&scene(&volume, Mode::Composite, true, how));
    let (full, all) = of(ImageInterpolation::Off);
    let mut errors = vec![0.0];
    for factor in [2, 3, 4, 16] {
        let (image, some) = of(ImageInterpolation::Factor(factor));
        let share = some.rays as f64 / all.rays as f64 * f64::from(factor * factor);
        assert!((0.85..1.35).contains(&share), "factor {factor}: {} of {}", some.rays, all.rays);
        // Lattice pixels are cast as they are in the full image; other packets round otherwise.
        for y in (0..SIZE[1]).step_by(factor as usize) {
            for x in (0..SIZE[0]).step_by(factor as usize) {
                let (a, b) = (full.pixel(x, y).unwrap(), image.pixel(x, y).unwrap());
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3), "({x}, {y}): {a:?}, {b:?}");
            }
        }
        errors.push(compare(&full, &image).unwrap().rmse);
    }
    assert!(errors.is_sorted(), "{errors:?}");
}

#[test]
fn a_thin_line_before_nothing_is_kept() {
    // One voxel thick, an oblique pixel or less wide, and half of it falls between lattice pixels.
    let n = 128u32;
    let mut voxels = vec![0u8; (n * n * n) as usize];
    for i in 8..120 {
        voxels[((64 * n + i) * n + 64) as usize] = 255;
    }
    let volume = Volume::new(UVec3::splat(n), voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE));
    let volume = volume.unwrap();
    let points = vec![point(20.0, [1.0; 3], 0.0), point(60.0, [1.0, 0.8, 0.2], 0.9)];
    let function = TransferFunction::new(points).unwrap();
    let of = |how| render(&framed(&volume, &function, Lighting::default(), settings(Mode::Composite, how))).0;
    let (full, image) = (of(ImageInterpolation::Off), of(ImageInterpolation::Adaptive));
    assert!(full.pixels().iter().filter(|p| p[3] > 0.1).count() > 50, "there is a line to be missed");
    assert_eq!(full, image);
}

#[test]
fn a_uniform_look_is_filled_without_a_trace() {
    let volume = uniform(UVec3::new(20, 20, 20), 1.0, DVec3::ONE);
    let function = TransferFunction::new(vec![point(1.0, [0.2, 0.6, 1.0], 1.0)]).unwrap();
    let of = |how| {
        let mut scene = framed(
            &volume,
            &function,
            Lighting { shade: false, ..Lighting::default() },
            settings(Mode::Composite, how),
        );
        // The volume fills the view.
        let mut camera = scene.camera().clone();
        camera.zoom(4.0);
        scene.set_camera(camera).unwrap();
        render(&scene)
    };
    let (full, all) = of(ImageInterpolation::Off);
    let (image, some) = of(ImageInterpolation::Adaptive);
    assert_eq!(full.pixels(), image.pixels());
    assert!(some.rays * 7 < all.rays, "{} of {}", some.rays, all.rays);
}

#[test]
fn any_number_of_threads_gives_the_same_interpolated_image() {
    let volume = AnalyticField::MarschnerLobb.volume(65);
    for how in [ImageInterpolation::Adaptive, ImageInterpolation::Factor(3)] {
        for mode in [Mode::Composite, Mode::Mip] {
            let scene = scene(&volume, mode, true, how);
            let one = cpu(&scene, SimdChoice::Auto, 1);
            for threads in [2, 5] {
                assert_eq!(one, cpu(&scene, SimdChoice::Auto, threads), "{how:?}");
            }
        }
    }
}

#[test]
fn every_instruction_set_interpolates_within_the_bound() {
    let volume = AnalyticField::MarschnerLobb.volume(65);
    for mode in [Mode::Composite, Mode::Mip, Mode::Iso] {
        let full = render(&scene(&volume, mode, true, ImageInterpolation::Off)).0;
        for simd in [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Avx512] {
            if CpuRenderer::new(1, simd).is_ok() {
                let image = cpu(&scene(&volume, mode, true, ImageInterpolation::Adaptive), simd, 0).0;
                assert!(compare(&full, &image).unwrap().rmse <= INTERPOLATED.rmse, "{simd:?}");
            }
        }
    }
}

#[test]
fn images_smaller_than_a_cell_are_rendered() {
    let volume = AnalyticField::Torus.volume(20);
    for resolution in [[1, 1], [2, 3], [1, 40], [5, 4]] {
        for how in
            [ImageInterpolation::Adaptive, ImageInterpolation::Factor(2), ImageInterpolation::Factor(16)]
        {
            let settings = RenderSettings { resolution, ..settings(Mode::Composite, how) };
            let image =
                render(&framed(&volume, &soft(volume.value_range()), Lighting::default(), settings)).0;
            assert_eq!([image.width(), image.height()], resolution);
            assert!(image.pixels().iter().flatten().all(|c| c.is_finite()));
        }
    }
}
