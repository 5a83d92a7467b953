//! Along a ray, a trilinear cell is a cubic polynomial: its exact extrema and crossings.

/// `c[0] + c[1] s + c[2] s² + c[3] s³` on `s` in 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic {
    /// Coefficients, constant first.
    pub c: [f64; 4],
}

impl Cubic {
    /// The cubic through values at `s` = 0, 1/3, 2/3 and 1.
    pub fn through(f: [f64; 4]) -> Self {
        let [f0, f1, f2, f3] = f;
        Self {
            c: [
                f0,
                0.5 * (-11.0 * f0 + 18.0 * f1 - 9.0 * f2 + 2.0 * f3),
                4.5 * (2.0 * f0 - 5.0 * f1 + 4.0 * f2 - f3),
                4.5 * (-f0 + 3.0 * f1 - 3.0 * f2 + f3),
            ],
        }
    }

    /// The value at `s`.
    #[inline]
    pub fn at(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.c;
        a + s * (b + s * (c + s * d))
    }

    /// The slope at `s`.
    #[inline]
    pub fn slope(&self, s: f64) -> f64 {
        let [_, b, c, d] = self.c;
        b + s * (2.0 * c + s * 3.0 * d)
    }

    /// The ends of the pieces of 0..=1 on which the cubic is monotone: 0, up to two turning points, 1.
    pub fn monotone_ends(&self) -> ([f64; 4], usize) {
        let [_, b, c, d] = self.c;
        let mut ends = [0.0, 0.0, 0.0, 0.0];
        let mut n = 1;
        // b + 2 c s + 3 d s² = 0, solved so that nothing cancels.
        let discriminant = c * c - 3.0 * b * d;
        if discriminant >= 0.0 {
            let q = -(c + discriminant.sqrt().copysign(c));
            let mut roots = [b / q, q / (3.0 * d)];
            roots.sort_by(f64::total_cmp);
            for s in roots {
                // Division by zero gives infinities and NaN, which are outside like any other.
                if s > 0.0 && s < 1.0 && s > ends[n - 1] {
                    ends[n] = s;
                    n += 1;
                }
            }
        }
        ends[n] = 1.0;
        (ends, n + 1)
    }

    /// Least and greatest value on 0..=1, and where the greatest is.
    pub fn range(&self) -> (f64, f64, f64) {
        let (ends, n) = self.monotone_ends();
        ends[..n].iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0), |(lo, hi, at), &s| {
            let v = self.at(s);
            if v > hi { (lo.min(v), v, s) } else { (lo.min(v), hi, at) }
        })
    }

    /// Where the cubic passes `level` on `a..=b`, between which it is monotone and changes sides. To the last bits.
    pub fn root_between(&self, level: f64, mut a: f64, mut b: f64) -> f64 {
        let rising = self.at(b) >= level && self.at(a) < level;
        let mut s = 0.5 * (a + b);
        // Newton's steps while they stay inside the bracket, bisection otherwise.
        for _ in 0..64 {
            let error = self.at(s) - level;
            if error == 0.0 || b - a < 1e-15 {
                break;
            }
            if (error > 0.0) == rising {
                b = s;
            } else {
                a = s;
            }
            let newton = s - error / self.slope(s);
            let next = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
            if (next - s).abs() < 1e-15 {
                break;
            }
            s = next;
        }
        s
    }

    /// Returns true if the field is at or above `level` at `s` = 0. `corners` are the smallest and largest value at the cell's
    /// corners: where all of them are on one side of the level, they decide, and not what rounding makes of the cubic.
    pub fn starts_above(&self, level: f64, corners: [f64; 2]) -> bool {
        one_side(level, corners).unwrap_or_else(|| self.at(0.0) >= level)
    }

    /// Calls `found` with every `s` at which a ray that comes `from_above` the level, or not, passes it; ascending. Returns true if
    /// it leaves at or above the level. `corners` as in [`Self::starts_above`].
    ///
    /// Rounding may put a crossing between two cells. The side that the ray comes from decides: then it is at 0.
    pub fn passes(
        &self,
        level: f64,
        corners: [f64; 2],
        from_above: bool,
        mut found: impl FnMut(f64),
    ) -> bool {
        if self.starts_above(level, corners) != from_above {
            found(0.0);
        }
        if let Some(above) = one_side(level, corners) {
            return above;
        }
        self.crossings(level, found);
        self.at(1.0) >= level
    }

    /// Calls `found` with every `s` in 0..=1, ascending, at which the cubic passes from below `level` to at or above
    /// it, or back.
    pub fn crossings(&self, level: f64, mut found: impl FnMut(f64)) {
        let (ends, n) = self.monotone_ends();
        for pair in ends[..n].windows(2) {
            if (self.at(pair[0]) >= level) != (self.at(pair[1]) >= level) {
                found(self.root_between(level, pair[0], pair[1]));
            }
        }
    }
}

