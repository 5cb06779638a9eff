//! What the `touchdown` command does beyond its crates: benchmarks, studies, progress.
pub mod bench;
pub mod campaign;
pub mod progress;
pub mod study;
