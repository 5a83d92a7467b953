//! What to ask of a tessellation, and what comes of it.

use cutaway_core::glam::Vec3;

use crate::{MeshError, TriangleMesh};

/// The most pieces that uniform tessellation cuts a side into.
pub(super) const MAX_SEGMENTS: u32 = 1 << 15;

/// How to cut patches into triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Every patch into `segments` x `segments` pairs of triangles (1 to 32768), evenly in its parameters.
    Uniform {
        /// Pieces of each side.
        segments: u32,
    },
    /// Where a patch bends more, into more.
    Adaptive {
        /// How far mesh and surface may be apart, both ways, in the patches' unit of length.
        tolerance: f64,
    },
}

/// Settings of [`PatchSet::tessellate`](super::PatchSet::tessellate).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tessellation {
    /// How to cut.
    pub method: Method,
    /// More triangles than this are refused, before they take memory (about 60 bytes each on the way).
    pub max_triangles: u64,
}

impl Tessellation {
    /// As many triangles as may be made unless said otherwise.
    pub const MAX_TRIANGLES: u64 = 1 << 24;

    /// Adaptive, within a tolerance.
    pub fn within(tolerance: f64) -> Self {
        Self { method: Method::Adaptive { tolerance }, max_triangles: Self::MAX_TRIANGLES }
    }

    /// Uniform, `segments` a side.
    pub fn uniform(segments: u32) -> Self {
        Self { method: Method::Uniform { segments }, max_triangles: Self::MAX_TRIANGLES }
    }
}

/// Why patches were not tessellated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TessellationError {
    /// Not a length.
    #[error("the tolerance is {found}, expected a positive length in the unit of the patches")]
    Tolerance {
        /// What it is.
        found: f64,
    },
    /// Finer than coordinates in single precision.
    #[error(
        "a tolerance of {found} is finer than single precision at coordinates of {largest}; give at least {finest:.3e}"
    )]
    TooFine {
        /// The tolerance.
        found: f64,
        /// The largest coordinate.
        largest: f64,
        /// The finest tolerance there.
        finest: f64,
    },
    /// Not a number of pieces.
    #[error("{found} segments a side, expected 1 to {MAX_SEGMENTS}")]
    Segments {
        /// How many.
        found: u32,
    },
    /// More triangles than allowed.
    #[error("this would need about {about} triangles, more than the limit of {limit}; {hint}")]
    TooMany {
        /// How many, about.
        about: u64,
        /// [`Tessellation::max_triangles`].
        limit: u64,
        /// What to do.
        hint: &'static str,
    },
    /// All patches are points or lines.
    #[error("the patches have no area: each is a point or a line; nothing can be cut with them")]
    NoArea,
    /// The triangles do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A mesh of patches, and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tessellated {
    /// The triangles. All patches that hang together face the same way: outwards, if the surface, its holes closed,
    /// has an outside.
    pub mesh: TriangleMesh,
    /// Unit normals, one a vertex; where patches meet in a crease their mean. Zero where the surface has none.
    pub normals: Vec<Vec3>,
    /// How far the mesh and the surface are apart at most, in the patches' unit of length.
    pub error_bound: f64,
    /// The vertices round each hole, in the direction of the triangles beside it; empty where the surface is closed.
    pub boundary_loops: Vec<Vec<u32>>,
    /// Mesh edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// How many patches there were.
    pub patches: usize,
    /// Patches that were turned to face the same way as their neighbours, and outwards.
    pub turned_patches: usize,
    /// Boundary curves at which neighbours face different ways whatever is turned: the surface has one side only.
    pub one_sided_edges: usize,
}

impl Tessellated {
    /// What a user should know, one lower-case line each; nothing if the surface is closed and all was well.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        let plural = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
        if self.turned_patches > 0 {
            let (turned, all) = (self.turned_patches, self.patches);
            notices.push(format!(
                "{turned} of {all} patches faced inwards or unlike their neighbours and were turned"
            ));
        }
        if !self.boundary_loops.is_empty() {
            let edges: usize = self.boundary_loops.iter().map(Vec::len).sum();
            let loops = plural(self.boundary_loops.len(), "boundary loop", "boundary loops");
            notices.push(format!("the surface is open: {loops} of {edges} edges in all"));
        }
        if self.non_manifold_edges > 0 {
            let edges = plural(self.non_manifold_edges, "edge has", "edges have");
            notices.push(format!("{edges} more than two triangles"));
        }
        if self.one_sided_edges > 0 {
            let curves = plural(self.one_sided_edges, "boundary curve joins", "boundary curves join");
            notices.push(format!("{curves} patches that face different ways; the surface has only one side"));
        }
        notices
    }
}
