//! How rays are sampled (Termeer 4.2.2 to 4.2.6): what goes beyond steps of one length, each the value in its middle.
//!
//! Enters: a scene's settings. Leaves: the shader's variant, and what only that is bound to (bind group 2): the tables of
//! pre-integrated steps, a tile of blue noise, and directions of the gradient. Whatever a scene does not ask for is a
//! placeholder of a few bytes.
//!
//! | setting | shader | as the CPU engine |
//! |---|---|---|
//! | pre-integration | `preintegration.wgsl`: the line through a step's Gauss points, looked up by its ends | yes |
//! | jitter | `raycast/steps.wgsl`: the second step of each segment has a share of its length that is each pixel's own | it has none |
//! | adaptive steps | `raycast/refined.wgsl`: a step that differs from its neighbours is cut into four | yes |
//! | sampling on planes | `raycast/steps.wgsl` | yes; there a packet's rays share an axis |
//! | gradients | `gradient.wgsl`; precomputed ones in 8 bits a component, filtered by the adapter | yes; there in 10 bits |

mod bindings;
mod directions;
mod tables;
mod variant;

pub(crate) use bindings::{SamplingBindings, SamplingInputs};
pub(crate) use directions::GpuDirections;
#[cfg(test)]
pub(crate) use directions::{DIRECTIONS_SHADER, Slab};
pub(crate) use tables::GpuPreintegration;
pub(crate) use variant::{SamplingVariant, cost_of_step};
