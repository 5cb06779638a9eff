//! How near every simulation comes to the recordings, by the objective rating of ISO/TS 18571.

use super::pictures::{pulse, simulations};
use assess::rating::{rate, Grade, Rating};
use assess::sampling::{fine_rate, grid, resample};
use chart::{Datum, Page};
use diagnose::run::Outcome;
use record::{Campaign, Channel};

/// Samples of a pulse at most: more say nothing more of it, and warping costs their square.
const MOST: f64 = 1000.0;

/// Mean scores of a simulation on one channel, and how many recordings they are of.
#[derive(Default)]
struct Mean {
    sum: [f64; 5],
    count: f64,
}

impl Mean {
    fn add(&mut self, r: &Rating) {
        let scores = [r.overall, r.corridor, r.phase, r.magnitude, r.slope];
        self.sum.iter_mut().zip(scores).for_each(|(s, r)| *s += r);
        self.count += 1.0;
    }

    fn cells(&self) -> Vec<Datum> {
        let scores = self.sum.map(|s| s / self.count);
        let grade = Grade::of(scores[0]).name().into();
        scores.iter().map(|s| Datum::fixed(*s, 3)).chain([grade]).collect()
    }
}

/// The rating of `simulated` against what was `measured` from `from` to `to`, s; None where that is too short.
fn of_pulse(time: &[f64], measured: &[f64], simulated: &[f64], (from, to): (f64, f64)) -> Option<Rating> {
    let often = fine_rate(time).ok()?.min(MOST / (to - from));
    let even = grid(from, to, often).ok()?;
    rate(&resample(time, measured, &even), &resample(time, simulated, &even)).ok()
}

/// The table: every simulation and channel, means over all recordings.
pub fn table(page: Page, c: &Campaign, o: &Outcome) -> Page {
    let mut rows = Vec::new();
    for ch in Channel::ALL {
        for (name, _, courses) in simulations(o) {
            let mut mean = Mean::default();
            for (i, (r, s)) in c.recordings.iter().zip(courses).enumerate() {
                let Some(y) = &r.channels[ch.index()] else { continue };
                let whole = || Some((*r.time.first()?, *r.time.last()?));
                let Some(part) = pulse(c, o, i).or_else(whole) else { continue };
                let rated = of_pulse(&r.time, y, &s.readings[ch.index()], part);
                rated.iter().for_each(|r| mean.add(r));
            }
            if mean.count > 0.0 {
                rows.push([vec![ch.name().into(), name.into()], mean.cells()].concat());
            }
        }
    }
    if rows.is_empty() {
        return page;
    }
    page.section("Objective rating before and after")
        .paragraph(
            "ISO/TS 18571: 1 is a perfect match; above 0.94 excellent, above 0.80 good, above 0.58 fair. Of the first impact (of an \
             indentation all of it), at the recordings' own rates, means over all recordings; \u{201c}recalibrated\u{201d} and what follows \
             it are predictions.",
        )
        .values(
            &["channel", "simulation", "rating", "corridor", "phase", "magnitude", "slope", "grade"],
            &rows,
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_is_rated_by_itself_and_a_poorer_one_below() {
        // an uneven clock, and a rest after the pulse that would flatter everything
        let time: Vec<f64> = (0..400).map(|i| 1e-5 * (f64::from(i) + 0.2 * f64::from(i % 3))).collect();
        let pulse = |late: f64, height: f64| -> Vec<f64> {
            let of = |t: f64| if (0.0..1e-3).contains(&t) { height * (3141.6 * t).sin() } else { 0.0 };
            time.iter().map(|t| of(t - 5e-4 - late)).collect()
        };
        let rated = |late: f64, height: f64| {
            of_pulse(&time, &pulse(0.0, 1.0), &pulse(late, height), (3.5e-4, 1.9e-3)).unwrap().overall
        };
        assert!((rated(0.0, 1.0) - 1.0).abs() < 1e-12);
        assert!(rated(0.0, 0.9) < 0.97 && rated(0.0, 0.6) < rated(0.0, 0.9));
        assert!(rated(2e-4, 1.0) < 0.9);
        assert!(of_pulse(&time, &pulse(0.0, 1.0), &pulse(0.0, 1.0), (1e-3, 1.02e-3)).is_none());
    }
}
