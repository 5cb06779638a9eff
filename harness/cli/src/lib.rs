//! What the `touchdown` command does beyond its crates: benchmarks, studies, progress.
pub mod aligned;
pub mod bench;
pub mod campaign;
pub mod compare;
pub mod progress;
pub mod study;
