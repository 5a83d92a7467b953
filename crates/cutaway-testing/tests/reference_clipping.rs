//! Clipping in the reference renderer against closed forms, a smaller volume, and the algebra of sets, pixel by pixel.

use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::clip::{
    AxisBox, Clip, ClipShading, Impregnation, Node, ObjectId, Plane, Pose, SegmentCount, Solid, Sphere,
};
use cutaway_core::glam::{DAffine3, DQuat, DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene};
use cutaway_core::transfer_function::{TransferFunction, extinction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point, soft, uniform};

/// f32 pixels round at 6e-8; the quadrature's own bound is 1e-9.
const ROUNDING: f64 = 2e-7;

fn object(solid: impl Solid + 'static) -> Clip {
    Clip::object(ObjectId(0), Arc::new(solid))
}

fn sphere(center: DVec3, radius: f64) -> Clip {
    object(Sphere::new(center, radius).unwrap())
}

fn plane(normal: DVec3, distance: f64) -> Clip {
    object(Plane::new(normal, distance).unwrap())
}

fn complement(clip: Clip) -> Clip {
    Node::Complement(Box::new(clip)).into()
}

fn plain() -> ClipShading {
    ClipShading { impregnation: Impregnation::None, ..ClipShading::default() }
}

fn unshaded() -> Lighting {
    Lighting { shade: false, ..Lighting::default() }
}

/// An orthographic view along +z from `distance` before the middle of the volume.
fn along_z(volume: &Volume, half_height: f64, distance: f64) -> Camera {
    let center = volume.center_in_world();
    Camera {
        position: (center - DVec3::new(0.0, 0.0, distance)).to_array(),
        focal_point: center.to_array(),
        view_up: [0.0, 1.0, 0.0],
        view_angle: 30.0,
        orthographic: Some(half_height),
    }
}

/// A cube of value 1, 10 long, centred at 5.
fn cube() -> Volume {
    uniform(UVec3::splat(11), 1.0, DVec3::ONE)
}

const OPACITY: f64 = 0.2;

fn one_value(opacity: f64) -> TransferFunction {
    TransferFunction::new(vec![point(1.0, [0.8, 0.4, 0.2], opacity)]).unwrap()
}

/// Opacity of each pixel must be that of the length that a straight line has within what is kept.
fn assert_lengths(clip: &Clip, camera: Camera, length: impl Fn(DVec3, DVec3) -> f64) {
    let volume = cube();
    let settings = RenderSettings { resolution: [41, 41], ..RenderSettings::default() };
    let rays = camera.rays(41, 41);
    let scene = Scene::new(
        Layer::new(volume.clone(), &one_value(OPACITY))
            .with_unit_distance(Some(1.0))
            .with_lighting(unshaded()),
        camera,
        settings,
    )
    .unwrap();
    let image = reference::render(&scene.with_clip(clip, plain()).unwrap());
    let mut seen = 0;
    for y in 0..41 {
        for x in 0..41 {
            let ray = rays.pixel(x, y);
            let alpha = 1.0 - (-extinction(OPACITY, 1.0) * length(ray.origin, ray.direction)).exp();
            let found = f64::from(image.pixel(x, y).unwrap()[3]);
            assert!((found - alpha).abs() < ROUNDING, "{x} {y}: found {found}, expected {alpha}");
            seen += u32::from(alpha > 0.0 && alpha < 0.89);
        }
    }
    assert!(seen > 100, "{seen} pixels show part of the volume");
}

/// Length of a line within a ball: where the line's distance from the centre leaves room.
fn chord(origin: DVec3, direction: DVec3, center: DVec3, radius: f64) -> f64 {
    let off = (origin - center).reject_from(direction).length();
    2.0 * (radius * radius - off * off).max(0.0).sqrt()
}

#[test]
fn a_sphere_leaves_its_chords() {
    // Radius 4 and pixels half a unit apart: the rays at 4 from the middle graze it.
    let (center, radius) = (DVec3::splat(5.0), 4.0);
    let camera = along_z(&cube(), 10.25, 100.0);
    let inside = |o: DVec3| (0.0..=10.0).contains(&o.x) && (0.0..=10.0).contains(&o.y);
    assert_lengths(&sphere(center, radius), camera.clone(), |o, d| chord(o, d, center, radius));
    let cut = Clip::everything().cut(sphere(center, radius));
    assert_lengths(&cut, camera, |o, d| if inside(o) { 10.0 - chord(o, d, center, radius) } else { 0.0 });
}

