//! Edits of a transfer function, without a window: each takes a function and makes another.
//!
//! Points keep their order, whatever is done to one of them: a point that is moved ends at its neighbours. So steps (two points at
//! one value) survive every edit but the removal of one of their points.
//!
//! The *window* of a function is the range of values over which it changes: what lies below and above it looks like its ends.
//! Window and level, as radiologists have them, are its width and its middle.

mod plot;

use cutaway_core::colormaps;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};

pub use plot::{Opacities, Plot, fit};

/// Values beyond this are not reached by dragging: nothing that is measured is there, and numbers still have digits.
pub const FARTHEST: f64 = 1e30;

/// The narrowest window, as a share of the larger of its ends: below it values cannot be told apart.
const NARROWEST: f64 = 1e-9;

/// A function of points that are known to be good.
fn of(points: Vec<ControlPoint>) -> Option<TransferFunction> {
    TransferFunction::new(points).ok()
}

/// The function with one point changed, or as it is where that makes none.
fn with_point(
    function: &TransferFunction,
    index: usize,
    change: impl FnOnce(&mut ControlPoint),
) -> TransferFunction {
    let mut points = function.points().to_vec();
    let Some(point) = points.get_mut(index) else { return function.clone() };
    change(point);
    of(points).unwrap_or_else(|| function.clone())
}

/// Moves a point, as far as its neighbours let it.
pub fn moved(function: &TransferFunction, index: usize, value: f64, opacity: f64) -> TransferFunction {
    if value.is_nan() || opacity.is_nan() {
        return function.clone();
    }
    let points = function.points();
    let below = index.checked_sub(1).and_then(|i| points.get(i)).map_or(-FARTHEST, |p| p.value);
    let above = points.get(index + 1).map_or(FARTHEST, |p| p.value);
    with_point(function, index, |p| {
        // A first point beyond the farthest (a file's) stays put rather than crossing its neighbour.
        p.value = value.max(below).min(above.max(below));
        p.opacity = opacity.clamp(0.0, 1.0);
    })
}

/// Gives a point another colour: straight RGB, 0..=1.
pub fn colored(function: &TransferFunction, index: usize, color: [f64; 3]) -> TransferFunction {
    with_point(function, index, |p| p.color = color)
}

/// Adds a point on the curve at a value, which changes nothing to be seen; the function and the point's number.
pub fn added(function: &TransferFunction, value: f64) -> (TransferFunction, usize) {
    let value = if value.is_nan() { 0.0 } else { value.clamp(-FARTHEST, FARTHEST) };
    let (color, opacity) = function.evaluate(value);
    let mut points = function.points().to_vec();
    let index = points.partition_point(|p| p.value <= value);
    points.insert(index, ControlPoint { value, color, opacity });
    (of(points).unwrap_or_else(|| function.clone()), index)
}

/// Removes a point; none where it is the last one, or is not there.
pub fn removed(function: &TransferFunction, index: usize) -> Option<TransferFunction> {
    let mut points = function.points().to_vec();
    if index >= points.len() || points.len() == 1 {
        return None;
    }
    points.remove(index);
    of(points)
}

/// The range of values over which a function changes; where it is the same everywhere, that of its points.
pub fn window(function: &TransferFunction) -> [f64; 2] {
    let points = function.points();
    let differs =
        |pair: &[ControlPoint]| (pair[0].color, pair[0].opacity) != (pair[1].color, pair[1].opacity);
    let first = points.windows(2).position(differs);
    let last = points.windows(2).rposition(differs);
    match (first, last) {
        (Some(first), Some(last)) => [points[first].value, points[last + 1].value],
        _ => [points[0].value, points[points.len() - 1].value],
    }
}

/// Moves every point along the values.
pub fn shifted(function: &TransferFunction, by: f64) -> TransferFunction {
    placed(function, |value| value + by)
}

/// Stretches the function about a value; factors of 0 and less leave it as it is.
pub fn scaled(function: &TransferFunction, about: f64, factor: f64) -> TransferFunction {
    if !(factor > 0.0 && factor.is_finite()) {
        return function.clone();
    }
    placed(function, |value| about + (value - about) * factor)
}

/// Shifts and stretches the function so that its window has this width and this middle. A step stays one: of a window without
/// width only the middle is taken.
pub fn windowed(function: &TransferFunction, width: f64, level: f64) -> TransferFunction {
    let [lo, hi] = window(function);
    let least = NARROWEST * lo.abs().max(hi.abs()).max(level.abs());
    if !level.is_finite() || !width.is_finite() {
        return function.clone();
    }
    let (own, middle) = (hi - lo, 0.5 * lo + 0.5 * hi);
    let factor = if own > 0.0 { width.max(least).max(f64::MIN_POSITIVE) / own } else { 1.0 };
    if !(factor > 0.0 && factor.is_finite()) {
        return function.clone();
    }
    placed(function, |value| level + (value - middle) * factor)
}

/// Window and level as a drag over the picture changes them: across widens the window, down lowers the level, both in shares
/// of the picture's height; `range` is the volume's.
pub fn dragged_window(
    function: &TransferFunction,
    [across, down]: [f64; 2],
    range: [f64; 2],
) -> TransferFunction {
    let [lo, hi] = window(function);
    let [least, most] = range;
    let all = (most - least).max(f64::MIN_POSITIVE);
    let width = ((hi - lo) * across.clamp(-2.0, 2.0).exp()).clamp(all * 1e-4, all * 10.0);
    let level = (0.5 * lo + 0.5 * hi - down * (hi - lo).max(all * 0.01)).clamp(least - all, most + all);
    windowed(function, width, level)
}

/// Every value put elsewhere, in the same order.
fn placed(function: &TransferFunction, place: impl Fn(f64) -> f64) -> TransferFunction {
    let mut points = function.points().to_vec();
    for p in &mut points {
        let value = place(p.value);
        if value.is_nan() {
            return function.clone();
        }
        p.value = value.clamp(-FARTHEST, FARTHEST);
    }
    of(points).unwrap_or_else(|| function.clone())
}

/// The colours of a named map over the window of a function, with the function's opacities; `range` (of the volume) where the
/// window has no width. None: there is no such map, or no range.
pub fn with_colormap(function: &TransferFunction, name: &str, range: [f64; 2]) -> Option<TransferFunction> {
    let [lo, hi] = wide(window(function), range);
    colormaps::over_range(name, lo, hi, &opacities(function)).ok()
}

/// The colours of another function, stretched over the window of this one, whose opacities stay: what a colour map without
/// opacities does.
pub fn with_colors_of(
    function: &TransferFunction,
    colors: &TransferFunction,
    range: [f64; 2],
) -> Option<TransferFunction> {
    let [lo, hi] = wide(window(function), range);
    let points = colors.points();
    let (first, last) = (points[0].value, points[points.len() - 1].value);
    let place = |value: f64| {
        let share = if last > first { (value - first) / (last - first) } else { 0.0 };
        lo + (hi - lo) * share
    };
    let colors: Vec<_> = points.iter().map(|p| (place(p.value), p.color)).collect();
    TransferFunction::from_color_and_opacity(&colors, &opacities(function)).ok()
}

fn wide(window: [f64; 2], range: [f64; 2]) -> [f64; 2] {
    if window[0] < window[1] { window } else { range }
}

fn opacities(function: &TransferFunction) -> Vec<(f64, f64)> {
    function.points().iter().map(|p| (p.value, p.opacity)).collect()
}

#[cfg(test)]
mod tests;
