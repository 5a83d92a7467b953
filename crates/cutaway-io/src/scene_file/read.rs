//! Scene files as JSON.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::{SceneFile, words};
use crate::files::open_once;
use crate::text::{self, SAVE_AS_UTF_8};

/// The largest JSON file that is read: a transfer function of 65536 points takes a tenth of it.
const MAX_BYTES: u64 = 64 << 20;

/// Why a JSON file was not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JsonError {
    /// The file system said no.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// Far more than a scene can be.
    #[error("{}: larger than {MAX_BYTES} bytes; this is not {what}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What was expected.
        what: &'static str,
    },
    /// Text in an encoding that is not read.
    #[error("{}: this is {found}; {SAVE_AS_UTF_8}", path.display())]
    Encoding {
        /// The file.
        path: PathBuf,
        /// The encoding.
        found: &'static str,
    },
    /// Not JSON, or not what was expected.
    #[error("{}: {error} (expected {what}; `cutaway schema` describes it)", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What was expected.
        what: &'static str,
        /// The place, the field, what was found and what was expected.
        error: String,
    },
}

/// Reads a scene file. Paths in it are relative to its folder.
pub fn read_scene(path: &Path) -> Result<SceneFile, JsonError> {
    read(path, "a scene file")
}

fn read<T: DeserializeOwned>(path: &Path, what: &'static str) -> Result<T, JsonError> {
    let io = |error| JsonError::Io { path: path.to_owned(), error };
    let mut bytes = Vec::new();
    open_once(path).map_err(io)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(JsonError::TooLarge { path: path.to_owned(), what });
    }
    if let Some(found) = text::foreign(&bytes) {
        return Err(JsonError::Encoding { path: path.to_owned(), found });
    }
    words::parse(text::without_mark(&bytes)).map_err(|error| JsonError::Syntax {
        path: path.to_owned(),
        what,
        error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        file
    }

    #[test]
    fn errors_name_the_file_and_the_place() {
        let file = written("{ \"volume\": \"a\",\n  \"camra\": {} }");
        let error = read_scene(file.path()).unwrap_err().to_string();
        assert!(error.contains("`camra`") && error.contains("line 2"), "{error}");
        assert!(read_scene(Path::new("/nowhere/at/all.json")).is_err());
    }

    #[test]
    fn every_truncation_is_refused() {
        let whole = r#"{"volume": "a", "transfer_function": {"unit_distance": 2, "points": [
            {"value": 1, "color": [0, 0, 1], "opacity": 0.5}]}}"#;
        for end in 0..whole.len() {
            assert!(read_scene(written(&whole[..end]).path()).is_err(), "{end}");
        }
        assert!(read_scene(written(whole).path()).is_ok());
    }
}
