//! A recording beside a simulation of it, judged as validation engineers do: both filtered alike and on common times,
//! pulses, ISO/TS 18571, shock spectra, bounces.

mod bounces;
mod pair;

use anyhow::{Context, Result};
use assess::pulse::{pulse, Pulse};
use assess::rating::{self, Rating};
use assess::{sampling, srs};
pub use bounces::{BounceFigures, BounceTable, ImpactFigures};
use diagnose::figure::figure;
use estimate::levels::nrmse;
use pair::{Pair, Side};
use record::Channel;
use serde::Serialize;
use std::path::PathBuf;

/// Frequencies of a shock spectrum in an octave.
pub const EACH_OCTAVE: u32 = 6;
/// Octaves of a shock spectrum, up to a tenth of the sampling rate: above that the filter's samples miss peaks.
const OCTAVES: i32 = 10;

/// What is to be compared, and how.
#[derive(Clone, Debug)]
pub struct Settings {
    pub recording: PathBuf,
    pub simulation: PathBuf,
    /// Columns of either file that are channels, and the run of the simulation.
    pub columns: Vec<(String, String)>,
    pub run: Option<f64>,
    /// Channel frequency class, Hz; None: nothing is filtered.
    pub cfc: Option<f64>,
    /// Quality of the shock spectrum's oscillators; None: no spectrum.
    pub quality: Option<f64>,
    /// Part of the recording's clock that is compared, s.
    pub from: Option<f64>,
    pub to: Option<f64>,
    /// Added to the simulation's times, s.
    pub shift: f64,
    /// Sampling rate at which channels are rated, Hz.
    pub rating_rate: f64,
}

/// A pulse's figures, SI.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PulseFigures {
    pub peak: f64,
    pub time: f64,
    pub width: Option<f64>,
    pub impulse: Option<f64>,
}

impl From<Pulse> for PulseFigures {
    fn from(p: Pulse) -> PulseFigures {
        PulseFigures { peak: p.peak, time: p.time, width: p.width, impulse: p.impulse }
    }
}

/// Scores of ISO/TS 18571.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Scores {
    pub corridor: f64,
    pub phase: f64,
    pub magnitude: f64,
    pub slope: f64,
    pub overall: f64,
    pub grade: &'static str,
    /// By how much the simulation is late, s, where it correlates best.
    pub late: f64,
}

impl Scores {
    fn new(r: &Rating, rate: f64) -> Scores {
        let (corridor, phase, magnitude, slope) = (r.corridor, r.phase, r.magnitude, r.slope);
        Scores {
            corridor,
            phase,
            magnitude,
            slope,
            overall: r.overall,
            grade: r.grade.name(),
            late: r.late as f64 / rate,
        }
    }
}

/// One channel of both.
#[derive(Clone, Debug, Serialize)]
pub struct ChannelComparison {
    pub channel: &'static str,
    pub unit: &'static str,
    pub recording: Option<PulseFigures>,
    pub simulation: Option<PulseFigures>,
    /// rms of the difference over the recording's range.
    pub normalised_rms: Option<f64>,
    pub rating: Option<Scores>,
}

/// A shock response spectrum, m/s^2.
#[derive(Clone, Debug, Serialize)]
pub struct SpectrumValues {
    pub maximax: Vec<f64>,
    pub positive: Vec<f64>,
    pub negative: Vec<f64>,
}

/// Shock response spectra of both accelerations.
#[derive(Clone, Debug, Serialize)]
pub struct Spectra {
    pub quality: f64,
    /// Hz
    pub frequency: Vec<f64>,
    pub recording: SpectrumValues,
    pub simulation: SpectrumValues,
}

/// All that is reported of both.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub recording: PathBuf,
    pub simulation: PathBuf,
    /// Common part, s, of the recording's clock.
    pub from: f64,
    pub to: f64,
    /// Samples of it, and a second.
    pub samples: usize,
    pub rate: f64,
    pub cfc: Option<f64>,
    pub rating_rate: f64,
    pub channels: Vec<ChannelComparison>,
    pub spectra: Option<Spectra>,
    pub bounces: BounceTable,
    /// What was left out, resampled or could not be had.
    pub notes: Vec<String>,
}

