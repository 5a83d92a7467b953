//! The GPU ray caster against the reference and against the CPU engine: real volumes in every mode at a quarter of a voxel,
//! and small scenes with every fallback forced.
//!
//! A test whose volume is not there (see `cutaway_testing::real`) shows as ignored, and so do all where there is no adapter.
//! `cargo test -p cutaway-testing --test gpu_against_reference -- --nocapture` prints the table of errors.

use std::sync::Arc;

use cutaway_core::analytic::AnalyticField;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::histogram::{Histogram, default_for_mode};
use cutaway_core::image::Image;
use cutaway_core::image::compare::{Comparison, compare};
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, SpaceSkipping, default_camera};
use cutaway_core::volume::Volume;
use cutaway_cpu::SimdChoice;
use cutaway_gpu::context::Fallbacks;
use cutaway_gpu::{GpuError, RaycastRenderer};
use cutaway_testing::engines::{cpu, raycast};
use cutaway_testing::gpus::{best, fallback_sets, renderer, there_is_an_adapter};
use cutaway_testing::real::{FILES, SAMPLES, is_there, read};
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point, soft, uniform};
use libtest_mimic::{Arguments, Failed, Trial};

/// Of real volumes, as for the CPU engine: light needs a finer step where normals turn within a fraction of a voxel.
const LARGEST_RMSE: f64 = 0.004;

/// A brightening or darkening of any channel: nothing but early termination at 0.999 may darken.
const LARGEST_BIAS: f64 = 0.001;

/// From the CPU engine at the same step, where rounding tells them apart: at a step of the transfer function, and for
/// isosurfaces seen edge-on, of which a pixel may see one and not the other.
const LARGEST_RMSE_FROM_CPU: f64 = 0.002;

/// Small scenes, smooth where the transfer function bends: see `tolerances::STEPPED`.
const LARGEST_RMSE_OF_SMALL: f64 = 0.002;

const SIZE: [u32; 2] = [121, 91];

/// Every mode, shaded where light matters, and not.
const MODES: [(Mode, bool); 7] = [
    (Mode::Composite, true),
    (Mode::Composite, false),
    (Mode::Iso, true),
    (Mode::Iso, false),
    (Mode::Mip, false),
    (Mode::Minip, false),
    (Mode::Mean, false),
];

/// What is checked, by itself.
type Check = fn() -> Result<(), Failed>;

fn main() {
    let arguments = Arguments::from_args();
    let there = there_is_an_adapter();
    let mut trials: Vec<Trial> = SAMPLES
        .into_iter()
        .chain(FILES)
        .map(|name| {
            let trial = Trial::test(format!("volume_{name}"), move || real_volume(name));
            trial.with_ignored_flag(!there || !is_there(name))
        })
        .collect();
    for (name, fallbacks) in fallback_sets() {
        let test = format!("fallback_{}", name.replace(' ', "_"));
        trials.push(Trial::test(test, move || fallback(name, &fallbacks)).with_ignored_flag(!there));
    }
    let others: [(&str, Check); 8] = [
        ("every_curve_and_light", every_curve_and_light),
        ("orthographic_views_and_eyes_inside", orthographic_views_and_eyes_inside),
        ("a_uniform_volume_is_exact_at_any_step", a_uniform_volume_is_exact_at_any_step),
        ("any_unit_of_length_gives_the_same_image", any_unit_of_length_gives_the_same_image),
        ("a_label_at_exactly_the_isovalue_is_inside", a_label_at_exactly_the_isovalue_is_inside),
        ("skipping_space_changes_no_pixel", skipping_space_changes_no_pixel),
        ("depths_agree_with_the_reference", depths_agree_with_the_reference),
        ("an_image_too_large_is_an_error_that_says_so", an_image_too_large_is_an_error_that_says_so),
    ];
    trials.extend(others.map(|(name, test)| Trial::test(name, test).with_ignored_flag(!there)));
    libtest_mimic::run(&arguments, trials).exit();
}

/// The largest bias of a channel, with its sign.
fn bias(c: &Comparison) -> f64 {
    c.bias.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a })
}

/// An error with all numbers where two images are too far apart.
fn near(what: &str, expected: &Image, actual: &Image, rmse: f64) -> Result<Comparison, Failed> {
    let c = compare(expected, actual)?;
    if c.exceeds(rmse) || bias(&c).abs() > LARGEST_BIAS.min(rmse) {
        return Err(format!("{what}: {c}; at most {rmse}").into());
    }
    Ok(c)
}

