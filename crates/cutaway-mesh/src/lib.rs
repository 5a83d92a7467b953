//! Closed surfaces to cut volumes with: triangle meshes, and where rays cross them.
//!
//! What enters: vertices and triangles, in *object* space. What leaves: [`cutaway_core::clip::Event`]s along rays.
#![forbid(unsafe_code)]

mod mesh;
pub mod patches;

pub use mesh::{MeshError, TriangleMesh};
