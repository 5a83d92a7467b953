use super::*;
use crate::document::{SceneState, Solids};
use cutaway_core::scene::Mode;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

struct Window {
    panel: FunctionPanel,
    document: Document,
    commands: Vec<Command>,
}

/// The panel on a ball of values 0 to 1, with a function of three points.
fn harness() -> Harness<'static, Window> {
    let volume = Arc::new(OpenVolume::read("sample:sphere:24").unwrap());
    let [lo, hi] = volume.lattice().value_range();
    let point =
        |share: f64, opacity| ControlPoint { value: lo + (hi - lo) * share, color: [share; 3], opacity };
    let mut state = SceneState::of_volume(volume.lattice());
    state.function = TransferFunction::new(vec![point(0.1, 0.0), point(0.5, 0.5), point(0.9, 1.0)]).unwrap();
    let document = Document::new(volume, state, Solids::default(), None);
    let window = Window { panel: FunctionPanel::default(), document, commands: Vec::new() };
    // As the application does: a released pointer ends a step.
    let show = |ui: &mut Ui, w: &mut Window| {
        w.panel.show(ui, &mut w.document, &mut w.commands);
        if ui.input(|i| i.pointer.any_released()) {
            w.document.settle();
        }
    };
    let mut harness = Harness::builder().with_size([420.0, 900.0]).build_ui_state(show, window);
    harness.run();
    harness
}

fn points(harness: &Harness<'_, Window>) -> Vec<ControlPoint> {
    harness.state().document.state().function.points().to_vec()
}

/// Where the plot shows a point.
fn place(harness: &Harness<'_, Window>, index: usize) -> Pos2 {
    let rect = harness.get_by_label("Plot of the transfer function").rect();
    let rect = egui::Rect::from_min_max(rect.min, pos2(rect.right(), rect.bottom() - 18.0)).shrink(6.0);
    let document = &harness.state().document;
    let function = &document.state().function;
    let values = crate::function::fit(document.volume().lattice().value_range(), function);
    let plot = crate::function::Plot { rect, values, opacities: Opacities::Root };
    let point = function.points()[index];
    plot.at(point.value, point.opacity)
}

fn click(harness: &mut Harness<'_, Window>, at: Pos2, button: PointerButton, modifiers: Modifiers) {
    harness.hover_at(at);
    for pressed in [true, false] {
        harness.event_modifiers(Event::PointerButton { pos: at, button, pressed, modifiers }, modifiers);
    }
    harness.run();
}

fn drag(harness: &mut Harness<'_, Window>, from: Pos2, by: Vec2) {
    harness.hover_at(from);
    harness.run();
    harness.drag_at(from);
    harness.run();
    for share in [0.3, 0.6, 1.0] {
        harness.hover_at(from + by * share);
        harness.run();
    }
    harness.drop_at(from + by);
    harness.run();
}

#[test]
fn a_dragged_point_follows_the_pointer_in_one_step() {
    let mut harness = harness();
    let before = points(&harness);
    let at = place(&harness, 1);
    drag(&mut harness, at, vec2(-40.0, 30.0));
    let after = points(&harness);
    assert!(after[1].value < before[1].value && after[1].opacity < before[1].opacity, "{after:?}");
    assert_eq!((after[0], after[2]), (before[0], before[2]));
    let moved = place(&harness, 1);
    assert!((moved - (at + vec2(-40.0, 30.0))).length() < 1.5, "{moved} {at}");
    assert!(harness.state_mut().document.undo());
    assert_eq!(points(&harness), before);
    assert!(!harness.state_mut().document.undo(), "the drag was one step");
}

#[test]
fn points_are_added_and_removed() {
    let mut harness = harness();
    let before = points(&harness);
    let middle = place(&harness, 0).lerp(place(&harness, 1), 0.5) - vec2(0.0, 60.0);
    click(&mut harness, middle, PointerButton::Primary, Modifiers::CTRL);
    assert_eq!(points(&harness).len(), 4);
    // The new one is selected, and Delete removes it.
    harness.key_press(Key::Delete);
    harness.run();
    assert_eq!(points(&harness), before);
    let at = place(&harness, 2);
    click(&mut harness, at, PointerButton::Secondary, Modifiers::NONE);
    assert_eq!(points(&harness), before[..2]);
    // All at once: the harness lets a quarter of a second pass from event to event.
    for pressed in [true, false, true, false] {
        let (pos, button, modifiers) = (middle, PointerButton::Primary, Modifiers::NONE);
        harness.input_mut().events.push(Event::PointerButton { pos, button, pressed, modifiers });
    }
    harness.run();
    assert_eq!(points(&harness).len(), 3, "a double click adds one");
}

