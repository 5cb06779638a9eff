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

/// What halving the steps of `base` once more changes in any channel of any recording, root mean square in standard
/// deviations of its noise; infinite where one of the two cannot be simulated.
pub(crate) fn change(base: &Fitted) -> f64 {
    let level = base.data.records.first().and_then(|r| r.setup.machine.as_ref()).map_or(0, |s| s.level);
    let finer = base.on(Arc::new(at_level(&base.data, level + 1)));
    let of = |r: usize| {
        let ((a, y), (b, z)) = (base.predict(r), finer.predict(r));
        if !a.ok || !b.ok {
            return f64::INFINITY;
        }
        let each = base.data.compared(r).map(|c| {
            let i = c.index();
            let sum: f64 = y[i].iter().zip(&z[i]).map(|(a, b)| (a - b).powi(2)).sum();
            (sum / y[i].len() as f64).sqrt() / base.data.noise[i].marginal()
        });
        each.fold(0.0, f64::max)
    };
    (0..base.data.records.len()).into_par_iter().map(of).collect::<Vec<_>>().into_iter().fold(0.0, f64::max)
}

/// `base` with the steps of its coupling so fine that half of them read the same; as it is where no FMUs simulate.
///
/// # Errors
/// No steps tried are fine enough: a coupling that shows in the readings would be taken for physics.
pub(crate) fn fine_enough(base: Fitted) -> Result<Fitted, Invalid> {
    let Some(machine) = base.data.machine() else { return Ok(base) };
    let fixed = machine.facts().fixed_step;
    let mut least = f64::INFINITY;
    let mut at = base.clone();
    for level in 0..=MOST {
        if level > 0 {
            at = base.on(Arc::new(at_level(&base.data, level)));
        }
        let change = change(&at);
        least = least.min(change);
        if change <= UNFELT || fixed.is_some() {
            // what it was fitted with may have been coarser
            let start = at.problem().evaluate(at.point().theta.clone(), at.point().locals.clone());
            return Ok(Fitted::from(&at.data, at.structure.clone(), start, &Options::default()));
        }
    }
    Err(Invalid(format!(
        "the coupling of the FMUs is too coarse to be judged by: halving its steps changes the readings by {least:.1} standard \
         deviations of their noise even at the {MOST}th time; look at FMUs that step in large steps of their own, or that jump"
    )))
}
