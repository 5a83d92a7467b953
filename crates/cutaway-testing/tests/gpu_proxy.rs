//! Proxy geometry changes what is done, never the image: every flavour, in every way of finding where rays begin and end,
//! against the same renderer without skipping. And opaque geometry among the volume against its closed form.
//!
//! `cargo test -p cutaway-testing --test gpu_proxy -- --nocapture` prints how many values are taken of real volumes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::glam::{DAffine3, DMat3, DVec3, UVec3};
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, SpaceSkipping};
use cutaway_core::space::WorldFrame;
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_gpu::context::Fallbacks;
use cutaway_gpu::{Extras, Gpu, GpuOptions, OpaquePart, ProxyOptions, RaycastRenderer, RaycastStatistics};
use cutaway_io::volume::{ReadOptions, read_volume};
use cutaway_mesh::TriangleMesh;
use cutaway_mesh::shapes::icosphere;
use cutaway_testing::scenes::{SMALL, point, uniform};
use libtest_mimic::{Arguments, Failed, Trial};

const FLAVOURS: [SpaceSkipping; 5] = [
    SpaceSkipping::Cells,
    SpaceSkipping::Fitted,
    SpaceSkipping::Boundary,
    SpaceSkipping::Contour,
    SpaceSkipping::FittedContour,
];

/// Largest difference of a channel: samples lie at the same places, so that only what is invisible can differ. Early
/// termination and f32 leave far less; an invisible entry of the table may still have an opacity of 1e-5.
const LARGEST: f32 = 1e-4;

fn main() {
    let arguments = Arguments::from_args();
    let there = Gpu::new(&GpuOptions::default()).is_ok();
    let mut trials = Vec::new();
    let mut add = |name: String, test: Box<dyn FnOnce() -> Result<(), Failed> + Send>| {
        trials.push(Trial::test(name, test).with_ignored_flag(!there));
    };
    for (way, fallbacks) in ways() {
        for kind in ["blobs", "hollow", "scattered"] {
            let fallbacks = fallbacks.clone();
            add(format!("{kind}_{way}"), Box::new(move || same_image(kind, fallbacks)));
        }
    }
    add("overflow".to_owned(), Box::new(overflow));
    add("more_cells_than_ten_bits".to_owned(), Box::new(long_volume));
    add("gap_between_fitted_cells".to_owned(), Box::new(fitted_gap));
    add("sphere_in_fog".to_owned(), Box::new(sphere_in_fog));
    add("wireframe".to_owned(), Box::new(wireframe));
    for name in ["bonsai.nii.gz", "foot_zfp8_256x256x256_uint8.nhdr"] {
        let path = data_folder().join(name);
        let missing = !path.exists();
        let trial = Trial::test(name, move || fetches(name, &path));
        trials.push(trial.with_ignored_flag(missing || !there));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

fn data_folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("CUTAWAY_DATA").map_or_else(beside, PathBuf::from).join("volumes")
}

/// The ways of finding the ends of rays.
fn ways() -> [(&'static str, Fallbacks); 3] {
    [
        ("blended", Fallbacks::default()),
        ("blended16", Fallbacks { without_float_blending: true, ..Fallbacks::default() }),
        ("sorted", Fallbacks { sorted_ranges: true, ..Fallbacks::default() }),
    ]
}

fn renderer(fallbacks: Fallbacks) -> Result<RaycastRenderer, Failed> {
    let gpu = Gpu::new(&GpuOptions { fallbacks, ..GpuOptions::default() })?;
    Ok(RaycastRenderer::new(&gpu)?)
}

/// Pseudo-random numbers, 0..1.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }

    fn point(&mut self, extent: DVec3) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * extent
    }
}

