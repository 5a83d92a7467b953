//! The tables of pre-integrated steps on the device.

use cutaway_core::preintegration::Preintegration;
use cutaway_core::scene::{Mode, Scene};

use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::index_map::IndexMap;
use crate::volume::GpuVolume;

/// [`Preintegration`] on the device, for texels instead of stored numbers.
#[derive(Debug)]
pub(crate) struct GpuPreintegration {
    bins: wgpu::Buffer,
    integrals: wgpu::Buffer,
    /// From texels to bins.
    index_map: IndexMap,
    nodes: u32,
}

impl GpuPreintegration {
    /// The tables of a scene; none where its settings do not ask for them.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene, volume: &GpuVolume) -> Result<Option<Self>, GpuError> {
        let settings = scene.settings();
        if !settings.pre_integration || settings.mode != Mode::Composite {
            return Ok(None);
        }
        let source = scene.volume();
        let (unit, step) = (scene.unit_distance(), scene.step_length());
        let function = scene.transfer_function();
        let table = Preintegration::new(function, unit, step, source.rescale(), source.stored_range());
        let (origin, scale) = table.index_map();
        let texels = volume.texels();
        let index_map = IndexMap {
            offset: texels.texel(f64::from(origin)) as f32,
            scale: (f64::from(scale) * texels.stored_per_texel) as f32,
            last: table.bins().len() as u32 - 1,
        };
        let unlit = if scene.is_shaded() { Vec::new() } else { table.unlit_entries() };
        let integrals: &[u8] = if scene.is_shaded() {
            bytemuck::cast_slice(table.entries())
        } else {
            bytemuck::cast_slice(&unlit)
        };
        let upload = |label, contents| gpu.buffer(label, contents, wgpu::BufferUsages::STORAGE);
        let (bins, integrals) = gpu.checked("the tables of pre-integrated steps", || {
            (upload("bins", bytemuck::cast_slice(table.bins())), upload("integrals", integrals))
        })?;
        Ok(Some(Self { bins, integrals, index_map, nodes: table.size() as u32 }))
    }

    pub(crate) fn index_map(&self) -> IndexMap {
        self.index_map
    }

    /// Nodes along a side of the table.
    pub(crate) fn nodes(&self) -> u32 {
        self.nodes
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bins.size() + self.integrals.size()
    }

    pub(super) fn buffers(&self) -> [&wgpu::Buffer; 2] {
        [&self.bins, &self.integrals]
    }
}
