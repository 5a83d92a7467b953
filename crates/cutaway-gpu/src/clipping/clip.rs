//! A scene's clip on the device.

use std::sync::Arc;

use cutaway_core::clip::FlatClip;

use super::leaf::{ClipCamera, Leaf, ROOT};
use super::mesh::{GpuMesh, MeshCache};
use crate::context::Gpu;
use crate::error::GpuError;

/// A clip as one frame sees it: its expression, its objects under a camera, and their meshes, which outlive it.
#[derive(Debug)]
pub(crate) struct GpuClip {
    pub(super) leaves: wgpu::Buffer,
    pub(super) gates: wgpu::Buffer,
    pub(super) leaf_count: u32,
    pub(super) gate_count: u32,
    pub(super) keeps_outside: bool,
    /// Which leaf each belongs to.
    pub(super) meshes: Vec<(u32, Arc<GpuMesh>)>,
    /// Of each leaf, whether its pose mirrors.
    pub(super) mirrored: Vec<bool>,
    /// What had to be uploaded of meshes, in bytes.
    pub(super) uploaded: u64,
}

impl GpuClip {
    pub(super) fn new(
        gpu: &Gpu,
        clip: &FlatClip,
        view: &ClipCamera,
        cache: &mut MeshCache,
    ) -> Result<Self, GpuError> {
        let mut leaves = Vec::with_capacity(clip.leaves().len());
        let (mut meshes, mut uploaded) = (Vec::new(), 0);
        for (index, leaf) in (0u32..).zip(clip.leaves()) {
            let unknown = GpuError::UnknownSolid { object: leaf.object.0 };
            let bare = u32::from(!leaf.solid.has_surface());
            let leaf = &*cache.as_mesh(leaf)?;
            let uniforms = Leaf::new(leaf, view).ok_or(unknown)?;
            leaves.push(Leaf { bare, ..uniforms });
            if let Some((mesh, bytes)) = cache.get(gpu, leaf)? {
                meshes.push((index, mesh));
                uploaded += bytes;
            }
        }
        cache.forget_dropped();
        let mirrored = leaves.iter().map(|leaf: &Leaf| leaf.mirrored == 1).collect();
        let mut gates: Vec<[u32; 4]> = clip
            .gates()
            .map(|gate| {
                let output = gate.output.gate.unwrap_or(ROOT);
                [gate.threshold, gate.true_inputs, output, u32::from(gate.output.inverted)]
            })
            .collect();
        let (leaf_count, gate_count) = (leaves.len() as u32, gates.len() as u32);
        // Buffers are never empty.
        if leaves.is_empty() {
            leaves.push(bytemuck::Zeroable::zeroed());
        }
        gates.push([0; 4]);
        let most = gpu.capabilities().max_buffer / size_of::<Leaf>() as u64;
        let needed = (leaves.len() + gates.len()) as u64;
        if needed > most {
            return Err(GpuError::ClipTooLarge { of: "objects and operations", needed, most });
        }
        let upload = |label, contents: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.buffer(label, contents, usage)
        };
        let [leaves, gates] = gpu.checked("the clip expression", || {
            [
                upload("clip objects", bytemuck::cast_slice(&leaves)),
                upload("clip gates", bytemuck::cast_slice(&gates)),
            ]
        })?;
        let keeps_outside = clip.keeps_outside();
        Ok(Self { leaves, gates, leaf_count, gate_count, keeps_outside, meshes, mirrored, uploaded })
    }

    /// Words of the expression's state on one ray.
    pub(super) fn state_words(&self) -> u64 {
        u64::from(self.leaf_count) + u64::from(self.gate_count)
    }
}
