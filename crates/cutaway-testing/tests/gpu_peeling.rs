//! Depth peeling on the GPU: layers against the CPU's events, images against those of event lists and of the reference.
//!
//! Without an adapter the tests show as ignored.

use std::num::NonZeroU32;
use std::sync::Arc;

use cutaway_core::camera::intersect_box;
use cutaway_core::clip::{
    BufferDepth, Clip, ClipEvents, ClipShading, Crossing, Event, Node, ObjectId, Pose, SegmentCount,
};
use cutaway_core::glam::{DAffine3, DMat3, DVec3, UVec3, Vec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene};
use cutaway_core::volume::Volume;
use cutaway_gpu::{ClipLayer, GpuError, PeelSettings, RaycastRenderer, RaycastStatistics};
use cutaway_mesh::{EventFinder, MeshSolid, PixelEvents, TileEvents, TileRect, TriangleMesh, shapes};
use cutaway_testing::gpus;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, soft};
use cutaway_testing::tolerances::{Tolerance, assert_close};
use libtest_mimic::{Arguments, Failed, Trial};

/// What a test does with a renderer.
type Check = fn(&RaycastRenderer);

const CHECKS: &[(&str, Check)] = &[
    ("layers_are_the_crossings_of_the_mesh", layers_are_the_crossings_of_the_mesh),
    ("peeled_images_are_those_of_lists", peeled_images_are_those_of_lists),
    ("limited_segments_need_as_many_layers", limited_segments_need_as_many_layers),
    ("a_camera_inside_the_mesh_is_inside", a_camera_inside_the_mesh_is_inside),
    ("several_objects_are_peeled_apart", several_objects_are_peeled_apart),
    ("coincident_triangles_are_peeled_one_by_one", coincident_triangles_are_peeled_one_by_one),
    ("half_precision_is_off_by_its_bound", half_precision_is_off_by_its_bound),
    ("peeling_goes_on_until_next_to_nothing_is_left", peeling_goes_on_until_next_to_nothing_is_left),
    ("more_layers_than_there_can_be_are_refused", more_layers_than_there_can_be_are_refused),
];