/// Compares as `s` says.
///
/// # Errors
/// Everything wrong with either file; no common part or channel; a class or quality that cannot be had.
pub fn compare(s: &Settings) -> Result<Comparison> {
    let (recording, simulation) = Side::read_both(s)?;
    let mut notes: Vec<String> = [&recording, &simulation].iter().flat_map(|f| f.signals.notes.clone()).collect();
    let bounces = BounceTable::new(&recording.signals, &simulation.signals);
    let pair = Pair::new(&recording, &simulation, s, bounces.of_both(), &mut notes)?;
    let times = sampling::grid(pair.from(), pair.to(), s.rating_rate)
        .with_context(|| format!("--rating-rate {}", s.rating_rate))?;
    let mut channels = Vec::new();
    for (channel, y) in &pair.channels {
        let c = compared(*channel, &pair, y, &times, s.rating_rate, &mut notes);
        channels.push(c);
    }
    if s.cfc.is_none() && s.rating_rate < pair.rate * (1.0 - 1e-6) {
        let [rate, all] = [s.rating_rate, pair.rate].map(|r| figure(r, "Hz"));
        notes.push(format!("rated at {rate} of {all} without a filter: what is faster is folded; give --cfc."));
    }
    let spectra = s.quality.map(|q| spectra(&pair, q, s)).transpose()?;
    Ok(Comparison {
        recording: s.recording.clone(),
        simulation: s.simulation.clone(),
        from: pair.from(),
        to: pair.to(),
        samples: pair.time.len(),
        rate: pair.rate,
        cfc: s.cfc,
        rating_rate: s.rating_rate,
        channels,
        spectra,
        bounces,
        notes,
    })
}

/// One channel, of recording and simulation, compared; rated at `times`.
fn compared(
    channel: Channel,
    pair: &Pair,
    [recording, simulation]: &[Vec<f64>; 2],
    times: &[f64],
    rating_rate: f64,
    notes: &mut Vec<String>,
) -> ChannelComparison {
    let at = |y: &[f64]| sampling::resample(&pair.time, y, times);
    let rated = rating::rate(&at(recording), &at(simulation));
    let of_recording = pulse(&pair.time, recording);
    if let Err(e) = &rated {
        notes.push(format!("{}: no rating: {e}.", channel.name()));
    }
    let smoothed = rating::SMOOTHED as f64 / rating_rate;
    if let Some(width) = of_recording.and_then(|p| p.width).filter(|w| *w < smoothed && rated.is_ok()) {
        notes.push(format!(
            "{}: the pulse of {} is shorter than the {} over which slopes are smoothed at {}; --rating-rate resolves it, \
             outside of the standard.",
            channel.name(),
            figure(width, "s"),
            figure(smoothed, "s"),
            figure(rating_rate, "Hz")
        ));
    }
    ChannelComparison {
        channel: channel.name(),
        unit: channel.unit(),
        recording: of_recording.map(PulseFigures::from),
        simulation: pulse(&pair.time, simulation).map(PulseFigures::from),
        normalised_rms: nrmse(recording, simulation),
        rating: rated.ok().map(|r| Scores::new(&r, rating_rate)),
    }
}

/// Shock spectra of both accelerations.
fn spectra(pair: &Pair, quality: f64, s: &Settings) -> Result<Spectra> {
    let (_, y) = pair.channels.iter().find(|c| c.0 == Channel::Acceleration).with_context(|| {
        let files = format!("{}, {}", s.recording.display(), s.simulation.display());
        format!("{files}: --srs needs the channel acceleration in both; add acceleration [m/s^2], or leave --srs out")
    })?;
    let highest = pair.rate / 10.0;
    let frequency = srs::frequencies(highest / f64::from(OCTAVES).exp2(), highest, EACH_OCTAVE)?;
    let of = |y: &[f64]| -> Result<SpectrumValues> {
        let v = srs::spectrum(y, pair.rate, &frequency, quality).context("--srs")?;
        Ok(SpectrumValues { maximax: v.maximax, positive: v.positive, negative: v.negative })
    };
    let (recording, simulation) = (of(&y[0])?, of(&y[1])?);
    Ok(Spectra { quality, frequency, recording, simulation })
}
