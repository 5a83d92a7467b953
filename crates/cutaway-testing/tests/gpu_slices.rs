//! The slice renderer against the reference: real volumes cut and uncut, small scenes from everywhere, bricks of every size,
//! and devices that cannot blend 32-bit floats.
//!
//! A test whose volume is not there (see `cutaway_testing::real`) shows as ignored, and so do all where there is no adapter.
//! `cargo test -p cutaway-testing --test gpu_slices -- --nocapture` prints the errors.

use std::sync::Arc;

use cutaway_core::clip::{Clip, ClipShading, Impregnation};
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::histogram::default_for_mode;
use cutaway_core::image::Image;
use cutaway_core::image::compare::{Comparison, compare};
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::reference;
use cutaway_core::scene::{Gradient, Layer, Mode, RenderSettings, Scene, SpaceSkipping, default_camera};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::Volume;
use cutaway_gpu::context::Fallbacks;
use cutaway_gpu::{Gpu, GpuError, GpuOptions, SliceRenderer};
use cutaway_mesh::EventFinder;
use cutaway_testing::clips::{ball, clips, middle, scene, settings};
use cutaway_testing::engines::slices;
use cutaway_testing::gpus::there_is_an_adapter;
use cutaway_testing::real::{FILES, SAMPLES, is_there, read};
use cutaway_testing::scenes::{framed, oblique_noise, point, soft, uniform};
use libtest_mimic::{Arguments, Failed, Trial};

/// Of real volumes at fine slices: as for the ray caster; the project allows 0.006.
const LARGEST_RMSE: f64 = 0.004;

/// A brightening or darkening of any channel.
const LARGEST_BIAS: f64 = 0.002;

/// Small scenes, smooth where the transfer function bends.
const LARGEST_RMSE_OF_SMALL: f64 = 0.002;

/// Of bricks against none: they take the same samples.
const LARGEST_SEAM: f64 = 1e-6;

/// Of 16-bit targets: what is blended is rounded to eleven bits, several hundred times.
const LARGEST_RMSE_OF_HALF: f64 = 0.01;
const LARGEST_BIAS_OF_HALF: f64 = 0.005;

const SIZE: [u32; 2] = [67, 45];

const MODES: [Mode; 4] = [Mode::Composite, Mode::Mip, Mode::Minip, Mode::Mean];

type Check = fn(&SliceRenderer) -> Result<(), Failed>;

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
    let others: [(&str, Check); 13] = [
        ("every_mode_and_view", every_mode_and_view),
        ("every_curve_and_gradient", every_curve_and_gradient),
        ("a_uniform_volume_is_exact_at_any_step", a_uniform_volume_is_exact_at_any_step),
        ("clipped_scenes", clipped_scenes),
        ("clip_surfaces_are_lit_and_overlaid", clip_surfaces_are_lit_and_overlaid),
        ("bricks_do_not_show", bricks_do_not_show),
        ("empty_bricks_are_left_out", empty_bricks_are_left_out),
        ("errors_fall_with_the_number_of_slices", errors_fall_with_the_number_of_slices),
        (
            "pre_integrated_slabs_stand_steps_of_the_function",
            pre_integrated_slabs_stand_steps_of_the_function,
        ),
        ("light_within_a_slab_takes_no_colour_away", light_within_a_slab_takes_no_colour_away),
        ("any_unit_of_length_gives_the_same_image", any_unit_of_length_gives_the_same_image),
        ("depths_are_where_opacity_is", depths_are_where_opacity_is),
        ("what_cannot_be_is_an_error_that_says_so", what_cannot_be_is_an_error_that_says_so),
    ];
    trials.extend(others.map(|(name, test)| {
        Trial::test(name, move || test(renderer(Fallbacks::default())?.as_ref())).with_ignored_flag(!there)
    }));
    trials.push(Trial::test("half_float_targets", half_float_targets).with_ignored_flag(!there));
    trials.push(Trial::test("volumes_in_an_atlas", volumes_in_an_atlas).with_ignored_flag(!there));
    libtest_mimic::run(&arguments, trials).exit();
}

