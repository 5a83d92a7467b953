//! Which handle is under the pointer.

use cutaway_core::glam::{DVec2, DVec3};

use super::{Frame, Handle, lengths};
use crate::cutting::lens::Lens;

/// How near to a line the pointer must be, in points.
const REACH: f64 = 6.0;

/// What is filled comes before lines, what is small before what is large.
pub(super) fn pick(frame: &Frame, lens: &Lens, point: DVec2) -> Option<Handle> {
    let size = frame.point_size(lens)?;
    let middle = lens.point(frame.center)?;
    if (point - middle).abs().max_element() <= lengths::MIDDLE {
        return Some(Handle::Scale);
    }
    let usable = |handle: &Handle| frame.is_usable(*handle, lens);
    let boxes = Handle::ALL.into_iter().filter(|h| matches!(h, Handle::ScaleAxis(_))).filter(usable);
    let boxes = boxes.filter_map(|h| Some((h, distance(frame, lens, h, size, point)?)));
    if let Some(found) = nearest(boxes, REACH + 1.0) {
        return Some(found);
    }
    let squares = Handle::ALL.into_iter().filter(|h| matches!(h, Handle::Plane(_))).filter(usable);
    for square in squares {
        if distance(frame, lens, square, size, point) == Some(0.0) {
            return Some(square);
        }
    }
    let lines = Handle::ALL.into_iter().filter(|h| {
        matches!(h, Handle::Axis(_) | Handle::Ring(_) | Handle::ViewRing) && frame.is_usable(*h, lens)
    });
    nearest(lines.filter_map(|h| Some((h, distance(frame, lens, h, size, point)?))), REACH)
}

fn nearest(found: impl Iterator<Item = (Handle, f64)>, reach: f64) -> Option<Handle> {
    let best = found.filter(|(_, d)| *d <= reach).min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(handle, _)| handle)
}

/// How far from a handle a point of the picture is, in points.
fn distance(frame: &Frame, lens: &Lens, handle: Handle, size: f64, point: DVec2) -> Option<f64> {
    match handle {
        Handle::Axis(axis) => {
            let at = |length: f64| lens.point(frame.center + frame.axes[axis] * (length * size));
            Some(to_segment(point, at(lengths::ARROW_FROM)?, at(lengths::ARROW_TO)?))
        }
        Handle::ScaleAxis(axis) => {
            let at = frame.center + frame.scale_axes[axis] * (lengths::SCALE_BOX * size);
            Some(lens.point(at)?.distance(point))
        }
        Handle::Plane(across) => {
            let [a, b, c, d] = frame.square(across, size).map(|p| lens.point(p));
            let inside = is_inside(point, &[a?, b?, c?, d?]);
            Some(if inside { 0.0 } else { f64::INFINITY })
        }
        Handle::Ring(_) | Handle::ViewRing => {
            let normal = frame.ring_normal(handle, lens)?;
            let radius = if handle == Handle::ViewRing { lengths::VIEW_RING } else { lengths::RING };
            let circle = frame.circle(normal, radius * size, 64);
            let segments = circle.windows(2).filter(|pair| is_near_half(frame, lens, handle, pair[0]));
            let distances = segments
                .filter_map(|pair| Some(to_segment(point, lens.point(pair[0])?, lens.point(pair[1])?)));
            distances.min_by(f64::total_cmp)
        }
        Handle::Scale => Some(lens.point(frame.center)?.distance(point)),
    }
}

/// Only the half of a ring that is on the viewer's side can be grabbed, else every click would meet two.
pub fn is_near_half(frame: &Frame, lens: &Lens, handle: Handle, at: DVec3) -> bool {
    let forward = lens.direction_to(frame.center);
    let edge = 0.02 * (at - frame.center).length();
    handle == Handle::ViewRing || (at - frame.center).dot(forward) <= edge
}

fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    p.distance(a + along * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 })
}

/// Whether a point is in a convex polygon.
fn is_inside(p: DVec2, corners: &[DVec2]) -> bool {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let turns: Vec<f64> = sides.map(|(a, b)| (*b - *a).perp_dot(p - *a)).collect();
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}
