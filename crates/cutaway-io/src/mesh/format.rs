//! What a mesh file is: by its first bytes, then by its name.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::error::MeshReadError;
use super::stl;
use crate::text;
use crate::volume::error::{quoted, shown_name};
use crate::volume::source::open_file;

/// Bytes of a file (and of what is inside a gzip file) that [`detect`] wants to see.
pub(super) const HEAD: u64 = 16 << 10;

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Polygon File Format, `.ply`.
    Ply,
    /// Stereolithography, `.stl`.
    Stl,
    /// Wavefront OBJ, `.obj`.
    Obj,
    /// glTF 2.0, `.gltf` or `.glb`; read only.
    Gltf,
}

/// A file name without an extension that names a mesh format that is written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{}': {} is not a mesh format that is written; known are .ply, .stl and .obj", path.display(), extension_shown(path))]
pub struct UnknownMeshFormat {
    /// The path as given.
    pub path: PathBuf,
}

fn extension_shown(path: &Path) -> String {
    path.extension().map_or("a name without an extension".into(), |e| format!("'.{}'", e.display()))
}

impl MeshFormat {
    /// The format to write that a file name's extension stands for, in upper or lower case.
    pub fn to_write(path: &Path) -> Result<Self, UnknownMeshFormat> {
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        let format = Self::from_extension(&extension.to_ascii_lowercase()).filter(|f| *f != Self::Gltf);
        format.ok_or_else(|| UnknownMeshFormat { path: path.to_owned() })
    }

    fn from_extension(extension: &str) -> Option<Self> {
        Some(match extension {
            "ply" => Self::Ply,
            "stl" => Self::Stl,
            "obj" => Self::Obj,
            "gltf" | "glb" => Self::Gltf,
            _ => return None,
        })
    }

    /// The format's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Obj => "OBJ",
            Self::Gltf => "glTF",
        }
    }
}

/// The mesh format of the file at `path`, by content and name; `None` where it is none, or cannot be read.
pub fn recognize(path: &Path) -> Option<MeshFormat> {
    identify(path).ok()
}

/// Returns the mesh format of the file at `path`, by content and name, or the reason why it is not a mesh.
///
/// # Errors
/// [`MeshReadError`]: the file cannot be read, is empty, or is not of a known format.
pub fn identify(path: &Path) -> Result<MeshFormat, MeshReadError> {
    Ok(examine(path)?.0)
}

/// The format of the file at `path`, and its first bytes.
pub(super) fn examine(path: &Path) -> Result<(MeshFormat, Vec<u8>), MeshReadError> {
    let file = shown_name(&path.to_string_lossy());
    let source = open_file(path);
    let mut source = source.map_err(|error| MeshReadError::Open { file: file.clone(), error, hint: "" })?;
    let head = source.head(HEAD);
    let (head, inside) = head.map_err(|error| MeshReadError::Io { file: file.clone(), offset: 0, error })?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let length = if inside.is_some() { None } else { Some(source.len()) };
    let head = inside.unwrap_or(head);
    Ok((detect(&file, &name, &head, length)?, text::without_mark(&head).to_vec()))
}

/// The format of a file, from its first bytes (inside, if it is compressed), its name and, where known, its length.
pub(super) fn detect(
    file: &str,
    name: &str,
    head: &[u8],
    length: Option<u64>,
) -> Result<MeshFormat, MeshReadError> {
    let extension = extension(name);
    let whole = head;
    let head = text::without_mark(head);
    let by_content = by_content(head);
    // Binary STL has no mark but that its length fits the count in it.
    let fits = matches!(extension.as_str(), "stl" | "") && length.is_some_and(|l| stl::fits_binary(whole, l));
    if let Some(found) = text::foreign(head).filter(|_| !fits) {
        let (found, hint) = (format!("this is {found}"), text::SAVE_AS_UTF_8);
        return Err(MeshReadError::Unsupported { file: file.to_owned(), found, hint });
    }
    let format =
        by_content.or(fits.then_some(MeshFormat::Stl)).or_else(|| MeshFormat::from_extension(&extension));
    if let Some(format) = format
        && !(format == MeshFormat::Obj && head.contains(&0))
        && !head.is_empty()
    {
        return Ok(format);
    }
    let shown: String = head.iter().take(12).map(|&b| char::from(b)).collect();
    let found = if head.is_empty() { "nothing (it is empty)".to_owned() } else { quoted(&shown) };
    Err(MeshReadError::UnknownFormat { file: file.to_owned(), found })
}

fn by_content(head: &[u8]) -> Option<MeshFormat> {
    if [&b"ply\n"[..], b"ply\r", b"ply "].iter().any(|magic| head.starts_with(magic)) {
        return Some(MeshFormat::Ply);
    }
    if head.starts_with(b"glTF") {
        return Some(MeshFormat::Gltf);
    }
    let mentions = |word: &[u8]| head.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word));
    (stl::is_text(head) && (mentions(b"facet") || mentions(b"endsolid"))).then_some(MeshFormat::Stl)
}

/// The name's extension in lower case, without a final `.gz`.
fn extension(name: &str) -> String {
    let name = name.to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').map(|(_, extension)| extension.to_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_comes_before_the_name() {
        let format = |name: &str, head: &[u8]| detect("f", name, head, None).ok();
        assert_eq!(format("a.stl", b"ply\nformat ascii 1.0"), Some(MeshFormat::Ply));
        assert_eq!(format("a", b"glTF\x02\0\0\0"), Some(MeshFormat::Gltf));
        assert_eq!(format("a.obj", b"  SOLID x\n Facet normal"), Some(MeshFormat::Stl));
        assert_eq!(format("A.OBJ.GZ", b"solid ground\nv 1 2 3"), Some(MeshFormat::Obj));
        assert_eq!(format("a.obj", b"\x64\x86\0\0"), None);
        assert_eq!(format("a.ply", b""), None);
        assert_eq!(format("a.nii", b"v 1 2 3"), None);
    }

    #[test]
    fn gltf_is_not_written() {
        assert_eq!(MeshFormat::to_write(Path::new("a.STL")), Ok(MeshFormat::Stl));
        let error = MeshFormat::to_write(Path::new("a.glb")).unwrap_err().to_string();
        assert_eq!(
            error,
            "'a.glb': '.glb' is not a mesh format that is written; known are .ply, .stl and .obj"
        );
        assert!(MeshFormat::to_write(Path::new("a")).is_err());
    }
}
