//! Voxel sources: where voxels come from, brick by brick, at several resolutions.
//!
//! A source describes its grids without reading a voxel ([`SourceInfo`]), and reads boxes of voxels on request
//! ([`VoxelSource::read`]). A [`Volume`] in memory is a source of one level, one channel and one time. Level 0 is the finest.
//! Voxels come as they are stored; [`SourceInfo::rescale`] turns them into values.

use glam::{DAffine3, UVec3};

use crate::space::WorldFrame;
use crate::volume::{Rescale, Volume, Voxels};
use crate::with_voxels;

/// The meaning of a source's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SourceKind {
    /// Measured or computed values, which may be interpolated.
    #[default]
    Scalar,
    /// Labels, between which there is nothing.
    Labels,
}

/// The grid of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelInfo {
    /// Number of voxels along x, y, z.
    pub dimensions: UVec3,
    /// Transform from the voxel indices of this level to the world.
    pub world_from_voxel: DAffine3,
    /// Number of voxels along x, y, z that are best read together: a chunk of a file.
    pub brick: UVec3,
}

/// The description of a source.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceInfo {
    /// The meaning of its numbers.
    pub kind: SourceKind,
    /// Its levels, the finest first; at least one.
    pub levels: Vec<LevelInfo>,
    /// Number of channels.
    pub channels: u32,
    /// Number of times.
    pub times: u32,
    /// Transform from stored numbers to values.
    pub rescale: Rescale,
    /// Meaning of the world's axes.
    pub frame: WorldFrame,
}

/// A box of voxels of one level, channel and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Region {
    /// Level; 0 is the finest.
    pub level: u32,
    /// Channel, from 0.
    pub channel: u32,
    /// Time, from 0.
    pub time: u32,
    /// First voxel along x, y, z.
    pub min: UVec3,
    /// One past the last voxel along x, y, z.
    pub max: UVec3,
}

/// A box of voxels that was read.
#[derive(Clone, Debug)]
pub struct SourceBrick {
    /// Its first voxel, in the voxel indices of the level.
    pub min: UVec3,
    /// Number of voxels along x, y, z.
    pub dimensions: UVec3,
    /// Stored numbers, x fastest, then y, then z.
    pub voxels: Voxels,
}

/// The reason why voxels were not read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// A region that the source does not have.
    #[error(
        "voxels {min:?} to {max:?} of level {level}, channel {channel}, time {time} are outside the source"
    )]
    Outside {
        /// Level asked for.
        level: u32,
        /// Channel asked for.
        channel: u32,
        /// Time asked for.
        time: u32,
        /// First voxel asked for.
        min: [u32; 3],
        /// One past the last voxel asked for.
        max: [u32; 3],
    },
    /// A chunk that could not be read: the place, and what is wrong.
    #[error("{place}: {reason}")]
    Read {
        /// The file, chunk or address.
        place: String,
        /// What is wrong.
        reason: String,
    },
}

/// A place that voxels come from.
pub trait VoxelSource: std::fmt::Debug + Send + Sync {
    /// Returns the description of the source. Reads no voxel.
    fn info(&self) -> SourceInfo;

    /// Returns the smallest and largest stored number of a level, where it is known without reading voxels.
    fn stored_range(&self, level: u32) -> Option<[f32; 2]>;

    /// Reads a region, as bricks that together cover it and do not overlap.
    ///
    /// # Errors
    /// A region outside the source; chunks that cannot be read.
    fn read(&self, region: &Region) -> Result<Vec<SourceBrick>, SourceError>;
}

impl Region {
    /// Returns the number of voxels along x, y, z.
    pub fn dimensions(&self) -> UVec3 {
        self.max.saturating_sub(self.min)
    }

    /// Checks that a source has the region, and that it is not empty.
    ///
    /// # Errors
    /// [`SourceError::Outside`].
    pub fn check(&self, info: &SourceInfo) -> Result<LevelInfo, SourceError> {
        let level = info.levels.get(self.level as usize).copied();
        let inside = |level: &LevelInfo| {
            self.min.cmplt(self.max).all()
                && self.max.cmple(level.dimensions).all()
                && self.channel < info.channels
                && self.time < info.times
        };
        level.filter(inside).ok_or(SourceError::Outside {
            level: self.level,
            channel: self.channel,
            time: self.time,
            min: self.min.to_array(),
            max: self.max.to_array(),
        })
    }
}

