//! What `--stats` says: one JSON object whose names other tools read.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use cutaway_io::atomic::write_atomically;
use serde::Serialize;

use crate::report;

/// Names are fixed. `null` where an engine has nothing to say.
#[derive(Debug, Serialize)]
pub(crate) struct StatisticsFile {
    pub(crate) engine: &'static str,
    pub(crate) adapter: Option<String>,
    pub(crate) simd: Option<&'static str>,
    pub(crate) threads: usize,
    pub(crate) resolution: [u32; 2],
    pub(crate) load_ms: f64,
    pub(crate) prepare_ms: f64,
    pub(crate) classify_ms: f64,
    pub(crate) clip_ms: f64,
    pub(crate) frame_ms: FrameTimes,
    /// Of the last frame on the GPU's own clock, rays alone.
    pub(crate) gpu_ms: Option<f64>,
    pub(crate) samples: Option<u64>,
    pub(crate) rays: Option<u64>,
    pub(crate) segments: Option<u64>,
    /// Lines through clip objects whose events did not balance.
    pub(crate) repaired_lines: Option<u64>,
    pub(crate) skipped_fraction: Option<f64>,
    /// Share of the pixels that show anything.
    pub(crate) visible_fraction: Option<f64>,
    pub(crate) peak_rss_bytes: Option<u64>,
    pub(crate) gpu_bytes: Option<u64>,
    pub(crate) triangles_or_tetrahedra: Option<u64>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct FrameTimes {
    pub(crate) min: f64,
    pub(crate) median: f64,
    pub(crate) max: f64,
    pub(crate) n: usize,
}

impl FrameTimes {
    /// From the times of at least one frame, in milliseconds.
    pub(crate) fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let n = times.len();
        let median = 0.5 * (times[(n - 1) / 2] + times[n / 2]);
        Self { min: times[0], median, max: times[n - 1], n }
    }
}

impl StatisticsFile {
    /// What one frame took, in a line.
    pub(crate) fn summary(&self) -> String {
        let simd = self.simd.map_or(String::new(), |simd| format!(" ({simd})"));
        let samples = self.samples.map_or(String::new(), |n| format!(", {n} samples"));
        format!(
            "{}{simd} on {} threads: load {:.1} ms, prepare {:.1} ms, classify {:.1} ms, render {:.1} ms{samples}",
            self.engine, self.threads, self.load_ms, self.prepare_ms, self.classify_ms, self.frame_ms.median
        )
    }

    /// As JSON, with a line's end.
    pub(crate) fn text(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Writes to a file; `-` is standard error.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = self.text()?;
        if path == Path::new("-") {
            return report::print_error_stream(&text).context("could not write the statistics");
        }
        write_atomically(path, |w| w.write_all(text.as_bytes())).context("could not write the statistics")
    }
}

/// The most memory this process has held, where the system tells.
pub(crate) fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
