//! How many layers of which meshes are peeled: planned from what the frame before needed, and planned again where that turns
//! out to be too few.

use bytemuck::{Pod, Zeroable};
use cutaway_core::clip::{BufferDepth, Crossing, SegmentCount, SegmentLimit};

use crate::error::GpuError;

/// Layers of all meshes together: as many as every adapter has in one texture.
pub(crate) const MOST_LAYERS: u32 = 256;

/// Layers of a kind that are peeled of a mesh which nothing is known of yet.
const FIRST_GUESS: u32 = 4;

/// As `PeeledMesh` in `sweep_peel.wgsl`, field by field; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct PeeledMesh {
    pub(crate) leaf: u32,
    pub(crate) entering: u32,
    pub(crate) entering_count: u32,
    pub(crate) leaving: u32,
    pub(crate) leaving_count: u32,
    pub(crate) backmost: u32,
    pub(crate) half: u32,
    pub(crate) reserved: u32,
}

/// What decides how many layers there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlanSettings {
    /// Segments of a ray that are used.
    pub(super) limit: SegmentLimit,
    /// Whether the clip is one mesh and nothing else: then so many segments need so many layers, else all of them.
    pub(super) alone: bool,
    /// Whether what is outside of it is kept.
    pub(super) keeps_outside: bool,
    /// Pixels that may go without what lies behind the last layer.
    pub(super) tolerance: u32,
}

/// Layers that a ray crosses in one sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LayerRun {
    /// Which mesh.
    pub(super) mesh: usize,
    pub(super) crossing: Crossing,
    /// Where they are among the layers of all.
    pub(super) first: u32,
    pub(super) count: u32,
    /// Whether the last of them is the backmost surface.
    pub(super) backmost: bool,
}

/// Layers of a mesh: those that rays enter through, and those that they leave through.
pub(super) type LayerCounts = [u32; 2];

const CROSSINGS: [Crossing; 2] = [Crossing::Entering, Crossing::Leaving];

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    settings: PlanSettings,
    counts: Vec<LayerCounts>,
}

impl Plan {
    /// For so many meshes, of which the frame before needed `before`, if it had as many.
    pub(super) fn new(settings: PlanSettings, meshes: usize, before: &[LayerCounts]) -> Self {
        let share = MOST_LAYERS / (2 * meshes.clamp(1, MOST_LAYERS as usize) as u32);
        let mut plan = Self { settings, counts: vec![[FIRST_GUESS.min(share); 2]; meshes] };
        if before.len() == meshes {
            plan.counts.copy_from_slice(before);
        }
        let most = plan.most();
        for count in plan.counts.as_flattened_mut() {
            *count = (*count).clamp(1, most);
        }
        plan
    }

    /// Layers of a kind that are ever of use.
    fn most(&self) -> u32 {
        match self.settings.limit.count {
            SegmentCount::AtMost(n) if self.settings.alone => n.get().min(MOST_LAYERS),
            _ => MOST_LAYERS,
        }
    }

    /// Which layers end with the backmost surface: those that segments end at.
    fn backmost(&self) -> Option<Crossing> {
        let limited = matches!(self.settings.limit.count, SegmentCount::AtMost(_));
        let closing = if self.settings.keeps_outside { Crossing::Entering } else { Crossing::Leaving };
        (limited && self.settings.alone && self.settings.limit.backmost).then_some(closing)
    }

    /// All layers, mesh by mesh.
    pub(super) fn runs(&self) -> Vec<LayerRun> {
        let mut first = 0;
        let mut runs = Vec::new();
        for (mesh, counts) in self.counts.iter().enumerate() {
            for (crossing, &count) in CROSSINGS.into_iter().zip(counts) {
                let backmost = self.backmost() == Some(crossing);
                runs.push(LayerRun { mesh, crossing, first, count, backmost });
                first += count;
            }
        }
        runs
    }

    /// Whether it has all layers that could be of use, whatever they cover.
    pub(super) fn is_complete(&self) -> bool {
        self.counts.iter().flatten().all(|count| *count == self.most())
    }

    /// How many layers there are altogether; an error where they are more than a texture can have.
    pub(super) fn layers(&self) -> Result<u32, GpuError> {
        let needed: u64 = self.counts.iter().flatten().map(|c| u64::from(*c)).sum();
        if needed > u64::from(MOST_LAYERS) {
            return Err(GpuError::TooManyLayers { needed, most: MOST_LAYERS });
        }
        Ok(needed as u32)
    }

    /// Makes more of the layers that end before the mesh does, by the pixels that each layer covers; false where none do.
    pub(super) fn grow(&mut self, pixels: &[u32]) -> bool {
        let (most, tolerance) = (self.most(), self.tolerance());
        let runs = self.runs();
        let ends_early = |run: &LayerRun| {
            // The backmost surface is behind the last of the others.
            let behind = if run.backmost { 2 } else { 1 };
            let covered = match run.count.checked_sub(behind) {
                Some(last) => pixels.get((run.first + last) as usize).copied().unwrap_or(0),
                None => u32::MAX,
            };
            covered > tolerance && run.count < most
        };
        let wanting = runs.iter().filter(|run| ends_early(run)).map(|run| run.count).sum::<u32>();
        let all = runs.iter().map(|run| run.count).sum::<u32>();
        // Twice as many as long as there is room for them, then one by one.
        let doubles = all + wanting <= MOST_LAYERS;
        for (run, count) in runs.iter().zip(self.counts.as_flattened_mut()) {
            if ends_early(run) {
                *count = if doubles { (2 * run.count).min(most) } else { run.count + 1 };
            }
        }
        wanting > 0
    }