/// Grids: plain; anisotropic; oblique, sheared and left-handed.
fn grid(kind: u32) -> Geometry {
    match kind % 3 {
        0 => Geometry::from_spacing(DVec3::ONE),
        1 => Geometry::from_spacing(DVec3::new(0.7, 1.3, 2.1)),
        _ => {
            let columns = DMat3::from_cols(
                DVec3::new(-0.9, 0.1, 0.2),
                DVec3::new(0.2, 1.1, -0.1),
                DVec3::new(0.3, 0.0, 1.4),
            );
            let world_from_voxel = DAffine3 { matrix3: columns, translation: DVec3::new(-40.0, 12.0, 7.0) };
            Geometry { world_from_voxel, frame: WorldFrame::Ras }
        }
    }
}

/// A volume of mostly nothing. `blobs`: soft balls, some cut by the border; `hollow`: a thick shell; `scattered`: dots.
fn sparse(kind: &str, seed: u32) -> Volume {
    let dimensions = UVec3::new(83, 61, 52);
    let extent = (dimensions - 1).as_dvec3();
    let mut random = Random(seed);
    let balls: Vec<(DVec3, f64)> = match kind {
        "blobs" => (0..6).map(|_| (random.point(extent), 4.0 + 9.0 * random.next())).collect(),
        "hollow" => vec![(extent * 0.5, 22.0)],
        _ => (0..20).map(|_| (random.point(extent).round(), 2.0)).collect(),
    };
    let value = |p: DVec3| {
        let of = |&(center, radius): &(DVec3, f64)| match kind {
            "hollow" => (1.0 - (p.distance(center) - radius).abs() / 4.0).max(0.0),
            _ => (1.5 * (1.0 - p.distance(center) / radius)).clamp(0.0, 1.0),
        };
        balls.iter().map(of).fold(0.0, f64::max)
    };
    let mut voxels = Vec::new();
    for z in 0..dimensions.z {
        for y in 0..dimensions.y {
            voxels.extend(
                (0..dimensions.x).map(|x| (255.0 * value(UVec3::new(x, y, z).as_dvec3())).round() as u8),
            );
        }
    }
    Volume::new(dimensions, voxels, Rescale::IDENTITY, grid(seed)).expect("a valid volume")
}

/// Transparent below, then a step that is visible at once, so that every lost sample shows.
fn stepped() -> TransferFunction {
    TransferFunction::new(vec![
        point(60.0, [0.2, 0.4, 0.9], 0.0),
        point(60.0, [0.9, 0.5, 0.2], 0.3),
        point(255.0, [1.0, 1.0, 0.8], 0.6),
    ])
    .expect("ordered points")
}

/// Cameras outside, along an axis of the grid, far off, inside at several places, and parallel ones.
fn cameras(volume: &Volume, seed: u32) -> Vec<(&'static str, Camera)> {
    let aspect = f64::from(SMALL[0]) / f64::from(SMALL[1]);
    let corners = volume.corners_in_world();
    let framing = |way: DVec3| {
        let up = if way.z.abs() > 0.9 * way.length() { DVec3::Y } else { DVec3::Z };
        Camera::framing(&corners, way, up, aspect, 1.05)
    };
    let mut random = Random(seed ^ 77);
    let oblique = random.point(DVec3::splat(2.0)) - 1.0;
    let outside = framing(oblique);
    let center = volume.center_in_world();
    let radius = corners[0].distance(center);
    let along = volume.world_from_voxel().matrix3.x_axis;
    let at = |position: DVec3, way: DVec3, angle| Camera {
        position: position.to_array(),
        focal_point: (position + way).to_array(),
        view_angle: angle,
        ..outside.clone()
    };
    let inside = volume.world_from_voxel().transform_point3(random.point(volume.extent()));
    let far = center - oblique.normalize() * 300.0 * radius;
    let parallel = Camera { orthographic: Some(0.8 * radius), ..outside.clone() };
    let axis = Camera { orthographic: Some(0.6 * radius), ..framing(along) };
    // The image's plane cuts the volume.
    let cutting = Camera { orthographic: Some(0.5 * radius), ..at(inside, oblique, 30.0) };
    vec![
        ("outside", outside.clone()),
        ("along an axis", framing(along)),
        ("far", at(far, center - far, 0.4)),
        ("inside", at(inside, oblique, 60.0)),
        ("inside, wide", at(inside, -oblique, 140.0)),
        ("in the middle", at(center, oblique, 90.0)),
        ("parallel", parallel),
        ("parallel, along an axis", axis),
        ("parallel, cutting", cutting),
    ]
}

