//! `cutaway render`: one image.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use cutaway_core::image::Image;
use cutaway_io::atomic::write_atomically;
use cutaway_io::image::{BitDepth, ImageFormat, encode_image, write_depth, write_image};

use super::session::Session;
use crate::args::{Bits, List, RenderArgs};
use crate::report::{Verbosity, wrong_use};
use crate::scene::{Prepared, show};

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let verbosity = Verbosity::new(args.quiet, args.verbose);
    // What cannot be written is refused before anything is rendered.
    for path in [Some(&args.output), args.depth_output.as_ref()].into_iter().flatten() {
        if path != Path::new("-") {
            ImageFormat::from_path(path).map_err(|e| wrong_use(e.to_string()))?;
        }
    }
    let background = args.background.as_ref().map(background).transpose()?;
    let prepared = Prepared::new(&args.scene)?;
    prepared.loaded.report(verbosity);
    describe(&prepared, verbosity);
    if let Some(path) = &args.save_scene {
        let text = serde_json::to_string_pretty(&prepared.to_file()?)? + "\n";
        write_atomically(path, |w| w.write_all(text.as_bytes())).context("could not write the scene")?;
    }
    let session = Session::new(&prepared, &args.scene)?;
    let progress = verbosity.progress("rendering");
    let (image, statistics, frame_ms) = session.frame(&|share| progress.set(share));
    drop(progress);
    let image = match background {
        Some(color) => image.over_background(color),
        None => image,
    };
    let statistics = session.statistics(statistics, vec![frame_ms]);
    verbosity.detail(|| {
        let [load, prepare, classify] =
            [statistics.load_ms, statistics.prepare_ms, statistics.classify_ms].map(|ms| ms.round());
        format!(
            "load {load} ms, prepare {prepare} ms, classify {classify} ms, render {} ms",
            frame_ms.round()
        )
    });
    write(args, &image)?;
    match &args.stats {
        Some(path) => statistics.write(path),
        None => Ok(()),
    }
}

fn write(args: &RenderArgs, image: &Image) -> anyhow::Result<()> {
    let depth = match args.bit_depth {
        Bits::Eight => BitDepth::Eight,
        Bits::Sixteen => BitDepth::Sixteen,
    };
    if args.output == Path::new("-") {
        let mut bytes = Vec::new();
        encode_image(image, ImageFormat::Png, depth, &mut bytes)?;
        std::io::stdout().lock().write_all(&bytes).context("could not write to standard output")?;
    } else {
        write_image(&args.output, image, depth)?;
    }
    if let Some(path) = &args.depth_output {
        write_depth(path, image)?;
    }
    Ok(())
}

/// A straight colour of three or four numbers in 0..=1.
fn background(list: &List) -> anyhow::Result<[f32; 4]> {
    let color = match list.0[..] {
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a] => [r, g, b, a],
        _ => {
            return Err(wrong_use(format!(
                "--background takes R,G,B or R,G,B,A; found {} numbers",
                list.0.len()
            )));
        }
    };
    match color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        Some(c) => Err(wrong_use(format!("--background: {c} is not within 0 to 1"))),
        None => Ok(color.map(|c| c as f32)),
    }
}

fn describe(prepared: &Prepared, verbosity: Verbosity) {
    verbosity.detail(|| {
        let volume = &prepared.loaded.volume;
        let [lo, hi] = volume.value_range();
        let d = volume.dimensions();
        format!("volume: {} x {} x {} {}, values {lo} to {hi}", d.x, d.y, d.z, volume.source_type().name())
    });
    verbosity.detail(|| {
        let c = &prepared.camera;
        format!("camera: at {} looking at {}, up {}", show(c.position), show(c.focal_point), show(c.view_up))
    });
    verbosity.detail(|| {
        let points = prepared.function.points().iter().map(|p| format!("{:.4}: {:.3}", p.value, p.opacity));
        format!("opacity: {}", points.collect::<Vec<_>>().join(", "))
    });
}