#[test]
fn a_posed_sphere_is_an_ellipsoid() {
    let turn = DQuat::from_rotation_x(0.4) * DQuat::from_rotation_y(0.7);
    let affine =
        DAffine3::from_scale_rotation_translation(DVec3::new(1.5, -3.0, 4.0), turn, DVec3::splat(5.0));
    let clip = sphere(DVec3::ZERO, 1.0).with_pose(Pose::new(affine).unwrap());
    let inverse = affine.inverse();
    assert_lengths(&clip, along_z(&cube(), 5.1, 100.0), |o, d| {
        // In the ball's space lengths are those of the mapped direction.
        let (o, d) = (inverse.transform_point3(o), inverse.transform_vector3(d));
        chord(o, d, DVec3::ZERO, 1.0) / d.length()
    });
}

#[test]
fn an_oblique_half_space_leaves_what_is_below_it() {
    let normal = DVec3::new(0.3, -0.5, 0.8);
    let distance = normal.dot(DVec3::splat(5.0)) + 0.3;
    let until = |o: DVec3, d: DVec3| {
        // From the front face of the cube, 95 away, to the plane.
        let t = (distance - normal.dot(o)) / normal.dot(d) - 95.0;
        if o.x.min(o.y) < 0.0 || o.x.max(o.y) > 10.0 { 0.0 } else { t.clamp(0.0, 10.0) }
    };
    let camera = along_z(&cube(), 6.0, 100.0);
    assert_lengths(&plane(normal, distance), camera.clone(), until);
    let above = |o: DVec3, d: DVec3| {
        if o.x.min(o.y) < 0.0 || o.x.max(o.y) > 10.0 { 0.0 } else { 10.0 - until(o, d) }
    };
    assert_lengths(&complement(plane(normal, distance)), camera, above);
}

#[test]
fn a_turned_box_leaves_its_width() {
    // Turned about z, a square column: the view along z sees all of it, or nothing.
    let column = object(AxisBox::new(DVec3::new(-3.0, -2.0, -1.0), DVec3::new(3.0, 2.0, 2.5)).unwrap());
    let affine = DAffine3::from_translation(DVec3::splat(5.0)) * DAffine3::from_rotation_z(0.6);
    let clip = column.with_pose(Pose::new(affine).unwrap());
    assert_lengths(&clip, along_z(&cube(), 5.1, 100.0), |o, _| {
        let p = affine.inverse().transform_point3(DVec3::new(o.x, o.y, 5.0));
        if p.x.abs() <= 3.0 && p.y.abs() <= 2.0 { 3.5 } else { 0.0 }
    });
}

#[test]
fn an_eye_within_what_is_cut_sees_what_lies_beyond() {
    let (center, radius) = (DVec3::new(5.0, 5.0, 4.0), 2.5);
    let mut camera = along_z(&cube(), 1.0, 1.5);
    camera.orthographic = None;
    camera.view_angle = 60.0;
    let to_end = |o: DVec3, d: DVec3| {
        let faces = (DVec3::splat(10.0) - o) / d;
        let low = -o / d;
        faces.max(low).min_element()
    };
    let out = |o: DVec3, d: DVec3| {
        let along = (center - o).dot(d);
        along + chord(o, d, center, radius) / 2.0
    };
    let cut = Clip::everything().cut(sphere(center, radius));
    assert_lengths(&cut, camera.clone(), |o, d| to_end(o, d) - out(o, d));
    assert_lengths(&sphere(center, radius), camera, out);
}

/// Values of a grid whose value is its z coordinate, 0 to 10.
fn ramp() -> Volume {
    let values = (0..11u32).flat_map(|k| [k as f32; 9]).collect::<Vec<_>>();
    let geometry = Geometry::from_spacing(DVec3::ONE);
    Volume::new(UVec3::new(3, 3, 11), values, Rescale::IDENTITY, geometry).unwrap()
}

