//! Clipping: which part of a volume is kept, as a tree of solids, and the segments that it leaves of a ray.
//!
//! A solid ([`Solid`]: a mesh, [`Plane`], [`AxisBox`], [`Sphere`]) tells where the *line* of a ray crosses its surface,
//! as [`Event`]s. Solids stand in a tree of set operations ([`Clip`]), each with its pose. Laid flat ([`FlatClip`]), the
//! tree is what a [`Sweep`] turns events into [`ClipSegment`]s with, ray by ray: disjoint, ascending, each with the
//! surface that bounds it. Nothing here knows the volume; a pose that changes costs the next [`FlatClip`] and no more.
//!
//! ```text
//!   Clip ──► FlatClip ─┐  once a pose change
//!   Ray ──► events ────┴► Sweep ──► [ClipSegment]   once a ray, no allocation
//! ```

mod event;
mod finding;
mod fit;
mod flat;
mod missing;
mod nearby;
mod pose;
mod shading;
mod shapes;
mod sweep;
#[cfg(test)]
mod tests;
mod tree;

pub use event::{Crossing, Event, Solid};
pub use finding::{BufferDepth, ClipEvents, ClipEventsHome};
pub use fit::{FitError, box_corners, extremes, fit};
pub use flat::{FlatClip, FlatGate, FlatLeaf, FlatWire};
pub use missing::MissingCells;
pub use pose::{Pose, PoseError};
pub use shading::{ClipShading, Impregnation, SegmentCount};
pub use shapes::{AxisBox, LARGEST_COORDINATE, Plane, ShapeError, Sphere};
pub use sweep::{Boundary, COINCIDENCE, ClipSegment, SegmentLimit, Sweep};
pub use tree::{Clip, Node, Object, ObjectId};
