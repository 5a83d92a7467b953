//! Segments: the half-open intervals `[t_near, t_far)` of a ray that are sampled, and their algebra.
//!
//! Volume bounds, clip objects and empty space all speak this one language:
//! `segments(ray) = volume bounds ∩ clip expression ∩ occupied space`.

/// A non-empty half-open interval of a ray; `t` is the world distance from the ray's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    t_near: f64,
    t_far: f64,
}

impl Segment {
    /// The segment from `t_near` to `t_far`, if there is anything between them. NaN gives none.
    #[inline]
    pub fn new(t_near: f64, t_far: f64) -> Option<Self> {
        (t_near < t_far).then_some(Self { t_near, t_far })
    }

    /// Where it begins.
    #[inline]
    pub fn t_near(&self) -> f64 {
        self.t_near
    }

    /// Where it ends; not part of it.
    #[inline]
    pub fn t_far(&self) -> f64 {
        self.t_far
    }

    /// Its length, above zero.
    #[inline]
    pub fn length(&self) -> f64 {
        self.t_far - self.t_near
    }

    /// What both have.
    #[inline]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        Self::new(self.t_near.max(other.t_near), self.t_far.min(other.t_far))
    }
}

/// Disjoint segments in ascending order, touching ones joined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segments(Vec<Segment>);

impl Segments {
    /// No segment.
    pub const EMPTY: Self = Self(Vec::new());

    /// Sorts and joins any segments.
    pub fn from_any(mut segments: Vec<Segment>) -> Self {
        segments.sort_by(|a, b| a.t_near.total_cmp(&b.t_near));
        let mut joined: Vec<Segment> = Vec::with_capacity(segments.len());
        for s in segments {
            match joined.last_mut() {
                Some(last) if s.t_near <= last.t_far => last.t_far = last.t_far.max(s.t_far),
                _ => joined.push(s),
            }
        }
        Self(joined)
    }

    /// The segments, ascending.
    pub fn as_slice(&self) -> &[Segment] {
        &self.0
    }

    /// Their total length.
    pub fn length(&self) -> f64 {
        self.0.iter().map(Segment::length).sum()
    }

    /// Whether `t` lies in one of them.
    pub fn contains(&self, t: f64) -> bool {
        self.0.iter().any(|s| (s.t_near..s.t_far).contains(&t))
    }

    /// What lies in both.
    pub fn intersection(&self, other: &Self) -> Self {
        self.sweep(other, |a, b| a && b)
    }

    /// What lies in either.
    pub fn union(&self, other: &Self) -> Self {
        self.sweep(other, |a, b| a || b)
    }

    /// What lies in `self` but not in `other`.
    pub fn difference(&self, other: &Self) -> Self {
        self.sweep(other, |a, b| a && !b)
    }

    /// Walks along all ends of both lists and keeps the stretches for which `keep(in self, in other)` holds.
    fn sweep(&self, other: &Self, keep: impl Fn(bool, bool) -> bool) -> Self {
        let ends = |s: &Self| s.0.iter().flat_map(|s| [s.t_near, s.t_far]).collect::<Vec<_>>();
        let (a, b) = (ends(self), ends(other));
        let (mut i, mut j) = (0, 0);
        let (mut kept, mut start) = (Vec::new(), None);
        while i < a.len() || j < b.len() {
            let t =
                a.get(i).copied().unwrap_or(f64::INFINITY).min(b.get(j).copied().unwrap_or(f64::INFINITY));
            while a.get(i) == Some(&t) {
                i += 1;
            }
            while b.get(j) == Some(&t) {
                j += 1;
            }
            // An odd number of ends passed means inside: the lists alternate near and far.
            match (keep(i % 2 == 1, j % 2 == 1), start) {
                (true, None) => start = Some(t),
                (false, Some(t_near)) => {
                    kept.extend(Segment::new(t_near, t));
                    start = None;
                }
                _ => {}
            }
        }
        Self(kept)
    }
}

impl From<Option<Segment>> for Segments {
    fn from(segment: Option<Segment>) -> Self {
        Self(segment.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_segments() -> impl Strategy<Value = Segments> {
        // Small integers make shared ends, the interesting case, frequent.
        prop::collection::vec((0i32..20, 0i32..8), 0..6).prop_map(|v| {
            Segments::from_any(
                v.into_iter().filter_map(|(a, l)| Segment::new(f64::from(a), f64::from(a + l))).collect(),
            )
        })
    }

    #[test]
    fn nothing_between_means_no_segment() {
        assert_eq!(Segment::new(1.0, 1.0), None);
        assert_eq!(Segment::new(2.0, 1.0), None);
        assert_eq!(Segment::new(f64::NAN, 1.0), None);
    }

    proptest! {
        #[test]
        fn algebra_is_boolean_at_every_point(a in any_segments(), b in any_segments(), t in 0.0f64..30.0) {
            prop_assert_eq!(a.intersection(&b).contains(t), a.contains(t) && b.contains(t));
            prop_assert_eq!(a.union(&b).contains(t), a.contains(t) || b.contains(t));
            prop_assert_eq!(a.difference(&b).contains(t), a.contains(t) && !b.contains(t));
        }

        #[test]
        fn laws_hold_exactly(a in any_segments(), b in any_segments(), c in any_segments()) {
            prop_assert_eq!(a.union(&b), b.union(&a));
            prop_assert_eq!(a.intersection(&b), b.intersection(&a));
            prop_assert_eq!(a.difference(&a), Segments::EMPTY);
            prop_assert_eq!(&a.union(&a), &a);
            prop_assert_eq!(a.intersection(&b.union(&c)), a.intersection(&b).union(&a.intersection(&c)));
            prop_assert_eq!(a.difference(&b.union(&c)), a.difference(&b).intersection(&a.difference(&c)));
            prop_assert!((a.union(&b).length() + a.intersection(&b).length() - a.length() - b.length()).abs() < 1e-12);
        }
    }
}
