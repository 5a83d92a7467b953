//! The indexed triangle mesh.

use cutaway_core::glam::{DVec3, Vec3};

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
        found: [f64; 3],
    },
}

/// Triangles that share vertices, in object space. Every index is in range and every coordinate finite; whether the
/// surface is closed is another question.
///
/// Vertices are in single precision, relative to an origin in double precision, so that a mesh far from the origin of
/// object space (in the coordinates of a survey, say) is as exact as a mesh near it. The origin is 0 for a mesh that is not
/// far away compared with its size. [`TriangleMesh::position`] is the sum of the two.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    origin: DVec3,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Makes a mesh of vertices in object space. Triangles are counter-clockwise seen from outside. Moving vertices to an
    /// origin of their own loses nothing.
    ///
    /// # Errors
    /// [`MeshError`] names the first vertex or triangle that is wrong.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check(vertices.iter().map(|v| v.as_dvec3()), &triangles)?;
        let origin = origin(&triangles, |v| vertices[v].as_dvec3());
        let mut mesh = Self { origin, vertices, triangles };
        if origin != DVec3::ZERO {
            mesh.vertices.iter_mut().for_each(|v| *v = (v.as_dvec3() - origin).as_vec3());
        }
        Ok(mesh)
    }

    /// Makes a mesh as [`TriangleMesh::new`] does, of vertices in double precision. What is lost is less than 1e-7 of the
    /// mesh's size.
    ///
    /// # Errors
    /// As [`TriangleMesh::new`]; coordinates beyond single precision are not finite, either.
    pub fn from_positions(positions: &[DVec3], triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check(positions.iter().copied(), &triangles)?;
        let origin = origin(&triangles, |v| positions[v]);
        let vertices = positions.iter().map(|v| (*v - origin).as_vec3()).collect();
        Ok(Self { origin, vertices, triangles })
    }

    /// Takes over what is known to be sound; vertices are relative to the origin.
    pub(crate) fn from_checked(origin: DVec3, vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        debug_assert!(check(vertices.iter().map(|v| v.as_dvec3()), &triangles).is_ok());
        Self { origin, vertices, triangles }
    }

    /// Turns the mesh by half a turn around the z axis: x and y change their signs, as between LPS and RAS.
    pub fn turned_around_z(mut self) -> Self {
        // Subtracting from 0 leaves no -0.
        (self.origin.x, self.origin.y) = (0.0 - self.origin.x, 0.0 - self.origin.y);
        for v in &mut self.vertices {
            (v.x, v.y) = (0.0 - v.x, 0.0 - v.y);
        }
        self
    }

    /// The mesh, moved by its origin.
    pub(crate) fn moved(self, by: DVec3) -> Self {
        Self { origin: self.origin + by, ..self }
    }

    /// The point in object space that vertices are relative to.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Vertices, relative to [`TriangleMesh::origin`].
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Returns where a vertex is in object space.
    ///
    /// # Panics
    /// If there is no such vertex.
    #[inline]
    pub fn position(&self, vertex: u32) -> DVec3 {
        self.origin + self.vertices[vertex as usize].as_dvec3()
    }

    /// Three vertices each, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The origin, the vertices relative to it, and the triangles, to do something else with.
    pub fn into_parts(self) -> (DVec3, Vec<Vec3>, Vec<[u32; 3]>) {
        (self.origin, self.vertices, self.triangles)
    }

    /// The lowest and the highest coordinates in object space of vertices that triangles use; `None` without triangles.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        self.relative_bounds().map(|ends| ends.map(|end| self.origin + end))
    }

    /// Bounds, relative to the origin.
    pub(crate) fn relative_bounds(&self) -> Option<[DVec3; 2]> {
        let mut used = self.triangles.iter().flatten().map(|&v| self.vertices[v as usize]);
        let first = used.next()?;
        let (low, high) = used.fold((first, first), |(low, high), v| (low.min(v), high.max(v)));
        Some([low.as_dvec3(), high.as_dvec3()])
    }

    /// Returns the corners of a triangle, relative to [`TriangleMesh::origin`].
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }
}

fn check(positions: impl ExactSizeIterator<Item = DVec3>, triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let vertices = positions.len();
    if vertices > u32::MAX as usize {
        return Err(MeshError::TooManyVertices { found: vertices });
    }
    for (vertex, position) in positions.enumerate() {
        if !position.as_vec3().is_finite() {
            return Err(MeshError::NotFinite { vertex, found: position.to_array() });
        }
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(MeshError::Index { triangle, vertex, vertices });
        }
    }
    Ok(())
}

