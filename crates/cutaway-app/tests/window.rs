//! The whole window, without one: egui runs headless, clicks and keys come from here.

use std::path::Path;
use std::time::{Duration, Instant};

use cutaway_app::command::{Command, Purpose};
use cutaway_app::cutting::Content;
use cutaway_app::function;
use cutaway_app::picture::Projection;
use cutaway_app::render::engines::Engines;
use cutaway_app::render::{DebugView, Pixels, Request};
use cutaway_app::{App, Start};
use cutaway_core::clip::Sphere;
use cutaway_core::glam::DVec3;
use cutaway_core::scene::Mode;
use cutaway_io::scene_file::ClipSource;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

/// How long a picture may take to be complete on a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(120);

const SIZE: Vec2 = Vec2::new(900.0, 600.0);

fn window(open: Option<&str>) -> Harness<'static, Option<App>> {
    let start = Start { open: open.map(str::to_owned), ..Start::default() };
    let show = move |ui: &mut egui::Ui, app: &mut Option<App>| {
        app.get_or_insert_with(|| App::new(ui.ctx(), &start).without_dialogs()).show(ui);
    };
    let mut harness = Harness::builder().with_size(SIZE).with_max_steps(4).build_ui_state(show, None);
    settle(&mut harness);
    harness
}

fn app<'h>(harness: &'h Harness<'_, Option<App>>) -> &'h App {
    harness.state().as_ref().expect("drawn at least once")
}

fn app_mut<'h>(harness: &'h mut Harness<'_, Option<App>>) -> &'h mut App {
    harness.state_mut().as_mut().expect("drawn at least once")
}

/// Waits until nothing is under way.
fn settle(harness: &mut Harness<'_, Option<App>>) {
    let began = Instant::now();
    // Two frames: the first may ask for what the second waits for.
    for _ in 0..2 {
        harness.step();
        while !app(harness).is_idle() {
            assert!(began.elapsed() < PATIENCE, "still at work: {:?}", app(harness).errors());
            std::thread::sleep(Duration::from_millis(5));
            harness.step();
        }
    }
}

/// What is open, as a picture.
fn picture(app: &App) -> Pixels {
    let document = app.document().expect("something is open");
    let request = Request {
        volume: document.volume().clone(),
        state: document.state().clone(),
        clip: document.clip(),
        size: [67, 45],
        debug: DebugView::Off,
    };
    Pixels::of(&Engines::default().still(&request, &|_| {}).expect("it can be rendered"))
}

fn visible(pixels: &Pixels) -> usize {
    pixels.rgba.chunks(4).filter(|p| p[3] > 127).count()
}

#[test]
fn the_first_start_shows_the_sample_with_a_cut_in_it() {
    let harness = window(None);
    let app = app(&harness);
    assert_eq!(app.errors(), &[] as &[String]);
    let document = app.document().unwrap();
    assert_eq!(document.volume().name(), "sample:mr-head");
    assert_eq!(document.state().cutting.operands.len(), 1);
    assert!(document.clip().is_some());
    assert!(visible(&picture(app)) > 500, "{}", visible(&picture(app)));
}

#[test]
fn what_cannot_be_opened_is_said_in_the_window_and_dismissed() {
    let mut harness = window(Some("/nowhere/at/all.nrrd"));
    let errors = app(&harness).errors();
    assert!(errors.len() == 1 && errors[0].contains("/nowhere/at/all.nrrd"), "{errors:?}");
    harness.get_by_label("Dismiss").click();
    harness.step();
    harness.step();
    assert!(app(&harness).errors().is_empty());
}

