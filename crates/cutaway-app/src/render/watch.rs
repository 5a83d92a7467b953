//! Shaders whose files change while the viewer runs, under the feature `watch-shaders`.
//!
//! The render thread looks at them between pictures. Once they have changed and are linked, the engine is started again
//! and the last picture made anew; where they do not link, that is said, and engine and picture stay.

use cutaway_gpu::ShaderWatch;

use super::Request;
use super::engines::Engines;

/// What is watched, and the picture that is shown.
#[derive(Debug, Default)]
pub(super) struct Shaders {
    watch: ShaderWatch,
    last: Option<(u64, Box<Request>)>,
}

impl Shaders {
    /// What is to be rendered: what was asked for or, where nothing was and shaders have changed, the last picture.
    pub(super) fn look(
        &mut self,
        asked: Option<(u64, Box<Request>)>,
        engines: &mut Engines,
        say: &mut dyn FnMut(String),
    ) -> Option<(u64, Box<Request>)> {
        let changed = self.watch.poll().unwrap_or_else(|line| {
            say(line);
            false
        });
        if changed {
            engines.restart();
        }
        if asked.is_some() {
            self.last = asked;
            return self.last.clone();
        }
        self.last.clone().filter(|_| changed)
    }
}