fn scene(volume: &Volume, camera: &Camera, settings: RenderSettings) -> Scene {
    let lighting = Lighting { shade: false, ..Lighting::default() };
    Scene::new(Layer::new(volume.clone(), &stepped()).with_lighting(lighting), camera.clone(), settings)
        .expect("a valid scene")
}

fn render(renderer: &RaycastRenderer, scene: &Scene) -> Result<(Image, RaycastStatistics), Failed> {
    let volume = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&volume, scene)?;
    Ok(renderer.render(&volume, &classification, scene, &|_| {})?)
}

fn largest_difference(a: &Image, b: &Image) -> f32 {
    let channels = |image: &Image| image.pixels().iter().flatten().copied().collect::<Vec<f32>>();
    channels(a).iter().zip(channels(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Every flavour, with rays that look at nothing outside of what the proxy gives them.
fn same_image(kind: &str, fallbacks: Fallbacks) -> Result<(), Failed> {
    let renderer = renderer(fallbacks)?;
    let alone = ProxyOptions { image_order: false, cell_blocks: Some(2), ..ProxyOptions::default() };
    let renderer = renderer.with_proxy_options(alone);
    for seed in 0..3 {
        let volume = sparse(kind, seed);
        let prepared = renderer.prepare(&volume)?;
        for (view, camera) in cameras(&volume, seed) {
            for mode in [Mode::Composite, Mode::Iso] {
                let settings = |space_skipping| RenderSettings {
                    mode,
                    iso: vec![100.0],
                    iso_opacity: 0.4,
                    space_skipping,
                    resolution: SMALL,
                    ..RenderSettings::default()
                };
                let all = scene(&volume, &camera, settings(SpaceSkipping::Off));
                let classification = renderer.classify(&prepared, &all)?;
                let (expected, off) = renderer.render(&prepared, &classification, &all, &|_| {})?;
                let shown = expected.pixels().iter().filter(|p| p[3] > 0.0).count();
                if shown == 0 && view == "outside" {
                    return Err(format!("nothing is seen from {view}").into());
                }
                let some = scene(&volume, &camera, settings(SpaceSkipping::Auto));
                let classification = renderer.classify(&prepared, &some)?;
                for flavour in FLAVOURS {
                    let scene = scene(&volume, &camera, settings(flavour));
                    let (image, on) = renderer.render(&prepared, &classification, &scene, &|_| {})?;
                    let difference = largest_difference(&expected, &image);
                    let what = format!("{kind} {seed}, {}, {}, {view}", mode.name(), flavour.name());
                    if difference > LARGEST {
                        return Err(format!("{what}: differs by {difference}").into());
                    }
                    if on.samples > off.samples {
                        return Err(format!("{what}: {} samples, {} without", on.samples, off.samples).into());
                    }
                }
            }
        }
    }
    Ok(())
}

/// With room for too few quads the box of all cells is drawn, which nothing on the host decides.
fn overflow() -> Result<(), Failed> {
    let volume = sparse("blobs", 1);
    let (_, camera) = cameras(&volume, 1).remove(0);
    let settings =
        |space_skipping| RenderSettings { space_skipping, resolution: SMALL, ..RenderSettings::default() };
    let plenty = renderer(Fallbacks::default())?;
    let few = renderer(Fallbacks::default())?
        .with_proxy_options(ProxyOptions { most_quads: Some(40), ..ProxyOptions::default() });
    let expected = render(&plenty, &scene(&volume, &camera, settings(SpaceSkipping::Off)))?.0;
    for flavour in FLAVOURS {
        let scene = scene(&volume, &camera, settings(flavour));
        let prepared = few.prepare(&volume)?;
        let classification = few.classify(&prepared, &scene)?;
        let counts = few.proxy_counts(&classification, &scene)?.ok_or("there is no proxy")?;
        assert_eq!((counts.quads, counts.capacity), (6, 40), "{}", flavour.name());
        assert!(counts.wanted > 40, "{}: {counts:?}", flavour.name());
        let image = few.render(&prepared, &classification, &scene, &|_| {})?.0;
        assert!(largest_difference(&expected, &image) <= LARGEST, "{}", flavour.name());
        // The cache knows these from others.
        let classification = plenty.classify(&plenty.prepare(&volume)?, &scene)?;
        let counts = plenty.proxy_counts(&classification, &scene)?.ok_or("there is no proxy")?;
        assert_eq!(counts.quads, counts.wanted, "{}", flavour.name());
        assert!(counts.quads > 40);
    }
    Ok(())
}

/// More blocks along a side than coordinates have numbers: units of several blocks.
fn long_volume() -> Result<(), Failed> {
    let renderer = renderer(Fallbacks::default())?;
    let side = renderer.gpu().capabilities().max_texture_3d;
    let dimensions = UVec3::new(side.min(16_384), 6, 5);
    let mut voxels = vec![0u8; dimensions.element_product() as usize];
    for x in [3, dimensions.x / 2, dimensions.x - 4] {
        let middle = ((2 * dimensions.y + 3) * dimensions.x + x) as usize;
        voxels[middle - 2..middle + 2].fill(200);
    }
    let geometry = Geometry::from_spacing(DVec3::new(0.01, 1.0, 1.0));
    let volume = Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry)?;
    let aspect = f64::from(SMALL[0]) / f64::from(SMALL[1]);
    let camera =
        Camera::framing(&volume.corners_in_world(), DVec3::new(0.1, 1.0, 0.2), DVec3::Z, aspect, 1.05);
    let settings = |space_skipping| RenderSettings {
        step: 4.0,
        space_skipping,
        resolution: SMALL,
        ..RenderSettings::default()
    };
    let expected = render(&renderer, &scene(&volume, &camera, settings(SpaceSkipping::Off)))?.0;
    assert!(expected.pixels().iter().any(|p| p[3] > 0.0));
    for flavour in FLAVOURS {
        let image = render(&renderer, &scene(&volume, &camera, settings(flavour)))?.0;
        assert!(largest_difference(&expected, &image) <= LARGEST, "{}", flavour.name());
    }
    Ok(())
}

/// Termeer's figure 4.9: two cells side by side, one with something at the top of what they share, the other at the bottom.
/// Shrunk, their boxes do not touch; without the faces that unshrunk ones share, rays would pass between them.
fn fitted_gap() -> Result<(), Failed> {
    let renderer = renderer(Fallbacks::default())?;
    // Two cells of two blocks of eight, next to each other along x.
    let dimensions = UVec3::new(33, 17, 17);
    let mut voxels = vec![0u8; dimensions.element_product() as usize];
    let mut set = |x: u32, y: u32, z: u32| {
        voxels[((z * dimensions.y + y) * dimensions.x + x) as usize] = 220;
    };
    for z in 2..15 {
        for x in 2..15 {
            (1..7).for_each(|y| set(x, y, z));
            (10..16).for_each(|y| set(x + 16, y, z));
        }
    }
    let volume = Volume::new(dimensions, voxels, Rescale::IDENTITY, grid(0))?;
    let center = volume.center_in_world();
    let inside = Camera {
        position: (center + DVec3::new(-1.0, -6.0, 0.0)).to_array(),
        focal_point: (center + DVec3::new(10.0, 2.0, 0.0)).to_array(),
        view_up: [0.0, 0.0, 1.0],
        view_angle: 100.0,
        orthographic: None,
    };
    let mut all = cameras(&volume, 5);
    // Into the gap, along the plane that both cells share, and through it.
    all.push(("into the gap", inside));
    for cell_blocks in [2, 4] {
        let options =
            ProxyOptions { cell_blocks: Some(cell_blocks), image_order: false, ..ProxyOptions::default() };
        let renderer = self::renderer(Fallbacks::default())?.with_proxy_options(options);
        for (view, camera) in &all {
            let settings = |space_skipping| RenderSettings {
                space_skipping,
                resolution: SMALL,
                ..RenderSettings::default()
            };
            let expected = render(&renderer, &scene(&volume, camera, settings(SpaceSkipping::Off)))?.0;
            let fitted = scene(&volume, camera, settings(SpaceSkipping::FittedContour));
            let image = render(&renderer, &fitted)?.0;
            let difference = largest_difference(&expected, &image);
            assert!(difference <= LARGEST, "{cell_blocks} blocks, {view}: {difference}");
        }
    }
    // The boxes do not touch, so all their faces are there; unshrunk cells share one, which two would draw.
    let scene = |how| {
        let settings = RenderSettings { space_skipping: how, resolution: SMALL, ..RenderSettings::default() };
        scene(&volume, &all[0].1, settings)
    };
    let edge = if count(&renderer, &scene(SpaceSkipping::Cells), 2)? == 12 { 2 } else { 4 };
    assert_eq!(count(&renderer, &scene(SpaceSkipping::Cells), edge)?, 12);
    assert_eq!(count(&renderer, &scene(SpaceSkipping::Contour), edge)?, 10);
    assert_eq!(count(&renderer, &scene(SpaceSkipping::FittedContour), edge)?, 12);
    Ok(())
}

/// Quads of a proxy whose cells are `edge` blocks.
fn count(renderer: &RaycastRenderer, scene: &Scene, edge: u32) -> Result<u32, Failed> {
    let options = ProxyOptions { cell_blocks: Some(edge), ..ProxyOptions::default() };
    let renderer = RaycastRenderer::new(renderer.gpu())?.with_proxy_options(options);
    let classification = renderer.classify(&renderer.prepare(scene.volume())?, scene)?;
    Ok(renderer.proxy_counts(&classification, scene)?.ok_or("there is no proxy")?.quads)
}

/// A ball in a volume of constant extinction: where a ray meets it, the fog before it has the opacity of the way to it.
fn sphere_in_fog() -> Result<(), Failed> {
    let volume = uniform(UVec3::new(41, 37, 33), 100.0, DVec3::new(1.0, 1.2, 0.9));
    let function = TransferFunction::new(vec![point(100.0, [0.2, 0.5, 0.8], 0.02)])?;
    let center = volume.center_in_world();
    let (radius, color) = (9.0, [0.9f32, 0.3, 0.1]);
    let mesh: TriangleMesh = icosphere(5);
    let world_from_mesh = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius));
    let parts = [OpaquePart { mesh: &mesh, world_from_mesh, color, lit: false }];
    for fallbacks in ways().map(|(_, fallbacks)| fallbacks) {
        let renderer = renderer(fallbacks)?;
        for (view, camera) in cameras(&volume, 3) {
            // The ball is seen from inside too, where it hides everything.
            let eye_inside = DVec3::from_array(camera.position).distance(center) < radius;
            for space_skipping in [SpaceSkipping::Off, SpaceSkipping::Contour] {
                let settings =
                    RenderSettings { space_skipping, resolution: SMALL, ..RenderSettings::default() };
                let lighting = Lighting { shade: false, ..Lighting::default() };
                let scene = Scene::new(
                    Layer::new(volume.clone(), &function)
                        .with_unit_distance(Some(1.0))
                        .with_lighting(lighting),
                    camera.clone(),
                    settings,
                )?;
                let prepared = renderer.prepare(&volume)?;
                let classification = renderer.classify(&prepared, &scene)?;
                let geometry = renderer.draw_geometry(&prepared, &classification, &scene, &parts)?;
                let extras = Extras { geometry: Some(&geometry), ..Extras::default() };
                let image = renderer.render_with(&prepared, &classification, &scene, &extras, &|_| {})?.0;
                let rays = camera.rays(SMALL[0], SMALL[1]);
                let mut compared = 0;
                for y in 0..SMALL[1] {
                    for x in 0..SMALL[0] {
                        let ray = rays.pixel(x, y);
                        let Some(t) = ball(ray.origin - center, ray.direction, radius) else { continue };
                        let box_near = box_entry(&volume, ray.origin, ray.direction);
                        let fog = 1.0 - 0.98f64.powf((t - box_near).max(0.0));
                        let found = image.pixels()[(y * SMALL[0] + x) as usize];
                        let expected: Vec<f64> = (0..3)
                            .map(|c| [0.2, 0.5, 0.8][c] * fog + (1.0 - fog) * f64::from(color[c]))
                            .collect();
                        for c in 0..3 {
                            let off = (f64::from(found[c]) - expected[c]).abs();
                            // A mesh of 20 480 triangles lies up to a hundredth of a unit inside the ball.
                            let what = format!("{view} ({x}, {y}) channel {c}: {off}");
                            if off > 2e-3 {
                                return Err(what.into());
                            }
                        }
                        if (f64::from(found[3]) - 1.0).abs() > 1e-5 {
                            return Err(format!("{view} ({x}, {y}): alpha {}", found[3]).into());
                        }
                        compared += 1;
                    }
                }
                if compared == 0 && (view == "outside" || eye_inside) {
                    return Err(format!("{view}: no ray meets the ball").into());
                }
            }
        }
    }
    Ok(())
}

