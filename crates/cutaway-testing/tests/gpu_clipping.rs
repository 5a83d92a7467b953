//! Clipped scenes on the GPU ray caster: against the reference, the identities of set algebra, and what moving an object costs.
//!
//! Without an adapter the tests show as ignored.

use std::num::NonZeroU32;
use std::sync::Arc;

use cutaway_core::camera::Ray;
use cutaway_core::clip::{
    AxisBox, Clip, ClipShading, Event, Impregnation, Node, ObjectId, Pose, SegmentCount, Solid, Sphere,
};
use cutaway_core::glam::{DAffine3, DVec3, UVec3, Vec3};
use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Mode, Scene};
use cutaway_core::volume::Volume;
use cutaway_gpu::{ClipStatistics, Gpu, GpuError, GpuOptions, RaycastRenderer};
use cutaway_mesh::{EventFinder, MeshSolid, TriangleMesh, shapes};
use cutaway_testing::clips::{ball, clips, middle, object, scene, settings};
use cutaway_testing::engines::raycast;
use cutaway_testing::scenes::{oblique_noise, uniform};
use cutaway_testing::tolerances::{Tolerance, assert_close};
use libtest_mimic::{Arguments, Failed, Trial};

/// What a test does with a renderer.
type Check = fn(&RaycastRenderer);

const CHECKS: &[(&str, Check)] = &[
    ("every_mode_agrees_with_the_reference", every_mode_agrees_with_the_reference),
    ("every_impregnation_agrees_with_the_reference", every_impregnation_agrees_with_the_reference),
    ("identities_of_sets_hold_pixel_by_pixel", identities_of_sets_hold_pixel_by_pixel),
    ("a_moved_object_is_not_uploaded_again", a_moved_object_is_not_uploaded_again),
    ("a_camera_inside_an_object_sees_what_is_left", a_camera_inside_an_object_sees_what_is_left),
    ("parallel_rays_begin_behind_the_eye", parallel_rays_begin_behind_the_eye),
    ("limited_segments_agree_with_the_reference", limited_segments_agree_with_the_reference),
    ("lists_of_any_length_are_swept", lists_of_any_length_are_swept),
    ("expressions_of_any_size_are_evaluated", expressions_of_any_size_are_evaluated),
    ("a_mirrored_object_is_cut_as_well", a_mirrored_object_is_cut_as_well),
    ("holes_cost_no_more_than_the_object", holes_cost_no_more_than_the_object),
    ("solids_of_other_kinds_are_refused", solids_of_other_kinds_are_refused),
];

