//! The plot: the histogram, the curve over it, and points that can be dragged.

use cutaway_core::histogram::Histogram;
use cutaway_core::transfer_function::TransferFunction;
use egui::epaint::Mesh;
use egui::{
    Color32, CursorIcon, EventFilter, Key, PointerButton, Pos2, Rect, Response, Role, Sense, Stroke, Ui,
    Vec2, WidgetInfo, pos2, vec2,
};

use crate::document::Document;
use crate::function::{self, Opacities, Plot};

/// How near the pointer must be to a point, in points of the screen.
const REACH: f32 = 10.0;

/// Height of the plot and of the colour bar below it.
const HEIGHTS: [f32; 2] = [180.0, 14.0];

/// What is zoomed to, selected and dragged.
#[derive(Debug, Default)]
pub(super) struct PlotView {
    /// Values in view; none: nothing was shown yet.
    values: Option<[f64; 2]>,
    pub(super) opacities: Opacities,
    pub(super) selected: Option<usize>,
    drag: Option<Drag>,
    hovered: bool,
}

/// What the pointer has got hold of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drag {
    /// A point, and how far the pointer is from it.
    Point(usize, Vec2),
    /// The whole function.
    Whole,
    /// The plot itself.
    View,
}

impl PlotView {
    pub(super) fn is_hovered(&self) -> bool {
        self.hovered
    }

    pub(super) fn hidden(&mut self) {
        self.hovered = false;
    }

    /// Shows all values of the volume and of the function.
    pub(super) fn fit(&mut self, document: &Document) {
        let range = document.volume().lattice().value_range();
        self.values = Some(function::fit(range, &document.state().function));
    }

    /// Removes a point, in a step of its own.
    pub(super) fn remove(&mut self, document: &mut Document, index: usize) {
        if let Some(removed) = function::removed(&document.state().function, index) {
            document.settle();
            document.edit("function: remove", |s| s.function = removed);
            document.settle();
            self.selected = None;
            self.drag = None;
        }
    }

    fn add(&mut self, document: &mut Document, value: f64) {
        let (function, index) = function::added(&document.state().function, value);
        document.settle();
        document.edit("function: add", |s| s.function = function);
        document.settle();
        self.selected = Some(index);
    }

