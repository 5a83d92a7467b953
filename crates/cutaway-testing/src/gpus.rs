//! Devices that tests share: one a set of fallbacks, opened when it is first asked for.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use cutaway_gpu::context::{Fallbacks, Filtering, adapters};
use cutaway_gpu::{Gpu, GpuError, GpuOptions, RaycastRenderer};

/// Sets of features that are pretended to be missing, by name; the first is none.
pub fn fallback_sets() -> Vec<(&'static str, Fallbacks)> {
    let none = Fallbacks::default();
    vec![
        ("all features", none.clone()),
        ("without norm16", Fallbacks { without_norm16: true, ..none.clone() }),
        ("without float filtering", Fallbacks { without_float_filtering: true, ..none.clone() }),
        ("without float blending", Fallbacks { without_float_blending: true, ..none.clone() }),
        ("without timestamps", Fallbacks { without_timestamps: true, ..none.clone() }),
        ("sorted ranges", Fallbacks { sorted_ranges: true, ..none.clone() }),
        ("exact filtering", Fallbacks { filtering: Some(Filtering::Exact), ..none.clone() }),
        (
            "without anything",
            Fallbacks {
                without_norm16: true,
                without_float_filtering: true,
                without_float_blending: true,
                without_timestamps: true,
                sorted_ranges: true,
                ..none
            },
        ),
    ]
}

/// A device on which most volumes do not fit, so that they are kept in bricks, coarser where they must be.
pub fn small_textures() -> (&'static str, Fallbacks) {
    ("small textures", Fallbacks { max_texture_3d: Some(16), ..Fallbacks::default() })
}

/// Whether there is an adapter at all: where there is none, tests show as ignored.
pub fn there_is_an_adapter() -> bool {
    static THERE: OnceLock<bool> = OnceLock::new();
    *THERE.get_or_init(|| {
        let there = !adapters().is_empty();
        if !there {
            eprintln!(
                "no GPU adapter: tests of the GPU engine are ignored (a software one: mesa-vulkan-drivers)"
            );
        }
        there
    })
}

/// The renderer of a set of fallbacks: pipelines are made once a process, not once a test.
pub fn renderer(name: &str, fallbacks: &Fallbacks) -> Result<Arc<RaycastRenderer>, GpuError> {
    static MADE: OnceLock<Mutex<HashMap<String, Arc<RaycastRenderer>>>> = OnceLock::new();
    let mut made = MADE.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(renderer) = made.get(name) {
        return Ok(renderer.clone());
    }
    let gpu = Gpu::new(&GpuOptions { fallbacks: fallbacks.clone(), ..GpuOptions::default() })?;
    let renderer = Arc::new(RaycastRenderer::new(&gpu)?);
    made.insert(name.to_owned(), renderer.clone());
    Ok(renderer)
}

/// The renderer of the best adapter as it is.
pub fn best() -> Result<Arc<RaycastRenderer>, GpuError> {
    renderer("all features", &Fallbacks::default())
}
