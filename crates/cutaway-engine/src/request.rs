//! Requests: what is wanted of a frame besides the scene.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// A view of an engine's work, shown instead of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DebugView {
    /// The image.
    #[default]
    Off,
    /// Number of texture fetches of each ray, in false colours.
    Fetches,
    /// The image with the edges of the proxy geometry.
    Wireframe,
}

impl DebugView {
    /// Returns the name at the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Fetches => "fetches",
            Self::Wireframe => "wireframe",
        }
    }
}

/// A function that is called with the finished share of a frame, 0..=1, from any thread.
pub type Progress<'a> = dyn Fn(f32) + Sync + 'a;

/// The request for a whole frame.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    /// The view of the engine's work.
    pub debug: DebugView,
    /// If true, an engine on a shared graphics device leaves its image there.
    pub on_device: bool,
    /// A flag that ends the frame early once it is set, where the engine can stop.
    pub cancel: Option<&'a AtomicBool>,
    /// Receives the finished share.
    pub progress: &'a Progress<'a>,
}

impl Default for Request<'_> {
    fn default() -> Self {
        Self { debug: DebugView::Off, on_device: false, cancel: None, progress: &|_| {} }
    }
}

impl fmt::Debug for Request<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { debug, on_device, cancel, .. } = self;
        f.debug_struct("Request")
            .field("debug", debug)
            .field("on_device", on_device)
            .field("cancel", cancel)
            .finish_non_exhaustive()
    }
}

impl Request<'_> {
    /// Returns true once the frame is to end early.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }
}
