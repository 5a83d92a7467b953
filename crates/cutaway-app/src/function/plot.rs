//! Where values and opacities are in a plot, and how its axis of values is zoomed; in points of the screen, without a window.

use cutaway_core::transfer_function::TransferFunction;
use egui::{Pos2, Rect, pos2};

use super::FARTHEST;

/// The narrowest range of values in view, as a share of the larger of its ends.
const NARROWEST: f64 = 1e-7;

/// How opacities lie along the upright axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Opacities {
    /// Evenly.
    Linear,
    /// By their square root: small ones, which matter in a deep volume, have room.
    #[default]
    Root,
}

/// A plot: a rectangle of the screen and the values at its left and right sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plot {
    /// Where it is on the screen.
    pub rect: Rect,
    /// Values at its sides, the smaller first.
    pub values: [f64; 2],
    /// How opacities lie in it: 0 at the bottom, 1 at the top.
    pub opacities: Opacities,
}

impl Plot {
    /// Where a value is.
    pub fn x(&self, value: f64) -> f32 {
        let [lo, hi] = self.values;
        let share = ((value - lo) / (hi - lo)) as f32;
        self.rect.left() + share.clamp(-1e6, 1e6) * self.rect.width()
    }

    /// Where an opacity is.
    pub fn y(&self, opacity: f64) -> f32 {
        let share = match self.opacities {
            Opacities::Linear => opacity,
            Opacities::Root => opacity.max(0.0).sqrt(),
        };
        self.rect.bottom() - share as f32 * self.rect.height()
    }

    /// Where both are.
    pub fn at(&self, value: f64, opacity: f64) -> Pos2 {
        pos2(self.x(value), self.y(opacity))
    }

    /// The value at a place.
    pub fn value(&self, x: f32) -> f64 {
        let [lo, hi] = self.values;
        let share = f64::from((x - self.rect.left()) / self.rect.width().max(1e-3));
        (lo + (hi - lo) * share).clamp(-FARTHEST, FARTHEST)
    }

    /// The opacity at a place, 0..=1.
    pub fn opacity(&self, y: f32) -> f64 {
        let share = f64::from((self.rect.bottom() - y) / self.rect.height().max(1e-3)).clamp(0.0, 1.0);
        match self.opacities {
            Opacities::Linear => share,
            Opacities::Root => share * share,
        }
    }

    /// The point nearest to a place, at most `within` points of the screen away. Of points in one place the upper of a step is
    /// taken where the place is right of it, so that both can be got hold of.
    pub fn nearest(&self, function: &TransferFunction, place: Pos2, within: f32) -> Option<usize> {
        let distance = |p: Pos2| p.distance(place);
        let mut best: Option<(usize, f32)> = None;
        for (index, point) in function.points().iter().enumerate() {
            let at = self.at(point.value, point.opacity);
            let found = distance(at);
            let nearer = best.is_none_or(|(_, least)| found < least || (found == least && place.x > at.x));
            if found <= within && nearer {
                best = Some((index, found));
            }
        }
        best.map(|(index, _)| index)
    }

    /// The values in view after zooming by `factor` (above 1: nearer) about a place.
    pub fn zoomed(&self, about: f32, factor: f64) -> [f64; 2] {
        if !(factor > 0.0 && factor.is_finite()) {
            return self.values;
        }
        let fixed = self.value(about);
        let ends = self.values.map(|v| (fixed + (v - fixed) / factor).clamp(-FARTHEST, FARTHEST));
        let least = NARROWEST * ends[0].abs().max(ends[1].abs());
        if ends[1] - ends[0] > least { ends } else { self.values }
    }

    /// The values in view after moving the plot under the pointer by `dx` points of the screen.
    pub fn panned(&self, dx: f32) -> [f64; 2] {
        let by = self.value(self.rect.left()) - self.value(self.rect.left() + dx);
        let ends = self.values.map(|v| v + by);
        if ends.iter().all(|v| v.abs() < FARTHEST) { ends } else { self.values }
    }
}

