//! Requests of the window on the engines of `cutaway-engine`: frames as the window draws them.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_engine::{EngineError, Picture, Refinement, Renderer, Setup};
use cutaway_gpu::Gpu;

use super::{Frame, MOVING_BUDGET, Pixels, Request, Shown, Took};

/// The reason why a picture was not finished.
#[derive(Clone, Debug, PartialEq)]
pub enum Interrupt {
    /// Something newer is wanted.
    Overtaken,
    /// It cannot be made: one line.
    Failed(String),
}

impl<E: std::error::Error + 'static> From<E> for Interrupt {
    fn from(error: E) -> Self {
        let engine = (&error as &dyn std::error::Error).downcast_ref::<EngineError>();
        match engine {
            Some(EngineError::Cancelled) => Self::Overtaken,
            _ => Self::Failed(error.to_string()),
        }
    }
}

/// Where frames go.
pub type HandOver<'a> = dyn FnMut(Frame) -> Result<(), Interrupt> + 'a;

/// Time between the frames of a picture that is being refined.
const REFINING_BUDGET: Duration = Duration::from_millis(150);

/// Time that a coarse picture stands before it is refined. While something moves the next request comes sooner, and the
/// window needs the processor to draw itself.
const STANDING: Duration = Duration::from_millis(70);

/// The renderer of the window.
#[derive(Debug, Default)]
pub struct Engines {
    renderer: Renderer,
    /// True if the device is the window's: pictures stay there.
    shared: bool,
}

impl Engines {
    /// Returns engines on the window's device: pictures stay on it.
    pub fn sharing(gpu: Gpu) -> Self {
        Self { renderer: Renderer::sharing(Setup::default(), gpu), shared: true }
    }

    /// Renders what is wanted, coarse first, and hands over every frame; ends early once `overtaken` is set.
    ///
    /// # Errors
    /// Why the picture is not complete.
    pub fn render(
        &mut self,
        request: &Request,
        overtaken: &AtomicBool,
        hand_over: &mut HandOver<'_>,
    ) -> Result<(), Interrupt> {
        let scene = scene(request)?;
        let refinement = Refinement {
            first: MOVING_BUDGET,
            between: REFINING_BUDGET,
            stand: STANDING,
            overtaken,
            debug: request.debug,
            on_device: self.shared,
        };
        let mut stopped = None;
        let refined = self.renderer.refine(&scene, &refinement, &mut |frame| match hand_over(shown(frame)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(interrupt) => {
                stopped = Some(interrupt);
                ControlFlow::Break(())
            }
        });
        stopped.map_or(Ok(refined?), Err)
    }

    /// Starts the engine again for the next picture: its shaders have changed.
    #[cfg(feature = "watch-shaders")]
    pub(super) fn restart(&mut self) {
        self.renderer.restart();
    }

    /// Renders a whole picture, as good as it gets. `progress` is called with the finished share, 0..=1.
    ///
    /// # Errors
    /// Why there is none, in a line.
    pub fn still(&mut self, request: &Request, progress: &(dyn Fn(f32) + Sync)) -> Result<Image, Interrupt> {
        let asked =
            cutaway_engine::Request { debug: request.debug, progress, ..cutaway_engine::Request::default() };
        let frame = self.renderer.render(&scene(request)?, &asked)?;
        frame
            .picture
            .into_image()
            .ok_or_else(|| Interrupt::Failed("the picture stayed on the GPU".to_owned()))
    }
}

fn scene(request: &Request) -> Result<Scene, Interrupt> {
    Ok(request.state.scene(&request.volume.data, request.clip.as_ref(), request.size)?)
}

/// A frame as the window draws it.
fn shown(frame: cutaway_engine::Frame) -> Frame {
    let cutaway_engine::Frame { picture, spacing, statistics, frame_ms, about } = frame;
    let took = Took {
        engine: about.engine,
        adapter: about.machine.adapter,
        milliseconds: frame_ms,
        preparing_milliseconds: about.prepare_ms + about.classify_ms,
        samples: statistics.samples.unwrap_or(0),
        gpu_bytes: statistics.gpu_bytes.unwrap_or(0),
        notices: about.notices.iter().map(ToString::to_string).collect(),
    };
    let shown = match picture {
        Picture::OnDevice(texture) => Shown::OnDevice(texture),
        picture => Shown::Pixels(picture.into_image().as_ref().map_or_else(Pixels::default, Pixels::of)),
    };
    Frame { serial: 0, shown, done: spacing <= 1, spacing, took }
}