/// Reads a region into one array of stored numbers, x fastest, then y, then z.
///
/// # Errors
/// As [`VoxelSource::read`].
pub fn gather(source: &dyn VoxelSource, region: &Region) -> Result<Vec<f32>, SourceError> {
    let size = region.dimensions().as_usizevec3();
    let mut gathered = vec![0.0; size.x * size.y * size.z];
    for brick in source.read(region)? {
        let lo = brick.min.max(region.min);
        let hi = (brick.min + brick.dimensions).min(region.max);
        let row = hi.x.saturating_sub(lo.x) as usize;
        with_voxels!(&brick.voxels, voxels => {
            for z in lo.z..hi.z {
                for y in lo.y..hi.y {
                    let from = index(UVec3::new(lo.x, y, z) - brick.min, brick.dimensions);
                    let to = index(UVec3::new(lo.x, y, z) - region.min, region.dimensions());
                    let rows = gathered[to..to + row].iter_mut().zip(&voxels[from..from + row]);
                    rows.for_each(|(to, from)| *to = single(*from));
                }
            }
        });
    }
    Ok(gathered)
}

fn single<T: Into<f32>>(stored: T) -> f32 {
    stored.into()
}

fn index(at: UVec3, dimensions: UVec3) -> usize {
    let (at, size) = (at.as_usizevec3(), dimensions.as_usizevec3());
    (at.z * size.y + at.y) * size.x + at.x
}

impl From<Vec<u8>> for Voxels {
    fn from(stored: Vec<u8>) -> Self {
        Self::U8(stored)
    }
}

impl From<Vec<u16>> for Voxels {
    fn from(stored: Vec<u16>) -> Self {
        Self::U16(stored)
    }
}

impl From<Vec<f32>> for Voxels {
    fn from(stored: Vec<f32>) -> Self {
        Self::F32(stored)
    }
}

/// A volume in memory: one level, channel and time.
impl VoxelSource for Volume {
    fn info(&self) -> SourceInfo {
        let dimensions = self.dimensions();
        let level = LevelInfo { dimensions, world_from_voxel: *self.world_from_voxel(), brick: dimensions };
        SourceInfo {
            kind: SourceKind::Scalar,
            levels: vec![level],
            channels: 1,
            times: 1,
            rescale: self.rescale(),
            frame: self.geometry().frame,
        }
    }

    fn stored_range(&self, level: u32) -> Option<[f32; 2]> {
        (level == 0).then(|| Volume::stored_range(self))
    }

