//! Direct volume rendering: volumes in, pictures out.
//!
//! This crate is one door to the crates that do the work. The modules of the core stand at its root ([`volume`],
//! [`transfer_function`], [`camera`], [`scene`], ...), those that read and write files under [`io`], closed surfaces
//! under [`mesh`], the engines under [`cpu`] and [`gpu`]. Whoever needs one part alone can depend on that part: the types are the same.
//!
//! | to | start at |
//! |---|---|
//! | read a volume | [`io::volume::read_volume`], [`io::samples::read_sample`]; or [`volume::Volume::new`] from an array |
//! | say what values look like | [`transfer_function::TransferFunction`], [`presets`], [`colormaps`], [`histogram::default_transfer_function`] |
//! | look from somewhere | [`camera::Camera`], [`scene::default_camera`] |
//! | put these together | [`scene::Scene`]; as a JSON file [`io::scene_file::SceneFile`] |
//! | cut it open | [`clip::Clip`], [`mesh::MeshSolid`], [`scene::Scene::with_clip`] |
//! | render | [`cpu::CpuRenderer`], [`gpu::RaycastRenderer`]; slow and exact: [`reference::render`](fn@reference::render) |
//! | write and compare pictures | [`io::image::write_image`], [`image::compare`](mod@image::compare) |
//!
//! The README's example, which is compiled and run with the tests, shows them at work.
#![forbid(unsafe_code)]

pub use cutaway_core::{
    analytic, camera, clip, colormaps, compositing, cubic, field, glam, histogram, image, lighting,
    occupancy, presets, reference, scene, segment, space, transfer_function, value_ranges, volume,
    with_voxels,
};
pub use cutaway_cpu as cpu;
pub use cutaway_gpu as gpu;
pub use cutaway_io as io;
pub use cutaway_mesh as mesh;

/// The README's Rust examples, as tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
