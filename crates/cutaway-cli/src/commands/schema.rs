//! `cutaway schema`.

use cutaway_core::scene::SceneFile;

use crate::report;

pub(crate) fn run() -> anyhow::Result<()> {
    let schema = schemars::schema_for!(SceneFile);
    report::print(&(serde_json::to_string_pretty(&schema)? + "\n"))
}
