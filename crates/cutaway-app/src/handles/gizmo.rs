//! The gizmo of the selected operand.

use cutaway_core::glam::{DAffine3, DQuat, DVec2, DVec3};
use egui::{Color32, Painter, Pos2, Response, Shape, Stroke, Ui};

use super::{COLORS, Dragging, Grip, HIGHLIGHT, Seen, announce, stroke_over};
use crate::cutting::OperandId;
use crate::cutting::gizmo::{Axes, Drag, Frame, Handle, Snap, is_near_half, lengths};
use crate::document::Document;
use crate::picture::Projection;
use crate::words::capitalised;

/// The undo step of a drag.
const STEP: &str = "move operand";

/// Moves, turns and scales the selected operand by handles in the picture.
///
/// With Ctrl (or Command) held it goes in steps: of a voxel, 15 degrees, a tenth. Escape takes the drag back.
#[derive(Clone, Debug, Default)]
pub struct Gizmo {
    /// Which axes handles go along.
    pub axes: Axes,
    dragging: Dragging<(OperandId, Drag)>,
    hovered: Option<Handle>,
}

impl Gizmo {
    /// The choice of axes, for a row of tools.
    pub fn controls(&mut self, ui: &mut Ui) {
        for (axes, word) in [(Axes::World, "world"), (Axes::Object, "object")] {
            let button = ui.selectable_label(self.axes == axes, capitalised(word));
            let button = button.accessible_name(format!("{word} axes"));
            if button.on_hover_text(format!("Handles go along the axes of the {word}")).clicked() {
                self.axes = axes;
            }
        }
    }

    /// Paints it and lets it be dragged; whether it has the pointer.
    /// Where something else has it already, nothing here `listens`.
    pub(super) fn show(
        &mut self,
        listens: bool,
        ui: &mut Ui,
        response: &Response,
        projection: &Projection,
        document: &mut Document,
    ) -> bool {
        let seen = Seen::new(projection);
        let held = self.dragging.has_pointer();
        let grip = Grip::new(ui, response, &seen, held, listens);
        let Some((id, frame)) = self.frame(document) else {
            self.let_go(&grip);
            return held;
        };
        self.follow(ui, &grip, &seen, document, id, frame);
        // It moved: it is drawn where it is now.
        let Some((_, mut now)) = self.frame(document) else { return held };
        if let Dragging::Yes((_, drag)) = &self.dragging {
            // Axes of the object would turn under the hand that turns it, and the middle of a half-space is its own only
            // until it is moved.
            let moved = document.state().cutting.world_from_operand(id);
            let before = drag.world_from_list * *drag.pose.world_from_object();
            now = Frame {
                center: (moved * before.inverse()).transform_point3(drag.frame.center),
                ..drag.frame
            };
            self.hovered = Some(drag.handle);
        }
        self.paint(ui, response, &seen, &now);
        if let Dragging::Yes((_, drag)) = self.dragging {
            self.say(ui, &seen, &drag, &grip);
        }
        if self.hovered.is_some() {
            ui.ctx().set_cursor_icon(match self.dragging {
                Dragging::No => egui::CursorIcon::Grab,
                Dragging::Yes(_) | Dragging::Over => egui::CursorIcon::Grabbing,
            });
        }
        // A click on a handle is nobody else's, either: the frame of its release is still taken.
        held || self.dragging.has_pointer()
    }

    /// Where the selected operand is.
    fn frame(&self, document: &Document) -> Option<(OperandId, Frame)> {
        let id = document.selected?;
        let cutting = &document.state().cutting;
        let volume = document.volume().lattice();
        let find = |source: &_| document.solids.get(source);
        let center = cutting.center(id, &find, volume.center_in_world())?;
        Some((id, Frame::new(center, &cutting.world_from_operand(id), self.axes)))
    }

    /// Nothing is selected: whatever was held is held no more, but the pointer stays ours until it is released.
    fn let_go(&mut self, grip: &Grip) {
        self.hovered = None;
        self.dragging = match (&self.dragging, grip) {
            (Dragging::No, _) | (_, Grip::Released(_)) => Dragging::No,
            _ => Dragging::Over,
        };
    }