    fn read(&self, region: &Region) -> Result<Vec<SourceBrick>, SourceError> {
        region.check(&self.info())?;
        let dimensions = region.dimensions();
        let row = dimensions.x as usize;
        let voxels = with_voxels!(self.voxels(), voxels => {
            let mut read = Vec::with_capacity(row * dimensions.y as usize * dimensions.z as usize);
            for z in region.min.z..region.max.z {
                for y in region.min.y..region.max.y {
                    let from = index(UVec3::new(region.min.x, y, z), self.dimensions());
                    read.extend_from_slice(&voxels[from..from + row]);
                }
            }
            Voxels::from(read)
        });
        Ok(vec![SourceBrick { min: region.min, dimensions, voxels }])
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::volume::Geometry;

    /// A pyramid that is computed: level `l` has every `2^l`-th voxel of x + 100 y + 10000 z, in bricks.
    #[derive(Debug)]
    struct Pyramid {
        dimensions: UVec3,
        brick: UVec3,
    }

    impl Pyramid {
        fn stored(level: u32, at: UVec3) -> f32 {
            let at = (at * (1 << level)).as_vec3();
            at.x + 100.0 * at.y + 10_000.0 * at.z
        }
    }

    impl VoxelSource for Pyramid {
        fn info(&self) -> SourceInfo {
            let level = |l: u32| LevelInfo {
                dimensions: self.dimensions.map(|n| n.div_ceil(1 << l)),
                world_from_voxel: DAffine3::from_scale(DVec3::splat(f64::from(1 << l))),
                brick: self.brick,
            };
            SourceInfo {
                kind: SourceKind::Scalar,
                levels: (0..3).map(level).collect(),
                channels: 1,
                times: 2,
                rescale: Rescale::IDENTITY,
                frame: WorldFrame::Unknown,
            }
        }

        fn stored_range(&self, level: u32) -> Option<[f32; 2]> {
            let last = self.info().levels.get(level as usize)?.dimensions - UVec3::ONE;
            Some([0.0, Self::stored(level, last)])
        }

        /// Whole bricks, as a file of chunks has them.
        fn read(&self, region: &Region) -> Result<Vec<SourceBrick>, SourceError> {
            let level = region.check(&self.info())?;
            let (first, last) = (region.min / level.brick, (region.max - UVec3::ONE) / level.brick);
            let mut bricks = Vec::new();
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        let min = UVec3::new(x, y, z) * level.brick;
                        let dimensions = (min + level.brick).min(level.dimensions) - min;
                        let all = (0..dimensions.z).flat_map(|z| {
                            (0..dimensions.y)
                                .flat_map(move |y| (0..dimensions.x).map(move |x| UVec3::new(x, y, z)))
                        });
                        let voxels: Vec<f32> = all.map(|at| Self::stored(region.level, min + at)).collect();
                        bricks.push(SourceBrick { min, dimensions, voxels: voxels.into() });
                    }
                }
            }
            Ok(bricks)
        }
    }

    fn region(level: u32, min: UVec3, max: UVec3) -> Region {
        Region { level, channel: 0, time: 0, min, max }
    }

    proptest! {
        /// Whatever box of whatever level is gathered, each voxel is the one of its place.
        #[test]
        fn a_box_of_bricks_is_gathered(
            level in 0u32..3,
            corner in prop::array::uniform3(0u32..5),
            size in prop::array::uniform3(1u32..9),
        ) {
            let source = Pyramid { dimensions: UVec3::new(37, 29, 41), brick: UVec3::new(5, 4, 3) };
            let dimensions = source.info().levels[level as usize].dimensions;
            let min = UVec3::from_array(corner).min(dimensions - UVec3::ONE);
            let max = (min + UVec3::from_array(size)).min(dimensions);
            let wanted = region(level, min, max);
            let gathered = gather(&source, &wanted).unwrap();
            for (i, stored) in gathered.iter().enumerate() {
                let d = wanted.dimensions();
                let at = UVec3::new(i as u32 % d.x, i as u32 / d.x % d.y, i as u32 / (d.x * d.y));
                prop_assert_eq!(*stored, Pyramid::stored(level, min + at));
            }
        }
    }

    #[test]
    fn a_volume_is_a_source() {
        let d = UVec3::new(5, 4, 3);
        let voxels: Vec<u16> = (0..60).collect();
        let volume = Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap();
        let info = volume.info();
        assert_eq!((info.levels.len(), info.levels[0].dimensions), (1, d));
        assert_eq!(VoxelSource::stored_range(&volume, 0), Some([0.0, 59.0]));
        assert_eq!(VoxelSource::stored_range(&volume, 1), None);
        let part = gather(&volume, &region(0, UVec3::new(1, 2, 1), UVec3::new(3, 4, 2))).unwrap();
        assert_eq!(part, [31.0, 32.0, 36.0, 37.0]);
    }

    #[test]
    fn regions_outside_are_refused() {
        let source = Pyramid { dimensions: UVec3::splat(8), brick: UVec3::splat(4) };
        let one = UVec3::ONE;
        let wrong = [
            region(3, UVec3::ZERO, one),
            region(0, UVec3::ZERO, UVec3::new(9, 1, 1)),
            region(0, one, one),
            Region { channel: 1, ..region(0, UVec3::ZERO, one) },
            Region { time: 2, ..region(0, UVec3::ZERO, one) },
        ];
        for region in wrong {
            assert!(matches!(source.read(&region), Err(SourceError::Outside { .. })), "{region:?}");
        }
        assert!(source.read(&Region { time: 1, ..region(2, UVec3::ZERO, one * 2) }).is_ok());
    }
}
