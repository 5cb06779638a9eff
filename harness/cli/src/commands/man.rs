//! `touchdown man`.

use crate::place;
use crate::print::{self, Shown};
use anyhow::{Context, Result};
use clap_mangen::Man;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown man --out ~/.local/share/man/man1            # then: man touchdown-diagnose
  touchdown man > touchdown.1                            # the program's page alone";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folder for the pages of the program and of every command
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// The program with all below it knowing their whole names.
fn built() -> clap::Command {
    let mut program = super::command_line().disable_help_subcommand(true);
    program.build();
    program
}

/// The page of `command`, and the name of its file.
fn page(command: &clap::Command) -> std::io::Result<(String, Vec<u8>)> {
    let source = format!("touchdown {}", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).source(source).manual("touchdown");
    let mut roff = Vec::new();
    man.render(&mut roff)?;
    Ok((man.get_filename(), roff))
}

/// How every page begins, but for what sets quotes.
const HEAD: &[u8] = b"\n.TH touchdown";

/// Writes the page of `command` and of all below it, and keeps what has their names and is none; their files' names.
fn write(command: &clap::Command, folder: &Path) -> Result<Vec<String>> {
    let (file, roff) = page(command)?;
    let is_page = |file: std::fs::File| {
        let mut head = Vec::new();
        file.take(64).read_to_end(&mut head).is_ok() && head.windows(HEAD.len()).any(|w| w == HEAD)
    };
    let kept =
        output::write_keeping(folder, &file, &roff, is_page).with_context(|| place::unwritten(&folder.join(&file)))?;
    kept.iter().for_each(|k| print::warning(&format!("{}: {}", folder.shown(), k.note())));
    let mut files = vec![file];
    for below in command.get_subcommands() {
        files.extend(write(below, folder)?);
    }
    Ok(files)
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let program = built();
    match &a.out {
        Some(folder) => {
            let files = write(&program, folder)?;
            print::beside(&format!("{}: {}\n", folder.shown(), files.join(", ")));
        }
        None => print::answer(&String::from_utf8(page(&program)?.1)?)?,
    }
    Ok(ExitCode::SUCCESS)
}
