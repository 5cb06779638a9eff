//! `touchdown check`.

use super::fmus::Fmus;
use super::form::Form;
use crate::aligned::aligned;
use crate::campaign::of_campaign;
use crate::print::{self, Shown};
use anyhow::Result;
use diagnose::agreement::{agreement, Compared};
use diagnose::figure::figure;
use estimate::condition::{condition_on, Guess, Invalid};
use estimate::impact::touch;
use estimate::levels::nrmse;
use estimate::problem::{Data, Nuisance, Problem};
use estimate::structure::Structure;
use host::Isolation;
use record::{Campaign, Channel, RecordError, RecordErrors, Recording, Section};
use serde::Serialize;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown check my_drops                               # what a diagnosis would see, and what contradicts
  touchdown check drops_a drops_b drops_c                # several at once; every fault of each is reported
  touchdown check my_drops --json > my_drops.json        # the same for programs";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

/// How a campaign is understood, SI; what was not come to is absent.
#[derive(Serialize)]
struct Understood {
    folder: PathBuf,
    name: String,
    kind: &'static str,
    moving_mass: Option<f64>,
    levels: usize,
    simulation: Simulation,
    recordings: Vec<Row>,
    notes: Vec<String>,
    /// What channels, speeds and heights say of each other.
    compared: Vec<Compared>,
    /// Differences that sensors alone do not explain, but a rig may.
    doubts: Vec<String>,
    noise: Vec<Noise>,
    /// What FMUs make of the recordings before anything is fitted; empty where none simulate it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    simulated: Vec<Simulated>,
    /// What is wrong with it, a line each; also on standard error.
    errors: Vec<String>,
}

/// The simulation as given.
#[derive(Serialize)]
struct Simulation {
    k: Option<f64>,
    p: Option<f64>,
    terms: Vec<String>,
}

/// What is known of a recording; channels by their least and largest reading.
#[derive(Serialize)]
struct Row {
    file: String,
    order: f64,
    level: String,
    samples: usize,
    interval: f64,
    impact_at: Option<f64>,
    contact: Option<f64>,
    force: Option<[f64; 2]>,
    acceleration: Option<[f64; 2]>,
    penetration: Option<[f64; 2]>,
}

/// A channel of a recording, as read and as FMUs simulate it with the values of the system file.
#[derive(Serialize)]
struct Simulated {
    file: String,
    channel: &'static str,
    unit: &'static str,
    /// Least and largest.
    recorded: [f64; 2],
    simulated: [f64; 2],
    /// Root mean square of the difference over the recording's range.
    off: f64,
}

/// A channel's noise: standard deviation in its unit, and over its range.
#[derive(Serialize)]
struct Noise {
    channel: &'static str,
    unit: &'static str,
    noise: f64,
    over_range: f64,
}

/// Columns of the table, with the unit.
const COLUMNS: [&str; 10] = [
    "file",
    "order",
    "level",
    "samples",
    "interval [s]",
    "impact at [s]",
    "contact [s]",
    "force [N]",
    "acceleration [m/s^2]",
    "penetration [m]",
];

fn row(c: &Campaign, r: &Recording) -> Row {
    let (time, samples) = (r.all_times(), r.rows.samples());
    let touched = touch(c.kind, r, c.moving_mass.unwrap_or(1.0));
    let of = |channel: Channel| {
        let y = r.channels[channel.index()].as_ref()?;
        Some(y.iter().fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(*v), high.max(*v)]))
    };
    Row {
        file: r.file.clone(),
        order: r.order,
        level: c.levels[r.level].1.clone(),
        samples,
        interval: (time[time.len() - 1] - time[0]) / (samples.max(2) - 1) as f64,
        impact_at: touched.map(|t| t.0),
        contact: touched.map(|t| t.1),
        force: of(Channel::Force),
        acceleration: of(Channel::Acceleration),
        penetration: of(Channel::Penetration),
    }
}