pub(crate) fn main() {
    let arguments = Arguments::from_args();
    let there = Gpu::new(&GpuOptions::default()).is_ok();
    let trials = CHECKS.iter().map(|&(name, check)| {
        let run = move || -> Result<(), Failed> {
            check(&RaycastRenderer::new(&Gpu::new(&GpuOptions::default())?)?);
            Ok(())
        };
        Trial::test(name, run).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

/// The bound of the project for GPU engines at a quarter of a voxel. Against `STEPPED`: a filter of 8 bits of fraction, and
/// a cut that lies where f32 has it.
const CLIPPED: Tolerance = Tolerance { rmse: 0.004, bias: 0.001, outliers: 0.05 };

fn image(renderer: &RaycastRenderer, scene: &Scene) -> Image {
    raycast(scene, renderer).0
}

fn clip_statistics(renderer: &RaycastRenderer, scene: &Scene) -> ClipStatistics {
    raycast(scene, renderer).1.clip
}

fn composite(volume: &Volume, clip: &Clip) -> Scene {
    scene(volume, clip, ClipShading::default(), settings(Mode::Composite, volume))
}

fn every_mode_agrees_with_the_reference(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    for (name, clip) in clips(&volume) {
        for mode in Mode::ALL {
            let shading = ClipShading { overlay: 0.2, cap: true, ..ClipShading::default() };
            let scene = scene(&volume, &clip, shading, settings(mode, &volume));
            let what = format!("{name}, {}", mode.name());
            assert_close(&what, &reference::render(&scene), &image(renderer, &scene), CLIPPED);
        }
    }
}

fn every_impregnation_agrees_with_the_reference(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(31, 25, 27), 3);
    for (name, clip) in clips(&volume).into_iter().filter(|(name, _)| name.starts_with("cut by")) {
        for impregnation in [Impregnation::None, Impregnation::Step, Impregnation::Linear] {
            for thickness in [0.0, 2.0, 6.0] {
                let shading = ClipShading { impregnation, thickness, ..ClipShading::default() };
                let scene = scene(&volume, &clip, shading, settings(Mode::Composite, &volume));
                let what = format!("{name}, {impregnation:?}, {thickness} voxels");
                // The layer ends within a step.
                let tolerance = Tolerance { outliers: 0.08, ..CLIPPED };
                assert_close(&what, &reference::render(&scene), &image(renderer, &scene), tolerance);
            }
        }
    }
}

/// A minus A is empty, A or A is A, and the laws of De Morgan, pixel by pixel.
fn identities_of_sets_hold_pixel_by_pixel(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(29, 31, 23), 8);
    let (center, r) = middle(&volume);
    let a = ball(center, 0.5 * r, 3, EventFinder::Raster);
    let b = object(2, AxisBox::new(center - 0.3 * r, center + DVec3::new(0.5, 0.2, 0.3) * r).unwrap());
    let render = |clip: Clip| image(renderer, &composite(&volume, &clip));
    let not = |clip: &Clip| -> Clip { Node::Complement(Box::new(clip.clone())).into() };
    let union = |a: &Clip, b: &Clip| -> Clip { Node::Union(vec![a.clone(), b.clone()]).into() };
    let both = |a: &Clip, b: &Clip| -> Clip { Node::Intersection(vec![a.clone(), b.clone()]).into() };
    let minus = |a: &Clip, b: &Clip| -> Clip { Node::Difference(vec![a.clone(), b.clone()]).into() };
    for (what, a) in [("a mesh", &a), ("a box", &b)] {
        let empty = render(minus(a, a));
        assert!(empty.pixels().iter().all(|p| *p == [0.0; 4]), "{what} minus itself");
        assert_eq!(render(union(a, a)), render(a.clone()), "{what} or itself");
        assert_eq!(render(both(a, a)), render(a.clone()), "{what} and itself");
        assert!(render(both(a, &not(a))).pixels().iter().all(|p| *p == [0.0; 4]));
    }
    assert_eq!(render(not(&union(&a, &b))), render(both(&not(&a), &not(&b))));
    assert_eq!(render(not(&both(&a, &b))), render(union(&not(&a), &not(&b))));
    assert_eq!(render(minus(&a, &b)), render(both(&a, &not(&b))));
    let everything = render(union(&a, &not(&a)));
    let scene = composite(&volume, &Clip::everything());
    assert_close("a or not a", &image(renderer, &scene), &everything, CLIPPED);
}

fn a_moved_object_is_not_uploaded_again(renderer: &RaycastRenderer) {
    let volume = uniform(UVec3::splat(24), 1.0, DVec3::ONE);
    let (center, r) = middle(&volume);
    let mut clip = Clip::everything().cut(ball(center, 0.3 * r, 3, EventFinder::Raster));
    let mut scene = composite(&volume, &clip);
    let first = clip_statistics(renderer, &scene);
    assert!(first.uploaded > 0, "{first:?}");
    for step in 1..4 {
        let offset = DVec3::new(0.1, 0.0, 0.05) * r * f64::from(step);
        let pose = DAffine3::from_translation(center + offset) * DAffine3::from_scale(DVec3::splat(0.3 * r));
        assert!(clip.set_pose(ObjectId(7), Pose::new(pose).unwrap()));
        scene.set_clip(Some(&clip)).unwrap();
        let (moved, statistics) = raycast(&scene, renderer);
        assert_eq!(statistics.clip.uploaded, 0);
        assert_close("moved", &reference::render(&scene), &moved, CLIPPED);
    }
    // The same mesh twice is one mesh; another one is another, also after the first is gone.
    let twice = Clip::everything().cut(clip.clone());
    assert_eq!(clip_statistics(renderer, &composite(&volume, &twice)).uploaded, 0);
    drop((scene, clip, twice));
    let other = Clip::everything().cut(ball(center, 0.3 * r, 1, EventFinder::Raster));
    assert!(clip_statistics(renderer, &composite(&volume, &other)).uploaded > 0);
}

fn a_camera_inside_an_object_sees_what_is_left(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 2);
    let (center, r) = middle(&volume);
    let around = |radius: f64| ball(center, radius * r, 3, EventFinder::Raster);
    let nested: Clip = Node::Union(vec![around(0.3), around(0.2)]).into();
    for (what, clip) in [
        ("cut", Clip::everything().cut(around(0.3))),
        ("probed", Clip::everything().probe(around(0.5))),
        ("a shell", Clip::everything().probe(around(0.5)).cut(nested)),
        ("cut by a sphere", Clip::everything().cut(object(1, Sphere::new(center, 0.3 * r).unwrap()))),
    ] {
        let mut scene = composite(&volume, &clip);
        let mut camera = scene.camera().clone();
        camera.position = (center + DVec3::new(0.02, 0.01, -0.03) * r).to_array();
        camera.focal_point = (center + DVec3::new(1.0, 0.3, 0.2)).to_array();
        camera.view_angle = 80.0;
        scene.set_camera(camera).unwrap();
        let (image, statistics) = raycast(&scene, renderer);
        assert_close(&format!("{what}, from inside"), &reference::render(&scene), &image, CLIPPED);
        assert_eq!(statistics.clip.repaired, 0, "{what}");
    }
}

