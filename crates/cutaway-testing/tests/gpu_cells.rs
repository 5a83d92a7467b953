//! The cell renderer against the reference: real volumes, cut and not, lit and not, in perspective and not; and meshes of
//! tetrahedra against an exact walk along rays.
//!
//! Its field is linear in each tetrahedron and not trilinear, so it is near to the reference and not the same: the bound is
//! wider than that of ray casters, and a finer grid must come nearer. A test whose volume is not there shows as ignored, and
//! so do all where there is no adapter. `cargo test -p cutaway-testing --test gpu_cells -- --nocapture` prints the errors.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use cutaway_core::clip::{Clip, ClipShading, Impregnation, Node, ObjectId, Sphere};
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::histogram::default_for_mode;
use cutaway_core::image::Image;
use cutaway_core::image::compare::{Comparison, compare};
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, SceneError, default_camera};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_gpu::cells::{CellDrawing, CellIntegral, CellOptions, CellRenderer, CellStatistics, Split};
use cutaway_gpu::context::Fallbacks;
use cutaway_gpu::{Gpu, GpuError, GpuOptions};
use cutaway_testing::gpus::there_is_an_adapter;
use cutaway_testing::real::{FILES, SAMPLES, is_there, read};
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point, soft};
use cutaway_testing::tetrahedra::render as walk;
use libtest_mimic::{Arguments, Failed, Trial};

/// Real volumes: linear tetrahedra against a trilinear field.
const LARGEST_RMSE: f64 = 0.008;

/// A brightening or darkening of any channel on real volumes.
const LARGEST_BIAS: f64 = 0.002;

/// Against the exact walk through the same tetrahedra, in right order: rounding of places to 1/256 of a pixel by the
/// rasteriser, of extinction by parabolas, of where colour comes from within a stretch.
const SAME_FIELD: f64 = 0.001;

/// The same where centroids put the tetrahedra in order, whose sizes and shapes differ much.
const BY_CENTROIDS: f64 = 0.004;

const SIZE: [u32; 2] = [67, 49];

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
    let others: [(&str, Check); 11] = [
        ("a_finer_grid_comes_nearer", a_finer_grid_comes_nearer),
        ("every_view_split_and_integral_agree", every_view_split_and_integral_agree),
        ("a_linear_field_is_exact", a_linear_field_is_exact),
        ("a_mesh_is_what_the_walk_finds", a_mesh_is_what_the_walk_finds),
        ("a_mesh_of_uneven_cells_is_near_to_the_walk", a_mesh_of_uneven_cells_is_near_to_the_walk),
        ("an_eye_inside_sees_its_surroundings", an_eye_inside_sees_its_surroundings),
        ("an_eye_inside_a_mesh_sees_what_the_walk_finds", an_eye_inside_a_mesh_sees_what_the_walk_finds),
        ("tiles_and_triangles_agree", tiles_and_triangles_agree),
        ("clips_cut_cells_open", clips_cut_cells_open),
        ("targets_of_16_bits_are_near", targets_of_16_bits_are_near),
        ("other_modes_are_refused", other_modes_are_refused),
    ];
    trials.extend(others.map(|(name, test)| Trial::test(name, test).with_ignored_flag(!there)));
    libtest_mimic::run(&arguments, trials).exit();
}

/// Pipelines are made once a set of options.
fn renderer(options: CellOptions, fallbacks: &Fallbacks) -> Result<Arc<CellRenderer>, GpuError> {
    type Made = Vec<(CellOptions, Fallbacks, Arc<CellRenderer>)>;
    static MADE: OnceLock<Mutex<Made>> = OnceLock::new();
    let mut made = MADE.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((.., there)) = made.iter().find(|(o, f, _)| *o == options && f == fallbacks) {
        return Ok(there.clone());
    }
    let gpu = match made.iter().find(|(_, f, _)| f == fallbacks) {
        Some((.., there)) => there.gpu().clone(),
        None => Gpu::new(&GpuOptions { fallbacks: fallbacks.clone(), ..GpuOptions::default() })?,
    };
    let renderer = Arc::new(CellRenderer::new(&gpu, options)?);
    made.push((options, fallbacks.clone(), renderer.clone()));
    Ok(renderer)
}

