//! The selected operand in numbers.

use cutaway_core::clip::{AxisBox, LARGEST_COORDINATE, Plane, Pose, Sphere};
use cutaway_io::scene_file::ClipSource;
use egui::{Grid, Ui};

use super::numbers::Numbers;
use crate::command::Command;
use crate::cutting::edit::GroupKind;
use crate::cutting::numbers::PoseNumbers;
use crate::cutting::{Content, OperandId};
use crate::document::Document;

/// The numbers as they were typed, as long as the pose is what they made of it: angles that say the same are many.
#[derive(Clone, Debug, Default)]
pub(super) struct Fields {
    typed: Option<(OperandId, PoseNumbers, Pose)>,
}

impl Fields {
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        document: &mut Document,
        id: OperandId,
        commands: &mut Vec<Command>,
    ) {
        let Some(operand) = document.state().cutting.get(id).cloned() else { return };
        ui.strong(operand.name.as_str());
        Grid::new("operand numbers").num_columns(4).show(ui, |ui| {
            self.pose(ui, document, id, &operand.pose);
            if let Content::Object(source) = &operand.content {
                shape(ui, document, id, source);
            }
        });
        if let Some(kind) = operand.group_kind() {
            group(ui, document, id, kind);
        }
        ui.horizontal(|ui| {
            let fit = ui.button("Fit").accessible_name("fit to the volume");
            if fit.on_hover_text("Into the middle of the volume, as large as it can be there").clicked() {
                match document.fit_operand(id) {
                    Ok(true) => {}
                    Ok(false) => commands.push(Command::Report(format!(
                        "{}: there is nothing to fit yet; wait until its file is read",
                        operand.name
                    ))),
                    Err(error) => commands.push(Command::Report(format!("{}: {error}", operand.name))),
                }
            }
            let moved = operand.pose != Pose::IDENTITY;
            let reset = ui.add_enabled(moved, egui::Button::new("Reset pose"));
            if reset.on_hover_text("As its file or its numbers have it").clicked() {
                document.reset_pose(id);
            }
        });
    }

    fn pose(&mut self, ui: &mut Ui, document: &mut Document, id: OperandId, pose: &Pose) {
        let known = self.typed.filter(|(of, _, made)| *of == id && made == pose);
        let before = known.map_or_else(|| PoseNumbers::new(pose), |(_, numbers, _)| numbers);
        let mut numbers = before;
        let step = 0.25 * document.volume().lattice().spacing().min_element();
        let length = Numbers { range: -LARGEST_COORDINATE..=LARGEST_COORDINATE, ..Numbers::any(step) };
        ui.label("Move");
        let moved = length.three(ui, "translation", &mut numbers.translation);
        ui.end_row();
        ui.label("Turn");
        let degrees = Numbers { suffix: "°", range: -3600.0..=3600.0, ..Numbers::any(0.5) };
        let turned = degrees.three(ui, "rotation", &mut numbers.rotation);
        ui.end_row();
        ui.label("Scale");
        let factor = Numbers { range: -1e6..=1e6, ..Numbers::any(0.01) };
        let scaled = factor.three(ui, "scale", &mut numbers.scale);
        if before.is_sheared() {
            ui.label("leaning").on_hover_text("Its axes are not at right angles: that stays as it is");
        }
        ui.end_row();
        // A factor that is dragged through 0 mirrors; at 0 there would be nothing.
        let passes_zero = (0..3).any(|axis| numbers.scale[axis] == 0.0);
        if !(moved || turned || scaled) || passes_zero {
            return;
        }
        let made = if moved { numbers.pose() } else { around_center(document, id, pose, numbers) };
        if let Some(made) = made {
            document.edit("pose in numbers", |state| {
                state.cutting.set_pose(id, made);
            });
            let numbers = PoseNumbers { translation: made.world_from_object().translation, ..numbers };
            self.typed = Some((id, numbers, made));
        }
    }
}

/// Turned and scaled about its middle, as the gizmo does.
fn around_center(document: &Document, id: OperandId, before: &Pose, numbers: PoseNumbers) -> Option<Pose> {
    let cutting = &document.state().cutting;
    let find = |source: &_| document.solids.get(source);
    let center = cutting.center(id, &find, document.volume().lattice().center_in_world())?;
    let pivot = cutting.world_from_operand(id).inverse().transform_point3(center);
    numbers.around(pivot, before)
}

fn shape(ui: &mut Ui, document: &mut Document, id: OperandId, source: &ClipSource) {
    let step = 0.25 * document.volume().lattice().spacing().min_element();
    let length = Numbers { range: -LARGEST_COORDINATE..=LARGEST_COORDINATE, ..Numbers::any(step) };
    let positive = Numbers { range: 0.0..=LARGEST_COORDINATE, ..Numbers::any(step) };
    let changed = match source {
        ClipSource::Sphere(shape) => {
            let (mut center, mut radius) = (shape.center(), shape.radius());
            ui.label("Centre");
            let mut changed = length.three(ui, "centre", &mut center);
            ui.end_row();
            ui.label("Radius");
            changed |= positive.one(ui, "radius", &mut radius);
            ui.end_row();
            changed.then(|| Sphere::new(center, radius).map(ClipSource::Sphere))
        }
        ClipSource::Box(shape) => {
            let (mut min, mut max) = (shape.min(), shape.max());
            ui.label("From");
            let mut changed = length.three(ui, "corner from", &mut min);
            ui.end_row();
            ui.label("To");
            changed |= length.three(ui, "corner to", &mut max);
            ui.end_row();
            changed.then(|| AxisBox::new(min, max).map(ClipSource::Box))
        }
        ClipSource::Plane(shape) => {
            let (mut normal, mut distance) = (shape.normal(), shape.distance());
            ui.label("Normal");
            let mut changed = Numbers::any(0.01).three(ui, "normal", &mut normal);
            ui.end_row();
            ui.label("Distance");
            changed |= length.one(ui, "distance", &mut distance);
            ui.end_row();
            changed.then(|| Plane::new(normal, distance).map(ClipSource::Plane))
        }
        ClipSource::Patches { path, tolerance } => {
            let mut within = tolerance.unwrap_or(0.0);
            ui.label("Tolerance")
                .on_hover_text("How far triangles may be from the patches; 0: what suits them");
            let changed = positive.one(ui, "tolerance", &mut within);
            ui.end_row();
            let tolerance = Some(within).filter(|within| *within > 0.0);
            changed.then(|| Ok(ClipSource::Patches { path: path.clone(), tolerance }))
        }
        ClipSource::Mesh { path, .. } => {
            ui.label("File");
            ui.add(egui::Label::new(path.as_str()).truncate());
            ui.end_row();
            None
        }
    };
    // Numbers that make no shape are not taken; the field shows what there is.
    if let Some(Ok(source)) = changed {
        document.edit("shape in numbers", |state| {
            if let Some(operand) = state.cutting.get_mut(id) {
                operand.content = Content::Object(source);
            }
        });
    }
}

fn group(ui: &mut Ui, document: &mut Document, id: OperandId, kind: GroupKind) {
    ui.horizontal(|ui| {
        ui.label("Together");
        for other in GroupKind::ALL {
            if ui.radio(kind == other, other.name()).clicked() {
                document.cut("set group", |c| c.get_mut(id).map(|o| o.set_group_kind(other)));
            }
        }
    });
}
