//! Files of transfer functions: bytes in, [`TransferFunction`] out, and back.
//!
//! Four formats, told apart by their content when read and by the name when written; `docs/formats.md` describes them.
//!
//! | format | names | holds beside the points |
//! |---|---|---|
//! | ours | `.json` | the unit distance |
//! | ParaView's colour maps | `.pv.json`; any `.json` when read | a name; we add the unit distance |
//! | Slicer's volume properties | `.vp` | light; opacities are per millimetre |
//! | the same as JSON | `.vp.json` | light, the unit distance |
//!
//! The other programs keep colours and opacities as two lists. Reading joins them: a point wherever either list has one.
//! Writing puts every point into both, so that a function that we wrote comes back point by point. A step (two points at one
//! value) is written one step of a float wide, because VTK takes only one point a value, and read as a step again.

mod curves;
mod error;
mod join;
mod lenient;
mod ours;
mod paraview;
mod slicer_json;
mod slicer_text;
mod spaces;

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use cutaway_core::lighting::Lighting;
use cutaway_core::transfer_function::TransferFunction;

pub use error::{FunctionReadError, FunctionWriteError};
pub use ours::TransferFunctionFile;

use crate::atomic::write_atomically;
use crate::files::{open_once, open_regular};
use crate::text;
use crate::volume::Loaded;
use crate::volume::error::{quoted, shown_name};

/// The largest file that is read: as many points as a function may have take a third of it.
const MAX_BYTES: u64 = 256 << 20;

/// The most points of a function, and of each of the lists that it is joined from; as many as in a scene file.
pub const MAX_POINTS: usize = 1_000_000;

/// The formats of transfer functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FunctionFormat {
    /// Cutaway's JSON, as in a scene file.
    Cutaway,
    /// ParaView's colour maps.
    ParaView,
    /// Slicer's volume property, as text.
    Slicer,
    /// Slicer's volume property, as JSON.
    SlicerJson,
}

impl FunctionFormat {
    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cutaway => "cutaway JSON",
            Self::ParaView => "ParaView colour map (JSON)",
            Self::Slicer => "Slicer volume property (.vp)",
            Self::SlicerJson => "Slicer volume property (.vp.json)",
        }
    }

    /// The format that a file's name asks for; none where the name says nothing of the kind.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ends = |end: &str| name.ends_with(end);
        match () {
            () if ends(".vp.json") => Some(Self::SlicerJson),
            () if ends(".pv.json") => Some(Self::ParaView),
            () if ends(".json") => Some(Self::Cutaway),
            () if ends(".vp") => Some(Self::Slicer),
            () => None,
        }
    }

    /// What a file is by its content, damaged or not.
    fn of_content(bytes: &[u8]) -> Option<Self> {
        let has = |key: &[u8]| bytes.windows(key.len()).any(|window| window == key);
        match lenient::begin(bytes).first()? {
            b'{' | b'[' if has(b"\"volumeProperties\"") => Some(Self::SlicerJson),
            b'{' | b'[' if has(b"\"RGBPoints\"") || has(b"\"IndexedColors\"") => Some(Self::ParaView),
            b'{' => Some(Self::Cutaway),
            b'0'..=b'9' if slicer_text::recognize(bytes) => Some(Self::Slicer),
            _ => None,
        }
    }

    fn article(self) -> &'static str {
        match self {
            Self::Cutaway => "a transfer function",
            Self::ParaView => "a ParaView colour map",
            Self::Slicer | Self::SlicerJson => "a Slicer volume property",
        }
    }

    fn hint(self) -> &'static str {
        if self == Self::Cutaway { "; `cutaway schema` prints what is expected" } else { "" }
    }
}

/// What a file of a transfer function holds.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionFile {
    /// What values look like.
    pub function: TransferFunction,
    /// World length that the opacities are for, above 0; none: the mean voxel spacing.
    pub unit_distance: Option<f64>,
    /// Light and material, where the format has them.
    pub lighting: Option<Lighting>,
    /// What the file calls it.
    pub name: Option<String>,
    /// Whether the file states opacities. Where it does not, they rise from 0 to one half over the range of its colours, as
    /// `--colormap` has it.
    pub has_opacities: bool,
}

impl FunctionFile {
    /// A function with nothing beside it.
    pub fn new(function: TransferFunction, unit_distance: Option<f64>) -> Self {
        Self { function, unit_distance, lighting: None, name: None, has_opacities: true }
    }
}

/// Reads the transfer function in the file at `path`, of any format. `FILE:NAME` names one of the colour maps in a file of
/// ParaView's that holds several.
///
/// # Errors
/// See [`FunctionReadError`]: every message names the file, the place, what was found and what was expected.
pub fn read_transfer_function(path: &Path) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    let (path, map) = split(path);
    let file = shown_name(&path.to_string_lossy());
    let bytes = open_once(&path).and_then(bytes_of);
    let bytes = bytes.map_err(|error| FunctionReadError::Io { file: file.clone(), error })?;
    parse(file, &bytes, map.as_deref())
}

