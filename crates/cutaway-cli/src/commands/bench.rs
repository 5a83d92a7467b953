//! `cutaway bench`: measurements that are made the same way every time.

use std::path::Path;

use cutaway_io::image::{BitDepth, write_image};

use super::session::{Counts, Session};
use crate::args::{Bench, BenchArgs, BenchFrameArgs};
use crate::outputs::Outputs;
use crate::report::{self, Verbosity};
use crate::scene::Prepared;

/// Frames before the first one that is measured.
const WARM_UP: u32 = 3;

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    match &args.bench {
        Bench::Frame(args) => frame(args),
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
    prepared.loaded.report(Verbosity::Normal);
    let mut session = Session::new(&prepared, &args.scene)?;
    let mut times = Vec::new();
    let mut last = Counts::default();
    for i in 0..WARM_UP + args.frames {
        let mut camera = prepared.camera.clone();
        let measured = i.checked_sub(WARM_UP);
        let turn = f64::from(measured.unwrap_or(i % args.frames)) / f64::from(args.frames);
        camera.azimuth((args.orbit * turn).to_radians());
        session.set_camera(camera)?;
        let (image, statistics, ms) = session.frame(&|_| {});
        if let (0, Some(path)) = (i, &args.output) {
            write_image(path, &image, BitDepth::Eight)?;
        }
        if measured.is_some() {
            times.push(ms);
            last = statistics;
        }
    }
    let statistics = session.statistics(last, times);
    match &args.stats {
        Some(path) => statistics.write(path),
        None => report::print(&statistics.text()?),
    }
}
