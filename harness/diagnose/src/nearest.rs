//! The equation that comes nearest to a law learned of imposed motion, of those that an FMU can hold: the one that predicts levels
//! not seen best.

use crate::expand::SLOW;
use crate::heldout::{held_out, HeldOut};
use crate::holding::can_be_held;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Nuisance, Problem};
use estimate::structure::Term;
use std::sync::Arc;

/// Equations at most that are fitted anew, the best of the search first: each costs as much as a fit and one of every level.
const TRIED: usize = 3;
/// Starts of a term that is added anew, the most promising first.
const STARTS: usize = 4;
/// Standard deviation of what an FMU has none of, a stiffness of each recording (ln) and a slope of the free line (share of the range of
/// force): next to none.
const NONE: f64 = 1e-6;

/// Of the equations `fits` that hold nothing but mechanisms of these `names` that an FMU can hold, the one that predicts levels not
/// seen best, with one law for all recordings, and those predictions. `base`: the simulation as given. None where it misses
/// `worst` of range or more.
pub fn nearest(base: &Fitted, fits: &[Fitted], names: &[&str], worst: f64) -> Option<(Fitted, HeldOut)> {
    let is_held = |t: &Term| names.contains(&t.name()) && can_be_held(t.mechanism);
    let holds = |f: &&Fitted| !f.structure.terms().is_empty() && f.structure.terms().iter().all(is_held);
    let mut all: Vec<&Fitted> = fits.iter().filter(holds).collect();
    if all.is_empty() {
        return None;
    }
    all.sort_by(|a, b| a.chi2().total_cmp(&b.chi2()));
    let mut data = (*base.data).clone();
    (data.repeat_scatter, data.tilt_share) = (NONE, NONE);
    let data = Arc::new(data);
    let base = of_one_law(base, &data);
    let fitted = all.into_iter().take(TRIED).map(|f| again(&base, f, &data)).filter(|f| f.at_bounds().is_empty());
    let predicted = fitted.map(|f| {
        let h = held_out(&f);
        (f, h)
    });
    predicted.min_by(|a, b| a.1.nrmse.total_cmp(&b.1.nrmse)).filter(|(_, h)| h.nrmse < worst)
}

/// The equation of `f` on `data`, fitted from where it was and, where its terms have starts of their own, from `base` and those. A
/// recording's own stiffness may have taken the place of what depends on its rate, and its free line that of what the law cannot bend.
fn again(base: &Fitted, f: &Fitted, data: &Arc<Data>) -> Fitted {
    let terms = f.structure.terms();
    let has_starts = terms.iter().all(|t| t.form.extends.is_none());
    let add = |from: Option<Fitted>, t: &Term| from?.add(t, STARTS, &SLOW);
    let anew = if has_starts { terms.iter().fold(Some(base.clone()), add) } else { None };
    let as_it_was = of_one_law(f, data);
    match anew {
        Some(a) if a.chi2() < as_it_was.chi2() => a,
        _ => as_it_was,
    }
}

/// The equation of `f` on `data`, fitted from where it was but for each recording's own stiffness and free line.
fn of_one_law(f: &Fitted, data: &Arc<Data>) -> Fitted {
    let problem = Problem::new(data, f.structure.model());
    let mut locals = f.point().locals.clone();
    let own = |n: &Nuisance| matches!(n, Nuisance::Stiffness | Nuisance::Tilt);
    for (k, _) in problem.nuisances().iter().enumerate().filter(|(_, n)| own(n)) {
        locals.iter_mut().for_each(|l| l[k] = 0.0);
    }
    let start = problem.evaluate(f.point().theta.clone(), locals);
    Fitted::from(data, f.structure.clone(), start, &SLOW)
}
