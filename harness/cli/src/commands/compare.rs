//! `touchdown compare`.

use super::form::Form;
use crate::aligned::aligned;
use crate::compare::{
    compare, BounceFigures, BounceTable, ChannelComparison, Comparison, ImpactFigures, PulseFigures, Settings, Spectra,
    EACH_OCTAVE,
};
use crate::print::{self, Shown};
use anyhow::{anyhow, Result};
use diagnose::figure::figure;
use std::path::PathBuf;
use std::process::ExitCode;

/// Impacts whose figures are printed; --json has all.
const PRINTED: usize = 12;

const EXAMPLES: &str = "Examples:
  touchdown compare r01.csv simulated.csv --cfc 180
  touchdown compare r01.csv simulated.csv --cfc 1000 --srs 10 --json
  touchdown compare r01.csv simulated.csv --shift 0.0123 --from 0.01 --to 0.05
  touchdown compare fast.csv simulated.csv --rating-rate 1e6    # impacts of less than a millisecond
  touchdown compare r01.csv results.csv --map force=stop.F --run 2   # results of a tool with its own names, of run 2

Both files have a header of columns name [unit]: time and force, acceleration, penetration or closed, also as the last part
of a name (contact.force); without a unit they are in SI; other columns are left out. docs/src/how-to/compare.md says how every figure is worked out.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// CSV file of the recording, the reference
    recording: PathBuf,
    /// CSV file of the simulation: results.csv of a run, a prediction of a diagnosis, or another tool's
    simulation: PathBuf,
    /// Columns that are channels: CHANNEL=COLUMN, parted by commas, where names do not say so: force=contact.force
    #[arg(long, value_name = "MAP", value_delimiter = ',')]
    map: Vec<String>,
    /// Of results of several runs, the one of this number in the column run
    #[arg(long, value_name = "NUMBER")]
    run: Option<f64>,
    /// Filter both by this channel frequency class (SAE J211-1, ISO 6487): 60, 180, 600, 1000 or another, Hz
    #[arg(long, value_name = "CLASS")]
    cfc: Option<f64>,
    /// Shock response spectra of both accelerations, of oscillators of this quality, 1 / (2 damping ratio)
    #[arg(long, value_name = "Q")]
    srs: Option<f64>,
    /// Compare from this time of the recording on, s
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Compare up to this time of the recording, s
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Added to the simulation's times, s
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    shift: f64,
    /// Sampling rate at which channels are rated, Hz; ISO/TS 18571 has 10000
    #[arg(long, value_name = "HZ", default_value_t = assess::rating::RATE)]
    rating_rate: f64,
    #[command(flatten)]
    form: Form,
}

impl Arguments {
    fn settings(&self) -> Result<Settings> {
        if !(self.rating_rate > 0.0 && self.rating_rate.is_finite()) {
            return Err(anyhow!("--rating-rate {} is no sampling rate; give Hz above 0, as 10000", self.rating_rate));
        }
        if !self.shift.is_finite() {
            return Err(anyhow!("--shift {} is no time; give seconds", self.shift));
        }
        if let Some(at) = [self.from, self.to].into_iter().flatten().find(|t| t.is_nan()) {
            return Err(anyhow!("{at} is no time; give --from and --to seconds of the recording's clock"));
        }
        if let (Some(from), Some(to)) = (self.from, self.to) {
            if from >= to {
                return Err(anyhow!("--from {from} and --to {to} leave nothing; give --from before --to"));
            }
        }
        let pair = |m: &String| {
            let parts = m.split_once('=').map(|(c, n)| (c.trim().to_string(), n.trim().to_string()));
            parts.ok_or_else(|| anyhow!("--map {m}: no column is named; write --map force=COLUMN"))
        };
        Ok(Settings {
            columns: self.map.iter().map(pair).collect::<Result<_>>()?,
            run: self.run,
            recording: self.recording.clone(),
            simulation: self.simulation.clone(),
            cfc: self.cfc,
            quality: self.srs,
            from: self.from,
            to: self.to,
            shift: self.shift,
            rating_rate: self.rating_rate,
        })
    }
}

fn cell(v: Option<f64>) -> String {
    v.map_or("-".into(), |v| figure(v, ""))
}

fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_string).to_vec()
}

/// Unit of a channel's integral over time.
fn impulse_unit(c: &ChannelComparison) -> &'static str {
    match c.unit {
        "N" => "N s",
        "m/s^2" => "m/s",
        _ => "m s",
    }
}

/// Pulses of every channel, in recording and simulation.
fn pulses(channels: &[ChannelComparison]) -> String {
    let mut rows = vec![row(["channel", "", "peak", "at [s]", "width [s]", "impulse", ""])];
    for c in channels {
        let name = format!("{} [{}]", c.channel, c.unit);
        for (name, file, p) in [(name.as_str(), "recording", c.recording), ("", "simulation", c.simulation)] {
            let of = |value: fn(&PulseFigures) -> Option<f64>| cell(p.as_ref().and_then(value));
            let (peak, time) = (of(|p| Some(p.peak)), of(|p| Some(p.time)));
            rows.push(row([name, file, &peak, &time, &of(|p| p.width), &of(|p| p.impulse), impulse_unit(c)]));
        }
    }
    aligned(&rows)
}

