//! Compositing: how a stretch of a ray adds up. All colours here are premultiplied.

/// Opacity of a stretch of `length` (world units) through constant `extinction` (per world unit).
///
/// `exp_m1` keeps the many faint steps of a fine sampling exact.
#[inline]
pub fn segment_opacity(extinction: f64, length: f64) -> f64 {
    -f64::exp_m1(-extinction * length)
}

/// `back` seen through `front`; both premultiplied RGBA.
#[inline]
pub fn over(front: [f32; 4], back: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| front[c] + (1.0 - front[3]) * back[c])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn splitting_a_segment_keeps_its_opacity(sigma in 0.0f64..50.0, length in 1e-3f64..2.0, split in 0.0f64..1.0) {
            let (a, b) = (segment_opacity(sigma, length * split), segment_opacity(sigma, length * (1.0 - split)));
            let whole = segment_opacity(sigma, length);
            prop_assert!((a + (1.0 - a) * b - whole).abs() < 1e-14);
        }

        #[test]
        fn over_is_associative(a in any::<[u8; 4]>(), b in any::<[u8; 4]>(), c in any::<[u8; 4]>()) {
            let premultiplied = |p: [u8; 4]| {
                let alpha = f32::from(p[3]) / 255.0;
                [f32::from(p[0]) / 255.0 * alpha, f32::from(p[1]) / 255.0 * alpha, f32::from(p[2]) / 255.0 * alpha, alpha]
            };
            let [a, b, c] = [a, b, c].map(premultiplied);
            let (left, right) = (over(over(a, b), c), over(a, over(b, c)));
            for k in 0..4 {
                prop_assert!((left[k] - right[k]).abs() < 1e-6);
            }
        }
    }
}