pub(crate) fn main() {
    let arguments = Arguments::from_args();
    let there = gpus::there_is_an_adapter();
    let trials = CHECKS.iter().map(|&(name, check)| {
        let run = move || -> Result<(), Failed> {
            check(&RaycastRenderer::new(gpus::best()?.gpu())?);
            Ok(())
        };
        Trial::test(name, run).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

/// The bound of the project for GPU engines at a quarter of a voxel.
const CLIPPED: Tolerance = Tolerance { rmse: 0.004, bias: 0.001, outliers: 0.05 };

/// Pixels in which two rasterisations, or a rasterisation and exact lines, may see different triangles: those whose centre an
/// outline passes within 1/256 of a pixel, which is what rasterisers round corners to. Outlines are a few hundred pixels long.
const SILHOUETTE: f64 = 0.01;

fn volume() -> Volume {
    oblique_noise(UVec3::new(37, 25, 19), 11)
}

/// Where a volume is, and half its diagonal.
fn middle(volume: &Volume) -> (DVec3, f64) {
    let [first, .., last] = volume.corners_in_world();
    (volume.center_in_world(), 0.5 * first.distance(last))
}

/// Copies of a mesh, each scaled and moved, in one mesh.
fn copies(of: &TriangleMesh, places: &[(f32, Vec3)]) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (scale, offset) in places {
        let first = vertices.len() as u32;
        vertices.extend(of.vertices().iter().map(|v| *v * *scale + *offset));
        triangles.extend(of.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Balls in a row along a view from the side, none of which meets another.
fn balls(count: usize) -> TriangleMesh {
    let place = |i: usize| (2.0 * i as f32 + 1.0) / count as f32 - 1.0;
    let places: Vec<(f32, Vec3)> =
        (0..count).map(|i| (0.8 / count as f32, Vec3::new(0.4, 0.8, -0.3) * place(i))).collect();
    copies(&shapes::icosphere(3), &places)
}

fn object(id: u32, mesh: TriangleMesh, pose: DAffine3) -> Clip {
    let solid = MeshSolid::new(Arc::new(mesh), EventFinder::Raster);
    Clip::object(ObjectId(id), Arc::new(solid)).with_pose(Pose::new(pose).unwrap())
}

/// In the middle of a volume, `size` times its half diagonal large, turned so that rays enter and leave more than once.
fn pose(volume: &Volume, size: f64) -> DAffine3 {
    let (center, r) = middle(volume);
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 0.2, 0.1).normalize(), 0.3);
    DAffine3::from_translation(center)
        * DAffine3::from_mat3(turn)
        * DAffine3::from_scale(DVec3::splat(size * r))
}

/// One mesh each.
fn objects(volume: &Volume) -> Vec<(&'static str, Clip)> {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.2));
    vec![
        ("a ball", object(1, shapes::icosphere(3), pose(volume, 0.5))),
        ("a torus", object(1, shapes::torus(0.3, 60, 30), pose(volume, 0.5))),
        ("a mirrored torus", object(1, shapes::torus(0.25, 60, 30), pose(volume, 0.5) * mirror)),
        ("three balls", object(1, balls(3), pose(volume, 0.6))),
        ("seven balls, larger than the volume", object(1, balls(7), pose(volume, 1.5))),
    ]
}

fn settings() -> RenderSettings {
    RenderSettings {
        step: 0.25,
        resolution: SMALL,
        clip_events: ClipEvents::Peel,
        ..RenderSettings::default()
    }
}

fn limited(count: u32, backmost: bool) -> RenderSettings {
    let count = NonZeroU32::new(count).map_or(SegmentCount::Auto, SegmentCount::AtMost);
    RenderSettings { segments: count, backmost, ..settings() }
}

fn scene(volume: &Volume, clip: &Clip, settings: RenderSettings) -> Scene {
    let scene = framed(volume, &soft(volume.value_range()), Lighting::default(), settings);
    scene.with_clip(clip, ClipShading::default()).unwrap()
}

fn render(renderer: &RaycastRenderer, scene: &Scene) -> Result<(Image, RaycastStatistics), GpuError> {
    let volume = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&volume, scene)?;
    renderer.render(&volume, &classification, scene, &|_| {})
}

/// The same scene by event lists.
fn listed(scene: &Scene, clip: &Clip) -> Scene {
    let settings = RenderSettings { clip_events: ClipEvents::Lists, ..scene.settings().clone() };
    let (function, unit) = (scene.transfer_function(), Some(scene.unit_distance()));
    let (camera, lighting) = (scene.camera().clone(), scene.lighting().clone());
    let listed = Scene::new(
        Layer::new(scene.volume().clone(), function).with_unit_distance(unit).with_lighting(lighting),
        camera,
        settings,
    );
    listed.and_then(|listed| listed.with_clip(clip, scene.clip_shading().clone())).unwrap()
}

/// From the eye, parallel, and from within the volume.
fn look(scene: &mut Scene, how: usize) {
    let (center, r) = middle(scene.volume());
    let mut camera = scene.camera().clone();
    match how {
        0 => {}
        1 => camera.orthographic = Some(0.8 * r),
        _ => {
            camera.position = (center + DVec3::new(0.02, 0.01, -0.03) * r).to_array();
            camera.focal_point = (center + DVec3::new(1.0, 0.3, 0.2)).to_array();
            camera.view_angle = 80.0;
        }
    }
    scene.set_camera(camera).unwrap();
}

/// The events of a pixel within the volume, of one sense, and where the volume is.
fn expected(scene: &Scene, events: &[Event], x: u32, y: u32, crossing: Crossing) -> (Vec<Event>, [f64; 2]) {
    let (width, height) = scene.resolution();
    let ray = scene.camera().rays(width, height).pixel(x, y);
    let m = scene.volume().voxel_from_world();
    let (origin, direction) = (m.transform_point3(ray.origin), m.transform_vector3(ray.direction));
    let Some(range) = intersect_box(origin, direction, scene.volume().extent()) else {
        return (Vec::new(), [0.0; 2]);
    };
    let (near, far) = (range.t_near(), range.t_far());
    let within = |e: &&Event| e.crossing == crossing && e.t > near && e.t < far;
    (events.iter().filter(within).copied().collect(), [near, far])
}

/// Of layers against events: pixels that differ in their number; and of the others, where rays are not nearly along the
/// surface, the largest difference of places, in parts of half the volume's diagonal, and of normals.
#[derive(Debug, Default)]
struct Differences {
    other_count: usize,
    crossings: usize,
    /// How many are further off than rounding makes them: on the plane of the triangle beside the one that the line meets,
    /// where a rasteriser rounded a corner.
    beside: usize,
    t: f64,
    normal: f64,
}

impl Differences {
    fn assert_small(&self, what: &str, normal: f64, t: f64) {
        let pixels = f64::from(SMALL[0] * SMALL[1]);
        assert!(self.crossings > 150, "{what}: {self:?}");
        assert!(self.other_count as f64 <= SILHOUETTE * pixels, "{what}: {self:?}");
        assert!(self.beside as f64 <= SILHOUETTE * self.crossings as f64, "{what}: {self:?}");
        assert!(self.t <= t && self.normal <= normal, "{what}: {self:?}");
    }
}

/// Rounding of f32, in parts of half the volume's diagonal: as in the sweep's tolerance for coincident events.
const SAME_PLACE: f64 = 4e-6;

/// A corner may be rounded by 1/256 of a pixel, and a pixel is a twentieth of the volume wide; along the ray that is at most
/// five times as much where its cosine with the surface is 0.2.
const BESIDE: f64 = 5.0 / 256.0 / 20.0;

/// `rounding`: what else places are rounded by, in parts of the ray's way through the volume.
fn differences(scene: &Scene, layers: &[ClipLayer], rounding: f64) -> Differences {
    let (width, height) = scene.resolution();
    let leaf = &scene.clip().unwrap().leaves()[0];
    let any: &dyn std::any::Any = leaf.solid.as_ref();
    let solid = any.downcast_ref::<MeshSolid>().unwrap();
    let rays = scene.camera().rays(width, height);
    let frame = solid.frame(&rays, leaf.object_from_world(), width, height);
    let mut tile = TileEvents::new();
    frame.tile(TileRect { x: 0, y: 0, width, height }, &mut tile);
    let (_, r) = middle(scene.volume());
    let mut found = Differences::default();
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let i = (y * width + x) as usize;
        for crossing in [Crossing::Entering, Crossing::Leaving] {
            let (events, [near, far]) = expected(scene, tile.pixel(x, y), x, y, crossing);
            let of_kind = layers.iter().filter(|layer| layer.crossing == crossing);
            let peeled: Vec<(f64, DVec3)> = of_kind
                .filter(|layer| !layer.t[i].is_nan())
                .map(|layer| (f64::from(layer.t[i]), layer.normals[i].as_dvec3()))
                .collect();
            if peeled.len() != events.len() {
                found.other_count += 1;
                continue;
            }
            assert!(peeled.windows(2).all(|pair| pair[0].0 <= pair[1].0), "layers are in order");
            let ray = rays.pixel(x, y);
            for ((t, normal), event) in peeled.into_iter().zip(&events) {
                let there = ray.origin + ray.direction * event.t;
                let outward = leaf.normal_in_world(event.surface, there);
                if outward.dot(ray.direction).abs() < 0.2 {
                    continue;
                }
                found.crossings += 1;
                let off = (t - event.t).abs();
                found.t = found.t.max(off / r);
                found.beside += usize::from(off > SAME_PLACE * r + rounding * (far - near));
                found.normal = found.normal.max(normal.distance(outward));
            }
        }
    }
    found
}

fn layers_are_the_crossings_of_the_mesh(renderer: &RaycastRenderer) {
    let volume = volume();
    renderer.set_peeling(PeelSettings { tolerance: 0.0 });
    for (name, object) in objects(&volume) {
        for how in 0..3 {
            let clip = Clip::everything().probe(object.clone());
            let mut scene = scene(&volume, &clip, settings());
            look(&mut scene, how);
            render(renderer, &scene).unwrap();
            let found = differences(&scene, &renderer.peeled_layers(&scene).unwrap(), 0.0);
            // Normals are kept in twice 16 bits.
            found.assert_small(&format!("{name}, view {how}"), 1e-3, BESIDE);
        }
    }
}

/// Peeled against listed and against the reference.
fn assert_alike(renderer: &RaycastRenderer, what: &str, scene: &Scene, clip: &Clip) {
    let (peeled, statistics) = render(renderer, scene).unwrap();
    assert!(statistics.clip.layers > 0 && statistics.clip.repaired == 0, "{what}: {:?}", statistics.clip);
    let (listed, _) = render(renderer, &listed(scene, clip)).unwrap();
    let differs = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-4);
    let different = peeled.pixels().iter().zip(listed.pixels()).filter(|(a, b)| differs((a, b))).count();
    let share = different as f64 / peeled.pixels().len() as f64;
    assert!(share <= SILHOUETTE, "{what}: {different} pixels differ from those of lists");
    assert_close(what, &reference::render(scene), &peeled, CLIPPED);
}

