//! What slices are blended into.

use cutaway_core::scene::Mode;

use crate::context::Gpu;
use crate::error::GpuError;

/// What blending adds up, and in how many bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Blending {
    pub(super) what: Blended,
    /// 16-bit floats, where the device cannot blend 32-bit ones.
    pub(super) half: bool,
}

/// What the fragments of a pixel become.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Blended {
    /// Each lies over what there is.
    Over,
    /// The greatest stays.
    Extreme,
    /// Their sum.
    Sum,
}

impl Blending {
    pub(super) fn of(gpu: &Gpu, mode: Mode) -> Self {
        let what = match mode {
            Mode::Mip | Mode::Minip => Blended::Extreme,
            Mode::Mean => Blended::Sum,
            Mode::Composite | Mode::Iso => Blended::Over,
        };
        Self { what, half: !gpu.capabilities().float_blending }
    }

    /// Of the targets, one or two: colour and distance, or values.
    pub(super) fn formats(self) -> &'static [wgpu::TextureFormat] {
        use wgpu::TextureFormat as Format;
        match (self.what, self.half) {
            (Blended::Over, false) => &[Format::Rgba32Float, Format::R32Float],
            (Blended::Over, true) => &[Format::Rgba16Float, Format::R16Float],
            (Blended::Extreme, false) => &[Format::R32Float],
            (Blended::Extreme, true) => &[Format::R16Float],
            (Blended::Sum, false) => &[Format::Rg32Float],
            (Blended::Sum, true) => &[Format::Rg16Float],
        }
    }

    pub(super) fn state(self) -> wgpu::BlendState {
        use wgpu::{BlendFactor as Factor, BlendOperation as Operation};
        let component = match self.what {
            Blended::Over => wgpu::BlendComponent::OVER,
            Blended::Extreme => wgpu::BlendComponent {
                src_factor: Factor::One,
                dst_factor: Factor::One,
                operation: Operation::Max,
            },
            Blended::Sum => wgpu::BlendComponent {
                src_factor: Factor::One,
                dst_factor: Factor::One,
                operation: Operation::Add,
            },
        };
        wgpu::BlendState { color: component, alpha: component }
    }

    /// What the targets are cleared to: an extreme value below all that there are, see `develop.wgsl`.
    fn nothing(self) -> wgpu::Color {
        match self.what {
            Blended::Extreme => wgpu::Color { r: -60_000.0, ..wgpu::Color::TRANSPARENT },
            _ => wgpu::Color::TRANSPARENT,
        }
    }
}

/// The targets of one size and way to blend.
#[derive(Debug)]
pub(super) struct SliceTargets {
    size: [u32; 2],
    blending: Blending,
    views: Vec<wgpu::TextureView>,
}

impl SliceTargets {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2], blending: Blending) -> Result<Self, GpuError> {
        let views = gpu.checked("what slices are blended into", || {
            let texture = |format: &wgpu::TextureFormat| {
                let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
                    label: Some("slices"),
                    size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: *format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                    view_formats: &[],
                });
                texture.create_view(&wgpu::TextureViewDescriptor::default())
            };
            blending.formats().iter().map(texture).collect()
        })?;
        Ok(Self { size, blending, views })
    }

    pub(super) fn is(&self, size: [u32; 2], blending: Blending) -> bool {
        self.size == size && self.blending == blending
    }

    /// Of values, or of colour and distance.
    pub(super) fn views(&self) -> [&wgpu::TextureView; 2] {
        [&self.views[0], &self.views[self.views.len() - 1]]
    }

    pub(super) fn bytes(&self) -> u64 {
        let texel = |f: &wgpu::TextureFormat| u64::from(f.block_copy_size(None).unwrap_or(16));
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        pixels * self.blending.formats().iter().map(texel).sum::<u64>()
    }

    /// A pass that blends into them; the first of a frame clears them.
    pub(super) fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        first: bool,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        let load = if first { wgpu::LoadOp::Clear(self.blending.nothing()) } else { wgpu::LoadOp::Load };
        let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
        let attachments: Vec<_> = (self.views.iter())
            .map(|view| {
                Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
            })
            .collect();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("slices"),
            color_attachments: &attachments,
            timestamp_writes,
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}
