//! Engines on a GPU, as users call them; where there is none, that this is said.

mod common;

use common::{Run, image, run};
use serde_json::Value;

const SCENE: &str = "render sample:sphere:24 --resolution 48,40 --engine raycast";

/// What a run with a GPU leaves behind; without any, it has failed with a line that says so.
fn on_a_gpu(folder: &std::path::Path, line: &str) -> Option<Run> {
    let adapters = run(folder, "info --gpu --json").succeeds();
    let adapters: Value = serde_json::from_str(&adapters).unwrap();
    let run = run(folder, line);
    if adapters.as_array().unwrap().is_empty() {
        run.fails(1, &["no usable GPU"]);
        return None;
    }
    Some(run)
}

#[test]
fn the_ray_caster_shows_what_the_cpu_shows() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!("{SCENE} -o gpu.png --stats stats.json");
    let Some(gpu) = on_a_gpu(folder.path(), &line) else { return };
    assert_eq!(gpu.succeeds_silently(), "");
    run(folder.path(), &format!("{} -o cpu.png", SCENE.replace("raycast", "cpu"))).succeeds();
    run(folder.path(), "compare gpu.png cpu.png --fail-above 0.004").succeeds();
    let stats = std::fs::read_to_string(folder.path().join("stats.json")).unwrap();
    let stats: Value = serde_json::from_str(&stats).unwrap();
    assert_eq!(stats["engine"], "raycast");
    assert!(stats["adapter"].is_string() && stats["samples"].as_u64().unwrap() > 0, "{stats}");
    // On the device's own clock, where it has one: within the frame's time.
    if let Some(ms) = stats["gpu_ms"].as_f64() {
        assert!(ms > 0.0 && ms <= stats["frame_ms"]["max"].as_f64().unwrap(), "{stats}");
    }
}

#[test]
fn slices_show_what_the_cpu_shows() {
    let folder = tempfile::tempdir().unwrap();
    let scene = SCENE.replace("raycast", "slices");
    let line = format!("{scene} -o gpu.png --stats stats.json --depth-output depth.npy");
    let Some(gpu) = on_a_gpu(folder.path(), &line) else { return };
    assert_eq!(gpu.succeeds_silently(), "");
    run(folder.path(), &format!("{} -o cpu.png", SCENE.replace("raycast", "cpu"))).succeeds();
    run(folder.path(), "compare gpu.png cpu.png --fail-above 0.004").succeeds();
    let stats = std::fs::read_to_string(folder.path().join("stats.json")).unwrap();
    let stats: Value = serde_json::from_str(&stats).unwrap();
    assert_eq!(stats["engine"], "slices");
    assert!(stats["adapter"].is_string() && stats["samples"].is_null(), "{stats}");
    assert!(stats["triangles_or_tetrahedra"].as_u64().unwrap() > 100, "{stats}");
    for brick_size in [0, 8] {
        run(folder.path(), &format!("{scene} --brick-size {brick_size} -o bricks.png")).succeeds_silently();
        run(folder.path(), "compare gpu.png bricks.png --fail-above 0").succeeds();
    }
    run(folder.path(), &format!("{scene} --iso 0.5 -o x.png"))
        .fails(1, &["iso mode", "--engine cpu or raycast"]);
    run(folder.path(), &format!("{scene} --mode mip -o x.png")).succeeds_silently();
    run(folder.path(), &format!("{scene} --mode mip -o x.png --depth-output d.npy"))
        .fails(2, &["--depth-output", "no depth in mip mode", "--engine cpu or raycast"]);
    let jittered = run(folder.path(), &format!("{scene} --jitter -o x.png"));
    assert!(jittered.err.contains("--jitter has no effect with the slices engine"), "{}", jittered.err);
}