fn plain() -> Result<Arc<CellRenderer>, GpuError> {
    renderer(CellOptions::default(), &Fallbacks::default())
}

fn drawn(renderer: &CellRenderer, scene: &Scene) -> Result<(Image, CellStatistics), GpuError> {
    let prepared = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&prepared, scene)?;
    renderer.render(&prepared, &classification, scene, &|_| {})
}

fn drawn_mesh(renderer: &CellRenderer, mesh: &TetrahedralMesh, scene: &Scene) -> Result<Image, GpuError> {
    let prepared = renderer.prepare_mesh(mesh)?;
    let classification = renderer.classify(&prepared, scene)?;
    Ok(renderer.render(&prepared, &classification, scene, &|_| {})?.0)
}

fn bias(c: &Comparison) -> f64 {
    c.bias.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a })
}

/// An error with all numbers where two images are too far apart.
fn near(what: &str, expected: &Image, actual: &Image, rmse: f64) -> Result<f64, Failed> {
    let c = compare(expected, actual)?;
    println!("| {what} | {:.5} | {:+.5} | {:.3} |", c.rmse, bias(&c), c.largest_difference);
    if c.exceeds(rmse) || bias(&c).abs() > LARGEST_BIAS.min(rmse) {
        return Err(format!("{what}: {c}; at most {rmse}").into());
    }
    Ok(c.rmse)
}

/// Cut, lit and seen in perspective in turn, so that each has been with and without each other.
fn real_volume(name: &str) -> Result<(), Failed> {
    let volume = read(name)?;
    let renderer = plain()?;
    let prepared = renderer.prepare(&volume)?;
    let all = [(true, false, false), (false, true, true), (false, false, true), (true, true, false)];
    // Samples in all four ways, larger volumes in the first two.
    let ways = if SAMPLES.contains(&name) { &all[..] } else { &all[..2] };
    for &(shade, cut, parallel) in ways {
        let settings = RenderSettings { resolution: SIZE, ..RenderSettings::default() };
        let mut camera = default_camera(&volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
        let [lo, .., hi] = volume.corners_in_world();
        if parallel {
            camera.orthographic = Some(0.4 * lo.distance(hi));
        }
        let lighting = Lighting { shade, ..Lighting::default() };
        let function = default_for_mode(&volume, Mode::Composite);
        let mut scene =
            Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings)?;
        if cut {
            scene = scene.with_clip(&ball_cut(hi, 0.35 * lo.distance(hi)), ClipShading::default())?;
        }
        let classification = renderer.classify(&prepared, &scene)?;
        let (image, statistics) = renderer.render(&prepared, &classification, &scene, &|_| {})?;
        assert!(statistics.drawn > 0 && statistics.drawn <= statistics.nominal);
        let what = format!("{name}, lit {shade}, cut {cut}, parallel {parallel}");
        near(&what, &reference::render(&scene), &image, LARGEST_RMSE)?;
    }
    Ok(())
}

/// Everything but a ball.
fn ball_cut(center: DVec3, radius: f64) -> Clip {
    let ball = Clip::object(ObjectId(1), Arc::new(Sphere::new(center, radius).expect("a radius")));
    Node::Difference(vec![Clip::everything(), ball]).into()
}

/// A smooth field on a grid of so many voxels a side, over the same box.
fn waves(side: u32) -> Volume {
    let at = |i: u32| f64::from(i) / f64::from(side - 1) * 2.0 - 1.0;
    let mut voxels = Vec::new();
    for k in 0..side {
        for j in 0..side {
            for i in 0..side {
                let p = DVec3::new(at(i), at(j), at(k));
                voxels.push(((3.0 * p.x).sin() * (2.0 * p.y + 1.0).cos() + p.z * p.length()) as f32);
            }
        }
    }
    let geometry = Geometry::from_spacing(DVec3::splat(16.0 / f64::from(side - 1)));
    Volume::new(UVec3::splat(side), voxels, Rescale::IDENTITY, geometry).expect("a valid volume")
}