fn one_pixel(
    volume: &Volume,
    f: &TransferFunction,
    lighting: Lighting,
    mode: RenderSettings,
    clip: &Clip,
    shading: ClipShading,
) -> Image {
    let settings = RenderSettings { resolution: [1, 1], ..mode };
    let camera = along_z(volume, 0.1, 1000.0);
    let scene = Scene::new(
        Layer::new(volume.clone(), f).with_unit_distance(Some(1.0)).with_lighting(lighting),
        camera,
        settings,
    )
    .unwrap();
    reference::render(&scene.with_clip(clip, shading).unwrap())
}

#[track_caller]
fn assert_pixel(image: &Image, expected: [f64; 4], tolerance: f64) {
    let found = image.pixel(0, 0).unwrap();
    for c in 0..4 {
        let off = (f64::from(found[c]) - expected[c]).abs();
        assert!(off <= tolerance, "found {found:?}, expected {expected:?}");
    }
}

fn gray_ramp() -> TransferFunction {
    TransferFunction::new(vec![point(0.0, [0.0, 1.0, 0.5], 0.0), point(10.0, [1.0, 0.0, 0.5], 1.0)]).unwrap()
}

/// Keeps 2.3 to 4 and 7 to 8.6 of z.
fn two_slabs() -> Clip {
    let slab = |from: f64, to: f64| {
        object(AxisBox::new(DVec3::new(-9.0, -9.0, from), DVec3::new(9.0, 9.0, to)).unwrap())
    };
    Clip::everything().probe(slab(2.3, 8.6)).cut(slab(4.0, 7.0))
}

#[test]
fn projections_see_only_what_is_kept() {
    // The mean over what is kept: (1.7 * 3.15 + 1.6 * 7.8) / 3.3.
    let mean = (1.7 * 3.15 + 1.6 * 7.8) / 3.3;
    for (mode, value, depth) in
        [(Mode::Mip, 8.6, 1003.6), (Mode::Minip, 2.3, 997.3), (Mode::Mean, mean, 997.3)]
    {
        let settings = RenderSettings { mode, ..RenderSettings::default() };
        let image = one_pixel(&ramp(), &gray_ramp(), unshaded(), settings, &two_slabs(), plain());
        let a: f64 = value / 10.0;
        assert_pixel(&image, [a * a, (1.0 - a) * a, 0.5 * a, a], 1e-6);
        assert!((f64::from(image.depth_at(0, 0).unwrap()) - depth).abs() < 1e-3, "{mode:?}");
    }
    let nothing = Clip::everything().cut(Clip::everything());
    for mode in Mode::ALL {
        let settings = RenderSettings { mode, iso: vec![3.0], ..RenderSettings::default() };
        let image = one_pixel(&ramp(), &gray_ramp(), unshaded(), settings, &nothing, plain());
        assert_eq!(image.pixel(0, 0), Some([0.0; 4]));
        assert_eq!(image.depth_at(0, 0), Some(f32::INFINITY));
    }
}

#[test]
fn a_limit_takes_the_first_segments_or_goes_to_the_end() {
    let depth = |segments: u32, backmost: bool| {
        let segments = SegmentCount::AtMost(segments.try_into().unwrap());
        let settings = RenderSettings { segments, backmost, ..RenderSettings::default() };
        let f = TransferFunction::new(vec![point(1.0, [1.0; 3], OPACITY)]).unwrap();
        let image = one_pixel(&ramp(), &f, unshaded(), settings, &two_slabs(), plain());
        (1.0 - f64::from(image.pixel(0, 0).unwrap()[3])).ln() / (1.0 - OPACITY).ln()
    };
    for (segments, backmost, length) in [(1, false, 1.7), (1, true, 6.3), (2, true, 3.3), (9, false, 3.3)] {
        assert!((depth(segments, backmost) - length).abs() < 1e-5, "{segments} {backmost}");
    }
}

