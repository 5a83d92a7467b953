//! Progressive rendering: whole from the first call, the full image in the end, and ended where asked. Budgets here are
//! nothing or without end: how much a clock allows is no matter of a test.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use cutaway_core::analytic::AnalyticField;
use cutaway_core::image::Image;
use cutaway_core::image::compare::compare;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{ImageInterpolation, Mode, RenderSettings, Scene};
use cutaway_core::volume::Volume;
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, SimdChoice, Step};
use cutaway_testing::scenes::{framed, soft};

const NO_TIME: Duration = Duration::ZERO;
const ALL_TIME: Duration = Duration::MAX;
static ON: AtomicBool = AtomicBool::new(false);
static OFF: AtomicBool = AtomicBool::new(true);

fn scene(volume: &Volume, mode: Mode, resolution: [u32; 2]) -> Scene {
    let [lo, hi] = volume.value_range();
    let iso = if mode == Mode::Iso { vec![0.5 * (lo + hi)] } else { vec![] };
    let settings = RenderSettings { mode, iso, resolution, ..RenderSettings::default() };
    framed(volume, &soft([lo, hi]), Lighting::default(), settings)
}

/// A renderer and what it has made ready.
struct Ready {
    renderer: CpuRenderer,
    volume: CpuVolume,
    classification: Classification,
}

impl Ready {
    fn new(scene: &Scene, threads: usize) -> Self {
        let renderer = CpuRenderer::new(threads, SimdChoice::Auto).unwrap();
        let volume = renderer.prepare(scene.volume()).unwrap();
        let classification = renderer.classify(&volume, scene);
        Self { renderer, volume, classification }
    }

    fn full(&self, scene: &Scene) -> Image {
        self.renderer.render(&self.volume, &self.classification, scene, &|_| {}).0
    }
}

#[test]
fn the_last_image_is_that_of_render_bit_for_bit() {
    let volume = AnalyticField::MarschnerLobb.volume(40);
    for mode in Mode::ALL {
        for (threads, resolution, budget) in
            [(1, [131, 77], NO_TIME), (3, [131, 77], ALL_TIME), (2, [20, 31], NO_TIME), (2, [1, 1], ALL_TIME)]
        {
            let scene = scene(&volume, mode, resolution);
            let ready = Ready::new(&scene, threads);
            let mut progressive = ready.renderer.progressive(&ready.volume, &ready.classification, &scene);
            let mut calls = 0;
            while !progressive.advance(budget, &ON).done {
                calls += 1;
                assert!(calls < 1000, "no progress");
            }
            assert_eq!(progressive.image(), ready.full(&scene), "{}, {resolution:?}", mode.name());
            assert!(budget == NO_TIME || calls == 0);
        }
    }
}

#[test]
fn every_call_casts_at_least_a_tile_and_the_first_one_leaves_a_whole_image() {
    let volume = AnalyticField::Torus.volume(40);
    let scene = scene(&volume, Mode::Composite, [260, 190]);
    let ready = Ready::new(&scene, 1);
    let full = ready.full(&scene);
    let mut progressive = ready.renderer.progressive(&ready.volume, &ready.classification, &scene);
    let mut rmse = f64::INFINITY;
    let mut last = Step { finished_share: 0.0, spacing: u32::MAX, done: false, cancelled: false };
    // One tile of 9 x 6 pixels at a spacing of 32, of 34 x 25 at 8, of 66 x 49 at 4, then 9 x 6 tiles.
    let (mut calls, mut spacings) = (0, Vec::new());
    while !last.done {
        let step = progressive.advance(NO_TIME, &ON);
        assert!(!step.cancelled && step.spacing > 0 && step.spacing <= last.spacing);
        assert!(step.finished_share >= last.finished_share);
        if step.spacing < last.spacing {
            spacings.push(step.spacing);
            let error = compare(&full, &progressive.image()).unwrap().rmse;
            assert!(error < rmse, "{error} at a spacing of {}, {rmse} before", step.spacing);
            rmse = error;
        }
        if calls == 0 {
            // Usable: something where there is something.
            assert!(rmse < 0.1, "{rmse}");
        }
        calls += 1;
        last = step;
    }
    assert_eq!(*spacings.last().unwrap(), 1);
    assert!(spacings.len() >= 3, "{spacings:?}");
    assert_eq!((last.finished_share, rmse), (1.0, 0.0));
    // One thread casts one tile a call.
    assert!((54..=80).contains(&calls), "{calls}");
    let after = progressive.advance(NO_TIME, &ON);
    assert_eq!(after, last, "nothing is left to do");
}

#[test]
fn a_set_flag_ends_a_call_and_leaves_the_image() {
    let volume = AnalyticField::Torus.volume(40);
    let scene = scene(&volume, Mode::Composite, [260, 190]);
    let ready = Ready::new(&scene, 2);
    let mut progressive = ready.renderer.progressive(&ready.volume, &ready.classification, &scene);
    let before = progressive.advance(ALL_TIME, &OFF);
    assert_eq!(before, Step { finished_share: 0.0, spacing: 0, done: false, cancelled: true });
    assert!(progressive.image().pixels().iter().all(|p| *p == [0.0; 4]));
    for _ in 0..10 {
        progressive.advance(NO_TIME, &ON);
    }
    let (image, statistics) = (progressive.image(), progressive.statistics());
    let step = progressive.advance(ALL_TIME, &OFF);
    assert!(step.cancelled && !step.done && step.finished_share < 1.0 && step.spacing > 0);
    assert_eq!((image, statistics), (progressive.image(), progressive.statistics()));
    assert!(progressive.image().pixels().iter().any(|p| p[3] > 0.1));
    // And it goes on from there.
    assert!(progressive.advance(ALL_TIME, &ON).done);
    assert_eq!(progressive.image(), ready.full(&scene));
    assert!(!progressive.advance(ALL_TIME, &OFF).cancelled, "what is done cannot be cancelled");
}

#[test]
fn a_flag_set_meanwhile_ends_the_call() {
    // More work than a test waits for, were it not ended; the flag is set once a first image is there.
    let volume = AnalyticField::MarschnerLobb.volume(40);
    let scene = scene(&volume, Mode::Mean, [4096, 4096]);
    let ready = Ready::new(&scene, 2);
    let mut progressive = ready.renderer.progressive(&ready.volume, &ready.classification, &scene);
    progressive.advance(NO_TIME, &ON);
    let cancel = AtomicBool::new(false);
    let step = std::thread::scope(|threads| {
        let call = threads.spawn(|| progressive.advance(ALL_TIME, &cancel));
        cancel.store(true, std::sync::atomic::Ordering::Relaxed);
        call.join().unwrap()
    });
    assert!(step.cancelled && !step.done, "{step:?}");
}

#[test]
fn interpolation_has_no_part_in_the_last_image() {
    let volume = AnalyticField::Torus.volume(40);
    let plain = scene(&volume, Mode::Composite, [101, 67]);
    let settings =
        RenderSettings { image_interpolation: ImageInterpolation::Factor(8), ..plain.settings().clone() };
    let coarse = framed(&volume, &soft(volume.value_range()), Lighting::default(), settings);
    let ready = Ready::new(&plain, 2);
    let mut progressive = ready.renderer.progressive(&ready.volume, &ready.classification, &coarse);
    assert!(progressive.advance(ALL_TIME, &ON).done);
    assert_eq!(progressive.image(), ready.full(&plain));
    assert_ne!(progressive.image(), ready.full(&coarse));
}
