//! The picture drawn by a shader of its own in the window's render pass.
//!
//! egui would draw it as a mesh: with the one shader that it has for all that it draws, over a background drawn before, of a
//! texture that it copies. Where a processor plays GPU that takes several times as long as rendering the picture does.

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState};
use egui::{Color32, PaintCallbackInfo, Painter, Rect};

use crate::render::Pixels;

/// Draws pictures in one window.
pub(super) struct Canvas {
    window: RenderState,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    background: wgpu::Buffer,
    /// For pictures of as many pixels as their place has, and for others.
    samplers: [wgpu::Sampler; 2],
    /// What pictures in memory are copied into.
    uploaded: Option<wgpu::Texture>,
    shown: Option<wgpu::Texture>,
}

impl Canvas {
    pub(super) fn new(window: RenderState) -> Self {
        let device = &window.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("canvas"),
            entries: &[entry(0, uniform), entry(1, texture), entry(2, sampler)],
        });
        let pipeline = pipeline(device, &layout, window.target_format);
        let background = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("background"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let samplers = [wgpu::FilterMode::Nearest, wgpu::FilterMode::Linear].map(|filter| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("canvas"),
                mag_filter: filter,
                min_filter: filter,
                ..wgpu::SamplerDescriptor::default()
            })
        });
        Self { pipeline, layout, background, samplers, uploaded: None, shown: None, window }
    }

    /// Takes a picture in memory.
    pub(super) fn upload(&mut self, pixels: &Pixels) {
        let [width, height] = pixels.size;
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let texture = self.uploaded.take().filter(|texture| texture.size() == size).unwrap_or_else(|| {
            self.window.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        self.window.queue.write_texture(texture.as_image_copy(), &pixels.rgba, layout, size);
        self.shown = Some(texture.clone());
        self.uploaded = Some(texture);
    }

    /// Takes a picture that is on the window's device.
    pub(super) fn take(&mut self, texture: &wgpu::Texture) {
        self.shown = Some(texture.clone());
    }

    /// Forgets what was shown.
    pub(super) fn clear(&mut self) {
        (self.uploaded, self.shown) = (None, None);
    }

    /// Draws the picture over all of a rectangle; returns whether there is one.
    pub(super) fn paint(&self, painter: &Painter, rect: Rect, background: Color32) -> bool {
        let Some(texture) = &self.shown else { return false };
        let color = background.to_normalized_gamma_f32();
        self.window.queue.write_buffer(&self.background, 0, bytemuck::cast_slice(&color));
        let place = (rect.size() * painter.pixels_per_point()).round();
        let fits = [texture.width() as f32, texture.height() as f32] == [place.x, place.y];
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let resources = [
            self.background.as_entire_binding(),
            wgpu::BindingResource::TextureView(&view),
            wgpu::BindingResource::Sampler(&self.samplers[usize::from(!fits)]),
        ];
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0u32..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = self.window.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("canvas"),
            layout: &self.layout,
            entries: &entries,
        });
        painter.add(Callback::new_paint_callback(rect, Painting { pipeline: self.pipeline.clone(), group }));
        true
    }
}

fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("canvas"),
        source: wgpu::ShaderSource::Wgsl(include_str!("canvas.wgsl").into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("canvas"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    // What egui draws with such a format goes through the same.
    let constants = [("ENCODES", f64::from(u8::from(format.is_srgb())))];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("canvas"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("cover"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("show_pixel"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..wgpu::PipelineCompilationOptions::default()
            },
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// One frame's drawing.
struct Painting {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl CallbackTrait for Painting {
    fn paint(&self, _: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
