//! What a scene file keeps for a viewer, beside what decides the picture.

use serde::{Deserialize, Serialize};

use crate::picture::Overlays;
use crate::slices::SliceNotes;

/// The `viewer` entry of a scene file, without the list of cuts, which [`super::scene_file`] keeps there. What is not known is left alone: another version may have written it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewerNotes {
    /// What is drawn over the picture.
    pub overlays: Overlays,
    /// Slices beside the picture.
    pub slices: SliceNotes,
}

impl ViewerNotes {
    /// The notes of a scene file; those that are not there, or not understood, are as they are by default.
    pub fn of(value: Option<&serde_json::Value>) -> Self {
        value.and_then(|value| serde_json::from_value(value.clone()).ok()).unwrap_or_default()
    }

    /// As a scene file holds them.
    pub fn to_value(&self) -> Option<serde_json::Value> {
        serde_json::to_value(self).ok()
    }
}