/// Scores and normalised rms of every channel.
fn scores(c: &Comparison) -> String {
    let title = "ISO/TS 18571";
    let mut rows =
        vec![row([title, "corridor", "phase", "magnitude", "slope", "overall", "grade", "late [s]", "normalised rms"])];
    for c in &c.channels {
        let rms = cell(c.normalised_rms);
        rows.push(match c.rating {
            Some(r) => {
                let [z, p, m, s, all] =
                    [r.corridor, r.phase, r.magnitude, r.slope, r.overall].map(|v| format!("{v:.3}"));
                row([c.channel, &z, &p, &m, &s, &all, r.grade, &figure(r.late, ""), &rms])
            }
            None => row([c.channel, "-", "-", "-", "-", "-", "-", "-", &rms]),
        });
    }
    aligned(&rows)
}

/// Spectra at every octave, and where they differ most.
fn spectra(s: &Spectra) -> String {
    let db = |i: usize| 20.0 * (s.simulation.maximax[i] / s.recording.maximax[i]).log10();
    let head = format!("shock spectrum, Q = {}", s.quality);
    let mut rows = vec![row([&head, "recording [m/s^2]", "simulation [m/s^2]", "ratio [dB]"])];
    let line = |i: usize, what: &str| {
        let f = format!("{what}{}", figure(s.frequency[i], "Hz"));
        row([&f, &cell(Some(s.recording.maximax[i])), &cell(Some(s.simulation.maximax[i])), &format!("{:.2}", db(i))])
    };
    rows.extend((0..s.frequency.len()).step_by(EACH_OCTAVE as usize).map(|i| line(i, "")));
    let most = (0..s.frequency.len()).max_by(|a, b| db(*a).abs().total_cmp(&db(*b).abs()));
    rows.extend(most.map(|i| line(i, "most apart at ")));
    aligned(&rows)
}

/// The bounce table; nothing where neither file shows an impact.
fn bounces(t: &BounceTable) -> String {
    let both = [&t.recording, &t.simulation];
    if both.iter().all(|b| b.is_none()) {
        return String::new();
    }
    let mut rows = vec![row(["bounces", "recording", "simulation"])];
    let mut add = |what: &str, of: &dyn Fn(&BounceFigures) -> String| {
        let [r, s] = both.map(|b| b.as_ref().map_or("-".into(), of));
        rows.push(row([what, &r, &s]));
    };
    add("read off", &|b| b.by.into());
    add("first impact [s]", &|b| cell(Some(b.first)));
    add("last impact [s]", &|b| cell(Some(b.last)));
    add("impacts", &|b| b.count.to_string());
    add("bounce time until rest [s]", &|b| cell(b.bounce_time));
    let most = both.iter().filter_map(|b| Some(b.as_ref()?.count)).max().unwrap_or(0);
    type Of = fn(&ImpactFigures) -> Option<f64>;
    let figures: [(&str, Of); 4] = [
        ("at [s]", |i| Some(i.touch)),
        ("contact [s]", |i| i.contact),
        ("restitution by speeds", |i| i.restitution),
        ("restitution by flight times", |i| i.flight_ratio),
    ];
    for k in 0..most.min(PRINTED) {
        for (name, of) in figures {
            add(&format!("{}: {name}", k + 1), &|b| cell(b.impacts.get(k).and_then(of)));
        }
    }
    aligned(&rows)
}

/// All of it, for a terminal.
fn text(c: &Comparison) -> String {
    let filter = c.cfc.map_or("not filtered".into(), |class| format!("CFC {class}"));
    let mut parts = vec![format!(
        "{} and {}: {} s to {} s, {} samples at {}, {filter}; rated at {}\n",
        c.recording.shown(),
        c.simulation.shown(),
        figure(c.from, ""),
        figure(c.to, ""),
        c.samples,
        figure(c.rate, "Hz"),
        figure(c.rating_rate, "Hz")
    )];
    if !c.channels.is_empty() {
        parts.extend([pulses(&c.channels), scores(c)]);
    }
    parts.extend(c.spectra.as_ref().map(spectra));
    parts.push(bounces(&c.bounces));
    parts.push(c.notes.iter().map(|n| format!("  note: {n}\n")).collect());
    parts.retain(|p| !p.is_empty());
    parts.join("\n")
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let c = match compare(&a.settings()?) {
        Ok(c) => c,
        Err(e) => {
            print::error(&format!("{e:#}"));
            return Ok(ExitCode::from(2));
        }
    };
    print::answer(&a.form.of(&c, text)?)?;
    Ok(ExitCode::SUCCESS)
}
