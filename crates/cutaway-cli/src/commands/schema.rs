//! `cutaway schema`.

use cutaway_core::scene::SceneFile;

pub(crate) fn run() -> anyhow::Result<()> {
    let schema = schemars::schema_for!(SceneFile);
    println!("{}", serde_json::to_string_pretty(&schema)?);
    Ok(())
}
