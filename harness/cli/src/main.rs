//! The `touchdown` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    touchdown::commands::main()
}
