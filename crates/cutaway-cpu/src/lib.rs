//! The CPU ray caster: the engine that every machine has.
//!
//! What enters: a [`Scene`](cutaway_core::scene::Scene). What leaves: an [`Image`] with depth, and [`Statistics`].
//!
//! The integral of the design is approximated by the midpoint rule: along each ray the volume's box is cut into steps
//! of the scene's step length, the last one shorter, and each step takes the field at its middle. Which steps are taken
//! is decided by occupancy and by early termination alone; where they lie is not, so that skipping empty space does
//! not change a pixel.
//!
//! Lifetimes: [`CpuRenderer`] (threads, instruction set; once) → [`CpuVolume`] (value ranges; once a volume) →
//! [`Classification`] (tables and occupancy; once a transfer function, step or mode) → [`CpuRenderer::render`] (once a frame),
//! or [`CpuRenderer::progressive`] (once a view: an image at once that is refined call by call).
//!
//! Inside: the image is cut into tiles (`tiles`), a tile into bundles of packets of neighbouring pixels, one pixel a SIMD
//! lane (`rays`, `packet`). A bundle goes through the volume slab by slab, past what is empty (`bundle`), and is cast by one
//! of the kernels of `cast`, which share one field sampler (`sample`) over the volume's voxels or a copy in `bricks`.
//! Isosurfaces are cast ray by ray, in f64. Clipped rays are cast piece by piece (`clipping`). Of an image every pixel is
//! cast, or a lattice (`lattice`), or a lattice and what it does not tell (`adaptive`).
#![deny(unsafe_code)]

mod adaptive;
mod bricks;
mod bundle;
mod cast;
mod classification;
mod clipping;
mod error;
mod lattice;
mod mask;
mod normals;
mod packet;
mod prepared;
mod progressive;
mod rays;
mod renderer;
pub mod roofline;
mod sample;
mod simd;
mod statistics;
mod threads;
mod tiles;

pub use classification::Classification;
pub use cutaway_core::image::Image;
pub use error::CpuError;
pub use prepared::CpuVolume;
pub use progressive::{Progressive, Step};
pub use renderer::CpuRenderer;
pub use simd::{SimdChoice, UnsupportedSimd};
pub use statistics::Statistics;
