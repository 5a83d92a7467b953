//! `cutaway schema`.

use crate::report;
use cutaway_io::scene_file::SceneFile;

pub(crate) fn run() -> anyhow::Result<()> {
    let schema = schemars::schema_for!(SceneFile);
    report::print(&(serde_json::to_string_pretty(&schema)? + "\n"))
}