#[test]
fn the_selected_point_has_numbers_and_keys() {
    let mut harness = harness();
    let at = place(&harness, 1);
    click(&mut harness, at, PointerButton::Primary, Modifiers::NONE);
    harness.get_by_label("Value");
    harness.get_by_label("Colour of the point");
    let before = points(&harness)[1];
    harness.key_press(Key::ArrowRight);
    harness.key_press(Key::ArrowUp);
    harness.run();
    let after = points(&harness)[1];
    assert!(after.value > before.value && after.opacity > before.opacity);
    harness.get_by_label("Opacity").set_value_accesskit(0.125);
    harness.run();
    assert_eq!(points(&harness)[1].opacity, 0.125);
    harness.get_by_label("Remove point").click();
    harness.run();
    assert_eq!(points(&harness).len(), 2);
}

#[test]
fn window_brightness_and_unit_are_set_by_numbers() {
    let mut harness = harness();
    harness.get_by_label("Window").set_value_accesskit(0.25);
    harness.run();
    let [lo, hi] = crate::function::window(&harness.state().document.state().function);
    assert!((hi - lo - 0.25).abs() < 1e-9, "{lo} {hi}");
    harness.get_by_label("Level").set_value_accesskit(3.0);
    harness.run();
    let [lo, hi] = crate::function::window(&harness.state().document.state().function);
    assert!((0.5 * (lo + hi) - 3.0).abs() < 1e-9 && (hi - lo - 0.25).abs() < 1e-9, "{lo} {hi}");
    harness.get_by_label("Unit distance").click();
    harness.run();
    assert!(harness.state().document.state().unit_distance.is_some());
    harness.get_by_role_and_label(Role::Slider, "Brightness").set_value_accesskit(2.0);
    harness.run();
    assert_eq!(harness.state().document.state().settings.brightness, 2.0);
}

#[test]
fn shift_drags_the_whole_function() {
    let mut harness = harness();
    let before = points(&harness);
    let rect = harness.get_by_label("Plot of the transfer function").rect();
    harness.event(Event::ModifiersChanged(Modifiers::SHIFT));
    harness.hover_at(rect.center());
    harness.event(Event::PointerButton {
        pos: rect.center(),
        button: PointerButton::Primary,
        pressed: true,
        modifiers: Modifiers::SHIFT,
    });
    harness.run();
    harness.hover_at(rect.center() + vec2(50.0, 0.0));
    harness.run();
    harness.drop_at(rect.center() + vec2(50.0, 0.0));
    harness.run();
    let after = points(&harness);
    let by = after[0].value - before[0].value;
    assert!(by > 0.0);
    assert!(
        before
            .iter()
            .zip(&after)
            .all(|(a, b)| (b.value - a.value - by).abs() < 1e-6 && a.opacity == b.opacity)
    );
}

#[test]
fn presets_and_maps_are_found_and_taken() {
    let mut harness = harness();
    harness.get_by_label("Presets").click();
    harness.run_steps(30);
    harness.get_by_label("Search presets").click();
    harness.run_steps(3);
    harness.get_by_label("Search presets").type_text("mr-mip");
    harness.run_steps(3);
    harness.get_by_label("MR-MIP").click();
    harness.run_steps(3);
    let state = harness.state().document.state().clone();
    assert_eq!(state.settings.mode, Mode::Mip);
    assert!(harness.state_mut().document.undo());
    assert_eq!(harness.state().document.state().settings.mode, Mode::Composite);
    harness.get_by_label("Presets").click();
    harness.run_steps(30);
    harness.get_by_label("Colour maps").click();
    harness.run_steps(30);
    harness.get_by_label("Reversed").click();
    harness.run_steps(3);
    harness.get_by_label("gray_r").click();
    harness.run_steps(3);
    let after = points(&harness);
    assert_eq!((after[0].color, after[after.len() - 1].color), ([1.0; 3], [0.0; 3]));
}

#[test]
fn files_are_asked_for() {
    let mut harness = harness();
    harness.get_by_label("Open function...").click();
    harness.get_by_label("Save function...").click();
    harness.run();
    let asked = [Purpose::OpenFunction, Purpose::SaveFunction].map(Command::PickFile);
    assert_eq!(harness.state().commands, asked);
}

#[test]
fn the_wheel_zooms_and_fit_shows_all_again() {
    let mut harness = harness();
    let rect = harness.get_by_label("Plot of the transfer function").rect();
    let at = place(&harness, 1);
    harness.hover_at(rect.center());
    harness.run();
    assert!(harness.state().panel.takes_wheel());
    harness.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 200.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    harness.run_steps(60);
    // The point is elsewhere now: where it was, nothing is to be dragged.
    harness.get_by_label("Fit").click();
    harness.run_steps(3);
    drag(&mut harness, at, vec2(10.0, 0.0));
    assert!((place(&harness, 1) - at).x > 8.0);
}