fn wave_scene(volume: &Volume) -> Result<Scene, SceneError> {
    let settings = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    let camera = default_camera(volume, f64::from(SMALL[0]) / f64::from(SMALL[1]));
    let lighting = Lighting { shade: false, ..Lighting::default() };
    Scene::new(
        Layer::new(volume.clone(), &soft([-1.7, 1.7])).with_unit_distance(Some(1.0)).with_lighting(lighting),
        camera,
        settings,
    )
}

/// The reference takes its field from a fine grid, cells come from coarser ones.
fn a_finer_grid_comes_nearer() -> Result<(), Failed> {
    let renderer = plain()?;
    let fine = waves(97);
    let right = reference::render(&wave_scene(&fine)?);
    let mut last = f64::INFINITY;
    for side in [7, 13, 25, 49] {
        let volume = waves(side);
        let (image, _) = drawn(&renderer, &wave_scene(&volume)?)?;
        let c = compare(&right, &image)?;
        println!("| {side} voxels a side | {:.6} |", c.rmse);
        // Second order would be a quarter.
        if c.rmse > 0.4 * last {
            return Err(format!("{side} voxels a side: rmse {}, before {last}", c.rmse).into());
        }
        last = c.rmse;
    }
    Ok(())
}

fn small_scene(volume: &Volume, shade: bool) -> Scene {
    let settings = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    framed(volume, &soft(volume.value_range()), Lighting { shade, ..Lighting::default() }, settings)
}

/// On an oblique grid with a negative slope; every engine's picture of it, and each other's.
fn every_view_split_and_integral_agree() -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    for split in [Split::Five, Split::Six] {
        for (integral, exponential_table) in [
            (CellIntegral::Exact, false),
            (CellIntegral::Partial, false),
            (CellIntegral::Partial, true),
            (CellIntegral::Average, true),
        ] {
            let options = CellOptions { split, integral, exponential_table, ..CellOptions::default() };
            let renderer = renderer(options, &Fallbacks::default())?;
            for turn in 0..4 {
                let mut scene = small_scene(&volume, true);
                let mut camera = scene.camera().clone();
                camera.azimuth(1.7 * f64::from(turn));
                camera.elevation(0.9 * f64::from(turn) - 1.2);
                if turn % 2 == 1 {
                    camera.orthographic = Some(30.0);
                }
                scene.set_camera(camera)?;
                let what = format!("{split:?}, {integral:?}, table {exponential_table}, turn {turn}");
                near(&what, &reference::render(&scene), &drawn(&renderer, &scene)?.0, LARGEST_RMSE)?;
            }
        }
    }
    Ok(())
}

/// A field that is linear everywhere is so in each tetrahedron and in each cell: nothing but rounding is left.
fn a_linear_field_is_exact() -> Result<(), Failed> {
    let renderer = plain()?;
    let d = UVec3::new(9, 12, 7);
    let voxels = (0..d.element_product())
        .map(|i| UVec3::new(i % d.x, i / d.x % d.y, i / (d.x * d.y)).as_dvec3())
        .map(|p| p.dot(DVec3::new(0.5, -0.3, 0.2)) as f32);
    let volume = Volume::new(d, voxels.collect(), Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))?;
    for parallel in [false, true] {
        // Unlit: at the border the gradient of clamped differences turns within a cell.
        let mut scene = small_scene(&volume, false);
        let mut camera = scene.camera().clone();
        if parallel {
            camera.orthographic = Some(8.0);
        }
        scene.set_camera(camera)?;
        near(
            &format!("linear, parallel {parallel}"),
            &reference::render(&scene),
            &drawn(&renderer, &scene)?.0,
            SAME_FIELD,
        )?;
    }
    Ok(())
}

