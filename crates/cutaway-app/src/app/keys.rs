//! Keys, and the list of them.

use egui::{Context, Key, KeyboardShortcut, Modifiers};

use super::App;
use crate::command::{Command, Purpose};
use cutaway_core::defaults::{Look, default_view};

use crate::picture::navigation::{self, StandardView};
use crate::render::DebugView;

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

const fn plain(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

/// What keys do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Action {
    Open,
    Save,
    SaveAs,
    Undo,
    Redo,
    SaveImage,
    CopyCommandLine,
    Reset,
    Orthographic,
    Forward,
    Back,
    Fetches,
    Wireframe,
    Box,
    Cube,
    Slices,
    Measure,
    View(StandardView),
    Help,
}

/// Keys with what they do, as the list shows them; the more modifiers, the earlier.
const KEYS: &[(KeyboardShortcut, Action, &str)] = &[
    (KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z), Action::Redo, "redo"),
    (
        KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
        Action::SaveAs,
        "save the scene as",
    ),
    (
        KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::C),
        Action::CopyCommandLine,
        "copy the command line",
    ),
    (ctrl(Key::Z), Action::Undo, "undo"),
    (ctrl(Key::Y), Action::Redo, "redo"),
    (ctrl(Key::O), Action::Open, "open a volume or a scene"),
    (ctrl(Key::S), Action::Save, "save the scene"),
    (ctrl(Key::P), Action::SaveImage, "save a picture"),
    (plain(Key::R), Action::Reset, "see the whole volume"),
    (plain(Key::O), Action::Orthographic, "orthographic or perspective"),
    (plain(Key::PageUp), Action::Forward, "fly forward, into the volume"),
    (plain(Key::PageDown), Action::Back, "fly back"),
    (plain(Key::F), Action::Fetches, "fetch counts of the GPU ray caster"),
    (plain(Key::W), Action::Wireframe, "wireframe of the proxy geometry"),
    (plain(Key::B), Action::Box, "bounding box"),
    (plain(Key::C), Action::Cube, "orientation cube"),
    (plain(Key::T), Action::Slices, "three slices beside the picture"),
    (plain(Key::M), Action::Measure, "measure between two clicks"),
    (plain(Key::Num1), Action::View(StandardView::Anterior), "from the front"),
    (plain(Key::Num2), Action::View(StandardView::Posterior), "from the back"),
    (plain(Key::Num3), Action::View(StandardView::Left), "from the left"),
    (plain(Key::Num4), Action::View(StandardView::Right), "from the right"),
    (plain(Key::Num5), Action::View(StandardView::Superior), "from above"),
    (plain(Key::Num6), Action::View(StandardView::Inferior), "from below"),
    (plain(Key::Questionmark), Action::Help, "this list"),
];

impl App {
    /// Does what keys say, unless somebody types.
    pub(super) fn keys(&mut self, context: &Context) {
        // Not where anything has the keyboard: undo belongs to whoever has just dragged a point of the plot.
        if context.text_edit_focused() {
            return;
        }
        for (shortcut, action, _) in KEYS {
            if context.input_mut(|i| i.consume_shortcut(shortcut)) {
                self.act(*action);
            }
        }
        // A question mark needs shift on most keyboards.
        let shifted = KeyboardShortcut::new(Modifiers::SHIFT, Key::Questionmark);
        if context.input_mut(|i| i.consume_shortcut(&shifted)) {
            self.act(Action::Help);
        }
    }

    fn act(&mut self, action: Action) {
        match action {
            Action::Open => self.ask(Command::PickFile(Purpose::Open)),
            Action::Save => self.ask(Command::Save),
            Action::SaveAs => self.ask(Command::PickFile(Purpose::SaveScene)),
            Action::SaveImage => self.ask(Command::PickFile(Purpose::SaveImage)),
            Action::CopyCommandLine => self.ask(Command::CopyCommandLine),
            Action::Help => self.show_help = !self.show_help,
            Action::Fetches => self.toggle_debug(DebugView::Fetches),
            Action::Wireframe => self.toggle_debug(DebugView::Wireframe),
            Action::Box => self.picture.overlays.bounding_box ^= true,
            Action::Cube => self.picture.overlays.orientation_cube ^= true,
            Action::Slices => self.panels.toggle_slices(),
            Action::Measure => self.panels.slices.measuring ^= true,
            Action::Reset => self.reset_view(),
            Action::View(view) => self.look_from(view),
            Action::Undo | Action::Redo | Action::Orthographic | Action::Forward | Action::Back => {
                let Some(document) = &mut self.document else { return };
                match action {
                    Action::Undo => _ = document.undo(),
                    Action::Redo => _ = document.redo(),
                    Action::Orthographic => document.look(navigation::toggle_orthographic),
                    Action::Forward => document.look(|camera| navigation::fly(camera, 0.1)),
                    _ => document.look(|camera| navigation::fly(camera, -0.1)),
                }
            }
        }
    }

    /// Shows the engine's work, or the picture again.
    pub(super) fn toggle_debug(&mut self, view: DebugView) {
        self.debug = if self.debug == view { DebugView::Off } else { view };
    }

    /// Shows what is visible of the volume as it is first seen.
    pub(super) fn reset_view(&mut self) {
        let aspect = self.aspect();
        if let Some(document) = &mut self.document {
            let data = &document.volume().data;
            let Ok(scene) = document.state().scene(data, document.clip().as_ref(), [1, 1]) else { return };
            let camera = default_view(&Look::of(&scene), None, aspect).camera;
            document.look(|c| *c = camera);
        }
    }

    /// Shows the whole volume from a side.
    pub(super) fn look_from(&mut self, view: StandardView) {
        let aspect = self.aspect();
        if let Some(document) = &mut self.document {
            let camera = view.camera(document.volume().lattice(), aspect, &document.state().camera);
            document.look(|c| *c = camera);
        }
    }

    /// Width over height of the picture.
    fn aspect(&self) -> f64 {
        self.asked.as_ref().map_or(1.0, |a| f64::from(a.size[0]) / f64::from(a.size[1]))
    }
}

/// The list of keys and of what the pointer does.
pub(super) fn show_help(context: &Context, open: &mut bool) {
    const POINTER: &[(&str, &str)] = &[
        ("drag", "turn the camera about its focal point"),
        ("shift and drag, middle drag", "move"),
        ("ctrl and drag", "roll"),
        ("right drag", "window and level"),
        ("click on a cut", "select what cuts there"),
        ("scroll, pinch", "zoom to the pointer"),
        ("alt and scroll", "fly into the volume"),
    ];
    egui::Window::new("Keys and pointer").open(open).collapsible(false).show(context, |ui| {
        egui::Grid::new("keys").striped(true).num_columns(2).show(ui, |ui| {
            for (input, does) in POINTER {
                ui.strong(*input);
                ui.label(*does);
                ui.end_row();
            }
            for (shortcut, _, does) in KEYS {
                ui.strong(context.format_shortcut(shortcut));
                ui.label(*does);
                ui.end_row();
            }
        });
    });
}
