//! Subcommands, a file each.

mod bench;
mod check;
mod compare;
mod completions;
mod demo;
mod diagnose;
mod fit;
mod fmus;
mod form;
mod impact;
mod import;
mod init;
mod man;
mod mechanisms;
mod merge;
mod pack;
mod paper;
mod run;
mod schema;
mod study;
mod system;
mod terminal;

use crate::place::Place;
use crate::print::{self, Unprinted, CLOSED_CODE};
use crate::progress::{end_cleanly, interrupted, interrupted_code};
use crate::typed;
use anyhow::Result;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

const CODES: &str = "\
Exit codes:
  0    done
  2    bad input, or something cannot be read or written; what and where is on standard error, with the cure
  3    a campaign is read but cannot be judged; its answer says why
  4    somebody else's FMU crashed, ended its process or went beyond a limit; what was computed so far is written
  129  ended by SIGHUP, 130 by Ctrl-C, 143 by SIGTERM, 152 by SIGXCPU (ulimit -S -t); what is written is whole
  141  nobody reads the answer any more, as behind `| head`

`touchdown COMMAND --help` has examples.";

/// The command line.
#[derive(Parser)]
#[command(
    name = "touchdown",
    version,
    long_version = concat!(env!("CARGO_PKG_VERSION"), "\ncommit ", env!("TOUCHDOWN_COMMIT")),
    about = "Contact elements for impacting machines: exact impacts and diagnosis of missing physics",
    after_help = CODES,
    styles = print::STYLES
)]
pub struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

/// Options of every command.
#[derive(clap::Args)]
struct Common {
    /// Print the answer and errors alone: no progress, no warnings
    #[arg(long, short, global = true, display_order = 901)]
    quiet: bool,
}

/// The command line as clap has it: for completions, manual pages and tests.
pub fn command_line() -> clap::Command {
    Cli::command()
}

#[derive(Subcommand)]
enum Command {
    // in the order of use; what developers of touchdown need is not listed
    /// Make a campaign out of the files that instruments write: columns guessed and listed, windows cut around the impacts
    Import(Box<import::Arguments>),
    /// Write a campaign.toml for the recordings in a folder, with what has to be filled in
    Init(init::Arguments),
    /// Say how campaigns are understood, and everything that is wrong with them; nothing is fitted
    Check(check::Arguments),
    /// Say what physics the simulation of a campaign leaves out, and how much better it fits with it
    Diagnose(diagnose::Arguments),
    /// Put the answers of many campaigns together: one table, one page, what grows with what, and what is lost
    Merge(merge::Arguments),
    /// Estimate the law from the recordings of a campaign
    Fit(fit::Arguments),
    /// Compare a recording with a simulation of it: class filters, pulses, ISO/TS 18571, shock spectra, bounces
    Compare(compare::Arguments),
    /// Run a scenario (drop test, contactor opening) and draw its impacts, or a system of FMUs
    Run(run::Arguments),
    /// Write a system of FMUs as an SSP 1.0 archive that other hosts run as it stands
    ExportSsp(system::ExportArguments),
    /// Write the element as an FMU, with start values of your own where you give them
    Pack(pack::Arguments),
    /// Print the exact impact of a mass on the law F = k x^p + mu_d x^p v
    Impact(impact::Arguments),
    /// Print the vocabulary of the diagnosis: every mechanism with its equation, quantities, units and source
    Mechanisms(mechanisms::Arguments),
    /// Do the main job on data of the repository: pack, run, fit, diagnose, run again, with pictures
    Demo(demo::Arguments),
    /// Repeat the estimation and the contactor of Ahn and Ryu 2005
    Paper(paper::Arguments),
    /// Print the JSON schema of campaigns, scenarios or systems, for editors that complete and check what one types
    Schema(schema::Arguments),
    /// Print the completions for a shell
    Completions(completions::Arguments),
    /// Print the manual page of the program, or write those of every command
    Man(man::Arguments),
    /// Measure what steps, powers, fits and diagnoses cost, beside others in the same run
    #[command(hide = true)]
    Bench(bench::Arguments),
    /// Measure a method against exact answers
    #[command(hide = true)]
    Study(study::Arguments),
}

impl Command {
    /// Whether it works on several threads.
    fn shares_its_work(&self) -> bool {
        !matches!(
            self,
            Command::Completions(_)
                | Command::Impact(_)
                | Command::Man(_)
                | Command::Mechanisms(_)
                | Command::Pack(_)
                | Command::Schema(_)
                | Command::ExportSsp(_)
        )
    }

