//! Instruction sets, chosen once at run time, and the one place with unsafe code: lanes filled from memory.
//!
//! Every kernel is compiled for AVX-512, AVX2 and the target's baseline. Kernels are written against
//! [`fearless_simd`]'s safe vectors; what no safe crate has is filling lanes from scattered addresses at full speed.
//! Scalar loads into a buffer, one each lane, beat hardware gathers by 1.8 to 2.8 times on current processors, but not
//! if each of them is bounds-checked: [`LaneSource`] bounds all lanes with one vector instruction instead.

#![allow(unsafe_code, reason = "unchecked loads behind a vector-wide bound; see LaneSource")]

use fearless_simd::{Level, Simd, SimdBase, SimdMask};

/// Which instructions the kernels use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SimdChoice {
    /// The widest that this processor has.
    #[default]
    Auto,
    /// Plain scalar code: the twin that the others are held against.
    Scalar,
    /// AVX2 and FMA: 8 rays at once.
    Avx2,
    /// AVX-512: 16 rays at once.
    Avx512,
}

/// An instruction set that this processor does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this processor has no {0}; leave the choice to `auto`")]
pub struct UnsupportedSimd(&'static str);

impl SimdChoice {
    /// The proof that kernels may use the instructions.
    pub(crate) fn level(self) -> Result<Level, UnsupportedSimd> {
        match self {
            Self::Auto => Ok(Level::new()),
            Self::Scalar => Ok(Level::fallback()),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => Level::new().as_avx2().map(Level::Avx2).ok_or(UnsupportedSimd("AVX2")),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => Level::new().as_avx512().map(Level::Avx512).ok_or(UnsupportedSimd("AVX-512")),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx2 => Err(UnsupportedSimd("AVX2")),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx512 => Err(UnsupportedSimd("AVX-512")),
        }
    }
}

/// What statistics call a level.
pub(crate) fn level_name(level: Level) -> &'static str {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        if level.as_avx512().is_some() {
            return "avx512";
        }
        if level.as_avx2().is_some() {
            return "avx2";
        }
    }
    #[cfg(target_arch = "aarch64")]
    if level.as_neon().is_some() {
        return "neon";
    }
    let _ = level;
    "scalar"
}

/// Work that is compiled once for each instruction set.
pub(crate) trait LaneWork {
    /// Does it; implementations are `#[inline(always)]`, so that they take on the caller's instructions.
    fn run<S: Simd>(self, simd: S);
}

/// Runs work with the instructions of a level. Between AVX2 and the oldest processors no level of its own is worth its
/// compile time: they take the scalar kernels.
pub(crate) fn dispatch(level: Level, work: impl LaneWork) {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        if let Some(simd) = level.as_avx512() {
            return simd.vectorize(
                #[inline(always)]
                || work.run(simd),
            );
        }
        if let Some(simd) = level.as_avx2() {
            return simd.vectorize(
                #[inline(always)]
                || work.run(simd),
            );
        }
    }
    #[cfg(target_arch = "aarch64")]
    if let Some(simd) = level.as_neon() {
        return simd.vectorize(
            #[inline(always)]
            || work.run(simd),
        );
    }
    if let Level::Fallback(simd) = Level::fallback() {
        work.run(simd);
    }
}

/// The most lanes that any instruction set has.
pub(crate) const MAX_LANES: usize = 16;

/// Memory that lanes are filled from. Indices beyond its end are moved to its end, all lanes at once, so that no load
/// can leave it, whatever a kernel computes.
#[derive(Clone, Copy)]
pub(crate) struct LaneSource<'a, T>(&'a [T]);

/// The fewest elements that a source must have: as many as the widest load takes.
const WIDEST: usize = 4;

impl<'a, T: Copy> LaneSource<'a, T> {
    /// A source of at least four and at most `u32::MAX` elements.
    pub(crate) fn new(elements: &'a [T]) -> Self {
        assert!(
            elements.len() >= WIDEST && u32::try_from(elements.len()).is_ok(),
            "a grid of 2 x 2 x 2 voxels or more"
        );
        Self(elements)
    }

    /// `i`, moved so that `i + width` is not beyond the end.
    #[inline(always)]
    fn bounded<S: Simd>(self, simd: S, i: S::u32s, width: usize) -> S::u32s {
        i.min(S::u32s::splat(simd, self.0.len().saturating_sub(width) as u32))
    }

    /// Element `i` of each lane.
    #[inline(always)]
    fn singles<S: Simd>(self, simd: S, i: S::u32s) -> [T; MAX_LANES]
    where
        T: Default,
    {
        let indices: [u32; MAX_LANES] = opaque(simd, &self.bounded(simd, i, 1));
        let mut out = [T::default(); MAX_LANES];
        for l in 0..S::u32s::LEN {
            debug_assert!((indices[l] as usize) < self.0.len());
            // SAFETY: `bounded` keeps i within the slice. Unchecked because a check a lane costs more than the load.
            // Twin: `elements_are_those_of_the_slice_and_none_is_beyond_it`.
            out[l] = unsafe { *self.0.get_unchecked(indices[l] as usize) };
        }
        out
    }
}

