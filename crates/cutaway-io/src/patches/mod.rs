//! Files of spline patches: bytes in, [`PatchSet`] out.
//!
//! Two formats, told apart by their content; `docs/formats.md` describes both.
//!
//! - The **teapot's text**, as the data of the Utah teapot have been passed on since 1975: how many patches; for each a
//!   line of 16 numbers of points, counted from 1; how many points; for each a line of three coordinates. The patches are
//!   bicubic Bezier patches.
//! - **JSON**: a surface or a list of surfaces, each of a kind (`bezier`, `b-spline`, `catmull-rom`, `hermite`, `nurbs`) with
//!   its points, counted from 0, and what else the kind needs.
//!
//! ```
//! use cutaway_mesh::patches::Tessellation;
//!
//! let json = br#"{ "kind": "bezier", "rows": 4, "columns": 4, "points": [
//!     [0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0],  [0, 1, 0], [1, 1, 2], [2, 1, 2], [3, 1, 0],
//!     [0, 2, 0], [1, 2, 2], [2, 2, 2], [3, 2, 0],  [0, 3, 0], [1, 3, 0], [2, 3, 0], [3, 3, 0]] }"#;
//! let patches = cutaway_io::patches::read_bytes("hill.json", json)?;
//! let made = patches.tessellate(&Tessellation::within(0.01))?;
//! assert_eq!(made.boundary_loops.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod json;
mod teapot_text;

use std::io::Read;
use std::path::Path;

use cutaway_mesh::patches::{PatchError, PatchSet};

use crate::files::open_regular;
use crate::json_words;
use crate::text::{self, SAVE_AS_UTF_8};
use crate::volume::error::{quoted, shown_name};

/// The largest file that is read. The teapot has 6 kB; as many control points as a set may have take less than this.
const MAX_BYTES: u64 = 64 << 20;

/// Why a file of patches could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PatchReadError {
    /// The file could not be opened or read.
    #[error("cannot read {file}: {error}")]
    Io {
        /// The file.
        file: String,
        /// What the system said.
        error: std::io::Error,
    },
    /// Far more than patches can be.
    #[error("{file}: larger than {MAX_BYTES} bytes, the most that is read as patches; split it")]
    TooLarge {
        /// The file.
        file: String,
    },
    /// Text in an encoding that is not read.
    #[error("{file}: this is {found}; {SAVE_AS_UTF_8}")]
    Encoding {
        /// The file.
        file: String,
        /// The encoding.
        found: &'static str,
    },
    /// Neither of the two formats.
    #[error(
        "{file}: found {found} at the beginning, expected patches: a number of patches on a line (the teapot's text) or JSON"
    )]
    UnknownFormat {
        /// The file.
        file: String,
        /// How it begins, quoted.
        found: String,
    },
    /// A line of the text that is not what it should be.
    #[error("{file}: line {line}: found {found}, expected {expected}")]
    Text {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// Not JSON, or not a surface; serde's message names field, line and column.
    #[error(
        "{file}: not a surface of patches: {}; docs/formats.md describes the fields",
        json_words::plain(error)
    )]
    Json {
        /// The file.
        file: String,
        /// Where and why.
        error: serde_json::Error,
    },
    /// A field that a kind of surface needs, or that it has no use for.
    #[error("{file}: surface {surface}: `{field}` {problem}")]
    Field {
        /// The file.
        file: String,
        /// Which surface of the file, counted from 0.
        surface: usize,
        /// Name of the field.
        field: &'static str,
        /// What is wrong with it, and what is expected.
        problem: String,
    },
    /// The numbers are well-formed but make no patches.
    #[error("{file}: {}{error}", surface.map(|n| format!("surface {n}: ")).unwrap_or_default())]
    Patches {
        /// The file.
        file: String,
        /// Which surface of a JSON file, counted from 0.
        surface: Option<usize>,
        /// Which patch or point, and why.
        error: PatchError,
    },
}

/// Reads the patches in the file at `path`.
///
/// # Errors
/// See [`PatchReadError`]: every message names the file, the place, what was found and what was expected.
pub fn read(path: &Path) -> Result<PatchSet, PatchReadError> {
    let file = shown_name(&path.to_string_lossy());
    let bytes = bytes_of(path).map_err(|error| PatchReadError::Io { file: file.clone(), error })?;
    parse(file, &bytes)
}

/// Reads patches from a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(name: &str, bytes: &[u8]) -> Result<PatchSet, PatchReadError> {
    parse(shown_name(name), bytes)
}

/// Whether the file at `path` holds patches, damaged or not, rather than a mesh or something else; false where it
/// cannot be read.
pub fn recognize(path: &Path) -> bool {
    bytes_of(path).is_ok_and(|bytes| match Format::of(&bytes) {
        Some(Format::Text) => true,
        // glTF and scenes are JSON, too, but have no kind; a surface has both.
        Some(Format::Json) => [&b"\"kind\""[..], b"\"points\""]
            .iter()
            .all(|key| bytes.windows(key.len()).any(|window| window == *key)),
        None => false,
    })
}

/// The Utah teapot that ships with cutaway: 32 patches, open at the rims of body and lid and at the ends of handle and
/// spout.
///
/// # Errors
/// None in practice: the file is part of the program, and a test reads it.
pub fn teapot() -> Result<PatchSet, PatchReadError> {
    read_bytes("sample:teapot", include_bytes!("../../samples/teapot_bezier.txt"))
}

/// The file, up to a byte more than is accepted.
fn bytes_of(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.0.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// What a file is by its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Text,
    Json,
}

impl Format {
    /// JSON begins with a bracket; the text with a line that holds one whole number, and numbers in the next.
    fn of(bytes: &[u8]) -> Option<Self> {
        let head = text::without_mark(bytes).trim_ascii_start();
        match head.first()? {
            b'{' | b'[' => Some(Self::Json),
            b'0'..=b'9' => {
                let digits = head.iter().take_while(|b| b.is_ascii_digit()).count();
                let after = head[digits..]
                    .iter()
                    .map(|b| if *b == b'\r' { b'\n' } else { *b })
                    .find(|b| !matches!(b, b' ' | b'\t'));
                matches!(after, None | Some(b'\n')).then_some(Self::Text)
            }
            _ => None,
        }
    }
}

fn parse(file: String, bytes: &[u8]) -> Result<PatchSet, PatchReadError> {
    if bytes.len() as u64 > MAX_BYTES {
        return Err(PatchReadError::TooLarge { file });
    }
    if let Some(found) = text::foreign(bytes) {
        return Err(PatchReadError::Encoding { file, found });
    }
    let bytes = text::without_mark(bytes);
    match Format::of(bytes) {
        Some(Format::Text) => teapot_text::parse(file, bytes),
        Some(Format::Json) => json::parse(file, bytes),
        None => {
            let head = String::from_utf8_lossy(&bytes[..bytes.len().min(40)]).into_owned();
            let found = if head.is_empty() { "nothing".to_owned() } else { quoted(&head) };
            Err(PatchReadError::UnknownFormat { file, found })
        }
    }
}
