//! Clipped scenes: the CPU engine against the reference, the identities of set algebra, and what a cut must not depend on.

use std::num::NonZeroU32;

use cutaway_core::clip::{AxisBox, Clip, ClipShading, Impregnation, Node, Plane, SegmentCount, Sphere};
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{ImageInterpolation, Mode, RenderSettings, Scene, SpaceSkipping};
use cutaway_core::volume::Volume;
use cutaway_cpu::{CpuRenderer, SimdChoice};
use cutaway_mesh::EventFinder;
use cutaway_testing::clips::{ball, clips, middle, object, scene, settings};
use cutaway_testing::engines::cpu;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, uniform};
use cutaway_testing::tolerances::{EXACT, SAME_KERNEL, STEPPED, Tolerance, assert_close};

fn image(scene: &Scene) -> Image {
    cpu(scene, SimdChoice::Auto, 0).0
}

/// As [`STEPPED`]; a piece of a ray that begins within a voxel takes its first, shorter-than-usual-lit samples where noise
/// is lit most unevenly.
const CLIPPED: Tolerance = Tolerance { outliers: 0.03, ..STEPPED };

#[test]
fn every_mode_agrees_with_the_reference() {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    for (name, clip) in clips(&volume) {
        for mode in Mode::ALL {
            let shading = ClipShading { overlay: 0.2, cap: true, ..ClipShading::default() };
            let scene = scene(&volume, &clip, shading, settings(mode, &volume));
            let tolerance = if mode == Mode::Iso { EXACT } else { CLIPPED };
            assert_close(
                &format!("{name}, {}", mode.name()),
                &reference::render(&scene),
                &image(&scene),
                tolerance,
            );
        }
    }
}

#[test]
fn every_impregnation_agrees_with_the_reference() {
    let volume = oblique_noise(UVec3::new(31, 25, 27), 3);
    let (_, clip) = clips(&volume).swap_remove(0);
    for impregnation in [Impregnation::None, Impregnation::Step, Impregnation::Linear] {
        for thickness in [0.0, 2.0, 6.0] {
            let shading = ClipShading { impregnation, thickness, ..ClipShading::default() };
            let scene = scene(&volume, &clip, shading, settings(Mode::Composite, &volume));
            let what = format!("{impregnation:?}, {thickness} voxels");
            // The layer ends within a step.
            let tolerance = Tolerance { rmse: 0.004, outliers: 0.08, ..CLIPPED };
            assert_close(&what, &reference::render(&scene), &image(&scene), tolerance);
        }
    }
}

#[test]
fn instruction_sets_threads_skipping_and_finders_change_nothing() {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 5);
    for (name, clip) in clips(&volume) {
        for mode in [Mode::Composite, Mode::Mip, Mode::Mean] {
            let scene_of = |settings| scene(&volume, &clip, ClipShading::default(), settings);
            let plain = scene_of(settings(mode, &volume));
            let (expected, counts) = cpu(&plain, SimdChoice::Auto, 1);
            assert_eq!(expected, cpu(&plain, SimdChoice::Auto, 3).0, "{name}: threads");
            let unskipped = RenderSettings { space_skipping: SpaceSkipping::Off, ..settings(mode, &volume) };
            let (all, all_counts) = cpu(&scene_of(unskipped), SimdChoice::Auto, 0);
            assert_eq!(expected, all, "{name}, {}: skipping", mode.name());
            assert!(counts.samples <= all_counts.samples);
            for choice in [SimdChoice::Scalar, SimdChoice::Avx2] {
                if CpuRenderer::new(1, choice).is_ok() {
                    assert_close(name, &expected, &cpu(&plain, choice, 0).0, SAME_KERNEL);
                }
            }
        }
    }
    let (center, r) = middle(&volume);
    let of = |finder| {
        let clip = Clip::everything().cut(ball(center, 0.5 * r, 3, finder));
        image(&scene(&volume, &clip, ClipShading::default(), settings(Mode::Composite, &volume)))
    };
    let expected = of(EventFinder::Raster);
    for finder in EventFinder::ALL {
        assert_eq!(expected, of(finder), "{}", finder.name());
    }
}