    fn follow(
        &mut self,
        ui: &Ui,
        grip: &Grip,
        seen: &Seen,
        document: &mut Document,
        id: OperandId,
        frame: Frame,
    ) {
        match (*grip, self.dragging) {
            (Grip::Hover(at), _) => self.hovered = at.and_then(|at| frame.pick(&seen.lens, at)),
            (Grip::Pressed(at), _) => {
                self.hovered = frame.pick(&seen.lens, at);
                let cutting = &document.state().cutting;
                if let (Some(handle), Some(operand)) = (self.hovered, cutting.get(id)) {
                    let world_from_list = cutting.world_from_list_of(id);
                    let drag = Drag { handle, frame, pose: operand.pose, world_from_list, start: at };
                    self.dragging = Dragging::Yes((id, drag));
                    document.settle();
                }
            }
            (Grip::Cancelled, _) => {
                document.cancel(STEP);
                self.dragging = Dragging::Over;
            }
            (Grip::Held(at), Dragging::Yes((id, drag))) => {
                // Where the handle cannot follow, the object stays where it followed last.
                if let Some(pose) = drag.pose(&seen.lens, at, snap(ui, document)) {
                    document.edit(STEP, |state| {
                        state.cutting.set_pose(id, pose);
                    });
                }
            }
            (Grip::Released(_), _) => {
                self.dragging = Dragging::No;
                document.settle();
            }
            (Grip::Held(_), _) => {}
        }
    }

    fn color(&self, handle: Handle, axis: usize) -> Color32 {
        if self.hovered == Some(handle) {
            HIGHLIGHT
        } else if matches!(self.dragging, Dragging::Yes(_)) {
            COLORS[axis].gamma_multiply(0.35)
        } else {
            COLORS[axis]
        }
    }

    fn paint(&self, ui: &Ui, response: &Response, seen: &Seen, frame: &Frame) {
        let Some(size) = frame.point_size(&seen.lens) else { return };
        let painter = ui.painter().with_clip_rect(response.rect);
        let usable = Handle::ALL.into_iter().filter(|h| frame.is_usable(*h, &seen.lens));
        // What is picked first is painted last.
        let mut handles: Vec<Handle> = usable.collect();
        handles.sort_by_key(|handle| match handle {
            Handle::ViewRing => 0,
            Handle::Ring(_) => 1,
            Handle::Axis(_) => 2,
            Handle::Plane(_) => 3,
            Handle::ScaleAxis(_) => 4,
            Handle::Scale => 5,
        });
        for handle in handles {
            if let Some(at) = self.paint_handle(&painter, seen, frame, handle, size)
                && response.rect.contains(at)
            {
                announce(ui, response, at, &name(handle));
            }
        }
    }

    /// Where it can be grabbed; none where it is not seen.
    fn paint_handle(
        &self,
        painter: &Painter,
        seen: &Seen,
        frame: &Frame,
        handle: Handle,
        size: f64,
    ) -> Option<Pos2> {
        let at = |axis: DVec3, length: f64| seen.place(frame.center + axis * (length * size));
        match handle {
            Handle::Axis(axis) => {
                let direction = frame.axes[axis];
                let [from, to] = [lengths::ARROW_FROM, lengths::ARROW_TO].map(|l| at(direction, l));
                let (from, to, color) = (from?, to?, self.color(handle, axis));
                stroke_over(painter, vec![from, to], 2.5, color);
                painter.add(arrow_head(from, to, color));
                // Where nothing else is met first.
                let places = [0.5, 0.7, 0.9, 0.3].map(|part| from.lerp(to, part));
                let own = |at: &Pos2| frame.pick(&seen.lens, seen.point(*at)) == Some(handle);
                places.into_iter().find(own)
            }
            Handle::ScaleAxis(axis) => {
                let (place, color) =
                    (at(frame.scale_axes[axis], lengths::SCALE_BOX)?, self.color(handle, axis));
                square(painter, place, 5.0, color);
                Some(place)
            }
            Handle::Plane(axis) => {
                let corners = seen.line(&frame.square(axis, size))?;
                let color = self.color(handle, axis);
                let middle = corners[0].lerp(corners[2], 0.5);
                painter.add(Shape::convex_polygon(
                    corners,
                    color.gamma_multiply(0.45),
                    Stroke::new(1.0, color),
                ));
                Some(middle)
            }
            Handle::Ring(axis) => self.paint_ring(painter, seen, frame, handle, axis, lengths::RING * size),
            Handle::ViewRing => self.paint_ring(painter, seen, frame, handle, 3, lengths::VIEW_RING * size),
            Handle::Scale => {
                let place = seen.place(frame.center)?;
                square(painter, place, lengths::MIDDLE as f32 - 2.0, self.color(handle, 3));
                Some(place)
            }
        }
    }

