//! Links the shaders: a `.wgsl` file says what it imports of others, and each that is listed here becomes one text with all
//! of it inside.

use wesl::{ManglerKind, ModulePath, Wesl};

/// Shaders that pipelines are made of, by their paths below `src`.
const SHADERS: &[&str] = &[
    "raycast::raycast",
    "ranges::value_ranges",
    "ranges::occupancy",
    "context::filter",
    "proxy::cells",
    "proxy::view",
    "proxy::range",
    "geometry::surface",
    "geometry::behind",
    "raycast::finish::fill",
    "raycast::finish::blur",
    "raycast::sampling::directions",
    "clip_layers::lists",
    "clip_layers::sweep_lists",
    "clip_layers::peel",
    "clip_layers::peel_count",
    "clip_layers::sweep_peel",
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

fn main() {
    let mut linker = Wesl::new("src");
    // Names stay as they are written, for the host to find; two alike in one shader do not pass its validation.
    linker.set_mangler(ManglerKind::None);
    for path in SHADERS {
        let module: ModulePath = format!("package::{path}").parse().expect("a path of names");
        linker.build_artifact(&module, &path.replace("::", "_"));
    }
    println!("cargo::rerun-if-changed=build.rs");
}
