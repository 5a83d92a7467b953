//! Skipping on the GPU changes what a frame takes, and not one bit of its image.
//!
//! Without an adapter these show as ignored.

use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Mode, RenderSettings, Sampling, Scene, SpaceSkipping};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::Volume;
use cutaway_gpu::RaycastStatistics;
use cutaway_gpu::context::{Fallbacks, Filtering};
use cutaway_testing::engines::raycast;
use cutaway_testing::gpus::{best, renderer, there_is_an_adapter};
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point};
use libtest_mimic::{Arguments, Failed, Trial};

type Outcome = Result<(), Failed>;

/// What is checked, by itself.
type Test = fn() -> Outcome;

fn main() {
    let arguments = Arguments::from_args();
    let tests: [(&str, Test); 7] = [
        ("emission_and_absorption_is_the_same", composite_is_the_same),
        ("every_way_of_sampling_is_the_same", every_way_of_sampling),
        ("projections_are_the_same_with_fewer_samples", projections_are_the_same),
        ("isosurfaces_are_the_same", isosurfaces_are_the_same),
        ("volumes_in_bricks_skip_by_ranges_of_the_host", bricks_are_the_same),
        ("a_dense_volume_is_not_skipped", nothing_to_skip),
        ("fetches_are_counted_by_pixel", fetches_by_pixel),
    ];
    let there = there_is_an_adapter();
    let trials = tests.into_iter().map(|(name, test)| Trial::test(name, test).with_ignored_flag(!there));
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

/// Mostly background with a few blobs, as 8-bit, 16-bit and float voxels, on an oblique grid; greater numbers are lesser
/// values.
fn volumes() -> Vec<(&'static str, Volume)> {
    volumes_of([70, 45, 38])
}

fn volumes_of(dimensions: [u32; 3]) -> Vec<(&'static str, Volume)> {
    let words = oblique_noise(dimensions.into(), 5);
    let above = |i: usize| (words.voxels().get(i) - 33_000.0).max(0.0);
    let indices = 0..words.voxels().len();
    let bytes: Vec<u8> = indices.clone().map(|i| (above(i) / 64.0).min(255.0) as u8).collect();
    let floats: Vec<f32> = indices.clone().map(|i| above(i) * 1e-3 - 7.0).collect();
    let blobs: Vec<u16> = indices.map(|i| above(i) as u16).collect();
    let (d, rescale, geometry) = (words.dimensions(), words.rescale(), *words.geometry());
    vec![
        ("u8", Volume::new(d, bytes, rescale, geometry).expect("a valid volume")),
        ("u16", Volume::new(d, blobs, rescale, geometry).expect("a valid volume")),
        ("f32", Volume::new(d, floats, rescale, geometry).expect("a valid volume")),
    ]
}

/// Opaque only within a narrow band, away from the background's value.
fn band(volume: &Volume) -> TransferFunction {
    let [lo, hi] = volume.value_range();
    let at = |share: f64| lo + share * (hi - lo);
    TransferFunction::new(vec![
        point(at(0.2), [0.9, 0.4, 0.2], 0.0),
        point(at(0.3), [0.9, 0.9, 0.2], 0.4),
        point(at(0.4), [0.2, 0.4, 0.9], 0.0),
    ])
    .expect("ordered points")
}

/// Visible everywhere: what projections find are extremes, which lie in no band.
fn ramp(volume: &Volume) -> TransferFunction {
    let [lo, hi] = volume.value_range();
    let ends = vec![point(lo, [0.2, 0.4, 0.9], 0.1), point(hi, [0.9, 0.9, 0.2], 0.9)];
    TransferFunction::new(ends).expect("ordered points")
}

fn scene(volume: &Volume, shade: bool, settings: RenderSettings) -> Scene {
    let lighting = Lighting { shade, ..Lighting::default() };
    let projection = matches!(settings.mode, Mode::Mip | Mode::Minip | Mode::Mean);
    let function = if projection { ramp(volume) } else { band(volume) };
    framed(volume, &function, lighting, RenderSettings { resolution: SMALL, ..settings })
}

fn sets() -> [(&'static str, Fallbacks); 3] {
    let none = Fallbacks::default();
    [
        ("all features", none.clone()),
        ("exact filtering", Fallbacks { filtering: Some(Filtering::Exact), ..none.clone() }),
        ("without norm16", Fallbacks { without_norm16: true, ..none }),
    ]
}

fn same(what: &str, a: &Image, b: &Image) -> Outcome {
    if a.pixels() == b.pixels() && a.depth() == b.depth() {
        return Ok(());
    }
    let differ = a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count();
    let largest = a.pixels().iter().zip(b.pixels()).flat_map(|(a, b)| (0..4).map(|i| (a[i] - b[i]).abs()));
    Err(format!("{what}: {differ} pixels differ, by {}", largest.fold(0.0, f32::max)).into())
}

/// Renders with and without skipping; the images must be the same.
fn with_and_without(
    volume: &Volume,
    shade: bool,
    settings: &RenderSettings,
    what: &str,
    (set, fallbacks): &(&'static str, Fallbacks),
) -> Result<[RaycastStatistics; 2], Failed> {
    let gpu = renderer(set, fallbacks)?;
    let [with, without] = [SpaceSkipping::Auto, SpaceSkipping::Off].map(|space_skipping| {
        raycast(&scene(volume, shade, RenderSettings { space_skipping, ..settings.clone() }), &gpu)
    });
    same(&format!("{what}, {set}"), &without.0, &with.0)?;
    if with.0.pixels().iter().all(|p| p[3] == 0.0) {
        return Err(format!("{what}, {set}: nothing is seen").into());
    }
    Ok([with.1, without.1])
}

fn composite_is_the_same() -> Outcome {
    for (name, volume) in &volumes() {
        for set in &sets() {
            for shade in [false, true] {
                let settings = RenderSettings { step: 0.4, ..RenderSettings::default() };
                let [with, without] = with_and_without(volume, shade, &settings, name, set)?;
                let (more, less) = (with.skipped_fraction, without.skipped_fraction);
                let shares = 0.0 <= less && less < more && more < 1.0;
                if with.samples >= without.samples || !shares {
                    return Err(format!("{name}: {more} is skipped, {less} without").into());
                }
            }
        }
    }
    Ok(())
}

fn every_way_of_sampling() -> Outcome {
    let usual = RenderSettings { step: 0.7, ..RenderSettings::default() };
    let ways = [
        ("pre-integrated", RenderSettings { pre_integration: true, ..usual.clone() }),
        ("adaptive", RenderSettings { adaptive_threshold: Some(0.02), ..usual.clone() }),
        ("on planes", RenderSettings { sampling: Sampling::Object, ..usual }),
    ];
    let [_, (_, volume), _] = &volumes()[..] else { unreachable!("three volumes") };
    for (way, settings) in &ways {
        let [with, _] = with_and_without(volume, true, settings, way, &sets()[0])?;
        if !(0.0..1.0).contains(&with.skipped_fraction) || with.skipped_fraction == 0.0 {
            return Err(format!("{way}: {} is skipped", with.skipped_fraction).into());
        }
    }
    Ok(())
}

fn projections_are_the_same() -> Outcome {
    for (name, volume) in &volumes() {
        for set in &sets() {
            for mode in [Mode::Mip, Mode::Minip, Mode::Mean] {
                let settings = RenderSettings { mode, step: 0.3, ..RenderSettings::default() };
                let what = format!("{name} {}", mode.name());
                let [with, without] = with_and_without(volume, false, &settings, &what, set)?;
                // Means take every sample; so do extremes where most of a volume is the extreme value.
                let fewer = with.samples < without.samples;
                if fewer == (mode == Mode::Mean) && mode != Mode::Mip {
                    return Err(format!("{what}: {} of {}", with.samples, without.samples).into());
                }
            }
        }
    }
    Ok(())
}

fn isosurfaces_are_the_same() -> Outcome {
    for (name, volume) in &volumes() {
        let [lo, hi] = volume.value_range();
        let iso = vec![lo + 0.3 * (hi - lo), lo + 0.55 * (hi - lo)];
        for set in &sets() {
            let settings = RenderSettings {
                mode: Mode::Iso,
                iso: iso.clone(),
                iso_opacity: 0.6,
                ..RenderSettings::default()
            };
            let [with, without] = with_and_without(volume, true, &settings, name, set)?;
            if with.samples >= without.samples || with.skipped_fraction != 0.0 {
                return Err(format!("{name}: {with:?} {without:?}").into());
            }
        }
    }
    Ok(())
}

fn bricks_are_the_same() -> Outcome {
    let fallbacks =
        Fallbacks { max_texture_3d: Some(69), filtering: Some(Filtering::Exact), ..Fallbacks::default() };
    let set = ("bricks", fallbacks);
    // Too long for a texture, and so thin that all of it fits in bricks: without skipping, nothing is coarser.
    for (name, volume) in &volumes_of([70, 18, 18]) {
        for mode in [Mode::Composite, Mode::Mip, Mode::Minip] {
            let settings = RenderSettings { mode, step: 0.5, ..RenderSettings::default() };
            with_and_without(volume, false, &settings, &format!("{name} {}", mode.name()), &set)?;
        }
    }
    Ok(())
}

fn nothing_to_skip() -> Outcome {
    let (_, volume) = volumes().swap_remove(0);
    let [lo, hi] = volume.value_range();
    let faint = TransferFunction::new(vec![point(lo, [1.0; 3], 0.01), point(hi, [0.5; 3], 0.02)])?;
    let settings = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    let lighting = Lighting { shade: false, ..Lighting::default() };
    let scene = framed(&volume, &faint, lighting, settings);
    let gpu = best()?;
    let prepared = gpu.prepare(&volume)?;
    let classification = gpu.classify(&prepared, &scene)?;
    let (_, statistics) = gpu.render(&prepared, &classification, &scene, &|_| {})?;
    let occupied = classification.occupied_fraction()?;
    if occupied != 1.0 || statistics.skipped_fraction != 0.0 {
        return Err(format!("{occupied} is occupied, {} is skipped", statistics.skipped_fraction).into());
    }
    Ok(())
}

fn fetches_by_pixel() -> Outcome {
    let (_, volume) = volumes().swap_remove(1);
    let scene = scene(&volume, true, RenderSettings::default());
    let gpu = best()?;
    let prepared = gpu.prepare(&volume)?;
    let classification = gpu.classify(&prepared, &scene)?;
    let (image, statistics) = gpu.render(&prepared, &classification, &scene, &|_| {})?;
    let (fetches, _) = gpu.fetch_counts(&prepared, &classification, &scene, &|_| {})?;
    let sum: u64 = fetches.counts().iter().map(|c| u64::from(*c)).sum();
    if fetches.size() != SMALL || sum != statistics.samples {
        return Err(format!("{sum} fetches in {:?}, {} in all", fetches.size(), statistics.samples).into());
    }
    // What is seen has been looked at.
    let unseen = image.pixels().iter().zip(fetches.counts()).any(|(p, count)| p[3] > 0.0 && *count == 0);
    let picture = fetches.false_color(fetches.most());
    if unseen || [picture.width(), picture.height()] != SMALL {
        return Err("a pixel that shows something took no fetch".into());
    }
    Ok(())
}
