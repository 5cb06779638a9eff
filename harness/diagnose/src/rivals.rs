//! The candidates beside the one chosen, each with the score that counts: on levels it did not see.

use super::decide::Decision;
use super::heldout::held_out;

/// A candidate and how it did.
#[derive(Clone, Debug)]
pub struct Rival {
    pub name: String,
    pub form: String,
    pub origin: &'static str,
    /// Fall of chi^2 against the base.
    pub gain: f64,
    /// Held-out misfit over range; None where it was not worth the time.
    pub heldout: Option<f64>,
    /// Whether it is (part of) what was chosen, or tied with it.
    pub chosen: bool,
    pub tied: bool,
    /// False for what stands in for physics nobody has named.
    pub named: bool,
}

/// Rivals whose held-out score is worked out.
const SCORED: usize = 3;

/// Every single candidate, best first; the chosen one, the ties and the best few wrong ones with held-out scores.
pub fn rivals(d: &Decision, after: Option<f64>) -> Vec<Rival> {
    let chosen = d.chosen.names();
    let tied: Vec<&str> = d.ties.iter().flatten().copied().collect();
    let mut scored = 0;
    d.singles
        .iter()
        .map(|s| {
            let term = &s.structure.terms()[0];
            let name = term.name();
            let is_chosen = chosen.contains(&name);
            let gain = d.base.chi2() - s.chi2();
            let heldout = if d.detected && chosen == [name] {
                after
            } else if d.detected && scored < SCORED && gain > 0.0 {
                scored += 1;
                Some(held_out(s).nrmse)
            } else {
                None
            };
            Rival {
                name: name.to_string(),
                form: term.form.label.to_string(),
                origin: term.mechanism.origin.name(),
                gain,
                heldout,
                chosen: is_chosen,
                tied: tied.contains(&name),
                named: term.mechanism.named,
            }
        })
        .collect()
}
