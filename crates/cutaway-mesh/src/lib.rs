//! Closed surfaces to cut volumes with: triangle meshes, and where rays cross them.
//!
//! What enters: vertices and triangles, in *object* space. What leaves: [`cutaway_core::clip::Event`]s along rays.
//!
//! A [`TriangleMesh`] is whatever a file holds; [`Topology`] counts what is wrong with it, and [`repair`] makes a
//! [`ClosedMesh`] of it, the only kind of mesh that has an inside.
#![forbid(unsafe_code)]

mod closed;
mod edges;
mod mesh;
mod polygon;
mod repair;
mod sets;
mod topology;

pub use closed::{ClosedMesh, NotClosed};
pub use mesh::{MeshError, TriangleMesh};
pub use polygon::EarClipper;
pub use repair::{RepairError, RepairNotice, RepairOptions, Repaired, repair};
pub use topology::Topology;
