//! Missing voxels: those that a file marks by NaN.
//!
//! A cell (the eight voxels around a sample) that touches a missing voxel shows nothing. Missing voxels have numbers all the
//! same, because gradients at the rim of what is there read one voxel further: the mean of their neighbours, which makes up no
//! edge.

use std::sync::Arc;

use glam::UVec3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::clip::MissingCells;

/// How voxels are shown that have no value (NaN).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NanMeaning {
    /// Nothing is shown in the cells that touch them.
    #[default]
    Transparent,
    /// As voxels of the smallest value.
    Lowest,
    /// As voxels of the largest value.
    Highest,
}

impl NanMeaning {
    /// Every meaning.
    pub const ALL: [Self; 3] = [Self::Transparent, Self::Lowest, Self::Highest];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Transparent => "transparent",
            Self::Lowest => "lowest",
            Self::Highest => "highest",
        }
    }
}

/// One bit per voxel: set where it is missing.
#[derive(Clone, Debug)]
pub(super) struct MissingVoxels {
    words: Vec<u64>,
    pub(super) count: usize,
}

impl MissingVoxels {
    /// From a test of each voxel, in their order; none where there is no missing voxel.
    pub(super) fn find<T: Copy + Sync>(voxels: &[T], missing: impl Fn(T) -> bool + Sync) -> Option<Self> {
        if !voxels.par_iter().any(|v| missing(*v)) {
            return None;
        }
        let word = |chunk: &[T]| {
            chunk.iter().enumerate().fold(0u64, |word, (i, v)| word | u64::from(missing(*v)) << i)
        };
        let words: Vec<u64> = voxels.par_chunks(64).map(word).collect();
        let count = words.iter().map(|word| word.count_ones() as usize).sum();
        Some(Self { words, count })
    }

    fn is_missing(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Linear indices of the missing voxels.
    pub(super) fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        let of_word = |(i, &word): (usize, &u64)| {
            (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| 64 * i + bit)
        };
        self.words.iter().enumerate().flat_map(of_word)
    }

    /// Gives missing voxels the mean of their neighbours: of those that share a face, else of all 26. Deeper ones stay as
    /// they are; nothing reads them.
    pub(super) fn fill(&self, dimensions: UVec3, floats: &mut [f32]) {
        let mean = |index| self.mean_around(index, dimensions, floats).map(|mean| (index, mean));
        let filled: Vec<(usize, f32)> = self.indices().filter_map(mean).collect();
        for (index, number) in filled {
            floats[index] = number;
        }
    }

    fn mean_around(&self, index: usize, dimensions: UVec3, floats: &[f32]) -> Option<f32> {
        let size = dimensions.to_array().map(i64::from);
        let at = place(index, dimensions).to_array().map(i64::from);
        let mut sums = [(0.0f64, 0u32); 2];
        for neighbour in 0..27i64 {
            let step = [neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1];
            let [x, y, z] = std::array::from_fn(|axis| at[axis] + step[axis]);
            let inside = [x, y, z].iter().zip(size).all(|(v, n)| (0..n).contains(v));
            let index = ((z * size[1] + y) * size[0] + x) as usize;
            if !inside || self.is_missing(index) {
                continue;
            }
            let (sum, count) = &mut sums[usize::from(step.iter().map(|s| s.abs()).sum::<i64>() > 1)];
            *sum += f64::from(floats[index]);
            *count += 1;
        }
        let (sum, count) = if sums[0].1 > 0 { sums[0] } else { sums[1] };
        (count > 0).then(|| (sum / f64::from(count)) as f32)
    }

    /// The cells that touch a missing voxel.
    pub(super) fn cells(&self, dimensions: UVec3) -> Option<Arc<MissingCells>> {
        let mut cells = MissingCells::none(dimensions)?;
        self.indices().for_each(|index| cells.add_voxel(place(index, dimensions)));
        Some(Arc::new(cells))
    }
}

/// Where the voxel of a linear index is.
fn place(index: usize, dimensions: UVec3) -> UVec3 {
    let [nx, ny, _] = dimensions.to_array().map(|n| n as usize);
    UVec3::new((index % nx) as u32, (index / nx % ny) as u32, (index / (nx * ny)) as u32)
}