/// Where a ray meets a ball about the origin, if not too near its outline for a mesh.
fn ball(origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let middle = -origin.dot(direction);
    let across = (origin + direction * middle).length();
    if across > 0.9 * radius {
        return None;
    }
    let half = (radius * radius - across * across).sqrt();
    let t = if middle - half > 0.0 { middle - half } else { middle + half };
    (t > 0.0).then_some(t)
}

fn box_entry(volume: &Volume, origin: DVec3, direction: DVec3) -> f64 {
    let m = volume.voxel_from_world();
    let (o, d) = (m.transform_point3(origin), m.transform_vector3(direction));
    let segment = cutaway_core::camera::intersect_box(o, d, volume.extent());
    segment.map_or(f64::INFINITY, |s| s.t_near())
}

/// Lines appear, and only over or around what is there.
fn wireframe() -> Result<(), Failed> {
    let renderer = renderer(Fallbacks::default())?;
    let volume = sparse("blobs", 2);
    let (_, camera) = cameras(&volume, 2).remove(0);
    let settings = RenderSettings {
        space_skipping: SpaceSkipping::Contour,
        resolution: [301, 203],
        ..RenderSettings::default()
    };
    let scene = scene(&volume, &camera, settings);
    let prepared = renderer.prepare(&volume)?;
    let classification = renderer.classify(&prepared, &scene)?;
    let plain = renderer.render(&prepared, &classification, &scene, &|_| {})?.0;
    let extras = Extras { wireframe: Some([0.0, 1.0, 0.0]), ..Extras::default() };
    let lines = renderer.render_with(&prepared, &classification, &scene, &extras, &|_| {})?.0;
    let mut drawn = 0;
    for (a, b) in plain.pixels().iter().zip(lines.pixels()) {
        if a != b {
            assert_eq!(*b, [0.0, 1.0, 0.0, 1.0]);
            drawn += 1;
        }
    }
    assert!((300..30_000).contains(&drawn), "{drawn} pixels of lines");
    if let Some(folder) = std::env::var_os("CUTAWAY_PICTURES") {
        let path = PathBuf::from(folder).join("proxy_wireframe.png");
        cutaway_io::image::write_image(&path, &lines, cutaway_io::image::BitDepth::Eight)?;
    }
    Ok(())
}

