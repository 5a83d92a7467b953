//! Settings that only some engines have, by the names that scene files use.

use cutaway_core::clip::{BufferDepth, ClipEvents};
use cutaway_core::scene::{Gradient, ImageInterpolation, Layout, RenderSettings, Sampling, SpaceSkipping};

/// A setting, or a choice of one, that not every engine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Setting {
    /// `step`: the distance between samples.
    Step,
    /// `early_termination`: the opacity at which a ray ends.
    EarlyTermination,
    /// `space_skipping`: off, or on in the engine's own way.
    SpaceSkipping,
    /// `space_skipping`: a kind of proxy geometry.
    ProxyGeometry,
    /// `image_interpolation` with a factor.
    InterpolationFactor,
    /// `image_interpolation` adaptive.
    AdaptiveInterpolation,
    /// `sampling` object: samples on the planes of voxels.
    ObjectSampling,
    /// `adaptive_threshold`: finer steps where values change.
    AdaptiveThreshold,
    /// `pre_integration`.
    PreIntegration,
    /// `gradient` other than central differences.
    Gradient,
    /// `layout` bricks.
    Layout,
    /// `jitter`.
    Jitter,
    /// `brick_size`.
    BrickSize,
    /// `clip_events`: a method that runs on the processor.
    ProcessorEvents,
    /// `clip_events`: a method that runs on a graphics device.
    DeviceEvents,
    /// `buffer_depth` of peeled layers.
    BufferDepth,
}

impl Setting {
    /// Every setting.
    pub const ALL: [Self; 16] = [
        Self::Step,
        Self::EarlyTermination,
        Self::SpaceSkipping,
        Self::ProxyGeometry,
        Self::InterpolationFactor,
        Self::AdaptiveInterpolation,
        Self::ObjectSampling,
        Self::AdaptiveThreshold,
        Self::PreIntegration,
        Self::Gradient,
        Self::Layout,
        Self::Jitter,
        Self::BrickSize,
        Self::ProcessorEvents,
        Self::DeviceEvents,
        Self::BufferDepth,
    ];

    /// Returns the name of the field in a scene file.
    pub fn field(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::EarlyTermination => "early_termination",
            Self::SpaceSkipping | Self::ProxyGeometry => "space_skipping",
            Self::InterpolationFactor | Self::AdaptiveInterpolation => "image_interpolation",
            Self::ObjectSampling => "sampling",
            Self::AdaptiveThreshold => "adaptive_threshold",
            Self::PreIntegration => "pre_integration",
            Self::Gradient => "gradient",
            Self::Layout => "layout",
            Self::Jitter => "jitter",
            Self::BrickSize => "brick_size",
            Self::ProcessorEvents | Self::DeviceEvents => "clip_events",
            Self::BufferDepth => "buffer_depth",
        }
    }

    /// Returns the value of the setting, as a scene file has it; none where it is the default.
    pub fn chosen(self, s: &RenderSettings) -> Option<String> {
        let default = RenderSettings::default();
        let changed = |is: bool, value: &dyn Fn() -> String| is.then(value);
        match self {
            Self::Step => changed(s.step != default.step, &|| s.step.to_string()),
            Self::EarlyTermination => {
                changed(s.early_termination != default.early_termination, &|| s.early_termination.to_string())
            }
            Self::SpaceSkipping => {
                changed(s.space_skipping == SpaceSkipping::Off, &|| s.space_skipping.name().to_owned())
            }
            Self::ProxyGeometry => {
                let plain = matches!(s.space_skipping, SpaceSkipping::Off | SpaceSkipping::Auto);
                changed(!plain, &|| s.space_skipping.name().to_owned())
            }
            Self::InterpolationFactor => match s.image_interpolation {
                ImageInterpolation::Factor(factor) => Some(factor.to_string()),
                _ => None,
            },
            Self::AdaptiveInterpolation => {
                let adaptive = s.image_interpolation == ImageInterpolation::Adaptive;
                changed(adaptive, &|| "adaptive".to_owned())
            }
            Self::ObjectSampling => changed(s.sampling == Sampling::Object, &|| "object".to_owned()),
            Self::AdaptiveThreshold => s.adaptive_threshold.map(|t| t.to_string()),
            Self::PreIntegration => changed(s.pre_integration, &|| "true".to_owned()),
            Self::Gradient => match s.gradient {
                Gradient::Central => None,
                Gradient::Sobel => Some("sobel".to_owned()),
                Gradient::Precomputed => Some("precomputed".to_owned()),
            },
            Self::Layout => changed(s.layout == Layout::Bricks, &|| "bricks".to_owned()),
            Self::Jitter => changed(s.jitter, &|| "true".to_owned()),
            Self::BrickSize => changed(s.brick_size != default.brick_size, &|| s.brick_size.to_string()),
            Self::ProcessorEvents => {
                let here = matches!(
                    s.clip_events,
                    ClipEvents::Grid | ClipEvents::Octree | ClipEvents::Bvh | ClipEvents::Raster
                );
                changed(here, &|| s.clip_events.name().to_owned())
            }
            Self::DeviceEvents => {
                let here = matches!(s.clip_events, ClipEvents::Peel | ClipEvents::Lists);
                changed(here, &|| s.clip_events.name().to_owned())
            }
            Self::BufferDepth => {
                changed(s.buffer_depth != BufferDepth::default(), &|| s.buffer_depth.bits().to_string())
            }
        }
    }
}
