//! Rendering a scene with an engine in one call.

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_cpu::{CpuRenderer, SimdChoice, Statistics};
use cutaway_gpu::{RaycastRenderer, SliceRenderer, slices};

/// The CPU engine's image of a scene. `threads`: 0 for one a core.
///
/// # Panics
/// If the processor lacks the instructions asked for.
pub fn cpu(scene: &Scene, simd: SimdChoice, threads: usize) -> (Image, Statistics) {
    let renderer = CpuRenderer::new(threads, simd).expect("an instruction set that this processor has");
    let volume = renderer.prepare(scene.volume()).expect("a volume that the engine can address");
    let classification = renderer.classify(&volume, scene);
    renderer.render(&volume, &classification, scene, &|_| {})
}

/// The GPU ray caster's image of a scene, on the best adapter there is.
///
/// # Panics
/// If anything fails.
pub fn raycast(scene: &Scene, renderer: &RaycastRenderer) -> (Image, cutaway_gpu::RaycastStatistics) {
    let volume = renderer.prepare(scene.volume()).expect("a volume that fits");
    let classification = renderer.classify(&volume, scene).expect("tables that fit");
    renderer.render(&volume, &classification, scene, &|_| {}).expect("a frame")
}

/// The slice renderer's image of a scene.
///
/// # Panics
/// If anything fails.
pub fn slices(scene: &Scene, renderer: &SliceRenderer) -> (Image, slices::SliceStatistics) {
    let volume = renderer.prepare(scene.volume()).expect("a volume that fits");
    let classification = renderer.classify(&volume, scene).expect("a mode that slices have");
    renderer.render(&volume, &classification, scene, &|_| {}).expect("a frame")
}