/// A minus A is empty, A or A is A, and the laws of De Morgan, pixel by pixel.
#[test]
fn identities_of_sets_hold_pixel_by_pixel() {
    let volume = oblique_noise(UVec3::new(29, 31, 23), 8);
    let (center, r) = middle(&volume);
    let a = ball(center, 0.5 * r, 3, EventFinder::Raster);
    let b = object(2, AxisBox::new(center - 0.3 * r, center + DVec3::new(0.5, 0.2, 0.3) * r).unwrap());
    let render = |clip: Clip| {
        image(&scene(&volume, &clip, ClipShading::default(), settings(Mode::Composite, &volume)))
    };
    let not = |clip: &Clip| -> Clip { Node::Complement(Box::new(clip.clone())).into() };
    let union = |a: &Clip, b: &Clip| -> Clip { Node::Union(vec![a.clone(), b.clone()]).into() };
    let both = |a: &Clip, b: &Clip| -> Clip { Node::Intersection(vec![a.clone(), b.clone()]).into() };
    let minus = |a: &Clip, b: &Clip| -> Clip { Node::Difference(vec![a.clone(), b.clone()]).into() };
    let empty = render(minus(&a, &a));
    assert!(empty.pixels().iter().all(|p| *p == [0.0; 4]));
    assert_eq!(render(union(&a, &a)), render(a.clone()));
    assert_eq!(render(not(&union(&a, &b))), render(both(&not(&a), &not(&b))));
    assert_eq!(render(not(&both(&a, &b))), render(union(&not(&a), &not(&b))));
    assert_eq!(render(minus(&a, &b)), render(both(&a, &not(&b))));
}

/// Where the cut lies is not a matter of where samples would have been.
#[test]
fn the_cut_does_not_depend_on_the_step() {
    let volume = uniform(UVec3::splat(40), 1.0, DVec3::ONE);
    let (center, r) = middle(&volume);
    let clip = Clip::everything().cut(object(1, Sphere::new(center, 0.45 * r).unwrap()));
    let at = |step: f64| {
        let settings = RenderSettings { step, ..settings(Mode::Composite, &volume) };
        image(&scene(&volume, &clip, ClipShading::default(), settings))
    };
    let fine = at(0.05);
    for step in [0.3, 0.7, 1.0, 2.5] {
        // The bound of the project; what is left is early termination, at most 0.001.
        assert_close(
            &format!("step {step}"),
            &fine,
            &at(step),
            Tolerance { rmse: 0.002, bias: 0.002, outliers: 0.0 },
        );
    }
}

/// Tessellated spheres come nearer to the sphere with the square of the edges' length.
#[test]
fn meshes_of_a_sphere_converge_to_it_at_second_order() {
    let volume = uniform(UVec3::splat(40), 1.0, DVec3::ONE);
    let (center, r) = middle(&volume);
    let settings = settings(Mode::Composite, &volume);
    let shading = ClipShading { impregnation: Impregnation::None, ..ClipShading::default() };
    let of = |object: Clip| {
        let clip = Clip::everything().probe(object);
        image(&scene(&volume, &clip, shading.clone(), settings.clone()))
    };
    let exact = of(object(1, Sphere::new(center, 0.45 * r).unwrap()));
    let error = |level: u32| {
        let mesh = of(ball(center, 0.45 * r, level, EventFinder::Raster));
        let alpha = |image: &Image| image.pixels().iter().map(|p| f64::from(p[3])).sum::<f64>();
        (alpha(&mesh) - alpha(&exact)).abs() / alpha(&exact)
    };
    // Opacity summed over the image is smooth in the shape, but for the pixels at its outline.
    let errors: Vec<f64> = (1..5).map(error).collect();
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 2.8, "{errors:?}");
    }
}