#[test]
fn dragging_turns_the_camera_and_scrolling_zooms() {
    let mut harness = window(Some("sample:sphere:24"));
    let before = app(&harness).document().unwrap().state().camera.clone();
    let at = Pos2::new(200.0, 300.0);
    harness.event(Event::PointerMoved(at));
    button(&harness, at, true);
    harness.step();
    harness.event(Event::PointerMoved(at + Vec2::new(60.0, 10.0)));
    harness.step();
    button(&harness, at + Vec2::new(60.0, 10.0), false);
    settle(&mut harness);
    let turned = app(&harness).document().unwrap().state().camera.clone();
    assert!(turned.position != before.position && turned.focal_point == before.focal_point);
    let scroll = Vec2::new(0.0, 50.0);
    harness.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: scroll,
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    settle(&mut harness);
    let zoomed = &app(&harness).document().unwrap().state().camera;
    let distance = |c: &cutaway_core::camera::Camera| {
        c.position.iter().zip(c.focal_point).map(|(p, f)| (p - f) * (p - f)).sum::<f64>()
    };
    assert!(distance(zoomed) < distance(&turned));
    assert!(!app(&harness).document().unwrap().history().can_undo(), "a view is no edit");
}

#[test]
fn keys_look_from_the_sides_and_undo() {
    let mut harness = window(Some("sample:sphere:24"));
    harness.key_press(Key::Num1);
    settle(&mut harness);
    let front = app(&harness).document().unwrap().state().camera.axes().forward;
    assert!((front.y - 1.0).abs() < 1e-9, "{front}");
    let brighter = |state: &mut cutaway_app::document::SceneState| state.settings.brightness = 2.0;
    app_mut(&mut harness).document_mut().unwrap().edit("brightness", brighter);
    settle(&mut harness);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut harness);
    assert_eq!(app(&harness).document().unwrap().state().settings.brightness, 1.0);
    harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut harness);
    assert_eq!(app(&harness).document().unwrap().state().settings.brightness, 2.0);
}

#[test]
fn a_saved_scene_opens_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    let mut harness = window(None);
    app_mut(&mut harness).document_mut().unwrap().look(|camera| camera.azimuth(0.7));
    app_mut(&mut harness).document_mut().unwrap().edit("light", |state| state.lighting.ambient = 0.4);
    app_mut(&mut harness).ask(Command::UseFile(Purpose::SaveScene, path.clone()));
    settle(&mut harness);
    assert_eq!(app(&harness).errors(), &[] as &[String]);
    assert!(!app(&harness).document().unwrap().is_changed());
    let (state, before) = (app(&harness).document().unwrap().state().clone(), picture(app(&harness)));
    let again = window(path.to_str());
    assert_eq!(app(&again).errors(), &[] as &[String]);
    assert_eq!(app(&again).document().unwrap().state(), &state);
    assert_eq!(picture(app(&again)), before);
}

#[test]
fn pictures_and_films_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let (still, film) = (folder.path().join("a.png"), folder.path().join("b.gif"));
    let mut harness = window(Some("sample:sphere:16"));
    app_mut(&mut harness).export_size([64, 48], 3);
    app_mut(&mut harness).ask(Command::UseFile(Purpose::SaveImage, still.clone()));
    app_mut(&mut harness).ask(Command::UseFile(Purpose::SaveFilm, film.clone()));
    settle(&mut harness);
    assert_eq!(app(&harness).errors(), &[] as &[String]);
    let image = cutaway_io::image::read_image(&still).unwrap();
    assert_eq!((image.width(), image.height()), (64, 48));
    assert!(std::fs::read(&film).unwrap().starts_with(b"GIF89a"));
    app_mut(&mut harness).ask(Command::UseFile(Purpose::SaveImage, Path::new("/nowhere/at/all.png").into()));
    settle(&mut harness);
    assert!(app(&harness).errors()[0].contains("/nowhere/at/all.png"), "{:?}", app(&harness).errors());
}

#[test]
fn slices_share_a_crosshair_and_show_values() {
    let mut harness = window(Some("sample:sphere:24"));
    harness.key_press(Key::T);
    settle(&mut harness);
    let slice = harness.get_by_label("xy slice").rect();
    let before = app(&harness).slices().crosshair;
    click(&mut harness, slice.center() + Vec2::new(15.0, 5.0));
    settle(&mut harness);
    let after = app(&harness).slices().crosshair;
    assert!(after.is_some() && after != before);
    assert!(app(&harness).slices().hover.is_some());
}

