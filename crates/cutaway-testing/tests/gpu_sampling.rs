//! How the GPU ray caster samples: each setting against the reference, and against the CPU engine with the same setting;
//! and what happens to an image after that. Without an adapter the tests show as ignored.

use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::image::compare::{Comparison, compare};
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::reference;
use cutaway_core::scene::{
    Gradient, ImageInterpolation, Layer, Mode, RenderSettings, Sampling, Scene, SpaceSkipping,
};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_cpu::SimdChoice;
use cutaway_gpu::{Gpu, GpuOptions, RaycastRenderer};
use cutaway_testing::engines;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point, soft};
use libtest_mimic::{Arguments, Failed, Trial};

/// Of a stepping engine against the integral, and of two stepping engines against each other.
const LARGEST_RMSE: f64 = 0.004;

/// The largest mean difference of any channel.
const LARGEST_BIAS: f64 = 0.001;

/// Two images that differ by rounding, or by a sample that rounding moved to the next entry of a table.
const SAME: f64 = 5e-5;

type Test = fn(&RaycastRenderer) -> Result<(), Failed>;

const TESTS: [(&str, Test); 10] = [
    ("settings_are_near_the_reference_and_the_cpu", settings_are_near_the_reference_and_the_cpu),
    ("gradients_are_those_of_the_cpu", gradients_are_those_of_the_cpu),
    ("planes_are_those_of_the_cpu", planes_are_those_of_the_cpu),
    ("every_light_is_that_of_the_reference", every_light_is_that_of_the_reference),
    ("a_preintegrated_voxel_is_as_good_as_quarters", a_preintegrated_voxel_is_as_good_as_quarters),
    ("skipping_hides_nothing", skipping_hides_nothing),
    ("jitter_turns_rings_into_noise", jitter_turns_rings_into_noise),
    ("jitter_leaves_faces_alone", jitter_leaves_faces_alone),
    ("every_so_many_pixels_as_the_cpu", every_so_many_pixels_as_the_cpu),
    ("blur_is_that_of_the_host", blur_is_that_of_the_host),
];

