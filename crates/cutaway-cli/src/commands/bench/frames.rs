//! Frames of an orbiting camera, measured the same way wherever a benchmark needs them.

use anyhow::Context;
use clap::Parser;
use cutaway_core::image::Image;
use cutaway_engine::FrameStatistics;

use crate::args::SceneArgs;
use crate::commands::empty::visible_fraction;
use crate::commands::session::Session;
use crate::commands::statistics::StatisticsFile;
use crate::report::Verbosity;
use crate::scene::Prepared;

/// Frames before the first one that is measured.
const WARM_UP: u32 = 3;

/// How many frames, and how far around.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orbit {
    pub(super) frames: u32,
    /// Degrees around the view-up direction.
    pub(super) degrees: f64,
}

/// Measures a scene. `first` gets the first image, which is that of the scene's own camera.
pub(super) fn measure(
    prepared: &Prepared,
    args: &SceneArgs,
    orbit: Orbit,
    mut first: impl FnMut(&Image) -> anyhow::Result<()>,
) -> anyhow::Result<StatisticsFile> {
    let mut session = Session::new(prepared, args, Verbosity::Quiet)?;
    let mut times = Vec::new();
    let mut last = (FrameStatistics::default(), 0.0);
    for i in 0..WARM_UP + orbit.frames {
        let mut camera = prepared.camera.clone();
        let measured = i.checked_sub(WARM_UP);
        let turn = f64::from(measured.unwrap_or(i % orbit.frames)) / f64::from(orbit.frames);
        camera.azimuth((orbit.degrees * turn).to_radians());
        session.set_camera(camera)?;
        let frame = session.frame(&|_| {})?;
        let image = frame.picture.into_image().context("the image stayed on the GPU")?;
        if measured.is_some() {
            times.push(frame.frame_ms);
            last = (frame.statistics, visible_fraction(&image));
        }
        if i == 0 {
            first(&image)?;
        }
    }
    let (counts, visible_fraction) = last;
    let visible_fraction = Some(visible_fraction);
    Ok(StatisticsFile { visible_fraction, ..session.statistics(counts, times) })
}

/// A scene as `cutaway bench frame` takes it.
#[derive(Parser)]
#[command(no_binary_name = true)]
struct SceneLine {
    #[command(flatten)]
    scene: SceneArgs,
}

/// The scene of a line that a user could give to `cutaway bench frame`: standard scenes are written so, and reports say
/// them, so that anyone can look at them and measure them alone.
pub(super) fn scene_of_line(line: &str) -> anyhow::Result<SceneArgs> {
    Ok(SceneLine::try_parse_from(line.split_whitespace())?.scene)
}
