use cutaway_core::clip::{Pose, Sphere};
use cutaway_core::glam::DVec3;
use cutaway_io::scene_file::ClipSource;
use egui::{Key, Modifiers, Pos2, Sense, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::cutting::{Content, CropBox, OperandId};
use crate::document::Document;
use crate::testing::document;

/// The picture with all its handles.
struct Picture {
    document: Document,
    handles: Handles,
    /// Whether any of them had the pointer, frame by frame.
    held: Vec<bool>,
}

impl Picture {
    fn show(&mut self, ui: &mut Ui) {
        let (rect, response) = ui.allocate_exact_size(vec2(640.0, 480.0), Sense::click_and_drag());
        let camera = self.document.state().camera.clone();
        let projection = Projection::new(&camera, rect);
        let (ui, document) = (ui, &mut self.document);
        let held = self.handles.show(ui, &response, &projection, document);
        self.held.push(held);
    }

    fn pose(&self) -> Pose {
        self.document.state().cutting.operands[0].pose
    }
}

/// Looks along y.
fn from_the_front(document: &mut Document) {
    let center = document.volume().lattice().center_in_world();
    document.look(|camera| {
        camera.focal_point = center.to_array();
        camera.position = (center - DVec3::Y * 80.0).to_array();
        camera.view_up = DVec3::Z.to_array();
    });
}

fn harness(document: Document) -> Harness<'static, Picture> {
    let picture = Picture { document, handles: Handles::default(), held: Vec::new() };
    let builder = Harness::builder().with_size(vec2(700.0, 520.0));
    builder.build_ui_state(|ui, picture: &mut Picture| picture.show(ui), picture)
}

/// A ball in the middle of the volume, selected.
fn with_ball() -> (Harness<'static, Picture>, OperandId) {
    let mut document = document();
    let center = document.volume().lattice().center_in_world();
    let ball = Content::Object(ClipSource::Sphere(Sphere::new(center, 3.0).unwrap()));
    let id = document.add_operand(ball).unwrap();
    (harness(document), id)
}

fn place(harness: &Harness<'_, Picture>, handle: &str) -> Pos2 {
    harness.get_by_label(handle).rect().center()
}

/// Presses on a handle, and goes on by so much.
fn drag(harness: &mut Harness<'_, Picture>, from: Pos2, by: egui::Vec2) {
    harness.hover_at(from);
    harness.run();
    harness.drag_at(from);
    harness.run();
    for part in 1..=4 {
        harness.hover_at(from + by * (part as f32 / 4.0));
        harness.run();
    }
}

fn release(harness: &mut Harness<'_, Picture>, at: Pos2) {
    harness.drop_at(at);
    harness.run();
}

#[test]
fn every_handle_has_a_name() {
    let (mut harness, _) = with_ball();
    from_the_front(&mut harness.state_mut().document);
    harness.run();
    for name in ["scale all axes", "turn in the picture", "turn around x", "turn around y", "turn around z"] {
        assert!(harness.query_by_label(name).is_some(), "{name}");
    }
    // Seen from the front, the axis that is seen end on has no arrow.
    let arrows = ["x", "y", "z"].map(|axis| harness.query_by_label(&format!("move along {axis}")).is_some());
    assert_eq!(arrows.iter().filter(|there| **there).count(), 2, "{arrows:?}");
}

#[test]
fn dragging_an_arrow_moves_the_object_and_undo_brings_it_back() {
    let (mut harness, _) = with_ball();
    harness.run();
    let from = place(&harness, "move along z");
    let before = harness.state().document.state().clone();
    drag(&mut harness, from, vec2(15.0, -60.0));
    let moved = harness.state().pose().world_from_object().translation;
    assert!(moved.z > 1.0 && moved.x.abs() < 1e-9 && moved.y.abs() < 1e-9, "{moved}");
    assert_eq!(harness.state().held.last(), Some(&true));
    release(&mut harness, from + vec2(15.0, -60.0));
    assert_eq!(harness.state().held.last(), Some(&false));
    // The arrow went along with the pointer.
    let now = place(&harness, "move along z");
    assert!((now - from - vec2(0.0, -60.0)).length() < 6.0, "{from} to {now}");
    // Another drag is another step.
    drag(&mut harness, now, vec2(0.0, 20.0));
    release(&mut harness, now + vec2(0.0, 20.0));
    let document = &mut harness.state_mut().document;
    assert!(document.undo());
    assert_eq!(document.state().cutting.operands[0].pose.world_from_object().translation, moved);
    assert!(document.undo());
    assert_eq!(document.state(), &before);
    assert!(document.redo());
    assert_eq!(harness.state().pose().world_from_object().translation, moved);
}

#[test]
fn turning_and_scaling_keep_the_middle() {
    for (handle, by) in [("turn in the picture", vec2(40.0, 90.0)), ("scale all axes", vec2(42.0, 0.0))] {
        let (mut harness, _) = with_ball();
        harness.run();
        let from = place(&harness, handle);
        drag(&mut harness, from, by);
        release(&mut harness, from + by);
        let pose = harness.state().pose();
        assert_ne!(pose, Pose::IDENTITY, "{handle}");
        let center = harness.state().document.volume().lattice().center_in_world();
        let there = pose.world_from_object().transform_point3(center);
        assert!(there.distance(center) < 1e-9, "{handle}: {there}");
        let factor = pose.world_from_object().matrix3.determinant();
        let expected = if handle.starts_with("turn") { 1.0 } else { 2f64.powf(1.5) };
        assert!((factor - expected).abs() < 1e-6, "{handle}: {factor}");
    }
}

