//! `cutaway view`.

use crate::args::ViewArgs;

/// Opens the window, and returns when it is closed.
#[cfg(feature = "viewer")]
pub(crate) fn run(args: &ViewArgs) -> anyhow::Result<()> {
    use anyhow::{Context, anyhow};
    let name = args.scene.as_ref().map(|path| path.as_os_str().to_owned()).or_else(|| args.volume.clone());
    let open = name.map(|name| {
        name.into_string().map_err(|name| {
            anyhow!(
                "{}: a scene file cannot hold a name that is not Unicode; rename the file",
                name.display()
            )
        })
    });
    let open = open.transpose()?;
    if let Some(name) = open.as_deref().filter(|name| !name.starts_with("sample:")) {
        // In the terminal, not in a window that has nothing to show.
        std::fs::metadata(name).with_context(|| name.to_owned())?;
    }
    Ok(cutaway_app::run(cutaway_app::Start { open, volume_index: args.volume_index, gpu: args.gpu.clone() })?)
}

/// Says that this program was built without a window.
#[cfg(not(feature = "viewer"))]
pub(crate) fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let name = args.volume.as_deref().or(args.scene.as_ref().map(|path| path.as_os_str()));
    let name = name.map(|name| format!("{}: ", name.display())).unwrap_or_default();
    Err(anyhow::anyhow!(
        "{name}this build has no viewer; build it with `cargo build --release --features viewer`"
    ))
}