#[test]
fn isosurfaces_are_cut_open_and_closed_by_the_cap() {
    let shading = |cap: bool| ClipShading { cap, ..plain() };
    let lighting = Lighting { specular: 0.0, ..Lighting::default() };
    let render = |iso: &[f64], clip: &Clip, cap: bool| {
        let settings = RenderSettings { mode: Mode::Iso, iso: iso.to_vec(), ..RenderSettings::default() };
        one_pixel(&ramp(), &gray_ramp(), lighting.clone(), settings, clip, shading(cap))
    };
    // A half-space whose face, at z = 6 in the middle of the image, is turned by 30 degrees.
    let normal = DVec3::new(0.5, 0.0, -0.75f64.sqrt());
    let behind = plane(normal, normal.dot(DVec3::new(1.0, 1.0, 6.0)));
    let depth = |image: &Image| f64::from(image.depth_at(0, 0).unwrap());
    // The surface at 8 lies behind the cut; that at 3 was cut away, and the ray begins within it.
    let open = render(&[8.0], &behind, false);
    assert!((depth(&open) - 1003.0).abs() < 1e-3);
    assert_eq!(open.pixels(), render(&[8.0], &behind, true).pixels());
    assert_eq!(render(&[3.0], &behind, false).pixel(0, 0), Some([0.0; 4]));
    let capped = render(&[3.0], &behind, true);
    let shade = 0.1 + 0.9 * 0.75f64.sqrt();
    assert!((depth(&capped) - 1001.0).abs() < 1e-3);
    assert_pixel(&capped, [0.3 * shade, 0.7 * shade, 0.5 * shade, 1.0], 1e-6);
    // Of nested ones the innermost shows; the cap is in front of what lies behind the cut.
    let nested = render(&[3.0, 5.0, 8.0], &behind, true);
    assert_pixel(&nested, [0.5 * shade, 0.5 * shade, 0.5 * shade, 1.0], 1e-6);
    // The volume's own faces are no cut.
    assert_eq!(render(&[-1.0], &Clip::everything(), true).pixel(0, 0), Some([0.0; 4]));
}

#[test]
fn impregnation_mixes_the_light_of_cut_and_volume_by_depth() {
    // The field's gradient is along z, so its light is full; the cut is turned by 60 degrees.
    let normal = DVec3::new(0.75f64.sqrt(), 0.0, -0.5);
    let clip = plane(normal, normal.dot(DVec3::new(1.0, 1.0, 4.0)));
    let lighting = Lighting { specular: 0.0, ..Lighting::default() };
    let f = TransferFunction::new(vec![point(0.0, [1.0; 3], OPACITY)]).unwrap();
    let sigma = extinction(OPACITY, 1.0);
    let (length, cosine) = (6.0, 0.5);
    let (cut, volume) = (0.1 + 0.9 * cosine, 1.0);
    let through = |x: f64| 1.0 - (-sigma * x).exp();
    for thickness in [0.7, 2.0, 5.0] {
        // Depth below the plane is the way along the ray times the cosine.
        let x: f64 = thickness / cosine;
        let step = cut * through(x.min(length)) + volume * (through(length) - through(x.min(length)));
        // ∫ (1 - s/x) sigma exp(-sigma s) ds over 0..y.
        let weight = |y: f64| {
            let e = (-sigma * y).exp();
            (1.0 - e) - ((1.0 - e) / sigma - y * e) / x
        };
        let w = weight(x.min(length));
        let linear = cut * w + volume * (through(length) - w);
        let none = volume * through(length);
        let cases = [(Impregnation::None, none), (Impregnation::Step, step), (Impregnation::Linear, linear)];
        for (impregnation, expected) in cases {
            let shading = ClipShading { impregnation, thickness, ..ClipShading::default() };
            let image = one_pixel(&ramp(), &f, lighting.clone(), RenderSettings::default(), &clip, shading);
            assert_pixel(&image, [expected, expected, expected, through(length)], 1e-6);
        }
    }
}

#[test]
fn faces_that_look_away_impregnate_nothing() {
    // Only the far end of what is kept is a cut.
    let clip = plane(DVec3::Z, 4.0);
    let render = |impregnation| {
        let shading = ClipShading { impregnation, ..ClipShading::default() };
        let f = TransferFunction::new(vec![point(0.0, [1.0; 3], OPACITY)]).unwrap();
        one_pixel(&ramp(), &f, Lighting::default(), RenderSettings::default(), &clip, shading)
    };
    assert_eq!(render(Impregnation::Step).pixels(), render(Impregnation::None).pixels());
}