impl<T> LaneSource<'_, T> {
    /// Bytes of all elements.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.0)
    }

    /// Has elements `i + offset` of each lane on their way to the caches, for each offset; no matter whether there are any.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd, const N: usize>(self, simd: S, i: S::u32s, offsets: [u32; N]) {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let indices: [u32; MAX_LANES] = opaque(simd, &i);
            for offset in offsets {
                let base = self.0.as_ptr().wrapping_add(offset as usize);
                for index in &indices[..S::u32s::LEN] {
                    let element = base.wrapping_add(*index as usize).cast();
                    // SAFETY: a prefetch has no effect that a program could see, and to it no address is wrong. Opaque frames of
                    // 512³ voxels take a fifth less time with it.
                    unsafe { _mm_prefetch::<_MM_HINT_T0>(element) };
                }
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (simd, i, offsets);
    }
}

impl LaneSource<'_, f32> {
    /// Element `i` of each lane.
    #[inline(always)]
    pub(crate) fn floats<S: Simd>(self, simd: S, i: S::u32s) -> S::f32s {
        S::f32s::from_slice(simd, &self.singles(simd, i)[..S::f32s::LEN])
    }
}

impl LaneSource<'_, [f32; 4]> {
    /// The four components of element `i` of each lane.
    #[inline(always)]
    pub(crate) fn columns<S: Simd>(self, simd: S, i: S::u32s) -> [S::f32s; 4] {
        let found = self.singles(simd, i);
        let (n, found) = (S::f32s::LEN, found.as_flattened());
        let mut vectors = [S::f32s::splat(simd, 0.0); 4];
        for k in 0..4 {
            vectors[k] = S::f32s::from_slice(simd, &found[k * n..(k + 1) * n]);
        }
        let (red_blue, green_alpha) = vectors[0].deinterleave(vectors[1]);
        let (red_blue_2, green_alpha_2) = vectors[2].deinterleave(vectors[3]);
        let (red, blue) = red_blue.deinterleave(red_blue_2);
        let (green, alpha) = green_alpha.deinterleave(green_alpha_2);
        [red, green, blue, alpha]
    }
}

/// An element of which several fit in a 32-bit word.
pub(crate) trait PackedVoxel: Copy {
    /// How many.
    const PER_WORD: usize;
    /// Its bits, lowest.
    fn bits(self) -> u32;
}

