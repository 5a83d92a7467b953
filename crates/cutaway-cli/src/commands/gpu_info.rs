//! `cutaway info --gpu`: which GPUs there are.

use cutaway_gpu::context::{AdapterSummary, adapters};
use serde::Serialize;

use crate::report;

#[derive(Debug, Serialize)]
struct GpuInfo {
    name: String,
    kind: &'static str,
    backend: String,
    driver: String,
    /// Whether `--engine auto` takes it.
    auto: bool,
}

pub(crate) fn run(json: bool) -> anyhow::Result<()> {
    let gpus: Vec<GpuInfo> = adapters().into_iter().enumerate().map(|(i, a)| described(i, a)).collect();
    if json {
        return report::print(&(serde_json::to_string_pretty(&gpus)? + "\n"));
    }
    if gpus.is_empty() {
        return report::print(
            "no GPU: there is no Vulkan, Metal or Direct3D 12 driver (software Vulkan on Debian and Ubuntu: mesa-vulkan-drivers)\n",
        );
    }
    let line = |g: &GpuInfo| {
        let auto = if g.auto { "; taken by --engine auto" } else { "" };
        format!("{} ({}, {}: {}){auto}\n", g.name, g.kind, g.backend, g.driver)
    };
    report::print(&gpus.iter().map(line).collect::<String>())
}

fn described(position: usize, adapter: AdapterSummary) -> GpuInfo {
    let auto = position == 0 && !adapter.software;
    let (name, kind, backend, driver) =
        (adapter.name.clone(), adapter.kind(), adapter.backend, adapter.driver);
    GpuInfo { name, kind, backend, driver, auto }
}
