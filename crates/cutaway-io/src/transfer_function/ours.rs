//! Our own JSON: what a scene file has under `transfer_function`.

use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::{FunctionFile, FunctionFormat, FunctionReadError, MAX_POINTS, join};
use crate::volume::Loaded;

/// A transfer function in a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferFunctionFile {
    /// The world length that the opacities are for; the mean voxel spacing unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_distance: Option<f64>,
    /// The points; values must not decrease.
    pub points: Vec<ControlPoint>,
}

/// The keys that tell a function from a scene, and from patches.
#[derive(Deserialize)]
struct Keys {
    points: Option<IgnoredAny>,
    volume: Option<IgnoredAny>,
    kind: Option<IgnoredAny>,
}

/// Whether JSON holds a function of ours; of damaged JSON, by the words in it.
pub(super) fn recognize(bytes: &[u8]) -> bool {
    let has = |key: &[u8]| bytes.windows(key.len()).any(|window| window == key);
    match serde_json::from_slice::<Keys>(bytes) {
        Ok(keys) => keys.points.is_some() && keys.volume.is_none() && keys.kind.is_none(),
        Err(_) => has(b"\"points\"") && has(b"\"opacity\"") && !has(b"\"volume\""),
    }
}

pub(super) fn parse(file: String, bytes: &[u8]) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    let read: TransferFunctionFile = match serde_json::from_slice(bytes) {
        Ok(read) => read,
        Err(error) => return Err(FunctionReadError::Json { file, format: FunctionFormat::Cutaway, error }),
    };
    if read.points.len() > MAX_POINTS {
        return Err(FunctionReadError::TooManyPoints { file });
    }
    let unit_distance =
        read.unit_distance.map(|unit| join::unit_distance(&file, "unit_distance", unit)).transpose()?;
    match TransferFunction::new(read.points) {
        Ok(function) => Ok(Loaded { value: FunctionFile::new(function, unit_distance), notices: Vec::new() }),
        Err(error) => Err(FunctionReadError::Function { file, list: "", error }),
    }
}

pub(super) fn text(file: &FunctionFile) -> String {
    let points = file.function.points().to_vec();
    let written = TransferFunctionFile { unit_distance: file.unit_distance, points };
    let text = serde_json::to_string_pretty(&written);
    text.expect("numbers and words are always JSON") + "\n"
}
