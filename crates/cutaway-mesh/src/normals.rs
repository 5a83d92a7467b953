//! Smooth normals: those of the surface that a mesh stands for.

use cutaway_core::glam::{DVec3, Vec3};

use crate::TriangleMesh;

/// Faces that meet at a vertex with a larger angle between their normals are apart: a crease. Its cosine, 60 degrees.
const CREASE_COSINE: f32 = 0.5;

/// At a vertex of more faces than this, each face is compared with the mean of all instead of with every other: faces
/// that all meet in one point would take time that grows with their square.
const MANY_FACES: usize = 64;

/// A unit normal at each corner of each triangle, interpolated between them.
///
/// The normal of a corner is the mean of the normals of the faces around its vertex, each with the angle of its corner
/// for weight (Thürmer and Wüthrich 1998), without those across a crease of more than 60 degrees. A finely tessellated
/// sphere is therefore shaded like a sphere, and a cube like a cube.
#[derive(Debug)]
pub(crate) struct SmoothNormals {
    normals: Vec<Vec3>,
    /// Which normal each corner has; `None` where no vertex has a crease, and normals are numbered as vertices.
    corners: Option<Vec<[u32; 3]>>,
}

impl SmoothNormals {
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let faces: Vec<Vec3> = (0..mesh.triangles().len()).map(|t| face_normal(mesh, t)).collect();
        let around = Corners::around_vertices(mesh);
        let mut normals: Vec<Vec3> = Vec::with_capacity(mesh.vertices().len());
        let mut split: Vec<(u32, u32)> = Vec::new();
        // One normal a vertex first; what differs from it is numbered behind.
        let mut further: Vec<Vec3> = Vec::new();
        let mut sums: Vec<Vec3> = Vec::new();
        for vertex in 0..mesh.vertices().len() {
            let corners = around.of(vertex);
            corner_normals(mesh, &faces, corners, &mut sums);
            let first = sums.first().copied().unwrap_or(Vec3::Z);
            normals.push(first);
            for (&corner, &normal) in corners.iter().zip(&sums).filter(|(_, normal)| **normal != first) {
                // Neighbours in the list often agree: one normal for them.
                if further.last() != Some(&normal) {
                    further.push(normal);
                }
                split.push((corner, (mesh.vertices().len() + further.len() - 1) as u32));
            }
        }
        if split.is_empty() {
            return Self { normals, corners: None };
        }
        normals.append(&mut further);
        normals.shrink_to_fit();
        let mut corners = mesh.triangles().to_vec();
        for (corner, normal) in split {
            corners[corner as usize / 3][corner as usize % 3] = normal;
        }
        Self { normals, corners: Some(corners) }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.normals.capacity() * size_of::<Vec3>()
            + self.corners.as_ref().map_or(0, |c| c.capacity() * size_of::<[u32; 3]>())
    }

    /// The unit normals at the corners of a triangle.
    pub(crate) fn of_corners(&self, mesh: &TriangleMesh, triangle: usize) -> [Vec3; 3] {
        let corners = self.corners.as_ref().map_or(mesh.triangles()[triangle], |c| c[triangle]);
        corners.map(|n| self.normals[n as usize])
    }

    /// The unit normal at a point of a triangle, relative to the mesh's origin, or as near to it as rounding leaves it.
    pub(crate) fn at(&self, mesh: &TriangleMesh, triangle: usize, point: DVec3) -> DVec3 {
        let [a, b, c] = mesh.corners(triangle).map(|c| c.as_dvec3());
        let [na, nb, nc] = self.of_corners(mesh, triangle).map(|n| n.as_dvec3());
        let face = (b - a).cross(c - a);
        let area = face.length_squared();
        if area == 0.0 {
            return (na + nb + nc).normalize_or(DVec3::Z);
        }
        let weight = |p: DVec3, q: DVec3| (face.dot((q - p).cross(point - p)) / area).clamp(0.0, 1.0);
        let smooth = na * weight(b, c) + nb * weight(c, a) + nc * weight(a, b);
        smooth.try_normalize().unwrap_or_else(|| face.normalize())
    }
}

