//! How rays are sampled (Termeer 4.2.2 to 4.2.6): what goes beyond steps of one length, each the value in its middle.
//!
//! Enters: a scene's settings. Leaves: the shader's variant, and what only that is bound to (bind group 2): the tables of
//! pre-integrated steps, a tile of blue noise, and directions of the gradient. Whatever a scene does not ask for is a
//! placeholder of a few bytes.
//!
//! | setting | shader | as the CPU engine |
//! |---|---|---|
//! | pre-integration | `preintegration.wgsl`: the line through a step's Gauss points, looked up by its ends | yes |
//! | jitter | `steps.wgsl`: the second step of each segment has a share of its length that is each pixel's own | it has none |
//! | adaptive steps | `refined.wgsl`: a step that differs from its neighbours is cut into four | yes |
//! | sampling on planes | `steps.wgsl` | yes; there a packet's rays share an axis |
//! | gradients | `gradient.wgsl`; precomputed ones in 8 bits a component, filtered by the adapter | yes; there in 10 bits |

mod bindings;
mod directions;
mod tables;

use cutaway_core::scene::{Gradient, ImageInterpolation, Mode, RenderSettings, Sampling, Scene};

pub(crate) use bindings::{SamplingBindings, SamplingInputs};
pub(crate) use directions::GpuDirections;
#[cfg(test)]
pub(crate) use directions::{DIRECTIONS_SHADER, Slab};
pub(crate) use tables::GpuPreintegration;

/// Which kernel adds up the steps of composite mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Stepping {
    /// The plain one.
    Plain,
    /// Steps by the value in their middle, jittered, on planes, or lit by another gradient.
    Middles,
    /// The same, cut finer where they differ.
    Adaptive,
    /// Steps by their integral.
    Preintegrated,
}

/// What is decided of sampling when a shader is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SamplingVariant {
    stepping: Stepping,
    jitter: bool,
    on_planes: bool,
    gradient: Gradient,
}

impl SamplingVariant {
    pub(crate) fn of(scene: &Scene) -> Self {
        let s = scene.settings();
        if s.mode != Mode::Composite {
            let gradient = Gradient::Central;
            return Self { stepping: Stepping::Plain, jitter: false, on_planes: false, gradient };
        }
        let gradient = if scene.is_shaded() { s.gradient } else { Gradient::Central };
        let on_planes = s.sampling == Sampling::Object;
        // Steps on planes have no phase that could be another one.
        let jitter = s.jitter && !on_planes;
        let stepping = match s {
            _ if s.pre_integration => Stepping::Preintegrated,
            _ if s.adaptive_threshold.is_some() => Stepping::Adaptive,
            _ if jitter || on_planes || gradient != Gradient::Central => Stepping::Middles,
            _ => Stepping::Plain,
        };
        Self { stepping, jitter, on_planes, gradient }
    }

    /// Whether directions of the gradient are needed.
    pub(crate) fn wants_directions(&self) -> bool {
        self.gradient == Gradient::Precomputed
    }

    pub(crate) fn constants(&self) -> [(&'static str, f64); 4] {
        let stepping = match self.stepping {
            Stepping::Plain => 0.0,
            Stepping::Middles => 1.0,
            Stepping::Adaptive => 2.0,
            Stepping::Preintegrated => 3.0,
        };
        let gradient = match self.gradient {
            Gradient::Central => 0.0,
            Gradient::Sobel => 1.0,
            Gradient::Precomputed => 2.0,
        };
        let flag = |on: bool| f64::from(u8::from(on));
        [
            ("STEPPING", stepping),
            ("JITTER", flag(self.jitter)),
            ("ON_PLANES", flag(self.on_planes)),
            ("GRADIENT", gradient),
        ]
    }
}

/// Most values of the field that a step of these settings takes, in those of a plain one: what tiles are made for.
pub(crate) fn cost_of_step(scene: &Scene) -> f64 {
    let variant = SamplingVariant::of(scene);
    let steps = match variant.stepping {
        Stepping::Plain | Stepping::Middles => 1.0,
        Stepping::Adaptive => 6.0,
        Stepping::Preintegrated => 3.0,
    };
    steps * if variant.gradient == Gradient::Sobel { 4.0 } else { 1.0 }
}

/// What of these settings the ray caster does without, in words for whoever asked for it.
pub fn notices(settings: &RenderSettings) -> Vec<String> {
    let composite = settings.mode == Mode::Composite;
    let refined = settings.jitter
        || settings.pre_integration
        || settings.adaptive_threshold.is_some()
        || settings.sampling != Sampling::default()
        || settings.gradient != Gradient::default();
    let on_planes = settings.sampling == Sampling::Object;
    let all = [
        (
            settings.image_interpolation == ImageInterpolation::Adaptive,
            "adaptive image interpolation is of the cpu engine; the gpu casts every pixel (a factor, 2 to 16, works)",
        ),
        (composite && settings.jitter && on_planes, "steps on planes of voxels are not jittered"),
        (
            !composite && refined,
            "jitter, pre-integration, adaptive steps, object-aligned sampling and kinds of gradient are of composite mode",
        ),
    ];
    all.into_iter().filter(|(is, _)| *is).map(|(_, notice)| notice.to_owned()).collect()
}