/// Returns the origin for a mesh: along each axis 0 unless the mesh is further away than twice its size.
///
/// The origin is a multiple of a power of two near the mesh's size. Along an axis where it is not 0, all coordinates are
/// within a factor of two of one another; so for coordinates in single precision the differences are exact.
fn origin(triangles: &[[u32; 3]], position: impl Fn(usize) -> DVec3) -> DVec3 {
    let mut used = triangles.iter().flatten().map(|&v| position(v as usize));
    let Some(first) = used.next() else { return DVec3::ZERO };
    let (low, high) = used.fold((first, first), |(low, high), v| (low.min(v), high.max(v)));
    origin_of(low, high)
}

/// As [`origin`], for what lies between these coordinates.
pub(crate) fn origin_of(low: DVec3, high: DVec3) -> DVec3 {
    let size = (high - low).max_element();
    // A point, or subnormal numbers: there is nothing to gain.
    if !(size >= f64::from(f32::MIN_POSITIVE) && size.is_finite()) {
        return DVec3::ZERO;
    }
    let step = size.log2().floor().exp2();
    let middle = (low * 0.5 + high * 0.5) / step;
    let far = low.abs().max(high.abs()).cmpgt(DVec3::splat(2.0 * size));
    DVec3::select(far, middle.round() * step, DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRIANGLE: [u32; 3] = [0, 1, 2];

    #[test]
    fn a_mesh_near_the_origin_stays_where_it_is() {
        let vertices = vec![Vec3::new(1.5, 0.1, -2.0), Vec3::X, Vec3::Y];
        let mesh = TriangleMesh::new(vertices.clone(), vec![TRIANGLE]).unwrap();
        assert_eq!((mesh.origin(), mesh.vertices()), (DVec3::ZERO, &vertices[..]));
    }

    #[test]
    fn only_what_is_used_decides() {
        let far = DVec3::new(5e5, 5.4e6, 200.0);
        let positions = [far, far + DVec3::X * 0.1, far + DVec3::Y * 0.3, DVec3::ZERO];
        let mesh = TriangleMesh::from_positions(&positions, vec![TRIANGLE]).unwrap();
        assert!(mesh.vertices()[..3].iter().all(|v| v.abs().max_element() <= 0.3), "{mesh:?}");
        assert!(TriangleMesh::from_positions(&positions, vec![]).unwrap().origin() == DVec3::ZERO);
    }

    #[test]
    fn what_single_precision_cannot_hold_is_refused() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y * 1e39];
        let error = TriangleMesh::from_positions(&positions, vec![TRIANGLE]).unwrap_err();
        assert_eq!(error, MeshError::NotFinite { vertex: 2, found: [0.0, 1e39, 0.0] });
    }

    fn coordinate() -> impl Strategy<Value = f32> {
        any::<f32>().prop_filter("finite", |c| c.is_finite())
    }

    proptest! {
        #[test]
        fn moving_single_precision_to_an_origin_loses_nothing(
            corners in prop::array::uniform9(-1f32..1.0), size in -20i32..20, at in prop::array::uniform3(coordinate()),
        ) {
            let at = Vec3::from_array(at) * 0.25;
            let corner = |i: usize| at + Vec3::from_slice(&corners[3 * i..]) * 2f32.powi(size);
            let vertices: Vec<Vec3> = (0..3).map(corner).collect();
            let mesh = TriangleMesh::new(vertices.clone(), vec![TRIANGLE]).unwrap();
            for (i, vertex) in (0..).zip(&vertices) {
                prop_assert_eq!(mesh.position(i), vertex.as_dvec3());
            }
        }

        #[test]
        fn double_precision_keeps_its_shape_wherever_it_is(
            corners in prop::array::uniform9(-1f64..1.0), size in 1e-3f64..1e3, at in prop::array::uniform3(-1e7f64..1e7),
        ) {
            let at = DVec3::from_array(at);
            let corner = |i: usize| at + DVec3::from_slice(&corners[3 * i..]) * size;
            let positions: Vec<DVec3> = (0..3).map(corner).collect();
            let mesh = TriangleMesh::from_positions(&positions, vec![TRIANGLE]).unwrap();
            let [low, high] = mesh.bounds().unwrap();
            let extent = (high - low).max_element();
            for (i, position) in (0..).zip(&positions) {
                let error = (mesh.position(i) - *position).abs().max_element();
                prop_assert!(error <= 1.2e-7 * extent + 4e-9, "{error} of {extent}");
            }
        }
    }
}
