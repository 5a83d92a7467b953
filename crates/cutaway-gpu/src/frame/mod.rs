//! What every engine needs of a frame, whichever draws it.
//!
//! Enters: a scene, and what was prepared and classified of its volume. Leaves: bind groups that the shaders in `shared/` read,
//! textures that an engine draws into, and the finished image that is made of those. An engine is what lies between.
//!
//! | object | holds | made anew |
//! |---|---|---|
//! | [`PreparedVolume`] | voxels, ranges of blocks, directions of the gradient | for another volume |
//! | [`SceneBindings`] | layouts of what all shaders are bound to | once |
//! | [`Targets`] | colours, depths and counts of pixels | for another size |
//! | [`Finisher`] | the passes from what was cast to the image | once |
//! | [`FrameUniforms`] | camera, light, sampling | each frame |
//! | [`Inputs`] | what a frame is drawn from | each frame |

mod bindings;
mod fetches;
mod finish;
mod index_map;
mod lattice;
mod light;
mod pending;
mod prepared;
mod progress;
mod rays;
mod readback;
mod sampling;
mod targets;
mod uniforms;

pub(crate) use bindings::{Inputs, SceneBindings};
pub use fetches::FetchCounts;
pub use finish::ShownFrame;
#[cfg(test)]
pub(crate) use finish::{BLUR_SHADER, Blur, FILL_SHADER, Fill};
pub(crate) use finish::{Finished, Finisher};
pub(crate) use index_map::IndexMap;
pub(crate) use lattice::Lattice;
pub(crate) use light::diffuse_curve;
pub use pending::Pending;
pub use prepared::PreparedVolume;
pub(crate) use progress::Progress;
pub(crate) use rays::{RayPlane, clip_from_world, off_axis, rays_of, single};
pub(crate) use readback::Taken;
#[cfg(test)]
pub(crate) use sampling::{DIRECTIONS_SHADER, Slab};
pub(crate) use sampling::{GpuDirections, GpuPreintegration, SamplingVariant, cost_of_step};
#[cfg(test)]
pub(crate) use targets::NO_DEPTH;
pub(crate) use targets::{FORMATS, SAMPLES_AT_ONCE, Targets, tiles};
pub(crate) use uniforms::FrameUniforms;