/// Where the picture shows a point of the world.
fn place(harness: &Harness<'_, Option<App>>, point: DVec3) -> Pos2 {
    let rect = harness.get_by_label("picture of the volume").rect();
    let camera = &app(harness).document().unwrap().state().camera;
    Projection::new(camera, rect).point(point).expect("it is before the eye")
}

#[test]
fn a_click_selects_the_cut_that_is_seen_and_no_other() {
    let mut harness = window(Some("sample:sphere:24"));
    let document = app_mut(&mut harness).document_mut().unwrap();
    let volume = document.volume().lattice().clone();
    let (center, forward) = (volume.center_in_world(), document.state().camera.axes().forward);
    let radius = 0.2 * volume.extent().min_element() * volume.spacing().min_element();
    let ball = |center| Content::Object(ClipSource::Sphere(Sphere::new(center, radius).unwrap()));
    // The second lies within what is opaque, behind the first.
    let seen = document.add_operand(ball(center - forward * (2.0 * radius))).unwrap();
    let hidden = document.add_operand(ball(center + forward * (1.2 * radius))).unwrap();
    document.edit("opaque", |state| state.settings.brightness = 10.0);
    document.selected = None;
    settle(&mut harness);
    let selected = |harness: &Harness<'_, Option<App>>| app(harness).document().unwrap().selected;
    let at = place(&harness, center);
    click(&mut harness, at);
    assert_eq!(selected(&harness), Some(seen));
    // Beside the volume is nothing, and what was selected stays so.
    let corner = harness.get_by_label("picture of the volume").rect().left_top() + Vec2::splat(5.0);
    click(&mut harness, corner);
    assert_eq!(selected(&harness), Some(seen));
    assert!(app(&harness).slices().crosshair.is_none());
    let document = app_mut(&mut harness).document_mut().unwrap();
    document.selected = None;
    document.cut("hide", |cutting| cutting.get_mut(seen).unwrap().visible = false);
    settle(&mut harness);
    click(&mut harness, at);
    assert_eq!(selected(&harness), None, "{hidden:?} is behind what is opaque");
    // No projection hides it.
    let document = app_mut(&mut harness).document_mut().unwrap();
    document.edit("mode", |state| state.settings.mode = Mode::Mip);
    settle(&mut harness);
    click(&mut harness, at);
    assert_eq!(selected(&harness), Some(hidden));
}

#[test]
fn clicks_that_measure_select_nothing() {
    let mut harness = window(None);
    app_mut(&mut harness).document_mut().unwrap().selected = None;
    harness.key_press(Key::M);
    settle(&mut harness);
    let center = app(&harness).document().unwrap().volume().lattice().center_in_world();
    let at = place(&harness, center);
    click(&mut harness, at);
    assert_eq!(app(&harness).slices().measure.points().count(), 1);
    assert_eq!(app(&harness).document().unwrap().selected, None);
}

#[test]
fn a_right_drag_is_window_and_level_in_one_step() {
    let mut harness = window(Some("sample:sphere:24"));
    let state = |harness: &Harness<'_, Option<App>>| app(harness).document().unwrap().state().clone();
    let before = state(&harness);
    let picture = harness.get_by_label("picture of the volume").rect();
    let mut at = picture.center();
    harness.event(Event::PointerMoved(at));
    harness.step();
    press(&harness, at, PointerButton::Secondary, true);
    harness.step();
    for _ in 0..4 {
        at += Vec2::new(0.05, -0.025) * picture.height();
        harness.event(Event::PointerMoved(at));
        harness.step();
    }
    press(&harness, at, PointerButton::Secondary, false);
    settle(&mut harness);
    let after = state(&harness);
    let ([lo, hi], [low, high]) = (function::window(&before.function), function::window(&after.function));
    // A fifth of the picture's height to the right; a tenth up, of windows that grew meanwhile.
    let wider = (high - low) / (hi - lo);
    assert!((wider / 0.2f64.exp() - 1.0).abs() < 1e-3, "{wider}");
    let higher = (0.5 * (low + high) - 0.5 * (lo + hi)) / (hi - lo);
    assert!((0.1..0.1 * wider).contains(&higher), "{higher}");
    assert_eq!((&after.camera, &after.cutting), (&before.camera, &before.cutting));
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut harness);
    assert_eq!(state(&harness), before);
}

