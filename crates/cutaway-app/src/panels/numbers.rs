//! Fields for numbers, each with a name that is seen and heard.

use std::ops::RangeInclusive;

use egui::{DragValue, Response, Slider, Ui};

/// A number to be dragged or typed, after its name; true: it was changed.
pub(super) fn field(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    speed: f64,
) -> Response {
    let label = ui.label(name);
    let speed = if speed.is_finite() && speed > 0.0 { speed } else { 0.1 };
    ui.add(DragValue::new(value).range(range).speed(speed).max_decimals(6)).labelled_by(label.id)
}

/// A slider with its name; the number beside it takes whatever is in `range`.
pub(super) fn slider(ui: &mut Ui, name: &str, value: &mut f64, range: RangeInclusive<f64>) -> Response {
    ui.add(Slider::new(value, range).text(name).max_decimals(4))
}

/// A slider over several orders of magnitude that can reach 0.
pub(super) fn logarithmic(ui: &mut Ui, name: &str, value: &mut f64, range: RangeInclusive<f64>) -> Response {
    ui.add(Slider::new(value, range).text(name).logarithmic(true).smallest_positive(1e-3).max_decimals(4))
}