fn renderer(fallbacks: Fallbacks) -> Result<Arc<SliceRenderer>, GpuError> {
    static BEST: std::sync::Mutex<Option<Arc<SliceRenderer>>> = std::sync::Mutex::new(None);
    let plain = fallbacks == Fallbacks::default();
    let mut best = BEST.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(renderer) = best.as_ref().filter(|_| plain) {
        return Ok(renderer.clone());
    }
    let gpu = Gpu::new(&GpuOptions { fallbacks, ..GpuOptions::default() })?;
    let made = Arc::new(SliceRenderer::new(&gpu)?);
    if plain {
        *best = Some(made.clone());
    }
    Ok(made)
}

fn bias(c: &Comparison) -> f64 {
    c.bias.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a })
}

/// An error with all numbers where two images are too far apart.
fn near(what: &str, expected: &Image, actual: &Image, rmse: f64) -> Result<Comparison, Failed> {
    let c = compare(expected, actual)?;
    println!("{what}: rmse {:.6}, bias {:+.6}, largest {:.4}", c.rmse, bias(&c), c.largest_difference);
    if c.exceeds(rmse) || bias(&c).abs() > LARGEST_BIAS.min(rmse) {
        return Err(format!("{what}: {c}; at most {rmse}").into());
    }
    Ok(c)
}

fn real_volume(name: &str) -> Result<(), Failed> {
    let volume = read(name)?;
    let renderer = renderer(Fallbacks::default())?;
    let prepared = renderer.prepare(&volume)?;
    let (center, radius) = middle(&volume);
    let cut = Clip::everything().cut(ball(
        center + DVec3::new(-0.2, 0.3, 0.1) * radius,
        0.5 * radius,
        3,
        EventFinder::Raster,
    ));
    let mut failures = Vec::new();
    let cases = [
        (Mode::Composite, true, false),
        (Mode::Composite, true, true),
        (Mode::Composite, false, false),
        (Mode::Composite, false, true),
        (Mode::Mip, false, false),
        (Mode::Mean, false, true),
    ];
    for (mode, shade, clipped) in cases {
        let settings = RenderSettings { mode, step: 0.25, resolution: SIZE, ..RenderSettings::default() };
        let camera = default_camera(&volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
        let lighting = Lighting { shade, ..Lighting::default() };
        let function = default_for_mode(&volume, mode);
        let mut scene =
            Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings)?;
        if clipped {
            scene.set_clip(Some(&cut))?;
        }
        let classification = renderer.classify(&prepared, &scene)?;
        let (image, _) = renderer.render(&prepared, &classification, &scene, &|_| {})?;
        let words = [if shade { ", shaded" } else { "" }, if clipped { ", cut" } else { "" }].concat();
        let what = format!("{name}, {}{words}", mode.name());
        if let Err(failed) = near(&what, &reference::render(&scene), &image, LARGEST_RMSE) {
            failures.push(failed.message().unwrap_or_default().to_owned());
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n").into()) }
}

fn every_mode_and_view(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(25, 19, 31), 7);
    for mode in MODES {
        let mut scene =
            framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
        let outside = scene.camera().clone();
        let mut parallel = outside.clone();
        parallel.orthographic = Some(30.0);
        let mut inside = outside.clone();
        inside.position = volume.center_in_world().to_array();
        inside.focal_point = (volume.center_in_world() + DVec3::new(1.0, 0.2, 0.1)).to_array();
        inside.view_angle = 70.0;
        let mut parallel_inside = inside.clone();
        parallel_inside.orthographic = Some(20.0);
        let mut along_an_axis = outside.clone();
        let forward = volume.world_from_voxel().matrix3.z_axis;
        along_an_axis.position = (volume.center_in_world() - 2.0 * 31.0 * forward).to_array();
        along_an_axis.focal_point = volume.center_in_world().to_array();
        let mut far_away = outside.clone();
        let away = DVec3::from_array(outside.position) - volume.center_in_world();
        far_away.position = (volume.center_in_world() + away * 1e5).to_array();
        far_away.view_angle = 30.0 / 1e5;
        let views = [
            ("outside", outside),
            ("orthographic", parallel),
            ("inside", inside),
            ("orthographic, inside", parallel_inside),
            ("along an axis", along_an_axis),
            ("far away", far_away),
        ];
        for (view, camera) in views {
            scene.set_camera(camera)?;
            let what = format!("{view}, {}", mode.name());
            near(&what, &reference::render(&scene), &slices(&scene, renderer).0, LARGEST_RMSE_OF_SMALL)?;
        }
    }
    Ok(())
}

fn every_curve_and_gradient(renderer: &SliceRenderer) -> Result<(), Failed> {
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
            near(&what, &reference::render(&scene), &slices(&scene, renderer).0, LARGEST_RMSE_OF_SMALL)?;
        }
    }
    // Of other gradients there is no reference: they are nearly the same on a smooth field.
    let with = |gradient| {
        let settings = RenderSettings { gradient, ..settings(Mode::Composite, &volume) };
        slices(&framed(&volume, &soft(volume.value_range()), Lighting::default(), settings), renderer).0
    };
    let central = with(Gradient::Central);
    near("Sobel", &central, &with(Gradient::Sobel), 0.05)?;
    near("precomputed", &central, &with(Gradient::Precomputed), 0.01)?;
    Ok(())
}