impl PackedVoxel for u8 {
    const PER_WORD: usize = 4;

    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl PackedVoxel for u16 {
    const PER_WORD: usize = 2;

    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl PackedVoxel for f32 {
    const PER_WORD: usize = 1;

    fn bits(self) -> u32 {
        self.to_bits()
    }
}

impl PackedVoxel for u32 {
    const PER_WORD: usize = 1;

    fn bits(self) -> u32 {
        self
    }
}

impl<T: PackedVoxel> LaneSource<'_, T> {
    /// The words that begin at element `i + offset` of each lane, for each of several offsets; the first element is lowest.
    ///
    /// Indices are bounded, and taken out of the vector, once for all offsets. Of a word at the greatest offset that would
    /// reach beyond the end, at least a pair of elements is right wherever there is one, and so it is at the others.
    #[inline(always)]
    pub(crate) fn words<S: Simd, const N: usize>(
        self,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [S::u32s; N] {
        let mut reach = 0;
        for offset in offsets {
            reach = offset.max(reach);
        }
        let reach = reach as usize + T::PER_WORD;
        if reach > self.0.len() {
            return self.words_of_few(simd, i, offsets);
        }
        let bounded = self.bounded(simd, i, reach);
        let mut found = [[0u32; MAX_LANES]; N];
        let indices: [u32; MAX_LANES] = opaque(simd, &bounded);
        for k in 0..N {
            for l in 0..S::u32s::LEN {
                // SAFETY: bounded + the greatest offset + a word's elements is within the slice.
                found[k][l] = unsafe { self.word(indices[l], offsets[k]) };
            }
        }
        let mut words = [bounded; N];
        for k in 0..N {
            words[k] = S::u32s::from_slice(simd, &found[k][..S::u32s::LEN]);
        }
        // A pair of 8-bit voxels at the very end is read with the two before it.
        if T::PER_WORD == 4 && i.simd_gt(bounded).any_true() {
            let shift = (i - bounded).min(3) << 3;
            for word in &mut words {
                *word >>= shift;
            }
        }
        words
    }

    /// The `W` words (2 or 4) that follow each other from element `i + offset` of each lane on, for each of several offsets:
    /// one load, however many words. Right wherever all of them are within the source.
    #[inline(always)]
    pub(crate) fn long_words<S: Simd, const N: usize, const W: usize>(
        self,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::u32s; W]; N] {
        const { assert!(W == 2 || W == 4, "words are told apart two at a time") }
        let mut reach = 0;
        for offset in offsets {
            reach = offset.max(reach);
        }
        let reach = reach as usize + W * T::PER_WORD;
        let bounded = self.bounded(simd, i, reach);
        let mut out = [[bounded; W]; N];
        if reach > self.0.len() {
            return self.long_words_of_few(simd, i, offsets);
        }
        let indices: [u32; MAX_LANES] = opaque(simd, &bounded);
        for k in 0..N {
            let mut found = [[0u32; W]; MAX_LANES];
            for l in 0..S::u32s::LEN {
                // SAFETY: bounded + the greatest offset + the elements of W words is within the slice.
                found[l] = unsafe { self.long_word(indices[l], offsets[k]) };
            }
            let (n, found) = (S::u32s::LEN, found.as_flattened());
            let mut vectors = [bounded; W];
            for w in 0..W {
                vectors[w] = S::u32s::from_slice(simd, &found[w * n..(w + 1) * n]);
            }
            let (even, odd) = vectors[0].deinterleave(vectors[1]);
            if W == 2 {
                (out[k][0], out[k][1]) = (even, odd);
            } else {
                let (even_2, odd_2) = vectors[2].deinterleave(vectors[3]);
                (out[k][0], out[k][2]) = even.deinterleave(even_2);
                (out[k][1], out[k][3]) = odd.deinterleave(odd_2);
            }
        }
        out
    }

    /// The same of a source that is shorter than the offsets reach, element by element: the smallest volumes.
    #[cold]
    fn words_of_few<S: Simd, const N: usize>(self, simd: S, i: S::u32s, offsets: [u32; N]) -> [S::u32s; N] {
        let mut out = [S::u32s::splat(simd, 0); N];
        for (out, offset) in out.iter_mut().zip(offsets) {
            for l in 0..S::u32s::LEN {
                let first = i[l] as usize + offset as usize;
                let found = self.0.get(first..).unwrap_or_default().iter().take(T::PER_WORD);
                let word =
                    found.enumerate().fold(0, |word, (k, v)| word | v.bits() << (k * 32 / T::PER_WORD));
                out.as_mut_slice()[l] = word;
            }
        }
        out
    }

    /// The same of several words.
    #[cold]
    fn long_words_of_few<S: Simd, const N: usize, const W: usize>(
        self,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::u32s; W]; N] {
        let mut out = [[i; W]; N];
        for w in 0..W {
            let words = self.words_of_few(simd, i + (w * T::PER_WORD) as u32, offsets);
            for (out, word) in out.iter_mut().zip(words) {
                out[w] = word;
            }
        }
        out
    }

    /// The word that begins at element `i + offset`.
    ///
    /// # Safety
    /// `i + offset + T::PER_WORD` must not be beyond the end.
    #[inline(always)]
    unsafe fn word(self, i: u32, offset: u32) -> u32 {
        debug_assert!(i as usize + offset as usize + T::PER_WORD <= self.0.len());
        // SAFETY: the caller keeps these four bytes within the slice, and `offset` alone is; they need no alignment and any
        // bits make a u32. Unchecked because a check a lane costs more than the load. Twin: as above. The base of an offset
        // is the same for all lanes, so that kernels add nothing a lane.
        u32::from_le(unsafe {
            self.0.as_ptr().add(offset as usize).add(i as usize).cast::<u32>().read_unaligned()
        })
    }

    /// The `W` words that begin at element `i + offset`.
    ///
    /// # Safety
    /// `i + offset + W * T::PER_WORD` must not be beyond the end.
    #[inline(always)]
    unsafe fn long_word<const W: usize>(self, i: u32, offset: u32) -> [u32; W] {
        debug_assert!(i as usize + offset as usize + W * T::PER_WORD <= self.0.len());
        // SAFETY: as for `word`. One load of a row instead of two: a quarter of a shaded sample's, a tenth of a frame's time.
        let mut words: [u32; W] = unsafe {
            self.0.as_ptr().add(offset as usize).add(i as usize).cast::<[u32; W]>().read_unaligned()
        };
        for word in &mut words {
            *word = u32::from_le(*word);
        }
        words
    }
}

