//! One file a command.

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
mod empty;
mod function_info;
mod gpu_info;
pub(crate) mod info;
mod mesh_info;
pub(crate) mod presets;
pub(crate) mod render;
pub(crate) mod schema;
mod session;
mod statistics;
mod tetrahedra_info;
pub(crate) mod view;
