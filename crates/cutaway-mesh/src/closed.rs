//! Meshes that have an inside.

use crate::mesh::TriangleMesh;
use crate::topology::Topology;

/// A triangle mesh that is closed, its outermost shells wound outward: every edge is used as often in one direction as
/// in the other, so that the winding number of every point off the surface is defined. Where it is not zero is the inside.
///
/// Made by [`repair`](crate::repair()) from anything that can be closed, or by [`ClosedMesh::new`] from what is.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedMesh(TriangleMesh);

/// Why a mesh is no [`ClosedMesh`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotClosed {
    /// Some edges are not used as often in one direction as in the other.
    #[error(
        "the mesh is not closed: {boundary} of its edges have one triangle, {non_manifold} have three or more, and \
         along {inconsistent} of the others both triangles run in the same direction; repair it first"
    )]
    Open {
        /// Edges of one triangle.
        boundary: usize,
        /// Edges of three triangles or more.
        non_manifold: usize,
        /// Edges of two triangles that run in the same direction.
        inconsistent: usize,
    },
    /// No volume, or one outside.
    #[error("the mesh encloses a volume of {volume}, expected more than 0; repair it first")]
    Volume {
        /// Signed volume, in object units cubed.
        volume: f64,
    },
}

impl ClosedMesh {
    /// Checks and takes over.
    pub fn new(mesh: TriangleMesh) -> Result<Self, NotClosed> {
        let topology = Topology::new(&mesh);
        if topology.unbalanced_edges > 0 {
            return Err(NotClosed::Open {
                boundary: topology.boundary_edges,
                non_manifold: topology.non_manifold_edges,
                inconsistent: topology.inconsistent_edges,
            });
        }
        if topology.volume > 0.0 {
            Ok(Self(mesh))
        } else {
            Err(NotClosed::Volume { volume: topology.volume })
        }
    }

    /// Takes over what was just made so.
    pub(crate) fn from_checked(mesh: TriangleMesh) -> Self {
        debug_assert!(Topology::new(&mesh).is_closed());
        Self(mesh)
    }

    /// The mesh.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.0
    }

    /// The mesh, no longer known to be closed.
    pub fn into_mesh(self) -> TriangleMesh {
        self.0
    }
}
