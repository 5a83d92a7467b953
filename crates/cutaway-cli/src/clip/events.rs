//! Ways of finding clip events, and which engine has them: what one does not have, its own way stands in for.

use cutaway_core::clip::{ClipEvents, ClipEventsHome};
use cutaway_core::scene::RenderSettings;
use cutaway_mesh::EventFinder;

/// What finds the events of single lines, and of pixels on the processor.
pub(super) fn finder(how: ClipEvents) -> EventFinder {
    match how {
        ClipEvents::Grid => EventFinder::Grid,
        ClipEvents::Octree => EventFinder::Octree,
        ClipEvents::Bvh => EventFinder::Bvh,
        ClipEvents::Raster | ClipEvents::Auto | ClipEvents::Peel | ClipEvents::Lists => {
            EventFinder::default()
        }
    }
}

/// Whether clip surfaces are peeled into layers by an engine at home here.
pub(crate) fn peels(settings: &RenderSettings, here: ClipEventsHome) -> bool {
    settings.clip_events == ClipEvents::Peel && here == ClipEventsHome::Gpu
}

/// What to say where an engine at home here does not have the way of finding events that was asked for.
pub(crate) fn substitute(settings: &RenderSettings, here: ClipEventsHome) -> Option<String> {
    let how = settings.clip_events;
    if matches!(how.home(), ClipEventsHome::Any) || how.home() == here {
        return None;
    }
    let (there, instead) = match here {
        ClipEventsHome::Gpu => ("cpu", ClipEvents::Lists),
        ClipEventsHome::Cpu | ClipEventsHome::Any => ("GPU", ClipEvents::Raster),
    };
    let (how, instead) = (how.name(), instead.name());
    Some(format!(
        "--clip-events {how} belongs to {there} engines; events are found by `{instead}`, which finds the same"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_without_a_way_says_what_it_does_instead() {
        for clip_events in ClipEvents::ALL {
            let settings = RenderSettings { clip_events, ..RenderSettings::default() };
            let says = |here| substitute(&settings, here).unwrap_or_default();
            let home = clip_events.home();
            assert_eq!(says(ClipEventsHome::Cpu).contains("`raster`"), home == ClipEventsHome::Gpu);
            assert_eq!(says(ClipEventsHome::Gpu).contains("`lists`"), home == ClipEventsHome::Cpu);
            assert_eq!(peels(&settings, ClipEventsHome::Gpu), clip_events == ClipEvents::Peel);
            assert!(!peels(&settings, ClipEventsHome::Cpu));
        }
        assert_eq!(finder(ClipEvents::Lists), EventFinder::Raster);
        assert_eq!(finder(ClipEvents::Bvh), EventFinder::Bvh);
    }
}
