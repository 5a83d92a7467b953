//! `cutaway presets`: what can be named.

use cutaway_core::{colormaps, presets};
use cutaway_io::samples;

use crate::args::PresetsArgs;

pub(crate) fn run(args: &PresetsArgs) -> anyhow::Result<()> {
    if args.json {
        let preset = |p: &presets::Preset| {
            serde_json::json!({
                "name": p.name, "description": p.description, "mode": p.mode.name(), "shade": p.shade,
            })
        };
        let list: Vec<_> = presets::all().iter().map(preset).collect();
        let all = serde_json::json!({ "presets": list, "colormaps": colormaps::NAMES, "samples": samples::names() });
        println!("{}", serde_json::to_string_pretty(&all)?);
        return Ok(());
    }
    println!("Presets (--preset NAME):");
    for p in presets::all() {
        println!("  {:28} {}", p.name, p.description);
    }
    println!("\nColour maps (--colormap NAME --range LO,HI):\n  {}", colormaps::NAMES.join(", "));
    println!("\nSamples (as VOLUME):");
    for name in samples::names() {
        println!("  {:28} {}", format!("sample:{name}"), samples::about(name).unwrap_or_default());
    }
    Ok(())
}
