//! The core of cutaway: what a volume, a transfer function, a segment and a scene are, and what image they make.
//!
//! No I/O, no GPU. Data flows `Volume` → classification → segments → renderer → `Image`; see the repository's
//! `docs/ARCHITECTURE.md` for the integral that every renderer approximates.
#![forbid(unsafe_code)]

pub mod analytic;
pub mod angiography;
pub mod blue_noise;
pub mod camera;
pub mod clip;
pub mod colormaps;
pub mod compositing;
pub mod cubic;
pub mod defaults;
pub mod field;
pub mod histogram;
pub mod image;
pub mod lighting;
pub mod numbers;
pub mod occupancy;
pub mod preintegration;
pub mod presets;
pub mod reference;
pub mod scene;
pub mod scene_builder;
pub mod segment;
pub mod space;
pub mod tetrahedra;
pub mod transfer_function;
pub mod value_ranges;
pub mod volume;
pub mod voxel_source;

pub use glam;
