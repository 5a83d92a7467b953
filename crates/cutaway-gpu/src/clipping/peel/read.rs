//! Peeled layers on the host: to look at, and to test.

use cutaway_core::camera::intersect_box;
use cutaway_core::clip::{BufferDepth, Crossing};
use cutaway_core::glam::{DVec3, Vec2, Vec3};
use cutaway_core::scene::Scene;
use half::f16;

use super::Peeler;
use super::textures::Textures;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::frame::RayPlane;

/// One layer of a mesh: a crossing a pixel, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipLayer {
    /// Which object of the clip.
    pub leaf: u32,
    /// Whether rays enter or leave it there.
    pub crossing: Crossing,
    /// World distance from the eye (parallel rays: from the plane of the camera); NaN where the layer has nothing.
    pub t: Vec<f32>,
    /// The unit normal in the world, out of the object.
    pub normals: Vec<Vec3>,
}

impl Peeler {
    /// Copies the layers that were peeled last, of this scene, to the host.
    pub(in crate::clipping) fn read(&self, gpu: &Gpu, scene: &Scene) -> Result<Vec<ClipLayer>, GpuError> {
        let (Some(textures), Some(plan)) = (&self.textures, &self.peeled) else { return Ok(Vec::new()) };
        let size @ [width, _] = textures.size();
        let plane = RayPlane::new(scene, size);
        let voxel_from_world = scene.volume().voxel_from_world();
        // From the eye: where t is measured from, and where the volume is.
        let along = |i: usize| {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let ray = plane.rays.pixel(x, y);
            let origin = voxel_from_world.transform_point3(ray.origin);
            let direction = voxel_from_world.transform_vector3(ray.direction);
            let range = intersect_box(origin, direction, scene.volume().extent());
            // Of the ray's point, from which t is measured.
            let base = plane.rays.eye().map_or(plane.depth, |eye| plane.points.at(x, y).distance(eye));
            (base, range.map_or([0.0; 2], |r| [r.t_near(), r.t_far()]))
        };
        let mut layers = Vec::new();
        for run in plan.runs() {
            for layer in run.first..run.first + run.count {
                let texels = texels(gpu, textures, layer)?;
                let mut t = vec![f32::NAN; size.iter().map(|n| *n as usize).product()];
                let mut normals = vec![Vec3::ZERO; t.len()];
                for (i, &[place, x, y, _]) in texels.iter().enumerate().filter(|(_, texel)| texel[3] > 0.0) {
                    let (base, [near, far]) = along(i);
                    t[i] = match textures.depth() {
                        BufferDepth::Single => (base + f64::from(place)) as f32,
                        BufferDepth::Half => (near + (0.5 + 0.5 * f64::from(place)) * (far - near)) as f32,
                    };
                    normals[i] = unfolded(Vec2::new(x, y));
                }
                layers.push(ClipLayer { leaf: self.leaves[run.mesh], crossing: run.crossing, t, normals });
            }
        }
        Ok(layers)
    }
}

/// The texels of a layer, row by row.
fn texels(gpu: &Gpu, textures: &Textures, layer: u32) -> Result<Vec<[f32; 4]>, GpuError> {
    let [width, height] = textures.size();
    let row = width * textures.depth().bits() / 2;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.checked("reading a layer", || {
        let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("layer on its way"),
            size: u64::from(padded) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut from = textures.layers.as_image_copy();
        from.origin.z = layer;
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(from, to, size);
        gpu.queue().submit([encoder.finish()]);
        buffer
    })?;
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.finish()?;
    let mapped = buffer
        .get_mapped_range(..)
        .map_err(|e| GpuError::Refused { what: "reading a layer".to_owned(), reason: e.to_string() })?;
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for bytes in mapped.chunks(padded as usize) {
        match textures.depth() {
            BufferDepth::Single => {
                let of_row = bytes[..row as usize].chunks_exact(16);
                texels.extend(of_row.map(bytemuck::pod_read_unaligned::<[f32; 4]>));
            }
            BufferDepth::Half => {
                let of_row = bytes[..row as usize].chunks_exact(8);
                let single = |bits: [u16; 4]| bits.map(|bits| f16::from_bits(bits).to_f32());
                texels.extend(of_row.map(|texel| single(bytemuck::pod_read_unaligned(texel))));
            }
        }
    }
    Ok(texels)
}

/// The unit vector at a point of the unfolded octahedron.
fn unfolded(point: Vec2) -> Vec3 {
    let z = 1.0 - point.x.abs() - point.y.abs();
    let fold = (-z).max(0.0);
    let unfold = |v: f32| if v >= 0.0 { v - fold } else { v + fold };
    DVec3::new(unfold(point.x).into(), unfold(point.y).into(), z.into()).normalize_or_zero().as_vec3()
}