fn press(harness: &Harness<'_, Option<App>>, pos: Pos2, button: PointerButton, pressed: bool) {
    harness.event(Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE });
}

fn button(harness: &Harness<'_, Option<App>>, pos: Pos2, pressed: bool) {
    press(harness, pos, PointerButton::Primary, pressed);
}

fn click(harness: &mut Harness<'_, Option<App>>, at: Pos2) {
    harness.event(Event::PointerMoved(at));
    harness.step();
    button(harness, at, true);
    harness.step();
    button(harness, at, false);
    harness.step();
}

/// A generator that needs no crate: Knuth's constants.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % sides
    }

    fn point(&mut self) -> Pos2 {
        Pos2::new(self.roll(SIZE.x as u64) as f32, self.roll(SIZE.y as u64) as f32)
    }
}

/// Clicks, drags, scrolls and keys wherever they fall: nothing panics, and what is open can be rendered afterwards.
#[test]
fn a_monkey_breaks_nothing() {
    const ACTIONS: usize = 5000;
    let seed = std::env::var("CUTAWAY_MONKEY").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    let mut dice = Dice(seed);
    let mut harness = window(Some("sample:sphere:12"));
    let keys = [
        Key::T,
        Key::M,
        Key::R,
        Key::O,
        Key::B,
        Key::C,
        Key::Num1,
        Key::Num3,
        Key::Num5,
        Key::PageUp,
        Key::PageDown,
        Key::Escape,
        Key::Tab,
        Key::Enter,
        Key::Space,
        Key::Delete,
        Key::Questionmark,
        Key::ArrowDown,
        Key::ArrowUp,
    ];
    let mut held = None;
    for _ in 0..ACTIONS {
        let at = dice.point();
        let modifiers = match dice.roll(8) {
            0 => Modifiers::SHIFT,
            1 => Modifiers::COMMAND,
            2 => Modifiers::ALT,
            _ => Modifiers::NONE,
        };
        match dice.roll(10) {
            0..=3 => harness.event(Event::PointerMoved(at)),
            4 | 5 => {
                let buttons = [
                    PointerButton::Primary,
                    PointerButton::Primary,
                    PointerButton::Secondary,
                    PointerButton::Middle,
                ];
                let (button, pressed) = match held.take() {
                    Some(button) => (button, false),
                    None => (buttons[dice.roll(4) as usize], true),
                };
                held = pressed.then_some(button);
                harness.event(Event::PointerButton { pos: at, button, pressed, modifiers });
            }
            6 => {
                let delta = Vec2::new(dice.roll(200) as f32 - 100.0, dice.roll(200) as f32 - 100.0);
                let (unit, phase) = (egui::MouseWheelUnit::Point, egui::TouchPhase::Move);
                let source = egui::MouseWheelSource::Unknown;
                harness.event(Event::MouseWheel { unit, delta, phase, source, modifiers });
            }
            7 => harness.event(Event::Text(["1", "-", "e9", "x", "0.5"][dice.roll(5) as usize].to_owned())),
            8 => harness.key_press_modifiers(modifiers, [Key::Z, Key::Y][dice.roll(2) as usize]),
            _ => harness.key_press_modifiers(modifiers, keys[dice.roll(keys.len() as u64) as usize]),
        }
        harness.step();
        let document = app(&harness).document().expect("it stays open");
        let size = [8, 8];
        document
            .state()
            .scene(&document.volume().data, document.clip().as_ref(), size)
            .expect("every number is sane");
    }
}