#[test]
fn an_overlay_is_a_white_surface_where_segments_begin() {
    let normal = DVec3::new(0.6, 0.0, -0.8);
    let clip = plane(normal, normal.dot(DVec3::new(1.0, 1.0, 4.0)));
    let lighting = Lighting { specular: 0.0, ..Lighting::default() };
    let shading = ClipShading { overlay: 0.3, ..plain() };
    let white = 0.1 + 0.9 * 0.8;
    let settings = |mode| RenderSettings { mode, iso: vec![5.0], ..RenderSettings::default() };
    let render = |mode, shading: ClipShading| {
        one_pixel(&ramp(), &gray_ramp(), lighting.clone(), settings(mode), &clip, shading)
    };
    for mode in Mode::ALL {
        let behind = render(mode, plain()).pixel(0, 0).unwrap().map(f64::from);
        let [r, g, b, a] = behind.map(|c| 0.7 * c);
        let expected = [r + 0.3 * white, g + 0.3 * white, b + 0.3 * white, a + 0.3];
        assert_pixel(&render(mode, shading.clone()), expected, 1e-6);
    }
}

/// The noise of a homogeneous volume must not be what a cut through it shows (Termeer, figure 4.2).
#[test]
fn impregnation_makes_a_noisy_cut_flat() {
    let mut state = 1u32;
    let noise = (0..33u32.pow(3)).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        100.0 + (state >> 24) as f32 / 64.0
    });
    let geometry = Geometry::from_spacing(DVec3::ONE);
    let volume = Volume::new(UVec3::splat(33), noise.collect(), Rescale::IDENTITY, geometry).unwrap();
    let f = TransferFunction::new(vec![point(100.0, [1.0; 3], 0.8)]).unwrap();
    let normal = DVec3::new(0.3, 0.2, -0.9);
    let clip = plane(normal, normal.dot(DVec3::splat(16.0)));
    let deviation = |impregnation| {
        let settings = RenderSettings { resolution: [31, 31], ..RenderSettings::default() };
        let camera = along_z(&volume, 8.0, 100.0);
        let scene =
            Scene::new(Layer::new(volume.clone(), &f).with_unit_distance(Some(1.0)), camera, settings)
                .unwrap();
        let shading = ClipShading { impregnation, ..ClipShading::default() };
        let image = reference::render(&scene.with_clip(&clip, shading).unwrap());
        let values: Vec<f64> = image.pixels().iter().map(|p| f64::from(p[1])).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let [none, step, linear] = [Impregnation::None, Impregnation::Step, Impregnation::Linear].map(deviation);
    assert!(none > 0.05, "{none}: the cut is not noisy to begin with");
    assert!(linear < none / 5.0 && step < none / 5.0, "none {none}, step {step}, linear {linear}");
}

/// What a crop leaves must be what a file of only those voxels shows.
#[test]
fn a_crop_is_the_smaller_volume() {
    let whole = oblique_noise(UVec3::new(15, 13, 11), 3);
    let (from, to) = (UVec3::new(3, 2, 4), UVec3::new(11, 9, 8));
    let dims = to - from + 1;
    let mut voxels = Vec::new();
    for k in from.z..=to.z {
        for j in from.y..=to.y {
            for i in from.x..=to.x {
                let value = whole.value_clamped(i64::from(i), i64::from(j), i64::from(k));
                voxels.push(value as f32);
            }
        }
    }
    let place = *whole.world_from_voxel() * DAffine3::from_translation(from.as_dvec3());
    let geometry = Geometry { world_from_voxel: place, frame: whole.geometry().frame };
    let part = Volume::new(dims, voxels, Rescale::IDENTITY, geometry).unwrap();
    let crop = object(AxisBox::new(from.as_dvec3(), to.as_dvec3()).unwrap())
        .with_pose(Pose::new(*whole.world_from_voxel()).unwrap());
    let f = soft(whole.value_range());
    let middle = whole.value_range().iter().sum::<f64>() / 2.0;
    for mode in Mode::ALL {
        let settings =
            RenderSettings { mode, iso: vec![middle], resolution: SMALL, ..RenderSettings::default() };
        let cropped = framed(&whole, &f, unshaded(), settings.clone());
        let camera = cropped.camera().clone();
        let cropped = reference::render(&cropped.with_clip(&crop, plain()).unwrap());
        let smaller =
            Scene::new(Layer::new(part.clone(), &f).with_lighting(unshaded()), camera, settings).unwrap();
        let smaller = reference::render(&smaller);
        let off = cropped.pixels().iter().zip(smaller.pixels()).filter(|(a, b)| {
            // f32 voxels of the part, of values near 1e4, round at 1e-3 of the range's 1e4.
            a.iter().zip(b.iter()).any(|(a, b)| (a - b).abs() > 1e-4)
        });
        assert_eq!(off.count(), 0, "{mode:?}");
        assert!(cropped.pixels().iter().any(|p| p[3] > 0.01), "{mode:?} shows nothing");
    }
}

