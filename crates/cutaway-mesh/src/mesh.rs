//! The indexed triangle mesh.

use cutaway_core::glam::Vec3;

/// Why vertices and triangles do not make a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}; the mesh has {vertices} vertices, numbered from 0")]
    Index {
        /// Which triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// More vertices than can be numbered.
    #[error("the mesh has {found} vertices, more than {}; simplify it", u32::MAX)]
    TooManyVertices {
        /// How many.
        found: usize,
    },
    /// A coordinate that is NaN or infinite.
    #[error("vertex {vertex} is {found:?}; coordinates must be finite")]
    NotFinite {
        /// Which vertex, from 0.
        vertex: usize,
        /// Its coordinates.
        found: [f32; 3],
    },
}

/// Triangles that share vertices, in object space. Every index is in range and every coordinate finite; whether the
/// surface is closed is another question.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Checks and takes over. Triangles are counter-clockwise seen from outside.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if vertices.len() > u32::MAX as usize {
            return Err(MeshError::TooManyVertices { found: vertices.len() });
        }
        if let Some(vertex) = vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex, found: vertices[vertex].to_array() });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(MeshError::Index { triangle, vertex, vertices: vertices.len() });
            }
        }
        Ok(Self { vertices, triangles })
    }

    /// Takes over what is known to be sound.
    pub(crate) fn from_checked(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        debug_assert!(Self::new(vertices.clone(), triangles.clone()).is_ok());
        Self { vertices, triangles }
    }

    /// Corner positions.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Three vertices each, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Vertices and triangles, to do something else with.
    pub fn into_parts(self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        (self.vertices, self.triangles)
    }

    /// The lowest and the highest coordinates of vertices that triangles use; `None` without triangles.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let mut used = self.triangles.iter().flatten().map(|&v| self.vertices[v as usize]);
        let first = used.next()?;
        Some(used.fold([first; 2], |[low, high], v| [low.min(v), high.max(v)]))
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }
}
