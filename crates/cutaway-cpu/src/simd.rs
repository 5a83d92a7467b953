//! Instruction sets, chosen once at run time, and the one place with unsafe code: lanes filled from memory.
//!
//! Every kernel is compiled for AVX-512, AVX2 and the target's baseline. Kernels are written against
//! [`fearless_simd`]'s safe vectors; what no safe crate has is filling lanes from scattered addresses at full speed.
//! Scalar loads into a buffer, one each lane, beat hardware gathers by 1.8 to 2.8 times on current processors, but not
//! if each of them is bounds-checked: [`LaneSource`] bounds all lanes with one vector instruction instead.

#![allow(unsafe_code, reason = "unchecked loads behind a vector-wide bound; see LaneSource")]

use fearless_simd::{Level, Simd, SimdBase};

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
        i.min(S::u32s::splat(simd, (self.0.len() - width) as u32))
    }

    /// `N` neighbouring elements from `i` on.
    ///
    /// # Safety
    /// `i + N` must not be beyond the end.
    #[inline(always)]
    unsafe fn at<const N: usize>(self, i: u32) -> [T; N] {
        debug_assert!(i as usize + N <= self.0.len());
        // SAFETY: the caller keeps i + N within the slice; [T; N] has the alignment of T. Unchecked because a check a
        // lane costs more than the load. Twin: `elements_are_those_of_the_slice` below.
        unsafe { self.0.as_ptr().add(i as usize).cast::<[T; N]>().read() }
    }

    /// `N` neighbouring elements from `i + offset` on.
    ///
    /// # Safety
    /// `i + offset + N` must not be beyond the end.
    #[inline(always)]
    unsafe fn at_offset<const N: usize>(self, i: u32, offset: u32) -> [T; N] {
        debug_assert!(i as usize + offset as usize + N <= self.0.len());
        // SAFETY: the caller keeps i + offset + N within the slice. Two steps, so that a kernel keeps one base an
        // offset and one index a lane instead of computing every address.
        unsafe { self.0.as_ptr().add(offset as usize).add(i as usize).cast::<[T; N]>().read() }
    }

    /// Element `i` of each lane.
    #[inline(always)]
    pub(crate) fn singles<S: Simd>(self, simd: S, i: S::u32s) -> [T; MAX_LANES]
    where
        T: Default,
    {
        let i = self.bounded(simd, i, 1);
        let mut out = [T::default(); MAX_LANES];
        for (out, &i) in out.iter_mut().zip(i.as_slice()) {
            // SAFETY: `bounded` keeps i + 1 within the slice.
            [*out] = unsafe { self.at(i) };
        }
        out
    }

    /// Element `i` of each lane, as a vector.
    #[inline(always)]
    pub(crate) fn floats<S: Simd>(self, simd: S, i: S::u32s) -> S::f32s
    where
        T: Into<f32> + Default,
    {
        let found = self.singles(simd, i);
        let mut out = [0.0f32; MAX_LANES];
        for l in 0..S::u32s::LEN {
            out[l] = found[l].into();
        }
        S::f32s::from_slice(simd, &out[..S::u32s::LEN])
    }

    /// Elements `i` and `i + 1` of each lane, packed into [`PackedVoxel::PAIR`] vectors of words; the rest are zero.
    #[inline(always)]
    pub(crate) fn pairs<S: Simd>(self, simd: S, i: S::u32s) -> [S::u32s; 2]
    where
        T: PackedVoxel,
    {
        let i = self.bounded(simd, i, 2);
        let mut words = [[0; MAX_LANES]; 2];
        for (l, &i) in i.as_slice().iter().enumerate() {
            // SAFETY: `bounded` keeps i + 2 within the slice.
            let packed = T::pack_pair(unsafe { self.at(i) });
            for w in 0..T::PAIR {
                words[w][l] = packed[w];
            }
        }
        words.map(|w| S::u32s::from_slice(simd, &w[..S::u32s::LEN]))
    }

    /// Elements `i` and `i + 1` of each lane at each of four `offsets`, ascending, packed into [`PackedVoxel::PAIR`]
    /// vectors of words; the rest are zero. Indices are bounded and taken out of the vector once for all four.
    #[inline(always)]
    pub(crate) fn pairs_at<S: Simd>(self, simd: S, i: S::u32s, offsets: [u32; 4]) -> [[S::u32s; 2]; 4]
    where
        T: PackedVoxel,
    {
        let i = self.bounded(simd, i, offsets[3] as usize + 2);
        // SAFETY: `bounded` keeps i + the greatest offset + 2 within the slice. Written out, for closures and iterators
        // over vectors are not sure to be inlined and then lose the caller's instructions.
        unsafe {
            [
                self.pairs_offset(simd, i, offsets[0]),
                self.pairs_offset(simd, i, offsets[1]),
                self.pairs_offset(simd, i, offsets[2]),
                self.pairs_offset(simd, i, offsets[3]),
            ]
        }
    }

    /// Elements `i + offset` and `i + offset + 1` of each lane, packed.
    ///
    /// # Safety
    /// `i + offset + 2` must not be beyond the end in any lane.
    #[inline(always)]
    unsafe fn pairs_offset<S: Simd>(self, simd: S, i: S::u32s, offset: u32) -> [S::u32s; 2]
    where
        T: PackedVoxel,
    {
        let mut words = [[0; MAX_LANES]; 2];
        for (l, &i) in i.as_slice().iter().enumerate() {
            // SAFETY: the caller keeps i + offset + 2 within the slice.
            let packed = T::pack_pair(unsafe { self.at_offset(i, offset) });
            for w in 0..T::PAIR {
                words[w][l] = packed[w];
            }
        }
        [
            S::u32s::from_slice(simd, &words[0][..S::u32s::LEN]),
            S::u32s::from_slice(simd, &words[1][..S::u32s::LEN]),
        ]
    }

    /// Elements `i` to `i + 3` of each lane, packed into [`PackedVoxel::FOUR`] vectors of words; the rest are zero.
    #[inline(always)]
    pub(crate) fn fours<S: Simd>(self, simd: S, i: S::u32s) -> [S::u32s; 4]
    where
        T: PackedVoxel,
    {
        let i = self.bounded(simd, i, 4);
        let mut words = [[0; MAX_LANES]; 4];
        for (l, &i) in i.as_slice().iter().enumerate() {
            // SAFETY: `bounded` keeps i + 4 within the slice.
            let packed = T::pack_four(unsafe { self.at(i) });
            for w in 0..T::FOUR {
                words[w][l] = packed[w];
            }
        }
        words.map(|w| S::u32s::from_slice(simd, &w[..S::u32s::LEN]))
    }
}