/// A grid's tetrahedra as a mesh: the order is right, for all are of a kind.
fn a_mesh_is_what_the_walk_finds() -> Result<(), Failed> {
    let renderer = plain()?;
    let volume = oblique_noise(UVec3::new(11, 9, 8), 3);
    let mesh = TetrahedralMesh::from_volume(&volume)?;
    for (shade, parallel) in [(false, false), (true, true)] {
        let mut scene = small_scene(mesh.lattice(), shade);
        if parallel {
            let mut camera = scene.camera().clone();
            camera.orthographic = Some(12.0);
            scene.set_camera(camera)?;
        }
        let image = drawn_mesh(&renderer, &mesh, &scene)?;
        near(&format!("mesh, lit {shade}, parallel {parallel}"), &walk(&mesh, &scene), &image, BY_CENTROIDS)?;
        let unlit = small_scene(&volume, false);
        let grid = drawn(&renderer, &unlit)?.0;
        let as_mesh = walk(&mesh, &unlit);
        near("a grid, by the walk", &as_mesh, &grid, SAME_FIELD)?;
    }
    Ok(())
}

/// Cells whose sizes differ by a factor of a thousand.
fn a_mesh_of_uneven_cells_is_near_to_the_walk() -> Result<(), Failed> {
    let renderer = plain()?;
    let volume = oblique_noise(UVec3::new(13, 11, 9), 5);
    let even = TetrahedralMesh::from_volume(&volume)?;
    let [lo, hi] = even.bounds();
    let bent = even.points().iter().map(|p| {
        let share = (*p - lo) / (hi - lo);
        lo + (hi - lo) * (share * share * (DVec3::splat(2.0) - share))
    });
    let mesh = TetrahedralMesh::new(bent.collect(), even.cells().to_vec(), even.values().to_vec())?;
    for turn in 0..3 {
        let mut scene = small_scene(mesh.lattice(), false);
        let mut camera = scene.camera().clone();
        camera.azimuth(2.0 * f64::from(turn));
        scene.set_camera(camera)?;
        let image = drawn_mesh(&renderer, &mesh, &scene)?;
        near(&format!("uneven mesh, turn {turn}"), &walk(&mesh, &scene), &image, BY_CENTROIDS)?;
    }
    Ok(())
}

fn from_inside(scene: &mut Scene, place: DVec3) -> Result<(), SceneError> {
    let mut camera = scene.camera().clone();
    camera.position = place.to_array();
    camera.focal_point = (place + DVec3::new(1.0, 0.2, 0.1)).to_array();
    camera.view_angle = 60.0;
    scene.set_camera(camera)
}

/// Cells that reach behind the eye are cut at the plane before it: coarse ones show what is missing best.
fn an_eye_inside_sees_its_surroundings() -> Result<(), Failed> {
    let renderer = plain()?;
    for (side, rmse) in [(65, LARGEST_RMSE), (33, LARGEST_RMSE), (9, 0.03)] {
        let volume = waves(side);
        let mut scene = small_scene(&volume, false);
        from_inside(&mut scene, volume.center_in_world() + DVec3::new(0.3, 0.1, -0.2))?;
        let expected = reference::render(&scene);
        near(&format!("inside, {side} a side"), &expected, &drawn(&renderer, &scene)?.0, rmse)?;
    }
    Ok(())
}

fn an_eye_inside_a_mesh_sees_what_the_walk_finds() -> Result<(), Failed> {
    let renderer = plain()?;
    let volume = oblique_noise(UVec3::new(9, 8, 7), 4);
    let mesh = TetrahedralMesh::from_volume(&volume)?;
    for offset in [DVec3::ZERO, DVec3::new(1.3, -0.4, 0.6)] {
        let mut scene = small_scene(mesh.lattice(), false);
        from_inside(&mut scene, mesh.lattice().center_in_world() + offset)?;
        let image = drawn_mesh(&renderer, &mesh, &scene)?;
        near("inside a mesh", &walk(&mesh, &scene), &image, BY_CENTROIDS)?;
    }
    Ok(())
}

