//! What cuts: a tree of operations, the numbers of the selected one, the crop box, and what cut surfaces look like.

mod fields;
mod look;
mod numbers;
#[cfg(test)]
mod tests;
mod tree;

use egui::Ui;

use crate::command::{Command, Purpose};
use crate::cutting::Content;
use crate::cutting::defaults::Shape;
use crate::document::Document;
use crate::words::capitalised;

use fields::Fields;
use tree::Tree;

/// The panel.
#[derive(Clone, Debug, Default)]
pub struct CuttingPanel {
    tree: Tree,
    fields: Fields,
}

impl CuttingPanel {
    /// Shows it and does what it is told to.
    pub fn show(&mut self, ui: &mut Ui, document: &mut Document, commands: &mut Vec<Command>) {
        // Whatever was selected may be undone, or another scene open.
        let cutting = &document.state().cutting;
        document.selected = document.selected.filter(|id| cutting.get(*id).is_some());
        add_row(ui, document, commands);
        self.tree.show(ui, document);
        if let Some(id) = document.selected {
            ui.separator();
            self.fields.show(ui, document, id, commands);
        }
        ui.separator();
        look::crop(ui, document);
        ui.separator();
        look::surfaces(ui, document);
    }
}

fn add_row(ui: &mut Ui, document: &mut Document, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Add");
        let mesh = ui.button("Mesh…").accessible_name("add mesh or patches");
        if mesh.on_hover_text("A triangle mesh or spline patches, from a file").clicked() {
            commands.push(Command::PickFile(Purpose::AddSolid));
        }
        for shape in Shape::ALL {
            let button = ui.button(capitalised(shape.name()));
            let button = button.accessible_name(format!("add {}", shape.name()));
            if button.clicked()
                && let Err(error) = document.add_shape(shape)
            {
                commands.push(Command::Report(error));
            }
        }
        let group = ui.button("Group").accessible_name("add group");
        if group.on_hover_text("A list of its own, whose outcome is one operand").clicked() {
            document.add_operand(Content::Group(Vec::new()));
        }
    });
}
