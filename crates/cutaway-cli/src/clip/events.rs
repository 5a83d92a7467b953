//! The method that finds the events of meshes on the processor.

use cutaway_core::clip::ClipEvents;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_asked_in_the_way_of_the_processor() {
        assert_eq!(finder(ClipEvents::Lists), EventFinder::Raster);
        assert_eq!(finder(ClipEvents::Bvh), EventFinder::Bvh);
    }
}
