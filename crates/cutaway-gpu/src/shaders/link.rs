//! Linking: a `.wgsl` file says what it imports of others, and each that is listed here becomes one text with all of it
//! inside. The build script does this, and nothing else in a build without the feature `watch-shaders`.

use std::path::{Path, PathBuf};

use wesl::{ManglerKind, ModulePath, StandardResolver, Wesl};

/// Shaders that pipelines are made of, by their paths below `src`.
pub(crate) const SHADERS: &[&str] = &[
    "raycast::raycast",
    "ranges::value_ranges",
    "ranges::occupancy",
    "context::filter",
    "proxy::cells",
    "proxy::view",
    "proxy::range",
    "geometry::surface",
    "geometry::behind",
    "frame::finish::fill",
    "frame::finish::blur",
    "frame::sampling::directions",
    "clipping::lists",
    "clipping::sweep_lists",
    "clipping::peel",
    "clipping::peel_count",
    "clipping::sweep_peel",
    "cells::select",
    "cells::project_grid",
    "cells::project_mesh",
    "cells::sort",
    "cells::draw",
    "cells::widen",
    "cells::tiles::mesh",
    "cells::tiles::grid",
    "cells::tiles::bin",
    "cells::tiles::composite",
    "cells::tiles::show",
    "slices::slices",
    "slices::develop",
];

/// What links the shaders of a folder.
pub(crate) fn linker(folder: &Path) -> Wesl<StandardResolver> {
    let mut linker = Wesl::new(folder);
    // Names stay as they are written, for the host to find; two alike in one shader do not pass its validation.
    linker.set_mangler(ManglerKind::None);
    linker
}

/// One of [`SHADERS`], as the linker names it.
pub(crate) fn module(path: &str) -> ModulePath {
    format!("package::{path}").parse().expect("a path of names")
}

/// The file of a module.
pub(crate) fn file(folder: &Path, module: &ModulePath) -> PathBuf {
    module.components.iter().fold(folder.to_owned(), |path, part| path.join(part)).with_extension("wgsl")
}
