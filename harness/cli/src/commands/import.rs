//! `touchdown import`.

use super::form::Form;
use crate::print;
use crate::progress::Progress;
use anyhow::{anyhow, bail, ensure, Result};
use import::{amount, look_at, parse_map, plan, Facts, File, Missing, Options, Outcome, Pattern, Plan, Table};
use record::Kind;
use serde::Serialize;
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
    #[arg(long, value_name = "RATE")]
    rate: Option<f64>,
    /// What the files' names say: {height:mm}, {speed:m/s}, {preload:N}, {order}, {level}; * for anything
    #[arg(long, value_name = "PATTERN")]
    names: Option<String>,
    /// CSV with a column file and any of order, level, drop_height [m], impact_speed [m/s], impact_speed_std [m/s],
    /// start_speed [m/s], start_speed_std [m/s], spring_preload [N]; a row for each file, or for each recording in it
    #[arg(long, value_name = "CSV")]
    table: Option<PathBuf>,
    /// Drop height of all recordings, m or with its unit
    #[arg(long)]
    height: Option<String>,
    /// Speed at touch of all recordings, m/s or with its unit
    #[arg(long)]
    speed: Option<String>,
    /// Preload of the return spring in all recordings, N or with its unit
    #[arg(long)]
    preload: Option<String>,
    /// What was done: drop-test, contactor-opening or indentation; guessed where it is not given
    #[arg(long)]
    kind: Option<String>,
    /// Moving mass, kg or with its unit
    #[arg(long)]
    mass: Option<String>,
    /// Travel of a contactor from rest to the stop, m or with its unit
    #[arg(long)]
    travel: Option<String>,
    /// Rate of a contactor's return spring, N/m or with its unit
    #[arg(long)]
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
}

/// A flag's amount.
fn value(flag: &str, text: &Option<String>, quantity: &str) -> Result<Option<f64>> {
    let Some(text) = text else { return Ok(None) };
    let v = amount(text, quantity).map_err(|e| anyhow!("{flag}: {e}"))?;
    ensure!(v.is_finite() && v > 0.0, "{flag} {text}: give a number above 0");
    Ok(Some(v))
}

fn options(a: &Arguments) -> Result<Options> {
    let mut o = Options {
        rate: a.rate,
        mass: value("--mass", &a.mass, "mass")?,
        travel: value("--travel", &a.travel, "penetration")?,
        spring_rate: value("--spring-rate", &a.spring_rate, "spring rate")?,
        keep_all: a.keep_all,
        split_columns: a.split_columns,
        least: a.least,
        skip_bad: a.skip_bad,
        material: a.material.clone(),
        terms: a.terms.clone(),
        ..Options::default()
    };
    ensure!(a.rate.is_none_or(|r| r.is_finite() && r > 0.0), "--rate: give samples per second, above 0");
    ensure!((0.0..=1.0).contains(&a.least), "--least {}: give a share from 0 to 1", a.least);
    for m in &a.map {
        o.map.extend(parse_map(m).map_err(|e| anyhow!(e))?);
    }
    o.names = a.names.as_deref().map(Pattern::parse).transpose().map_err(|e| anyhow!(e))?;
    o.table = a.table.as_deref().map(Table::read).transpose().map_err(|e| anyhow!(e.join("\n")))?;
    for (flag, key, text) in [
        ("--height", "drop_height", &a.height),
        ("--speed", "impact_speed", &a.speed),
        ("--preload", "spring_preload", &a.preload),
    ] {
        if let Some(text) = text {
            o.all.read(key, text, "", flag).map_err(|e| anyhow!("{flag}: {e}"))?;
        }
    }
    if let Some(k) = &a.kind {
        let names = Kind::BUILT_IN.map(Kind::name);
        o.kind = Some(
            Kind::named(k)
                .filter(|k| Kind::BUILT_IN.contains(k))
                .ok_or_else(|| anyhow!("--kind {k:?} is not known; {}", record::words::instead(k, &names)))?,
        );
    }
    let known = mechanisms::terms();
    if let Some(t) = a.terms.iter().flatten().find(|t| !known.contains(&t.as_str())) {
        bail!("--terms: {t:?} is not known; {}", record::words::instead(t, &known));
    }
    let folder = a.out.as_deref().and_then(std::path::Path::file_name);
    let folder = folder.map_or("campaign".into(), |n| n.to_string_lossy().into_owned());
    o.name = a.name.clone().unwrap_or(folder);
    Ok(o)
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

/// Asks for what no file tells; whether everything was answered.
fn asked(missing: &[Missing], o: &mut Options) -> Result<bool> {
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
            let name = file.display();
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

/// What is missing, as an error says it.
fn told(m: &Missing) -> String {
    let most = 3;
    let mut names: Vec<String> = m.files.iter().take(most).map(|f| f.display().to_string()).collect();
    if m.files.len() > most {
        names.push(format!("{} more", m.files.len() - most));
    }
    let of = if names.is_empty() { String::new() } else { format!(" of {}", names.join(", ")) };
    let what = if m.key == "impact_speed" { "impact_speed or drop_height" } else { m.key };
    format!("{what}{of} is missing: no file tells it; give {}", m.cure)
}

/// What was taken and left out.
#[derive(Serialize)]
struct Taken<'a> {
    campaign: &'a Path,
    kind: &'a str,
    kind_from: &'a str,
    files: Vec<TakenFile<'a>>,
    recordings: Vec<TakenRecording<'a>>,
    notes: Vec<&'a String>,
    left_out: Vec<&'a String>,
    pictures: PathBuf,
}

#[derive(Serialize)]
struct TakenFile<'a> {
    file: String,
    taken: &'a [String],
    left_out: &'a [String],
}

