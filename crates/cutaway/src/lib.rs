//! Direct volume rendering that cuts volumes open.
//!
//! ```
//! use cutaway::prelude::*;
//! # use cutaway::{clip::Sphere, glam::DVec3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let mesh = Sphere::new(DVec3::splat(12.0), 9.0)?;
//! # let path = std::env::temp_dir().join("cutaway-doc.png");
//! let image = cutaway::render(&Scene::of(cutaway::read("sample:sphere:24")?).preset("MR-Default").cut(mesh))?;
//! image.save(&path)?;
//! # Ok(())
//! # }
//! ```
//!
//! | to | start at |
//! |---|---|
//! | read a volume or an unstructured grid | [`read`]; or [`volume::Volume::new`] from an array |
//! | choose colours and opacities | [`transfer_function::TransferFunction`], [`presets`], [`colormaps`] |
//! | put a scene together | [`Scene::of`](scene::Scene::of); as a JSON file [`io::scene_file::SceneFile`] |
//! | cut it open | [`SceneBuilder::cut`](scene_builder::SceneBuilder::cut), [`read_solid`], [`clip::Clip`] |
//! | render one image | [`render`] |
//! | render many, with progress, on a device of your own | [`engine::Renderer`] |
//! | save and compare images | [`SaveImage::save`], [`image::compare`](mod@image::compare) |
//!
//! Engines are chosen by [`scene::Engine`]; without a choice the best one for the data and the machine renders. The
//! modules at the root are those of the core. The crates behind it can be used alone: the types are the same.
//!
//! Cargo features: `gpu` (the engines that need a graphics device) and `files` (readers and writers) are on by default. Without
//! both, a program renders arrays on the processor and needs no graphics library.
#![forbid(unsafe_code)]

pub use cutaway_core::{
    analytic, camera, clip, colormaps, compositing, cubic, field, glam, histogram, image, lighting,
    occupancy, presets, reference, scene, scene_builder, segment, space, transfer_function, value_ranges,
    volume, with_voxels,
};
pub use cutaway_cpu as cpu;
pub use cutaway_engine as engine;
#[cfg(feature = "gpu")]
pub use cutaway_gpu as gpu;
#[cfg(feature = "files")]
pub use cutaway_io as io;
pub use cutaway_mesh as mesh;

#[cfg(feature = "files")]
mod files;

use cutaway_core::image::Image;
use cutaway_core::scene::SceneError;
use cutaway_core::scene_builder::ToScene;
use cutaway_engine::{EngineError, Renderer, Request};

#[cfg(feature = "files")]
pub use files::{ReadError, SaveImage, read, read_solid};

/// The names that most programs need.
pub mod prelude {
    #[cfg(feature = "files")]
    pub use crate::SaveImage;
    pub use crate::scene::Scene;
}

/// The reason why an image was not made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A setting of the scene is outside its range.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
}

/// Renders one image of a scene, which may still be a [`SceneBuilder`](scene_builder::SceneBuilder).
///
/// For more than one image of the same data keep a [`Renderer`]: it prepares the data once.
///
/// # Errors
/// A setting outside its range; an engine that cannot render the scene.
pub fn render(scene: &impl ToScene) -> Result<Image, RenderError> {
    let frame = Renderer::default().render(&scene.to_scene()?, &Request::default())?;
    frame.picture.into_image().ok_or(RenderError::Engine(EngineError::Cancelled))
}

/// The README's Rust examples, as tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