/// On noise, the cut face is at least five times calmer with impregnation (Termeer, figure 4.2).
#[test]
fn impregnation_calms_the_cut_face() {
    let mut state = 7u32;
    let voxels: Vec<u16> = (0..48 * 48 * 48)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            1000 + (state >> 24) as u16 / 4
        })
        .collect();
    let volume = Volume::new(
        UVec3::splat(48),
        voxels,
        cutaway_core::volume::Rescale::IDENTITY,
        cutaway_core::volume::Geometry::from_spacing(DVec3::ONE),
    )
    .unwrap();
    let gray = cutaway_testing::scenes::point(0.0, [0.7; 3], 0.9);
    let function = cutaway_core::transfer_function::TransferFunction::new(vec![gray]).unwrap();
    let normal = DVec3::new(-0.4, -0.8, 0.3).normalize();
    let plane = Plane::new(normal, normal.dot(volume.center_in_world())).unwrap();
    let clip = Clip::everything().probe(object(1, plane));
    let deviation = |impregnation: Impregnation| {
        let settings = RenderSettings { resolution: [101, 67], step: 0.5, ..RenderSettings::default() };
        let shading = ClipShading { impregnation, ..ClipShading::default() };
        let scene = framed(&volume, &function, Lighting::default(), settings);
        let image = image(&scene.with_clip(&clip, shading).unwrap());
        // The face is in the middle of the picture.
        let values: Vec<f64> = (23..44)
            .flat_map(|y| (40..61).map(move |x| y * 101 + x))
            .map(|i| f64::from(image.pixels()[i][0]))
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let (without, with) = (deviation(Impregnation::None), deviation(Impregnation::Linear));
    println!("deviation of brightness on the cut face: {without:.4} without, {with:.4} with impregnation");
    assert!(without > 5.0 * with, "{without} without, {with} with");
}

#[test]
fn limits_interpolation_and_a_camera_inside_an_object_are_right() {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 2);
    let clips = clips(&volume);
    for (name, clip) in &clips {
        for backmost in [false, true] {
            let limited = RenderSettings {
                segments: SegmentCount::AtMost(NonZeroU32::MIN),
                backmost,
                ..settings(Mode::Composite, &volume)
            };
            let scene = scene(&volume, clip, ClipShading::default(), limited);
            let what = format!("{name}, one segment, backmost {backmost}");
            assert_close(&what, &reference::render(&scene), &image(&scene), CLIPPED);
        }
        // Pixels of a lattice are cast with the pieces that they have without one; their positions are rounded otherwise.
        let lattice = RenderSettings {
            image_interpolation: ImageInterpolation::Factor(2),
            ..settings(Mode::Composite, &volume)
        };
        let full = image(&scene(&volume, clip, ClipShading::default(), settings(Mode::Composite, &volume)));
        let half = image(&scene(&volume, clip, ClipShading::default(), lattice));
        for (y, x) in (0..SMALL[1]).step_by(2).flat_map(|y| (0..SMALL[0]).step_by(2).map(move |x| (y, x))) {
            let at = (y * SMALL[0] + x) as usize;
            for c in 0..4 {
                let off = (full.pixels()[at][c] - half.pixels()[at][c]).abs();
                assert!(off < 5e-3, "{name} at ({x}, {y}): {off}");
            }
        }
    }
    let (center, r) = middle(&volume);
    let mut scene = scene(
        &volume,
        &Clip::everything().cut(ball(center, 0.3 * r, 3, EventFinder::Raster)),
        ClipShading::default(),
        settings(Mode::Composite, &volume),
    );
    let mut camera = scene.camera().clone();
    camera.position = center.to_array();
    camera.focal_point = (center + DVec3::new(1.0, 0.3, 0.2)).to_array();
    camera.view_angle = 80.0;
    scene.set_camera(camera).unwrap();
    assert_close("from within the cut", &reference::render(&scene), &image(&scene), CLIPPED);
}
