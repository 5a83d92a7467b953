//! The CPU engine stage by stage, on all cores with the widest instructions: `cargo bench -p cutaway-testing --bench stages`.
//!
//! `ranges` and `classify` are measured alone. What follows is measured as frames that do little else: `traverse` is a
//! frame in which nearly nothing can be seen; `sample` one that takes every sample for a mean; `composite` and `shade`
//! are what the same samples take longer with a transfer function, and with light on top.

mod common;

use std::time::{Duration, Instant};

use common::{Look, Ready, marschner_lobb, scene};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use cutaway_core::scene::Mode;
use cutaway_core::volume::VoxelType;
use cutaway_cpu::{CpuRenderer, SimdChoice};

fn before_frames(c: &mut Criterion) {
    let volume = marschner_lobb(512, VoxelType::U8);
    let renderer = CpuRenderer::new(0, SimdChoice::Auto).expect("threads");
    let mut group = c.benchmark_group("stages/512");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(volume.voxels().bytes() as u64));
    group.bench_function("ranges", |b| b.iter(|| renderer.prepare(&volume).expect("a volume of usual size")));
    let prepared = renderer.prepare(&volume).expect("a volume of usual size");
    let scene = scene(&volume, Mode::Composite, Look::Opaque, true);
    group.throughput(Throughput::Elements(prepared.ranges().level0.blocks.len() as u64));
    group.bench_function("classify", |b| b.iter(|| renderer.classify(&prepared, &scene)));
    group.finish();
}

fn in_frames(c: &mut Criterion) {
    let volume = marschner_lobb(256, VoxelType::U16);
    let ready = |mode, look, shade| {
        Ready::new(scene(&volume, mode, look, shade), SimdChoice::Auto, 0).expect("the widest there is")
    };
    let empty = ready(Mode::Composite, Look::AlmostEmpty, false);
    let mean = ready(Mode::Mean, Look::Transparent, false);
    let plain = ready(Mode::Composite, Look::Transparent, false);
    let shaded = ready(Mode::Composite, Look::Transparent, true);
    let mut group = c.benchmark_group("stages/256");
    group.sample_size(20);
    group.throughput(Throughput::Elements(empty.frame().rays));
    group.bench_function("traverse (rays)", |b| b.iter(|| empty.frame()));
    group.throughput(Throughput::Elements(mean.frame().samples));
    group.bench_function("sample", |b| b.iter(|| mean.frame()));
    group.throughput(Throughput::Elements(shaded.frame().samples));
    difference(&mut group, "composite", &plain, &mean);
    difference(&mut group, "shade", &shaded, &plain);
    group.finish();
}

/// How much longer frames of `more` take than those of `less`; one after the other, so that both see the same machine.
fn difference(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, more: &Ready, less: &Ready) {
    group.bench_function(name, |b| {
        b.iter_custom(|frames| {
            let (mut longer, mut shorter) = (Duration::ZERO, Duration::ZERO);
            for _ in 0..frames {
                let started = Instant::now();
                less.frame();
                let between = Instant::now();
                more.frame();
                shorter += between - started;
                longer += between.elapsed();
            }
            // Criterion divides by it.
            longer.saturating_sub(shorter).max(Duration::from_nanos(1))
        });
    });
}

criterion_group!(benches, before_frames, in_frames);
criterion_main!(benches);
