//! Opaque geometry among the volume: an implant, a tool. It ends rays, and the image lies over it.
//!
//! Enters: triangle meshes with a colour each, or textures that another renderer has drawn. Leaves: for each pixel a colour
//! and the distance from the eye along the pixel's ray ([`OpaqueGeometry`]); see
//! [`RaycastRenderer::render_with`](crate::RaycastRenderer::render_with).

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::DAffine3;
use cutaway_core::scene::Scene;
use cutaway_mesh::TriangleMesh;

use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::FrameUniforms;
use crate::frame::clip_from_world;
use crate::plumbing::{FRAGMENT, UNIFORM, VERTEX, bind_in_order, floats, group_layout_of, pipeline_layout};
use crate::proxy::ProxyViewUniforms;
use crate::shaders::{Shader, shader};

/// The linked shaders.
pub(crate) const SURFACE_SHADER: Shader = shader!(geometry::surface);
pub(crate) const BEHIND_SHADER: Shader = shader!(geometry::behind);

/// Premultiplied colour, and world distance from the eye.
const FORMATS: [wgpu::TextureFormat; 2] = [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::R32Float];

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Where nothing is.
pub(crate) const NO_DISTANCE: f64 = 1e30;

/// A mesh to be drawn.
#[derive(Clone, Debug)]
pub struct OpaquePart<'a> {
    /// Its triangles; both sides of each are seen.
    pub mesh: &'a TriangleMesh,
    /// Where it is.
    pub world_from_mesh: DAffine3,
    /// Straight RGB, 0..=1.
    pub color: [f32; 3],
    /// Whether it is lit from the eye, by the ambient and diffuse light of the scene.
    pub lit: bool,
}

/// What is seen of opaque geometry: a colour and a distance a pixel.
#[derive(Clone, Debug)]
pub struct OpaqueGeometry {
    size: [u32; 2],
    colors: wgpu::TextureView,
    distances: wgpu::TextureView,
}

/// As `Paint` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct PaintUniforms {
    pub(crate) color: [f32; 3],
    pub(crate) lit: u32,
    pub(crate) depth_unit: f32,
    pub(crate) reserved_x: u32,
    pub(crate) reserved_y: u32,
    pub(crate) reserved_z: u32,
}

impl OpaqueGeometry {
    /// Takes what another renderer has drawn: 2D float textures of the image's size. `colors`: premultiplied RGBA;
    /// `distances`: red is the world distance from the eye (from the image's plane, where rays are parallel) along the ray
    /// through the pixel's centre, 1e30 or more where nothing is.
    pub fn from_textures(size: [u32; 2], colors: wgpu::TextureView, distances: wgpu::TextureView) -> Self {
        Self { size, colors, distances }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// World distance from the eye, a pixel.
    pub(crate) fn distances(&self) -> &wgpu::TextureView {
        &self.distances
    }
}

/// Pipelines that draw opaque geometry and put images over it.
#[derive(Debug)]
pub(crate) struct GeometryPipelines {
    surface: wgpu::RenderPipeline,
    behind: wgpu::RenderPipeline,
}

impl GeometryPipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        gpu.checked("the pipelines of opaque geometry", || {
            let device = gpu.device();
            let layout =
                |stages, types: &[wgpu::BindingType]| group_layout_of(device, "geometry", stages, types);
            let both = VERTEX | FRAGMENT;
            let (frame, view) = (layout(both, &[UNIFORM]), layout(both, &[UNIFORM; 2]));
            let textures = layout(FRAGMENT, &[floats(false, wgpu::TextureViewDimension::D2); 4]);
            let corner = wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3],
            };
            let depth = wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            };
            Self {
                surface: pipeline(
                    device,
                    SURFACE_SHADER,
                    ["surface_corner", "surface_color"],
                    &[&frame, &view],
                    Some((corner, depth)),
                ),
                behind: pipeline(
                    device,
                    BEHIND_SHADER,
                    ["whole_picture", "over_geometry"],
                    &[&textures],
                    None,
                ),
            }
        })
    }

    /// Draws meshes as the camera of a scene sees them.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        frame: &FrameUniforms,
        parts: &[OpaquePart],
    ) -> Result<OpaqueGeometry, GpuError> {
        let size = scene.settings().resolution;
        let uploads: Vec<Upload> =
            parts.iter().map(|part| Upload::new(gpu, scene, size, part)).collect::<Result<_, _>>()?;
        gpu.checked("opaque geometry", || {
            let [colors, distances] = FORMATS.map(|format| target(gpu, size, format));
            let depth = target(gpu, size, DEPTH);
            let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
            let geometry = OpaqueGeometry { size, colors: view(&colors), distances: view(&distances) };
            let frame = uniform(gpu, bytemuck::bytes_of(frame));
            let frame = bind(gpu, &self.surface, 0, &[frame.as_entire_binding()]);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let nothing = wgpu::Color { r: NO_DISTANCE, g: 0.0, b: 0.0, a: 0.0 };
                let attachments = [
                    attachment(&geometry.colors, wgpu::Color::TRANSPARENT),
                    attachment(&geometry.distances, nothing),
                ];
                let depth = view(&depth);
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("opaque geometry"),
                    color_attachments: &attachments,
                    depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                        view: &depth,
                        depth_ops: Some(wgpu::Operations {
                            load: wgpu::LoadOp::Clear(1.0),
                            store: wgpu::StoreOp::Discard,
                        }),
                        stencil_ops: None,
                    }),
                    ..wgpu::RenderPassDescriptor::default()
                });
                pass.set_pipeline(&self.surface);
                pass.set_bind_group(0, &frame, &[]);
                for upload in &uploads {
                    let resources = [upload.view.as_entire_binding(), upload.paint.as_entire_binding()];
                    pass.set_bind_group(1, &bind(gpu, &self.surface, 1, &resources), &[]);
                    pass.set_vertex_buffer(0, upload.corners.slice(..));
                    pass.draw(0..upload.count, 0..1);
                }
            }
            gpu.queue().submit([encoder.finish()]);
            geometry
        })
    }

    /// Puts an image over geometry: `textures` and `views` are its colours and depths.
    pub(crate) fn put_over(
        &self,
        gpu: &Gpu,
        geometry: &OpaqueGeometry,
        textures: [&wgpu::Texture; 2],
        views: [&wgpu::TextureView; 2],
    ) -> Result<(), GpuError> {
        gpu.checked("the image over opaque geometry", || {
            let together = FORMATS.map(|format| target(gpu, geometry.size, format));
            let together_views =
                together.each_ref().map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));
            let resources = [views[0], views[1], &geometry.colors, &geometry.distances]
                .map(wgpu::BindingResource::TextureView);
            let group = bind(gpu, &self.behind, 0, &resources);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let attachments =
                    together_views.each_ref().map(|view| attachment(view, wgpu::Color::TRANSPARENT));
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("over opaque geometry"),
                    color_attachments: &attachments,
                    ..wgpu::RenderPassDescriptor::default()
                });
                pass.set_pipeline(&self.behind);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..3, 0..1);
            }
            for (from, to) in together.iter().zip(textures) {
                encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }
}

