//! A proxy on the device: made from the occupancy by three compute passes, without a word read back.

use cutaway_core::glam::UVec3;

use super::pipelines::ProxyPipelines;
use super::uniforms::BuildUniforms;
use super::{Flavour, ProxyOptions};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::ranges::Occupancy;

/// Units along a side at most: coordinates have 10 bits, and the last one is the far side.
const MOST_UNITS: u32 = 1023;

/// Cells at most; of larger volumes each is larger.
const MOST_CELLS: u64 = 1 << 21;

/// Cells along the longest side of a volume: for flavours that draw a surface only, whose faces grow with the square of this;
/// for a fitted contour, which has faces within the surface too; and for those that draw every cell. With more, the latter
/// have more quads than there is room for.
const CELLS_ALONG: [u32; 3] = [32, 16, 8];

/// Blocks that a software adapter reads in 100 ms at the least, and a GPU.
const BLOCKS_AT_ONCE: [u64; 2] = [1 << 22, 1 << 29];

/// The measures of a proxy: units, cells and room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ProxyGrid {
    blocks: UVec3,
    blocks_per_unit: u32,
    units: UVec3,
    units_per_cell: u32,
    cells: UVec3,
    capacity: u32,
}

impl ProxyGrid {
    /// `room`: bytes of a buffer at most.
    pub(crate) fn new(blocks: UVec3, flavour: Flavour, options: &ProxyOptions, room: u64) -> Self {
        let blocks_per_unit = blocks.max_element().div_ceil(MOST_UNITS).max(1);
        let per = |n: UVec3, k: u32| UVec3::new(n.x.div_ceil(k), n.y.div_ceil(k), n.z.div_ceil(k));
        let units = per(blocks, blocks_per_unit);
        let along = match flavour {
            Flavour { boundary: true, .. } | Flavour { glued: true, fitted: false, .. } => CELLS_ALONG[0],
            Flavour { glued: true, .. } => CELLS_ALONG[1],
            _ => CELLS_ALONG[2],
        };
        let along = blocks.max_element().div_ceil(along);
        let wanted = options.cell_blocks.unwrap_or(along.max(1 + u32::from(flavour.fitted)));
        let mut units_per_cell = wanted.max(1).div_ceil(blocks_per_unit).min(MOST_UNITS);
        let count = |cells: UVec3| cells.as_u64vec3().element_product();
        while count(per(units, units_per_cell)) > MOST_CELLS {
            units_per_cell += 1;
        }
        let cells = per(units, units_per_cell);
        // Haferburg: the faces of the box, and ten slices more; n² of a cube is a third of its three sides.
        let [x, y, z] = cells.as_u64vec3().to_array();
        let all = 16 * (x * y + y * z + z * x).div_ceil(3);
        // Every cell has six faces, and its box may be there too.
        let capacity = all.min(12 * count(cells)).min(room / 16).min(u64::from(u32::MAX / 8)) as u32;
        let capacity = capacity.min(options.most_quads.unwrap_or(u32::MAX)).max(6);
        Self { blocks, blocks_per_unit, units, units_per_cell, cells, capacity }
    }

    fn uniforms(&self, flavour: Flavour, first_slab: u32) -> BuildUniforms {
        BuildUniforms {
            blocks: self.blocks.to_array(),
            blocks_per_unit: self.blocks_per_unit,
            units: self.units.to_array(),
            units_per_cell: self.units_per_cell,
            cells: self.cells.to_array(),
            capacity: self.capacity,
            fitted: u32::from(flavour.fitted),
            glued: u32::from(flavour.glued),
            boundary: u32::from(flavour.boundary),
            first_slab,
        }
    }

