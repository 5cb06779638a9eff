//! A campaign as estimation sees it: the simulation as its user has it, with the terms he lists.

use super::search::{MakeUp, Search};
use estimate::case::Case;
use estimate::prepare::Guess;
use record::Campaign;

/// Lowest exponent an estimation may reach: a law alone may want a flatter curve than any contact has.
const FLATTEST: f64 = 0.2;

impl Search<'_> {
    /// The campaign's simulation, to be estimated.
    pub fn case(&self, campaign: &Campaign, guess: Guess) -> Case<'_> {
        let s = &campaign.simulation;
        Case {
            data: self.data,
            guess,
            given: s.k.zip(s.p).map(|(k, p)| (k, p, s.mu_d.unwrap_or(0.0))),
            hysteresis: self.hysteresis,
            model: Box::new(|k, p, mu| {
                let mut m = self.model(&MakeUp::default(), k, p, mu);
                m.parameters[1].lower = FLATTEST;
                m
            }),
            describe: Box::new(|theta| {
                let mut at = theta.len() - self.given.iter().map(|t| t.form.parameters.len()).sum::<usize>();
                let mut out = Vec::new();
                for t in &self.given {
                    let n = t.form.parameters.len();
                    let of = t.form.describe(&theta[at..at + n], &self.context);
                    out.extend(of.into_iter().map(|(q, v, u)| (format!("{}: {q}", t.mechanism.name), v, u)));
                    at += n;
                }
                out
            }),
        }
    }
}