fn cut_and_probe(object: &Clip) -> [(&'static str, Clip); 2] {
    [("cut", Clip::everything().cut(object.clone())), ("probed", Clip::everything().probe(object.clone()))]
}

fn peeled_images_are_those_of_lists(renderer: &RaycastRenderer) {
    let volume = volume();
    let [lo, hi] = volume.value_range();
    for (name, object) in objects(&volume) {
        for (operation, clip) in cut_and_probe(&object) {
            for mode in [Mode::Composite, Mode::Iso, Mode::Mip] {
                let iso = if mode == Mode::Iso { vec![lo + 0.6 * (hi - lo)] } else { vec![] };
                let scene = scene(&volume, &clip, RenderSettings { mode, iso, ..settings() });
                let what = format!("{operation} by {name}, {}", mode.name());
                assert_alike(renderer, &what, &scene, &clip);
            }
        }
    }
}

fn limited_segments_need_as_many_layers(renderer: &RaycastRenderer) {
    let volume = volume();
    for (name, object) in objects(&volume) {
        for (operation, clip) in cut_and_probe(&object) {
            for (count, backmost) in [(1, false), (1, true), (2, false), (2, true), (5, true), (6, false)] {
                for how in 0..3 {
                    let mut scene = scene(&volume, &clip, limited(count, backmost));
                    look(&mut scene, how);
                    let what = format!("{operation} by {name}, {count} segments, backmost {backmost}, {how}");
                    assert_alike(renderer, &what, &scene, &clip);
                    let layers = renderer.peeled_layers(&scene).unwrap().len();
                    assert!(layers <= 2 * count as usize, "{what}: {layers} layers");
                }
            }
        }
    }
}

fn a_camera_inside_the_mesh_is_inside(renderer: &RaycastRenderer) {
    let volume = volume();
    for (name, mesh) in [("a ball", shapes::icosphere(3)), ("shells", shells())] {
        let object = object(1, mesh, pose(&volume, 0.5));
        for (operation, clip) in cut_and_probe(&object) {
            let mut scene = scene(&volume, &clip, settings());
            look(&mut scene, 2);
            assert_alike(renderer, &format!("{operation} by {name}, from inside"), &scene, &clip);
        }
    }
}

/// Three balls, each within the next: a winding number of 3.
fn shells() -> TriangleMesh {
    copies(&shapes::icosphere(3), &[(1.0, Vec3::ZERO), (0.7, Vec3::ZERO), (0.4, Vec3::ZERO)])
}

fn several_objects_are_peeled_apart(renderer: &RaycastRenderer) {
    let volume = volume();
    let torus = object(1, shapes::torus(0.3, 60, 30), pose(&volume, 0.5));
    let row = object(2, balls(3), pose(&volume, 0.7));
    let (center, r) = middle(&volume);
    let sphere = cutaway_core::clip::Sphere::new(center, 0.5 * r).unwrap();
    let sphere = Clip::object(ObjectId(3), Arc::new(sphere));
    let union: Clip = Node::Union(vec![torus.clone(), row.clone()]).into();
    for (name, clip) in [
        ("cut by both", Clip::everything().cut(union)),
        ("probed, then cut", Clip::everything().probe(sphere).cut(torus).cut(row)),
    ] {
        for (count, backmost) in [(0, false), (1, false), (2, true)] {
            let scene = scene(&volume, &clip, limited(count, backmost));
            assert_alike(renderer, &format!("{name}, {count} segments, {backmost}"), &scene, &clip);
        }
    }
}

fn coincident_triangles_are_peeled_one_by_one(renderer: &RaycastRenderer) {
    let volume = volume();
    let doubled = copies(&shapes::icosphere(2), &[(1.0, Vec3::ZERO), (1.0, Vec3::ZERO)]);
    for (operation, clip) in cut_and_probe(&object(1, doubled, pose(&volume, 0.5))) {
        let scene = scene(&volume, &clip, settings());
        assert_alike(renderer, &format!("{operation} by a doubled ball"), &scene, &clip);
        let layers = renderer.peeled_layers(&scene).unwrap();
        let covered = |layer: &ClipLayer| layer.t.iter().filter(|t| !t.is_nan()).count();
        let entering: Vec<usize> =
            layers.iter().filter(|l| l.crossing == Crossing::Entering).map(covered).collect();
        assert!(entering[0] > 300 && entering[0] == entering[1], "{entering:?}");
        assert!(entering[2..].iter().all(|n| *n == 0), "{entering:?}");
    }
}

fn half_precision_is_off_by_its_bound(renderer: &RaycastRenderer) {
    let volume = volume();
    let half = || RenderSettings { buffer_depth: BufferDepth::Half, ..settings() };
    for (name, object) in objects(&volume) {
        let clip = Clip::everything().probe(object.clone());
        for how in 0..3 {
            let mut scene = scene(&volume, &clip, half());
            look(&mut scene, how);
            let (image, statistics) = render(renderer, &scene).unwrap();
            // Twice what rounding to the nearest is off by: adapters may round towards zero.
            let rounding = 1.0 / 4096.0;
            let found = differences(&scene, &renderer.peeled_layers(&scene).unwrap(), rounding);
            found.assert_small(&format!("{name}, view {how}, 16 bits"), 4e-3, BESIDE + 2.0 * rounding);
            assert_eq!(statistics.clip.repaired, 0);
            assert_close(&format!("{name}, 16 bits"), &reference::render(&scene), &image, CLIPPED);
        }
    }
}

/// Thin plates across the view.
fn plates(count: usize) -> TriangleMesh {
    let place = |i: usize| (2.0 * i as f32 + 1.0) / count as f32 - 1.0;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let cube = shapes::cube();
    for plate in 0..count {
        let first = vertices.len() as u32;
        let thin = Vec3::new(1.0, 0.5 / count as f32, 1.0);
        vertices.extend(cube.vertices().iter().map(|v| *v * thin + Vec3::Y * place(plate)));
        triangles.extend(cube.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

fn peeling_goes_on_until_next_to_nothing_is_left(renderer: &RaycastRenderer) {
    let volume = volume();
    let clip = Clip::everything().probe(object(1, plates(20), pose(&volume, 0.3)));
    let scene = scene(&volume, &clip, settings());
    renderer.set_peeling(PeelSettings { tolerance: 1.0 });
    let first = render(renderer, &scene).unwrap().1.clip;
    assert_eq!(first.layers, 8, "a guess");
    renderer.set_peeling(PeelSettings::default());
    assert_alike(renderer, "plates", &scene, &clip);
    let all = render(renderer, &scene).unwrap().1.clip;
    // 20 of each kind, and one that shows that there is no other.
    assert!((40..=42).contains(&all.layers), "{all:?}");
    assert!(all.segments > first.segments);
    // What moves on needs no second try.
    assert_eq!(render(renderer, &scene).unwrap().1.clip.layers, all.layers);
}

fn more_layers_than_there_can_be_are_refused(renderer: &RaycastRenderer) {
    let volume = volume();
    renderer.set_peeling(PeelSettings { tolerance: 0.0 });
    let clip = Clip::everything().probe(object(1, plates(150), pose(&volume, 0.3)));
    let error = render(renderer, &scene(&volume, &clip, settings())).unwrap_err();
    assert!(matches!(error, GpuError::TooManyLayers { .. }), "{error}");
    assert!(error.to_string().contains("--clip-events lists"), "{error}");
    // A limit of segments is one of layers.
    render(renderer, &scene(&volume, &clip, limited(3, false))).unwrap();
}