/// Two tetrahedra with a face in common.
const GRID: &str = "# vtk DataFile Version 3.0
two tetrahedra
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 float
0 0 0  4 0 0  0 4 0  0 0 4  4 4 4
CELLS 2 10
4 0 1 2 3
4 1 2 3 4
CELL_TYPES 2
10
10
POINT_DATA 5
SCALARS density float 1
LOOKUP_TABLE default
0 1 2 3 4
";

#[test]
fn cells_show_what_the_cpu_shows_and_grids_that_it_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let scene = SCENE.replace("raycast", "cells");
    let Some(cells) = on_a_gpu(folder.path(), &format!("{scene} -o cells.png")) else { return };
    cells.succeeds();
    run(folder.path(), &format!("{} -o cpu.png", SCENE.replace("raycast", "cpu"))).succeeds();
    // The field of a cell is linear in five tetrahedra, not trilinear.
    run(folder.path(), "compare cells.png cpu.png --fail-above 0.02").succeeds();
    run(folder.path(), &format!("{scene} -o x.png --depth-output d.npy"))
        .fails(2, &["--depth-output", "--engine cpu or raycast"]);

    std::fs::write(folder.path().join("grid.vtk"), GRID).unwrap();
    let about = run(folder.path(), "info grid.vtk").succeeds();
    assert!(about.contains("tetrahedra") && about.contains("0 to 4"), "{about}");
    let look = "--colormap viridis --range 0,4 --opacity 0,0.2,4,0.8 --resolution 40,40";
    run(folder.path(), &format!("render grid.vtk {look} -o grid.png")).succeeds();
    let seen = image(folder.path().join("grid.png")).pixels().iter().filter(|p| p[3] > 0.1).count();
    assert!((40..1600).contains(&seen), "{seen}");
    run(folder.path(), "render grid.vtk --engine cpu -o x.png").fails(2, &["grid.vtk", "--engine cells"]);
    let torn: String = GRID.chars().take(GRID.len() - 20).collect();
    std::fs::write(folder.path().join("torn.vtk"), torn).unwrap();
    run(folder.path(), "render torn.vtk -o x.png").fails(1, &["torn.vtk"]);
}

#[test]
fn debug_views_show_work_and_proxy() {
    let folder = tempfile::tempdir().unwrap();
    let Some(fetches) = on_a_gpu(folder.path(), &format!("{SCENE} --debug fetches -o fetches.png")) else {
        return;
    };
    fetches.succeeds_silently();
    let fetches = image(folder.path().join("fetches.png"));
    // Opaque, dark in the corner, where rays pass by, bright in the middle.
    let light = |x: usize, y: usize| fetches.pixels()[y * 48 + x][..3].iter().sum::<f32>();
    assert!(fetches.pixels().iter().all(|p| p[3] == 1.0));
    assert!(light(24, 20) > light(0, 0) + 0.2, "{} {}", light(24, 20), light(0, 0));

    run(folder.path(), &format!("{SCENE} -o plain.png --space-skipping cells")).succeeds_silently();
    let line = format!("{SCENE} --debug wireframe --space-skipping cells -o wire.png");
    run(folder.path(), &line).succeeds_silently();
    let [plain, wire] = ["plain.png", "wire.png"].map(|name| image(folder.path().join(name)));
    let greener = |(a, b): (&[f32; 4], &[f32; 4])| b[1] > a[1] + 0.3;
    assert!(plain.pixels().iter().zip(wire.pixels()).filter(|pair| greener(*pair)).count() > 20);

    let none = format!("{SCENE} --debug wireframe -o x.png");
    run(folder.path(), &none).fails(2, &["--debug wireframe", "--space-skipping auto", "contour"]);
}

#[test]
fn debug_views_belong_to_the_ray_caster_on_a_gpu() {
    let folder = tempfile::tempdir().unwrap();
    let line = "render sample:sphere:8 --engine cpu --debug fetches -o x.png";
    run(folder.path(), line).fails(2, &["--debug", "--engine raycast"]);
    run(folder.path(), "render sample:sphere:8 --debug fetch -o x.png").fails(2, &["fetches", "wireframe"]);
}