    pub(super) fn show(&mut self, ui: &mut Ui, document: &mut Document) {
        if self.values.is_none() {
            self.fit(document);
        }
        let [height, bar] = HEIGHTS;
        let size = vec2(ui.available_width().max(80.0), height + bar + 4.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let (area, bar) = (
            Rect::from_min_max(rect.min, pos2(rect.right(), rect.bottom() - bar - 4.0)),
            Rect::from_min_max(pos2(rect.left(), rect.bottom() - bar), rect.max),
        );
        response.widget_info(|| {
            WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), "Plot of the transfer function")
        });
        self.hovered = response.hovered();
        let mut plot = Plot {
            rect: area.shrink(6.0),
            values: self.values.expect("fitted above"),
            opacities: self.opacities,
        };
        self.zoom(ui, &response, &mut plot);
        self.pointer(ui, &response, &mut plot, document);
        self.keys(ui, &response, &plot, document);
        self.values = Some(plot.values);
        if ui.is_rect_visible(rect) {
            let state = document.state();
            let painter = ui.painter_at(rect);
            painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
            paint_histogram(&painter, &plot, document.volume().histogram(), ui.visuals().weak_text_color());
            paint_curve(&painter, &plot, &state.function, ui.visuals().strong_text_color());
            paint_bar(&painter, &plot, bar, &state.function);
            self.paint_points(ui, &response, &painter, &plot, &state.function);
        }
        if response.hovered() && self.drag.is_none() {
            tell(ui, &response, &plot, document);
        }
    }

    /// The wheel and two fingers zoom about the pointer; sideways they move the view.
    fn zoom(&self, ui: &Ui, response: &Response, plot: &mut Plot) {
        let Some(at) = response.hover_pos() else { return };
        let (scroll, zoom) = ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta()));
        if scroll.y != 0.0 || zoom != 1.0 {
            plot.values = plot.zoomed(at.x, f64::from(zoom) * f64::from(scroll.y / 200.0).exp());
        }
        if scroll.x != 0.0 {
            plot.values = plot.panned(scroll.x);
        }
    }

    fn pointer(&mut self, ui: &Ui, response: &Response, plot: &mut Plot, document: &mut Document) {
        let modifiers = ui.input(|i| i.modifiers);
        let hit = |place: Option<Pos2>| {
            place.and_then(|place| plot.nearest(&document.state().function, place, REACH))
        };
        if response.drag_started_by(PointerButton::Primary) {
            let origin = ui.input(|i| i.pointer.press_origin());
            let found = hit(origin);
            self.drag = Some(match (found, origin) {
                _ if modifiers.shift => Drag::Whole,
                (Some(index), Some(origin)) => {
                    let point = document.state().function.points()[index];
                    Drag::Point(index, plot.at(point.value, point.opacity) - origin)
                }
                _ => Drag::View,
            });
            if let Some(Drag::Point(index, _)) = self.drag {
                self.selected = Some(index);
            }
            response.request_focus();
        }
        if response.dragged_by(PointerButton::Primary) {
            self.dragged(response, plot, document);
        }
        if response.drag_stopped() {
            self.drag = None;
        }
        let place = response.interact_pointer_pos();
        let hit = place.and_then(|place| plot.nearest(&document.state().function, place, REACH));
        let value = place.map(|place| plot.value(place.x));
        if response.secondary_clicked() {
            if let Some(index) = hit {
                self.remove(document, index);
            }
        } else if response.clicked() || response.double_clicked() {
            response.request_focus();
            let adds = response.double_clicked() || modifiers.command || modifiers.ctrl;
            match (hit, value) {
                (None, Some(value)) if adds => self.add(document, value),
                _ => self.selected = hit,
            }
        }
    }

    fn dragged(&self, response: &Response, plot: &mut Plot, document: &mut Document) {
        let (Some(place), Some(drag)) = (response.interact_pointer_pos(), self.drag) else { return };
        match drag {
            Drag::Point(index, offset) => {
                let place = place + offset;
                let (value, opacity) = (plot.value(place.x), plot.opacity(place.y));
                document.edit("function: point", |s| {
                    s.function = function::moved(&s.function, index, value, opacity);
                });
            }
            Drag::Whole => {
                let by = plot.value(place.x) - plot.value(place.x - response.drag_delta().x);
                document.edit("function: shift", |s| s.function = function::shifted(&s.function, by));
            }
            Drag::View => plot.values = plot.panned(response.drag_delta().x),
        }
    }

    /// Arrows move the selected point, Delete removes it.
    fn keys(&mut self, ui: &Ui, response: &Response, plot: &Plot, document: &mut Document) {
        if !response.has_focus() {
            return;
        }
        let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|m| m.set_focus_lock_filter(response.id, arrows));
        let Some(index) = self.selected.filter(|i| *i < document.state().function.points().len()) else {
            return;
        };
        let [left, right, up, down, remove] = ui.input(|i| {
            let pressed = |key| i.key_pressed(key);
            let remove = pressed(Key::Delete) || pressed(Key::Backspace);
            [
                pressed(Key::ArrowLeft),
                pressed(Key::ArrowRight),
                pressed(Key::ArrowUp),
                pressed(Key::ArrowDown),
                remove,
            ]
        });
        if remove {
            return self.remove(document, index);
        }
        let sign = |more: bool, less: bool| f64::from(i8::from(more) - i8::from(less));
        let (dx, dy) = (sign(right, left), sign(up, down));
        if dx != 0.0 || dy != 0.0 {
            let point = document.state().function.points()[index];
            let value = point.value + 0.01 * dx * (plot.values[1] - plot.values[0]);
            let opacity = point.opacity + 0.01 * dy;
            document.edit("function: point", |s| {
                s.function = function::moved(&s.function, index, value, opacity);
            });
        }
    }

    fn paint_points(
        &self,
        ui: &Ui,
        response: &Response,
        painter: &egui::Painter,
        plot: &Plot,
        function: &TransferFunction,
    ) {
        let hovered = response.hover_pos().and_then(|place| plot.nearest(function, place, REACH));
        let (ring, chosen) = (ui.visuals().strong_text_color(), ui.visuals().selection.stroke.color);
        for (index, point) in function.points().iter().enumerate() {
            let selected = self.selected == Some(index);
            let at = plot.at(point.value, point.opacity);
            if !plot.rect.expand(8.0).contains(at) {
                continue;
            }
            let radius = if selected || hovered == Some(index) { 6.0 } else { 4.0 };
            let stroke = if selected { Stroke::new(2.5, chosen) } else { Stroke::new(1.0, ring) };
            painter.circle(at, radius, shown(point.color), stroke);
        }
        if hovered.is_some() && response.hovered() {
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
    }
}

/// Value and opacity under the pointer.
fn tell(ui: &Ui, response: &Response, plot: &Plot, document: &Document) {
    let Some(at) = response.hover_pos() else { return };
    let value = plot.value(at.x);
    let (_, opacity) = document.state().function.evaluate(value);
    let digits = (3.0 - (plot.values[1] - plot.values[0]).abs().log10()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}  opacity {opacity:.3}");
    let font = egui::TextStyle::Small.resolve(ui.style());
    let (place, align) = (plot.rect.right_top(), egui::Align2::RIGHT_TOP);
    ui.painter_at(response.rect).text(place, align, text, font, ui.visuals().text_color());
}