fn real_volume(name: &str) -> Result<(), Failed> {
    let volume = read(name)?;
    let renderer = best()?;
    let prepared = renderer.prepare(&volume)?;
    let mut failures = Vec::new();
    for (mode, shade) in MODES {
        let scene = real_scene(&volume, mode, shade);
        let classification = renderer.classify(&prepared, &scene)?;
        let (image, _) = renderer.render(&prepared, &classification, &scene, &|_| {})?;
        let from_cpu = compare(&cpu(&scene, SimdChoice::Auto, 0).0, &image)?;
        let c = compare(&reference::render(&scene), &image)?;
        let what = format!("{}{}", mode.name(), if shade { ", shaded" } else { "" });
        println!(
            "| {name} | {what} | {:.5} | {:+.5} | {:.3} | {:.5} |",
            c.rmse,
            bias(&c),
            c.largest_difference,
            from_cpu.rmse
        );
        if c.exceeds(LARGEST_RMSE) || bias(&c).abs() > LARGEST_BIAS {
            failures.push(format!("{what}: {c}; at most {LARGEST_RMSE}"));
        }
        if from_cpu.exceeds(LARGEST_RMSE_FROM_CPU) {
            failures
                .push(format!("{what}, from the CPU engine: {from_cpu}; at most {LARGEST_RMSE_FROM_CPU}"));
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n").into()) }
}

fn real_scene(volume: &Volume, mode: Mode, shade: bool) -> Scene {
    let histogram = Histogram::new(volume, 256);
    let settings = RenderSettings {
        mode,
        step: 0.25,
        resolution: SIZE,
        // Halfway up what is not background.
        iso: if mode == Mode::Iso { vec![histogram.percentile_from(64, 0.5)] } else { vec![] },
        ..RenderSettings::default()
    };
    let camera = default_camera(volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let lighting = Lighting { shade, ..Lighting::default() };
    Scene::new(
        Layer::new(volume.clone(), &default_for_mode(volume, mode)).with_lighting(lighting),
        camera,
        settings,
    )
    .expect("a valid scene")
}

fn settings(mode: Mode, volume: &Volume) -> RenderSettings {
    let [lo, hi] = volume.value_range();
    RenderSettings {
        mode,
        step: 0.25,
        resolution: SMALL,
        iso: if mode == Mode::Iso { vec![lo + 0.55 * (hi - lo), lo + 0.8 * (hi - lo)] } else { vec![] },
        iso_opacity: if mode == Mode::Iso { 0.7 } else { 1.0 },
        early_termination: if mode == Mode::Iso { 1.0 } else { 0.999 },
        ..RenderSettings::default()
    }
}

/// One volume of each way to keep voxels: 8 and 16 bits, and floats.
fn volumes() -> [(&'static str, Volume); 3] {
    let noise = oblique_noise(UVec3::new(37, 25, 19), 11);
    let bytes: Vec<u8> = (0..noise.voxels().len()).map(|i| (noise.voxels().get(i) / 256.0) as u8).collect();
    let eight = Volume::new(noise.dimensions(), bytes, noise.rescale(), *noise.geometry());
    [
        ("16 bits", noise),
        ("8 bits", eight.expect("as many voxels as before")),
        ("floats", AnalyticField::Torus.volume(33)),
    ]
}

fn fallback(name: &str, fallbacks: &Fallbacks) -> Result<(), Failed> {
    let renderer = renderer(name, fallbacks)?;
    for (kind, volume) in volumes() {
        for mode in Mode::ALL {
            let scene =
                framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
            let (image, _) = raycast(&scene, &renderer);
            let what = format!("{name}, {kind}, {}", mode.name());
            let c = near(&what, &reference::render(&scene), &image, LARGEST_RMSE_OF_SMALL)?;
            println!(
                "| {name} | {kind} | {} | {:.6} | {:+.6} | {:.4} |",
                mode.name(),
                c.rmse,
                bias(&c),
                c.largest_difference
            );
        }
    }
    Ok(())
}

fn every_curve_and_light() -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(25, 19, 31), 5);
    let renderer = best()?;
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
            let image = raycast(&scene, &renderer).0;
            near(&what, &reference::render(&scene), &image, LARGEST_RMSE_OF_SMALL)?;
        }
    }
    Ok(())
}