    /// A limit on segments is exact; without one, a few pixels may go without their last layers.
    fn tolerance(&self) -> u32 {
        if self.most() < MOST_LAYERS { 0 } else { self.settings.tolerance }
    }

    /// What the next frame had best begin with: a layer more than was needed, which shows that no other is.
    pub(super) fn needed(&self, pixels: &[u32]) -> Vec<LayerCounts> {
        let tolerance = self.tolerance();
        let mut counts = self.counts.clone();
        for (run, count) in self.runs().into_iter().zip(counts.as_flattened_mut()) {
            let of_run = pixels.get(run.first as usize..(run.first + run.count) as usize).unwrap_or(&[]);
            if !run.backmost {
                let used = of_run.iter().take_while(|covered| **covered > tolerance).count() as u32;
                *count = (used + 1).min(run.count);
            }
        }
        counts
    }

    /// As the sweep wants it; `leaves` are those of the meshes.
    pub(super) fn meshes(&self, leaves: &[u32], depth: BufferDepth) -> Vec<PeeledMesh> {
        let runs = self.runs();
        let backmost = match self.backmost() {
            None => 0,
            Some(Crossing::Entering) => 1,
            Some(Crossing::Leaving) => 2,
        };
        runs.chunks(2)
            .zip(leaves)
            .map(|(runs, &leaf)| PeeledMesh {
                leaf,
                entering: runs[0].first,
                entering_count: runs[0].count,
                leaving: runs[1].first,
                leaving_count: runs[1].count,
                backmost,
                half: u32::from(depth == BufferDepth::Half),
                reserved: 0,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroU32;

    fn settings(count: Option<u32>, backmost: bool, alone: bool) -> PlanSettings {
        let count = count.and_then(NonZeroU32::new).map_or(SegmentCount::Auto, SegmentCount::AtMost);
        let limit = SegmentLimit { count, backmost };
        PlanSettings { limit, alone, keeps_outside: false, tolerance: 5 }
    }

    #[test]
    fn layers_grow_until_they_cover_next_to_nothing() {
        let mut plan = Plan::new(settings(None, false, false), 2, &[]);
        assert_eq!(plan.layers(), Ok(16));
        // The last layers of the first mesh cover 9 pixels and 5: the first kind grows.
        let mut pixels = [100, 90, 50, 9, 100, 90, 50, 5, 100, 0, 0, 0, 100, 0, 0, 0];
        assert!(plan.grow(&pixels));
        assert_eq!(plan.counts, [[8, 4], [4, 4]]);
        pixels[3] = 0;
        assert!(!Plan::new(settings(None, false, false), 2, &[]).grow(&pixels));
    }

    #[test]
    fn a_frame_begins_with_what_the_last_one_needed() {
        let plan = Plan::new(settings(None, false, true), 1, &[]);
        let needed = plan.needed(&[100, 7, 5, 0, 100, 8, 6, 4]);
        assert_eq!(needed, [[3, 4]]);
        assert_eq!(Plan::new(settings(None, false, true), 1, &needed).counts, needed);
        // Of another number of meshes nothing is known.
        assert_eq!(Plan::new(settings(None, false, true), 2, &needed).counts, [[FIRST_GUESS; 2]; 2]);
    }

    #[test]
    fn limits_of_one_mesh_alone_are_limits_of_layers() {
        assert_eq!(Plan::new(settings(Some(1), false, true), 1, &[]).counts, [[1, 1]]);
        assert_eq!(Plan::new(settings(Some(1), false, false), 1, &[]).counts, [[FIRST_GUESS; 2]]);
        let mut plan = Plan::new(settings(Some(6), false, true), 1, &[]);
        // Every pixel counts: one that has a fourth layer may have a fifth.
        assert!(plan.grow(&[9, 9, 9, 1, 9, 9, 9, 0]));
        assert_eq!(plan.counts, [[6, 4]]);
        assert!(!plan.grow(&[9; 10][..9].iter().chain(&[0]).copied().collect::<Vec<_>>()));
    }

    #[test]
    fn the_backmost_layer_is_the_last_of_those_that_segments_end_at() {
        let plan = Plan::new(settings(Some(2), true, true), 1, &[]);
        let backmost: Vec<bool> = plan.runs().iter().map(|run| run.backmost).collect();
        assert_eq!(backmost, [false, true]);
        assert_eq!(plan.meshes(&[3], BufferDepth::Half)[0].backmost, 2);
        let outside = PlanSettings { keeps_outside: true, ..settings(Some(2), true, true) };
        assert_eq!(Plan::new(outside, 1, &[]).meshes(&[3], BufferDepth::Single)[0].backmost, 1);
        assert_eq!(
            Plan::new(settings(None, true, true), 1, &[]).meshes(&[3], BufferDepth::Single)[0].backmost,
            0
        );
    }

    #[test]
    fn more_layers_than_a_texture_has_are_an_error() {
        let mut plan = Plan::new(settings(None, false, false), 40, &[]);
        assert_eq!(plan.layers(), Ok(240));
        assert!(plan.grow(&[9; 240]));
        assert_eq!(plan.layers(), Err(GpuError::TooManyLayers { needed: 320, most: MOST_LAYERS }));
    }
}