/// The side of a level that all corners of a cell are on: true is at or above it. None where they are on both.
fn one_side(level: f64, [least, greatest]: [f64; 2]) -> Option<bool> {
    if least >= level {
        Some(true)
    } else if greatest < level {
        Some(false)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn corners_on_one_side_decide() {
        // Rounding has put the middle just below the level.
        let cubic = Cubic { c: [0.1, -1e-17, 0.0, 0.0] };
        let mut found = Vec::new();
        assert!(cubic.passes(0.1, [0.1, 0.7], true, |s| found.push(s)));
        assert!(found.is_empty());
        assert!(cubic.passes(0.1, [0.1, 0.7], false, |s| found.push(s)));
        assert_eq!(found, [0.0]);
        assert!(!cubic.passes(0.2, [0.1, 0.15], false, |s| found.push(s)));
        assert_eq!(found, [0.0]);
    }

    #[test]
    fn interpolation_gives_the_coefficients_back() {
        let cubic = Cubic { c: [1.0, -2.0, 0.5, 3.0] };
        let again = Cubic::through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|s| cubic.at(s)));
        for (a, b) in cubic.c.iter().zip(again.c) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn degenerate_cubics_have_their_turning_points() {
        let parabola = Cubic { c: [0.0, 1.0, -1.0, 0.0] };
        assert_eq!(parabola.monotone_ends().1, 3);
        assert!((parabola.range().1 - 0.25).abs() < 1e-15);
        for c in [[1.0, 0.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]] {
            assert_eq!(Cubic { c }.monotone_ends().1, 2, "{c:?}");
        }
    }

    proptest! {
        #[test]
        fn crossings_are_on_the_level_and_none_is_missed(c in prop::array::uniform4(-3.0f64..3.0), level in -2.0f64..2.0) {
            let cubic = Cubic { c };
            let mut roots = Vec::new();
            cubic.crossings(level, |s| roots.push(s));
            for &s in &roots {
                prop_assert!((cubic.at(s) - level).abs() < 1e-11);
            }
            let n = 2000;
            let sides: Vec<bool> = (0..=n).map(|i| cubic.at(f64::from(i) / f64::from(n)) >= level).collect();
            let changes = sides.windows(2).filter(|w| w[0] != w[1]).count();
            // A fine sampling may miss a pair of crossings, never see more, and agrees on the parity.
            prop_assert!(roots.len() >= changes && (roots.len() - changes) % 2 == 0);
        }

        #[test]
        fn the_range_bounds_every_value_and_is_attained(c in prop::array::uniform4(-3.0f64..3.0), s in 0.0f64..=1.0) {
            let cubic = Cubic { c };
            let (lo, hi, at) = cubic.range();
            prop_assert!(cubic.at(s) >= lo - 1e-12 && cubic.at(s) <= hi + 1e-12);
            prop_assert_eq!(cubic.at(at), hi);
        }
    }
}
