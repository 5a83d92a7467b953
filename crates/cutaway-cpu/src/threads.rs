//! Threads: what those that run kernels need.

/// Bytes of stack of each thread that runs kernels. The compiler inlines the kernels into a few large functions. Without
/// optimisation, as in a plain `cargo run` of another project, their frames need between 4 and 8 MiB, and the usual 2 MiB
/// overflow. The system provides only the pages that are used.
pub(crate) const STACK: usize = 32 << 20;
