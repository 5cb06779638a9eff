//! A second effect beside the first: tried beside the best few, believed where it carries its share, and swapped for
//! what does better beside the other.

use super::candidate::{Candidate, PENALTY, WHITE};
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::Options;

/// A second effect has to bring this share of what the first brought.
const SECOND_SHARE: f64 = 0.03;
/// The part of that share which does where it takes the residual back to noise.
const WHITENING: f64 = 0.15;
/// Overdispersion of the first effect's residual up to which nothing is sought beside a strong one.
const WHITE_ALONE: f64 = 1.05;
/// Gain of the first effect up to which a second is sought however white the residual.
const FAINT: f64 = 3000.0;
/// Share of the best gain from which another first effect is tried.
const FIRST_SHARE: f64 = 0.8;
/// Share of its gain from which its plainer form is.
const PLAIN_SHARE: f64 = 0.9;
/// First effects tried, seconds weighed beside each, and rounds of swaps.
const FIRSTS: usize = 2;
const SECONDS: usize = 4;
const SWAPS: usize = 2;
/// Overdispersion from which a pair's two effects are swapped for better ones.
const SWAPPED: f64 = 1.1;
/// Overdispersion from which swaps are tried although no pair is believed yet.
const SWAPPED_UNBELIEVED: f64 = 2.0;

/// How what is left of a pair is fitted.
const SLOW: Options = Options { iterations: 60, tolerance: 1e-5, hopeless: 0.0, ceiling: f64::INFINITY };

/// chi^2 within which two fits of one structure are the same fit.
const SAME: f64 = 2.0;

/// What was found beside a candidate, kept: swaps search beside the same candidates again.
#[derive(Default)]
struct Beside(Vec<(Fitted, Vec<Fitted>)>);

impl Beside {
    /// What stands beside `c`, best first.
    fn of(&mut self, search: &Search, c: &Fitted, starts: usize, keep: usize) -> Vec<Fitted> {
        let same = |d: &Fitted| d.structure.forms() == c.structure.forms() && (d.chi2() - c.chi2()).abs() < SAME;
        if let Some((_, found)) = self.0.iter().find(|(d, _)| same(d)) {
            return found.clone();
        }
        let found = search.beside(c, 9, starts, keep);
        self.0.push((c.clone(), found.clone()));
        found
    }
}

/// What a second effect is weighed against.
struct Scale {
    total: f64,
    overdispersion: f64,
}

