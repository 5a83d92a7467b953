//! Events of all pixels of an image: finder by triangle count by image size.
//!
//! `cargo bench -p cutaway-mesh --bench events` measures with criterion; afterwards a table of the shortest of several
//! runs is printed, which is what to compare on a machine that does other things meanwhile, and Termeer's table 3.1.
//! `-- --table` prints the tables alone, `-- --table bunny` those of meshes with that name. The bunny is taken from `CUTAWAY_DATA`'s `meshes`, or from `../shared/data` beside the repository.

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use cutaway_core::camera::RayGenerator;
use cutaway_core::glam::{DAffine3, DVec3};
use cutaway_mesh::papers::ray_triangle::table_3_1;
use cutaway_mesh::shapes::icosphere;
use cutaway_mesh::{EventFinder, MeshSolid, PixelEvents, TileEvents, TileRect, TriangleMesh};
use rayon::prelude::*;

const TILE: u32 = 32;
const SIZES: [u32; 3] = [256, 512, 1024];

fn meshes() -> Vec<(String, Arc<TriangleMesh>)> {
    let mut meshes: Vec<_> = [3, 5, 6, 8]
        .map(icosphere)
        .into_iter()
        .map(|m| (format!("sphere {}", m.triangles().len()), m))
        .collect();
    let bunny = support::mesh_folder().join("bunny.ply");
    if bunny.exists() {
        meshes.push(("bunny 69451".to_owned(), support::load(&bunny)));
    }
    meshes.into_iter().map(|(name, mesh)| (name, Arc::new(mesh))).collect()
}

/// Finds the events of all pixels, on all cores; gives their number.
fn all_events(solid: &MeshSolid, rays: &RayGenerator, size: u32) -> usize {
    let frame = solid.frame(rays, &DAffine3::IDENTITY, size, size);
    let tiles = size.div_ceil(TILE);
    (0..tiles * tiles)
        .into_par_iter()
        .map_init(TileEvents::new, |tile, i| {
            let (x, y) = (i % tiles * TILE, i / tiles * TILE);
            frame.tile(TileRect { x, y, width: TILE, height: TILE }, tile);
            tile.events().len()
        })
        .sum()
}

fn shortest(runs: usize, mut run: impl FnMut()) -> Duration {
    let mut time = || {
        let start = Instant::now();
        run();
        start.elapsed()
    };
    (0..runs).map(|_| time()).min().unwrap_or_default()
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

fn table(meshes: &[(String, Arc<TriangleMesh>)]) {
    println!(
        "\nmilliseconds for the events of all pixels, shortest of 15; {} threads",
        rayon::current_num_threads()
    );
    println!(
        "{:16} {:7} {:>9} {:>7} {:>9} {:>9} {:>9}",
        "mesh", "finder", "build", "B/tri", "256", "512", "1024"
    );
    for (name, mesh) in meshes {
        for finder in EventFinder::ALL {
            let start = Instant::now();
            let solid = MeshSolid::new(Arc::clone(mesh), finder);
            let built = milliseconds(start.elapsed());
            let times = SIZES.map(|size| {
                let rays = support::view(mesh, DVec3::new(0.2, 0.1, -1.0), [size, size], false);
                milliseconds(shortest(15, || {
                    black_box(all_events(&solid, &rays, size));
                }))
            });
            let bytes = solid.bytes() as f64 / mesh.triangles().len() as f64;
            let [a, b, c] = times;
            println!("{name:16} {:7} {built:9.1} {bytes:7.1} {a:9.2} {b:9.2} {c:9.2}", finder.name());
        }
    }
}

fn table_of_ray_triangle_tests(mesh: &TriangleMesh) {
    println!("\n{:28} {:>6} {:>9} {:>6}", "ray-triangle (table 3.1)", "ns", "relative", "paper");
    for row in table_3_1(mesh, Duration::from_secs(2)) {
        let paper = row.paper.map_or_else(String::new, |paper| format!("{paper:.2}"));
        println!("{:28} {:6.2} {:9.2} {paper:>6}", row.algorithm.name(), row.nanoseconds, row.relative);
    }
}

fn measure(criterion: &mut Criterion, meshes: &[(String, Arc<TriangleMesh>)]) {
    for (name, mesh) in meshes {
        let mut group = criterion.benchmark_group(name.as_str());
        group
            .sample_size(10)
            .measurement_time(Duration::from_secs(1))
            .warm_up_time(Duration::from_millis(300));
        for finder in EventFinder::ALL {
            let solid = MeshSolid::new(Arc::clone(mesh), finder);
            for size in SIZES {
                let rays = support::view(mesh, DVec3::new(0.2, 0.1, -1.0), [size, size], false);
                group.throughput(Throughput::Elements(u64::from(size) * u64::from(size)));
                group.bench_function(BenchmarkId::new(finder.name(), size), |b| {
                    b.iter(|| all_events(&solid, &rays, size));
                });
            }
        }
        group.finish();
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let mut meshes = meshes();
    if arguments.first().is_some_and(|argument| argument == "--table") {
        meshes.retain(|(name, _)| arguments.get(1).is_none_or(|part| name.contains(part)));
    } else {
        let mut criterion = Criterion::default().configure_from_args();
        measure(&mut criterion, &meshes);
        criterion.final_summary();
    }
    table(&meshes);
    if let Some((_, mesh)) = meshes.last() {
        table_of_ray_triangle_tests(mesh);
    }
}
