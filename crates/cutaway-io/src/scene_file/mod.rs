//! Scene files: JSON that holds everything that decides an image. Paths in it are relative to the file.
//!
//! [`SceneFile`] is the file, [`ClipTree`] its clip expression with the names of files for leaves, [`paths`] everything
//! about the paths in it.

mod clip;
pub mod paths;
mod read;
mod volume;
mod words;

use cutaway_core::camera::Camera;
use cutaway_core::clip::ClipShading;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::RenderSettings;
use cutaway_core::volume::NanMeaning;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use clip::{ClipFile, ClipSource, ClipTree, ExternalSolid, LoadSolid, resolve};
pub use read::{JsonError, read_scene};
pub use volume::{RawVolumeReference, VolumeReference};

use crate::transfer_function::TransferFunctionFile;

/// A scene as a JSON file holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// The volume.
    pub volume: VolumeReference,
    /// How voxels without a value (NaN) are shown; by default not at all, nor the cells that touch them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nan: Option<NanMeaning>,
    /// What values look like; made from the volume's histogram unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer_function: Option<TransferFunctionFile>,
    /// Where it is seen from; a view that frames the volume unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// Light and material.
    #[serde(default)]
    pub lighting: Lighting,
    /// What is kept of the volume; all of it unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<ClipFile>,
    /// What clip surfaces look like.
    #[serde(default)]
    pub clip_shading: ClipShading,
    /// How the image is made.
    #[serde(default)]
    pub render: RenderSettings,
    /// What a viewer keeps beside the picture: names, what is hidden, panes. Nothing in it changes an image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viewer: Option<serde_json::Value>,
}

#[cfg(test)]
mod tests {
    use cutaway_core::scene::Engine;

    use super::*;

    const EXAMPLE: &str = r#"{
        "volume": "engine_256x256x128_uint8.raw",
        "transfer_function": { "unit_distance": 1.0, "points": [
            { "value": 80, "color": [0.9, 0.7, 0.5], "opacity": 0.0 },
            { "value": 200, "color": [1, 1, 1], "opacity": 0.4 } ] },
        "camera": { "position": [0, -600, 120], "focal_point": [127.5, 127.5, 63.5], "view_up": [0, 0, 1], "view_angle": 30 },
        "lighting": { "shade": true, "ambient": 0.1, "diffuse": 0.9, "specular": 0.2, "specular_power": 10, "diffuse_curve": "two-sided" },
        "clip": { "difference": [ "volume", { "mesh": "bunny.ply", "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] } ] },
        "clip_shading": { "impregnation": "linear", "thickness": 3, "overlay": 0.0 },
        "render": { "mode": "composite", "step": 0.5, "engine": "cpu", "resolution": [512, 512] }
    }"#;

    #[test]
    fn the_documented_scene_is_read_and_written_without_loss() {
        let scene: SceneFile = serde_json::from_str(EXAMPLE).unwrap();
        assert_eq!(scene.render.engine, Engine::Cpu);
        let again: SceneFile = serde_json::from_str(&serde_json::to_string(&scene).unwrap()).unwrap();
        assert_eq!(scene, again);
    }

    #[test]
    fn a_raw_volume_can_be_described() {
        let text =
            r#"{ "volume": { "path": "a.bin", "dims": [2, 3, 4], "type": "int16", "big_endian": true } }"#;
        let scene: SceneFile = serde_json::from_str(text).unwrap();
        let VolumeReference::Described(raw) = scene.volume else { panic!("not described") };
        assert_eq!((raw.dims, raw.voxel_type.as_deref()), (Some([2, 3, 4]), Some("int16")));
    }

    #[test]
    fn what_does_not_exist_is_refused_by_name() {
        let error = serde_json::from_str::<SceneFile>(r#"{ "volume": "a", "clipp": {} }"#).unwrap_err();
        assert!(error.to_string().contains("`clipp`"), "{error}");
    }
}
