//! The engines that run on a graphics device.

pub(super) mod cells;
pub(super) mod raycast;
pub(super) mod slices;

use cutaway_core::image::Image;
use cutaway_gpu::{Gpu, GpuError, ShownFrame};

use crate::engine::{Engine, Ready};
use crate::error::EngineError;
use crate::frame::{FrameStatistics, Machine, Picture, Rendered};
use crate::notice::Notice;
use crate::request::Request;

/// The machine of an engine on a device.
fn machine(gpu: &Gpu) -> Machine {
    Machine { adapter: Some(gpu.adapter().name.clone()), simd: None, threads: 1 }
}

/// Notices of data on a device.
fn data_notices(notices: &[cutaway_gpu::Notice]) -> Vec<Notice> {
    notices.iter().map(|notice| Notice::Data(notice.to_string())).collect()
}

/// A frame in memory.
fn in_memory<S: Into<FrameStatistics>>(
    rendered: Result<(Image, S), GpuError>,
) -> Result<Rendered, EngineError> {
    let (image, statistics) = rendered?;
    Ok(Rendered { picture: Picture::Image(image), statistics: statistics.into() })
}

/// A frame that stays on the device.
fn on_device(shown: Result<ShownFrame, GpuError>) -> Result<Rendered, EngineError> {
    let ShownFrame { texture, gpu_bytes } = shown?;
    let statistics = FrameStatistics { gpu_bytes: Some(gpu_bytes), ..FrameStatistics::default() };
    Ok(Rendered { picture: Picture::OnDevice(texture), statistics })
}

/// What a frame of a device's engine is rendered from.
type Inputs<'a, E> = (Ready<'a, E>, &'a Request<'a>);

/// Renders a frame where it is wanted: on the device or in memory.
fn rendered<'a, E: Engine, S: Into<FrameStatistics>>(
    inputs: Inputs<'a, E>,
    show: impl FnOnce(Inputs<'a, E>) -> Result<ShownFrame, GpuError>,
    render: impl FnOnce(Inputs<'a, E>) -> Result<(Image, S), GpuError>,
) -> Result<Rendered, EngineError> {
    if inputs.1.on_device { on_device(show(inputs)) } else { in_memory(render(inputs)) }
}
