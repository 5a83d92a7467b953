//! Frames: images with what it took to make them.

use cutaway_core::image::Image;

use crate::notice::Notice;

/// Place of an image.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Picture {
    /// In memory.
    Image(Image),
    /// On the device that the engine shares with a window: premultiplied display values, `Rgba8Unorm`.
    #[cfg(feature = "gpu")]
    OnDevice(wgpu::Texture),
}

impl Picture {
    /// Returns the image in memory; none where it is on a device.
    pub fn into_image(self) -> Option<Image> {
        match self {
            Self::Image(image) => Some(image),
            #[cfg(feature = "gpu")]
            Self::OnDevice(_) => None,
        }
    }
}

/// Counts of a frame; none where the engine does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStatistics {
    /// Samples of the field that were taken.
    pub samples: Option<u64>,
    /// Rays that met the data.
    pub rays: Option<u64>,
    /// Segments of the rays.
    pub segments: Option<u64>,
    /// Lines through clip objects whose events did not balance.
    pub repaired_lines: Option<u64>,
    /// Share of the samples inside the data that were not taken, 0..=1.
    pub skipped_fraction: Option<f64>,
    /// Milliseconds of clipping after a change of a pose.
    pub clip_ms: Option<f64>,
    /// Milliseconds on the device's own clock.
    pub gpu_ms: Option<f64>,
    /// Bytes on the device.
    pub gpu_bytes: Option<u64>,
    /// Triangles or tetrahedra that were drawn.
    pub primitives: Option<u64>,
}

/// An image as an engine returns it.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The image.
    pub picture: Picture,
    /// Its counts.
    pub statistics: FrameStatistics,
}

/// The machine that an engine runs on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    /// Name of the graphics adapter.
    pub adapter: Option<String>,
    /// Name of the instruction set.
    pub simd: Option<&'static str>,
    /// Number of threads.
    pub threads: usize,
}

/// The engine that made a frame, and what it had to do for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Name of the engine.
    pub engine: &'static str,
    /// The machine.
    pub machine: Machine,
    /// Milliseconds of preparing new data; 0 where nothing was to be done.
    pub prepare_ms: f64,
    /// Milliseconds of classifying; 0 where nothing was to be done.
    pub classify_ms: f64,
    /// Things that the engine does otherwise than asked.
    pub notices: Vec<Notice>,
}

/// A frame of a scene.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The image.
    pub picture: Picture,
    /// Largest distance in pixels between rays of the image; 1: every pixel was rendered, and the image stays as it is.
    pub spacing: u32,
    /// Counts.
    pub statistics: FrameStatistics,
    /// Milliseconds of rendering; of a refined frame, since the request.
    pub frame_ms: f64,
    /// The engine.
    pub about: About,
}
