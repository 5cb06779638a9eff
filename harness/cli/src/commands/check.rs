//! `touchdown check`.

use anyhow::{anyhow, Context, Result};
use diagnose::figure::figure;
use estimate::condition::condition;
use estimate::impact::touch;
use record::{Campaign, Channel, Recording};
use std::path::PathBuf;
use std::process::ExitCode;
use touchdown::aligned::aligned;
use touchdown::campaign::{of_campaign, tell};

#[derive(clap::Args)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
}

/// What is known of each recording: its column's name, with the unit.
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

/// A row of the table; channels by their least and largest reading.
fn row(c: &Campaign, r: &Recording) -> [String; 10] {
    let time = r.all_times();
    let interval = (time[time.len() - 1] - time[0]) / (time.len() - 1).max(1) as f64;
    let (at, contact) = touch(c.kind, r, c.moving_mass.unwrap_or(1.0)).unwrap_or((f64::NAN, f64::NAN));
    let of = |channel: Channel| {
        r.channels[channel.index()].as_ref().map_or("-".to_string(), |y| {
            let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |m, v| (m.0.min(*v), m.1.max(*v)));
            format!("{} to {}", figure(low, ""), figure(high, ""))
        })
    };
    [
        r.file.clone(),
        r.order.to_string(),
        c.levels[r.level].1.clone(),
        time.len().to_string(),
        figure(interval, ""),
        figure(at, ""),
        figure(contact, ""),
        of(Channel::Force),
        of(Channel::Acceleration),
        of(Channel::Penetration),
    ]
}

/// The recordings as a table.
fn table(c: &Campaign) -> String {
    let head = COLUMNS.map(str::to_string);
    let rows: Vec<_> = std::iter::once(head).chain(c.recordings.iter().map(|r| row(c, r))).collect();
    aligned(&rows)
}

/// How a campaign is understood.
fn understood(c: &Campaign) -> String {
    let simulation = match (c.simulation.k, c.simulation.p) {
        (Some(k), Some(p)) => format!("k = {k} N/m^p, p = {p}"),
        _ => "not calibrated yet".to_string(),
    };
    let terms = if c.simulation.terms.is_empty() { "none".to_string() } else { c.simulation.terms.join(", ") };
    let mass = c.moving_mass.map_or(String::new(), |m| format!(", moving mass {m} kg"));
    format!(
        "{}: {} of {}{mass}; {} recordings at {} levels; simulation: {simulation}, terms: {terms}\n{}",
        c.dir.display(),
        c.kind.name(),
        c.name,
        c.recordings.len(),
        c.levels.len(),
        table(c)
    )
}

/// Checks one campaign as far as a diagnosis looks before it fits anything.
fn check(dir: &std::path::Path) -> Result<()> {
    let c = touchdown::campaign::load(dir)?;
    print!("{}", understood(&c));
    for w in &c.warnings {
        println!("  note: {w}");
    }
    let place = || dir.display().to_string();
    let conditioned = condition(&c).with_context(place)?;
    for channel in Channel::ALL.into_iter().filter(|k| conditioned.data.has(*k)) {
        let (noise, range) =
            (conditioned.data.noise[channel.index()].marginal(), conditioned.data.range[channel.index()]);
        println!(
            "  noise of {}: {}, {} of its range",
            channel.name(),
            figure(noise, channel.unit()),
            figure(100.0 * noise / range, "%")
        );
    }
    diagnose::plausible::check(&c, &conditioned.data).map_err(|e| anyhow!(of_campaign(dir, &e)))?;
    println!("  nothing contradicts");
    Ok(())
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut failed = false;
    for dir in &a.campaigns {
        if let Err(e) = check(dir) {
            failed = true;
            tell(&format!("{e:#}"));
        }
    }
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