/// The unit normal of a face; zero where it has no area.
fn face_normal(mesh: &TriangleMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle).map(|c| c.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

/// The normals of the corners around one vertex, into `normals`.
fn corner_normals(mesh: &TriangleMesh, faces: &[Vec3], corners: &[u32], normals: &mut Vec<Vec3>) {
    let face = |corner: u32| faces[corner as usize / 3];
    let weighted = |corner: u32| face(corner) * corner_angle(mesh, corner);
    let all = corners.iter().map(|&c| weighted(c)).sum::<Vec3>().normalize_or_zero();
    normals.clear();
    let together = |a: Vec3, b: Vec3| a.dot(b) >= CREASE_COSINE;
    let smooth = corners.len() > MANY_FACES
        || corners.iter().all(|&c| {
            corners.iter().all(|&other| {
                together(face(c), face(other)) || face(c) == Vec3::ZERO || face(other) == Vec3::ZERO
            })
        });
    normals.extend(corners.iter().map(|&corner| {
        let own = face(corner);
        if own == Vec3::ZERO || smooth {
            return if own == Vec3::ZERO || together(own, all) { all } else { own };
        }
        let near = corners.iter().filter(|&&other| together(own, face(other)));
        near.map(|&other| weighted(other)).sum::<Vec3>().normalize_or(own)
    }));
}

/// The angle of a triangle at one of its corners, in radians.
fn corner_angle(mesh: &TriangleMesh, corner: u32) -> f32 {
    let corners = mesh.corners(corner as usize / 3);
    let [p, q, r] = [0, 1, 2].map(|i| corners[(corner as usize + i) % 3].as_dvec3());
    let (u, v) = ((q - p).normalize_or_zero(), (r - p).normalize_or_zero());
    u.dot(v).clamp(-1.0, 1.0).acos() as f32
}

/// The corners (3 times the triangle, and which) around each vertex.
struct Corners {
    offsets: Vec<u32>,
    corners: Vec<u32>,
}

impl Corners {
    fn around_vertices(mesh: &TriangleMesh) -> Self {
        let mut offsets = vec![0u32; mesh.vertices().len() + 1];
        for &vertex in mesh.triangles().iter().flatten() {
            offsets[vertex as usize] += 1;
        }
        let mut end = 0;
        for offset in &mut offsets {
            end += *offset;
            *offset = end;
        }
        let mut corners = vec![0; end as usize];
        for (corner, &vertex) in mesh.triangles().as_flattened().iter().enumerate().rev() {
            offsets[vertex as usize] -= 1;
            corners[offsets[vertex as usize] as usize] = corner as u32;
        }
        Self { offsets, corners }
    }

    fn of(&self, vertex: usize) -> &[u32] {
        &self.corners[self.offsets[vertex] as usize..self.offsets[vertex + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{cube, icosphere};

    #[test]
    fn a_fine_sphere_has_the_normals_of_a_sphere() {
        let mesh = icosphere(4);
        let normals = SmoothNormals::new(&mesh);
        assert!(normals.corners.is_none(), "no crease");
        let mut worst = 0.0f64;
        for triangle in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(triangle).map(|c| c.as_dvec3());
            let point = a * 0.2 + b * 0.5 + c * 0.3;
            worst = worst.max(normals.at(&mesh, triangle, point).angle_between(point));
        }
        // Faces lean by up to half an edge, 0.04 at this level; interpolation takes that to second order.
        assert!(worst < 0.004, "{worst}");
    }

    #[test]
    fn a_cube_keeps_its_faces_flat() {
        let mesh = cube();
        let normals = SmoothNormals::new(&mesh);
        for triangle in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(triangle).map(|c| c.as_dvec3());
            for point in [a, b * 0.9 + c * 0.1, (a + b + c) / 3.0] {
                let normal = normals.at(&mesh, triangle, point);
                assert!(normal.distance(face_normal(&mesh, triangle).as_dvec3()) < 1e-6, "{normal}");
            }
        }
    }

    #[test]
    fn triangles_without_area_still_have_a_unit_normal() {
        let mesh =
            TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0], vec![[0, 1, 2], [1, 1, 1]]).unwrap();
        let normals = SmoothNormals::new(&mesh);
        for triangle in 0..2 {
            assert!((normals.at(&mesh, triangle, DVec3::X).length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_vertex_of_very_many_faces_takes_no_long_time() {
        let n = 200_000u32;
        let rim = (0..n).map(|i| {
            let angle = i as f32 / n as f32 * std::f32::consts::TAU;
            Vec3::new(angle.cos(), angle.sin(), 0.0)
        });
        let vertices: Vec<Vec3> = rim.chain([Vec3::new(0.0, 0.0, 0.2)]).collect();
        let mesh = TriangleMesh::new(vertices, (0..n).map(|i| [n, i, (i + 1) % n]).collect()).unwrap();
        let normal = SmoothNormals::new(&mesh).at(&mesh, 0, DVec3::new(0.0, 0.0, 0.2));
        assert!(normal.distance(DVec3::Z) < 1e-2, "{normal}");
    }
}
