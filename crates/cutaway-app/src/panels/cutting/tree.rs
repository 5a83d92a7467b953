//! The list of operations, with the lists within it.

use egui::{Button, DragAndDrop, Key, Rect, Response, RichText, Sense, Stroke, Ui};

use crate::cutting::edit::{GroupKind, Place};
use crate::cutting::{Content, Cutting, Operand, OperandId, Operation};
use crate::document::Document;

/// How far a list in a list is moved to the right, in points.
const INDENT: f32 = 16.0;

/// The tree: what it shows is the document's, but for a name while it is typed.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    renaming: Option<(OperandId, String)>,
}

/// What is done to the list after it is shown.
#[derive(Clone, Debug, PartialEq)]
enum Action {
    Select(OperandId),
    Show(OperandId, bool),
    Solo(OperandId),
    Operation(OperandId, Operation),
    Kind(OperandId, GroupKind),
    Rename(OperandId, String),
    Remove(OperandId),
    Duplicate(OperandId),
    Enclose(OperandId),
    Move(OperandId, Place),
}

impl Tree {
    pub(super) fn show(&mut self, ui: &mut Ui, document: &mut Document) {
        let cutting = document.state().cutting.clone();
        let mut rows = Rows { tree: self, document, cutting: &cutting, actions: Vec::new() };
        if cutting.operands.is_empty() {
            ui.label(RichText::new("Nothing is cut.").weak());
        }
        rows.list(ui, None, &cutting.operands, 0);
        rows.end(ui);
        for action in rows.actions {
            apply(document, action);
        }
    }
}

fn apply(document: &mut Document, action: Action) {
    let selected = document.selected;
    match action {
        Action::Select(id) => document.selected = Some(id),
        Action::Show(id, visible) => {
            document.cut("show operand", |c| c.get_mut(id).map(|o| o.visible = visible));
        }
        Action::Solo(id) => {
            document.cut("solo operand", |c| c.toggle_solo(id));
        }
        Action::Operation(id, operation) => {
            document.cut("set operation", |c| c.get_mut(id).map(|o| o.operation = operation));
        }
        Action::Kind(id, kind) => {
            document.cut("set group", |c| c.get_mut(id).map(|o| o.set_group_kind(kind)));
        }
        Action::Rename(id, name) => {
            document.cut("rename operand", |c| c.get_mut(id).map(|o| o.name = name));
        }
        Action::Remove(id) => {
            document.cut("remove operand", |c| c.remove(id));
        }
        Action::Duplicate(id) => {
            let copy = document.cut("duplicate operand", |c| c.duplicate(id));
            document.selected = copy.flatten().or(selected);
        }
        Action::Enclose(id) => {
            document.cut("group operand", |c| c.enclose(id));
        }
        Action::Move(id, place) => {
            document.cut("move in list", |c| c.move_to(id, place));
        }
    }
}

/// What rows are shown of, and what they ask for.
struct Rows<'a> {
    tree: &'a mut Tree,
    document: &'a Document,
    cutting: &'a Cutting,
    actions: Vec<Action>,
}

