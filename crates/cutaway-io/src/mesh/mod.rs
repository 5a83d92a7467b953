//! Mesh files: bytes in, [`TriangleMesh`] out, and back.
//!
//! What a file is follows from its content first and from its name second; any of them may be gzip-compressed:
//!
//! | format | read | written |
//! |---|---|---|
//! | PLY | text, binary of both byte orders, any further properties and elements, polygons, triangle strips | binary, little-endian |
//! | STL | text with one solid or several, in any case; binary, whatever its header begins with | binary |
//! | OBJ | polygons, numbers from the end, texture coordinates and normals left out | text |
//! | glTF 2.0, GLB | the scene's nodes with their transforms; triangles, strips and fans, with indices or without | |
//!
//! The readers are our own. Those of the usual crates were looked at (stl_io 0.11, tobj 4.0, ply-rs-bw 4.0, gltf 1.4):
//! none bounds what it allocates by a limit or says at which byte a binary file is wrong. stl_io takes every file that
//! begins with `solid ` for text and reads one solid only; tobj's errors name no line; ply-rs-bw keeps every property of
//! every element in a container of its own; gltf adds offsets of hostile files without checking and depends on an image
//! library for its own reading of buffers. What they would leave to do here is most of what these modules do.
//!
//! Coordinates stay as they are (glTF's y axis is up there, too), except those of a file that says that they are along LPS
//! axes: see [`MeshSpace`]. Vertices are merged only where the format has no
//! way to share them (STL). Whether the surface is closed is [`cutaway_mesh::repair`]'s business.
//!
//! ```
//! use cutaway_io::mesh::{MeshReadOptions, read_mesh_bytes};
//! use cutaway_io::volume::MemoryFolder;
//!
//! let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
//! let loaded = read_mesh_bytes("square.obj", text, &MemoryFolder::new(), &MeshReadOptions::default())?;
//! assert_eq!(loaded.value.triangles().len(), 2);
//! # Ok::<(), cutaway_io::mesh::MeshReadError>(())
//! ```

mod builder;
mod error;
mod format;
mod gltf;
mod input;
mod obj;
mod ply;
mod space;
mod stl;
mod write;

use std::path::Path;

use cutaway_mesh::TriangleMesh;

pub use error::MeshReadError;
pub use format::{MeshFormat, UnknownMeshFormat, identify, recognize};
pub use space::{MeshSpace, states_its_space};
pub use write::{MeshWriteError, WrittenSpace, encode_mesh, rounding, write_mesh};

use crate::limits::Limits;
use crate::text::{self, LineEnd};
pub use crate::volume::Loaded;
use crate::volume::error::shown_name;
use crate::volume::source::{DiskFolder, Folder, Source, Stream, open_file};
use input::Input;

/// How to read a mesh.
#[derive(Clone, Debug, Default)]
pub struct MeshReadOptions {
    /// How much memory the mesh may need.
    pub limits: Limits,
    /// The axes that coordinates are along.
    pub space: MeshSpace,
}

/// Reads the mesh in the file at `path`.
///
/// # Errors
/// See [`MeshReadError`]: every message names the file, the place, what was found and what was expected.
pub fn read_mesh(path: &Path, options: &MeshReadOptions) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    let file = shown_name(&path.to_string_lossy());
    let failed = |error, hint| MeshReadError::Open { file: file.clone(), error, hint };
    let source = open_file(path).map_err(|error| failed(error, ""))?;
    let folder = DiskFolder::new(path.parent().unwrap_or(Path::new("")));
    let folder = folder.map_err(|error| failed(error, "its folder cannot be opened"))?;
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    read_source(&file, &name, source, &folder, options)
}

/// Reads a mesh from a file in memory, without a file system.
///
/// `name` is the file's name without a path, `folder` the files that a glTF file may name as its buffers.
///
/// # Errors
/// As [`read_mesh`].
pub fn read_mesh_bytes(
    name: &str,
    bytes: &[u8],
    folder: &dyn Folder,
    options: &MeshReadOptions,
) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    read_source(&shown_name(name), name, Source::from_slice(bytes), folder, options)
}

fn read_source(
    file: &str,
    name: &str,
    mut source: Source<'_>,
    folder: &dyn Folder,
    options: &MeshReadOptions,
) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    let head = source.head(format::HEAD);
    let (head, inside) =
        head.map_err(|error| MeshReadError::Io { file: file.to_owned(), offset: 0, error })?;
    let length = if inside.is_some() { None } else { Some(source.len()) };
    let format = format::detect(file, name, inside.as_deref().unwrap_or(&head), length)?;
    let content = inside.as_deref().unwrap_or(&head);
    let marked = content.starts_with(text::MARK);
    let content = text::without_mark(content);
    let text_stl = stl::is_text(content);
    let stated = space::stated(format, content);
    let line_end = LineEnd::of(content);
    let mut stream =
        if inside.is_some() { Stream::gunzip(file, source) } else { Stream::plain(file, source) };
    let skipped = stream.skip(if marked { text::MARK.len() as u64 } else { 0 });
    skipped.map_err(|error| MeshReadError::Io { file: file.to_owned(), offset: 0, error })?;
    let mut input = Input::new(stream, options.limits);
    let mesh = match format {
        MeshFormat::Ply => ply::read(&mut input, line_end),
        MeshFormat::Stl if text_stl => stl::read_text(&mut input),
        MeshFormat::Stl => stl::read_binary(&mut input),
        MeshFormat::Obj => obj::read(&mut input),
        MeshFormat::Gltf => gltf::read(&mut input, folder),
    }?;
    let mut notices = input.into_notices();
    let (mesh, notice) = space::into_ras(mesh, file, &stated, options.space);
    notices.extend(notice);
    if mesh.triangles().is_empty() {
        notices.push(format!("the file has no faces (vertices: {})", mesh.vertices().len()));
    }
    Ok(Loaded { value: mesh, notices })
}
