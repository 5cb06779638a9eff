//! Whether the coupling of FMUs is fine enough to be judged by: half its steps have to read the same.

use crate::condition::Invalid;
use crate::fitted::Fitted;
use crate::problem::{Data, Options};
use rayon::prelude::*;
use std::sync::Arc;

/// Times that the steps are halved at most.
const MOST: u32 = 7;
/// Root mean square of what halving changes, in standard deviations of the noise, up to which steps are fine enough.
const UNFELT: f64 = 0.2;

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

/// What differs between two readings of `data` in any channel of any recording, root mean square in standard deviations of its
/// noise; infinite where one of the two is not there.
fn change(data: &Data, before: &[Reading], after: &[Reading]) -> f64 {
    let of = |(r, pair): (usize, (&Reading, &Reading))| {
        let (Some(y), Some(z)) = pair else { return f64::INFINITY };
        let each = data.compared(r).map(|c| {
            let i = c.index();
            let sum: f64 = y[i].iter().zip(&z[i]).map(|(a, b)| (a - b).powi(2)).sum();
            (sum / y[i].len() as f64).sqrt() / data.noise[i].marginal()
        });
        each.fold(0.0, f64::max)
    };
    before.iter().zip(after).enumerate().map(of).fold(0.0, f64::max)
}

/// `base` with the steps of its coupling so fine that half of them read the same; as it is where no FMUs simulate.
///
/// # Errors
/// No steps tried are fine enough: a coupling that shows in the readings would be taken for physics.
pub(crate) fn fine_enough(base: Fitted) -> Result<Fitted, Invalid> {
    let Some(machine) = base.data.machine() else { return Ok(base) };
    // what it was fitted with may have been coarser
    let fitted_on = |at: &Fitted| {
        let start = at.problem().evaluate(at.point().theta.clone(), at.point().locals.clone());
        Fitted::from(&at.data, at.structure.clone(), start, &Options::default())
    };
    if machine.facts().fixed_step.is_some() {
        return Ok(fitted_on(&base));
    }
    let mut least = f64::INFINITY;
    let mut at = base.clone();
    let mut read = readings(&at);
    for level in 0..=MOST {
        let finer = base.on(Arc::new(at_level(&base.data, level + 1)));
        let read_finer = readings(&finer);
        let change = change(&at.data, &read, &read_finer);
        least = least.min(change);
        if change <= UNFELT {
            return Ok(fitted_on(&at));
        }
        (at, read) = (finer, read_finer);
    }
    Err(Invalid(format!(
        "the coupling of the FMUs is too coarse to be judged by: halving its steps changes the readings by {least:.1} standard \
         deviations of their noise even at the {MOST}th time; look at FMUs that step in large steps of their own, or that jump"
    )))
}