/// A part on the device.
struct Upload {
    corners: wgpu::Buffer,
    count: u32,
    view: wgpu::Buffer,
    paint: wgpu::Buffer,
}

impl Upload {
    fn new(gpu: &Gpu, scene: &Scene, size: [u32; 2], part: &OpaquePart) -> Result<Self, GpuError> {
        let volume = scene.volume();
        let scene_from_mesh = scene.space().scene_from_world() * part.world_from_mesh;
        let triangles = part.mesh.triangles().len() as u64;
        let most = gpu.capabilities().max_buffer;
        if triangles * 36 > most || triangles > u64::from(u32::MAX / 3) {
            let what = format!("a mesh of {triangles} triangles, whose corners take more than {most} bytes");
            return Err(GpuError::OutOfMemory { what });
        }
        let voxel_from_mesh = *volume.voxel_from_world() * scene_from_mesh;
        let rays = scene.camera().rays(size[0], size[1]);
        let mut far: f64 = volume.spacing().max_element();
        for vertex in 0..part.mesh.vertices().len() as u32 {
            far = far.max(rays.depth_of(scene_from_mesh.transform_point3(part.mesh.position(vertex))));
        }
        let place = |v: &u32| voxel_from_mesh.transform_point3(part.mesh.position(*v)).as_vec3().to_array();
        let corners: Vec<[f32; 3]> = part.mesh.triangles().iter().flatten().map(place).collect();
        let clip = clip_from_world(scene, size, far);
        let view = ProxyViewUniforms::of_geometry(scene, size, clip);
        let paint = PaintUniforms {
            color: part.color,
            lit: u32::from(part.lit),
            depth_unit: far as f32,
            reserved_x: 0,
            reserved_y: 0,
            reserved_z: 0,
        };
        gpu.checked("a mesh", || Self {
            count: corners.len() as u32,
            // A buffer of no bytes cannot be bound.
            corners: gpu.buffer(
                "opaque geometry",
                if corners.is_empty() { &[0; 36] } else { bytemuck::cast_slice(&corners) },
                wgpu::BufferUsages::VERTEX,
            ),
            view: uniform(gpu, bytemuck::bytes_of(&view)),
            paint: uniform(gpu, bytemuck::bytes_of(&paint)),
        })
    }
}

fn pipeline(
    device: &wgpu::Device,
    shader: Shader,
    [vertex, fragment]: [&str; 2],
    layouts: &[&wgpu::BindGroupLayout],
    surface: Option<(wgpu::VertexBufferLayout, wgpu::DepthStencilState)>,
) -> wgpu::RenderPipeline {
    let module = shader.module(device);
    let layouts: Vec<_> = layouts.iter().map(|l| Some(*l)).collect();
    let layout = pipeline_layout(device, fragment, &layouts);
    let (corner, depth_stencil) = surface.unzip();
    let buffers: Vec<_> = corner.into_iter().map(Some).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &FORMATS.map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn attachment(view: &wgpu::TextureView, clear: wgpu::Color) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Store };
    Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
}

fn target(gpu: &Gpu, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("opaque geometry"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
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

fn uniform(gpu: &Gpu, contents: &[u8]) -> wgpu::Buffer {
    gpu.buffer("opaque geometry", contents, wgpu::BufferUsages::UNIFORM)
}

fn bind(
    gpu: &Gpu,
    pipeline: &wgpu::RenderPipeline,
    group: u32,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    bind_in_order(gpu.device(), &pipeline.get_bind_group_layout(group), resources)
}