    /// Slabs of cells, as the first one's z and how many, that are gone through at once. Multiples of a workgroup's depth.
    fn slabs(&self, software: bool) -> Vec<[u32; 2]> {
        let blocks_per_cell = u64::from(self.units_per_cell * self.blocks_per_unit).pow(3);
        // The second pass reads some two hundred boxes a cell at a surface, the first a cell's blocks.
        let layer = u64::from(self.cells.x) * u64::from(self.cells.y) * blocks_per_cell.max(64);
        let most = BLOCKS_AT_ONCE[usize::from(!software)] / layer;
        let depth = (most / 4 * 4).clamp(4, 1 << 16) as u32;
        (0..self.cells.z)
            .step_by(depth as usize)
            .map(|first| [first, depth.min(self.cells.z - first)])
            .collect()
    }
}

/// How many quads a proxy has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProxyCounts {
    /// Quads that are drawn.
    pub quads: u32,
    /// Quads that there would be if there were room for all; more than there is room for: a box is drawn instead.
    pub wanted: u32,
    /// Quads that there is room for.
    pub capacity: u32,
}

/// Quads on the device, and how they are drawn.
#[derive(Debug)]
pub(crate) struct ProxyGeometry {
    flavour: Flavour,
    options: ProxyOptions,
    grid: ProxyGrid,
    edge: u32,
    boxes: wgpu::Buffer,
    quads: wgpu::Buffer,
    draws: wgpu::Buffer,
    counts: wgpu::Buffer,
}

impl ProxyGeometry {
    pub(crate) fn new(
        gpu: &Gpu,
        pipelines: &ProxyPipelines,
        occupancy: &Occupancy,
        flavour: Flavour,
        options: &ProxyOptions,
    ) -> Result<Self, GpuError> {
        let blocks = occupancy.levels();
        let room = gpu.capabilities().max_buffer;
        let grid = ProxyGrid::new(blocks.fine, flavour, options, room);
        let storage = wgpu::BufferUsages::STORAGE;
        let made = gpu.checked("the proxy geometry", || {
            let buffer = |label, size: u64, usage| {
                let mapped_at_creation = false;
                gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size,
                    usage,
                    mapped_at_creation,
                })
            };
            let cells = grid.cells.as_u64vec3().element_product();
            // Least corners are lowered, the others raised.
            let counts: [u32; 8] = [0, u32::MAX, u32::MAX, u32::MAX, 0, 0, 0, 0];
            Self {
                flavour,
                options: options.clone(),
                grid,
                edge: blocks.fine_edge,
                boxes: buffer("proxy boxes", 8 * cells, storage),
                quads: buffer("proxy quads", 16 * u64::from(grid.capacity), storage),
                draws: buffer(
                    "proxy draws",
                    32,
                    storage | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_SRC,
                ),
                counts: gpu.buffer(
                    "proxy counts",
                    bytemuck::cast_slice(&counts),
                    storage | wgpu::BufferUsages::COPY_SRC,
                ),
            }
        })?;
        made.fill(gpu, pipelines, occupancy)?;
        Ok(made)
    }

    /// Runs the three passes, each slab by slab: quads need the boxes of all slabs.
    fn fill(&self, gpu: &Gpu, pipelines: &ProxyPipelines, occupancy: &Occupancy) -> Result<(), GpuError> {
        let slabs = self.grid.slabs(gpu.adapter().software);
        let [find, add, finish] = pipelines.build();
        let groups = |[x, y, z]: [u32; 3]| [x.div_ceil(4), y.div_ceil(4), z.div_ceil(4)];
        let passes = [find, add].into_iter().flat_map(|pipeline| {
            slabs.iter().map(move |[first, depth]| {
                (pipeline, *first, groups([self.grid.cells.x, self.grid.cells.y, *depth]))
            })
        });
        for (pipeline, first, groups) in passes.chain([(finish, 0, [1; 3])]) {
            gpu.checked("building the proxy geometry", || {
                let uniforms = self.grid.uniforms(self.flavour, first);
                let uniforms =
                    gpu.buffer("proxy build", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
                let buffers =
                    [&uniforms, occupancy.bits(), &self.boxes, &self.quads, &self.draws, &self.counts];
                let group = pipelines.bind_build(gpu, buffers);
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, &group, &[]);
                    pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
                }
                gpu.queue().submit([encoder.finish()]);
            })?;
        }
        Ok(())
    }

    /// Whether this is what these would make.
    pub(crate) fn is(&self, flavour: Flavour, options: &ProxyOptions) -> bool {
        self.flavour == flavour && self.options == *options
    }

    /// Reads back how many quads there are.
    pub(crate) fn counts(&self, gpu: &Gpu) -> Result<ProxyCounts, GpuError> {
        let what = "counting the proxy's quads";
        let read = |source: &wgpu::Buffer| -> Result<u32, GpuError> {
            let copy = gpu.checked(what, || {
                let copy = gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some("count"),
                    size: 4,
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                });
                let mut encoder =
                    gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_buffer_to_buffer(source, 0, &copy, 0, 4);
                gpu.queue().submit([encoder.finish()]);
                copy.map_async(wgpu::MapMode::Read, .., |_| {});
                copy
            })?;
            gpu.finish()?;
            let refused =
                |e: wgpu::MapRangeError| GpuError::Refused { what: what.to_owned(), reason: e.to_string() };
            let mapped = copy.get_mapped_range(..).map_err(refused)?;
            Ok(bytemuck::pod_read_unaligned(&mapped[..4]))
        };
        Ok(ProxyCounts {
            quads: read(&self.draws)? / 6,
            wanted: read(&self.counts)?,
            capacity: self.grid.capacity,
        })
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.boxes.size() + self.quads.size() + self.draws.size() + self.counts.size()
    }

    /// Voxels along an edge of a unit.
    pub(crate) fn unit_edge(&self) -> f32 {
        (self.edge * self.grid.blocks_per_unit) as f32
    }

    /// Cells along each axis, and voxels along an edge of one.
    pub(crate) fn cells(&self) -> ([u32; 3], f32) {
        (self.grid.cells.to_array(), self.unit_edge() * self.grid.units_per_cell as f32)
    }

    pub(crate) fn boxes(&self) -> &wgpu::Buffer {
        &self.boxes
    }

    pub(crate) fn quads(&self) -> &wgpu::Buffer {
        &self.quads
    }

    /// Arguments of draws: of triangles, and from [`LINES`] on of lines.
    pub(crate) fn draws(&self) -> &wgpu::Buffer {
        &self.draws
    }
}