#[derive(Serialize)]
struct TakenRecording<'a> {
    recording: &'a str,
    file: String,
    /// What tells it from others of its file; empty where it is the only one.
    label: &'a str,
    samples: usize,
    /// When it touches and for how long, s.
    touch: Option<(f64, f64)>,
    notes: &'a [String],
}

fn taken<'a>(campaign: &'a Path, files: &'a [File], p: &'a Plan, out: &'a Outcome, faults: &'a [String]) -> Taken<'a> {
    let of_file = |f: &'a File| TakenFile { file: f.name(), taken: &f.taken, left_out: &f.left };
    let of = |w: &'a import::Written| {
        let r = &p.recordings[w.recording];
        let file = files[r.file].name();
        TakenRecording {
            recording: &r.name,
            file,
            label: &r.label,
            samples: w.samples,
            touch: w.touch,
            notes: &w.notes,
        }
    };
    Taken {
        campaign,
        kind: p.kind.name(),
        kind_from: &p.kind_from,
        files: files.iter().map(of_file).collect(),
        recordings: out.recordings.iter().map(of).collect(),
        notes: p.notes.iter().chain(&out.notes).collect(),
        left_out: faults.iter().chain(&out.faults).collect(),
        pictures: campaign.join(import::PAGE),
    }
}

/// The same for a terminal.
fn words(t: &Taken<'_>) -> String {
    let mut lines = Vec::new();
    let mut before: Option<&TakenFile<'_>> = None;
    for f in &t.files {
        if before.is_some_and(|b| (b.taken, b.left_out) == (f.taken, f.left_out)) {
            lines.push(format!("{}: the same", f.file));
            continue;
        }
        lines.push(f.file.clone());
        lines.extend(f.taken.iter().map(|t| format!("  {t}")));
        lines.extend(f.left_out.iter().map(|l| format!("  left out: {l}")));
        before = Some(f);
    }
    lines.push(format!("{}: {}", t.kind, t.kind_from));
    for r in &t.recordings {
        let label = if r.label.is_empty() { String::new() } else { format!(", {}", r.label) };
        let touch = r.touch.map_or(String::new(), |(at, length)| {
            format!(", touch at {} for {}", diagnose::figure::figure(at, "s"), diagnose::figure::figure(length, "s"))
        });
        lines.push(format!("  {} of {}{label}: {} samples{touch}", r.recording, r.file, r.samples));
        lines.extend(r.notes.iter().map(|n| format!("    {n}")));
    }
    lines.extend(t.notes.iter().map(|n| format!("  note: {n}")));
    lines.push(format!(
        "{}: {} recordings; look at {}, then run `touchdown check {}`\n",
        t.campaign.display(),
        t.recordings.len(),
        t.pictures.display(),
        t.campaign.display()
    ));
    lines.join("\n")
}

fn list(a: &Arguments, o: &Options) -> Result<ExitCode> {
    let mut listed = Vec::new();
    let mut bad = false;
    for f in &a.files {
        match import::list(f, o, &instruments::open) {
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
    let mut o = options(a)?;
    let Some(out) = a.writes() else { return list(a, &o) };
    ensure!(!out.exists(), "{}: is there already; give another --out, or move it away", out.display());
    let progress = Progress::new("import: looking at files", a.files.len() as u64);
    let mut files = Vec::new();
    let mut faults = Vec::new();
    for looked in look_at(&a.files, &o, &instruments::open, &|_| progress.add(1)) {
        match looked {
            Ok(file) => files.push(file),
            Err(e) => faults.extend(e),
        }
    }
    drop(progress);
    let mut planned = plan(&mut files, &o);
    let may_ask = std::io::stdin().is_terminal() && (faults.is_empty() || o.skip_bad);
    if may_ask && !planned.missing.is_empty() && asked(&planned.missing, &mut o)? {
        planned = plan(&mut files, &o);
    }
    faults.extend(planned.faults.iter().cloned());
    let mut missing: Vec<String> = planned.missing.iter().map(told).collect();
    if o.kind.is_none() && !missing.is_empty() {
        missing.push(format!("taken as {}, {}; --kind says another", planned.kind.name(), planned.kind_from));
    }
    if !missing.is_empty() || planned.recordings.is_empty() || (!faults.is_empty() && !o.skip_bad) {
        let skip = !faults.is_empty() && !o.skip_bad && !planned.recordings.is_empty();
        print::error(&faults.iter().chain(&missing).cloned().collect::<Vec<_>>().join("\n"));
        if skip {
            print::error("nothing was written; --skip-bad leaves out the files that hold no recording");
        }
        return Ok(ExitCode::from(2));
    }
    let progress = Progress::new("import: writing recordings", files.len() as u64);
    let outcome = import::write(out, &files, &planned, &o, &|path| {
        progress.add(1);
        instruments::open(path)
    });
    drop(progress);
    match outcome {
        Ok(outcome) => {
            let taken = taken(out, &files, &planned, &outcome, &faults);
            taken.left_out.iter().for_each(|f| print::warning(&format!("left out: {f}")));
            print::beside(&a.form.of(&taken, words)?);
            Ok(ExitCode::SUCCESS)
        }
        Err(faults) => {
            print::error(&faults.join("\n"));
            Ok(ExitCode::from(2))
        }
    }
}
