use std::sync::Arc;

use super::*;
use crate::document::{OpenVolume, SceneState, Solids};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

struct Window {
    panel: LightPanel,
    document: Document,
    commands: Vec<Command>,
}

fn harness() -> Harness<'static, Window> {
    let volume = Arc::new(OpenVolume::read("sample:sphere:24").unwrap());
    let state = SceneState::of_volume(volume.lattice());
    let document = Document::new(volume, state, Solids::default(), None);
    let window = Window { panel: LightPanel::default(), document, commands: Vec::new() };
    let show = |ui: &mut Ui, w: &mut Window| w.panel.show(ui, &mut w.document, &mut w.commands);
    let mut harness = Harness::builder().with_size([420.0, 700.0]).build_ui_state(show, window);
    harness.run();
    harness
}

fn choose(harness: &mut Harness<'_, Window>, combo: &str, choice: &str) {
    harness.get_by_label(combo).click();
    harness.run();
    harness.get_by_label(choice).click();
    harness.run();
}

#[test]
fn isosurfaces_have_a_value_from_the_start_and_more_can_be_added() {
    let mut harness = harness();
    choose(&mut harness, "Mode", "Isosurfaces");
    let [lo, hi] = harness.state().document.volume().lattice().value_range();
    let settings = |h: &Harness<'_, Window>| h.state().document.state().settings.clone();
    assert_eq!((settings(&harness).mode, settings(&harness).iso.len()), (Mode::Iso, 1));
    assert!((lo..=hi).contains(&settings(&harness).iso[0]));
    harness.get_by_label("Add isovalue").click();
    harness.run();
    assert_eq!(settings(&harness).iso.len(), 2);
    harness.get_by_label("Remove isovalue 1").click();
    harness.run();
    assert_eq!(settings(&harness).iso.len(), 1);
    // Each was a step: the surface, its mode.
    let document = &mut harness.state_mut().document;
    (0..3).for_each(|_| assert!(document.undo()));
    assert_eq!(document.state().settings, RenderSettings::default());
    assert!(!document.undo());
}

#[test]
fn every_state_of_the_panel_is_a_scene() {
    let mut harness = harness();
    for mode in ["Isosurfaces", "Maximum", "Minimum", "Mean", "Composite"] {
        choose(&mut harness, "Mode", mode);
        let document = &harness.state().document;
        document.state().scene(&document.volume().data, None, [8, 8]).unwrap();
    }
    harness.get_by_label("Sampling").click();
    harness.run();
    harness.state_mut().document.edit("x", |s| s.settings.adaptive_threshold = Some(0.1));
    harness.get_by_label("Pre-integration").click();
    harness.get_by_label("Jitter").click();
    harness.run();
    choose(&mut harness, "Gradient", "Sobel");
    let document = &harness.state().document;
    let settings = &document.state().settings;
    assert!(settings.pre_integration && settings.jitter && settings.gradient == Gradient::Sobel);
    document.state().scene(&document.volume().data, None, [8, 8]).unwrap();
}

#[test]
fn light_is_moved_on_the_sphere_and_falls_off_as_chosen() {
    let mut harness = harness();
    choose(&mut harness, "Falloff", "Wrapped");
    harness.get_by_role_and_label(egui::accesskit::Role::Slider, "Wrap power");
    harness.get_by_label("Headlight").click();
    harness.run();
    let sphere = harness.get_by_label("Direction of the light").rect();
    let right = sphere.center() + egui::vec2(20.0, 0.0);
    harness.drag_at(sphere.center());
    harness.run();
    harness.hover_at(right);
    harness.run();
    harness.drop_at(right);
    harness.run();
    let document = &harness.state().document;
    let lighting = &document.state().lighting;
    assert_eq!(lighting.diffuse_curve, DiffuseCurve::Wrapped);
    let view = direction::in_view(&document.state().camera.axes(), lighting.light.unwrap());
    assert!((view.x - 20.0 / 33.0).abs() < 0.05 && view.y.abs() < 0.05 && view.z > 0.5, "{view}");
    harness.get_by_label("Headlight").click();
    harness.run();
    assert_eq!(harness.state().document.state().lighting.light, None);
    harness.get_by_label("Shade").click();
    harness.run();
    assert!(!harness.state().document.state().lighting.shade);
}
