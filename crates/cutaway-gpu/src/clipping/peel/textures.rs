//! What layers are peeled into.

use cutaway_core::clip::BufferDepth;

use super::plan::MOST_LAYERS;
use crate::context::Gpu;
use crate::error::GpuError;

/// t, the octahedral point of a normal, and 1 where there is a surface.
pub(super) fn layer_format(depth: BufferDepth) -> wgpu::TextureFormat {
    match depth {
        BufferDepth::Half => wgpu::TextureFormat::Rgba16Float,
        BufferDepth::Single => wgpu::TextureFormat::Rgba32Float,
    }
}

/// The depth that one pass leaves to the next.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// The triangle that goes with it.
pub(super) const TRIANGLE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Winding numbers at both ends of the volume: sums, for which a format must blend. Whole numbers up to 2048 are exact.
pub(super) const ENDS_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

/// What one pass leaves to the next.
#[derive(Debug)]
pub(super) struct Pass {
    pub(super) depth: wgpu::TextureView,
    pub(super) triangle: wgpu::TextureView,
}

/// The textures of one image size: layers, ends, and two passes by turns.
#[derive(Debug)]
pub(super) struct Textures {
    size: [u32; 2],
    depth: BufferDepth,
    pub(super) layers: wgpu::Texture,
    /// All layers, for the sweep.
    pub(super) all_layers: wgpu::TextureView,
    /// Each layer, to draw into.
    pub(super) each_layer: Vec<wgpu::TextureView>,
    pub(super) all_ends: wgpu::TextureView,
    pub(super) each_ends: Vec<wgpu::TextureView>,
    pub(super) passes: [Pass; 2],
    bytes: u64,
}

impl Textures {
    /// For at least so many layers of so many meshes. What would take more than the device holds at once is an error before
    /// anything is made.
    pub(super) fn new(
        gpu: &Gpu,
        size: [u32; 2],
        depth: BufferDepth,
        layers: u32,
        meshes: u32,
    ) -> Result<Self, GpuError> {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let of_layers = u64::from(layers) * pixels * u64::from(depth.bits() / 2);
        let bytes = of_layers + u64::from(meshes) * pixels * 4 + 2 * 2 * 4 * pixels;
        let most = gpu.capabilities().max_texture_bytes.min(MOST_BYTES);
        let most_side = gpu.capabilities().max_texture_2d;
        if of_layers > most || size[0].max(size[1]) > most_side || meshes > MOST_LAYERS {
            let what = format!(
                "{layers} layers of clip surfaces of {} x {} pixels; take `--clip-events lists`, `--buffer-depth 16` or \
                 fewer `--segments`",
                size[0], size[1]
            );
            return Err(GpuError::OutOfMemory { what });
        }
        gpu.checked("layers of clip surfaces", || {
            let make = |label, format, layers: u32| {
                gpu.device().create_texture(&wgpu::TextureDescriptor {
                    label: Some(label),
                    size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: layers },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                        | wgpu::TextureUsages::TEXTURE_BINDING
                        | wgpu::TextureUsages::COPY_SRC,
                    view_formats: &[],
                })
            };
            let whole =
                |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
            let texture = make("layers", layer_format(depth), layers);
            let ends = make("ends of layers", ENDS_FORMAT, meshes);
            let passes = [0, 1].map(|_| Pass {
                depth: whole(&make("depth of a layer", DEPTH_FORMAT, 1)),
                triangle: whole(&make("triangles of a layer", TRIANGLE_FORMAT, 1)),
            });
            let [all_layers, all_ends] = [&texture, &ends].map(as_array);
            let each_layer = (0..layers).map(|layer| one(&texture, layer)).collect();
            let each_ends = (0..meshes).map(|layer| one(&ends, layer)).collect();
            Self { size, depth, layers: texture, all_layers, each_layer, all_ends, each_ends, passes, bytes }
        })
    }

    /// Whether they will do.
    pub(super) fn are_for(&self, size: [u32; 2], depth: BufferDepth, layers: u32, meshes: u32) -> bool {
        let enough = |views: &[wgpu::TextureView], wanted: u32| views.len() >= wanted as usize;
        self.size == size
            && self.depth == depth
            && enough(&self.each_layer, layers)
            && enough(&self.each_ends, meshes)
    }

    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(super) fn depth(&self) -> BufferDepth {
        self.depth
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Layers take no more than this, whatever the device would give.
const MOST_BYTES: u64 = 4 << 30;

fn as_array(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    })
}

fn one(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..wgpu::TextureViewDescriptor::default()
    })
}
