//! `cutaway presets`: what can be named.

use cutaway_core::{colormaps, presets};
use cutaway_io::samples;

use crate::args::PresetsArgs;
use crate::report;

pub(crate) fn run(args: &PresetsArgs) -> anyhow::Result<()> {
    if args.json {
        let preset = |p: &presets::Preset| {
            serde_json::json!({
                "name": p.name, "description": p.description, "mode": p.mode.name(), "shade": p.shade,
            })
        };
        let list: Vec<_> = presets::all().iter().map(preset).collect();
        let all = serde_json::json!({ "presets": list, "colormaps": colormaps::NAMES, "samples": samples::names() });
        return report::print(&(serde_json::to_string_pretty(&all)? + "\n"));
    }
    let mut text = "Presets (--preset NAME):\n".to_owned();
    for p in presets::all() {
        text += &format!("  {:28} {}\n", p.name, p.description);
    }
    text += &format!("\nColour maps (--colormap NAME --range LO,HI):\n  {}\n", colormaps::NAMES.join(", "));
    text += "\nSamples (as VOLUME):\n";
    for name in samples::names() {
        text += &format!("  {:28} {}\n", format!("sample:{name}"), samples::about(name).unwrap_or_default());
    }
    report::print(&text)
}