/// How many values are taken of a real volume, from the box and from each proxy: at least three times fewer.
fn fetches(name: &str, path: &Path) -> Result<(), Failed> {
    let volume = Arc::new(read_volume(path, &ReadOptions::default())?.value);
    let gpu = Gpu::new(&GpuOptions::default())?;
    let [lo, hi] = volume.value_range();
    let at = |share: f64| lo + share * (hi - lo);
    // Bone, or wood and pot.
    let share = if name.starts_with("foot") { 0.45 } else { 0.35 };
    let function = TransferFunction::new(vec![
        point(at(share - 0.02), [0.9, 0.7, 0.5], 0.0),
        point(at(share), [0.9, 0.8, 0.7], 0.9),
        point(at(1.0), [1.0, 1.0, 1.0], 0.95),
    ])?;
    // All sizes of cells, and an image as large as is asked for, are for a table; the test needs neither.
    let asked: Option<u32> = std::env::var("CUTAWAY_PROXY_TABLE").ok().and_then(|s| s.parse().ok());
    let size = asked.unwrap_or(96);
    let edges: &[Option<u32>] = if asked.is_some() { &[None, Some(1), Some(2), Some(4)] } else { &[None] };
    let camera = cutaway_core::scene::default_camera(&volume, 1.0);
    println!("\n{name} at {size} x {size}, step 0.5; cells of E blocks along an edge");
    println!(
        "| mode | proxy | E | quads | samples | of the box's | ms | with blocks skipped: samples | ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for mode in [Mode::Composite, Mode::Iso] {
        let mut from_box = 0;
        let mut best = u64::MAX;
        let every = FLAVOURS.iter().flat_map(|f| edges.iter().map(move |edge| (*f, *edge)));
        let ways = [(SpaceSkipping::Off, None), (SpaceSkipping::Auto, None)].into_iter().chain(every);
        for (space_skipping, edge) in ways {
            let settings = RenderSettings {
                mode,
                iso: vec![at(share)],
                space_skipping,
                resolution: [size, size],
                ..RenderSettings::default()
            };
            let lighting = Lighting { shade: false, ..Lighting::default() };
            let scene = Scene::new(
                Layer::new(volume.clone(), &function).with_lighting(lighting),
                camera.clone(),
                settings,
            )?;
            let mut found = Vec::new();
            let mut quads = 0;
            for image_order in [false, true] {
                let options = ProxyOptions { cell_blocks: edge, image_order, most_quads: None };
                let renderer = RaycastRenderer::new(&gpu)?.with_proxy_options(options);
                let prepared = renderer.prepare(&volume)?;
                let classification = renderer.classify(&prepared, &scene)?;
                quads = renderer.proxy_counts(&classification, &scene)?.map_or(0, |c| c.quads);
                let mut least = f64::MAX;
                let mut samples = 0;
                for _ in 0..if asked.is_some() { 3 } else { 1 } {
                    let start = std::time::Instant::now();
                    samples = renderer.render(&prepared, &classification, &scene, &|_| {})?.1.samples;
                    least = least.min(start.elapsed().as_secs_f64() * 1e3);
                }
                found.push((samples, least));
            }
            match space_skipping {
                SpaceSkipping::Off => from_box = found[0].0,
                SpaceSkipping::Auto => {}
                _ => best = best.min(found[0].0),
            }
            println!(
                "| {} | {} | {} | {quads} | {} | {:.3} | {:.1} | {} | {:.1} |",
                mode.name(),
                space_skipping.name(),
                edge.map_or("-".to_owned(), |edge| edge.to_string()),
                found[0].0,
                found[0].0 as f64 / from_box as f64,
                found[0].1,
                found[1].0,
                found[1].1
            );
        }
        if best * 3 > from_box {
            return Err(format!("{}: {best} samples, {from_box} from the box", mode.name()).into());
        }
    }
    Ok(())
}
