//! Random scenes through the GPU ray caster: no panic, no error, no NaN; and tame ones against the reference.
//!
//! `CUTAWAY_RANDOM_SCENES=10000` tries more of them, from `CUTAWAY_RANDOM_FIRST` on (so that several processes can share
//! them), `CUTAWAY_RANDOM_SEED=17` one alone, saying what it is made of. A failure prints its seed and its scene;
//! `CUTAWAY_RANDOM_TABLE=1` prints how far off each tame one is.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use cutaway_core::clip::BufferDepth;
use cutaway_core::image::Image;
use cutaway_core::reference;
use cutaway_core::scene::{Gradient, ImageInterpolation, RenderSettings, Sampling};
use cutaway_gpu::{GpuError, RaycastRenderer};
use cutaway_testing::gpus::{fallback_sets, renderer, small_textures, there_is_an_adapter};
use cutaway_testing::random_scenes::RandomScene;
use libtest_mimic::{Arguments, Failed, Trial};

/// Scenes tried unless the environment says otherwise: on a software adapter most of the time goes into compiling shaders.
const SCENES: u64 = 100;

/// Failures after which no more scenes are tried.
const MOST_FAILURES: usize = 8;

/// The step that tame scenes are compared at, in units of the smallest spacing.
const FINE_STEP: f64 = 0.1;

/// A pixel this far off is another picture: at a silhouette, a ray may meet a surface in f64 and miss it in f32. One pixel and
/// two of a hundred may be.
const OFF: f32 = 0.1;

/// Mean of the others' largest differences of a channel, at steps of a tenth of a voxel.
const MEAN_DIFFERENCE: f64 = 0.002;

fn main() {
    let arguments = Arguments::from_args();
    let trial = Trial::test("random_scenes", random_scenes).with_ignored_flag(!there_is_an_adapter());
    libtest_mimic::run(&arguments, vec![trial]).exit();
}

fn number(variable: &str) -> Result<Option<u64>, Failed> {
    match std::env::var(variable) {
        Err(_) => Ok(None),
        Ok(text) => text.parse().map(Some).map_err(|e| format!("{variable} is `{text}`: {e}").into()),
    }
}

fn random_scenes() -> Result<(), Failed> {
    if let Some(seed) = number("CUTAWAY_RANDOM_SEED")? {
        println!("{}", RandomScene::new(seed).describe());
        let renderer = renderer_of(seed)?;
        return render(seed, &renderer).map_err(Failed::from);
    }
    let count = number("CUTAWAY_RANDOM_SCENES")?.unwrap_or(SCENES);
    let first = number("CUTAWAY_RANDOM_FIRST")?.unwrap_or(0);
    let began = Instant::now();
    let mut failures = Vec::new();
    let mut tried_scenes = 0;
    for seed in first..first.saturating_add(count) {
        tried_scenes += 1;
        let renderer = renderer_of(seed)?;
        let tried = catch_unwind(AssertUnwindSafe(|| render(seed, &renderer)));
        let failure = match tried {
            Ok(Ok(())) => continue,
            Ok(Err(failure)) => failure,
            Err(_) => "it panicked".to_owned(),
        };
        failures.push(format!("{failure}\n{}", RandomScene::new(seed).describe()));
        if failures.len() == MOST_FAILURES {
            break;
        }
    }
    println!("{tried_scenes} scenes, {} failures, in {:.1} s", failures.len(), began.elapsed().as_secs_f64());
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n\n").into()) }
}

/// The set of fallbacks of which one brick of a volume is as much as a texture holds.
const SMALL_TEXTURES: &str = "small textures";

fn set_of(seed: u64) -> &'static str {
    match seed % 20 {
        0 => "without anything",
        1 => "exact filtering",
        2 => SMALL_TEXTURES,
        _ => "all features",
    }
}

/// Most scenes take the device as it is; some one without anything that can be missing, or with exact values.
fn renderer_of(seed: u64) -> Result<Arc<RaycastRenderer>, Failed> {
    let wanted = set_of(seed);
    let mut sets = fallback_sets();
    sets.push(small_textures());
    let (name, fallbacks) =
        sets.iter().find(|(name, _)| *name == wanted).ok_or("no such set of fallbacks")?;
    Ok(renderer(name, fallbacks)?)
}