#[test]
fn the_algebra_of_sets_holds_pixel_by_pixel() {
    let volume = oblique_noise(UVec3::new(15, 13, 11), 5);
    let (f, center) = (soft(volume.value_range()), volume.center_in_world());
    let turn = Pose::new(
        DAffine3::from_translation(center)
            * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.8),
    );
    let half = DVec3::new(6.0, 3.0, 8.0);
    let a = || sphere(center + DVec3::new(2.0, 0.0, -3.0), 6.0);
    let b = || object(AxisBox::new(-half, half).unwrap()).with_pose(turn.clone().unwrap());
    let c = || plane(DVec3::new(1.0, -1.0, 0.2), DVec3::new(1.0, -1.0, 0.2).dot(center));
    let union = |parts: Vec<Clip>| -> Clip { Node::Union(parts).into() };
    let both = |parts: Vec<Clip>| -> Clip { Node::Intersection(parts).into() };
    let minus = |x: Clip, y: Clip| -> Clip { Node::Difference(vec![x, y]).into() };
    let laws: [(&str, Clip, Clip); 9] = [
        ("A - A = nothing", minus(a(), a()), complement(Clip::everything())),
        ("A ∪ A = A", union(vec![a(), a()]), a()),
        ("A ∩ A = A", both(vec![b(), b()]), b()),
        ("A ∪ not A = everything", union(vec![b(), complement(b())]), Clip::everything()),
        (
            "not (A ∪ B) = not A ∩ not B",
            complement(union(vec![a(), b()])),
            both(vec![complement(a()), complement(b())]),
        ),
        (
            "not (A ∩ B) = not A ∪ not B",
            complement(both(vec![a(), b()])),
            union(vec![complement(a()), complement(b())]),
        ),
        ("A - B = A ∩ not B", minus(a(), b()), both(vec![a(), complement(b())])),
        (
            "A ∩ (B ∪ C) = (A ∩ B) ∪ (A ∩ C)",
            both(vec![a(), union(vec![b(), c()])]),
            union(vec![both(vec![a(), b()]), both(vec![a(), c()])]),
        ),
        ("cuts and probes in any order", Clip::everything().cut(a()).probe(b()), minus(b(), a())),
    ];
    let middle = volume.value_range().iter().sum::<f64>() / 2.0;
    for mode in [Mode::Composite, Mode::Iso, Mode::Mip, Mode::Mean] {
        let settings =
            RenderSettings { mode, iso: vec![middle], resolution: [31, 23], ..RenderSettings::default() };
        let shading = ClipShading { overlay: 0.2, cap: true, ..ClipShading::default() };
        let render = |clip: &Clip| {
            let scene = framed(&volume, &f, Lighting::default(), settings.clone());
            reference::render(&scene.with_clip(clip, shading.clone()).unwrap())
        };
        for (law, left, right) in &laws {
            let (left, right) = (render(left), render(right));
            for (p, q) in left.pixels().iter().zip(right.pixels()) {
                // The same segments, to the bit; of coincident surfaces another may bound, and round its normal.
                assert!(p.iter().zip(q).all(|(p, q)| (p - q).abs() < 1e-6), "{law}, {mode:?}: {p:?} {q:?}");
            }
        }
        assert!(render(&minus(a(), b())).pixels().iter().filter(|p| p[3] > 0.01).count() > 20);
    }
}

#[test]
fn statistics_count_rays_and_segments() {
    let volume = ramp();
    let settings = RenderSettings { resolution: [3, 3], ..RenderSettings::default() };
    let camera = along_z(&volume, 0.1, 1000.0);
    let scene =
        Scene::new(Layer::new(volume.clone(), &gray_ramp()).with_lighting(unshaded()), camera, settings)
            .unwrap();
    let count = |scene: &Scene| reference::render_with_progress(scene, &|_| {}).1;
    let unclipped = count(&scene);
    assert_eq!((unclipped.rays, unclipped.segments, unclipped.repaired), (9, 9, 0));
    let clipped = count(&scene.with_clip(&two_slabs(), plain()).unwrap());
    assert_eq!((clipped.rays, clipped.segments, clipped.repaired), (9, 18, 0));
}