/// Slabs at the volume's border are as thick as what is left of them, in every pixel.
fn a_uniform_volume_is_exact_at_any_step(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = uniform(UVec3::new(9, 8, 7), 1.0, DVec3::new(1.0, 1.3, 0.7));
    for step in [0.3, 0.77, 1.9, 30.0, 1e6] {
        for (opacity, orthographic) in [(0.1, None), (0.1, Some(8.0)), (1.0, None)] {
            let settings = RenderSettings { step, ..settings(Mode::Composite, &volume) };
            let function = TransferFunction::new(vec![point(1.0, [0.2, 0.6, 1.0], opacity)])?;
            let lighting = Lighting { shade: false, ..Lighting::default() };
            let mut scene = framed(&volume, &function, lighting, settings);
            let mut camera = scene.camera().clone();
            camera.orthographic = orthographic;
            scene.set_camera(camera)?;
            let what = format!("step {step}, opacity {opacity}, orthographic {orthographic:?}");
            // Rounding of up to forty slabs.
            near(&what, &reference::render(&scene), &slices(&scene, renderer).0, 5e-6)?;
        }
    }
    Ok(())
}

fn clipped_scenes(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    for (name, clip) in clips(&volume) {
        for mode in MODES {
            let scene = scene(&volume, &clip, ClipShading::default(), settings(mode, &volume));
            let what = format!("{name}, {}", mode.name());
            near(&what, &reference::render(&scene), &slices(&scene, renderer).0, 0.004)?;
        }
    }
    // Cuts are as exact as the volume's own border.
    let volume = uniform(UVec3::new(19, 18, 17), 1.0, DVec3::new(1.0, 1.3, 0.7));
    let function = TransferFunction::new(vec![point(1.0, [0.2, 0.6, 1.0], 0.1)])?;
    for (name, clip) in clips(&volume) {
        for step in [0.3, 3.0, 50.0] {
            let settings = RenderSettings { step, ..settings(Mode::Composite, &volume) };
            let lighting = Lighting { shade: false, ..Lighting::default() };
            let shading = ClipShading { impregnation: Impregnation::None, ..ClipShading::default() };
            let scene = framed(&volume, &function, lighting, settings).with_clip(&clip, shading)?;
            let what = format!("{name}, uniform, step {step}");
            near(&what, &reference::render(&scene), &slices(&scene, renderer).0, 2e-4)?;
        }
    }
    Ok(())
}

fn clip_surfaces_are_lit_and_overlaid(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(31, 25, 27), 3);
    for (name, clip) in clips(&volume).into_iter().filter(|(name, _)| name.starts_with("cut by")) {
        for (impregnation, overlay) in
            [(Impregnation::Step, 0.0), (Impregnation::Linear, 0.0), (Impregnation::None, 0.3)]
        {
            let shading = ClipShading { impregnation, thickness: 4.0, overlay, ..ClipShading::default() };
            for mode in [Mode::Composite, Mode::Mean] {
                let scene = scene(&volume, &clip, shading.clone(), settings(mode, &volume));
                let what = format!("{name}, {impregnation:?}, overlay {overlay}, {}", mode.name());
                near(&what, &reference::render(&scene), &slices(&scene, renderer).0, 0.004)?;
            }
        }
    }
    Ok(())
}

