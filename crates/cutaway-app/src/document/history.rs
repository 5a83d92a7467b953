//! Undo and redo: the states before and after, whole.
//!
//! States are small (solids are named, not held), so that a history of them needs no inverse of any edit. Edits that
//! belong together, as the hundred positions of one drag do, are one step: they share a key until the history settles.

use super::SceneState;

/// How many steps can be undone.
const MOST_STEPS: usize = 200;

/// The states that undo and redo lead to.
#[derive(Clone, Debug, Default)]
pub struct History {
    before: Vec<SceneState>,
    after: Vec<SceneState>,
    /// What the last step was, while it may still go on.
    open: Option<&'static str>,
}

impl History {
    /// Notes the state before an edit. Edits of the same key are one step until [`Self::settle`].
    pub fn record(&mut self, key: &'static str, before: &SceneState) {
        self.after.clear();
        if self.open == Some(key) {
            return;
        }
        self.open = Some(key);
        if self.before.len() == MOST_STEPS {
            self.before.remove(0);
        }
        self.before.push(before.clone());
    }

    /// Ends the step: the next edit is another one.
    pub fn settle(&mut self) {
        self.open = None;
    }

    /// Goes back to before the step of this key, while it is open, and forgets it; whether it was open.
    pub fn cancel(&mut self, key: &'static str, state: &mut SceneState) -> bool {
        if self.open != Some(key) {
            return false;
        }
        self.open = None;
        let Some(mut before) = self.before.pop() else { return false };
        before.camera = state.camera.clone();
        *state = before;
        true
    }

    /// Whether there is anything to undo.
    pub fn can_undo(&self) -> bool {
        !self.before.is_empty()
    }

    /// Whether there is anything to do again.
    pub fn can_redo(&self) -> bool {
        !self.after.is_empty()
    }

    /// Goes back a step. The camera stays: a view is no edit.
    pub fn undo(&mut self, state: &mut SceneState) -> bool {
        Self::step(&mut self.before, &mut self.after, &mut self.open, state)
    }

    /// Goes forward again.
    pub fn redo(&mut self, state: &mut SceneState) -> bool {
        Self::step(&mut self.after, &mut self.before, &mut self.open, state)
    }

    fn step(
        from: &mut Vec<SceneState>,
        to: &mut Vec<SceneState>,
        open: &mut Option<&'static str>,
        state: &mut SceneState,
    ) -> bool {
        *open = None;
        let Some(mut other) = from.pop() else { return false };
        other.camera = state.camera.clone();
        to.push(std::mem::replace(state, other));
        true
    }
}
