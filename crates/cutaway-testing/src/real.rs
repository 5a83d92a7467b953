//! Real volumes: the bundled samples, and others where they are kept.
//!
//! The two bundled samples are always there. The others are looked for in the folder that `CUTAWAY_DATA` names, or in
//! `../shared/data` beside the repository; a test whose volume is not there shows as ignored.

use std::path::{Path, PathBuf};

use cutaway_core::volume::Volume;
use cutaway_io::samples::read_sample;
use cutaway_io::volume::{ReadOptions, read_volume};

/// Bundled samples.
pub const SAMPLES: [&str; 2] = ["mr-head", "bonsai"];

/// Files in the data folder.
pub const FILES: [&str; 6] = [
    "engine_256x256x128_uint8.raw",
    "cranium.mhd",
    "CT_pitch.nii.gz",
    "brain1_image.nrrd",
    "foot_zfp8_256x256x256_uint8.nhdr",
    "mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz",
];

/// Where the files lie.
pub fn data_folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("CUTAWAY_DATA").map_or_else(beside, PathBuf::from).join("volumes")
}

/// Whether a volume of this name is there.
pub fn is_there(name: &str) -> bool {
    SAMPLES.contains(&name) || data_folder().join(name).exists()
}

/// The sample or file of this name; the error is one line.
pub fn read(name: &str) -> Result<Volume, String> {
    let options = ReadOptions::default();
    if SAMPLES.contains(&name) {
        return read_sample(name, &options).map(|loaded| loaded.value).map_err(|e| e.to_string());
    }
    let path = data_folder().join(name);
    read_volume(&path, &options).map(|loaded| loaded.value).map_err(|e| e.to_string())
}