/// Bricks take the samples that the volume as one brick takes, cut or not, at steps up to several bricks.
fn bricks_do_not_show(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(45, 41, 39), 9);
    let everything = Clip::everything();
    let (_, cut) = clips(&volume).swap_remove(4);
    let views: [(u32, Mode, f64, &Clip); 8] = [
        (0, Mode::Composite, 0.5, &everything),
        (1, Mode::Composite, 0.5, &cut),
        (2, Mode::Composite, 3.0, &everything),
        (3, Mode::Composite, 20.0, &cut),
        (4, Mode::Composite, 40.0, &everything),
        (5, Mode::Mip, 0.5, &everything),
        (1, Mode::Mean, 0.5, &cut),
        (2, Mode::Mean, 0.7, &everything),
    ];
    for (view, mode, step, clip) in views {
        for pre_integration in [false, true] {
            let image = |brick_size| -> Result<Image, Failed> {
                let settings = RenderSettings {
                    brick_size,
                    step,
                    pre_integration: pre_integration && mode == Mode::Composite,
                    ..settings(mode, &volume)
                };
                let mut scene = scene(&volume, clip, ClipShading::default(), settings.clone());
                if std::ptr::eq(clip, &everything) {
                    scene = framed(&volume, &soft(volume.value_range()), Lighting::default(), settings);
                }
                let mut camera = scene.camera().clone();
                camera.azimuth(f64::from(view) * 2.4);
                camera.elevation((f64::from(view) * 1.7).sin() * 1.5);
                camera.zoom([1.0, 3.0, 0.4][view as usize % 3]);
                camera.orthographic = (view % 4 == 3).then_some(40.0);
                if view == 4 {
                    camera.position = (volume.center_in_world() + DVec3::new(7.0, 3.0, 5.0)).to_array();
                }
                scene.set_camera(camera)?;
                Ok(slices(&scene, renderer).0)
            };
            let whole = image(0)?;
            for brick_size in [8, 16, 32, 64] {
                let what = format!("view {view}, {}, step {step}, bricks of {brick_size}", mode.name());
                near(&what, &whole, &image(brick_size)?, LARGEST_SEAM)?;
            }
        }
    }
    Ok(())
}

fn empty_bricks_are_left_out(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = read("bonsai")?;
    let [lo, hi] = volume.value_range();
    let function = TransferFunction::new(vec![
        point(lo + 0.3 * (hi - lo), [1.0, 0.5, 0.2], 0.0),
        point(hi, [1.0, 1.0, 1.0], 0.6),
    ])?;
    let mut all = Vec::new();
    for pre_integration in [false, true] {
        for (brick_size, space_skipping) in [
            (0, SpaceSkipping::Auto),
            (8, SpaceSkipping::Auto),
            (16, SpaceSkipping::Auto),
            (32, SpaceSkipping::Auto),
            (16, SpaceSkipping::Off),
        ] {
            let settings = RenderSettings {
                brick_size,
                space_skipping,
                pre_integration,
                step: 1.0,
                resolution: SIZE,
                ..RenderSettings::default()
            };
            let scene = framed(&volume, &function, Lighting::default(), settings);
            let (image, statistics) = slices(&scene, renderer);
            println!("bricks of {brick_size}: {statistics:?}");
            all.push((brick_size, space_skipping, image, statistics));
        }
    }
    for images in all.chunks(5) {
        for (brick_size, skipping, image, statistics) in images {
            near(&format!("bricks of {brick_size}"), &images[0].2, image, LARGEST_SEAM)?;
            let skips = *brick_size > 0 && *skipping == SpaceSkipping::Auto;
            if skips != (statistics.skipped_fraction > 0.3) {
                return Err(format!("bricks of {brick_size}, {skipping:?}: {statistics:?}").into());
            }
        }
    }
    Ok(())
}

/// Second order: half the distance, a quarter of the error, until other errors are larger.
fn errors_fall_with_the_number_of_slices(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 4);
    let mut before = f64::INFINITY;
    for step in [2.0, 1.0, 0.5, 0.25] {
        let settings = RenderSettings { step, ..settings(Mode::Composite, &volume) };
        let scene = framed(&volume, &soft(volume.value_range()), Lighting::default(), settings);
        let c = near(&format!("step {step}"), &reference::render(&scene), &slices(&scene, renderer).0, 0.1)?;
        if c.rmse > 0.5 * before {
            return Err(format!("step {step}: {c}, twice that step: {before}").into());
        }
        before = c.rmse;
    }
    Ok(())
}