/// The lanes of a vector, as numbers that the compiler does not know to come from one: else it turns the
/// loads that they index into hardware gathers, which take 1.8 to 2.8 times as long. 0 in lanes that the vector does not
/// have.
#[inline(always)]
fn opaque<S: Simd>(_simd: S, v: &S::u32s) -> [u32; MAX_LANES] {
    let from = v.as_slice();
    let mut lanes = [0; MAX_LANES];
    for l in 0..S::u32s::LEN {
        // SAFETY: a reference into the vector, read as what it is.
        lanes[l] = unsafe { std::ptr::read_volatile(&from[l]) };
    }
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Check<'a> {
        data: &'a [u16],
        bytes: &'a [u8],
        indices: [u32; MAX_LANES],
    }

    impl LaneWork for Check<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let i = S::u32s::from_slice(simd, &self.indices[..S::u32s::LEN]);
            let one = LaneSource::new(self.data).singles(simd, i);
            let words = LaneSource::new(self.data).words(simd, i, [0, 4, 1]);
            let of_bytes = LaneSource::new(self.bytes).words(simd, i, [0, 4]);
            let twos = LaneSource::new(self.data).long_words::<S, 2, 2>(simd, i, [5, 0]);
            let fours = LaneSource::new(self.data).long_words::<S, 1, 4>(simd, i, [1]);
            for l in 0..S::u32s::LEN {
                let index = self.indices[l] as usize;
                assert_eq!(one[l], self.data[index.min(self.data.len() - 1)]);
                let at = index.min(self.data.len() - 6);
                for (word, offset) in words.iter().zip([0, 4, 1]) {
                    let (a, b) = (self.data[at + offset], self.data[at + offset + 1]);
                    assert_eq!(word[l], u32::from(a) | u32::from(b) << 16);
                }
                let in_words = |word: &dyn Fn(usize) -> u32, from: usize, count: usize| {
                    for w in 0..count {
                        let (a, b) = (self.data[from + 2 * w], self.data[from + 2 * w + 1]);
                        assert_eq!(word(w), u32::from(a) | u32::from(b) << 16, "word {w} from {from}");
                    }
                };
                let at = index.min(self.data.len() - 9);
                in_words(&|w| twos[0][w][l], at + 5, 2);
                in_words(&|w| twos[1][w][l], at, 2);
                in_words(&|w| fours[0][w][l], index.min(self.data.len() - 9) + 1, 4);
                // Wherever there is a pair at the greatest offset, pairs are right.
                if index + 4 + 2 <= self.bytes.len() {
                    for (word, offset) in of_bytes.iter().zip([0, 4]) {
                        let (a, b) = (self.bytes[index + offset], self.bytes[index + offset + 1]);
                        assert_eq!(word[l] & 0xffff, u32::from(a) | u32::from(b) << 8, "at {index}");
                    }
                }
            }
        }
    }

    #[test]
    fn elements_are_those_of_the_slice_and_none_is_beyond_it() {
        let data: Vec<u16> = (0..29).map(|i| i * 7).collect();
        let bytes: Vec<u8> = (1..30).map(|i| i * 7).collect();
        let indices = [0, 1, 5, 24, 25, 26, 27, 28, 29, 30, 1000, u32::MAX, u32::MAX - 1, 1 << 31, 3, 12];
        for choice in [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Avx512, SimdChoice::Auto] {
            if let Ok(level) = choice.level() {
                for rotate in 0..MAX_LANES {
                    let mut indices = indices;
                    indices.rotate_left(rotate);
                    dispatch(level, Check { data: &data, bytes: &bytes, indices });
                }
            }
        }
    }

    struct Few;

    impl LaneWork for Few {
        fn run<S: Simd>(self, simd: S) {
            let data = [1u8, 2, 3, 4, 5, 6, 7, 8];
            let words = LaneSource::new(&data).words(simd, S::u32s::splat(simd, 1), [0, 6]);
            assert_eq!((words[0][0], words[1][0] & 0xff), (0x0504_0302, 8));
            let long = LaneSource::new(&data).long_words::<S, 2, 2>(simd, S::u32s::splat(simd, 0), [0, 4]);
            assert_eq!((long[0][0][0], long[0][1][0]), (0x0403_0201, 0x0807_0605));
            assert_eq!((long[1][0][0], long[1][1][0]), (0x0807_0605, 0));
            let beyond = LaneSource::new(&data).words(simd, S::u32s::splat(simd, u32::MAX), [0, 6]);
            assert_eq!(beyond[1][0], 0);
        }
    }

    #[test]
    fn sources_shorter_than_offsets_reach_are_read_element_by_element() {
        for choice in [SimdChoice::Scalar, SimdChoice::Auto] {
            dispatch(choice.level().unwrap(), Few);
        }
    }

    #[test]
    #[should_panic(expected = "2 x 2 x 2")]
    fn a_source_shorter_than_a_load_is_refused() {
        let _ = LaneSource::new(&[1u8, 2, 3]);
    }
}
