//! Rows of numbers with accessible names.

use cutaway_core::glam::DVec3;
use egui::{DragValue, Ui};

/// How a row of numbers is dragged and shown.
#[derive(Clone, Debug)]
pub(super) struct Numbers {
    /// Change a point of the screen.
    pub(super) speed: f64,
    /// What is put behind each number.
    pub(super) suffix: &'static str,
    /// What each may be.
    pub(super) range: std::ops::RangeInclusive<f64>,
}

impl Numbers {
    /// Any number, of no unit.
    pub(super) fn any(speed: f64) -> Self {
        Self { speed, suffix: "", range: f64::NEG_INFINITY..=f64::INFINITY }
    }

    /// A number; whether it changed.
    pub(super) fn one(&self, ui: &mut Ui, name: &str, value: &mut f64) -> bool {
        let number = DragValue::new(value).speed(self.speed).suffix(self.suffix).max_decimals(4);
        ui.add(number.range(self.range.clone())).accessible_name(name).changed()
    }

    /// Three numbers, for x, y and z; whether one of them changed.
    pub(super) fn three(&self, ui: &mut Ui, name: &str, values: &mut DVec3) -> bool {
        let mut changed = false;
        for axis in 0..3 {
            let name = format!("{name} {}", ["x", "y", "z"][axis]);
            changed |= self.one(ui, &name, &mut values[axis]);
        }
        changed
    }
}