/// A narrow peak of opacity, which slices jump over unless they stand for what lies between.
fn pre_integrated_slabs_stand_steps_of_the_function(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 4);
    let [lo, hi] = volume.value_range();
    let at = |share: f64| lo + share * (hi - lo);
    let function = TransferFunction::new(vec![
        point(at(0.55), [1.0, 0.4, 0.1], 0.0),
        point(at(0.56), [1.0, 0.4, 0.1], 0.9),
        point(at(0.57), [0.1, 0.4, 1.0], 0.9),
        point(at(0.58), [0.1, 0.4, 1.0], 0.0),
    ])?;
    let error = |pre_integration| -> Result<f64, Failed> {
        let settings = RenderSettings { step: 0.5, pre_integration, ..settings(Mode::Composite, &volume) };
        let scene = framed(&volume, &function, Lighting::default(), settings);
        Ok(compare(&reference::render(&scene), &slices(&scene, renderer).0)?.rmse)
    };
    let (by_middle, integrated) = (error(false)?, error(true)?);
    println!("by the middle {by_middle:.5}, pre-integrated {integrated:.5}");
    if integrated > 0.01 || integrated > 0.2 * by_middle {
        return Err(format!("pre-integrated: {integrated}, by the value in the middle: {by_middle}").into());
    }
    Ok(())
}

/// Light that changes within a slab is extrapolated to its ends, where it may be none, but never less.
fn light_within_a_slab_takes_no_colour_away(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(15, 13, 11), 9);
    let [lo, hi] = volume.value_range();
    let function = TransferFunction::new(vec![point(lo, [1.0; 3], 0.8), point(hi, [1.0; 3], 0.9)])?;
    let lighting = Lighting {
        ambient: 0.0,
        diffuse: 1.0,
        specular: 0.0,
        diffuse_curve: DiffuseCurve::Clamped,
        light: Some([1.0, -0.5, 2.0]),
        ..Lighting::default()
    };
    // One slab, or two: nothing lies over what is taken away.
    let settings = RenderSettings { step: 12.0, pre_integration: true, ..settings(Mode::Composite, &volume) };
    let image = slices(&framed(&volume, &function, lighting, settings), renderer).0;
    let colors = || image.pixels().iter().flat_map(|pixel| pixel[..3].iter().copied());
    let (least, most) = (colors().fold(f32::MAX, f32::min), colors().fold(f32::MIN, f32::max));
    println!("colours from {least} to {most}");
    if least < 0.0 || most < 0.3 {
        return Err(format!("colours from {least} to {most}").into());
    }
    Ok(())
}

/// A micrometre or a kilometre instead of a millimetre.
fn any_unit_of_length_gives_the_same_image(renderer: &SliceRenderer) -> Result<(), Failed> {
    let images = |scale: f64| -> Result<Vec<Image>, Failed> {
        let bytes: Vec<u8> =
            (0..23u32 * 2 * 18).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let geometry = cutaway_core::volume::Geometry::from_spacing(DVec3::new(1.0, 3.0, 0.5) * scale);
        let rescale = cutaway_core::volume::Rescale::IDENTITY;
        let volume = Volume::new(UVec3::new(23, 2, 18), bytes, rescale, geometry)?;
        let render = |mode| {
            let scene =
                framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
            slices(&scene, renderer).0
        };
        Ok(MODES.map(render).to_vec())
    };
    let expected = images(1.0)?;
    for scale in [1e-6, 1e-3, 1e3, 1e6, 1e9] {
        for ((mode, expected), image) in MODES.iter().zip(&expected).zip(images(scale)?) {
            near(&format!("{}, {scale} times as large", mode.name()), expected, &image, 1e-3)?;
        }
    }
    Ok(())
}

