//! The `touchdown` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    if std::env::args_os().nth(1).is_some_and(|a| a == host::ARGUMENT) {
        return host::serve();
    }
    touchdown::commands::main()
}
