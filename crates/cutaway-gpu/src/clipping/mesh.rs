//! Meshes on the device: uploaded once, whatever pose they are then given.

use std::any::Any;
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Weak};

use cutaway_core::clip::{FlatLeaf, MissingCells, Solid};
use cutaway_core::glam::{DAffine3, DVec3, Vec3};
use cutaway_mesh::{EventFinder, MeshSolid, TriangleMesh, missing_cells};

use crate::context::Gpu;
use crate::error::GpuError;

/// What a mesh's own numbers are measured from, and in: its middle, relative to its origin, and half its largest side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LocalSpace {
    origin: DVec3,
    middle: DVec3,
    size: f64,
}

impl LocalSpace {
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let origin = mesh.origin();
        let Some([low, high]) = mesh.bounds().map(|ends| ends.map(|end| end - origin)) else {
            return Self { origin, middle: DVec3::ZERO, size: 1.0 };
        };
        let size = 0.5 * (high - low).max_element();
        Self { origin, middle: 0.5 * (low + high), size: if size > 0.0 { size } else { 1.0 } }
    }

    /// From the mesh's vertices, which are relative to its origin.
    fn local_from_mesh(self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(1.0 / self.size)) * DAffine3::from_translation(-self.middle)
    }

    pub(super) fn local_from_object(self) -> DAffine3 {
        self.local_from_mesh() * DAffine3::from_translation(-self.origin)
    }
}

/// A mesh on the device.
#[derive(Debug)]
pub(crate) struct GpuMesh {
    /// Vertices, triangles and normals; see `lists.wgsl`.
    buffers: [wgpu::Buffer; 3],
    triangles: u32,
}

impl GpuMesh {
    fn new(gpu: &Gpu, solid: &MeshSolid) -> Result<Self, GpuError> {
        let mesh = solid.mesh();
        let most = gpu.capabilities().max_buffer / 12;
        let check = |count: usize, of| {
            let needed = count as u64;
            if needed > most { Err(GpuError::ClipTooLarge { of, needed, most }) } else { Ok(()) }
        };
        check(mesh.vertices().len(), "vertices of a mesh")?;
        check(mesh.triangles().len(), "triangles of a mesh")?;
        let local_from_mesh = LocalSpace::of(mesh).local_from_mesh();
        let local = |v: &Vec3| local_from_mesh.transform_point3(v.as_dvec3()).as_vec3().to_array();
        let positions: Vec<[f32; 3]> = mesh.vertices().iter().map(local).collect();
        let normals: Vec<[u32; 3]> =
            (0..mesh.triangles().len()).map(|t| solid.corner_normals(t).map(octahedral)).collect();
        let buffers = gpu.checked("a clip mesh", || {
            let upload = |label, contents: &[u8]| {
                // A buffer is never empty.
                let contents = if contents.is_empty() { &[0; 12] } else { contents };
                let usage = wgpu::BufferUsages::STORAGE;
                gpu.buffer(label, contents, usage)
            };
            [
                upload("vertices of a clip mesh", bytemuck::cast_slice(&positions)),
                upload("triangles of a clip mesh", bytemuck::cast_slice(mesh.triangles())),
                upload("normals of a clip mesh", bytemuck::cast_slice(&normals)),
            ]
        })?;
        // At most as many as fit in a buffer, far from what u32 holds.
        Ok(Self { buffers, triangles: mesh.triangles().len() as u32 })
    }

    pub(super) fn buffers(&self) -> &[wgpu::Buffer; 3] {
        &self.buffers
    }

    pub(super) fn triangles(&self) -> u32 {
        self.triangles
    }

    fn bytes(&self) -> u64 {
        self.buffers.iter().map(wgpu::Buffer::size).sum()
    }
}

/// A unit normal on the unfolded octahedron, 16 bits a side; `octahedral.wgsl` has the same.
fn octahedral(n: Vec3) -> u32 {
    let on_octahedron = n / n.abs().element_sum().max(f32::MIN_POSITIVE);
    let [x, y, z] = on_octahedron.to_array();
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    let [x, y] = if z < 0.0 { [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)] } else { [x, y] };
    let [x, y] = [x, y].map(|v| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16));
    x | y << 16
}

/// The meshes that clips have had, as long as their solids live.
#[derive(Debug, Default)]
pub(super) struct MeshCache {
    /// By the solid's address, which no other has while there is a reference to it, however weak.
    meshes: HashMap<usize, Kept>,
    /// Meshes of what shaders know no other form of: missing cells.
    made: HashMap<usize, Made>,
}

#[derive(Debug)]
struct Made {
    of: Weak<dyn Solid>,
    solid: Arc<dyn Solid>,
}

#[derive(Debug)]
struct Kept {
    solid: Weak<dyn Solid>,
    mesh: Arc<GpuMesh>,
}

impl MeshCache {
    /// The mesh of an object, uploaded if it is not there yet, and the bytes that this took; none of other solids.
    pub(super) fn get(
        &mut self,
        gpu: &Gpu,
        leaf: &FlatLeaf,
    ) -> Result<Option<(Arc<GpuMesh>, u64)>, GpuError> {
        let any: &dyn Any = leaf.solid.as_ref();
        let Some(solid) = any.downcast_ref::<MeshSolid>() else { return Ok(None) };
        let address = Arc::as_ptr(&leaf.solid).addr();
        if let Some(kept) = self.meshes.get(&address) {
            return Ok(Some((kept.mesh.clone(), 0)));
        }
        let mesh = Arc::new(GpuMesh::new(gpu, solid)?);
        let kept = Kept { solid: Arc::downgrade(&leaf.solid), mesh: mesh.clone() };
        self.meshes.insert(address, kept);
        let bytes = mesh.bytes();
        Ok(Some((mesh, bytes)))
    }

    /// The object, or, where no shader knows it but as a mesh, the same as a mesh.
    pub(super) fn as_mesh<'a>(&mut self, leaf: &'a FlatLeaf) -> Result<Cow<'a, FlatLeaf>, GpuError> {
        let any: &dyn Any = leaf.solid.as_ref();
        let Some(cells) = any.downcast_ref::<MissingCells>() else { return Ok(Cow::Borrowed(leaf)) };
        let address = Arc::as_ptr(&leaf.solid).addr();
        let mut as_mesh = leaf.clone();
        as_mesh.solid = match self.made.get(&address) {
            Some(made) => made.solid.clone(),
            None => {
                let mesh = missing_cells(cells);
                let solid: Arc<dyn Solid> = Arc::new(MeshSolid::new(Arc::new(mesh), EventFinder::Bvh));
                self.made.insert(address, Made { of: Arc::downgrade(&leaf.solid), solid: solid.clone() });
                solid
            }
        };
        Ok(Cow::Owned(as_mesh))
    }

    /// Lets go of meshes whose solids are gone.
    pub(super) fn forget_dropped(&mut self) {
        self.made.retain(|_, made| made.of.strong_count() > 0);
        self.meshes.retain(|_, kept| kept.solid.strong_count() > 0);
    }

    /// What they take of the device's memory.
    pub(super) fn bytes(&self) -> u64 {
        self.meshes.values().map(|kept| kept.mesh.bytes()).sum()
    }
}
