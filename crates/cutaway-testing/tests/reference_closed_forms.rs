//! The reference renderer against closed forms: it is the truth that every engine is tested against, so it is held
//! against the mathematics first.

use cutaway_core::analytic::AnalyticField;
use cutaway_core::camera::Camera;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene};
use cutaway_core::transfer_function::{ControlPoint, TransferFunction, extinction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_testing::scenes::{point, uniform};

/// An orthographic view along +z, one ray through the middle of the volume's xy face (and odd images around it).
fn along_z(volume: &Volume, half_height: f64) -> Camera {
    let center = volume.center_in_world();
    Camera {
        position: (center - DVec3::new(0.0, 0.0, 1000.0)).to_array(),
        focal_point: center.to_array(),
        view_up: [0.0, 1.0, 0.0],
        view_angle: 30.0,
        orthographic: Some(half_height),
    }
}

fn unshaded() -> Lighting {
    Lighting { shade: false, ..Lighting::default() }
}

fn one_pixel(mode: Mode) -> RenderSettings {
    RenderSettings { mode, resolution: [1, 1], ..RenderSettings::default() }
}

fn function(points: &[ControlPoint]) -> TransferFunction {
    TransferFunction::new(points.to_vec()).unwrap()
}

fn render(
    volume: &Volume,
    f: &TransferFunction,
    unit: f64,
    lighting: Lighting,
    settings: RenderSettings,
) -> Image {
    let camera = along_z(volume, 0.1);
    reference::render(
        &Scene::new(
            Layer::new(volume.clone(), f).with_unit_distance(Some(unit)).with_lighting(lighting),
            camera,
            settings,
        )
        .unwrap(),
    )
}

#[track_caller]
fn assert_pixel(image: &Image, expected: [f64; 4], tolerance: f64) {
    let found = image.pixel(image.width() / 2, image.height() / 2).unwrap();
    for c in 0..4 {
        assert!(
            (f64::from(found[c]) - expected[c]).abs() <= tolerance,
            "found {found:?}, expected {expected:?}"
        );
    }
}

/// A grid whose value is its z coordinate in the world, 0 to `length`.
fn ramp(voxels: u32, length: f64) -> Volume {
    let step = length / f64::from(voxels - 1);
    let values = (0..voxels).flat_map(|k| [(f64::from(k) * step) as f32; 9]).collect::<Vec<_>>();
    let geometry = Geometry::from_spacing(DVec3::new(1.0, 1.0, step));
    Volume::new(UVec3::new(3, 3, voxels), values, Rescale::IDENTITY, geometry).unwrap()
}

// f32 pixels round at 6e-8; the quadrature's own bound is 1e-9.
const ROUNDING: f64 = 2e-7;

#[test]
fn constant_extinction_is_one_minus_exp() {
    for (opacity, unit, length) in [(0.1, 1.0, 10.0), (0.5, 2.5, 7.0), (0.999, 1.0, 3.0), (1e-4, 1.0, 10.0)] {
        let spacing = length / 4.0;
        let volume = uniform(UVec3::new(3, 3, 5), 1.0, DVec3::new(1.0, 1.0, spacing));
        let f = function(&[point(1.0, [0.8, 0.4, 0.2], opacity)]);
        let image = render(&volume, &f, unit, unshaded(), one_pixel(Mode::Composite));
        let alpha = 1.0 - (-extinction(opacity, unit) * length).exp();
        assert_pixel(&image, [0.8 * alpha, 0.4 * alpha, 0.2 * alpha, alpha], ROUNDING);
    }
}

#[test]
fn brightness_does_not_depend_on_the_spacing_of_the_grid() {
    let f = function(&[point(1.0, [1.0; 3], 0.2)]);
    let images = [3u32, 9, 33].map(|n| {
        let volume = uniform(UVec3::new(3, 3, n), 1.0, DVec3::new(1.0, 1.0, 8.0 / f64::from(n - 1)));
        render(&volume, &f, 1.0, unshaded(), one_pixel(Mode::Composite)).pixel(0, 0).unwrap()
    });
    assert!(images.iter().all(|p| (p[3] - images[0][3]).abs() < 1e-6), "{images:?}");
}

#[test]
fn opacity_linear_along_the_ray_has_its_closed_form() {
    // sigma(z) = -ln(1 - a z) / u, so ∫ sigma = ((1 - aL) ln(1 - aL) + aL) / (a u).
    let (length, top, unit) = (6.0, 0.9, 1.5);
    let volume = ramp(13, length);
    let f = function(&[point(0.0, [0.3; 3], 0.0), point(length, [0.3; 3], top)]);
    let image = render(&volume, &f, unit, unshaded(), one_pixel(Mode::Composite));
    let a = top / length;
    let depth = ((1.0 - top) * (1.0 - top).ln() + top) / (a * unit);
    let alpha = 1.0 - (-depth).exp();
    assert_pixel(&image, [0.3 * alpha, 0.3 * alpha, 0.3 * alpha, alpha], ROUNDING);
}

/// Exact colour and transmittance of a ramp through pieces of constant extinction and linear colour.
fn pieces(parts: &[(f64, f64, f64, f64)]) -> (f64, f64) {
    let (mut color, mut transmittance) = (0.0, 1.0);
    for &(sigma, length, c0, c1) in parts {
        // ∫ (c0 + m t) sigma exp(-sigma t) dt over 0..length.
        let (e, m) = ((-sigma * length).exp(), (c1 - c0) / length);
        color += transmittance * (c0 * (1.0 - e) + m * ((1.0 - e) / sigma - length * e));
        transmittance *= e;
    }
    (color, transmittance)
}

#[test]
fn a_ramp_through_a_piecewise_linear_function_is_exact_over_each_piece() {
    let (length, unit) = (10.0, 1.0);
    // 7 voxels: the knots at 3 and 7.5 lie inside cells, so pieces must be split there.
    let volume = ramp(7, length);
    let gray = |v: f64| [v; 3];
    let f = function(&[
        point(0.0, gray(0.1), 0.05),
        point(3.0, gray(0.9), 0.05),
        point(3.0, gray(0.9), 0.3),
        point(7.5, gray(0.2), 0.3),
        point(7.5, gray(1.0), 0.01),
        point(10.0, gray(0.5), 0.01),
    ]);
    let image = render(&volume, &f, unit, unshaded(), one_pixel(Mode::Composite));
    let s = |o: f64| extinction(o, unit);
    let (color, transmittance) =
        pieces(&[(s(0.05), 3.0, 0.1, 0.9), (s(0.3), 4.5, 0.9, 0.2), (s(0.01), 2.5, 1.0, 0.5)]);
    assert_pixel(&image, [color, color, color, 1.0 - transmittance], ROUNDING);
}

#[test]
fn depth_is_where_opacity_passes_one_half() {
    let volume = uniform(UVec3::new(3, 3, 11), 1.0, DVec3::ONE);
    let f = function(&[point(1.0, [1.0; 3], 0.25)]);
    let image = render(&volume, &f, 1.0, unshaded(), one_pixel(Mode::Composite));
    let expected = 995.0 + 0.5f64.ln() / 0.75f64.ln();
    assert!((f64::from(image.depth_at(0, 0).unwrap()) - expected).abs() < 1e-3);
}

#[test]
fn a_plane_isosurface_is_where_and_as_bright_as_it_should_be() {
    let direction = DVec3::new(0.3, -0.2, 0.9);
    let volume = AnalyticField::Ramp { direction }.volume(11);
    let f = function(&[point(-2.0, [0.5, 0.25, 1.0], 0.0), point(2.0, [0.5, 0.25, 1.0], 0.0)]);
    let lighting = Lighting { specular: 0.3, specular_power: 12.0, ..Lighting::default() };
    let settings = RenderSettings { iso: vec![0.1], ..one_pixel(Mode::Iso) };
    let image = render(&volume, &f, 1.0, lighting.clone(), settings);
    // Through the centre, direction·p = 0.9 z: the plane is at z = 1/9, i.e. 5/9 of a voxel past the centre.
    assert!((f64::from(image.depth_at(0, 0).unwrap()) - (1000.0 + 5.0 / 9.0)).abs() < 1e-4);
    let cos = (direction.normalize().z).abs();
    let factor = lighting.ambient + lighting.diffuse * cos;
    let white = lighting.specular * cos.powf(12.0);
    assert_pixel(&image, [0.5 * factor + white, 0.25 * factor + white, factor + white, 1.0], 1e-6);
}

#[test]
fn several_translucent_isosurfaces_composite_front_to_back() {
    let volume = ramp(9, 8.0);
    let f = function(&[point(0.0, [0.0; 3], 0.0), point(8.0, [1.0; 3], 0.0)]);
    let settings = RenderSettings { iso: vec![6.0, 2.0, 4.0], iso_opacity: 0.5, ..one_pixel(Mode::Iso) };
    let image = render(&volume, &f, 1.0, unshaded(), settings);
    let color = 0.5 * 0.25 + 0.25 * 0.5 + 0.125 * 0.75;
    assert_pixel(&image, [color, color, color, 0.875], 1e-6);
}

#[test]
fn projections_of_a_ramp_are_its_ends_and_its_middle() {
    let volume = ramp(9, 8.0);
    let f = function(&[point(0.0, [0.0, 1.0, 0.5], 0.0), point(8.0, [1.0, 0.0, 0.5], 1.0)]);
    for (mode, value) in [(Mode::Mip, 8.0), (Mode::Minip, 0.0), (Mode::Mean, 4.0)] {
        let image = render(&volume, &f, 1.0, unshaded(), one_pixel(mode));
        let a: f64 = value / 8.0;
        assert_pixel(&image, [a * a, (1.0 - a) * a, 0.5 * a, a], 1e-6);
    }
}

#[test]
fn a_maximum_between_voxels_is_found() {
    // v = x y on one cell, seen along its diagonal: t (1 - t) has its maximum 1/4 in the middle, on no voxel.
    let values = vec![0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let volume =
        Volume::new(UVec3::new(2, 2, 2), values, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
            .unwrap();
    let f = function(&[point(0.0, [1.0; 3], 0.0), point(1.0, [1.0; 3], 1.0)]);
    let center = DVec3::splat(0.5);
    let camera = Camera {
        position: (center - DVec3::new(10.0, 10.0, 0.0)).to_array(),
        focal_point: center.to_array(),
        view_up: [0.0, 0.0, 1.0],
        view_angle: 30.0,
        orthographic: Some(0.01),
    };
    let scene =
        Scene::new(Layer::new(volume.clone(), &f).with_lighting(unshaded()), camera, one_pixel(Mode::Mip))
            .unwrap();
    assert_pixel(&reference::render(&scene), [0.25, 0.25, 0.25, 0.25], 1e-6);
}

#[test]
fn a_sphere_has_the_radius_that_trilinear_interpolation_gives_it() {
    // Linear interpolation of 1 - r is off by at most h²/8 times its curvature (2/r): the isosurface moves by that.
    let n = 49;
    let volume = AnalyticField::Sphere.volume(n);
    let h = 2.0 / f64::from(n - 1);
    let radius = 0.7;
    let f = function(&[point(0.0, [1.0; 3], 1.0)]);
    let settings = RenderSettings {
        mode: Mode::Iso,
        iso: vec![1.0 - radius],
        resolution: [41, 41],
        ..Default::default()
    };
    let camera = along_z(&volume, 20.5);
    let image = reference::render(
        &Scene::new(Layer::new(volume.clone(), &f).with_lighting(unshaded()), camera, settings).unwrap(),
    );
    let bound = 3.0 * h * h / 8.0 * 2.0 / radius / h + 1e-3;
    let mut hits = 0;
    for y in 0..41 {
        for x in 0..41 {
            let (dx, dy) = (f64::from(x) - 20.0, f64::from(y) - 20.0);
            let (off, r) = ((dx * dx + dy * dy).sqrt(), radius / h);
            if off < r - 2.0 {
                let expected = 1000.0 - (r * r - off * off).sqrt();
                // Across a slope the surface moves along the ray by more than along its normal.
                let slope = r / (r * r - off * off).sqrt();
                let found = f64::from(image.depth_at(x, y).unwrap());
                assert!((found - expected).abs() < bound * slope, "{x} {y}: {found} {expected}");
                hits += 1;
            } else if off > r + 2.0 {
                assert_eq!(image.pixel(x, y).unwrap()[3], 0.0);
            }
        }
    }
    assert!(hits > 500);
}

#[test]
fn shading_a_linear_field_is_the_same_everywhere_and_follows_each_curve() {
    let direction = DVec3::new(0.5, 0.1, -0.7);
    let volume = AnalyticField::Ramp { direction }.volume(9);
    let f = function(&[point(-2.0, [1.0; 3], 0.999), point(2.0, [1.0; 3], 0.999)]);
    for curve in [DiffuseCurve::Clamped, DiffuseCurve::TwoSided, DiffuseCurve::Wrapped] {
        let lighting = Lighting {
            diffuse_curve: curve,
            specular: 0.0,
            wrap_power: 2.0,
            light: Some([0.0, 0.3, -1.0]),
            ..Lighting::default()
        };
        // The eye is inside: at the border the clamped differences would turn the normal.
        let mut camera = along_z(&volume, 0.1);
        camera.position = (volume.center_in_world() - DVec3::new(0.0, 0.0, 1.5)).to_array();
        let settings = one_pixel(Mode::Composite);
        let scene = Scene::new(
            Layer::new(volume.clone(), &f).with_unit_distance(Some(0.01)).with_lighting(lighting.clone()),
            camera,
            settings,
        )
        .unwrap();
        let image = reference::render(&scene);
        let (n, l) = (-direction.normalize(), DVec3::new(0.0, 0.3, -1.0).normalize());
        let d = match curve {
            DiffuseCurve::Clamped => n.dot(l).max(0.0),
            DiffuseCurve::TwoSided => n.dot(l).abs(),
            DiffuseCurve::Wrapped => ((n.dot(l) + 1.0) / 2.0).powi(2),
        };
        let shade = 0.1 + 0.9 * d;
        assert_pixel(&image, [shade, shade, shade, 1.0], 1e-5);
    }
}

#[test]
fn a_homogeneous_region_is_lit_by_the_mean_of_the_curve() {
    let volume = uniform(UVec3::splat(5), 1.0, DVec3::ONE);
    let f = function(&[point(1.0, [0.5; 3], 0.999)]);
    let lighting = Lighting::default();
    let image = render(&volume, &f, 0.01, lighting, one_pixel(Mode::Composite));
    let shade = 0.5 * (0.1 + 0.9 * 0.5) + 0.2 / 11.0;
    assert_pixel(&image, [shade, shade, shade, 1.0], 1e-5);
}

#[test]
fn perspective_and_orthographic_rays_measure_world_length() {
    // Through a slab, a ray at an angle is longer by 1/cos.
    let volume = uniform(UVec3::new(81, 81, 3), 1.0, DVec3::ONE);
    let f = function(&[point(1.0, [1.0; 3], 0.2)]);
    let mut camera = along_z(&volume, 20.0);
    camera.orthographic = None;
    camera.position[2] = camera.focal_point[2] - 30.0;
    camera.view_angle = 60.0;
    let settings = RenderSettings { resolution: [21, 21], ..RenderSettings::default() };
    let scene = Scene::new(
        Layer::new(volume.clone(), &f).with_unit_distance(Some(1.0)).with_lighting(unshaded()),
        camera.clone(),
        settings,
    )
    .unwrap();
    let image = reference::render(&scene);
    for (x, y) in [(10, 10), (0, 10), (3, 17), (20, 0)] {
        let cos = camera.rays(21, 21).pixel(x, y).direction.z;
        let alpha = 1.0 - 0.8f64.powf(2.0 / cos);
        assert!((f64::from(image.pixel(x, y).unwrap()[3]) - alpha).abs() < 1e-6, "{x} {y}");
    }
}
