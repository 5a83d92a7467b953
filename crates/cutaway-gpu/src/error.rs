//! Why something could not be done on a GPU.

use cutaway_core::glam::UVec3;

/// Why the engine cannot start or render.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter at all, or none that a device can be had of.
    #[error(
        "no usable GPU: {reason}; install a Vulkan driver (software: mesa-vulkan-drivers) or take `--engine cpu`"
    )]
    NoAdapter {
        /// What the system said.
        reason: String,
    },
    /// No adapter is called what was asked for.
    #[error("no GPU is called `{wanted}`; there are: {found}")]
    UnknownAdapter {
        /// The name asked for.
        wanted: String,
        /// Names of those that there are.
        found: String,
    },
    /// The adapter lacks what everything here needs.
    #[error("{adapter} cannot be used: {lacking}")]
    Insufficient {
        /// Its name.
        adapter: String,
        /// What is not there.
        lacking: String,
    },
    /// The device's memory does not suffice.
    #[error("the GPU has not enough memory for {what}")]
    OutOfMemory {
        /// What was to be made.
        what: String,
    },
    /// The device is gone: reset, unplugged, or its driver crashed.
    #[error("the GPU was lost: {reason}")]
    Lost {
        /// What the driver said.
        reason: String,
    },
    /// More voxels along a side than the adapter can hold, in whichever way.
    #[error("a volume of {dimensions} voxels does not fit on this GPU: {reason}")]
    TooLarge {
        /// Voxels along x, y, z.
        dimensions: UVec3,
        /// What was exceeded.
        reason: String,
    },
    /// Voxels of the volume that could not be read.
    #[error("the volume could not be read: {reason}")]
    Source {
        /// The place, and what is wrong.
        reason: String,
    },
    /// More pixels along a side than the adapter's textures have, or more bytes than it can hand back at once.
    #[error(
        "an image of {width} x {height} pixels does not fit on this GPU: {reason}; take a smaller one or `--engine cpu`"
    )]
    ImageTooLarge {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// What was exceeded.
        reason: String,
    },
    /// Opaque geometry was drawn for an image of another size.
    #[error("opaque geometry has {found:?} pixels, the image has {expected:?}; draw it for this image")]
    GeometrySize {
        /// Width and height of the image.
        expected: [u32; 2],
        /// Width and height of the geometry.
        found: [u32; 2],
    },
    /// A clip object of a kind that no shader knows.
    #[error(
        "clip object {object} is of a kind that the GPU engine does not know; it knows meshes, planes, boxes and \
         spheres; take `--engine cpu`"
    )]
    UnknownSolid {
        /// Its id.
        object: u32,
    },
    /// More triangles, crossings or segments than a buffer of the device holds.
    #[error(
        "clipping needs {needed} {of}, and a buffer of this GPU holds {most}; take a smaller image, a simpler clip or \
         `--engine cpu`"
    )]
    ClipTooLarge {
        /// Of what there are too many.
        of: &'static str,
        /// How many there are.
        needed: u64,
        /// How many fit.
        most: u64,
    },
    /// More layers of clip surfaces than a texture has.
    #[error(
        "peeling the clip's meshes needs {needed} layers, and a texture has {most}; take `--clip-events lists` or fewer \
         `--segments`"
    )]
    TooManyLayers {
        /// How many there are at least.
        needed: u64,
        /// How many fit.
        most: u32,
    },
    /// Isosurfaces were asked of the slice renderer.
    #[error(
        "slices show no isosurfaces; take `--engine raycast`, or `--mode composite` with a steep opacity"
    )]
    NoIsosurfaces,
    /// More slices than can be told apart.
    #[error(
        "the step needs {needed:.0} slices, and there may be {most}; take a `--step` of at least {smallest:.2e}"
    )]
    TooManySlices {
        /// How many there would be.
        needed: f64,
        /// How many there may be.
        most: u32,
        /// The least step that makes no more, in voxels.
        smallest: f64,
    },
    /// A mode that cells do not have.
    #[error(
        "the cell renderer has the composite mode, found {mode}; take `--engine raycast` or `--engine cpu`"
    )]
    CellsMode {
        /// The mode asked for.
        mode: &'static str,
    },
    /// More tetrahedra than a buffer of the device holds.
    #[error("{cells} tetrahedra do not fit on this GPU, whose buffers hold {most} of them")]
    MeshTooLarge {
        /// How many there are.
        cells: u64,
        /// How many fit.
        most: u64,
    },
    /// Whoever asked for the frame wants it no more.
    #[error("the frame was given up before it was finished")]
    Cancelled,
    /// The driver refused what should be right: a fault of ours, or of the driver.
    #[error("the GPU refused {what}: {reason}")]
    Refused {
        /// What was to be done.
        what: String,
        /// What the driver said.
        reason: String,
    },
}
