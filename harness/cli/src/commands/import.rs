//! `touchdown import`.

use super::form::Form;
use super::terminal::Terminal;
use crate::print::{self, Shown};
use crate::tasks::import::{imported, words, Options};
use crate::typed;
use anyhow::Result;
use import::{amount, Facts, Missing};
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Examples, below the flags.
const EXAMPLES: &str = "\
Examples:
  What do these files hold, and what would be taken of them?
    touchdown import --list drop_*.tdms

  Eight drops, height and order in the names, 0.509 kg:
    touchdown import drop_*.tdms --names 'drop_{height:mm}_{order}.tdms' --mass 0.509 --out campaign
    touchdown check campaign
    touchdown diagnose campaign --out answer

  Voltages: a force transducer of 2.5 mV/N, an accelerometer of 10 mV/g whose sign is turned, 51,200 samples per second:
    touchdown import rig.csv --map force=ai0:2.5mV/N,acceleration=ai1:10mV/g:negative --rate 51200 \\
      --height 200mm --mass 509g --out campaign

  Speeds from a table with the columns file, order, impact_speed [m/s], impact_speed_std [m/s]:
    touchdown import *.mf4 --table levels.csv --mass 0.509 --out campaign

  A contactor, a file for each opening, each beginning with the release:
    touchdown import open_*.csv --names 'open_{preload:N}_{order}.csv' --mass 0.02 --travel 4mm --spring-rate 900 \\
      --out campaign";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Files of instruments: text of any dialect, TDMS, MAT, MDF, WAV and others
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Folder for the campaign: campaign.toml, a CSV for each recording in SI, import.html with what was taken and left out
    #[arg(long, required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Print what the files hold and what would be taken; nothing is written
    #[arg(long)]
    list: bool,
    /// Columns: CHANNEL=COLUMN[:UNIT or sensitivity][:negative or :positive], parted by commas. CHANNEL: time, force,
    /// acceleration, penetration. COLUMN: its name, or #3 for the third. Unit: kN; sensitivity: 2.5mV/N or 200N/V
    #[arg(long, value_name = "MAP")]
    map: Vec<String>,
    /// Samples per second, where no column is time
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// What the files' names say: {height:mm}, {speed:m/s}, {preload:N}, {order}, {level}; * for anything
    #[arg(long, value_name = "PATTERN")]
    names: Option<String>,
    /// CSV with a column file and any of order, level, drop_height [m], impact_speed [m/s], impact_speed_std [m/s],
    /// start_speed [m/s], start_speed_std [m/s], spring_preload [N]; a row for each file, or for each recording in it
    #[arg(long, value_name = "CSV")]
    table: Option<PathBuf>,
    /// Drop height of all recordings, m or with its unit
    #[arg(long, allow_hyphen_values = true)]
    height: Option<String>,
    /// Speed at touch of all recordings, m/s or with its unit
    #[arg(long, allow_hyphen_values = true)]
    speed: Option<String>,
    /// Preload of the return spring in all recordings, N or with its unit
    #[arg(long, allow_hyphen_values = true)]
    preload: Option<String>,
    /// What was done: drop-test, contactor-opening or indentation; guessed where it is not given
    #[arg(long)]
    kind: Option<String>,
    /// Moving mass, kg or with its unit
    #[arg(long, allow_hyphen_values = true)]
    mass: Option<String>,
    /// Travel of a contactor from rest to the stop, m or with its unit
    #[arg(long, allow_hyphen_values = true)]
    travel: Option<String>,
    /// Rate of a contactor's return spring, N/m or with its unit
    #[arg(long, allow_hyphen_values = true)]
    spring_rate: Option<String>,
    /// What the simulation holds beside k x^p: names of `touchdown mechanisms`, parted by commas
    #[arg(long, value_delimiter = ',')]
    terms: Option<Vec<String>>,
    /// Name of the campaign; that of the folder where it is not given
    #[arg(long)]
    name: Option<String>,
    /// Material, free text
    #[arg(long)]
    material: Option<String>,
    /// Take recordings whole: no window around the impact, nothing parted at impacts
    #[arg(long)]
    keep_all: bool,
    /// Columns of one kind are recordings of their own
    #[arg(long)]
    split_columns: bool,
    /// Share of a file's hardest impact that another has to reach to be a recording
    #[arg(long, default_value_t = 0.05)]
    least: f64,
    /// Leave out files that hold no recording, instead of refusing them all
    #[arg(long)]
    skip_bad: bool,
    #[command(flatten)]
    form: Form,
}

