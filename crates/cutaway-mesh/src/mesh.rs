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

    /// Corner positions.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Three vertices each, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }
}
