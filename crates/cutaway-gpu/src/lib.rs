//! The GPU renderers.
//!
//! What enters: a [`Scene`](cutaway_core::scene::Scene). What leaves: an [`Image`](cutaway_core::image::Image). [`raycast`]
//! casts a ray a pixel in a fragment shader; [`slices`] blends polygons across the view; [`cells`] projects tetrahedra;
//! [`proxy`] finds where rays begin and end; [`geometry`] is what they end at
//! among the volume.
//!
//! | object | holds | made anew |
//! |---|---|---|
//! | [`Gpu`] | device, queue, what they can do | once |
//! | [`RaycastRenderer`] | pipelines | once |
//! | [`GpuVolume`] | voxels | for another volume |
//! | ranges | least and greatest value of every block | for another volume |
//! | [`GpuClassification`] | table, occupancy | on an edit of the transfer function, mode or step |
//! | targets | the image | for another size |
//! | uniforms | camera, light | each frame |
//!
//! Shaders are `.wgsl` files beside the Rust that uses them, those in `shared/` used by several; the build links each with
//! what it imports.
#![forbid(unsafe_code)]

pub mod cells;
mod classification;
mod clipping;
mod clock;
pub mod context;
mod error;
mod frame;
pub mod geometry;
mod notice;
mod plumbing;
pub mod proxy;
mod ranges;
pub mod raycast;
mod shaders;
pub mod slices;
mod volume;

pub use cells::{CellOptions, CellRenderer, CellStatistics};
pub use classification::GpuClassification;
pub use clipping::{ClipLayer, ClipStatistics, PeelSettings};
pub use context::{Gpu, GpuOptions};
pub use error::GpuError;
pub use frame::{FetchCounts, Pending, ShownFrame};
pub use geometry::{OpaqueGeometry, OpaquePart};
pub use notice::Notice;
pub use proxy::{ProxyCounts, ProxyOptions};
pub use raycast::{Extras, RaycastRenderer, RaycastStatistics};
#[cfg(feature = "watch-shaders")]
pub use shaders::ShaderWatch;
pub use slices::SliceRenderer;
pub use volume::{GpuVolume, Texels};

#[cfg(test)]
mod shader_tests;