impl Rows<'_> {
    fn list(&mut self, ui: &mut Ui, list: Option<OperandId>, operands: &[Operand], depth: usize) {
        for (index, operand) in operands.iter().enumerate() {
            let place = Place { list, index };
            let is_first_of_group = list.is_some() && index == 0;
            let row = ui.horizontal(|ui| {
                ui.add_space(depth as f32 * INDENT);
                self.row(ui, operand, is_first_of_group);
            });
            self.drop_on(ui, &row.response, operand, place);
            if let Content::Group(inner) = &operand.content {
                self.list(ui, Some(operand.id), inner, depth + 1);
            }
        }
    }

    fn row(&mut self, ui: &mut Ui, operand: &Operand, is_first_of_group: bool) {
        let (id, name) = (operand.id, &operand.name);
        let grip = grip(ui).accessible_name(format!("drag {name}"));
        grip.dnd_set_drag_payload(id);
        let mut visible = operand.visible;
        let shown = ui.checkbox(&mut visible, "").accessible_name(format!("show {name}"));
        if shown.on_hover_text("Whether it has an effect").changed() {
            self.actions.push(Action::Show(id, visible));
        }
        self.operation(ui, operand, is_first_of_group);
        self.name(ui, operand);
        let solo = ui.selectable_label(self.cutting.solo == Some(id), "S");
        let solo = solo.accessible_name(format!("solo {name}"));
        if solo.on_hover_text("Only this has an effect").clicked() {
            self.actions.push(Action::Solo(id));
        }
        let remove = ui.add(Button::new("×").frame(false)).accessible_name(format!("delete {name}"));
        if remove.on_hover_text("Delete").clicked() {
            self.actions.push(Action::Remove(id));
        }
    }

    /// What it does: a word to click on; the first of a group is taken whatever it does.
    fn operation(&mut self, ui: &mut Ui, operand: &Operand, is_first_of_group: bool) {
        let label = format!("operation of {}", operand.name);
        ui.add_enabled_ui(!is_first_of_group, |ui| {
            let word = if is_first_of_group { "first" } else { operand.operation.name() };
            let combo = egui::ComboBox::from_id_salt(("operation", operand.id)).width(58.0);
            let shown = combo.selected_text(word).show_ui(ui, |ui| {
                for operation in Operation::ALL {
                    let chosen = operation == operand.operation;
                    if ui.selectable_label(chosen, operation.name()).clicked() {
                        self.actions.push(Action::Operation(operand.id, operation));
                    }
                }
            });
            shown.response.accessible_name(label);
        });
    }

    fn name(&mut self, ui: &mut Ui, operand: &Operand) {
        if let Some((id, text)) = &mut self.tree.renaming
            && *id == operand.id
        {
            let edit = ui.add(egui::TextEdit::singleline(text).desired_width(110.0));
            let edit = edit.accessible_name("new name");
            if edit.lost_focus() {
                let text = text.trim().to_owned();
                if !text.is_empty() && !ui.input(|i| i.key_pressed(Key::Escape)) {
                    self.actions.push(Action::Rename(operand.id, text));
                }
                self.tree.renaming = None;
            } else {
                edit.request_focus();
            }
            return;
        }
        let selected = self.document.selected == Some(operand.id);
        let name = ui.add(
            Button::selectable(selected, text_of(operand, self.document)).sense(Sense::click_and_drag()),
        );
        let name = name.accessible_name(operand.name.as_str());
        name.dnd_set_drag_payload(operand.id);
        if name.clicked() {
            self.actions.push(Action::Select(operand.id));
        }
        let pressed = |key| name.has_focus() && ui.input(|input| input.key_pressed(key));
        if name.double_clicked() || pressed(Key::F2) {
            self.rename(operand);
        }
        if pressed(Key::Delete) {
            self.actions.push(Action::Remove(operand.id));
        }
        name.context_menu(|ui| self.menu(ui, operand));
    }

    fn rename(&mut self, operand: &Operand) {
        self.tree.renaming = Some((operand.id, operand.name.clone()));
    }

    fn menu(&mut self, ui: &mut Ui, operand: &Operand) {
        let id = operand.id;
        if ui.button("Rename").clicked() {
            self.rename(operand);
        }
        if ui.button("Duplicate").clicked() {
            self.actions.push(Action::Duplicate(id));
        }
        if ui.button("Put into a new group").clicked() {
            self.actions.push(Action::Enclose(id));
        }
        if let Some(place) = self.cutting.place(id) {
            if place.index > 0 && ui.button("Move up").clicked() {
                self.actions.push(Action::Move(id, Place { index: place.index - 1, ..place }));
            }
            if ui.button("Move down").clicked() {
                self.actions.push(Action::Move(id, Place { index: place.index + 2, ..place }));
            }
            if let Some(group) = place.list
                && ui.button("Move out of the group").clicked()
                && let Some(outer) = self.cutting.place(group)
            {
                self.actions.push(Action::Move(id, Place { index: outer.index + 1, ..outer }));
            }
        }
        if let Some(kind) = operand.group_kind() {
            ui.separator();
            for other in GroupKind::ALL {
                if ui.radio(kind == other, other.name()).clicked() {
                    self.actions.push(Action::Kind(id, other));
                }
            }
        }
        ui.separator();
        if ui.button("Delete").clicked() {
            self.actions.push(Action::Remove(id));
        }
    }

    /// An operand is dragged over a row: it goes before it, behind it, or into it.
    fn drop_on(&mut self, ui: &Ui, row: &Response, operand: &Operand, place: Place) {
        let Some(dragged) = DragAndDrop::payload::<OperandId>(ui.ctx()) else { return };
        let rect = Rect::from_x_y_ranges(ui.max_rect().x_range(), row.rect.y_range());
        let Some(at) = ui.input(|i| i.pointer.interact_pos()).filter(|at| rect.contains(*at)) else { return };
        let down = (at.y - rect.top()) / rect.height().max(1.0);
        let is_group = matches!(operand.content, Content::Group(_));
        let (to, line) = match (is_group, down) {
            (true, 0.3..) => (Place { list: Some(operand.id), index: usize::MAX }, None),
            (true, _) | (false, ..0.5) => (place, Some(rect.top())),
            (false, _) => (Place { index: place.index + 1, ..place }, Some(rect.bottom())),
        };
        self.drop_to(ui, *dragged, to, rect, line);
    }

    /// Below the last row: the end of the outermost list.
    fn end(&mut self, ui: &mut Ui) {
        let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), 8.0), Sense::hover());
        let Some(dragged) = DragAndDrop::payload::<OperandId>(ui.ctx()) else { return };
        if ui.input(|i| i.pointer.interact_pos()).is_some_and(|at| rect.contains(at)) {
            self.drop_to(ui, *dragged, Place::END, rect, Some(rect.top()));
        }
    }

    fn drop_to(&mut self, ui: &Ui, dragged: OperandId, to: Place, rect: Rect, line: Option<f32>) {
        let stroke = Stroke::new(2.0, ui.visuals().selection.stroke.color);
        match line {
            Some(y) => ui.painter().hline(rect.x_range(), y, stroke),
            None => ui.painter().rect_stroke(rect, 2.0, stroke, egui::StrokeKind::Inside),
        };
        if ui.input(|i| i.pointer.any_released()) {
            DragAndDrop::clear_payload(ui.ctx());
            self.actions.push(Action::Move(dragged, to));
        }
    }
}

/// Six dots to take hold of a row by.
fn grip(ui: &mut Ui) -> Response {
    let (rect, response) = ui.allocate_exact_size(egui::vec2(10.0, 16.0), Sense::drag());
    let color = ui.style().interact(&response).fg_stroke.color;
    for (x, y) in (0..6).map(|i| (i % 2, i / 2)) {
        let at = egui::vec2(x as f32 - 0.5, y as f32 - 1.0) * 4.0;
        ui.painter().circle_filled(rect.center() + at, 1.0, color);
    }
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, "drag"));
    response.on_hover_cursor(egui::CursorIcon::Grab)
}

/// The name, and what there is to say of it.
fn text_of(operand: &Operand, document: &Document) -> RichText {
    let mut text = operand.name.clone();
    if let Content::Object(source) = &operand.content
        && document.solids.get(source).is_none()
    {
        text += " (not read yet)";
    }
    if let Some(kind) = operand.group_kind() {
        text = format!("{text}: {}", kind.name());
    }
    let text = RichText::new(text);
    if operand.visible { text } else { text.weak() }
}
