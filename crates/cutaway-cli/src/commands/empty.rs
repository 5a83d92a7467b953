//! Images that show nothing: said in a line that names what is to blame.

use cutaway_core::defaults::{EmptyCause, empty_cause};
use cutaway_core::image::Image;
use cutaway_core::presets;

use crate::args::SceneArgs;
use crate::report::Verbosity;
use crate::scene::Prepared;

/// The share of the pixels that show anything, 0 to 1.
pub(crate) fn visible_fraction(image: &Image) -> f64 {
    let visible = image.pixels().iter().filter(|pixel| pixel.iter().any(|channel| *channel > 0.0)).count();
    visible as f64 / image.pixels().len().max(1) as f64
}

/// Says why an image shows nothing.
pub(super) fn explain(prepared: &Prepared, args: &SceneArgs, verbosity: Verbosity) -> anyhow::Result<()> {
    let cause = empty_cause(&prepared.scene()?);
    let preset = args.function.preset.as_deref().and_then(presets::by_name);
    let units = preset.and_then(|preset| preset.unit_mismatch(prepared.loaded.lattice()));
    let why = match (&cause, units) {
        // Opacities that no value reaches are those of other units.
        (EmptyCause::Function { .. } | EmptyCause::Faint { .. }, Some(units)) => units.to_string(),
        _ => cause.to_string(),
    };
    verbosity.notice(&format!("the image is empty: {why}"));
    Ok(())
}
