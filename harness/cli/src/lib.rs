//! The `touchdown` command: its subcommands, benchmarks, studies, progress.
pub mod aligned;
pub mod bench;
pub mod campaign;
pub mod commands;
pub mod compare;
pub mod place;
pub mod print;
pub mod progress;
pub mod study;
pub mod tasks;
pub mod threads;
pub mod typed;
