//! Every real mesh against counts that a reader of another language made (`tests/golden/generator/mesh_counts.py`), and
//! what repair makes of it: one test a file.
//!
//! The meshes are found through `CUTAWAY_DATA` or in `../shared/data` beside the workspace; where they are not, their tests
//! show as ignored.

use std::fs;
use std::path::{Path, PathBuf};

use cutaway_io::mesh::{MeshReadOptions, read_mesh};
use cutaway_mesh::{RepairOptions, Topology, TriangleMesh, repair};
use libtest_mimic::{Arguments, Failed, Trial};
use serde::Deserialize;

#[derive(Clone, Deserialize)]
struct Golden {
    file: String,
    vertices: usize,
    triangles: usize,
    low: [f64; 3],
    high: [f64; 3],
    volume: f64,
    euler: i64,
    boundary_edges: usize,
    non_manifold_edges: usize,
}

fn main() {
    let arguments = Arguments::from_args();
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(here.join("tests/golden/meshes.json")).expect("golden counts are there");
    let goldens: Vec<Golden> = serde_json::from_str(&text).expect("golden counts are JSON");
    let trials = goldens.into_iter().map(|golden| {
        let path = data_folder(here).join(&golden.file);
        let there = path.exists();
        Trial::test(golden.file.clone(), move || check(&path, &golden)).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

fn data_folder(here: &Path) -> PathBuf {
    let beside = || here.join("../../../shared/data");
    std::env::var_os("CUTAWAY_DATA").map_or_else(beside, PathBuf::from).join("meshes")
}

fn check(path: &Path, golden: &Golden) -> Result<(), Failed> {
    let loaded = read_mesh(path, &MeshReadOptions::default())?;
    let t = Topology::new(&loaded.value);
    let counts = |t: &Topology| [t.vertices, t.triangles, t.boundary_edges, t.non_manifold_edges];
    same(
        "vertices, triangles, boundary and non-manifold edges",
        counts(&t),
        [golden.vertices, golden.triangles, golden.boundary_edges, golden.non_manifold_edges],
    )?;
    same("Euler number", t.euler, golden.euler)?;
    let [low, high] = t.bounds.ok_or("no bounds")?.map(|v| v.to_array());
    let size = (0..3).map(|i| golden.high[i] - golden.low[i]).fold(0.0, f64::max);
    for (found, expected) in low.iter().chain(&high).zip(golden.low.iter().chain(&golden.high)) {
        // The duck's node scales; there the two programs round at different places.
        near("bounds", *found, *expected, 1e-6 * size)?;
    }
    // Of open surfaces the volume depends on the point that it is measured from.
    if golden.boundary_edges == 0 || golden.file.starts_with("Duck") {
        near("volume", t.volume, golden.volume, 1e-5 * golden.volume.abs())?;
    }
    check_repair(&loaded.value, golden)
}

fn check_repair(mesh: &TriangleMesh, golden: &Golden) -> Result<(), Failed> {
    let repaired = repair(mesh, &RepairOptions::default())?;
    let t = Topology::new(repaired.mesh.mesh());
    same("closed", t.is_closed(), true)?;
    // Holes of the bunnies are 223 edges of 208,000.
    near("volume after repair", t.volume, golden.volume.abs(), 0.03 * golden.volume.abs())?;
    // One in twenty of the dragon's are the two sides of a wall.
    let kept = t.triangles as f64 / golden.triangles as f64;
    near("triangles kept", kept, 1.0, 0.05)
}

fn same<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), Failed> {
    if found == expected { Ok(()) } else { Err(format!("{what}: {found:?}, expected {expected:?}").into()) }
}

fn near(what: &str, found: f64, expected: f64, within: f64) -> Result<(), Failed> {
    if (found - expected).abs() <= within {
        Ok(())
    } else {
        Err(format!("{what}: {found}, expected {expected}").into())
    }
}
