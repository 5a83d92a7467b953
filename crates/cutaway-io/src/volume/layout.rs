//! What a header claims to hold, held against the limits, and which part of it is wanted.

use cutaway_core::volume::VoxelType;
use glam::UVec3;

use super::Context;
use super::error::{Place, ReadError};

/// What lies in a file: volumes of `dims` voxels, `components` of them interleaved, `volumes` of those after another.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub dims: [u64; 3],
    pub components: u64,
    pub volumes: u64,
    /// Where further volumes lie between the axes of space: all axes from the first of space to the last, the fastest
    /// first. Empty where the axes of space are side by side.
    pub between: Vec<Between>,
}

/// An axis of [`Shape::between`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between {
    pub size: u64,
    /// An axis of space; the others hold volumes, of which one is wanted.
    pub space: bool,
}

/// A [`Shape`] that fits in the limits, and which of its volumes is wanted.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub dims: UVec3,
    pub voxel: VoxelType,
    pub components: u64,
    /// Which of the interleaved components is wanted.
    pub component: u64,
    /// Elements in the whole file.
    pub elements: u64,
    /// First element of the group of interleaved volumes that holds the wanted one, and the group's length.
    pub from: u64,
    pub group: u64,
    /// Bytes of the wanted volume alone.
    pub bytes: usize,
    /// As in [`Shape`].
    between: Vec<Between>,
    /// How many volumes the axes between those of space hold, and which one is wanted.
    woven: u64,
    wanted: u64,
}

impl Layout {
    /// Holds a claimed shape against the limits. `field` and `place` are where the claim stands.
    pub(crate) fn new(
        ctx: &mut Context<'_>,
        shape: Shape,
        voxel: VoxelType,
        field: &'static str,
        place: Place,
    ) -> Result<Self, ReadError> {
        let [x, y, z] = shape.dims;
        let dims = shape.dims.map(u32::try_from);
        let [Ok(dx), Ok(dy), Ok(dz)] = dims else {
            return Err(ctx.too_large(shape.dims, voxel, u64::MAX));
        };
        if x == 0 || y == 0 || z == 0 || shape.components == 0 || shape.volumes == 0 {
            return Err(ReadError::Field {
                file: ctx.file.clone(),
                place,
                field,
                found: format!("{x} x {y} x {z}").into(),
                expected: "sizes of at least 1".to_owned(),
                hint: "",
            });
        }
        let voxels = x.checked_mul(y).and_then(|n| n.checked_mul(z));
        let bytes = voxels.and_then(|n| n.checked_mul(voxel.bytes() as u64)).unwrap_or(u64::MAX);
        if bytes > ctx.options.limits.max_bytes || usize::try_from(bytes).is_err() {
            return Err(ctx.too_large(shape.dims, voxel, bytes));
        }
        let others = shape.between.iter().filter(|axis| !axis.space);
        let woven = others.fold(1u64, |n, axis| n.saturating_mul(axis.size));
        let read = bytes.saturating_mul(woven);
        if read > ctx.options.limits.max_bytes || usize::try_from(read).is_err() {
            let what = format!("{woven} interleaved volumes of {x} x {y} x {z} {} voxels", voxel.name());
            let (file, limit) = (ctx.file.clone(), ctx.options.limits.max_bytes);
            return Err(ReadError::TooLarge { file, what, needed: read, limit });
        }
        let group = voxels.and_then(|n| n.checked_mul(shape.components)).and_then(|n| n.checked_mul(woven));
        let elements = group.and_then(|n| n.checked_mul(shape.volumes));
        let fits = elements.and_then(|n| n.checked_mul(voxel.bytes() as u64));
        let (Some(group), Some(elements), Some(_)) = (group, elements, fits) else {
            return Err(ctx.too_large(shape.dims, voxel, u64::MAX));
        };
        let (component, volume) = ctx.choose(shape.components, woven.saturating_mul(shape.volumes))?;
        let (wanted, volume) = (volume % woven, volume / woven);
        Ok(Self {
            dims: UVec3::new(dx, dy, dz),
            voxel,
            components: shape.components,
            component,
            elements,
            from: volume * group,
            group,
            bytes: bytes as usize,
            between: shape.between,
            woven,
            wanted,
        })
    }

    /// Bytes of everything that the file claims to hold.
    pub(crate) fn total_bytes(&self) -> u64 {
        self.elements * self.size()
    }

    /// Bytes of an element.
    pub(crate) fn size(&self) -> u64 {
        self.voxel.bytes() as u64
    }

    /// Bytes that are read for the wanted volume: those of the volumes that are interleaved with it, too.
    pub(crate) fn bytes_read(&self) -> usize {
        self.bytes * self.woven as usize
    }

    /// Keeps the wanted one of the volumes between the axes of space, of all that was read.
    pub(crate) fn pick(&self, bytes: &mut Vec<u8>) {
        let Some(first) = self.between.iter().position(|axis| !axis.space) else { return };
        let run: u64 = self.size() * self.between[..first].iter().map(|axis| axis.size).product::<u64>();
        // Steps of the axes beyond the runs; those of volumes stay where the wanted one is.
        let (mut step, mut wanted, mut start) = (run, self.wanted, 0);
        let mut axes = Vec::new();
        for axis in &self.between[first..] {
            if axis.space {
                axes.push((axis.size, step));
            } else {
                start += wanted % axis.size * step;
                wanted /= axis.size;
            }
            step *= axis.size;
        }
        for k in 0..self.bytes as u64 / run {
            let mut rest = k;
            let from = axes.iter().fold(start, |from, (size, step)| {
                let at = rest % size;
                rest /= size;
                from + at * step
            }) as usize;
            // Runs come in order and none is before its place.
            bytes.copy_within(from..from + run as usize, (k * run) as usize);
        }
        bytes.truncate(self.bytes);
    }

    /// The claim in words, for messages.
    pub(crate) fn describe(&self, span: Span) -> String {
        let [x, y, z] = self.dims.to_array();
        let name = self.voxel.name();
        let volumes = self.elements / (u64::from(x) * u64::from(y) * u64::from(z));
        let times = if volumes > 1 { format!("{volumes} times ") } else { String::new() };
        let part = if span.total < self.total_bytes() { "a part of " } else { "" };
        format!("{} ({part}{times}{x} x {y} x {z} {name})", bytes_exactly(span.total))
    }
}

/// A count of bytes to the byte, for sizes that are compared with a file's.
pub(crate) fn bytes_exactly(bytes: u64) -> String {
    format!("{bytes} bytes")
}

/// The stretch of a part that is wanted: bytes `[from, from + len)` of its `total`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub from: u64,
    pub len: u64,
    pub total: u64,
}