/// The values that show a whole volume and a whole function, with a little room; never without width.
pub fn fit(range: [f64; 2], function: &TransferFunction) -> [f64; 2] {
    let points = function.points();
    let lo = range[0].min(points[0].value).clamp(-FARTHEST, FARTHEST);
    let hi = range[1].max(points[points.len() - 1].value).clamp(-FARTHEST, FARTHEST);
    let room = (0.02 * (hi - lo)).max(NARROWEST * 10.0 * lo.abs().max(hi.abs()));
    let room = if room > 0.0 { room } else { 0.5 };
    [lo - room, hi + room]
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::transfer_function::ControlPoint;
    use proptest::prelude::*;

    fn plot(lo: f64, width: f64, opacities: Opacities) -> Plot {
        let rect = Rect::from_min_max(pos2(20.0, 30.0), pos2(420.0, 230.0));
        Plot { rect, values: [lo, lo + width], opacities }
    }

    fn step() -> TransferFunction {
        let point = |value, opacity| ControlPoint { value, color: [0.0; 3], opacity };
        TransferFunction::new(vec![point(0.0, 0.0), point(5.0, 0.5), point(5.0, 0.5), point(9.0, 1.0)])
            .unwrap()
    }

    proptest! {
        #[test]
        fn places_and_numbers_agree(lo in -1e4..1e4, width in 1.0..1e4, v in 0.0..=1.0, o in 0.0..=1.0) {
            for opacities in [Opacities::Linear, Opacities::Root] {
                let plot = plot(lo, width, opacities);
                let value = lo + v * width;
                let at = plot.at(value, o);
                prop_assert!((plot.value(at.x) - value).abs() < 1e-4 * width);
                prop_assert!((plot.opacity(at.y) - o).abs() < 1e-4);
            }
        }

        #[test]
        fn zooming_keeps_what_is_under_the_pointer(
            lo in -1e4..1e4, width in 1.0..1e4, x in 20f32..420.0, factor in 0.1..10.0, dx in -300f32..300.0
        ) {
            let plot = plot(lo, width, Opacities::Linear);
            let zoomed = Plot { values: plot.zoomed(x, factor), ..plot };
            prop_assert!((zoomed.value(x) - plot.value(x)).abs() < 1e-3 * width * factor.max(1.0 / factor));
            let panned = Plot { values: plot.panned(dx), ..plot };
            prop_assert!((panned.value(x + dx) - plot.value(x)).abs() < 1e-3 * width);
        }
    }

    #[test]
    fn zooming_ends_somewhere() {
        let mut plot = plot(0.0, 100.0, Opacities::Linear);
        for factor in [10.0, 0.1] {
            (0..400).for_each(|_| plot.values = plot.zoomed(200.0, factor));
            assert!(plot.values[0] < plot.values[1] && plot.values.iter().all(|v| v.is_finite()));
        }
        assert_eq!(plot.zoomed(200.0, f64::NAN), plot.values);
    }

    #[test]
    fn both_points_of_a_step_can_be_got_hold_of() {
        let plot = plot(0.0, 10.0, Opacities::Linear);
        let at = plot.at(5.0, 0.5);
        assert_eq!(plot.nearest(&step(), at - egui::vec2(2.0, 0.0), 8.0), Some(1));
        assert_eq!(plot.nearest(&step(), at + egui::vec2(2.0, 0.0), 8.0), Some(2));
        assert_eq!(plot.nearest(&step(), at + egui::vec2(9.0, 0.0), 8.0), None);
    }

    #[test]
    fn what_fits_has_width() {
        let one =
            TransferFunction::new(vec![ControlPoint { value: 7.0, color: [0.0; 3], opacity: 0.0 }]).unwrap();
        for range in [[7.0, 7.0], [0.0, 0.0], [-1e29, 1e29]] {
            let [lo, hi] = fit(range, &one);
            assert!(lo < hi && lo <= range[0] && hi >= range[1]);
        }
        assert_eq!(fit([0.0, 100.0], &step()), [-2.0, 102.0]);
    }
}
