//! What a scene's settings decide of sampling before a shader is compiled.

use cutaway_core::scene::{Gradient, Mode, Sampling, Scene};

use crate::plumbing::flag;

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
