//! Whole frames of the CPU engine: volume x mode x instructions x threads, `cargo bench -p cutaway-testing --bench frames`.
//!
//! Every combination of a volume and a mode is measured with the widest instructions on all cores; instruction sets and
//! thread counts are then tried on one of them each. Throughput is in samples a second (cells, for isosurfaces).

mod common;

use common::{Look, Ready, marschner_lobb, scene};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use cutaway_core::scene::{Mode, Scene};
use cutaway_core::volume::{Volume, VoxelType};
use cutaway_cpu::SimdChoice;
use cutaway_io::samples::read_sample;
use cutaway_io::volume::ReadOptions;

/// Mode, look, light, and a name for them.
const CASES: [(Mode, Look, bool, &str); 7] = [
    (Mode::Composite, Look::Opaque, true, "opaque shaded"),
    (Mode::Composite, Look::Transparent, false, "transparent"),
    (Mode::Composite, Look::Transparent, true, "transparent shaded"),
    (Mode::Composite, Look::AlmostEmpty, false, "almost empty"),
    (Mode::Iso, Look::Opaque, true, "iso"),
    (Mode::Mip, Look::Transparent, false, "mip"),
    (Mode::Mean, Look::Transparent, false, "mean"),
];

fn volumes() -> Vec<(&'static str, Volume)> {
    let sample = |name| read_sample(name, &ReadOptions::default()).expect("a sample that is bundled").value;
    vec![
        ("marschner-lobb 256 u8", marschner_lobb(256, VoxelType::U8)),
        ("marschner-lobb 128 f32", marschner_lobb(128, VoxelType::F32)),
        ("bonsai", sample("bonsai")),
        ("mr-head", sample("mr-head")),
    ]
}

fn frame(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: String,
    scene: Scene,
    simd: SimdChoice,
    threads: usize,
) {
    // An instruction set that this processor does not have is left out.
    let Some(ready) = Ready::new(scene, simd, threads) else { return };
    group.throughput(Throughput::Elements(ready.frame().samples.max(1)));
    group.bench_function(name, |b| b.iter(|| ready.frame()));
}

fn modes(c: &mut Criterion) {
    for (volume_name, volume) in volumes() {
        let mut group = c.benchmark_group(format!("frames/{volume_name}"));
        group.sample_size(10);
        for (mode, look, shade, name) in CASES {
            frame(&mut group, name.to_owned(), scene(&volume, mode, look, shade), SimdChoice::Auto, 0);
        }
        group.finish();
    }
}

fn instructions_and_threads(c: &mut Criterion) {
    let volume = marschner_lobb(256, VoxelType::U16);
    let mut group = c.benchmark_group("frames/marschner-lobb 256 u16, transparent shaded");
    group.sample_size(10);
    let scene = || scene(&volume, Mode::Composite, Look::Transparent, true);
    for (name, simd) in
        [("scalar", SimdChoice::Scalar), ("avx2", SimdChoice::Avx2), ("avx512", SimdChoice::Avx512)]
    {
        frame(&mut group, format!("{name}, 1 thread"), scene(), simd, 1);
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let counts = std::iter::successors(Some(1), |n| Some(n * 2)).take_while(|n| *n <= cores);
    for threads in counts {
        frame(&mut group, format!("auto, {threads} threads"), scene(), SimdChoice::Auto, threads);
    }
    group.finish();
}

criterion_group!(benches, modes, instructions_and_threads);
criterion_main!(benches);