    fn paint_ring(
        &self,
        painter: &Painter,
        seen: &Seen,
        frame: &Frame,
        handle: Handle,
        axis: usize,
        radius: f64,
    ) -> Option<Pos2> {
        let circle = frame.circle(frame.ring_normal(handle, &seen.lens)?, radius, 64);
        let line = seen.line(&circle)?;
        let color = self.color(handle, axis);
        // The far half is fainter, and cannot be grabbed.
        let is_near = |i: &usize| is_near_half(frame, &seen.lens, handle, circle[*i]);
        let sides: Vec<usize> = (0..circle.len() - 1).collect();
        for run in sides.chunk_by(|a, b| is_near(a) == is_near(b)) {
            let (first, last) = (run[0], run[run.len() - 1] + 1);
            let part = line[first..=last].to_vec();
            if is_near(&first) {
                stroke_over(painter, part, 2.0, color);
            } else {
                painter.line(part, Stroke::new(1.0, color.gamma_multiply(0.4)));
            }
        }
        // Rings cross each other, and all else: where this is the one that is met.
        let own = |i: &usize| frame.pick(&seen.lens, seen.point(line[*i])) == Some(handle);
        sides.into_iter().find(own).map(|i| line[i])
    }

    /// How far it was dragged, in words beside the pointer.
    fn say(&self, ui: &Ui, seen: &Seen, drag: &Drag, grip: &Grip) {
        let Grip::Held(at) = grip else { return };
        let Some(motion) = drag.motion(&seen.lens, *at, None) else { return };
        let painter = ui.painter();
        let at = seen.screen(*at + DVec2::new(16.0, 16.0));
        let font = egui::TextStyle::Small.resolve(ui.style());
        let galley = painter.layout_no_wrap(in_words(drag.handle, &motion), font, Color32::WHITE);
        let rect = egui::Rect::from_min_size(at, galley.size()).expand(3.0);
        painter.rect_filled(rect, 3.0, super::SHADOW);
        painter.galley(at, galley, Color32::WHITE);
    }
}

/// Steps, where they are asked for.
fn snap(ui: &Ui, document: &Document) -> Option<Snap> {
    let length = document.volume().lattice().spacing().min_element();
    let snap = Snap { length, angle: 15f64.to_radians(), factor: 0.1 };
    ui.input(|input| input.modifiers.command).then_some(snap)
}

fn in_words(handle: Handle, motion: &DAffine3) -> String {
    match handle {
        Handle::Axis(_) | Handle::Plane(_) => {
            let [x, y, z] = motion.translation.to_array();
            format!("{x:.1}, {y:.1}, {z:.1}")
        }
        Handle::Ring(_) | Handle::ViewRing => {
            let (_, angle) = DQuat::from_mat3(&motion.matrix3).to_axis_angle();
            let degrees = angle.to_degrees();
            format!("{:.1}°", if degrees > 180.0 { 360.0 - degrees } else { degrees })
        }
        Handle::Scale => format!("× {:.2}", motion.matrix3.x_axis.x),
        // The determinant of a stretch along one axis is its factor.
        Handle::ScaleAxis(_) => format!("× {:.2}", motion.matrix3.determinant()),
    }
}

/// What a handle is called.
fn name(handle: Handle) -> String {
    let letter = |axis: usize| ["x", "y", "z"][axis.min(2)];
    match handle {
        Handle::Axis(axis) => format!("move along {}", letter(axis)),
        Handle::Plane(axis) => format!("move across {}", letter(axis)),
        Handle::Ring(axis) => format!("turn around {}", letter(axis)),
        Handle::ViewRing => "turn in the picture".to_owned(),
        Handle::Scale => "scale all axes".to_owned(),
        Handle::ScaleAxis(axis) => format!("scale along {}", letter(axis)),
    }
}

fn arrow_head(from: Pos2, to: Pos2, color: Color32) -> Shape {
    let along = (to - from).normalized();
    let (back, side) = (to - along * 11.0, along.rot90() * 5.0);
    Shape::convex_polygon(vec![to + along * 2.0, back + side, back - side], color, Stroke::NONE)
}

fn square(painter: &Painter, at: Pos2, half: f32, color: Color32) {
    let rect = egui::Rect::from_center_size(at, egui::Vec2::splat(2.0 * half));
    painter.rect_filled(rect.expand(1.0), 1.0, super::SHADOW);
    painter.rect_filled(rect, 1.0, color);
}