fn orthographic_views_and_eyes_inside() -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(25, 19, 31), 7);
    let renderer = best()?;
    for mode in Mode::ALL {
        let mut scene =
            framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
        let mut camera = scene.camera().clone();
        camera.orthographic = Some(30.0);
        let mut inside = scene.camera().clone();
        inside.position = volume.center_in_world().to_array();
        inside.focal_point = (volume.center_in_world() + DVec3::new(1.0, 0.2, 0.1)).to_array();
        inside.view_angle = 70.0;
        for (view, camera) in [("orthographic", camera), ("inside", inside)] {
            scene.set_camera(camera)?;
            let what = format!("{view}, {}", mode.name());
            let image = raycast(&scene, &renderer).0;
            near(&what, &reference::render(&scene), &image, LARGEST_RMSE_OF_SMALL)?;
        }
    }
    Ok(())
}

/// The partial last step has its own length: no step divides the volume, and one is longer than it.
fn a_uniform_volume_is_exact_at_any_step() -> Result<(), Failed> {
    let volume = uniform(UVec3::new(9, 8, 7), 1.0, DVec3::new(1.0, 1.3, 0.7));
    let renderer = best()?;
    for step in [0.3, 0.77, 1.9, 30.0, 1e6] {
        for opacity in [0.1, 1.0] {
            let settings =
                RenderSettings { step, early_termination: 1.0, ..settings(Mode::Composite, &volume) };
            let function = cutaway_core::transfer_function::TransferFunction::new(vec![point(
                1.0,
                [0.2, 0.6, 1.0],
                opacity,
            )])?;
            let scene =
                framed(&volume, &function, Lighting { shade: false, ..Lighting::default() }, settings);
            let image = raycast(&scene, &renderer).0;
            // Rounding of up to forty steps.
            near(&format!("step {step}, opacity {opacity}"), &reference::render(&scene), &image, 5e-6)?;
        }
    }
    Ok(())
}

/// A micrometre or a kilometre instead of a millimetre: lengths in shaders are relative, or this shows it.
fn any_unit_of_length_gives_the_same_image() -> Result<(), Failed> {
    let renderer = best()?;
    let images = |scale: f64| -> Result<Vec<Image>, Failed> {
        let bytes: Vec<u8> =
            (0..23u32 * 2 * 18).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let geometry = cutaway_core::volume::Geometry::from_spacing(DVec3::new(1.0, 3.0, 0.5) * scale);
        let rescale = cutaway_core::volume::Rescale::IDENTITY;
        let volume = Volume::new(UVec3::new(23, 2, 18), bytes, rescale, geometry)?;
        let render = |mode| {
            let scene =
                framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
            raycast(&scene, &renderer).0
        };
        Ok(Mode::ALL.map(render).to_vec())
    };
    let expected = images(1.0)?;
    for scale in [1e-6, 1e-3, 1e3, 1e6, 1e9] {
        for ((mode, expected), image) in Mode::ALL.iter().zip(&expected).zip(images(scale)?) {
            near(&format!("{}, {scale} times as large", mode.name()), expected, &image, 1e-3)?;
        }
    }
    Ok(())
}

/// Labels have no value between them: the isovalue is one of them, and its plateau is inside.
fn a_label_at_exactly_the_isovalue_is_inside() -> Result<(), Failed> {
    let renderer = best()?;
    let labels = |i: u32| {
        let p = UVec3::new(i % 12, i / 12 % 11, i / 132).as_vec3() - 5.0;
        if p.length() < 3.5 { 100u8 } else { 0 }
    };
    let geometry = cutaway_core::volume::Geometry::from_spacing(DVec3::ONE);
    for value in [1u32, 77, 100, 255] {
        let dimensions = UVec3::new(12, 11, 13);
        let count = dimensions.element_product();
        let eight: Vec<u8> = (0..count).map(|i| (u32::from(labels(i)) * value / 100) as u8).collect();
        let sixteen: Vec<u16> = (0..count).map(|i| (u32::from(labels(i)) * value * 2) as u16).collect();
        let floats: Vec<f32> =
            (0..count).map(|i| f32::from(labels(i)) * value as f32 * 0.017 - 3.0).collect();
        let rescale = cutaway_core::volume::Rescale { slope: 0.1, intercept: -3.0 };
        for volume in [
            Volume::new(dimensions, eight, rescale, geometry)?,
            Volume::new(dimensions, sixteen, rescale, geometry)?,
            Volume::new(dimensions, floats, rescale, geometry)?,
        ] {
            let [lo, hi] = volume.value_range();
            // Opaque: in a plateau of exactly the isovalue, what lies behind its first surface is rounding.
            let settings = RenderSettings { iso: vec![hi], iso_opacity: 1.0, ..settings(Mode::Iso, &volume) };
            let scene = framed(&volume, &soft([lo, hi]), Lighting::default(), settings);
            let image = raycast(&scene, &renderer).0;
            // Plateaus end at their voxels: the ray that grazes one sees it or not.
            let c = compare(&reference::render(&scene), &image)?;
            if c.outlier_share > 0.02 || c.non_finite_pixels > 0 {
                let kind = volume.source_type().name();
                return Err(format!("{kind}, {value}: {c}").into());
            }
        }
    }
    Ok(())
}