/// The same tetrahedra by compute shaders and by the rasteriser, whatever `Auto` takes here.
fn tiles_and_triangles_agree() -> Result<(), Failed> {
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    let mesh = TetrahedralMesh::from_volume(&oblique_noise(UVec3::new(11, 9, 8), 3))?;
    let by = |drawing| renderer(CellOptions { drawing, ..CellOptions::default() }, &Fallbacks::default());
    let (tiles, triangles) = (by(CellDrawing::Tiles)?, by(CellDrawing::Triangles)?);
    for parallel in [false, true] {
        let mut scene = small_scene(&volume, false);
        let mut of_mesh = small_scene(mesh.lattice(), false);
        if parallel {
            for (scene, height) in [(&mut scene, 30.0), (&mut of_mesh, 12.0)] {
                let mut camera = scene.camera().clone();
                camera.orthographic = Some(height);
                scene.set_camera(camera)?;
            }
        }
        let images = [drawn(&triangles, &scene)?.0, drawn(&tiles, &scene)?.0];
        near(&format!("tiles, a grid, parallel {parallel}"), &images[0], &images[1], SAME_FIELD)?;
        let images = [drawn_mesh(&triangles, &mesh, &of_mesh)?, drawn_mesh(&tiles, &mesh, &of_mesh)?];
        near(&format!("tiles, a mesh, parallel {parallel}"), &images[0], &images[1], SAME_FIELD)?;
    }
    Ok(())
}

fn clips_cut_cells_open() -> Result<(), Failed> {
    let renderer = plain()?;
    let volume = oblique_noise(UVec3::new(37, 25, 19), 11);
    let center = volume.center_in_world();
    for (impregnation, overlay) in
        [(Impregnation::None, 0.0), (Impregnation::Step, 0.0), (Impregnation::Linear, 0.3)]
    {
        let shading = ClipShading { impregnation, overlay, thickness: 2.0, ..ClipShading::default() };
        for parallel in [false, true] {
            let mut scene = small_scene(&volume, true).with_clip(&ball_cut(center, 14.0), shading.clone())?;
            if parallel {
                let mut camera = scene.camera().clone();
                camera.orthographic = Some(30.0);
                scene.set_camera(camera)?;
            }
            let what = format!("{impregnation:?}, overlay {overlay}, parallel {parallel}");
            near(&what, &reference::render(&scene), &drawn(&renderer, &scene)?.0, LARGEST_RMSE)?;
        }
    }
    Ok(())
}

fn targets_of_16_bits_are_near() -> Result<(), Failed> {
    let fallbacks = Fallbacks { without_float_blending: true, ..Fallbacks::default() };
    let renderer = renderer(CellOptions::default(), &fallbacks)?;
    let volume = oblique_noise(UVec3::new(25, 19, 31), 5);
    let scene = small_scene(&volume, false);
    near("16-bit target", &reference::render(&scene), &drawn(&renderer, &scene)?.0, 0.003)?;
    Ok(())
}

fn other_modes_are_refused() -> Result<(), Failed> {
    let renderer = plain()?;
    let volume = waves(7);
    let settings = RenderSettings { mode: Mode::Mip, resolution: SMALL, ..RenderSettings::default() };
    let function = cutaway_core::transfer_function::TransferFunction::new(vec![point(0.0, [1.0; 3], 0.5)])?;
    let scene = framed(&volume, &function, Lighting::default(), settings);
    match drawn(&renderer, &scene) {
        Err(error @ GpuError::CellsMode { .. }) if error.to_string().contains("found mip") => Ok(()),
        other => Err(format!("{:?}", other.map(|_| ())).into()),
    }
}
