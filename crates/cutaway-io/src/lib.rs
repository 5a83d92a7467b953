//! Files in, types out, and back: readers that trust nothing they read, writers that leave nothing half-written.
//!
//! Every reader holds what a header claims against the file and against [`limits::Limits`] before it allocates, opens
//! no file outside the folder of the file it was given, and reports what was wrong, where, and what to do.
#![forbid(unsafe_code)]

pub mod atomic;
mod files;
pub mod image;
pub(crate) mod json_words;
pub mod limits;
pub mod mesh;
pub mod named;
pub mod patches;
pub mod samples;
pub mod scene_file;
pub mod solids;
pub mod tetrahedra;
pub(crate) mod text;
pub mod transfer_function;
pub mod volume;