/// The mean distance of what is seen, where that is at least half opaque: of a wall, where it is.
fn depths_are_where_opacity_is(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = uniform(UVec3::splat(33), 1.0, DVec3::ONE);
    let function = TransferFunction::new(vec![point(1.0, [1.0; 3], 0.999)])?;
    let scene = framed(&volume, &function, Lighting::default(), settings(Mode::Composite, &volume));
    let (image, reference) = (slices(&scene, renderer).0, reference::render(&scene));
    let pairs = image.depth().zip(reference.depth()).ok_or("no depths")?;
    for (i, (found, expected)) in pairs.0.iter().zip(pairs.1).enumerate() {
        // Of pixels at the border, half are seen in the last sliver of the volume.
        let border = reference.pixels()[i][3] < 0.99;
        let apart = f64::from((found - expected).abs());
        if found.is_finite() != expected.is_finite() && !border || apart.is_finite() && apart > 0.5 {
            return Err(format!("pixel {i}: {found}, expected {expected}").into());
        }
    }
    let mip = framed(&volume, &function, Lighting::default(), settings(Mode::Mip, &volume));
    if slices(&mip, renderer).0.depth().is_some() {
        return Err("a maximum has a depth".into());
    }
    Ok(())
}

fn what_cannot_be_is_an_error_that_says_so(renderer: &SliceRenderer) -> Result<(), Failed> {
    let volume = uniform(UVec3::splat(9), 1.0, DVec3::ONE);
    let prepared = renderer.prepare(&volume)?;
    let iso = RenderSettings { iso: vec![0.5], ..settings(Mode::Iso, &volume) };
    let iso = framed(&volume, &soft([0.0, 2.0]), Lighting::default(), iso);
    let error = renderer.classify(&prepared, &iso).err().ok_or("isosurfaces are not refused")?;
    if !error.to_string().contains("--engine raycast") {
        return Err(error.into());
    }
    let volume = uniform(UVec3::splat(9), 1.0, DVec3::new(1.0, 1.0, 1000.0));
    let prepared = renderer.prepare(&volume)?;
    let settings = RenderSettings { step: 0.001, ..settings(Mode::Composite, &volume) };
    let fine = framed(&volume, &soft([0.0, 2.0]), Lighting::default(), settings);
    let classification = renderer.classify(&prepared, &fine)?;
    let error = renderer.render(&prepared, &classification, &fine, &|_| {}).err();
    let text = error.ok_or("too many slices are not refused")?.to_string();
    if !text.contains("--step") {
        return Err(text.into());
    }
    Ok(())
}

fn half_float_targets() -> Result<(), Failed> {
    let renderer = renderer(Fallbacks { without_float_blending: true, ..Fallbacks::default() })?;
    let noise = oblique_noise(UVec3::new(37, 25, 19), 11);
    let head = read("mr-head")?;
    for (name, volume, mode) in
        [&noise, &head].iter().zip(["noise", "head"]).flat_map(|(v, name)| MODES.map(|m| (name, *v, m)))
    {
        let function =
            if name == "noise" { soft(volume.value_range()) } else { default_for_mode(volume, mode) };
        let settings = RenderSettings { step: 0.5, resolution: SIZE, ..settings(mode, volume) };
        let scene = framed(volume, &function, Lighting { shade: false, ..Lighting::default() }, settings);
        let what = format!("half floats, {name}, {}", mode.name());
        let c = compare(&reference::render(&scene), &slices(&scene, &renderer).0)?;
        println!("{what}: rmse {:.6}, bias {:+.6}, largest {:.4}", c.rmse, bias(&c), c.largest_difference);
        if c.exceeds(LARGEST_RMSE_OF_HALF) || bias(&c).abs() > LARGEST_BIAS_OF_HALF {
            return Err(format!("{what}: {c}").into());
        }
    }
    Ok(())
}

/// Volumes that do not fit in a texture: where texels lie has nothing to do with what is drawn.
fn volumes_in_an_atlas() -> Result<(), Failed> {
    let fallbacks = Fallbacks { max_texture_3d: Some(40), ..Fallbacks::default() };
    let (small, large) = (renderer(fallbacks)?, renderer(Fallbacks::default())?);
    let volume = oblique_noise(UVec3::new(50, 20, 12), 2);
    for mode in MODES {
        let scene =
            framed(&volume, &soft(volume.value_range()), Lighting::default(), settings(mode, &volume));
        let prepared = small.prepare(&volume)?;
        if prepared.voxels().brick_edge().is_none() {
            return Err("the volume fits in a texture".into());
        }
        let what = format!("in an atlas, {}", mode.name());
        near(&what, &slices(&scene, &large).0, &slices(&scene, &small).0, 1e-4)?;
    }
    Ok(())
}