fn render(seed: u64, renderer: &RaycastRenderer) -> Result<(), String> {
    let made = RandomScene::new(seed);
    let scene = made.scene_with(made.settings.clone()).map_err(|e| format!("no scene: {e}"))?;
    let prepared = renderer.prepare(&made.volume).map_err(|e| e.to_string())?;
    let classification = renderer.classify(&prepared, &scene).map_err(|e| e.to_string())?;
    let (image, statistics) = match renderer.render(&prepared, &classification, &scene, &|_| {}) {
        Ok(rendered) => rendered,
        // Of a volume in bricks there are none; only the small textures need them.
        Err(GpuError::OutOfMemory { what })
            if set_of(seed) == SMALL_TEXTURES && what.starts_with("precomputed gradients") =>
        {
            return Ok(());
        }
        Err(error) => return Err(error.to_string()),
    };
    let [width, height] = made.settings.resolution;
    sound(&image)?;
    // At most one ray a pixel, and the points of a lattice of every second pixel, which reaches beyond the border.
    let pixels = u64::from(width) * u64::from(height);
    let lattice = match made.settings.image_interpolation {
        ImageInterpolation::Off => 0,
        _ => u64::from(width / 2 + 2) * u64::from(height / 2 + 2),
    };
    if statistics.rays > pixels + lattice {
        return Err(format!("{} rays of {width} x {height} pixels", statistics.rays));
    }
    if made.tame { compare_with_reference(&made, renderer) } else { Ok(()) }
}

/// No NaN, nothing infinite, no opacity beyond 1, nothing behind the eye.
fn sound(image: &Image) -> Result<(), String> {
    for (i, p) in image.pixels().iter().enumerate() {
        let (x, y) = (i as u32 % image.width(), i as u32 / image.width());
        let alpha = (-1e-5..=1.0 + 1e-5).contains(&p[3]);
        if !p.iter().all(|c| c.is_finite() && *c >= -1e-5) || !alpha {
            return Err(format!("pixel {x}, {y} is {p:?}"));
        }
        let depth = image.depth().map_or(0.0, |depths| depths[i]);
        if depth.is_nan() || depth < -1e-3 * depth.abs().max(1.0) {
            return Err(format!("depth {x}, {y} is {depth}"));
        }
    }
    Ok(())
}

fn compare_with_reference(made: &RandomScene, renderer: &RaycastRenderer) -> Result<(), String> {
    let settings = RenderSettings {
        step: FINE_STEP,
        early_termination: 1.0,
        // What is not the integral itself, but a way to come near to it.
        sampling: Sampling::View,
        gradient: Gradient::Central,
        image_interpolation: ImageInterpolation::Off,
        adaptive_threshold: None,
        pre_integration: false,
        jitter: false,
        blur: 0.0,
        buffer_depth: BufferDepth::Single,
        ..made.settings.clone()
    };
    let scene = made.scene_with(settings).map_err(|e| format!("no scene: {e}"))?;
    let prepared = renderer.prepare(&made.volume).map_err(|e| e.to_string())?;
    let classification = renderer.classify(&prepared, &scene).map_err(|e| e.to_string())?;
    let (image, _) =
        renderer.render(&prepared, &classification, &scene, &|_| {}).map_err(|e| e.to_string())?;
    sound(&image)?;
    // What is visible did not fit: it was made coarser, and says so.
    if !prepared.notices().is_empty() {
        return Ok(());
    }
    let expected = reference::render(&scene);
    let (mut off, mut sum) = (0, 0.0);
    for (a, b) in expected.pixels().iter().zip(image.pixels()) {
        let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0f32, f32::max);
        if difference > OFF {
            off += 1;
        } else {
            sum += f64::from(difference);
        }
    }
    let pixels = image.pixels().len();
    let mean = sum / pixels as f64;
    if std::env::var_os("CUTAWAY_RANDOM_TABLE").is_some() {
        println!("| {} | {} | {off} | {pixels} | {mean:.6} |", made.seed, made.settings.mode.name());
    }
    if off > 1 + pixels / 50 || mean > MEAN_DIFFERENCE {
        let mode = made.settings.mode.name();
        return Err(format!(
            "{mode}: {off} of {pixels} pixels are off by more than {OFF}, the others by {mean:.5}"
        ));
    }
    Ok(())
}
