//! NaN means nothing, on the GPU: ray caster, slices and cells show no cell that touches a NaN voxel. Without an adapter the
//! tests show as ignored.

use cutaway_core::scene::Mode;
use cutaway_core::volume::NanMeaning;
use cutaway_gpu::cells::{CellOptions, CellRenderer};
use cutaway_gpu::{Gpu, GpuOptions, RaycastRenderer, SliceRenderer};
use cutaway_testing::engines::{raycast, slices};
use cutaway_testing::gpus::there_is_an_adapter;
use cutaway_testing::missing::{border, covered, middle, scene};
use libtest_mimic::{Arguments, Failed, Trial};

type Check = fn(&Gpu) -> Result<(), Failed>;

fn main() {
    let arguments = Arguments::from_args();
    let there = there_is_an_adapter();
    let checks: [(&str, Check); 3] = [("raycast", by_raycast), ("slices", by_slices), ("cells", by_cells)];
    let trials = checks.map(|(name, check)| {
        let run = move || check(&Gpu::new(&GpuOptions::default())?);
        Trial::test(format!("report_34_{name}"), run).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

/// Fragments at the border of a cell may fall on its other side.
fn is_about(found: f64, area: f64, what: &str) -> Result<(), Failed> {
    if (found - area).abs() < 0.5 { Ok(()) } else { Err(format!("{what}: {found} for {area}").into()) }
}

fn by_raycast(gpu: &Gpu) -> Result<(), Failed> {
    let renderer = RaycastRenderer::new(gpu)?;
    for mode in [Mode::Composite, Mode::Mip] {
        let hole = scene(middle, NanMeaning::Transparent, mode, true);
        is_about(covered(&raycast(&hole, &renderer).0), 60.0, mode.name())?;
        let masked = scene(border, NanMeaning::Transparent, mode, true);
        is_about(covered(&raycast(&masked, &renderer).0), 36.0, mode.name())?;
    }
    Ok(())
}

fn by_slices(gpu: &Gpu) -> Result<(), Failed> {
    let renderer = SliceRenderer::new(gpu)?;
    for (holes, area) in [(middle as fn(u32, u32) -> bool, 60.0), (border, 36.0)] {
        let scene = scene(holes, NanMeaning::Transparent, Mode::Composite, true);
        is_about(covered(&slices(&scene, &renderer).0), area, "slices")?;
    }
    Ok(())
}

fn by_cells(gpu: &Gpu) -> Result<(), Failed> {
    let renderer = CellRenderer::new(gpu, CellOptions::default())?;
    for (holes, area) in [(middle as fn(u32, u32) -> bool, 60.0), (border, 36.0)] {
        let scene = scene(holes, NanMeaning::Transparent, Mode::Composite, true);
        let cells = renderer.prepare(scene.volume())?;
        let classification = renderer.classify(&cells, &scene)?;
        let (image, _) = renderer.render(&cells, &classification, &scene, &|_| {})?;
        is_about(covered(&image), area, "cells")?;
    }
    Ok(())
}
