//! Mesh files, written whole or not at all.

use std::io::{self, Write};
use std::path::Path;

use cutaway_mesh::TriangleMesh;
use glam::Vec3;

use super::format::{MeshFormat, UnknownMeshFormat};
use crate::atomic::{AtomicWriteError, write_atomically};

/// Why a mesh was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshWriteError {
    /// The file's name does not say which format.
    #[error(transparent)]
    Format(#[from] UnknownMeshFormat),
    /// Binary STL counts triangles in 32 bits.
    #[error(
        "{found} triangles do not fit into an STL file, which has at most {}; write .ply or .obj",
        u32::MAX
    )]
    TooManyTriangles {
        /// How many there are.
        found: usize,
    },
    /// glTF is read only.
    #[error("{format} files are not written; write .ply, .stl or .obj")]
    ReadOnly {
        /// The format asked for.
        format: &'static str,
    },
    /// The system's reason.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file could not be put in its place.
    #[error(transparent)]
    File(#[from] Box<AtomicWriteError<MeshWriteError>>),
}

/// What a written file says of its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WrittenSpace {
    /// Nothing: the axes are not known.
    #[default]
    Unsaid,
    /// `SPACE=RAS`, as 3D Slicer says it.
    Ras,
}

impl WrittenSpace {
    /// The words that go into the header.
    fn text(self) -> &'static str {
        match self {
            Self::Unsaid => "",
            Self::Ras => "; SPACE=RAS",
        }
    }
}

/// Writes a mesh; the extension chooses the format: `.ply` (binary, little-endian), `.stl` (binary) or `.obj`.
pub fn write_mesh(path: &Path, mesh: &TriangleMesh, space: WrittenSpace) -> Result<(), MeshWriteError> {
    let format = MeshFormat::to_write(path)?;
    write_atomically(path, |out| encode_mesh(mesh, format, space, out))
        .map_err(|error| Box::new(error).into())
}

/// Writes a mesh to anything that takes bytes.
pub fn encode_mesh(
    mesh: &TriangleMesh,
    format: MeshFormat,
    space: WrittenSpace,
    out: &mut impl Write,
) -> Result<(), MeshWriteError> {
    match format {
        MeshFormat::Ply => Ok(ply(mesh, space, out)?),
        MeshFormat::Stl => stl(mesh, space, out),
        MeshFormat::Obj => Ok(obj(mesh, space, out)?),
        MeshFormat::Gltf => Err(MeshWriteError::ReadOnly { format: format.name() }),
    }
}

/// Returns the largest distance along an axis by which single precision moves a vertex, in object units: 0 for a mesh that
/// it can hold. STL files have nothing else; PLY and OBJ files are written in double precision where this is not 0.
pub fn rounding(mesh: &TriangleMesh) -> f64 {
    let moved = |vertex: u32| {
        let position = mesh.position(vertex);
        (position - position.as_vec3().as_dvec3()).abs().max_element()
    };
    (0..mesh.vertices().len() as u32).map(moved).fold(0.0, f64::max)
}

fn ply(mesh: &TriangleMesh, space: WrittenSpace, out: &mut impl Write) -> io::Result<()> {
    let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
    let single = rounding(mesh) == 0.0;
    let kind = if single { "float" } else { "double" };
    // Readers of other programs may take numbers for signed: they are, up to 2^31.
    let index = if vertices.len() <= i32::MAX as usize { "int" } else { "uint" };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment written by cutaway{}\nelement vertex {}\nproperty {kind} x\n\
         property {kind} y\nproperty {kind} z\nelement face {}\nproperty list uchar {index} vertex_indices\nend_header\n",
        space.text(),
        vertices.len(),
        triangles.len()
    )?;
    for vertex in 0..vertices.len() as u32 {
        let position = mesh.position(vertex);
        if single {
            position.as_vec3().to_array().iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))?;
        } else {
            position.to_array().iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))?;
        }
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}

fn stl(mesh: &TriangleMesh, space: WrittenSpace, out: &mut impl Write) -> Result<(), MeshWriteError> {
    let found = mesh.triangles().len();
    let count = u32::try_from(found).map_err(|_| MeshWriteError::TooManyTriangles { found })?;
    // It must not begin with `solid`.
    let mut header = [b' '; 80];
    let text = format!("binary STL written by cutaway{}", space.text());
    header[..text.len()].copy_from_slice(text.as_bytes());
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in 0..found {
        let [a, b, c] = mesh.corners(triangle).map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        let corners = mesh.triangles()[triangle].map(|v| mesh.position(v).as_vec3());
        for vector in [normal].into_iter().chain(corners) {
            vector.to_array().iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn obj(mesh: &TriangleMesh, space: WrittenSpace, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "# written by cutaway{}", space.text())?;
    let single = rounding(mesh) == 0.0;
    for vertex in 0..mesh.vertices().len() as u32 {
        // The shortest text that is read as the same number.
        let v = mesh.position(vertex);
        if single {
            let v = v.as_vec3();
            writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
        } else {
            writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
        }
    }
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
