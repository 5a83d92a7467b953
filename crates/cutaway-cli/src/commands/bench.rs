//! `cutaway bench`: measurements that are made the same way every time.

mod frames;
mod papers;
mod roofline;
mod table;

use std::path::Path;

use cutaway_io::image::{BitDepth, write_image};

use crate::args::{Bench, BenchArgs, BenchFrameArgs};
use crate::outputs::Outputs;
use crate::report::{self, Verbosity};
use crate::scene::Prepared;
use frames::Orbit;

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    match &args.bench {
        Bench::Frame(args) => frame(args),
        Bench::Roofline(args) => roofline::run(args),
        Bench::Papers(args) => papers::run(args),
    }
}

fn frame(args: &BenchFrameArgs) -> anyhow::Result<()> {
    let mut outputs = Outputs::default();
    if let Some(path) = &args.output {
        outputs.image("--output", path)?;
    }
    if let Some(path) = args.stats.as_ref().filter(|path| *path != Path::new("-")) {
        outputs.file("--stats", path)?;
    }
    outputs.check()?;
    let prepared = Prepared::new(&args.scene)?;
    prepared.report(Verbosity::Normal);
    let orbit = Orbit { frames: args.frames, degrees: args.orbit };
    let statistics = frames::measure(&prepared, &args.scene, orbit, |image| {
        if let Some(path) = &args.output {
            write_image(path, image, BitDepth::Eight)?;
        }
        Ok(())
    })?;
    match &args.stats {
        Some(path) => statistics.write(path),
        None => report::print(&statistics.text()?),
    }
}