fn cells(r: &Row) -> [String; 10] {
    let time = |t: Option<f64>| t.map_or("-".to_string(), |t| figure(t, ""));
    let range = |y: Option<[f64; 2]>| {
        y.map_or("-".to_string(), |[low, high]| format!("{} to {}", figure(low, ""), figure(high, "")))
    };
    [
        print::spelled_out(&r.file),
        r.order.to_string(),
        r.level.clone(),
        r.samples.to_string(),
        figure(r.interval, ""),
        time(r.impact_at),
        time(r.contact),
        range(r.force),
        range(r.acceleration),
        range(r.penetration),
    ]
}

fn words(u: &Understood) -> String {
    let simulation = match (u.simulation.k, u.simulation.p) {
        _ if u.kind == record::Kind::System.name() => "FMUs".to_string(),
        (Some(k), Some(p)) => format!("k = {k} N/m^p, p = {p}"),
        _ => "not calibrated yet".to_string(),
    };
    let terms = if u.simulation.terms.is_empty() { "none".to_string() } else { u.simulation.terms.join(", ") };
    // as it was given; what FMUs declare of it, to six digits
    let six = |m: f64| format!("{m:.5e}").parse().unwrap_or(m);
    let mass = u.moving_mass.map_or(String::new(), |m| format!(", moving mass {} kg", six(m)));
    let mut s = format!(
        "{}: {} of {}{mass}; {} recordings at {} levels; simulation: {simulation}, terms: {terms}\n",
        u.folder.shown(),
        u.kind,
        print::spelled_out(&u.name),
        u.recordings.len(),
        u.levels
    );
    let head = COLUMNS.map(str::to_string);
    s += &aligned(&std::iter::once(head).chain(u.recordings.iter().map(cells)).collect::<Vec<_>>());
    s.extend(u.notes.iter().map(|n| format!("  note: {}\n", print::spelled_out(n))));
    for c in &u.compared {
        let [low, high] = c.interval.map(|v| figure(v, ""));
        let [least, most] = c.expected.map(|v| figure(v, ""));
        s += &format!(
            "  compared in {} recordings: {}: {} ({low} to {high}); {least} to {most} is right\n",
            c.recordings,
            c.what,
            figure(c.value, "")
        );
    }
    for n in &u.noise {
        let (noise, share) = (figure(n.noise, n.unit), figure(100.0 * n.over_range, "%"));
        s += &format!("  noise of {}: {noise}, {share} of its range\n", n.channel);
    }
    for m in &u.simulated {
        let range = |[low, high]: [f64; 2]| format!("{} to {}", figure(low, ""), figure(high, m.unit));
        let off = figure(100.0 * m.off, "%");
        s += &format!(
            "  {}, {}: recorded {}, simulated {}, off by {off} of range\n",
            print::spelled_out(&m.file),
            m.channel,
            range(m.recorded),
            range(m.simulated)
        );
    }
    s.extend(u.doubts.iter().map(|d| format!("  doubt: {d}\n")));
    if u.levels == 1 && u.recordings.len() > 1 {
        s += "  note: all recordings are of one level: what grows with speed or depth cannot be told from what does not\n";
    }
    match (u.errors.len(), u.doubts.len()) {
        (0, 0) => s += "  nothing contradicts\n",
        (0, 1) => s += "  no contradiction, but a doubt\n",
        (0, n) => s += &format!("  no contradiction, but {n} doubts\n"),
        _ => {}
    }
    s
}