fn parallel_rays_begin_behind_the_eye(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 4);
    let (center, r) = middle(&volume);
    for (name, clip) in clips(&volume) {
        for inside in [false, true] {
            let mut scene = composite(&volume, &clip);
            let mut camera = scene.camera().clone();
            camera.orthographic = Some(0.8 * r);
            if inside {
                let forward = DVec3::from_array(camera.focal_point) - DVec3::from_array(camera.position);
                camera.position = center.to_array();
                camera.focal_point = (center + forward).to_array();
            }
            scene.set_camera(camera).unwrap();
            let (image, statistics) = raycast(&scene, renderer);
            let what = format!("{name}, parallel, inside {inside}");
            assert_close(&what, &reference::render(&scene), &image, CLIPPED);
            assert_eq!(statistics.clip.repaired, 0, "{what}");
        }
    }
}

fn limited_segments_agree_with_the_reference(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 2);
    for (name, clip) in clips(&volume) {
        for (count, backmost) in [(1, false), (1, true), (2, false), (2, true)] {
            let limited = cutaway_core::scene::RenderSettings {
                segments: SegmentCount::AtMost(NonZeroU32::new(count).unwrap()),
                backmost,
                ..settings(Mode::Composite, &volume)
            };
            let scene = scene(&volume, &clip, ClipShading::default(), limited);
            let what = format!("{name}, {count} segments, backmost {backmost}");
            assert_close(&what, &reference::render(&scene), &image(renderer, &scene), CLIPPED);
        }
    }
}

/// Thin plates across the view: rays cross far more surfaces than the sweep holds at once.
fn lists_of_any_length_are_swept(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 6);
    let (center, r) = middle(&volume);
    let plates = 60;
    let cube = shapes::cube();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for plate in 0..plates {
        let first = vertices.len() as u32;
        let y = (plate as f32 - 30.0) / 30.0;
        vertices.extend(cube.vertices().iter().map(|v| Vec3::new(v.x, y + v.y * 0.008, v.z)));
        triangles.extend(cube.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let solid = MeshSolid::new(Arc::new(mesh), EventFinder::Bvh);
    let pose = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(0.6 * r));
    let object = Clip::object(ObjectId(1), Arc::new(solid)).with_pose(Pose::new(pose).unwrap());
    for clip in [Clip::everything().probe(object.clone()), Clip::everything().cut(object)] {
        let scene = composite(&volume, &clip);
        let (image, statistics) = raycast(&scene, renderer);
        assert!(statistics.clip.crossings > 100_000, "{:?}", statistics.clip);
        assert_eq!(statistics.clip.repaired, 0);
        // Segments are shorter than a step.
        let tolerance = Tolerance { rmse: 0.006, outliers: 0.1, ..CLIPPED };
        assert_close("plates", &reference::render(&scene), &image, tolerance);
    }
}

