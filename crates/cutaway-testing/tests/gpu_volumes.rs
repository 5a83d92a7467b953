//! Volumes of any size and kind on the GPU: in bricks as in one texture, in every format, and what becomes of too large ones
//! and of a device that is lost. Tiny limits stand in for large volumes.
//!
//! Without an adapter these show as ignored.

use cutaway_core::image::Image;
use cutaway_core::image::compare::compare;
use cutaway_core::lighting::Lighting;
use cutaway_core::reference;
use cutaway_core::scene::{Mode, RenderSettings, Scene, SpaceSkipping};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::Volume;
use cutaway_gpu::context::{Fallbacks, Filtering, Oversize, adapters};
use cutaway_gpu::{Gpu, GpuError, GpuOptions, Notice, RaycastRenderer};
use cutaway_testing::engines::raycast;
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, point, soft};
use cutaway_testing::tolerances::SAME_KERNEL;
use libtest_mimic::{Arguments, Failed, Trial};
use wgpu::TextureFormat as Format;

type Outcome = Result<(), Failed>;
type Test = (&'static str, fn() -> Outcome);

fn main() {
    let arguments = Arguments::from_args();
    let tests: [Test; 9] = [
        ("bricks_make_the_same_image_exact_filtering", || same_in_bricks(Some(Filtering::Exact), 1e-6)),
        // Coordinates in an atlas are other numbers than in a texture of the volume: rounding, which may move a sample to
        // the next entry of a table.
        ("bricks_make_the_same_image_hardware_filtering", || same_in_bricks(None, SAME_KERNEL.rmse)),
        ("only_visible_bricks_are_uploaded", only_visible_bricks),
        ("coarser_levels_stand_in_with_a_notice", coarser_levels),
        ("what_does_not_fit_is_refused_when_asked", refused_when_asked),
        ("what_fits_in_no_way_is_refused", refused),
        ("every_format_is_right", every_format),
        ("short_memory_takes_half_precision_with_a_notice", half_precision),
        ("a_lost_device_is_an_error", lost),
    ];
    // Asked once: listing adapters loads drivers.
    let there = !adapters().is_empty();
    if !there {
        eprintln!("no GPU adapter: tests of volumes on the GPU are ignored");
    }
    let trials = tests.into_iter().map(|(name, test)| Trial::test(name, test).with_ignored_flag(!there));
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

const DIMENSIONS: [u32; 3] = [70, 40, 33];

/// A renderer with limits and a choice for what is too large.
fn renderer(fallbacks: Fallbacks, oversize: Oversize) -> Result<RaycastRenderer, Failed> {
    let gpu = Gpu::new(&GpuOptions { fallbacks, oversize, ..GpuOptions::default() })?;
    Ok(RaycastRenderer::new(&gpu)?)
}

fn limited(fallbacks: Fallbacks) -> Result<RaycastRenderer, Failed> {
    renderer(fallbacks, Oversize::Coarsen)
}

/// The same field on an oblique grid as 8-bit, 16-bit and float voxels.
fn volumes() -> Vec<(&'static str, Volume)> {
    let words = oblique_noise(DIMENSIONS.into(), 11);
    let voxels = words.voxels();
    let make = |factor: f32| (0..voxels.len()).map(move |i| voxels.get(i) * factor);
    let bytes: Vec<u8> = make(1.0 / 256.0).map(|v| v as u8).collect();
    let floats: Vec<f32> = make(1e-3).collect();
    let geometry = *words.geometry();
    let (d, rescale) = (words.dimensions(), words.rescale());
    vec![
        ("u8", Volume::new(d, bytes, rescale, geometry).expect("a valid volume")),
        ("f32", Volume::new(d, floats, rescale, geometry).expect("a valid volume")),
        ("u16", words),
    ]
}

fn settings(volume: &Volume, mode: Mode) -> RenderSettings {
    let [lo, hi] = volume.value_range();
    let iso = if mode == Mode::Iso { vec![lo + 0.4 * (hi - lo), lo + 0.7 * (hi - lo)] } else { vec![] };
    RenderSettings { mode, iso, iso_opacity: 0.6, step: 0.5, resolution: SMALL, ..RenderSettings::default() }
}

fn scene(volume: &Volume, mode: Mode, shade: bool) -> Scene {
    let lighting = Lighting { shade, ..Lighting::default() };
    framed(volume, &soft(volume.value_range()), lighting, settings(volume, mode))
}

fn same(what: &str, expected: &Image, found: &Image, rmse: f64) -> Outcome {
    let c = compare(expected, found)?;
    if c.rmse <= rmse && c.non_finite_pixels == 0 {
        return Ok(());
    }
    Err(format!("{what}: rmse {:.2e}, largest {:.2e}; at most {rmse:.0e}", c.rmse, c.largest_difference)
        .into())
}

fn same_in_bricks(filtering: Option<Filtering>, rmse: f64) -> Outcome {
    let whole = limited(Fallbacks { filtering, ..Fallbacks::default() })?;
    let bricked = limited(Fallbacks { filtering, max_texture_3d: Some(66), ..Fallbacks::default() })?;
    for (kind, volume) in volumes() {
        for (mode, shade) in [
            (Mode::Composite, true),
            (Mode::Composite, false),
            (Mode::Iso, true),
            (Mode::Mip, false),
            (Mode::Minip, false),
            (Mode::Mean, false),
        ] {
            let scene = scene(&volume, mode, shade);
            let prepared = bricked.prepare(&volume)?;
            if prepared.voxels().brick_edge().is_none() {
                return Err("the volume is in one texture".into());
            }
            let what = format!("{kind}, {}, shaded {shade}", mode.name());
            same(&what, &raycast(&scene, &whole).0, &raycast(&scene, &bricked).0, rmse)?;
            if !prepared.notices().is_empty() {
                return Err(format!("{what}: {:?}", prepared.notices()).into());
            }
        }
        // Without skipping every brick is there, and every sample is taken.
        let settings =
            RenderSettings { space_skipping: SpaceSkipping::Off, ..settings(&volume, Mode::Composite) };
        let scene = framed(&volume, &soft(volume.value_range()), Lighting::default(), settings);
        same(kind, &raycast(&scene, &whole).0, &raycast(&scene, &bricked).0, rmse)?;
    }
    Ok(())
}

/// A field that is large in one corner only.
fn corner() -> Volume {
    let noise = oblique_noise(DIMENSIONS.into(), 5);
    let [nx, ny, nz] = DIMENSIONS.map(|n| n as usize);
    let voxels: Vec<u16> = (0..nx * ny * nz)
        .map(|i| {
            let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|c| c as f32);
            let near = 1.0 - (at[0] + at[1] + at[2]) / 60.0;
            (noise.voxels().get(i) * near.max(0.0)) as u16
        })
        .collect();
    Volume::new(noise.dimensions(), voxels, noise.rescale(), *noise.geometry()).expect("a valid volume")
}

/// Shows what is below a share of the range: the slope of the rescale is negative, so that large numbers are small values.
fn corner_scene(volume: &Volume, below: f64) -> Scene {
    let [lo, hi] = volume.value_range();
    let at = |share: f64| lo + share * (hi - lo);
    let function = TransferFunction::new(vec![
        point(at(below), [0.9, 0.4, 0.2], 0.5),
        point(at(below + 0.1), [0.8, 0.9, 0.9], 0.0),
    ]);
    let lighting = Lighting { shade: true, ..Lighting::default() };
    framed(volume, &function.expect("ordered points"), lighting, settings(volume, Mode::Composite))
}

fn only_visible_bricks() -> Outcome {
    let volume = corner();
    // Two thirds of what the voxels take, and the borders of bricks come on top.
    let bricked = limited(Fallbacks { max_bytes: Some(120_000), ..Fallbacks::default() })?;
    let whole = limited(Fallbacks::default())?;
    let lighting = Lighting { shade: true, ..Lighting::default() };
    // The rescale's slope is negative: large numbers are small values.
    let of = |low: f64| {
        let [lo, hi] = volume.value_range();
        let at = |share: f64| lo + share * (hi - lo);
        let function = TransferFunction::new(vec![
            point(at(low), [0.9, 0.4, 0.2], 0.5),
            point(at(low + 0.1), [0.8, 0.9, 0.9], 0.0),
        ]);
        framed(
            &volume,
            &function.expect("ordered points"),
            lighting.clone(),
            settings(&volume, Mode::Composite),
        )
    };
    let (few, more) = (of(0.2), of(0.35));
    let prepared = bricked.prepare(&volume)?;
    let first = bricked.classify(&prepared, &few)?;
    let uploaded = prepared.voxels().uploaded_bricks();
    if uploaded == 0 || !first.notices().is_empty() {
        return Err(format!("{uploaded} bricks uploaded, {:?}", first.notices()).into());
    }
    same("few", &raycast(&few, &whole).0, &bricked.render(&prepared, &first, &few, &|_| {})?.0, 1e-5)?;
    let second = bricked.classify(&prepared, &more)?;
    same("more", &raycast(&more, &whole).0, &bricked.render(&prepared, &second, &more, &|_| {})?.0, 1e-5)?;
    if !second.notices().is_empty() {
        return Err(format!("{:?}", second.notices()).into());
    }
    // The first classification still draws what it did.
    same("few again", &raycast(&few, &whole).0, &bricked.render(&prepared, &first, &few, &|_| {})?.0, 1e-5)
}

/// A field that changes slowly, of which every value occurs in many places.
fn slow() -> Volume {
    let [nx, ny, nz] = DIMENSIONS;
    let wave = |i: u32, length: f32| (i as f32 / length).sin();
    let voxels: Vec<u8> = (0..nx * ny * nz)
        .map(|i| {
            let sum = wave(i % nx, 9.0) + wave(i / nx % ny, 7.0) + wave(i / (nx * ny), 8.0);
            (127.0 + 42.0 * sum) as u8
        })
        .collect();
    let like = oblique_noise(DIMENSIONS.into(), 1);
    Volume::new(like.dimensions(), voxels, like.rescale(), *like.geometry()).expect("a valid volume")
}

/// Half the bytes of the voxels: every mode shows parts of the volume as averages of two or more voxels.
fn coarser_levels() -> Outcome {
    let whole = limited(Fallbacks::default())?;
    let bricked = limited(Fallbacks { max_bytes: Some(48_000), ..Fallbacks::default() })?;
    let volume = slow();
    for mode in Mode::ALL {
        let scene = scene(&volume, mode, true);
        let prepared = bricked.prepare(&volume)?;
        let classification = bricked.classify(&prepared, &scene)?;
        let notices = classification.notices();
        let coarser = notices.iter().any(|n| matches!(n, Notice::Coarser { factor: 2..=8, .. }));
        if !coarser || prepared.voxels().bytes() > 60_000 {
            return Err(format!("{notices:?}, {} bytes", prepared.voxels().bytes()).into());
        }
        let found = bricked.render(&prepared, &classification, &scene, &|_| {})?.0;
        // Averages flatten waves by a few hundredths, and surfaces move by a fraction of a voxel.
        same(mode.name(), &raycast(&scene, &whole).0, &found, 0.08)?;
    }
    Ok(())
}

fn refused_when_asked() -> Outcome {
    let limits = Fallbacks { max_bytes: Some(120_000), ..Fallbacks::default() };
    let bricked = renderer(limits, Oversize::Refuse)?;
    let volume = corner();
    let prepared = bricked.prepare(&volume)?;
    match bricked.classify(&prepared, &scene(&volume, Mode::Mip, false)) {
        Err(GpuError::TooLarge { reason, .. }) if reason.contains("needs") => {}
        other => return Err(format!("{other:?}").into()),
    }
    // What is visible of the same volume fits.
    bricked.classify(&prepared, &corner_scene(&volume, 0.2))?;
    Ok(())
}

fn refused() -> Outcome {
    let (_, volume) = volumes().swap_remove(0);
    for limits in [
        Fallbacks { max_texture_3d: Some(10), ..Fallbacks::default() },
        Fallbacks { max_bytes: Some(1000), ..Fallbacks::default() },
    ] {
        match limited(limits)?.prepare(&volume) {
            Err(GpuError::TooLarge { reason, .. }) if reason.contains("take `--engine cpu`") => {}
            other => return Err(format!("{other:?}").into()),
        }
    }
    Ok(())
}

fn every_format() -> Outcome {
    let exact = limited(Fallbacks { filtering: Some(Filtering::Exact), ..Fallbacks::default() })?;
    for (kind, volume) in volumes() {
        let scene = scene(&volume, Mode::Composite, true);
        let expected = raycast(&scene, &exact).0;
        let c = compare(&reference::render(&scene), &expected)?;
        if c.rmse > 0.01 {
            return Err(format!("{kind}: rmse {:.4} from the reference", c.rmse).into());
        }
        for format in [None, Some(Format::R16Unorm), Some(Format::R16Float), Some(Format::R32Float)] {
            let renderer = limited(Fallbacks { texel_format: format, ..Fallbacks::default() })?;
            let texels = *renderer.prepare(&volume)?.voxels().texels();
            let what = format!("{kind} as {:?}, {:?}", texels.format, texels.filtering);
            // A real adapter's filter has weights of eight bits, and 16-bit floats round floats.
            same(&what, &expected, &raycast(&scene, &renderer).0, 2e-3)?;
        }
    }
    Ok(())
}

fn half_precision() -> Outcome {
    let whole = limited(Fallbacks::default())?;
    let (_, volume) = volumes().swap_remove(1);
    let voxels = volume.voxels().len() as u64;
    let short = limited(Fallbacks { max_bytes: Some(3 * voxels), ..Fallbacks::default() })?;
    let prepared = short.prepare(&volume)?;
    let notices = prepared.notices();
    let told =
        notices.iter().any(|n| matches!(n, Notice::HalfPrecision { needed, .. } if *needed == 4 * voxels));
    if !told || prepared.voxels().texels().format != Format::R16Float {
        return Err(format!("{notices:?}, {:?}", prepared.voxels().texels()).into());
    }
    let scene = scene(&volume, Mode::Composite, true);
    same("half precision", &raycast(&scene, &whole).0, &raycast(&scene, &short).0, 2e-3)
}

fn lost() -> Outcome {
    for limits in [Fallbacks::default(), Fallbacks { max_texture_3d: Some(66), ..Fallbacks::default() }] {
        let renderer = limited(limits)?;
        let (_, volume) = volumes().swap_remove(0);
        let scene = scene(&volume, Mode::Composite, true);
        let prepared = renderer.prepare(&volume)?;
        let classification = renderer.classify(&prepared, &scene)?;
        renderer.render(&prepared, &classification, &scene, &|_| {})?;
        renderer.gpu().device().destroy();
        let again = [
            renderer.render(&prepared, &classification, &scene, &|_| {}).map(drop),
            renderer.classify(&prepared, &scene).map(drop),
            renderer.prepare(&volume).map(drop),
            renderer.render(&prepared, &classification, &scene, &|_| {}).map(drop),
        ];
        for (i, outcome) in again.into_iter().enumerate() {
            if !matches!(outcome, Err(GpuError::Lost { .. })) {
                return Err(format!("call {i}: {outcome:?}").into());
            }
        }
    }
    Ok(())
}