/// A path and, behind a colon, the name of one of the colour maps in its file. A file that has the whole name comes first.
fn split(path: &Path) -> (PathBuf, Option<String>) {
    let whole = || (path.to_owned(), None);
    if path.exists() {
        return whole();
    }
    match path.to_str().and_then(|text| text.rsplit_once(':')) {
        Some((file, map)) if Path::new(file).is_file() => (PathBuf::from(file), Some(map.to_owned())),
        _ => whole(),
    }
}

/// Reads a transfer function from a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_transfer_function`].
pub fn read_transfer_function_bytes(
    name: &str,
    bytes: &[u8],
) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    parse(shown_name(name), bytes, None)
}

/// Reads the colour map `map` of a file of ParaView's in memory, which may hold many; `name` is for messages.
///
/// # Errors
/// As [`read_transfer_function`].
pub fn read_color_map_bytes(
    name: &str,
    bytes: &[u8],
    map: &str,
) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    parse(shown_name(name), bytes, Some(map))
}

/// What the file at `path` is, if it holds a transfer function, damaged or not, rather than a scene, patches, a mesh or
/// something else; none where it cannot be read.
pub fn recognize(path: &Path) -> Option<FunctionFormat> {
    let (file, _) = open_regular(&split(path).0).ok()?;
    recognize_bytes(&bytes_of(file).ok()?)
}

/// As [`recognize`], of a file in memory.
pub fn recognize_bytes(bytes: &[u8]) -> Option<FunctionFormat> {
    if bytes.len() as u64 > MAX_BYTES {
        return None;
    }
    let bytes = text::without_mark(bytes);
    let format = FunctionFormat::of_content(bytes)?;
    (format != FunctionFormat::Cutaway || ours::recognize(bytes)).then_some(format)
}

/// Writes a transfer function in the format that the file's name asks for; the file appears whole or not at all. What the
/// format cannot hold comes back as notices, one line each.
///
/// # Errors
/// A name of no format, or what the file system said.
pub fn write_transfer_function(path: &Path, file: &FunctionFile) -> Result<Vec<String>, FunctionWriteError> {
    let extension = || FunctionWriteError::Extension { file: shown_name(&path.to_string_lossy()) };
    let format = FunctionFormat::of_name(path).ok_or_else(extension)?;
    let (text, notices) = function_text(file, format);
    write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    Ok(notices)
}

/// A transfer function as a file has it, and what the format cannot hold, one line each.
pub fn function_text(file: &FunctionFile, format: FunctionFormat) -> (String, Vec<String>) {
    let (text, mut notices) = match format {
        FunctionFormat::Cutaway => (ours::text(file), Vec::new()),
        FunctionFormat::ParaView => (paraview::text(file), Vec::new()),
        FunctionFormat::Slicer => slicer_text::text(file),
        FunctionFormat::SlicerJson => slicer_json::text(file),
    };
    let holds_light = matches!(format, FunctionFormat::Slicer | FunctionFormat::SlicerJson);
    if file.lighting.is_some() && !holds_light {
        notices.push(format!("light was left out: a {} holds none", format.name()));
    }
    (text, notices)
}

/// The file, up to a byte more than is accepted.
fn bytes_of(file: File) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn parse(file: String, bytes: &[u8], map: Option<&str>) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    if bytes.len() as u64 > MAX_BYTES {
        return Err(FunctionReadError::TooLarge { file });
    }
    if let Some(found) = text::foreign(bytes) {
        return Err(FunctionReadError::Encoding { file, found });
    }
    let bytes = text::without_mark(bytes);
    let format = FunctionFormat::of_content(bytes);
    if let Some(name) = map.filter(|_| format != Some(FunctionFormat::ParaView)) {
        let (name, known) =
            (quoted(name), "none: only files of ParaView's colour maps have several".to_owned());
        return Err(FunctionReadError::NoMap { file, name, known });
    }
    match format {
        Some(FunctionFormat::Cutaway) => ours::parse(file, bytes),
        Some(FunctionFormat::ParaView) => paraview::parse(file, bytes, map),
        Some(FunctionFormat::Slicer) => slicer_text::parse(file, bytes),
        Some(FunctionFormat::SlicerJson) => slicer_json::parse(file, bytes),
        None => {
            let head = String::from_utf8_lossy(&bytes[..bytes.len().min(40)]).into_owned();
            let found = if head.is_empty() { "nothing".to_owned() } else { quoted(&head) };
            Err(FunctionReadError::UnknownFormat { file, found })
        }
    }
}