#[test]
fn escape_takes_a_drag_back_and_leaves_no_step() {
    let (mut harness, _) = with_ball();
    harness.run();
    harness.state_mut().document.settle();
    let from = place(&harness, "move along z");
    let before = harness.state().document.state().clone();
    drag(&mut harness, from, vec2(0.0, -60.0));
    assert_ne!(harness.state().document.state(), &before);
    harness.key_press(Key::Escape);
    harness.run();
    assert_eq!(harness.state().document.state(), &before);
    assert_eq!(harness.state().held.last(), Some(&true), "the camera must not take over");
    harness.hover_at(from + vec2(50.0, 50.0));
    harness.run();
    assert_eq!(harness.state().document.state(), &before);
    release(&mut harness, from);
    assert_eq!(harness.state().held.last(), Some(&false));
    let document = &mut harness.state_mut().document;
    assert!(!document.history().can_redo());
    document.undo();
    assert_eq!(document.state().cutting.operands.len(), 0, "the step before is that which added the ball");
}

#[test]
fn ctrl_goes_in_steps_of_a_voxel() {
    let (mut harness, _) = with_ball();
    harness.run();
    let from = place(&harness, "move along z");
    harness.event(egui::Event::ModifiersChanged(Modifiers::COMMAND));
    drag(&mut harness, from, vec2(0.0, -61.0));
    let moved = harness.state().pose().world_from_object().translation;
    assert!(moved.z >= 1.0 && (moved.z - moved.z.round()).abs() < 1e-9, "{moved}");
}

#[test]
fn what_is_not_on_a_handle_is_the_cameras() {
    let (mut harness, _) = with_ball();
    harness.run();
    let before = harness.state().document.state().clone();
    drag(&mut harness, Pos2::new(30.0, 30.0), vec2(100.0, 100.0));
    release(&mut harness, Pos2::new(130.0, 130.0));
    assert!(harness.state().held.iter().all(|held| !held));
    assert_eq!(harness.state().document.state(), &before);
    // Nor does anything happen where nothing is selected.
    harness.state_mut().document.selected = None;
    harness.run();
    assert!(harness.query_by_label("scale all axes").is_none());
}

#[test]
fn an_operand_that_goes_while_it_is_dragged_is_let_go() {
    let (mut harness, id) = with_ball();
    harness.run();
    let from = place(&harness, "move along z");
    drag(&mut harness, from, vec2(0.0, -30.0));
    harness.state_mut().document.cut("remove", |cutting| cutting.remove(id));
    harness.hover_at(from);
    harness.run();
    assert_eq!(harness.state().held.last(), Some(&true));
    release(&mut harness, from);
    assert_eq!(harness.state().held.last(), Some(&false));
}

#[test]
fn faces_of_the_crop_box_are_dragged() {
    let mut document = document();
    let whole = CropBox::whole(document.volume().lattice());
    document.cut("crop", |cutting| cutting.crop = Some(whole));
    from_the_front(&mut document);
    let mut harness = harness(document);
    harness.run();
    // The view is along one axis: its faces have no handles.
    let names: Vec<String> = ["x", "y", "z"].map(|axis| format!("crop {axis} max")).to_vec();
    let there = names.iter().filter(|name| harness.query_by_label(name).is_some()).count();
    assert_eq!(there, 2);
    let from = place(&harness, "crop z max");
    drag(&mut harness, from, vec2(5.0, 80.0));
    release(&mut harness, from + vec2(5.0, 80.0));
    let crop = harness.state().document.state().cutting.crop.unwrap();
    assert!(crop.max.z < whole.max.z - 1.0 && crop.max.z > LEFT, "{crop:?}");
    assert_eq!((crop.min, crop.max.x, crop.max.y), (whole.min, whole.max.x, whole.max.y));
    // Escape takes it back.
    let from = place(&harness, "crop z max");
    drag(&mut harness, from, vec2(0.0, 40.0));
    harness.key_press(Key::Escape);
    harness.run();
    assert_eq!(harness.state().document.state().cutting.crop, Some(crop));
    release(&mut harness, from);
    harness.state_mut().document.undo();
    assert_eq!(harness.state().document.state().cutting.crop, Some(whole));
}

const LEFT: f64 = 1.0;

#[test]
fn a_rectangle_trims_and_is_off_again() {
    let mut harness = harness(document());
    harness.run();
    let (from, to) = (Pos2::new(320.0, 200.0), Pos2::new(400.0, 300.0));
    drag(&mut harness, from, to - from);
    release(&mut harness, to);
    assert_eq!(harness.state().document.state().cutting.crop, None, "it was not on");
    harness.state_mut().handles.rectangle.on = true;
    drag(&mut harness, from, to - from);
    assert_eq!(harness.state().held.last(), Some(&true));
    release(&mut harness, to);
    let crop = harness.state().document.state().cutting.crop.unwrap();
    let whole = CropBox::whole(harness.state().document.volume().lattice());
    let trimmed =
        DVec3::select(crop.min.cmpne(whole.min) | crop.max.cmpne(whole.max), DVec3::ONE, DVec3::ZERO);
    assert_eq!(trimmed.element_sum(), 2.0, "{crop:?}: all but the axis of the view");
    assert!(!harness.state().handles.rectangle.on);
    harness.state_mut().document.undo();
    assert_eq!(harness.state().document.state().cutting.crop, None);
    // Escape while it is drawn.
    harness.state_mut().handles.rectangle.on = true;
    drag(&mut harness, from, to - from);
    harness.key_press(Key::Escape);
    harness.run();
    release(&mut harness, to);
    assert_eq!(harness.state().document.state().cutting.crop, None);
    assert!(!harness.state().handles.rectangle.on);
}