    /// Where `--out` says that the command writes.
    fn out(&self) -> Option<Place<'_>> {
        match self {
            Command::Demo(a) => Some(Place::Folder(&a.out)),
            Command::Diagnose(a) => Some(Place::Folder(&a.out)),
            Command::Fit(a) => Some(Place::Folder(&a.out)),
            Command::Import(a) => a.writes().map(Place::Folder),
            Command::Man(a) => a.out.as_deref().map(Place::Folder),
            Command::Merge(a) => Some(Place::Folder(a.out())),
            Command::Pack(a) => Some(Place::File(&a.out)),
            Command::Paper(a) => Some(Place::Folder(&a.out)),
            Command::Run(a) => Some(Place::Folder(&a.out)),
            Command::ExportSsp(a) => Some(Place::File(&a.out)),
            Command::Study(a) => Some(Place::Folder(a.out())),
            Command::Bench(_) | Command::Check(_) | Command::Compare(_) | Command::Impact(_) => None,
            Command::Completions(_) | Command::Init(_) | Command::Mechanisms(_) | Command::Schema(_) => None,
        }
    }
}

/// Exit code where the process of somebody else's FMU died.
const DIED_CODE: u8 = 4;

/// Runs the command line; exit code 2 for bad input.
pub fn main() -> ExitCode {
    typed::begin(std::env::args_os().map(|w| w.to_string_lossy().into_owned()));
    match Cli::try_parse() {
        Ok(command_line) => run_parsed(command_line),
        Err(e) => refused(&e),
    }
}

/// Prints why a command line was not taken; help and version, which are no errors, are printed where they belong.
fn refused(e: &clap::Error) -> ExitCode {
    match e.print() {
        Err(unprinted) => failed(&Unprinted::from(unprinted).into()),
        Ok(()) => ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(2)),
    }
}

/// Runs the command line of these words, the first of which stands for the program; as [`main`].
pub fn main_of(words: Vec<String>) -> ExitCode {
    typed::begin(words.iter().cloned());
    match Cli::try_parse_from(words) {
        Ok(command_line) => run_parsed(command_line),
        Err(e) => refused(&e),
    }
}

fn run_parsed(command_line: Cli) -> ExitCode {
    end_cleanly();
    let done = command(command_line);
    print::warnings(&output::finished());
    let done = done.map(|code| match print::has_failed() && code == ExitCode::SUCCESS {
        true => ExitCode::from(2),
        false => code,
    });
    done.unwrap_or_else(|e| failed(&e))
}

/// Reports why a command failed; its exit code.
fn failed(e: &anyhow::Error) -> ExitCode {
    // what failed because the process is being ended is no failure of its own
    if output::is_ending() && interrupted() {
        return interrupted_code();
    }
    if e.downcast_ref::<Unprinted>().is_some_and(Unprinted::is_closed) {
        return ExitCode::from(CLOSED_CODE);
    }
    print::error(&print::cured_of(format!("{e:#}"), e));
    let died = e.chain().filter_map(|c| c.downcast_ref::<host::HostError>()).any(host::HostError::is_death);
    match died {
        _ if interrupted() => interrupted_code(),
        true => ExitCode::from(DIED_CODE),
        false => ExitCode::from(2),
    }
}

/// Runs one command given as words, as a shell would.
fn dispatch<'a>(words: impl Iterator<Item = &'a str>) -> Result<ExitCode> {
    let words: Vec<&str> = std::iter::once("touchdown").chain(words).collect();
    typed::begin(words.iter().map(ToString::to_string));
    command(Cli::try_parse_from(words)?)
}

fn command(c: Cli) -> Result<ExitCode> {
    if let Some(place) = c.command.out() {
        place.check()?;
    }
    if c.common.quiet {
        print::be_quiet();
    }
    if c.command.shares_its_work() {
        crate::threads::get_ready(true)?;
    }
    match c.command {
        Command::Bench(a) => bench::run(&a),
        Command::Check(a) => check::run(&a),
        Command::Compare(a) => compare::run(&a),
        Command::Completions(a) => completions::run(&a),
        Command::Demo(a) => demo::run(&a),
        Command::Diagnose(a) => diagnose::run(&a),
        Command::Fit(a) => fit::run(&a),
        Command::Impact(a) => impact::run(&a),
        Command::Import(a) => import::run(&a),
        Command::Init(a) => init::run(&a),
        Command::Man(a) => man::run(&a),
        Command::Merge(a) => merge::run(&a),
        Command::Mechanisms(a) => mechanisms::run(&a),
        Command::Pack(a) => pack::run(&a),
        Command::Paper(a) => paper::run(&a),
        Command::Run(a) => run::run(&a),
        Command::Schema(a) => schema::run(&a),
        Command::ExportSsp(a) => system::export(&a),
        Command::Study(a) => study::run(&a),
    }
}
