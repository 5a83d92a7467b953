//! How much memory a reader may use, and what a reader hands back.

/// Bounds that readers hold a file's claims against before they allocate anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest volume or mesh, in bytes as decoded from the file: voxels times the size of the file's scalar type, or 12
    /// bytes a vertex and a triangle. Turning them into a [`Volume`](cutaway_core::volume::Volume) or a
    /// [`TriangleMesh`](cutaway_mesh::TriangleMesh) may take about as much again for a moment.
    pub max_bytes: u64,
}

impl Default for Limits {
    /// Three quarters of the machine's memory, or of what the process's container may use; 16 GiB where neither is
    /// known.
    fn default() -> Self {
        const FALLBACK: u64 = 16 << 30;
        let memory = [physical_memory(), container_memory()].into_iter().flatten().min();
        Self { max_bytes: memory.map_or(FALLBACK, |bytes| bytes / 4 * 3) }
    }
}

/// Physical memory in bytes, where the system tells as Linux does.
fn physical_memory() -> Option<u64> {
    memory_total(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn memory_total(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The limit of a Linux container (cgroup version 2), if it has one.
fn container_memory() -> Option<u64> {
    std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok()?.trim().parse().ok()
}

/// A number of bytes as people write it: `17 bytes`, `12.5 GiB`.
pub(crate) fn bytes_text(bytes: u64) -> String {
    const UNITS: [&str; 6] = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    if bytes < 10_000 {
        return format!("{bytes} bytes");
    }
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    format!("{value:.1} {}", UNITS[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_as_linux_writes_it() {
        assert_eq!(memory_total("MemTotal:       24684100 kB\nMemFree: 1 kB\n"), Some(24_684_100 * 1024));
        assert_eq!(memory_total("MemFree: 1 kB\n"), None);
        assert_eq!(memory_total("MemTotal: 99999999999999999999 kB\n"), None);
    }

    #[test]
    fn sizes_are_short() {
        let texts = [0, 9_999, 10_240, 1 << 30, u64::MAX].map(bytes_text);
        assert_eq!(texts, ["0 bytes", "9999 bytes", "10.0 KiB", "1.0 GiB", "16.0 EiB"]);
    }
}
