//! Whether the coupling of FMUs is fine enough to be judged by: half its steps have to read the same.
//!
//! An error of a fifth of the noise shows in no single sample, and in chi^2 of thousands of them it is some hundred: enough
//! for a wrong name. So steps are halved until halving them changes chi^2 by next to nothing.

use crate::condition::{Guess, Invalid};
use crate::fitted::Fitted;
use crate::problem::{Data, Fit, Options};
use rayon::prelude::*;
use std::sync::Arc;

/// Times that the steps are halved at most.
const MOST: u32 = 7;
/// Sum of squares of what halving changes, in standard deviations of the noise, up to which steps are fine enough, where the
/// fit leaves noise; as many times more as it leaves more. So much may chi^2 change: one or two nats.
const UNFELT: f64 = 4.0;
/// Root mean square of the same in any channel of any recording that has to be reached at least.
const COARSEST: f64 = 0.2;
/// Times that steps as fine as that are halved further, where chi^2 still changes.
const FURTHER: u32 = 2;

/// The same data with the steps of the coupling halved `level` times.
fn at_level(data: &Data, level: u32) -> Data {
    let mut d = data.clone();
    d.records.iter_mut().filter_map(|r| r.setup.machine.as_mut()).for_each(|s| s.level = level);
    d
}

/// What a recording reads, by channel; None where it cannot be simulated.
type Reading = Option<[Vec<f64>; 3]>;

/// What every recording reads by `f`.
fn readings(f: &Fitted) -> Vec<Reading> {
    let of = |r: usize| {
        let (trace, y) = f.predict(r);
        trace.ok.then_some(y)
    };
    (0..f.data.records.len()).into_par_iter().map(of).collect()
}

/// What differs between two readings, in standard deviations of the noise.
struct Change {
    /// Root mean square in the channel and the recording where it is largest.
    largest: f64,
    /// Sum of squares over all samples.
    squares: f64,
}

/// The change of the readings of `data`; infinite where a recording is not there before or after.
fn change(data: &Data, before: &[Reading], after: &[Reading]) -> Change {
    let mut all = Change { largest: 0.0, squares: 0.0 };
    for (r, pair) in before.iter().zip(after).enumerate() {
        let (Some(y), Some(z)) = pair else { return Change { largest: f64::INFINITY, squares: f64::INFINITY } };
        for c in data.compared(r) {
            let i = c.index();
            let sum: f64 = y[i].iter().zip(&z[i]).map(|(a, b)| (a - b).powi(2)).sum();
            let squares = sum / data.noise[i].marginal().powi(2);
            all.squares += squares;
            all.largest = all.largest.max((squares / y[i].len() as f64).sqrt());
        }
    }
    all
}

/// `base` with the steps of its coupling so fine that half of them read the same; as it is where no FMUs simulate. Where coarse
/// steps have led the fit astray, to where none are fine enough, it begins anew with steps that are so for the simulation as given.
///
/// # Errors
/// No steps tried are fine enough: a coupling that shows in the readings would be taken for physics.
pub(crate) fn fine_enough(base: Fitted, guess: &Guess) -> Result<Fitted, Invalid> {
    let Some(machine) = base.data.machine() else { return Ok(base) };
    // what it was fitted with may have been coarser
    let fitted_on = |at: Fitted| {
        let start = at.problem().evaluate(at.point().theta.clone(), at.point().locals.clone());
        Fitted::from(&at.data, at.structure.clone(), start, &Options::default())
    };
    if machine.facts().fixed_step.is_some() {
        return Ok(fitted_on(base));
    }
    let found = with_fine_steps(&base).or_else(|_| {
        let point = base.problem().start(base.structure.starts(guess).swap_remove(0));
        let given = Fitted { fit: Fit { point, ..base.fit.clone() }, ..base.clone() };
        with_fine_steps(&Fitted::base(&with_fine_steps(&given)?.data, &base.structure, guess))
    });
    found.map(fitted_on)
}

/// The same fit held against its recordings with the steps of the coupling so fine that half of them read the same.
///
/// # Errors
/// No steps tried are.
fn with_fine_steps(base: &Fitted) -> Result<Fitted, Invalid> {
    let unfelt = UNFELT * (base.chi2() / base.data.samples().max(1) as f64).max(1.0);
    let mut least = f64::INFINITY;
    let mut fine_from = None;
    let mut at = base.clone();
    let mut read = readings(&at);
    let first = base.data.records.iter().filter_map(|r| r.setup.machine.as_ref()).map(|s| s.level).max().unwrap_or(0);
    for level in first..=MOST.max(first) {
        let finer = base.on(Arc::new(at_level(&base.data, level + 1)));
        let read_finer = readings(&finer);
        let change = change(&at.data, &read, &read_finer);
        least = least.min(change.largest);
        if change.largest <= COARSEST {
            fine_from.get_or_insert(level);
        }
        if fine_from.is_some_and(|from| change.squares <= unfelt || level >= MOST.min(from + FURTHER)) {
            return Ok(at);
        }
        (at, read) = (finer, read_finer);
    }
    Err(Invalid(format!(
        "the coupling of the FMUs is too coarse to be judged by: halving its steps changes the readings by {least:.1} standard \
         deviations of their noise even at the {MOST}th time; look at FMUs that step in large steps of their own, or that jump"
    )))
}
