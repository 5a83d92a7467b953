//! A scene that is moved as a whole, up to 10,000,000 units from the origin, with a clip mesh that is read from a file
//! there: its image stays the same, in every engine.
//!
//! Without an adapter the tests of the GPU engines show as ignored.

use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::clip::{Clip, ClipEvents, ClipShading, Pose};
use cutaway_core::glam::{DAffine3, DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_cpu::SimdChoice;
use cutaway_gpu::{Gpu, GpuOptions, RaycastRenderer, SliceRenderer};
use cutaway_io::mesh::{MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::MemoryFolder;
use cutaway_mesh::{EventFinder, MeshSolid, RepairOptions, repair, shapes};
use cutaway_testing::clips::object;
use cutaway_testing::engines::{cpu, raycast, slices};
use cutaway_testing::scenes::soft;
use libtest_mimic::{Arguments, Failed, Trial};

type Render = fn(&Scene) -> Image;

/// Engines, and whether each needs an adapter.
const ENGINES: &[(&str, bool, Render)] = &[
    ("reference", false, |scene| reference::render(scene)),
    ("cpu", false, |scene| cpu(scene, SimdChoice::Auto, 1).0),
    ("raycast", true, |scene| raycast(scene, &RaycastRenderer::new(&gpu()).unwrap()).0),
    ("slices", true, |scene| slices(scene, &SliceRenderer::new(&gpu()).unwrap()).0),
];

pub(crate) fn main() {
    let arguments = Arguments::from_args();
    let there = Gpu::new(&GpuOptions::default()).is_ok();
    let trials = ENGINES.iter().map(|&(name, gpu, render)| {
        let run = move || -> Result<(), Failed> {
            stays_the_same(name, gpu, render);
            Ok(())
        };
        Trial::test(format!("report_40_{name}_shows_the_same_wherever_the_scene_is"), run)
            .with_ignored_flag(gpu && !there)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

fn gpu() -> Gpu {
    Gpu::new(&GpuOptions::default()).unwrap()
}

/// Steps away from the origin: up to 1e7, along axes and askew, none of them whole in binary.
const PLACES: [[f64; 3]; 6] = [
    [500_000.3, 5_400_000.7, 250.1],
    [-9_999_999.9, 0.0, 0.0],
    [0.1, -0.2, 10_000_000.3],
    [1e7, -1e7, 1e7],
    [-77_777.7, 1_234_567.8, -3_141.5],
    [1_000.1, 2_000.2, -3_000.3],
];

fn stays_the_same(name: &str, gpu: bool, render: Render) {
    let kinds = [ClipKind::File, ClipKind::Moved];
    for (kind, events) in
        kinds.into_iter().zip([ClipEvents::Auto, if gpu { ClipEvents::Peel } else { ClipEvents::Bvh }])
    {
        let expected = render(&scene(DVec3::ZERO, kind, events));
        let covered = expected.pixels().iter().filter(|p| p[3] > 0.1).count();
        assert!(covered > 100, "{name}: {covered} pixels show something");
        for place in PLACES {
            let found = render(&scene(place.into(), kind, events));
            let rmse = rmse(&expected, &found);
            // Pixels on the border of a cut may differ by rounding.
            assert!(rmse < 0.004, "{name}, {kind:?} at {place:?}: RMSE {rmse}");
        }
    }
}

fn rmse(a: &Image, b: &Image) -> f64 {
    let squares = a.pixels().as_flattened().iter().zip(b.pixels().as_flattened());
    let sum: f64 = squares.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (sum / (4 * a.pixels().len()) as f64).sqrt()
}

/// How the mesh comes to its place.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ClipKind {
    /// Its file has the coordinates of the place.
    File,
    /// A pose moves it there.
    Moved,
}

/// A block with a cube of 0.9 and a sphere cut out, both meshes.
fn scene(at: DVec3, kind: ClipKind, events: ClipEvents) -> Scene {
    let dimensions = UVec3::new(13, 11, 9);
    let geometry = Geometry::from_spacing(DVec3::new(0.3, 0.4, 0.5));
    let geometry =
        Geometry { world_from_voxel: DAffine3::from_translation(at) * geometry.world_from_voxel, ..geometry };
    let voxels = (0..dimensions.element_product()).map(|i| (i * 7919 % 101) as f32).collect::<Vec<_>>();
    let volume = Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry).unwrap();
    let cube = shapes::cube();
    let corner = |v: u32| cube.position(v) * DVec3::new(0.9, 1.1, 0.7) + DVec3::new(1.1, 1.7, 0.4);
    let solid = match kind {
        ClipKind::File => mesh_of(&cube, |v| corner(v) + at),
        ClipKind::Moved => {
            mesh_of(&cube, corner).with_pose(Pose::new(DAffine3::from_translation(at)).unwrap())
        }
    };
    let middle = volume.center_in_world();
    let camera = Camera::framing(&volume.corners_in_world(), DVec3::new(0.4, 0.6, 0.5), DVec3::Z, 1.0, 1.0);
    let camera = Camera { focal_point: middle.to_array(), ..camera };
    let settings = RenderSettings {
        mode: Mode::Composite,
        step: 0.5,
        resolution: [61, 61],
        clip_events: events,
        ..RenderSettings::default()
    };
    let function = soft(volume.value_range());
    let layer = Layer::new(volume, &function).with_lighting(Lighting::default());
    let scene = Scene::new(layer, camera, settings).unwrap();
    scene.with_clip(&Clip::everything().cut(solid), ClipShading::default()).unwrap()
}

/// The mesh, written as OBJ with other vertices and read again.
fn mesh_of(mesh: &cutaway_mesh::TriangleMesh, position: impl Fn(u32) -> DVec3) -> Clip {
    let mut text = String::new();
    for vertex in 0..mesh.vertices().len() as u32 {
        let p = position(vertex);
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for [a, b, c] in mesh.triangles() {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    let read = read_mesh_bytes("a.obj", text.as_bytes(), &MemoryFolder::new(), &MeshReadOptions::default());
    let closed = repair(&read.unwrap().value, &RepairOptions::default()).unwrap().mesh.into_mesh();
    object(1, MeshSolid::new(Arc::new(closed), EventFinder::Raster))
}
