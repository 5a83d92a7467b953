//! Fitting an object to a volume.

use glam::{DAffine3, DVec3};

/// Why an object cannot be fitted to anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// It has no end.
    #[error("a half-space has no size that could be fitted")]
    Endless,
    /// It is a point, or there are no points at all.
    #[error("the object has no size that could be fitted to the volume's")]
    NoSize,
}

/// The corners of a box between two of them: bit `axis` of an index says whether it is at the large coordinate.
pub fn box_corners([min, max]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| DVec3::from_array(std::array::from_fn(|axis| [min, max][i >> axis & 1][axis])))
}

/// Centres what reaches as far as `points` do in the box around `room`, and scales it, the same along all axes, as large
/// as it can be within that box.
///
/// # Errors
/// Points that are not finite, or that are all in one place.
pub fn fit(points: &[DVec3], room: &[DVec3]) -> Result<DAffine3, FitError> {
    if !points.iter().all(|p| p.is_finite()) {
        return Err(FitError::Endless);
    }
    let ([min, max], room) = (extremes(points), extremes(room));
    // A flat object has a size of 0 along an axis: the others decide.
    let factor = ((room[1] - room[0]) / (max - min)).min_element();
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(FitError::NoSize);
    }
    let center = 0.5 * (room[0] + room[1]);
    Ok(DAffine3::from_translation(center)
        * DAffine3::from_scale(DVec3::splat(factor))
        * DAffine3::from_translation(-0.5 * (min + max)))
}

/// The box around points.
pub fn extremes(points: &[DVec3]) -> [DVec3; 2] {
    let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.iter().fold([low, high], |[min, max], p| [min.min(*p), max.max(*p)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_fitted_touches_the_room_along_one_axis_and_is_in_its_middle() {
        let points = box_corners([DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 6.0, 5.0)]);
        let room = [DVec3::ZERO, DVec3::splat(8.0)];
        let fitted = fit(&points, &room).unwrap();
        let [min, max] = extremes(&points.map(|p| fitted.transform_point3(p)));
        assert_eq!((min, max), (DVec3::new(3.0, 0.0, 2.0), DVec3::new(5.0, 8.0, 6.0)));
    }

    #[test]
    fn what_has_no_size_or_no_end_is_refused() {
        let room = [DVec3::ZERO, DVec3::ONE];
        assert_eq!(fit(&[DVec3::ONE], &room), Err(FitError::NoSize));
        assert_eq!(fit(&[], &room), Err(FitError::NoSize));
        assert_eq!(fit(&[DVec3::NEG_INFINITY, DVec3::INFINITY], &room), Err(FitError::Endless));
        // Flat is a size.
        assert!(fit(&[DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)], &room).is_ok());
    }
}
