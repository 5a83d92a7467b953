use cutaway_core::clip::{Impregnation, Pose};
use cutaway_core::glam::DVec3;
use cutaway_io::scene_file::ClipSource;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

use super::*;
use crate::cutting::edit::GroupKind;
use crate::cutting::{CropBox, Operation};
use crate::testing::document;

struct Window {
    document: Document,
    panel: CuttingPanel,
    commands: Vec<Command>,
}

fn harness() -> Harness<'static, Window> {
    let window = Window { document: document(), panel: CuttingPanel::default(), commands: Vec::new() };
    let builder = Harness::builder().with_size(egui::vec2(420.0, 800.0));
    builder.build_ui_state(
        |ui, window: &mut Window| window.panel.show(ui, &mut window.document, &mut window.commands),
        window,
    )
}

fn click(harness: &mut Harness<'_, Window>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

/// Clicks on what is in a menu or a list that is open.
fn choose(harness: &mut Harness<'_, Window>, text: &str) {
    click(harness, text);
}

fn set(harness: &mut Harness<'_, Window>, label: &str, value: f64) {
    harness.get_by_label(label).set_value_accesskit(value);
    harness.run();
    harness.state_mut().document.settle();
}

/// The name in a row of the tree; the heading of the numbers has it, too.
fn row_of<'h>(harness: &'h Harness<'_, Window>, name: &'h str) -> egui_kittest::Node<'h> {
    harness.get_by_role_and_label(egui::accesskit::Role::Button, name)
}

fn operands<'a>(harness: &'a Harness<'_, Window>) -> &'a [crate::cutting::Operand] {
    &harness.state().document.state().cutting.operands
}

fn names(harness: &Harness<'_, Window>) -> Vec<String> {
    operands(harness).iter().map(|o| o.name.clone()).collect()
}

#[test]
fn shapes_are_added_selected_and_taken_away_again() {
    let mut harness = harness();
    for shape in ["add sphere", "add box", "add plane", "add group"] {
        click(&mut harness, shape);
    }
    assert_eq!(names(&harness), ["sphere", "box", "plane", "group"]);
    let last = operands(&harness)[3].id;
    assert_eq!(harness.state().document.selected, Some(last));
    // Into the group that is selected.
    click(&mut harness, "add sphere");
    let inner = &operands(&harness)[3].operands()[0];
    assert_eq!((inner.name.as_str(), inner.operation), ("sphere 2", Operation::Union));
    click(&mut harness, "delete box");
    assert_eq!(names(&harness), ["sphere", "plane", "group"]);
    assert!(harness.state_mut().document.undo());
    harness.run();
    assert_eq!(names(&harness), ["sphere", "box", "plane", "group"]);
    for _ in 0..5 {
        assert!(harness.state_mut().document.undo());
        harness.run();
    }
    assert!(operands(&harness).is_empty() && harness.state().document.selected.is_none());
}

#[test]
fn a_mesh_is_asked_for() {
    let mut harness = harness();
    click(&mut harness, "add mesh or patches");
    assert_eq!(harness.state().commands, [Command::PickFile(Purpose::AddSolid)]);
}

#[test]
fn what_an_operand_does_is_chosen() {
    let mut harness = harness();
    click(&mut harness, "add sphere");
    click(&mut harness, "operation of sphere");
    choose(&mut harness, "keep");
    assert_eq!(operands(&harness)[0].operation, Operation::Keep);
    click(&mut harness, "show sphere");
    assert!(!operands(&harness)[0].visible);
    click(&mut harness, "show sphere");
    assert!(operands(&harness)[0].visible);
    click(&mut harness, "solo sphere");
    assert_eq!(harness.state().document.state().cutting.solo, Some(operands(&harness)[0].id));
    click(&mut harness, "solo sphere");
    assert_eq!(harness.state().document.state().cutting.solo, None);
}

#[test]
fn menus_rename_duplicate_group_and_move() {
    let mut harness = harness();
    click(&mut harness, "add sphere");
    let menu = |harness: &mut Harness<'_, Window>, row: &str, entry: &str| {
        row_of(harness, row).click_secondary();
        harness.run();
        choose(harness, entry);
    };
    menu(&mut harness, "sphere", "Duplicate");
    assert_eq!(names(&harness), ["sphere", "sphere 2"]);
    menu(&mut harness, "sphere", "Rename");
    let field = harness.get_by_label("new name");
    field.set_text_value_accesskit("hole");
    harness.run();
    harness.key_press(egui::Key::Enter);
    harness.run();
    assert_eq!(names(&harness), ["hole", "sphere 2"]);
    menu(&mut harness, "hole", "Move down");
    assert_eq!(names(&harness), ["sphere 2", "hole"]);
    menu(&mut harness, "hole", "Put into a new group");
    assert_eq!(names(&harness), ["sphere 2", "group"]);
    assert_eq!(operands(&harness)[1].operands()[0].name, "hole");
    menu(&mut harness, "group", "intersection");
    assert_eq!(operands(&harness)[1].group_kind(), Some(GroupKind::Intersection));
    menu(&mut harness, "hole", "Move out of the group");
    assert_eq!(names(&harness), ["sphere 2", "group", "hole"]);
    menu(&mut harness, "group", "Delete");
    assert_eq!(names(&harness), ["sphere 2", "hole"]);
}

