//! Two files brought together: each at an even rate, filtered, then both at common times.

use super::Settings;
use anyhow::{anyhow, Context, Result};
use assess::{cfc, sampling};
use diagnose::figure::figure;
use record::{read_wanted, Channel, Signals, Wanted};
use std::path::Path;

/// Fewest samples that both have to share.
const FEWEST: usize = 16;

/// One of both files.
pub struct Side<'a> {
    pub path: &'a Path,
    pub signals: Signals,
}

impl Side<'_> {
    /// Recording and simulation, the latter's times shifted.
    ///
    /// # Errors
    /// Everything wrong with both.
    pub fn read_both(s: &Settings) -> Result<(Side<'_>, Side<'_>)> {
        let wanted = Wanted { columns: s.columns.clone(), run: s.run };
        match (read_wanted(&s.recording, &wanted), read_wanted(&s.simulation, &wanted)) {
            (Ok(recording), Ok(mut simulation)) => {
                simulation.time.iter_mut().for_each(|t| *t += s.shift);
                let (recording, simulation) = (
                    Side { path: &s.recording, signals: recording },
                    Side { path: &s.simulation, signals: simulation },
                );
                Ok((recording, simulation))
            }
            (r, s) => {
                let errors: Vec<String> = [r.err(), s.err()].into_iter().flatten().map(|e| e.to_string()).collect();
                Err(anyhow!(errors.join("\n")))
            }
        }
    }

    /// At an even rate and filtered; what was done to it is listed in `notes`.
    fn even(&self, class: Option<f64>, notes: &mut Vec<String>) -> Result<Even> {
        let place = || self.path.display().to_string();
        let of = &self.signals;
        let mut e = match sampling::rate(&of.time) {
            Ok(rate) => Even { time: of.time.clone(), rate, channels: of.channels.clone() },
            Err(_) => {
                let rate = sampling::fine_rate(&of.time).with_context(place)?;
                let time = sampling::grid(of.time[0], of.time[of.time.len() - 1], rate).with_context(place)?;
                let name = self.path.file_name().unwrap_or_default().to_string_lossy();
                notes.push(format!("{name}: its sampling is not even: resampled at {}.", figure(rate, "Hz")));
                let at = |y: &Option<Vec<f64>>| Some(sampling::resample(&of.time, y.as_ref()?, &time));
                let channels = Channel::ALL.map(|c| at(&of.channels[c.index()]));
                Even { channels, time, rate }
            }
        };
        if let Some(class) = class {
            for y in e.channels.iter_mut().flatten() {
                *y = cfc::filter(y, e.rate, class).with_context(place)?;
            }
        }
        Ok(e)
    }
}

/// A file at an even rate.
struct Even {
    /// s
    time: Vec<f64>,
    /// Hz
    rate: f64,
    channels: [Option<Vec<f64>>; 3],
}

/// Both at common times.
pub struct Pair {
    /// s, even; one at least
    pub time: Vec<f64>,
    /// Hz
    pub rate: f64,
    /// Channels that both have: of the recording, of the simulation, SI.
    pub channels: Vec<(Channel, [Vec<f64>; 2])>,
}

impl Pair {
    /// Brings both to common times at the higher of both rates. `events`: whether there is something to compare without
    /// a common channel.
    ///
    /// # Errors
    /// No common channel, a common part of too few samples, or a class that cannot be had.
    pub fn new(
        recording: &Side,
        simulation: &Side,
        s: &Settings,
        events: bool,
        notes: &mut Vec<String>,
    ) -> Result<Pair> {
        let files = || format!("{}, {}", recording.path.display(), simulation.path.display());
        let common: Vec<Channel> = Channel::ALL
            .into_iter()
            .filter(|c| [recording, simulation].iter().all(|f| f.signals.channels[c.index()].is_some()))
            .collect();
        if common.is_empty() && !events {
            return Err(anyhow!(
                "{}:1: no channel is in both; give them a common one: force [N], acceleration [m/s^2] or penetration [m]",
                files()
            ));
        }
        note_left_out(recording, &common, notes);
        note_left_out(simulation, &common, notes);
        let (a, b) = (recording.even(s.cfc, notes)?, simulation.even(s.cfc, notes)?);
        let from = a.time[0].max(b.time[0]).max(s.from.unwrap_or(f64::MIN));
        let to = a.time[a.time.len() - 1].min(b.time[b.time.len() - 1]).min(s.to.unwrap_or(f64::MAX));
        let rate = a.rate.max(b.rate);
        let (spans, cure) = (spans(&a, &b), "shift the simulation with --shift, or give another --from and --to");
        let few = |n: usize| anyhow!("{}: {spans}: {n} samples of the part compared are too few; {cure}", files());
        if from > to {
            return Err(few(0));
        }
        let time = sampling::grid(from, to, rate).with_context(files)?;
        if time.len() < FEWEST {
            return Err(few(time.len()));
        }
        if (a.rate / b.rate - 1.0).abs() > 1e-6 {
            let [a, b, both] = [a.rate, b.rate, rate].map(|r| figure(r, "Hz"));
            notes.push(format!("the recording has {a} and the simulation {b}: both are compared at {both}."));
        }
        let at = |e: &Even, c: Channel| {
            let y = e.channels[c.index()].as_deref().unwrap_or_default();
            sampling::resample(&e.time, y, &time)
        };
        let channels = common.into_iter().map(|c| (c, [at(&a, c), at(&b, c)])).collect();
        Ok(Pair { time, rate, channels })
    }

    /// When the common part begins, s.
    pub fn from(&self) -> f64 {
        self.time[0]
    }

    /// When it ends, s.
    pub fn to(&self) -> f64 {
        self.time[self.time.len() - 1]
    }
}

/// From when to when each file runs.
fn spans(a: &Even, b: &Even) -> String {
    let span = |e: &Even| format!("{} to {}", figure(e.time[0], "s"), figure(e.time[e.time.len() - 1], "s"));
    format!("the recording runs from {}, the simulation from {}", span(a), span(b))
}

/// Notes which channels a file has for itself.
fn note_left_out(side: &Side, common: &[Channel], notes: &mut Vec<String>) {
    let name = side.path.file_name().unwrap_or_default().to_string_lossy();
    for c in Channel::ALL.iter().filter(|c| side.signals.channels[c.index()].is_some() && !common.contains(c)) {
        notes.push(format!("{name}: the other file has no channel {}: it was left out.", c.name()));
    }
}