impl Search {
    /// `first` alone, or with the second effect that the recordings carry; and the pairs tried, best first. `named`: all
    /// single names, best first; `certain`: the first shows in the readings without any fit, nothing else may take its
    /// place.
    pub fn with_second(
        &self,
        base: &Fitted,
        first: &Fitted,
        named: &[&Fitted],
        certain: bool,
    ) -> (Fitted, Vec<Fitted>) {
        let scale = Scale { total: first.gain(base).max(1.0), overdispersion: first.overdispersion() };
        if scale.overdispersion <= WHITE_ALONE && scale.total >= FAINT {
            return (first.clone(), Vec::new());
        }
        let near: Vec<&Fitted> = if certain {
            vec![first]
        } else {
            let near = named.iter().take(FIRSTS).filter(|c| c.gain(base) > FIRST_SHARE * scale.total);
            near.copied().collect()
        };
        // of what is not the best, the plain form only where there is something left to find
        let plain: Vec<Fitted> = near
            .iter()
            .filter(|c| !certain && (c.names() == first.names() || scale.overdispersion > WHITE))
            .filter_map(|c| self.plainer(base, c))
            .filter(|c| c.gain(base) > PLAIN_SHARE * scale.total)
            .collect();
        let mut found = Beside::default();
        let mut pairs: Vec<(Fitted, &Fitted)> = Vec::new();
        for c in near.iter().copied().chain(&plain) {
            let (starts, keep) = if certain { (2, 6) } else { (1, 3) };
            // what is added to the plainer form is weighed against that
            let against = if plain.iter().any(|p| std::ptr::eq(p, c)) { c } else { first };
            pairs.extend(found.of(self, c, starts, keep).into_iter().take(SECONDS).map(|p| (p, against)));
        }
        let best_believed = |pairs: &mut Vec<(Fitted, &Fitted)>| -> Option<Fitted> {
            pairs.sort_by(|a, b| a.0.cost().total_cmp(&b.0.cost()));
            let carries = |(p, against): &&(Fitted, &Fitted)| {
                self.believed(p, against, &scale) && p.cost() < first.cost() - 2.0 * PENALTY
            };
            pairs.iter().find(carries).map(|(p, _)| p.clone())
        };
        let believed = best_believed(&mut pairs);
        let tried = pairs.iter().map(|(p, _)| p.clone()).collect();
        let pair = match (believed, pairs.first()) {
            (Some(p), _) if certain => Some(p),
            (Some(p), _) => Some(self.swapped(p, &mut found)),
            (None, Some((p, against))) if scale.overdispersion > SWAPPED_UNBELIEVED && !certain => {
                let led = Some(self.swapped(p.clone(), &mut found)).filter(|p| self.believed(p, against, &scale));
                // far from noise whatever is added: once more, from more starts and in every form
                led.or_else(|| {
                    let mut more: Vec<_> = self.further(first, SECONDS).into_iter().map(|p| (p, first)).collect();
                    best_believed(&mut more).map(|p| self.swapped(p, &mut found))
                })
            }
            _ => None,
        };
        let Some(pair) = pair else { return (first.clone(), tried) };
        if certain {
            return (pair, tried);
        }
        // either may do without the other, from where the pair has led it
        for i in [0, pair.structure.terms().len() - 1] {
            match pair.without(i, &SLOW) {
                Some(alone) if !self.believed(&pair, &alone, &scale) => return (alone, tried),
                _ => {}
            }
        }
        (pair, tried)
    }

    /// The first effect in the form of fewest parameters, where its best form has more: those may stand in for a second
    /// effect.
    fn plainer(&self, base: &Fitted, first: &Fitted) -> Option<Fitted> {
        let term = first.structure.terms().first()?;
        let forms = self.candidates().into_iter().filter(|t| t.name() == term.name());
        let plain = forms.min_by_key(|t| t.form.parameters.len())?;
        if plain.form.parameters.len() >= term.form.parameters.len() {
            return None;
        }
        base.add(&plain, 2, &Options::default())
    }

    /// Whether a pair's last effect carries its share beside `first`.
    fn believed(&self, pair: &Fitted, first: &Fitted, scale: &Scale) -> bool {
        let overdispersion = pair.overdispersion();
        // what takes the residual back to noise is believed sooner than what merely shrinks it
        let white = overdispersion < WHITE && overdispersion < scale.overdispersion - 0.01;
        // what differs between recordings is held back by the scatter of repeats, and counts by that
        let explains_scatter = || first.excess_scatter().is_some_and(|s| pair.excess_scatter_left(Some(s)).is_none());
        let share = match (pair.calibrates(), white) {
            (true, _) => 0.0,
            (_, true) => WHITENING * SECOND_SHARE,
            _ => SECOND_SHARE,
        };
        let gain = pair.gain(first);
        pair.significance(first, overdispersion) >= 1.0 && (gain > share * scale.total || explains_scatter())
    }

    /// Each effect of a pair exchanged for what does better beside the other, as long as that goes on.
    fn swapped(&self, mut pair: Fitted, found: &mut Beside) -> Fitted {
        for _ in 0..SWAPS {
            if pair.overdispersion() < SWAPPED {
                break;
            }
            let kept = (0..pair.structure.terms().len()).filter_map(|i| pair.without(i, &SLOW));
            let better = kept
                .filter_map(|k| found.of(self, &k, 1, 3).into_iter().next())
                .min_by(|a, b| a.cost().total_cmp(&b.cost()));
            match better {
                Some(b) if b.cost() < pair.cost() - PENALTY => pair = b,
                _ => break,
            }
        }
        pair
    }
}
