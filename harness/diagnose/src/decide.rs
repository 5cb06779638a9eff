//! From fits to a decision: what is missing, what cannot be distinguished, what stays unexplained.

use super::candidate::{Candidate, DETECT, PENALTY, WHITE};
use super::evidence::Evidences;
use super::heldout::Folds;
use super::posterior::Posterior;
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::Options;

/// What stands in for unknown physics has to leave this share less misfit than the best name.
const UNKNOWN_SHARE: f64 = 0.06;
/// The margin between them, in units of what counts as detected.
const UNKNOWN_MARGIN: f64 = 5.0;
/// The same where it takes the residual back to noise and the best names do not.
const WHITER_SHARE: f64 = 0.003;
/// Overdispersion from which a residual is not back at noise.
const COLOURED: f64 = 1.5;

/// Fall of chi^2, and share of it, from which a base that had stalled is searched beside once more.
const STALLED: f64 = 100.0;
const STALLED_SHARE: f64 = 0.02;

/// The decision on a campaign.
pub struct Decision {
    pub base: Fitted,
    pub chosen: Fitted,
    /// Single candidates, best form each, best first.
    pub singles: Vec<Fitted>,
    /// Pairs that were tried, best first.
    pub pairs: Vec<Fitted>,
    pub detected: bool,
    pub false_alarm_probability: f64,
    /// Names that fit as well as the chosen one, by term.
    pub ties: Vec<Vec<&'static str>>,
    pub unexplained: bool,
    /// Whether what the base leaves is overdispersed in contact as no noise is, or its stiffness scatters as no repeats do.
    pub beyond_noise: bool,
    /// What the chosen model's stiffness differs by between recordings of one level (rms of ln), beyond repeat scatter.
    pub excess_scatter: Option<f64>,
    /// A second effect that was not believed because something stays unexplained beside it.
    pub doubted: Option<Fitted>,
    /// Overdispersion of the base's and the chosen model's residual.
    pub overdispersion: (f64, f64),
    /// What it was weighed by, and what came of it.
    pub evidence: Evidences,
    pub posterior: Posterior,
    /// Predictions of levels not seen by names chosen without them; None where nothing is named.
    pub folds: Option<Folds>,
    /// Names that recordings give which end so many contact times after the touch.
    pub windows: Vec<(f64, Vec<&'static str>)>,
}

impl Decision {
    /// Whether a mechanism of the vocabulary is named.
    pub fn names_something(&self) -> bool {
        self.detected && self.chosen.structure.terms().iter().any(|t| t.mechanism.named)
    }
}

impl Search {
    /// A better base: nothing added, started from where a candidate had led the base's parameters.
    fn polish(&self, base: &mut Fitted, singles: &[Fitted]) {
        let g = base.structure.model().parameters.len();
        for c in singles.iter().take(3) {
            let start = base.problem().evaluate(c.fit.point.theta[..g].to_vec(), c.fit.point.locals.clone());
            let f = base.problem().fit(start, &Options::default());
            if f.point.chi2 < base.chi2() - 1.0 {
                base.fit = f;
            }
        }
    }