/// More objects than a pixel's own memory holds.
fn expressions_of_any_size_are_evaluated(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 7);
    let (center, r) = middle(&volume);
    let sphere = |i: u32| {
        let turn = f64::from(i) * 2.399_963;
        let out = (f64::from(i) / 100.0).sqrt() * 0.8;
        let at = center + DVec3::new(turn.cos() * out, -0.3, turn.sin() * out) * r;
        object(i, Sphere::new(at, 0.1 * r).unwrap())
    };
    let pairs = (0..50).map(|i| Node::Union(vec![sphere(2 * i), sphere(2 * i + 1)]).into()).collect();
    let union: Clip = Node::Union(pairs).into();
    let mesh = ball(center, 0.3 * r, 2, EventFinder::Bvh);
    for clip in [Clip::everything().cut(union.clone()), Clip::everything().probe(union).cut(mesh)] {
        let scene = composite(&volume, &clip);
        assert_close("a hundred spheres", &reference::render(&scene), &image(renderer, &scene), CLIPPED);
    }
}

fn a_mirrored_object_is_cut_as_well(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(31, 25, 27), 9);
    let (center, r) = middle(&volume);
    let solid = MeshSolid::new(Arc::new(shapes::icosphere(2)), EventFinder::Bvh);
    let scale = DVec3::new(-0.5, 0.3, 0.4) * r;
    let pose = DAffine3::from_translation(center) * DAffine3::from_scale(scale);
    let object = Clip::object(ObjectId(1), Arc::new(solid)).with_pose(Pose::new(pose).unwrap());
    for clip in [Clip::everything().cut(object.clone()), Clip::everything().probe(object)] {
        let scene = composite(&volume, &clip);
        let (image, statistics) = raycast(&scene, renderer);
        assert_close("mirrored", &reference::render(&scene), &image, CLIPPED);
        assert_eq!(statistics.clip.repaired, 0);
    }
}

/// Without some of its triangles, an object is missing where its surface is; nothing beyond it is lost.
fn holes_cost_no_more_than_the_object(renderer: &RaycastRenderer) {
    let volume = oblique_noise(UVec3::new(31, 25, 27), 10);
    let (center, r) = middle(&volume);
    let whole = shapes::icosphere(3);
    let torn: Vec<[u32; 3]> =
        whole.triangles().iter().enumerate().filter(|(i, _)| i % 7 != 0).map(|(_, t)| *t).collect();
    let mesh = TriangleMesh::new(whole.vertices().to_vec(), torn).unwrap();
    let solid = MeshSolid::new(Arc::new(mesh), EventFinder::Bvh);
    let pose = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(0.4 * r));
    let object = Clip::object(ObjectId(1), Arc::new(solid)).with_pose(Pose::new(pose).unwrap());
    let twice = object.clone().with_pose(
        Pose::new(DAffine3::from_translation(center + 0.2 * r) * DAffine3::from_scale(DVec3::splat(0.4 * r)))
            .unwrap(),
    );
    let cut: Clip = Clip::everything().cut(object.clone());
    let either: Clip = Node::Union(vec![object, twice]).into();
    for clip in [cut, either] {
        let scene = composite(&volume, &clip);
        let (image, statistics) = raycast(&scene, renderer);
        assert!(statistics.clip.repaired > 0);
        // Which pixels a hole's edge covers, two finders may see differently.
        let tolerance = Tolerance { rmse: 0.02, bias: 0.003, ..CLIPPED };
        assert_close("torn", &reference::render(&scene), &image, tolerance);
    }
}

/// A solid of a kind that only its own program knows.
#[derive(Debug)]
struct Unknown(Sphere);

impl Solid for Unknown {
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        self.0.events(ray_in_object, events);
    }

    fn normal(&self, surface: u32, point_in_object: DVec3) -> DVec3 {
        self.0.normal(surface, point_in_object)
    }

    fn bounds(&self) -> [DVec3; 2] {
        self.0.bounds()
    }
}

fn solids_of_other_kinds_are_refused(renderer: &RaycastRenderer) {
    let volume = uniform(UVec3::splat(8), 1.0, DVec3::ONE);
    let unknown = Unknown(Sphere::new(DVec3::ZERO, 1.0).unwrap());
    let scene = composite(&volume, &Clip::everything().cut(object(5, unknown)));
    let prepared = renderer.prepare(&volume).unwrap();
    let classification = renderer.classify(&prepared, &scene).unwrap();
    let refused = renderer.render(&prepared, &classification, &scene, &|_| {}).map(|_| ());
    assert_eq!(refused, Err(GpuError::UnknownSolid { object: 5 }));
}
