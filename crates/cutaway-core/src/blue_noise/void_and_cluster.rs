//! The generator of the tile, and what the tile must be like.

use super::{SIDE, TILE};

const N: usize = SIDE as usize;

/// Sigma of the Gaussian that measures voids and clusters, in pixels: Ulichney's 1.5.
const SIGMA: f64 = 1.5;

/// How crowded each pixel is. In whole numbers, so that the order does not hang on anybody's exponential function.
struct Crowd {
    around: Vec<u64>,
    crowded: Vec<u64>,
    taken: Vec<bool>,
}

impl Crowd {
    fn new() -> Self {
        let far = |d: usize| d.min(N - d) as f64;
        let weight = |i: usize| {
            let (x, y) = (far(i % N), far(i / N));
            ((-(x * x + y * y) / (2.0 * SIGMA * SIGMA)).exp() * f64::from(1u32 << 30)).round() as u64
        };
        let around = (0..N * N).map(weight).collect();
        Self { around, crowded: vec![0; N * N], taken: vec![false; N * N] }
    }

    fn put(&mut self, at: usize, there: bool) {
        self.taken[at] = there;
        let (x, y) = (at % N, at / N);
        for (i, crowded) in self.crowded.iter_mut().enumerate() {
            let weight = self.around[(i / N + N - y) % N * N + (i % N + N - x) % N];
            *crowded = if there { *crowded + weight } else { *crowded - weight };
        }
    }

    fn tightest_cluster(&self) -> usize {
        (0..N * N).filter(|i| self.taken[*i]).max_by_key(|i| self.crowded[*i]).expect("a point is there")
    }

    fn largest_void(&self) -> usize {
        (0..N * N).filter(|i| !self.taken[*i]).min_by_key(|i| self.crowded[*i]).expect("a pixel is free")
    }
}

/// The order in which pixels are taken.
fn ranks() -> Vec<usize> {
    let mut crowd = Crowd::new();
    let mut state = 1u32;
    let first = N * N / 10;
    let mut count = 0;
    while count < first {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let at = (state >> 8) as usize % (N * N);
        if !crowd.taken[at] {
            crowd.put(at, true);
            count += 1;
        }
    }
    // The first points are moved from the tightest cluster to the largest void until that is where they came from.
    loop {
        let cluster = crowd.tightest_cluster();
        crowd.put(cluster, false);
        let void = crowd.largest_void();
        crowd.put(void, true);
        if void == cluster {
            break;
        }
    }
    let mut ranks = vec![0; N * N];
    let prototype = crowd.taken.clone();
    for rank in (0..first).rev() {
        let cluster = crowd.tightest_cluster();
        crowd.put(cluster, false);
        ranks[cluster] = rank;
    }
    (0..N * N).filter(|i| prototype[*i]).for_each(|i| crowd.put(i, true));
    for rank in first..N * N {
        let void = crowd.largest_void();
        crowd.put(void, true);
        ranks[void] = rank;
    }
    ranks
}

fn tile() -> Vec<u8> {
    ranks().iter().map(|rank| (rank * 256 / (N * N)) as u8).collect()
}

#[test]
fn the_tile_is_what_the_generator_makes() {
    let made = tile();
    if std::env::var_os("CUTAWAY_WRITE_BLUE_NOISE").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/blue_noise/tile.bin"), &made).unwrap();
    }
    assert!(made == TILE.as_slice(), "run with CUTAWAY_WRITE_BLUE_NOISE=1 to write the tile anew");
}

#[test]
fn every_value_is_there_equally_often() {
    let mut counts = [0; 256];
    TILE.iter().for_each(|v| counts[usize::from(*v)] += 1);
    assert_eq!(counts, [N * N / 256; 256]);
}

/// The mean power of frequencies from `from` up to `to` cycles a tile, that of white noise being 1.
fn power(values: &[u8], from: f64, to: f64) -> f64 {
    let white = 256.0f64 * 256.0 / 12.0 * (N * N) as f64;
    let (mut sum, mut count) = (0.0, 0.0);
    for v in 0..N {
        for u in 0..N {
            let far = |k: usize| k.min(N - k) as f64;
            let frequency = far(u).hypot(far(v));
            if frequency < from || frequency >= to {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in values.iter().enumerate() {
                let phase = ((i % N) * u + (i / N) * v) % N;
                let (sin, cos) = (phase as f64 * std::f64::consts::TAU / N as f64).sin_cos();
                re += f64::from(*value) * cos;
                im += f64::from(*value) * sin;
            }
            sum += (re * re + im * im) / white;
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn low_frequencies_are_missing() {
    let low = power(TILE, 1.0, 10.0);
    let high = power(TILE, 20.0, 32.0);
    assert!(low < 0.05 && high > 1.0, "low {low}, high {high}");
    // The test can fail: noise without order has as much of the one as of the other.
    let mut state = 7u32;
    let mut white = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let white: Vec<u8> = (0..N * N).map(|_| white()).collect();
    assert!(power(&white, 1.0, 10.0) > 0.5);
}
