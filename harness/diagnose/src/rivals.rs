//! The candidates beside the one chosen, each with the score that counts: on levels it did not see.

use super::decide::Decision;

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

/// Every single candidate, best first; with the misfit on levels not seen of those that the decision predicted them with.
pub fn rivals(d: &Decision) -> Vec<Rival> {
    let chosen = d.chosen.names();
    let tied: Vec<&str> = d.ties.iter().flatten().copied().collect();
    d.singles
        .iter()
        .map(|s| {
            let term = &s.structure.terms()[0];
            let name = term.name();
            let heldout = d.evidence.structures.iter().filter(|w| w.names == [name]).find_map(|w| w.heldout);
            Rival {
                name: name.to_string(),
                form: term.form.label.to_string(),
                origin: term.mechanism.origin.name(),
                gain: d.base.chi2() - s.chi2(),
                heldout,
                chosen: chosen.contains(&name),
                tied: tied.contains(&name),
                named: term.mechanism.named,
            }
        })
        .collect()
}
