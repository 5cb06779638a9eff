//! The posterior settles what the search has come to: which names are given, whether the cause is unknown, or nothing.

use super::candidate::Candidate;
use super::decide::Decision;
use super::evidence::{weigh, Evidences};
use super::heldout::{folds, held_out, windows, HeldOut};
use super::posterior::{Posterior, Table};
use estimate::fitted::Fitted;

/// Structures at most whose predictions of levels not seen are worked out before one stands.
const PREDICTED: usize = 4;
/// Structures of names that every fold chooses among, beside the simulation as given.
const CHOICES: usize = 3;

impl Decision {
    /// Weighs the evidence and decides by the posterior: the likeliest of names, an unknown cause and nothing. Predictions
    /// of levels not seen, by the simulation as given (`before`) and by what is chosen, count among the evidence; the
    /// latter are returned.
    pub fn settle(&mut self, before: &HeldOut) -> Option<HeldOut> {
        let (fits, mut evidence) = weigh(self);
        let table = Table::calibrated();
        let mut predicted: Vec<Option<HeldOut>> = fits.iter().map(|_| None).collect();
        if let Some(given) = evidence.structures.first_mut() {
            given.heldout = Some(before.nrmse);
        }
        let mut posterior = Posterior::new(&evidence, &table);
        for _ in 0..PREDICTED {
            let i = likeliest(&posterior, &fits, &evidence);
            if predicted[i].is_some() || fits[i].structure.terms().is_empty() {
                break;
            }
            let of = held_out(&fits[i]);
            evidence.structures[i].heldout = Some(of.nrmse);
            predicted[i] = Some(of);
            posterior = Posterior::new(&evidence, &table);
        }
        let mut at = likeliest(&posterior, &fits, &evidence);
        if !fits[at].is_named() && evidence.is_worse(at) {
            at = 0;
        }
        let chosen = fits.get(at).unwrap_or(&self.base).clone();
        if chosen.is_named() && !chosen.structure.terms().is_empty() {
            let mut choices = vec![self.base.clone()];
            let near = posterior.causes.iter().filter(|c| !c.names.is_empty()).filter_map(|c| c.structure);
            choices.extend(near.take(CHOICES).map(|i| fits[i].clone()));
            self.folds = folds(&choices, &table);
            self.windows = windows(&choices[..choices.len().min(CHOICES)], &table);
        }
        // what differs between recordings of one level is seen by no force within one
        self.excess_scatter = chosen.excess_scatter_left(self.base.excess_scatter());
        let scatters = self.excess_scatter.is_some();
        let (nothing, unknown) = (posterior.nothing(), posterior.unknown());
        let is_unknown = unknown > nothing.max(1.0 - nothing - unknown);
        let adds = !chosen.structure.terms().is_empty();
        self.detected = adds || is_unknown || scatters;
        self.unexplained = is_unknown || scatters;
        self.ties = rivals(&posterior, &chosen);
        self.overdispersion.1 = chosen.overdispersion();
        (self.chosen, self.evidence, self.posterior) = (chosen, evidence, posterior);
        adds.then(|| predicted.swap_remove(at).unwrap_or_else(|| held_out(&self.chosen)))
    }
}

/// Index of the fit that stands for the likeliest of names, an unknown cause and nothing; the simulation as given is first.
fn likeliest(posterior: &Posterior, fits: &[Fitted], evidence: &Evidences) -> usize {
    let (nothing, unknown) = (posterior.nothing(), posterior.unknown());
    match posterior.best_named().and_then(|c| c.structure) {
        Some(best) if 1.0 - nothing - unknown >= nothing.max(unknown) => best,
        _ if unknown > nothing => stand_in(fits, evidence),
        _ => 0,
    }
}

/// What stands in for a cause that nobody has named: the fit of least cost among those with a stand-in that is not known to
/// predict worse, or nothing added.
fn stand_in(fits: &[Fitted], evidence: &Evidences) -> usize {
    let standing = (0..fits.len()).filter(|i| !fits[*i].is_named() && !evidence.is_worse(*i));
    standing.min_by(|a, b| fits[*a].cost().total_cmp(&fits[*b].cost())).unwrap_or(0)
}

/// Names that may stand in the place of each of the chosen ones: those of the credible set that differ in one name, and
/// those that no recordings part.
fn rivals(posterior: &Posterior, chosen: &Fitted) -> Vec<Vec<&'static str>> {
    let names = chosen.names();
    let candidates = chosen.structure.base().candidates();
    let rest = |set: &[&'static str], without: &str| -> Vec<&'static str> {
        let mut v: Vec<&'static str> = set.iter().copied().filter(|n| *n != without).collect();
        v.sort_unstable();
        v
    };
    let of = |i: usize| {
        let others = rest(&names, names[i]);
        let mut v: Vec<&'static str> = Vec::new();
        for cause in posterior.credible_set().iter().filter(|c| !c.is_unknown() && c.names.len() == names.len()) {
            let differs = cause.names.iter().find(|n| !names.contains(n));
            if let Some(n) = differs.filter(|n| rest(&cause.names, n) == others) {
                v.push(n);
            }
        }
        for n in chosen.structure.terms()[i].mechanism.hints.collinear_with {
            if !v.contains(n) && candidates.iter().any(|c| c.name() == *n) {
                v.push(n);
            }
        }
        v
    };
    (0..names.len()).map(of).collect()
}
