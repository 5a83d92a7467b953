//! Ranges and bits read back and held against those found on the host. Without an adapter there is nothing to test.

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::transfer_function::{ClassificationTable, ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use proptest::prelude::*;

use super::occupancy::read_words;
use super::*;
use crate::context::{Fallbacks, GpuOptions};

/// A device with 16-bit textures and one without.
fn devices() -> Option<[Gpu; 2]> {
    let open = |without_norm16| {
        let fallbacks = Fallbacks { without_norm16, ..Fallbacks::default() };
        Gpu::new(&GpuOptions { fallbacks, ..GpuOptions::default() })
    };
    match (open(false), open(true)) {
        (Ok(a), Ok(b)) => Some([a, b]),
        (Err(e), _) | (_, Err(e)) => {
            println!("not tested: {e}");
            None
        }
    }
}

/// Noise in one of the forms that voxels are kept in.
fn noise(d: UVec3, form: u32, seed: u32) -> Volume {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    };
    let n = d.element_product();
    let geometry = Geometry::from_spacing(DVec3::ONE);
    // Few high values, so that blocks differ.
    let mut value = || random() % 256 * (random() % 256) / 256 * (random() % 256) / 256;
    match form {
        0 => {
            let voxels: Vec<u8> = (0..n).map(|_| value() as u8).collect();
            Volume::new(d, voxels, Rescale::IDENTITY, geometry)
        }
        1 => {
            let voxels: Vec<u16> = (0..n).map(|_| (value() * 257 + value() % 100) as u16).collect();
            Volume::new(d, voxels, Rescale::IDENTITY, geometry)
        }
        _ => {
            let voxels: Vec<f32> = (0..n).map(|_| (value() as f32 * 0.37).exp_m1() - 3.0).collect();
            Volume::new(d, voxels, Rescale::IDENTITY, geometry)
        }
    }
    .expect("a valid volume")
}

/// Least and greatest texel of the cells of every block, found voxel by voxel.
fn host_ranges(volume: &Volume, texels: &crate::Texels, edge: u32, blocks: UVec3) -> Vec<[f64; 2]> {
    let d = volume.dimensions();
    let block = |b: UVec3| {
        let (first, last) = (b * edge, (b * edge + edge).min(d - UVec3::ONE));
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let stored = volume.voxels().get(((z * d.y + y) * d.x + x) as usize);
                    let texel = texels.texel(f64::from(stored));
                    range = [range[0].min(texel), range[1].max(texel)];
                }
            }
        }
        range
    };
    let places = (0..blocks.element_product())
        .map(|i| UVec3::new(i % blocks.x, i / blocks.x % blocks.y, i / blocks.x / blocks.y));
    places.map(block).collect()
}

struct Made {
    voxels: GpuVolume,
    pipelines: BlockPipelines,
    ranges: GpuRanges,
    words: Vec<u32>,
}

fn made(gpu: &Gpu, volume: &Volume) -> Made {
    let voxels = GpuVolume::new(gpu, volume).expect("it fits");
    let pipelines = BlockPipelines::new(gpu).expect("valid shaders");
    let ranges = pipelines.ranges(gpu, &voxels, volume).expect("they fit");
    let words = read_words(gpu, ranges.words(), 0..ranges.bytes()).expect("they come back");
    Made { voxels, pipelines, ranges, words }
}

fn ends(word: u32) -> [f64; 2] {
    [f64::from(word & 0xffff), f64::from(word >> 16)]
}

#[test]
fn ranges_contain_every_voxel_of_their_block_and_little_else() {
    let Some(gpus) = devices() else { return };
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(12));
    let case = (prop::array::uniform3(2u32..41), 0u32..3, any::<u32>());
    let tested = runner.run(&case, |(d, form, seed)| {
        let volume = noise(UVec3::from_array(d), form, seed);
        for gpu in &gpus {
            let made = made(gpu, &volume);
            let levels = made.ranges.levels();
            for (edge, blocks, first) in [
                (levels.fine_edge, levels.fine, 0),
                (levels.coarse_edge, levels.coarse, levels.fine_count() as usize),
            ] {
                let expected = host_ranges(&volume, made.voxels.texels(), edge, blocks);
                // Whole numbers of 65535ths are met exactly, others within one and the rounding that is allowed for.
                let slack = if made.ranges.map().whole { 1e-6 } else { 1.1 };
                for (word, range) in made.words[first..].iter().zip(expected) {
                    let ([lo, hi], found) = (range.map(|t| made.ranges.map().place(t)), ends(*word));
                    prop_assert!(found[0] <= lo + 1e-6 && found[1] >= hi - 1e-6, "{found:?} {lo} {hi}");
                    prop_assert!(found[0] >= lo - slack && found[1] <= hi + slack, "{found:?} {lo} {hi}");
                }
            }
        }
        Ok(())
    });
    tested.unwrap_or_else(|e| panic!("{e}"));
}

