//! What is open: a volume, the state that decides its picture, and the way back from every edit.
//!
//! Enters: files and edits. Leaves: the state that renderers and panels read. Nothing here draws or waits: files are read and
//! written by functions of [`load`], [`functions`] and [`scene_file`], in threads of the caller's choosing.

pub mod functions;
mod history;
pub mod load;
pub mod notes;
mod operands;
pub mod scene_file;
pub mod solids;
mod state;

use std::path::PathBuf;
use std::sync::Arc;

use cutaway_core::clip::Clip;

use crate::cutting::OperandId;

pub use history::History;
pub use load::OpenVolume;
pub use notes::ViewerNotes;
pub use solids::Solids;
pub use state::SceneState;

/// What is open.
#[derive(Debug)]
pub struct Document {
    volume: Arc<OpenVolume>,
    state: SceneState,
    history: History,
    /// The surfaces of files that operands name.
    pub solids: Solids,
    /// The operand that handles and numbers are for: a matter of the view, which no step remembers.
    pub selected: Option<OperandId>,
    /// The scene file that it was read from or saved to last.
    pub path: Option<PathBuf>,
    /// The state as that file has it.
    saved: SceneState,
}

impl Document {
    /// A volume, and how it is first seen.
    pub fn new(volume: Arc<OpenVolume>, state: SceneState, solids: Solids, path: Option<PathBuf>) -> Self {
        Self {
            volume,
            saved: state.clone(),
            state,
            history: History::default(),
            solids,
            selected: None,
            path,
        }
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<OpenVolume> {
        &self.volume
    }

    /// What decides its picture.
    pub fn state(&self) -> &SceneState {
        &self.state
    }

    /// Changes the state, in a step that can be undone. Edits of one `key` are one step until [`Self::settle`]; an edit
    /// that changes nothing is none.
    pub fn edit(&mut self, key: &'static str, change: impl FnOnce(&mut SceneState)) {
        let before = self.state.clone();
        change(&mut self.state);
        if self.state != before {
            self.history.record(key, &before);
        }
    }

    /// Looks from elsewhere, which is no step.
    pub fn look(&mut self, change: impl FnOnce(&mut cutaway_core::camera::Camera)) {
        change(&mut self.state.camera);
    }

    /// Ends a step: the pointer was released, or something else has the keyboard.
    pub fn settle(&mut self) {
        self.history.settle();
    }

    /// Takes back the step of this key, as if it had never begun, if it has not ended; whether it had begun.
    pub fn cancel(&mut self, key: &'static str) -> bool {
        self.history.cancel(key, &mut self.state)
    }

    /// Undoes the last step; whether there was one.
    pub fn undo(&mut self) -> bool {
        self.history.undo(&mut self.state)
    }

    /// Does again what was undone last; whether anything was.
    pub fn redo(&mut self) -> bool {
        self.history.redo(&mut self.state)
    }

    /// What can be undone and done again.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Whether there is anything that its file does not have.
    pub fn is_changed(&self) -> bool {
        self.state != self.saved
    }

    /// Notes that a state, which was that of this document, was written to a file.
    pub fn saved_to(&mut self, path: PathBuf, state: SceneState) {
        self.path = Some(path);
        self.saved = state;
    }

    /// What is cut, with the solids that are loaded; what has none yet neither cuts nor keeps.
    pub fn clip(&self) -> Option<Clip> {
        let present = self.state.cutting.with_hidden(&|source| self.solids.get(source).is_none());
        Some(self.solids.resolve(&present.to_clip(self.volume.lattice())?))
    }
}
