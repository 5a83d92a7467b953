//! The JSON that describes raw voxels, in a file beside them.

use std::io::Read;

use cutaway_core::volume::VoxelType;
use serde::Deserialize;

use super::Context;
use super::error::{Place, ReadError, quoted};
use super::raw::RawOptions;
use super::source::{Source, Stream};
use crate::{json_words, text};

/// Longest description beside raw data.
const LONGEST: u64 = 1 << 20;

/// What a description says. Other keys (name, url, licence) are left alone.
#[derive(Deserialize)]
struct Description {
    #[serde(alias = "size")]
    dims: Option<[u32; 3]>,
    #[serde(rename = "type")]
    voxel_type: Option<String>,
    spacing: Option<[f64; 3]>,
    big_endian: Option<bool>,
    header_bytes: Option<u64>,
}

/// Reads the description of that name, if there is one.
pub(super) fn read(ctx: &Context<'_>, name: &str) -> Result<Option<RawOptions>, ReadError> {
    let Ok(source) = ctx.folder.open(name) else { return Ok(None) };
    let file = ctx.beside(name);
    let bytes = bytes(&file, source)?;
    let text = text::without_mark(&bytes);
    if let Some(found) = text::foreign(text) {
        let (found, hint) = (format!("this is {found}"), text::SAVE_AS_UTF_8);
        return Err(ReadError::Unsupported { file, found, hint });
    }
    let parsed: Description = serde_json::from_slice(text).map_err(|error| ReadError::Field {
        file: file.clone(),
        place: Place::Line(error.line()),
        field: "json",
        found: json_words::plain(&error).into(),
        expected: "an object with \"dims\" (three integers) and \"type\" (a name like \"uint8\")".to_owned(),
        hint: "",
    })?;
    let voxel_type = match parsed.voxel_type {
        None => None,
        Some(name) => Some(VoxelType::from_name(&name).ok_or_else(|| ReadError::Field {
            file,
            place: Place::Whole,
            field: "type",
            found: quoted(&name).into(),
            expected:
                "uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64".to_owned(),
            hint: "",
        })?),
    };
    let Description { dims, spacing, big_endian, header_bytes, .. } = parsed;
    Ok(Some(RawOptions { dims, voxel_type, spacing, big_endian, header_bytes }))
}

fn bytes(file: &str, source: Source<'_>) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    let read = Stream::plain(file, source).take(LONGEST).read_to_end(&mut bytes);
    read.map_err(|error| ReadError::Io { file: file.to_owned(), offset: 0, error })?;
    Ok(bytes)
}

/// Why a JSON file that was given as a volume is none.
pub(super) fn refused(file: &str, source: Source<'_>) -> ReadError {
    let bytes = match bytes(file, source) {
        Ok(bytes) => bytes,
        Err(error) => return error,
    };
    let refused = |found: String, hint| ReadError::Unsupported { file: file.to_owned(), found, hint };
    let json: serde_json::Value = match serde_json::from_slice(text::without_mark(&bytes)) {
        Ok(json) => json,
        // What was cut off here may be whole.
        Err(_) if bytes.len() as u64 == LONGEST => {
            return refused("this is JSON and holds no voxels".to_owned(), "give a file of voxels");
        }
        Err(error) => {
            let found = format!("this is not JSON, as its name says: {}", json_words::plain(&error));
            return refused(found, "correct it there");
        }
    };
    let has = |key: &str| json.get(key).is_some();
    if has("dims") || has("size") {
        return refused(
            "this describes raw voxels and has none itself".to_owned(),
            "give the .raw file beside it: the description is found by itself",
        );
    }
    refused(
        "this is JSON and neither a volume nor a description of raw voxels".to_owned(),
        "a description has \"dims\" and \"type\"",
    )
}
