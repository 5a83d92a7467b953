//! Closed surfaces to cut volumes with: triangle meshes, and where rays cross them.
//!
//! What enters: vertices and triangles, in *object* space. What leaves: [`cutaway_core::clip::Event`]s along rays.
#![forbid(unsafe_code)]

pub mod events;
mod mesh;
mod normals;
pub mod papers;
pub mod shapes;
mod solid;

pub use events::{EventFinder, FrameEvents, MeshEvents, PixelEvents, TileEvents, TileRect};
pub use mesh::{MeshError, TriangleMesh};
pub use solid::MeshSolid;
