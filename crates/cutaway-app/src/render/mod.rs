//! Pictures of the newest state, made in a thread of their own.
//!
//! Enters: [`Request`]s, of which only the newest counts. Leaves: [`Frame`]s, the first within a fraction of a second at
//! whatever quality fits, later ones finer until the picture is complete. A request that comes while a picture is being
//! refined ends that; whoever asks need not wait.
//!
//! | thread | does |
//! |---|---|
//! | the window's | [`RenderService::request`], [`RenderService::answer`] |
//! | `render` | classifies, casts, hands over; owns the engines ([`engines`]) |
//! | the CPU engine's own | tiles |
//! | `thumbnails` | small pictures for lists ([`thumbnails`]) |

pub mod engines;
mod service;
pub mod thumbnails;
#[cfg(feature = "watch-shaders")]
mod watch;

use std::sync::Arc;
use std::time::Duration;

use cutaway_core::clip::Clip;
use cutaway_core::image::Image;

use crate::document::{OpenVolume, SceneState};

pub use cutaway_engine::DebugView;
pub use service::{Answer, RenderService};

/// How long the first frame of a request may take while something moves.
pub const MOVING_BUDGET: Duration = Duration::from_millis(33);

/// A picture that is wanted.
#[derive(Clone, Debug)]
pub struct Request {
    /// The volume.
    pub volume: Arc<OpenVolume>,
    /// What decides the picture.
    pub state: SceneState,
    /// What is cut, with its solids.
    pub clip: Option<Clip>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What is shown of the engine's work.
    pub debug: DebugView,
}

/// What came of a request.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Which request it answers: its number, counted from 1.
    pub serial: u64,
    /// The picture.
    pub shown: Shown,
    /// Whether it stays as it is.
    pub done: bool,
    /// Distance in pixels of the rays that it was made of, at least.
    pub spacing: u32,
    /// What it took.
    pub took: Took,
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub enum Shown {
    /// In memory.
    Pixels(Pixels),
    /// On the device that the window is drawn with, as `Rgba8Unorm`.
    OnDevice(wgpu::Texture),
}

/// A picture as the window draws it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixels {
    /// Width and height in pixels; less than asked for while something moves.
    pub size: [u32; 2],
    /// Premultiplied display values, 8 bits each of red, green, blue and opacity, row by row from the top.
    pub rgba: Vec<u8>,
}

impl Pixels {
    /// An image in 8 bits.
    pub fn of(image: &Image) -> Self {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let mut rgba = vec![0; 4 * image.pixels().len()];
        for (bytes, pixel) in rgba.chunks_exact_mut(4).zip(image.pixels()) {
            bytes.copy_from_slice(&pixel.map(byte));
        }
        Self { size: [image.width(), image.height()], rgba }
    }
}

/// What frames take, for the read-out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Took {
    /// The engine that made it.
    pub engine: &'static str,
    /// The adapter, of a GPU engine.
    pub adapter: Option<String>,
    /// From the request's start to this frame.
    pub milliseconds: f64,
    /// Of that, until a changed volume or transfer function was ready.
    pub preparing_milliseconds: f64,
    /// Samples taken so far.
    pub samples: u64,
    /// Bytes on the GPU.
    pub gpu_bytes: u64,
    /// What the engine did without, or differently, one line each.
    pub notices: Vec<String>,
}