impl Arguments {
    /// The folder that the campaign goes to; None where nothing is written.
    pub fn writes(&self) -> Option<&Path> {
        self.out.as_deref().filter(|_| !self.list)
    }

    fn options(&self) -> Options {
        Options {
            files: self.files.clone(),
            out: self.out.clone(),
            map: self.map.clone(),
            rate: self.rate,
            names: self.names.clone(),
            table: self.table.clone(),
            height: self.height.clone(),
            speed: self.speed.clone(),
            preload: self.preload.clone(),
            kind: self.kind.clone(),
            mass: self.mass.clone(),
            travel: self.travel.clone(),
            spring_rate: self.spring_rate.clone(),
            terms: self.terms.clone(),
            name: self.name.clone(),
            material: self.material.clone(),
            keep_all: self.keep_all,
            split_columns: self.split_columns,
            least: self.least,
            skip_bad: self.skip_bad,
            command: typed::line(),
        }
    }
}

/// Asks for one amount until it is one; None at the end of the input.
fn ask(question: &str, read: &mut dyn FnMut(&str) -> Result<(), String>) -> Result<bool> {
    loop {
        print::question(&format!("{question}: "));
        let mut line = String::new();
        if std::io::stdin().lock().read_line(&mut line)? == 0 {
            return Ok(false);
        }
        match read(line.trim()) {
            Ok(()) => return Ok(true),
            Err(e) => print::line(&format!("  {e}")),
        }
    }
}

/// Asks for what no file holds; whether everything was answered.
fn asked(missing: &[Missing], o: &mut import::Options) -> Result<bool> {
    for m in missing {
        if m.files.is_empty() {
            let question = format!("{} ({}, or with its unit)", m.key.replace('_', " "), m.unit);
            let mut read = |text: &str| {
                let v = amount(text, m.quantity)?;
                if !(v.is_finite() && v > 0.0) {
                    return Err("give a number above 0".to_string());
                }
                match m.key {
                    "moving_mass" => o.mass = Some(v),
                    "travel" => o.travel = Some(v),
                    _ => o.spring_rate = Some(v),
                }
                Ok(())
            };
            if !ask(&question, &mut read)? {
                return Ok(false);
            }
        }
        for file in &m.files {
            let name = file.shown();
            let question = match m.key {
                "impact_speed" => format!("{name}: impact speed (m/s), or drop height with its unit (200 mm)"),
                key => format!("{name}: {} ({})", key.replace('_', " "), m.unit),
            };
            let mut facts = Facts::default();
            let mut read = |text: &str| {
                if m.key == "impact_speed" && amount(text, "speed").is_err() {
                    return facts.read("drop_height", text, "", "asked");
                }
                facts.read(m.key, text, "", "asked")
            };
            if !ask(&question, &mut read)? {
                return Ok(false);
            }
            o.asked.insert(file.clone(), facts);
        }
    }
    Ok(true)
}

fn list(a: &Arguments) -> Result<ExitCode> {
    let o = a.options().read()?;
    let mut listed = Vec::new();
    let mut bad = false;
    for f in &a.files {
        match import::list(f, &o, &instruments::open) {
            Ok(l) => listed.push(l),
            Err(e) => {
                bad = true;
                print::error(&e);
            }
        }
    }
    print::answer(&a.form.of(&listed, |all| all.iter().map(ToString::to_string).collect())?)?;
    Ok(if bad { ExitCode::from(2) } else { ExitCode::SUCCESS })
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if a.writes().is_none() {
        return list(a);
    }
    let mut ask = |missing: &[Missing], o: &mut import::Options| asked(missing, o);
    let taken = imported(&a.options(), std::io::stdin().is_terminal().then_some(&mut ask), &Terminal::new(a.form))?;
    print::beside(&a.form.of(&taken, words)?);
    Ok(ExitCode::SUCCESS)
}