    /// Decides.
    pub fn decide(&self, mut base: Fitted) -> Decision {
        let quick = Options { iterations: 12, hopeless: 2.0, ..Options::default() };
        let mut singles = self.expand(&base, &quick, 2, 6);
        let before = base.chi2();
        self.polish(&mut base, &singles);
        if base.chi2() < before - STALLED.max(STALLED_SHARE * before) {
            // what was compared with a base that had stalled says nothing
            singles = self.expand(&base, &quick, 2, 6);
            self.polish(&mut base, &singles);
        }
        singles.retain(|c| c.chi2() <= base.chi2() + 1.0);
        let base_overdispersion = base.overdispersion();
        let excess_scatter = base.excess_scatter();
        let beyond_noise = excess_scatter.is_some() || base.is_overdispersed_in_contact();
        let nothing = |base: Fitted, singles, lambda, p| Decision {
            chosen: base.clone(),
            base,
            singles,
            pairs: Vec::new(),
            detected: beyond_noise,
            false_alarm_probability: p,
            ties: Vec::new(),
            unexplained: beyond_noise,
            beyond_noise,
            excess_scatter,
            doubted: None,
            overdispersion: (lambda, lambda),
            evidence: Evidences::default(),
            posterior: Posterior::default(),
            folds: None,
            windows: Vec::new(),
        };
        let named: Vec<&Fitted> = singles.iter().filter(|c| c.is_named()).collect();
        let Some(best) = named.first().map(|c| (*c).clone()) else {
            return nothing(base, singles, base_overdispersion, 1.0);
        };
        let lambda = best.overdispersion();
        // the most significant of the best few
        let mut first = best.clone();
        if first.significance(&base, lambda) < 1.0 {
            if let Some(g) = named.iter().find(|c| c.calibrates() && c.significance(&base, lambda) >= 1.0) {
                first = (*g).clone();
            }
        }
        // what shows in the readings without any fit comes first
        let flat = self.structure.base().context.flat;
        if flat.is_some() {
            if let Some(c) = named.iter().find(|c| c.structure.has(|h| h.limits_reading)) {
                first = (*c).clone();
            }
        }
        let certain = first.structure.has(|h| h.limits_reading) && flat.is_some();
        let strength = first.significance(&base, lambda);
        let stand_in = singles.iter().find(|c| !c.is_named()).cloned();
        let stand_in_strength = stand_in.as_ref().map_or(0.0, |c| c.gain(&base) / lambda.max(1.0) / DETECT);
        let probability = |s: f64| (40.0 * (-0.5 * s * DETECT).exp()).min(1.0);
        if strength < 1.0 && stand_in_strength < 2.0 {
            return nothing(base, singles, lambda, probability(strength.max(stand_in_strength)));
        }
        let (mut chosen, pairs) = self.with_second(&base, &first, &named, certain);
        let final_overdispersion = chosen.overdispersion();
        // does physics nobody has named do better than one name, and as well as two?
        let mut unexplained = false;
        let mut doubted = None;
        if let Some(u) = &stand_in {
            let extra = |c: &Fitted| PENALTY * (u.parameters() - c.parameters()).max(0.0);
            let gain = u.gain(&base);
            let l = final_overdispersion.clamp(1.0, 3.0);
            let whiter = final_overdispersion > COLOURED && u.overdispersion() < WHITE;
            let share = match (whiter, u.structure.has(|h| h.is_flexible)) {
                (true, _) => WHITER_SHARE,
                (_, true) => 3.0 * UNKNOWN_SHARE,
                _ => UNKNOWN_SHARE,
            };
            let beats = |c: &Fitted, m: f64, s: f64| {
                let margin = c.chi2() - u.chi2() - extra(c);
                margin > m * DETECT * l && margin > s * gain
            };
            let against_pair = chosen.structure.terms().len() < 2 || beats(&chosen, -2.0, -0.02);
            if beats(&first, UNKNOWN_MARGIN, share) && against_pair {
                unexplained = true;
                chosen = u.clone();
            }
        }
        if !unexplained {
            let left = (final_overdispersion - 1.0) / (base_overdispersion - 1.0).max(0.05);
            if final_overdispersion > 1.6 && left > 0.35 {
                unexplained = true;
                // where something stays unexplained, a second name is not believed
                if chosen.structure.terms().len() > 1 {
                    doubted = Some(chosen);
                }
                chosen = first.clone();
            }
        }
        let excess_scatter = chosen.excess_scatter_left(excess_scatter);
        if excess_scatter.is_some() && !unexplained {
            unexplained = true;
            chosen = first;
        }
        Decision {
            base,
            singles,
            pairs,
            detected: true,
            false_alarm_probability: probability(strength.max(stand_in_strength)),
            ties: Vec::new(),
            unexplained,
            beyond_noise,
            excess_scatter,
            doubted,
            overdispersion: (base_overdispersion, final_overdispersion),
            evidence: Evidences::default(),
            posterior: Posterior::default(),
            folds: None,
            windows: Vec::new(),
            chosen,
        }
    }
}