/// A colour of a function, as it is on the screen.
fn shown(color: [f64; 3]) -> Color32 {
    let [r, g, b] = color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// Columns of the plot: a pixel or so each.
fn columns(rect: Rect) -> impl Iterator<Item = (f32, f32)> {
    let count = (rect.width().clamp(1.0, 4096.0)) as usize;
    let width = rect.width() / count as f32;
    (0..count).map(move |i| (rect.left() + i as f32 * width, rect.left() + (i + 1) as f32 * width))
}

/// Bars on a logarithmic scale; a column takes the fullest of the bins under it.
fn paint_histogram(painter: &egui::Painter, plot: &Plot, histogram: &Histogram, color: Color32) {
    let [lo, hi] = histogram.range;
    let bins = histogram.counts.len();
    let most = histogram.counts.iter().max().map_or(0.0, |n| (*n as f64).ln_1p());
    if most <= 0.0 || lo >= hi {
        return;
    }
    let bin = |value: f64| ((value - lo) / (hi - lo) * bins as f64).floor();
    let mut mesh = Mesh::default();
    for (left, right) in columns(plot.rect) {
        let (first, last) = (bin(plot.value(left)), bin(plot.value(right)));
        if last < 0.0 || first >= bins as f64 {
            continue;
        }
        let [first, last] = [first, last].map(|b| b.clamp(0.0, (bins - 1) as f64) as usize);
        let count = histogram.counts[first..=last].iter().max().copied().unwrap_or(0);
        if count > 0 {
            let height = ((count as f64).ln_1p() / most) as f32 * plot.rect.height();
            let top = pos2(left, plot.rect.bottom() - height);
            mesh.add_colored_rect(
                Rect::from_min_max(top, pos2(right, plot.rect.bottom())),
                color.gamma_multiply(0.6),
            );
        }
    }
    painter.add(mesh);
}

/// The curve, and below it what it makes of values.
fn paint_curve(painter: &egui::Painter, plot: &Plot, function: &TransferFunction, color: Color32) {
    let mut mesh = Mesh::default();
    for (left, right) in columns(plot.rect) {
        let (rgb, opacity) = function.evaluate(plot.value(0.5 * (left + right)));
        let top = pos2(left, plot.y(opacity));
        let below = Rect::from_min_max(top, pos2(right, plot.rect.bottom()));
        mesh.add_colored_rect(below, shown(rgb).gamma_multiply(0.55));
    }
    painter.add(mesh);
    let line = curve(plot, function);
    painter.with_clip_rect(plot.rect.expand(2.0)).line(line, Stroke::new(1.5, color));
}

/// The curve as a line: steps upright, bends of the axis followed.
fn curve(plot: &Plot, function: &TransferFunction) -> Vec<Pos2> {
    let mut values: Vec<(f64, f64)> =
        columns(plot.rect).map(|(x, _)| plot.value(x)).map(|v| (v, function.evaluate(v).1)).collect();
    values.push((plot.values[1], function.evaluate(plot.values[1]).1));
    let inside = function.points().iter().filter(|p| (plot.values[0]..=plot.values[1]).contains(&p.value));
    values.extend(inside.map(|p| (p.value, p.opacity)));
    // Stable: the points of a step stay in their order.
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    values.into_iter().map(|(value, opacity)| plot.at(value, opacity)).collect()
}

/// The colours alone.
fn paint_bar(painter: &egui::Painter, plot: &Plot, bar: Rect, function: &TransferFunction) {
    let mut mesh = Mesh::default();
    for (left, right) in columns(plot.rect) {
        let (rgb, _) = function.evaluate(plot.value(0.5 * (left + right)));
        let column = Rect::from_min_max(pos2(left, bar.top()), pos2(right, bar.bottom()));
        mesh.add_colored_rect(column, shown(rgb));
    }
    painter.add(mesh);
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::transfer_function::ControlPoint;

    #[test]
    fn the_curve_is_upright_at_steps_and_never_goes_back() {
        let point = |value, opacity| ControlPoint { value, color: [0.0; 3], opacity };
        let function =
            TransferFunction::new(vec![point(2.0, 0.1), point(5.0, 0.9), point(5.0, 0.2)]).unwrap();
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(97.0, 50.0));
        let plot = Plot { rect, values: [0.0, 10.0], opacities: Opacities::Linear };
        let line = curve(&plot, &function);
        assert!(line.windows(2).all(|w| w[0].x <= w[1].x));
        let at_step: Vec<f32> = line.iter().filter(|p| p.x == plot.x(5.0)).map(|p| p.y).collect();
        assert_eq!(at_step, [plot.y(0.9), plot.y(0.2)]);
    }
}
