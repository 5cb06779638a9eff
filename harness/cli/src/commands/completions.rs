//! `touchdown completions`.

use crate::print;
use anyhow::Result;
use clap_complete::Shell;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown completions bash > ~/.local/share/bash-completion/completions/touchdown
  touchdown completions zsh > ~/.zfunc/_touchdown        # with fpath+=~/.zfunc before compinit in ~/.zshrc
  touchdown completions fish > ~/.config/fish/completions/touchdown.fish";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The shell that the completions are for
    shell: Shell,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut program = super::command_line();
    let name = program.get_name().to_string();
    let mut script = Vec::new();
    clap_complete::generate(a.shell, &mut program, name, &mut script);
    print::answer(&String::from_utf8(script)?)?;
    Ok(ExitCode::SUCCESS)
}
