//! What is decided of light when a shader is compiled.

use cutaway_core::lighting::DiffuseCurve;
use cutaway_core::scene::Scene;

/// `DIFFUSE_CURVE` of `shared/lighting.wgsl`.
pub(crate) fn diffuse_curve(scene: &Scene) -> u32 {
    match scene.lighting().diffuse_curve {
        // Without light it does not matter: one pipeline for all. Clip surfaces are lit in every mode.
        _ if !scene.lighting().shade => 1,
        DiffuseCurve::Clamped => 0,
        DiffuseCurve::TwoSided => 1,
        DiffuseCurve::Wrapped => 2,
    }
}
