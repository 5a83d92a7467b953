//! Closed surfaces to cut volumes with: triangle meshes, and where rays cross them.
//!
//! What enters: vertices and triangles, in *object* space. What leaves: [`cutaway_core::clip::Event`]s along rays.
//!
//! A [`TriangleMesh`] is whatever a file holds; [`Topology`] counts what is wrong with it, and [`repair`] makes a
//! [`ClosedMesh`] of it, the only kind of mesh that has an inside.
#![forbid(unsafe_code)]

mod closed;
mod edges;
pub mod events;
mod mesh;
mod missing;
mod normals;
pub mod papers;
pub mod patches;
mod polygon;
mod repair;
mod sets;
pub mod shapes;
mod solid;
mod topology;

pub use closed::{ClosedMesh, NotClosed};
pub use events::{EventFinder, FrameEvents, MeshEvents, PixelEvents, TileEvents, TileRect};
pub use mesh::{MeshError, TriangleMesh};
pub use missing::missing_cells;
pub use polygon::EarClipper;
pub use repair::{RepairError, RepairNotice, RepairOptions, Repaired, repair};
pub use solid::MeshSolid;
pub use topology::Topology;