/// A campaign as far as a diagnosis looks before it fits anything.
///
/// # Errors
/// Where it cannot be read at all; what contradicts is among what is understood.
fn understood(dir: &Path, isolation: &Isolation) -> Result<Understood> {
    let agreed = agreement(&record::load(dir, &mechanisms::terms())?);
    let of_dir = |text: &String| format!("{}: {text}", dir.shown());
    let mut c = crate::campaign::load(dir).map_err(|e| match agreed.contradictions.first() {
        Some(first) => e.context(of_dir(first)),
        None => e,
    })?;
    let machine = crate::campaign::machine(&mut c, isolation)?;
    let c = c;
    let mut u = Understood {
        folder: dir.into(),
        name: c.name.clone(),
        kind: c.kind.name(),
        moving_mass: c.moving_mass,
        levels: c.levels.len(),
        simulation: Simulation { k: c.simulation.k, p: c.simulation.p, terms: c.simulation.terms.clone() },
        recordings: c.recordings.iter().map(|r| row(&c, r)).collect(),
        notes: c.warnings.clone(),
        compared: agreed.compared,
        doubts: agreed.doubts,
        noise: Vec::new(),
        simulated: Vec::new(),
        errors: agreed.contradictions.iter().map(of_dir).collect(),
    };
    let lines = |e: Invalid| -> Vec<String> { of_campaign(dir, &e).lines().map(str::to_string).collect() };
    let (data, guess) = match condition_on(&c, machine.as_ref()) {
        Ok(conditioned) => (conditioned.data, conditioned.guess),
        Err(e) => {
            u.errors.extend(lines(e));
            return Ok(u);
        }
    };
    let noise = |channel: Channel| {
        let noise = data.noise[channel.index()].marginal();
        let over_range = noise / data.range[channel.index()];
        Noise { channel: channel.name(), unit: channel.unit(), noise, over_range }
    };
    u.noise = Channel::ALL.into_iter().filter(|k| data.has(*k)).map(noise).collect();
    if let Err(e) = diagnose::plausible::check(&c, &data) {
        // a unit that was taken for another is told already
        let further = lines(e).into_iter().filter(|l| !u.errors.contains(l)).collect::<Vec<_>>();
        u.errors.extend(further);
    }
    if let Some(m) = machine {
        u.notes.extend(m.facts().notes.iter().cloned());
        u.simulated = simulated(&c, &data, &guess);
        u.errors.extend(m.troubles().iter().map(|t| format!("{}: {t}", dir.shown())));
    }
    Ok(u)
}

/// What FMUs make of every recording with the values of the system file.
fn simulated(c: &Campaign, data: &Data, guess: &Guess) -> Vec<Simulated> {
    let structure = Structure::given(c, data);
    let problem = Problem::new(data, structure.model());
    let Some(theta) = structure.starts(guess).into_iter().next() else { return Vec::new() };
    let ends = |y: &[f64]| y.iter().fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(*v), high.max(*v)]);
    let mut all = Vec::new();
    for (r, rec) in data.records.iter().enumerate() {
        let local = problem.fit_local(&theta, r, &data.local_start(r), &|n| n == Nuisance::Start);
        let (trace, y) = problem.predict(&theta, r, &local);
        for k in data.compared(r).filter(|_| trace.ok) {
            let Some(read) = &rec.y[k.index()] else { continue };
            let simulated = &y[k.index()];
            all.push(Simulated {
                file: rec.file.clone(),
                channel: k.name(),
                unit: k.unit(),
                recorded: ends(read),
                simulated: ends(simulated),
                off: nrmse(read, simulated).unwrap_or(f64::NAN),
            });
        }
    }
    all
}

/// An error, and where the documentation says what is right.
fn linked(error: &dyn Display, section: Section) -> String {
    format!("{error}; see {}", section.link())
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut all = Vec::new();
    let mut failed = false;
    let isolation = a.fmus.isolation()?;
    for dir in &a.campaigns {
        if let Err(e) = crate::campaign::of_folder(dir) {
            failed = true;
            print::error(&format!("{e:#}"));
            continue;
        }
        match understood(dir, &isolation) {
            Ok(u) => {
                // what is to be one JSON text is printed at the end
                if !a.form.json {
                    print::answer(&words(&u))?;
                }
                u.errors.iter().for_each(|e| print::error(&linked(e, Section::WhatContradicts)));
                failed |= !u.errors.is_empty();
                all.push(u);
            }
            Err(e) => {
                failed = true;
                match e.downcast_ref::<RecordErrors>() {
                    Some(all) => all.0.iter().for_each(|e| print::error(&linked(e, e.section))),
                    None => {
                        let of_fmus = e.downcast_ref::<RecordError>().map(|e| e.section);
                        print::error(&linked(&format!("{e:#}"), of_fmus.unwrap_or(Section::NoImpact)))
                    }
                }
            }
        }
    }
    print::answer(&a.form.of(&all, |_| String::new())?)?;
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