impl LaneSource<'_, [f32; 4]> {
    /// The four components of element `i` of each lane.
    #[inline(always)]
    pub(crate) fn columns<S: Simd>(self, simd: S, i: S::u32s) -> [S::f32s; 4] {
        let found = self.singles(simd, i);
        let (n, found) = (S::f32s::LEN, found.as_flattened());
        let vector = |k: usize| S::f32s::from_slice(simd, &found[k * n..(k + 1) * n]);
        let (red_blue, green_alpha) = vector(0).deinterleave(vector(1));
        let (red_blue_2, green_alpha_2) = vector(2).deinterleave(vector(3));
        let (red, blue) = red_blue.deinterleave(red_blue_2);
        let (green, alpha) = green_alpha.deinterleave(green_alpha_2);
        [red, green, blue, alpha]
    }
}

/// An element of which several fit in a 32-bit word: a neighbourhood is then one load and one store a lane.
pub(crate) trait PackedVoxel: Copy {
    /// Words that two and four elements take.
    const PAIR: usize;
    const FOUR: usize;
    /// Two elements, the first lowest.
    fn pack_pair(v: [Self; 2]) -> [u32; 2];
    /// Four elements, the first lowest.
    fn pack_four(v: [Self; 4]) -> [u32; 4];
}

impl PackedVoxel for u8 {
    const PAIR: usize = 1;
    const FOUR: usize = 1;

    #[inline(always)]
    fn pack_pair(v: [Self; 2]) -> [u32; 2] {
        [u32::from(u16::from_le_bytes(v)), 0]
    }

    #[inline(always)]
    fn pack_four(v: [Self; 4]) -> [u32; 4] {
        [u32::from_le_bytes(v), 0, 0, 0]
    }
}

impl PackedVoxel for u16 {
    const PAIR: usize = 1;
    const FOUR: usize = 2;

    #[inline(always)]
    fn pack_pair([a, b]: [Self; 2]) -> [u32; 2] {
        [u32::from(a) | u32::from(b) << 16, 0]
    }

    #[inline(always)]
    fn pack_four([a, b, c, d]: [Self; 4]) -> [u32; 4] {
        [u32::from(a) | u32::from(b) << 16, u32::from(c) | u32::from(d) << 16, 0, 0]
    }
}

impl PackedVoxel for f32 {
    const PAIR: usize = 2;
    const FOUR: usize = 4;

    #[inline(always)]
    fn pack_pair(v: [Self; 2]) -> [u32; 2] {
        v.map(f32::to_bits)
    }

    #[inline(always)]
    fn pack_four(v: [Self; 4]) -> [u32; 4] {
        v.map(f32::to_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Check<'a> {
        data: &'a [u16],
        indices: [u32; MAX_LANES],
    }

    impl LaneWork for Check<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let source = LaneSource::new(self.data);
            let i = S::u32s::from_slice(simd, &self.indices[..S::u32s::LEN]);
            let (one, [two, _], [low, high, _, _]) =
                (source.singles(simd, i), source.pairs(simd, i), source.fours(simd, i));
            for l in 0..S::u32s::LEN {
                let at = |width: usize| (self.indices[l] as usize).min(self.data.len() - width);
                let word = |i: usize| u32::from(self.data[i]) | u32::from(self.data[i + 1]) << 16;
                assert_eq!(one[l], self.data[at(1)]);
                assert_eq!(two[l], word(at(2)));
                assert_eq!((low[l], high[l]), (word(at(4)), word(at(4) + 2)));
            }
        }
    }

    #[test]
    fn elements_are_those_of_the_slice_and_none_is_beyond_it() {
        let data: Vec<u16> = (0..29).map(|i| i * 7).collect();
        let indices = [0, 1, 5, 24, 25, 26, 27, 28, 29, 30, 1000, u32::MAX, u32::MAX - 1, 1 << 31, 3, 12];
        for choice in [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Avx512, SimdChoice::Auto] {
            if let Ok(level) = choice.level() {
                for rotate in 0..MAX_LANES {
                    let mut indices = indices;
                    indices.rotate_left(rotate);
                    dispatch(level, Check { data: &data, indices });
                }
            }
        }
    }

    #[test]
    #[should_panic(expected = "2 x 2 x 2")]
    fn a_source_shorter_than_a_load_is_refused() {
        LaneSource::new(&[1u8, 2, 3]);
    }
}