fn skipping_space_changes_no_pixel() -> Result<(), Failed> {
    let renderer: Arc<RaycastRenderer> = best()?;
    let volume = AnalyticField::MarschnerLobb.volume(41);
    // Only the top of the range is visible.
    let function = soft([0.7, 1.0]);
    for view in 0..12 {
        for mode in [Mode::Composite, Mode::Iso] {
            let with = settings(mode, &volume);
            let without = RenderSettings { space_skipping: SpaceSkipping::Off, ..with.clone() };
            let mut images = Vec::new();
            for settings in [with, without] {
                let mut scene = framed(&volume, &function, Lighting::default(), settings);
                let mut camera = scene.camera().clone();
                camera.azimuth(f64::from(view) * 2.4);
                camera.elevation((f64::from(view) * 1.7).sin() * 1.5);
                camera.zoom([1.0, 3.0, 0.4][view as usize % 3]);
                camera.orthographic = (view % 4 == 3).then_some(40.0);
                scene.set_camera(camera)?;
                images.push(raycast(&scene, &renderer));
            }
            near(&format!("view {view}, {}", mode.name()), &images[1].0, &images[0].0, 1e-6)?;
            if images[0].1.samples > images[1].1.samples {
                return Err(format!("view {view}: more samples with skipping than without").into());
            }
        }
    }
    Ok(())
}

/// Depth is where the opacity passes one half, or the first surface.
fn depths_agree_with_the_reference() -> Result<(), Failed> {
    let renderer = best()?;
    let volume = AnalyticField::Torus.volume(33);
    for mode in [Mode::Composite, Mode::Iso, Mode::Mean] {
        let scene =
            framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
        let (expected, actual) = (reference::render(&scene), raycast(&scene, &renderer).0);
        let depths = |image: &Image| image.depth().map(<[f32]>::to_vec).ok_or("there are no depths");
        let pairs: Vec<(f32, f32)> = depths(&expected)?.into_iter().zip(depths(&actual)?).collect();
        // At the rim of a thing the opacity may just pass one half or just not.
        let off = |(a, b): &&(f32, f32)| a.is_finite() != b.is_finite() || (a - b).abs() > 0.1;
        let off = pairs.iter().filter(off).filter(|(a, b)| a.is_finite() || b.is_finite()).count();
        let there = pairs.iter().filter(|(a, _)| a.is_finite()).count();
        if there == 0 || off * 50 > there {
            return Err(format!("{}: {off} of {there} depths are off", mode.name()).into());
        }
    }
    Ok(())
}

fn an_image_too_large_is_an_error_that_says_so() -> Result<(), Failed> {
    let renderer = best()?;
    let most = renderer.gpu().capabilities().max_texture_2d;
    if most >= 32768 {
        println!("every image that a scene can ask for fits on this GPU");
        return Ok(());
    }
    let volume = uniform(UVec3::splat(3), 1.0, DVec3::ONE);
    let settings = RenderSettings { resolution: [most + 1, 1], ..settings(Mode::Composite, &volume) };
    let scene = framed(&volume, &soft([0.0, 1.0]), Lighting::default(), settings);
    let prepared = renderer.prepare(&volume)?;
    let classification = renderer.classify(&prepared, &scene)?;
    match renderer.render(&prepared, &classification, &scene, &|_| {}) {
        Err(error @ GpuError::ImageTooLarge { .. }) if error.to_string().contains(&most.to_string()) => {
            Ok(())
        }
        Err(error) => Err(format!("another error: {error}").into()),
        Ok(_) => Err("no error".into()),
    }
}
