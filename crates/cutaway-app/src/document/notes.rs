//! What a scene file keeps for a viewer, beside what decides the picture.

use serde::{Deserialize, Serialize};

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

/// What is drawn over the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Overlays {
    /// The edges of the volume's box.
    pub bounding_box: bool,
    /// Which way is front, left and up.
    pub orientation_cube: bool,
    /// A length to compare with.
    pub scale_bar: bool,
}

impl Default for Overlays {
    fn default() -> Self {
        Self { bounding_box: false, orientation_cube: true, scale_bar: true }
    }
}

/// What a scene file keeps of slices.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SliceNotes {
    /// Whether they are shown.
    pub visible: bool,
    /// Whether there is a fourth, as the camera looks.
    pub oblique: bool,
    /// The point that all slices pass through, in the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crosshair: Option<[f64; 3]>,
    /// The values that are black and white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<[f64; 2]>,
}