fn main() {
    let arguments = Arguments::from_args();
    let renderer = Gpu::new(&GpuOptions::default()).and_then(|gpu| RaycastRenderer::new(&gpu)).map(Arc::new);
    if let Err(reason) = &renderer {
        eprintln!("ignored: {reason}");
    }
    let trials = TESTS.map(|(name, test)| match renderer.clone() {
        Ok(renderer) => Trial::test(name, move || test(&renderer)),
        Err(_) => Trial::test(name, || Ok(())).with_ignored_flag(true),
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

/// Values fall as stored numbers rise, and no two axes are alike.
fn noise() -> Volume {
    oblique_noise(UVec3::new(37, 25, 19), 11)
}

/// Bytes that rise along y, by seven a voxel.
fn ramp() -> Volume {
    let dimensions = UVec3::splat(32);
    let voxels: Vec<u8> = (0..32u32 * 32 * 32).map(|i| (i / 32 % 32 * 7) as u8).collect();
    Volume::new(dimensions, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
        .expect("a valid volume")
}

fn at_step(step: f64) -> RenderSettings {
    RenderSettings { step, resolution: SMALL, ..RenderSettings::default() }
}

fn scene(volume: &Volume, shade: bool, settings: RenderSettings) -> Scene {
    framed(volume, &soft(volume.value_range()), Lighting { shade, ..Lighting::default() }, settings)
}

fn gpu(renderer: &RaycastRenderer, scene: &Scene) -> Image {
    engines::raycast(scene, renderer).0
}

fn cpu(scene: &Scene) -> Image {
    engines::cpu(scene, SimdChoice::Auto, 0).0
}

fn largest_bias(c: &Comparison) -> f64 {
    c.bias.iter().fold(0.0, |most, b| most.max(b.abs()))
}

fn near(what: &str, expected: &Image, actual: &Image, rmse: f64, bias: f64) -> Result<(), Failed> {
    let c = compare(expected, actual)?;
    let numbers = format!(
        "{what}: rmse {:.5} of {rmse}, bias {:.5} of {bias}, largest {:.3}",
        c.rmse,
        largest_bias(&c),
        c.largest_difference
    );
    println!("{numbers}");
    let visible = expected.pixels().iter().any(|p| p[3] > 0.05);
    let ok = c.rmse <= rmse && largest_bias(&c) <= bias && c.non_finite_pixels == 0 && visible;
    if ok { Ok(()) } else { Err(numbers.into()) }
}

fn settings_are_near_the_reference_and_the_cpu(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = noise();
    for shade in [true, false] {
        for step in [0.25, 0.5] {
            let plain = at_step(step);
            let all = [
                ("pre-integration", RenderSettings { pre_integration: true, ..plain.clone() }),
                ("adaptive", RenderSettings { adaptive_threshold: Some(0.02), ..plain.clone() }),
                ("jitter", RenderSettings { jitter: true, ..plain.clone() }),
                (
                    "jittered pre-integration",
                    RenderSettings { jitter: true, pre_integration: true, ..plain.clone() },
                ),
            ];
            for (name, settings) in all {
                let scene = scene(&volume, shade, settings);
                let image = gpu(renderer, &scene);
                let what = format!("{name}, shaded {shade}, step {step}");
                let expected = reference::render(&scene);
                near(&format!("{what}, reference"), &expected, &image, LARGEST_RMSE, LARGEST_BIAS)?;
                near(&format!("{what}, cpu"), &cpu(&scene), &image, LARGEST_RMSE, LARGEST_BIAS)?;
            }
        }
    }
    Ok(())
}

fn gradients_are_those_of_the_cpu(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = noise();
    let of = |gradient, pre_integration| {
        scene(&volume, true, RenderSettings { gradient, pre_integration, ..at_step(0.5) })
    };
    for pre_integration in [false, true] {
        // Eight bits a component against ten: a two-hundredth of the light at worst.
        for (gradient, rmse) in [(Gradient::Sobel, 5e-4), (Gradient::Precomputed, 2e-3)] {
            let scene = of(gradient, pre_integration);
            let image = gpu(renderer, &scene);
            near(&format!("{gradient:?}"), &cpu(&scene), &image, rmse, LARGEST_BIAS)?;
            // And it is another gradient.
            let central = gpu(renderer, &of(Gradient::Central, pre_integration));
            let apart = compare(&central, &image)?.rmse;
            if apart < 2.0 * rmse {
                return Err(format!("{gradient:?} is only {apart:.5} from central differences").into());
            }
        }
    }
    Ok(())
}

fn planes_are_those_of_the_cpu(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = noise();
    for (shade, adaptive_threshold) in [(true, None), (false, None), (true, Some(0.02))] {
        let settings = RenderSettings { sampling: Sampling::Object, adaptive_threshold, ..at_step(0.5) };
        let scene = scene(&volume, shade, settings);
        let what = format!("planes, shaded {shade}, adaptive {adaptive_threshold:?}");
        near(&what, &cpu(&scene), &gpu(renderer, &scene), LARGEST_RMSE, LARGEST_BIAS)?;
    }
    Ok(())
}

fn every_light_is_that_of_the_reference(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let falling = noise();
    let rising = ramp();
    for curve in [DiffuseCurve::Clamped, DiffuseCurve::TwoSided, DiffuseCurve::Wrapped] {
        for light in [None, Some([0.3, -2.0, 1.0])] {
            for (volume, mode) in
                [(&falling, Mode::Composite), (&rising, Mode::Composite), (&falling, Mode::Iso)]
            {
                let lighting = Lighting {
                    diffuse_curve: curve,
                    wrap_power: 2.5,
                    specular: 0.4,
                    specular_power: 7.5,
                    light,
                    ..Lighting::default()
                };
                let [lo, hi] = volume.value_range();
                let iso = if mode == Mode::Iso { vec![0.5 * (lo + hi)] } else { Vec::new() };
                let settings = RenderSettings { mode, iso, ..at_step(0.25) };
                let scene = framed(volume, &soft([lo, hi]), lighting, settings);
                let what = format!("{curve:?}, light {light:?}, {}", mode.name());
                let expected = reference::render(&scene);
                near(&what, &expected, &gpu(renderer, &scene), LARGEST_RMSE, LARGEST_BIAS)?;
            }
        }
    }
    Ok(())
}

/// Two thin walls: between the values of neighbouring samples the function is somewhere else.
fn walls([lo, hi]: [f64; 2]) -> TransferFunction {
    let at = |share: f64| lo + share * (hi - lo);
    TransferFunction::new(vec![
        point(at(0.3), [0.9, 0.2, 0.1], 0.0),
        point(at(0.33), [0.9, 0.2, 0.1], 0.5),
        point(at(0.36), [0.9, 0.2, 0.1], 0.0),
        point(at(0.6), [0.2, 0.6, 0.9], 0.0),
        point(at(0.62), [0.2, 0.6, 0.9], 0.8),
        point(at(0.64), [0.2, 0.6, 0.9], 0.0),
    ])
    .expect("ordered points")
}

fn a_preintegrated_voxel_is_as_good_as_quarters(renderer: &RaycastRenderer) -> Result<(), Failed> {
    // A field that bends within a voxel under a function that does not, and the other way round. What bends is not linear
    // along a step, as the table takes it to be: there a voxel is nearer than without, though not as near as quarters.
    let (bent, straight) = (noise(), ramp());
    let cases = [(&bent, soft(bent.value_range())), (&straight, walls(straight.value_range()))];
    for ((volume, function), shade) in cases.iter().flat_map(|case| [(case, false), (case, true)]) {
        let of = |step, pre_integration| {
            let settings = RenderSettings { pre_integration, early_termination: 1.0, ..at_step(step) };
            framed(volume, function, Lighting { shade, ..Lighting::default() }, settings)
        };
        let expected = reference::render(&of(0.25, false));
        let error = |scene: &Scene| compare(&expected, &gpu(renderer, scene)).map(|c| c.rmse);
        let (quarters, voxel, plain_voxel) =
            (error(&of(0.25, false))?, error(&of(1.0, true))?, error(&of(1.0, false))?);
        let numbers = format!(
            "shaded {shade}: pre-integrated 1 {voxel:.5}, plain 0.25 {quarters:.5}, plain 1 {plain_voxel:.5}"
        );
        println!("{numbers}");
        let bends = std::ptr::eq(*volume, &bent);
        let near = if bends { 2.0 * voxel <= plain_voxel } else { voxel <= quarters };
        if !near {
            return Err(numbers.into());
        }
    }
    Ok(())
}

fn skipping_hides_nothing(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let (noise, ramp) = (oblique_noise(UVec3::new(45, 38, 29), 3), ramp());
    for settings in [
        RenderSettings { pre_integration: true, ..at_step(2.0) },
        RenderSettings { pre_integration: true, jitter: true, ..at_step(0.7) },
        RenderSettings { adaptive_threshold: Some(0.01), ..at_step(1.3) },
        RenderSettings { sampling: Sampling::Object, ..at_step(1.0) },
        RenderSettings { jitter: true, ..at_step(3.0) },
    ] {
        let of = |volume: &Volume, space_skipping| {
            let settings = RenderSettings { space_skipping, ..settings.clone() };
            let scene = framed(volume, &walls(volume.value_range()), Lighting::default(), settings);
            engines::raycast(&scene, renderer)
        };
        let both = |volume: &Volume| (of(volume, SpaceSkipping::Auto), of(volume, SpaceSkipping::Off));
        let (with, without) = both(&noise);
        near("skipping in noise", &without.0, &with.0, SAME, SAME)?;
        let (with, without) = both(&ramp);
        near("skipping on a ramp", &without.0, &with.0, SAME, SAME)?;
        if with.1.samples >= without.1.samples {
            return Err("nothing was skipped".into());
        }
    }
    Ok(())
}

/// A ramp that turns visible half-way, seen askew, in steps that are far too long.
fn rings(volume: &Volume, settings: RenderSettings) -> Scene {
    let function = TransferFunction::new(vec![
        point(100.0, [1.0, 0.8, 0.6], 0.0),
        point(104.0, [1.0, 0.8, 0.6], 0.06),
        point(255.0, [1.0, 0.8, 0.6], 0.06),
    ])
    .expect("ordered points");
    let forward = DVec3::new(0.6, 0.8, 0.0);
    let camera = Camera::framing(&volume.corners_in_world(), forward, DVec3::Z, 1.0, 1.05);
    let lighting = Lighting { shade: false, ..Lighting::default() };
    Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings)
        .expect("a valid scene")
}

fn jitter_turns_rings_into_noise(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = ramp();
    let settings = |jitter, blur| RenderSettings {
        jitter,
        blur,
        step: 3.0,
        resolution: [128, 128],
        ..RenderSettings::default()
    };
    // A blur takes the noise, which has no low frequencies, and leaves the rings, which are wide.
    let expected = |blur| reference::render(&rings(&volume, settings(false, blur)));
    let error =
        |jitter, blur| compare(&expected(blur), &gpu(renderer, &rings(&volume, settings(jitter, blur))));
    let (plain, plain_blurred) = (error(false, 0.0)?, error(false, 2.0)?);
    let (jittered, jittered_blurred) = (error(true, 0.0)?, error(true, 2.0)?);
    let numbers = format!(
        "plain {:.5}, blurred {:.5}; jittered {:.5}, blurred {:.5}; bias {:.5} and {:.5}",
        plain.rmse,
        plain_blurred.rmse,
        jittered.rmse,
        jittered_blurred.rmse,
        largest_bias(&plain),
        largest_bias(&jittered)
    );
    println!("{numbers}");
    let rings_stay = plain_blurred.rmse > 0.5 * plain.rmse;
    let noise_goes = jittered_blurred.rmse < 0.35 * jittered.rmse;
    let better = jittered_blurred.rmse < 0.5 * plain_blurred.rmse;
    let no_louder = jittered.rmse < 1.6 * plain.rmse;
    let fair = largest_bias(&jittered) < LARGEST_BIAS;
    if rings_stay && noise_goes && better && no_louder && fair { Ok(()) } else { Err(numbers.into()) }
}

fn jitter_leaves_faces_alone(renderer: &RaycastRenderer) -> Result<(), Failed> {
    // So dense that the first step is all that is seen.
    let volume = noise();
    let [lo, hi] = volume.value_range();
    let function =
        TransferFunction::new(vec![point(lo, [0.1, 0.3, 0.9], 0.9999), point(hi, [0.9, 0.8, 0.1], 0.9999)])
            .expect("ordered points");
    let image = |jitter| {
        let settings = RenderSettings { jitter, ..at_step(0.5) };
        let camera = Camera::framing(
            &volume.corners_in_world(),
            DVec3::new(0.4, 0.8, -0.3),
            DVec3::Z,
            f64::from(SMALL[0]) / f64::from(SMALL[1]),
            1.05,
        );
        let scene = Scene::new(
            Layer::new(volume.clone(), &function).with_unit_distance(Some(0.03)),
            camera,
            settings,
        );
        gpu(renderer, &scene.expect("a valid scene"))
    };
    let (with, without) = (image(true), image(false));
    // Where a ray grazes an edge its only step may be thin.
    near("faces", &without, &with, 1e-3, 1e-4)?;
    let same = with
        .pixels()
        .iter()
        .zip(without.pixels())
        .filter(|(a, b)| a.iter().zip(*b).all(|(a, b)| (a - b).abs() < 1e-3));
    let share = same.count() as f64 / with.pixels().len() as f64;
    if share > 0.98 { Ok(()) } else { Err(format!("only {share:.3} of the pixels stay").into()) }
}

fn every_so_many_pixels_as_the_cpu(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = noise();
    for (factor, mode) in
        [(2, Mode::Composite), (3, Mode::Mip), (5, Mode::Iso), (7, Mode::Mean), (16, Mode::Composite)]
    {
        let how = ImageInterpolation::Factor(factor);
        let [lo, hi] = volume.value_range();
        let iso = if mode == Mode::Iso { vec![0.5 * (lo + hi)] } else { Vec::new() };
        let settings = RenderSettings { mode, iso, image_interpolation: how, ..at_step(0.25) };
        let scene = scene(&volume, true, settings);
        let (expected, image) = (cpu(&scene), gpu(renderer, &scene));
        near(&format!("factor {factor}"), &expected, &image, 0.002, LARGEST_BIAS)?;
        let depths = expected.depth().into_iter().flatten().zip(image.depth().into_iter().flatten());
        let off = depths.filter(|(a, b)| a.is_finite() != b.is_finite() || (*a - *b).abs() > 0.5).count();
        if off * 50 > expected.pixels().len() {
            return Err(format!("factor {factor}: {off} depths differ").into());
        }
        // Cast pixels are those of the whole image.
        let whole =
            RenderSettings { image_interpolation: ImageInterpolation::Off, ..scene.settings().clone() };
        let whole = gpu(renderer, &self::scene(&volume, true, whole));
        for (x, y) in [(0, 0), (factor, factor), (factor * 2, factor)] {
            if x < SMALL[0] && y < SMALL[1] {
                let (a, b) = (whole.pixel(x, y).unwrap_or_default(), image.pixel(x, y).unwrap_or_default());
                if a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-3) {
                    return Err(format!("factor {factor}: pixel {x}, {y} is {b:?}, not {a:?}").into());
                }
            }
        }
    }
    Ok(())
}

fn blur_is_that_of_the_host(renderer: &RaycastRenderer) -> Result<(), Failed> {
    let volume = noise();
    for (sigma, how) in [
        (0.4, ImageInterpolation::Off),
        (1.7, ImageInterpolation::Off),
        (30.0, ImageInterpolation::Off),
        (2.0, ImageInterpolation::Factor(3)),
    ] {
        let of = |blur| {
            let settings = RenderSettings { blur, image_interpolation: how, ..at_step(0.5) };
            scene(&volume, true, settings)
        };
        let sharp = gpu(renderer, &of(0.0));
        let blurred = gpu(renderer, &of(sigma));
        let expected = sharp.clone().blurred(sigma);
        near(&format!("sigma {sigma}"), &expected, &blurred, 1e-6, 1e-6)?;
        if blurred.depth() != sharp.depth() {
            return Err("depths are blurred".into());
        }
        if compare(&sharp, &blurred)?.rmse < 1e-3 {
            return Err(format!("sigma {sigma} blurs nothing").into());
        }
    }
    Ok(())
}
