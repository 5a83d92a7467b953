//! What a file is: by its first bytes, then by its name.

use super::error::{ReadError, quoted};
use super::{ReadOptions, fields, nifti, raw};
use crate::text;

/// Bytes of a file (and of what is inside a gzip file) that [`detect`] wants to see: a whole NIfTI-2 header.
pub(crate) const HEAD: u64 = 540;

const SUPPORTED: &str = "supported are NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .nhdr), MetaImage (.mhd, .mha) and raw voxels (.raw, .raw.gz)";

const DESCRIBE: &str = "supported are NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .nhdr), MetaImage (.mhd, .mha) and raw voxels, described by their name (name_256x256x128_uint8.raw), a .json file beside them or options for dimensions and type";

/// A format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Nifti,
    /// The voxels of a NIfTI pair: the header lies beside.
    NiftiPair,
    Nrrd,
    MetaImage,
    Raw,
    /// No volume: JSON that may describe one, or anything else.
    Json,
}

/// The format of a file, from its first bytes and the first bytes inside, if it is a gzip file.
pub(crate) fn detect(
    file: &str,
    name: &str,
    head: &[u8],
    inside: Option<&[u8]>,
    options: &ReadOptions,
) -> Result<Format, ReadError> {
    let content = text::without_mark(inside.unwrap_or(head));
    let refuse = |found: &str| {
        Err(ReadError::Unsupported {
            file: file.to_owned(),
            found: format!("{found} is not supported yet"),
            hint: SUPPORTED,
        })
    };
    if let Some(format) = by_content(content) {
        return Ok(format);
    }
    let extension = extension(name);
    let in_text = matches!(extension.as_str(), "nrrd" | "nhdr" | "mhd" | "mha");
    if let Some(found) = text::foreign(content).filter(|_| in_text) {
        return Err(foreign(file, found));
    }
    let by_name = match extension.as_str() {
        "nii" | "hdr" => Some(Format::Nifti),
        "img" => Some(Format::NiftiPair),
        "nrrd" | "nhdr" => Some(Format::Nrrd),
        "mhd" | "mha" => Some(Format::MetaImage),
        "raw" => Some(Format::Raw),
        _ => None,
    };
    if let Some(format) = by_name {
        return Ok(format);
    }
    // Raw data that someone describes may begin with anything.
    if options.raw.is_described() || raw::is_described_by_name(name) {
        return Ok(Format::Raw);
    }
    if let Some(found) = text::foreign(content) {
        return Err(foreign(file, found));
    }
    if extension == "json" {
        return Ok(Format::Json);
    }
    if let Some(found) = unsupported(content, &extension) {
        return refuse(found);
    }
    let shown: String = head.iter().take(12).map(|&b| char::from(b)).collect();
    let found = if head.is_empty() { "nothing (it is empty)".to_owned() } else { quoted(&shown) };
    Err(ReadError::UnknownFormat { file: file.to_owned(), found, hint: DESCRIBE })
}

/// Text in an encoding that is not read.
fn foreign(file: &str, found: &str) -> ReadError {
    ReadError::Unsupported {
        file: file.to_owned(),
        found: format!("this is {found}"),
        hint: text::SAVE_AS_UTF_8,
    }
}

/// A folder, as the file of a volume.
pub(crate) fn folder(file: &str) -> ReadError {
    ReadError::Unsupported {
        file: file.to_owned(),
        found: "a folder (a DICOM series, a TIFF stack, a Zarr store) is not supported yet".to_owned(),
        hint: SUPPORTED,
    }
}

fn by_content(content: &[u8]) -> Option<Format> {
    if content.starts_with(b"NRRD") {
        return Some(Format::Nrrd);
    }
    if nifti::has_magic(content) {
        return Some(Format::Nifti);
    }
    fields::begins_like_metaimage(content).then_some(Format::MetaImage)
}

/// The name's extension in lower case, without a final `.gz`.
fn extension(name: &str) -> String {
    let name = name.to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').map(|(_, extension)| extension.to_owned()).unwrap_or_default()
}

/// What a file that is not read is called.
fn unsupported(content: &[u8], extension: &str) -> Option<&'static str> {
    let begins = |magic: &[u8]| content.starts_with(magic);
    if content.get(128..132) == Some(b"DICM") {
        return Some("DICOM");
    }
    if begins(b"II*\0") || begins(b"MM\0*") || begins(b"II+\0") || begins(b"MM\0+") {
        return Some("TIFF");
    }
    if begins(b"# vtk DataFile") {
        return Some("legacy VTK (.vtk)");
    }
    if begins(b"\x89HDF\r\n\x1a\n") {
        return Some("HDF5");
    }
    if begins(b"\x89PNG") || begins(b"\xff\xd8\xff") {
        return Some("a picture");
    }
    if begins(b"\x93NUMPY") {
        return Some("NumPy (.npy)");
    }
    Some(match extension {
        "dcm" | "ima" => "DICOM",
        "tif" | "tiff" => "TIFF",
        // Not .vtk and .vtu: unstructured grids have a reader of their own.
        "vti" | "vtp" | "vts" | "vtr" => "VTK's XML",
        "zarr" | "zip" | "tar" => "Zarr",
        "h5" | "hdf5" | "mnc" | "nc" => "HDF5",
        "mgh" | "mgz" => "FreeSurfer's MGH",
        "npy" | "npz" => "NumPy",
        "png" | "jpg" | "jpeg" | "bmp" => "a picture",
        "stl" | "ply" | "obj" | "glb" | "gltf" => "a mesh as a volume",
        _ => return None,
    })
}
