//! The passes over finished pixels: pipelines, and drawing with them tile by tile.

use bytemuck::{Pod, Zeroable};

use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::targets::tiles;
use crate::plumbing::{
    FRAGMENT, RenderSetup, UNIFORM, bind_in_order, floats, group_layout_of, render_pipeline, storage,
};
use crate::shaders::{Shader, shader};

/// The linked shaders.
pub(crate) const FILL_SHADER: Shader = shader!(frame::finish::fill);
pub(crate) const BLUR_SHADER: Shader = shader!(frame::finish::blur);

/// `Fill` in `fill.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Fill {
    pub(crate) spacing: u32,
    pub(crate) nearest_depths: u32,
    pub(crate) reserved: [u32; 2],
}

/// `Blur` in `blur.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Blur {
    pub(crate) along: [i32; 2],
    pub(crate) count: u32,
    pub(crate) reserved: u32,
}

/// A pipeline a pass.
#[derive(Debug)]
pub(super) struct Passes {
    fill: Pass,
    blur: Pass,
    show: Pass,
}

#[derive(Debug)]
struct Pass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

/// What windows show: premultiplied display values of 8 bits.
pub(super) const SHOWN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A texture that is drawn into, read by the next pass, and copied from.
pub(super) fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("finished image"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

impl Passes {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let weights = storage(true);
        let pixels = floats(false, wgpu::TextureViewDimension::D2);
        let (color, depth) = (wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::R32Float);
        Self {
            fill: Pass::new(device, FILL_SHADER, "fill_pixel", [UNIFORM, pixels, pixels], &[color, depth]),
            blur: Pass::new(device, BLUR_SHADER, "blur_pixel", [UNIFORM, pixels, weights], &[color]),
            show: Pass::new(device, BLUR_SHADER, "blur_pixel", [UNIFORM, pixels, weights], &[SHOWN]),
        }
    }

    /// Fills `to`, colours and depths, from a lattice.
    pub(super) fn fill(
        &self,
        gpu: &Gpu,
        fill: &Fill,
        from: [&wgpu::Texture; 2],
        to: [&wgpu::Texture; 2],
    ) -> Result<(), GpuError> {
        let group = gpu.checked("filling in pixels", || {
            let fill = uniform(gpu, bytemuck::bytes_of(fill));
            let [colors, depths] = from.map(view);
            let views = [&colors, &depths].map(wgpu::BindingResource::TextureView);
            let [colors, depths] = views;
            self.fill.bind(gpu, [fill.as_entire_binding(), colors, depths])
        })?;
        self.fill.draw(gpu, "filling in pixels", &group, &to, 8.0)
    }

    /// Blurs colours along one axis.
    pub(super) fn blur(
        &self,
        gpu: &Gpu,
        blur: &Blur,
        weights: &[f32],
        from: &wgpu::Texture,
        to: &wgpu::Texture,
    ) -> Result<(), GpuError> {
        self.blur.blur(gpu, "blurring", blur, weights, [from, to])
    }

    /// Copies colours into a texture of 8 bits: a blur of one pixel.
    pub(super) fn show(&self, gpu: &Gpu, from: &wgpu::Texture, to: &wgpu::Texture) -> Result<(), GpuError> {
        let blur = Blur { along: [1, 0], count: 1, reserved: 0 };
        self.show.blur(gpu, "handing over the image", &blur, &[1.0], [from, to])
    }
}

fn uniform(gpu: &Gpu, contents: &[u8]) -> wgpu::Buffer {
    gpu.buffer("pass", contents, wgpu::BufferUsages::UNIFORM)
}

impl Pass {
    fn new(
        device: &wgpu::Device,
        shader: Shader,
        entry_point: &str,
        types: [wgpu::BindingType; 3],
        formats: &[wgpu::TextureFormat],
    ) -> Self {
        let module = shader.module(device);
        let layout = group_layout_of(device, entry_point, FRAGMENT, &types);
        let targets: Vec<Option<wgpu::ColorTargetState>> =
            formats.iter().map(|f| Some((*f).into())).collect();
        let setup =
            RenderSetup { label: entry_point, groups: &[Some(&layout)], constants: &[], targets: &targets };
        let pipeline = render_pipeline(device, &module, ["whole_image", entry_point], &setup);
        Self { layout, pipeline }
    }

    fn blur(
        &self,
        gpu: &Gpu,
        what: &str,
        blur: &Blur,
        weights: &[f32],
        [from, to]: [&wgpu::Texture; 2],
    ) -> Result<(), GpuError> {
        let group = gpu.checked(what, || {
            let weights = gpu.buffer("weights", bytemuck::cast_slice(weights), wgpu::BufferUsages::STORAGE);
            let blur = uniform(gpu, bytemuck::bytes_of(blur));
            let sharp = view(from);
            let sharp = wgpu::BindingResource::TextureView(&sharp);
            self.bind(gpu, [blur.as_entire_binding(), sharp, weights.as_entire_binding()])
        })?;
        self.draw(gpu, what, &group, &[to], 2.0 * weights.len() as f64)
    }

    fn bind(&self, gpu: &Gpu, resources: [wgpu::BindingResource; 3]) -> wgpu::BindGroup {
        bind_in_order(gpu.device(), &self.layout, &resources)
    }

    /// Draws into every pixel of `to`, of which each costs about so many `fetches`.
    fn draw(
        &self,
        gpu: &Gpu,
        what: &str,
        group: &wgpu::BindGroup,
        to: &[&wgpu::Texture],
        fetches: f64,
    ) -> Result<(), GpuError> {
        let size = [to[0].width(), to[0].height()];
        let views: Vec<wgpu::TextureView> = to.iter().map(|t| view(t)).collect();
        for (i, tile) in tiles(size, fetches, gpu.adapter().software).iter().enumerate() {
            let load =
                if i == 0 { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            let attachments: Vec<Option<wgpu::RenderPassColorAttachment>> = views
                .iter()
                .map(|view| {
                    Some(wgpu::RenderPassColorAttachment {
                        view,
                        depth_slice: None,
                        resolve_target: None,
                        ops,
                    })
                })
                .collect();
            gpu.checked(what, || {
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                        label: Some("finish"),
                        color_attachments: &attachments,
                        ..wgpu::RenderPassDescriptor::default()
                    });
                    pass.set_pipeline(&self.pipeline);
                    pass.set_bind_group(0, group, &[]);
                    pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
                    pass.draw(0..3, 0..1);
                }
                gpu.queue().submit([encoder.finish()]);
            })?;
        }
        Ok(())
    }
}
