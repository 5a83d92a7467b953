//! Clipping.

/// The linked shader that makes event lists.
pub(crate) const LISTS_SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/clip_layers_lists.wgsl"));
/// The linked shader that sweeps over them.
pub(crate) const SWEEP_SHADER: &str =
    include_str!(concat!(env!("OUT_DIR"), "/clip_layers_sweep_lists.wgsl"));
