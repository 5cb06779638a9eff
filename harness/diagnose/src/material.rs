//! Material or not: what each mechanism named does to the figures an engineer asks for, and what nobody can explain.

use estimate::fitted::Fitted;
use estimate::problem::Problem;
use mechanisms::physics::Physics;
use plant::chain::readings;
use plant::simulate::{simulate, Local, Setup};
use record::{largest, Channel, Kind};
use serde::Serialize;

/// Relative change of what a campaign is judged by, mean over its recordings, 1; None where a campaign has no such figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Effect {
    /// Of the largest force read.
    pub peak_force: Option<f64>,
    /// Of the rebound speed over the speed at touch, of the first contact.
    pub restitution: Option<f64>,
    /// Of the time from touch to leaving the nominal surface.
    pub contact_time: Option<f64>,
    /// Of the deepest position.
    pub depth: Option<f64>,
}

/// What is left that no mechanism named explains.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Remainder {
    /// Slow part of the residual, rms over range, mean of recordings and channels, 1.
    pub share_of_range: f64,
    /// Mean relative difference of the largest force (or acceleration) read and simulated, 1.
    pub peak_force: f64,
    pub text: String,
}

/// Share of a channel's range below which a slow remainder is of no matter: instruments of the best class err by as much
/// (accuracy class 0.1).
const MATERIAL: f64 = 1e-3;

impl Remainder {
    /// What a law that was learned leaves: its misfit, rms over the range of force; `unknown`: whether that is more than laws are
    /// off by, or has no name.
    /// `peaks`: mean relative difference of the largest force read and of the law, 1.
    pub fn of_a_law_learned(misfit: f64, peaks: f64, unknown: bool) -> Remainder {
        let of = if unknown { "beyond what is named" } else { "of no single cause" };
        Remainder { share_of_range: misfit, peak_force: peaks, text: format!("{:.2} % of range, {of}", 100.0 * misfit) }
    }

    /// Whether it is more than what the best instruments err by.
    pub fn is_material(&self) -> bool {
        self.share_of_range >= MATERIAL
    }
}

/// Figures of one simulated recording.
struct Figures {
    peak: f64,
    restitution: f64,
    contact_time: f64,
    depth: f64,
}

fn figures(p: &Physics, s: &Setup, local: &Local) -> Option<Figures> {
    let trace = simulate(p, s, local);
    if !trace.ok {
        return None;
    }
    let y = readings(p, &trace, &s.time);
    let at = |t: f64| s.time.iter().position(|u| *u >= t).unwrap_or(s.time.len() - 1);
    let (touch, leave) = (at(trace.touch), at(trace.leave));
    let (v, w) = (trace.velocity[touch], trace.velocity[leave.min(s.time.len() - 1)]);
    Some(Figures {
        peak: largest(&y[Channel::Force.index()]),
        restitution: if trace.leave < *s.time.last()? { -w / v } else { f64::NAN },
        contact_time: if trace.leave < *s.time.last()? { trace.leave - trace.touch } else { f64::NAN },
        depth: trace.position.iter().cloned().fold(0.0, f64::max),
    })
}

/// Share of a figure below which it is the mechanism that makes it: beside what the simulation without it has left, no relative
/// change says anything.
const NOTHING_LEFT: f64 = 0.5;

/// Relative change from `b` to `a`, 1; None where there is little of `b`.
fn relative(a: f64, b: f64) -> Option<f64> {
    let q = a / b - 1.0;
    (q.is_finite() && b.abs() >= NOTHING_LEFT * a.abs()).then_some(q)
}

/// What `chosen`'s term `term` does, beside the same simulation without it.
pub fn effect(chosen: &Fitted, term: usize) -> Effect {
    let data = &chosen.data;
    let problem = chosen.problem();
    let without = chosen.structure.without(term);
    let theta = chosen.structure.theta_without(&chosen.fit.point.theta, term);
    let (with, bare) = (chosen.physics(), Problem::new(data, without.model()).physics(&theta));
    let mut changes: [Vec<f64>; 4] = Default::default();
    for (r, rec) in data.records.iter().enumerate() {
        let local = problem.local(&chosen.fit.point.locals[r]);
        let (Some(a), Some(b)) = (figures(&with, &rec.setup, &local), figures(&bare, &rec.setup, &local)) else {
            continue;
        };
        let pairs =
            [(a.peak, b.peak), (a.restitution, b.restitution), (a.contact_time, b.contact_time), (a.depth, b.depth)];
        for (change, (a, b)) in changes.iter_mut().zip(pairs) {
            change.extend(relative(a, b));
        }
    }
    let mean = |v: &[f64]| (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64);
    let moves = data.kind != Kind::Indentation;
    Effect {
        peak_force: mean(&changes[0]),
        restitution: mean(&changes[1]).filter(|_| moves),
        contact_time: mean(&changes[2]).filter(|_| moves),
        depth: mean(&changes[3]).filter(|_| moves),
    }
}

/// Samples over which a residual is averaged before it counts as more than noise.
const SLOW: usize = 24;

/// What `chosen` leaves; `unknown`: whether a single cause outside the vocabulary is likely.
pub fn remainder(chosen: &Fitted, unknown: bool) -> Remainder {
    let data = &chosen.data;
    let (mut share, mut n) = (0.0, 0.0);
    let (mut peak, mut peaks) = (0.0, 0.0);
    for (r, rec) in data.records.iter().enumerate() {
        let (_, y) = chosen.predict(r);
        for c in data.compared(r) {
            let i = c.index();
            let Some(read) = &rec.y[i] else { continue };
            let kept = |k: &usize| rec.weight[i][*k] > 0.0;
            let left = rec.left_of(c, &y[i]).unwrap_or_default();
            let means: Vec<f64> = (0..read.len())
                .filter(kept)
                .map(|k| left[k])
                .collect::<Vec<f64>>()
                .chunks_exact(SLOW)
                .map(|w| w.iter().sum::<f64>() / SLOW as f64)
                .collect();
            if means.is_empty() || data.range[i] <= 0.0 {
                continue;
            }
            let square = means.iter().map(|m| m * m).sum::<f64>() / means.len() as f64;
            let noise = data.noise[i].marginal().powi(2) / SLOW as f64;
            share += (square - noise).max(0.0).sqrt() / data.range[i];
            n += 1.0;
            if c != Channel::Penetration {
                peak += (largest(read) / largest(&y[i]) - 1.0).abs();
                peaks += 1.0;
            }
        }
    }
    let share_of_range = if n > 0.0 { share / n } else { 0.0 };
    let cause = if unknown { "of a cause that no mechanism known explains" } else { "of no single cause" };
    Remainder {
        share_of_range,
        peak_force: if peaks > 0.0 { peak / peaks } else { 0.0 },
        text: format!("{:.2} % of range, {cause}", 100.0 * share_of_range),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_the_mechanism_makes_is_changed_by_no_percentage() {
        assert_eq!((relative(6.9, 1.0), relative(1.0, 0.0), relative(f64::NAN, 1.0)), (None, None, None));
        assert_eq!((relative(1.5, 1.0), relative(0.25, 1.0)), (Some(0.5), Some(-0.75)));
    }
}