/// Where in [`ProxyGeometry::draws`] the draw of the quads' edges is.
pub(crate) const LINES: u64 = 16;

#[cfg(test)]
mod tests {
    use super::*;

    const CONTOUR: Flavour = Flavour { fitted: false, glued: true, boundary: false };

    #[test]
    fn coordinates_have_ten_bits_and_memory_is_bounded() {
        for n in [1, 2, 64, 1023, 1024, 3000, 20_000] {
            let blocks = UVec3::new(n, n / 3 + 1, 7);
            let grid = ProxyGrid::new(blocks, CONTOUR, &ProxyOptions::default(), 1 << 27);
            assert!(grid.units.max_element() <= MOST_UNITS, "{grid:?}");
            assert!((grid.units * grid.blocks_per_unit).cmpge(blocks).all(), "{grid:?}");
            assert!((grid.cells * grid.units_per_cell).cmpge(grid.units).all(), "{grid:?}");
            assert!(grid.cells.as_u64vec3().element_product() <= MOST_CELLS, "{grid:?}");
            assert!(u64::from(grid.capacity) * 16 <= 1 << 27, "{grid:?}");
        }
        let cube = ProxyGrid::new(
            UVec3::splat(64),
            CONTOUR,
            &ProxyOptions { cell_blocks: Some(1), ..ProxyOptions::default() },
            1 << 27,
        );
        assert_eq!(cube.capacity, 16 * 64 * 64);
    }

    #[test]
    fn slabs_cover_every_layer_once() {
        for software in [false, true] {
            let grid = ProxyGrid::new(UVec3::new(300, 300, 211), CONTOUR, &ProxyOptions::default(), 1 << 27);
            let mut next = 0;
            for [first, depth] in grid.slabs(software) {
                assert_eq!(first, next);
                next += depth;
            }
            assert_eq!(next, grid.cells.z);
        }
    }
}