#[test]
fn rows_are_dragged_to_other_places_and_into_groups() {
    let mut harness = harness();
    for shape in ["add sphere", "add box", "add plane"] {
        click(&mut harness, shape);
    }
    let row = |harness: &Harness<'_, Window>, name: &str| row_of(harness, name).rect();
    let drag = |harness: &mut Harness<'_, Window>, from: egui::Pos2, to: egui::Pos2| {
        harness.drag_at(from);
        harness.run();
        harness.hover_at(from.lerp(to, 0.5));
        harness.run();
        harness.hover_at(to);
        harness.run();
        harness.drop_at(to);
        harness.run();
    };
    let (from, to) =
        (harness.get_by_label("drag plane").rect().center(), row(&harness, "sphere").center_top());
    drag(&mut harness, from, to);
    assert_eq!(names(&harness), ["plane", "sphere", "box"]);
    let (from, to) =
        (harness.get_by_label("drag plane").rect().center(), row(&harness, "sphere").center_bottom());
    drag(&mut harness, from, to);
    assert_eq!(names(&harness), ["sphere", "plane", "box"]);
    // Once more by its name, into a group.
    harness.state_mut().document.selected = None;
    click(&mut harness, "add group");
    let (from, to) = (row(&harness, "sphere").center(), row(&harness, "group").center());
    drag(&mut harness, from, to);
    assert_eq!(names(&harness), ["plane", "box", "group"]);
    assert_eq!(operands(&harness)[2].operands()[0].name, "sphere");
    harness.state_mut().document.undo();
    harness.run();
    assert_eq!(names(&harness), ["sphere", "plane", "box", "group"]);
}

#[test]
fn numbers_pose_and_shape_the_selected_one() {
    let mut harness = harness();
    click(&mut harness, "add box");
    let center = |harness: &Harness<'_, Window>| {
        let document = &harness.state().document;
        let id = document.selected.unwrap();
        let find = |source: &_| document.solids.get(source);
        document.state().cutting.center(id, &find, DVec3::ZERO).unwrap()
    };
    let before = center(&harness);
    set(&mut harness, "rotation z", 30.0);
    set(&mut harness, "rotation y", 100.0);
    set(&mut harness, "scale x", 2.0);
    assert!(center(&harness).distance(before) < 1e-9, "it turns about its middle");
    // What was typed is what is shown, though other angles say the same.
    let shown = harness.get_by_label("rotation y").accesskit_node().numeric_value();
    assert_eq!(shown, Some(100.0));
    let moved = operands(&harness)[0].pose.world_from_object().translation;
    set(&mut harness, "translation x", moved.x + 5.0);
    assert!(center(&harness).distance(before + DVec3::X * 5.0) < 1e-9);
    set(&mut harness, "scale x", 0.0);
    assert!(operands(&harness)[0].pose.object_from_world().is_finite());
    set(&mut harness, "corner from x", -50.0);
    let Content::Object(ClipSource::Box(shape)) = &operands(&harness)[0].content else { panic!("no box") };
    assert_eq!(shape.min().x, -50.0);
    // Not to where it would be no box.
    set(&mut harness, "corner from x", 1e6);
    let Content::Object(ClipSource::Box(shape)) = &operands(&harness)[0].content else { panic!("no box") };
    assert_eq!(shape.min().x, -50.0);
    click(&mut harness, "fit to the volume");
    let volume = harness.state().document.volume().clone();
    assert!(center(&harness).distance(volume.lattice().center_in_world()) < 1e-9);
    click(&mut harness, "Reset pose");
    assert_eq!(operands(&harness)[0].pose, Pose::IDENTITY);
    assert!(harness.state().commands.is_empty());
    click(&mut harness, "add plane");
    click(&mut harness, "fit to the volume");
    assert!(matches!(&harness.state().commands[..], [Command::Report(text)] if text.contains("no size")));
}

#[test]
fn a_mesh_that_is_not_read_yet_says_so() {
    let mut harness = harness();
    let source =
        ClipSource::Mesh { path: "/data/bunny.ply".to_owned(), space: cutaway_io::mesh::MeshSpace::File };
    harness.state_mut().document.add_solid(source.clone());
    harness.run();
    assert_eq!(names(&harness), ["bunny.ply"]);
    assert!(harness.state().document.clip().is_none(), "what is not there cuts nothing");
    click(&mut harness, "fit to the volume");
    assert!(matches!(&harness.state().commands[..], [Command::Report(text)] if text.contains("bunny.ply")));
    let ball = cutaway_core::clip::Sphere::new(DVec3::ZERO, 1.0).unwrap();
    harness.state_mut().document.solids.insert(&source, std::sync::Arc::new(ball));
    assert!(harness.state().document.clip().is_some());
}

#[test]
fn the_crop_box_is_turned_on_and_trimmed_by_numbers() {
    let mut harness = harness();
    let whole = CropBox::whole(harness.state().document.volume().lattice());
    click(&mut harness, "Crop box");
    assert_eq!(harness.state().document.state().cutting.crop, Some(whole));
    set(&mut harness, "crop from x", 5.0);
    set(&mut harness, "crop to x", 2.0);
    let crop = harness.state().document.state().cutting.crop.unwrap();
    assert_eq!((crop.min.x, crop.max.x), (5.0, 6.0), "it keeps a voxel");
    click(&mut harness, "reset crop box");
    assert_eq!(harness.state().document.state().cutting.crop, Some(whole));
    click(&mut harness, "Crop box");
    assert_eq!(harness.state().document.state().cutting.crop, None);
}

#[test]
fn cut_surfaces_are_set() {
    let mut harness = harness();
    set(&mut harness, "Thickness", 7.0);
    let slider = harness.get_by_role_and_label(egui::accesskit::Role::Slider, "Surface opacity");
    slider.set_value_accesskit(0.5);
    harness.run();
    click(&mut harness, "Close cut isosurfaces");
    click(&mut harness, "Light below cuts");
    choose(&mut harness, "step");
    let shading = &harness.state().document.state().cutting.shading;
    assert_eq!((shading.thickness, shading.overlay, shading.cap), (7.0, 0.5, true));
    assert_eq!(shading.impregnation, Impregnation::Step);
}