/// Opaque within a tenth of the volume's range.
fn band(volume: &Volume, at: f64) -> TransferFunction {
    let [lo, hi] = volume.value_range();
    let point =
        |share: f64, opacity| ControlPoint { value: lo + share * (hi - lo), color: [1.0; 3], opacity };
    TransferFunction::new(vec![point(at, 0.0), point(at + 0.05, 0.7), point(at + 0.1, 0.0)]).expect("ordered")
}

#[test]
fn a_block_is_occupied_where_its_range_meets_what_is_visible() {
    let Some(gpus) = devices() else { return };
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(12));
    let case = (prop::array::uniform3(2u32..41), 0u32..3, any::<u32>(), 0.0..0.9, any::<bool>());
    let tested = runner.run(&case, |(d, form, seed, at, iso)| {
        let volume = noise(UVec3::from_array(d), form, seed);
        let table = ClassificationTable::new(&band(&volume, at), volume.rescale(), volume.stored_range());
        for gpu in &gpus {
            let made = made(gpu, &volume);
            let texels = made.voxels.texels();
            let [lo, hi] = volume.stored_range().map(f64::from);
            let entry = (texels.texel(hi) - texels.texel(lo)) / (table.entries().len() - 1) as f64;
            let level = texels.texel((lo + at * (hi - lo)).round());
            let criterion = if iso {
                Criterion::Levels(vec![level])
            } else {
                let mut visible_before = vec![0];
                for e in table.entries() {
                    visible_before.push(visible_before[visible_before.len() - 1] + u32::from(e[3] > 0.0));
                }
                let scale = if entry > 0.0 { 1.0 / entry } else { 0.0 };
                Criterion::Entries { visible_before, offset: texels.texel(lo), scale }
            };
            let stored = |texel: f64| (texel * texels.stored_per_texel + texels.stored_at_zero) as f32;
            // With `slack` 65535ths and entries more on either side.
            let met = |[lo, hi]: [f64; 2], slack: f64| {
                let more = slack / made.ranges.map().scale + if iso { 0.0 } else { slack * entry };
                let (lo, hi) = (lo - more, hi + more);
                if iso { (lo..=hi).contains(&level) } else { table.visible(stored(lo), stored(hi)) }
            };
            let occupancy =
                Occupancy::new(gpu, made.pipelines.occupancy(), &made.ranges, &criterion).expect("made");
            let bits = read_words(gpu, occupancy.bits(), 0..occupancy.bits().size()).expect("read");
            check_bits(&volume, &made, &occupancy, &bits, met)?;
        }
        Ok(())
    });
    tested.unwrap_or_else(|e| panic!("{e}"));
}

fn check_bits(
    volume: &Volume,
    made: &Made,
    occupancy: &Occupancy,
    bits: &[u32],
    met: impl Fn([f64; 2], f64) -> bool,
) -> Result<(), TestCaseError> {
    let levels = occupancy.levels();
    let coarse = levels.fine_words() as usize;
    let bit = |first: usize, i: usize| bits[first + i / 32] >> (i % 32) & 1 == 1;
    let expected = host_ranges(volume, made.voxels.texels(), levels.fine_edge, levels.fine);
    let coarse_count = levels.coarse_count() as usize;
    let (mut some, mut every) = (vec![false; coarse_count], vec![true; coarse_count]);
    let mut count = 0;
    for (i, range) in expected.iter().enumerate() {
        let occupied = bit(0, i);
        prop_assert!(occupied || !met(*range, 0.0), "block {i} of {range:?} is not seen");
        prop_assert!(!occupied || met(*range, 2.0), "block {i} of {range:?} is seen");
        count += u32::from(occupied);
        let (i, n) = (i as u32, levels.fine);
        let c = UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y) / levels.fine_per_coarse();
        let c = ((c.z * levels.coarse.y + c.y) * levels.coarse.x + c.x) as usize;
        some[c] |= occupied;
        every[c] &= occupied;
    }
    for c in 0..coarse_count {
        prop_assert_eq!((bit(coarse, 2 * c), bit(coarse, 2 * c + 1)), (some[c], every[c]));
    }
    let share = occupancy.occupied_fraction().expect("counted");
    prop_assert_eq!(share, f64::from(count) / expected.len() as f64);
    Ok(())
}

#[test]
fn everything_is_occupied_where_nothing_is_asked() {
    let Some([gpu, _]) = devices() else { return };
    let made = made(&gpu, &noise(UVec3::new(35, 21, 70), 0, 3));
    let occupancy =
        Occupancy::new(&gpu, made.pipelines.occupancy(), &made.ranges, &Criterion::All).expect("made");
    assert_eq!(occupancy.occupied_fraction(), Ok(1.0));
    let none = Criterion::Levels(Vec::new());
    let occupancy = Occupancy::new(&gpu, made.pipelines.occupancy(), &made.ranges, &none).expect("made");
    assert_eq!(occupancy.occupied_fraction(), Ok(0.0));
}
