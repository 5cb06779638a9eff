//! From fits to a decision: what is missing, what cannot be told apart, what stays unexplained.

use super::candidate::{Candidate, DETECT, PENALTY, WHITE};
use super::search::{MakeUp, Search};
use estimate::problem::{Fit, Options, Problem};

/// What stands in for unknown physics has to leave this share less misfit than the best name.
const UNKNOWN_SHARE: f64 = 0.06;
/// The margin between them, in units of what counts as detected.
const UNKNOWN_MARGIN: f64 = 5.0;
/// The same where it takes the residual back to noise and the best names do not.
const WHITER_SHARE: f64 = 0.003;
/// Wander from which a residual is not back at noise.
const COLOURED: f64 = 1.5;

/// Fall of chi^2, and share of it, from which a base that had stalled is searched beside once more.
const STALLED: f64 = 100.0;
const STALLED_SHARE: f64 = 0.02;

/// The decision on a campaign.
pub struct Decision {
    pub base: Candidate,
    pub chosen: Candidate,
    /// Single candidates, best form each, best first.
    pub singles: Vec<Candidate>,
    pub detected: bool,
    pub false_alarm_probability: f64,
    /// Names that fit as well as the chosen one, by term.
    pub ties: Vec<Vec<&'static str>>,
    pub unexplained: bool,
    /// Whether what the base leaves wanders in contact as no noise does, or its stiffness swings as no repeats do.
    pub restless: bool,
    /// What the chosen model's stiffness differs by between recordings of one level (rms of ln), beyond scatter.
    pub swing: Option<f64>,
    /// A second effect that was not believed because something stays unexplained beside it.
    pub doubted: Option<Candidate>,
    /// Wander of the base's and the chosen model's residual.
    pub wander: (f64, f64),
}

impl Search<'_> {
    /// A better base: nothing added, started from where a candidate had led the base's parameters.
    fn polish(&self, base: &mut Candidate, singles: &[Candidate]) {
        let m = self.model(&base.make_up, 1.0, 1.0, 0.0);
        let p = Problem::new(self.data, &m);
        let g = m.parameters.len();
        for c in singles.iter().take(3) {
            let start = p.evaluate(c.fit.point.theta[..g].to_vec(), c.fit.point.locals.clone());
            let f = p.fit(start, &Options::default());
            if f.point.chi2 < base.fit.point.chi2 - 1.0 {
                base.fit = f;
            }
        }
    }

    /// Decides.
    pub fn decide(&self, base: Fit) -> Decision {
        let mut base = Candidate { make_up: MakeUp::default(), fit: base };
        let quick = Options { iterations: 12, hopeless: 2.0, ..Options::default() };
        let mut singles = self.expand(&base, &quick, 2, 6);
        let before = base.fit.point.chi2;
        self.polish(&mut base, &singles);
        if base.fit.point.chi2 < before - STALLED.max(STALLED_SHARE * before) {
            // what was compared with a base that had stalled says nothing
            singles = self.expand(&base, &quick, 2, 6);
            self.polish(&mut base, &singles);
        }
        singles.retain(|c| c.fit.point.chi2 <= base.fit.point.chi2 + 1.0);
        let base_wander = self.wander_of(&base);
        let swing = self.swing(&base);
        let restless = swing.is_some() || self.restless_contact(&base);
        let nothing = |base: Candidate, singles, lambda, p| Decision {
            chosen: base.clone(),
            base,
            singles,
            detected: restless,
            false_alarm_probability: p,
            ties: Vec::new(),
            unexplained: restless,
            restless,
            swing,
            doubted: None,
            wander: (lambda, lambda),
        };
        let named: Vec<&Candidate> = singles.iter().filter(|c| c.make_up.terms[0].mechanism.named).collect();
        let Some(best) = named.first().map(|c| (*c).clone()) else {
            return nothing(base, singles, base_wander, 1.0);
        };
        let lambda = self.wander_of(&best);
        // the most significant of the best few
        let mut first = best.clone();
        if first.significance(&base, lambda) < 1.0 {
            if let Some(g) = named.iter().find(|c| c.calibrates() && c.significance(&base, lambda) >= 1.0) {
                first = (*g).clone();
            }
        }
        // what can be seen without any fit comes first
        let flat = self.context.flat;
        if flat.is_some() {
            if let Some(c) = named.iter().find(|c| c.names() == ["clipping"]) {
                first = (*c).clone();
            }
        }
        let seen = first.names() == ["clipping"] && flat.is_some();
        let strength = first.significance(&base, lambda);
        let stand_in = singles.iter().find(|c| !c.make_up.terms[0].mechanism.named).cloned();
        let stand_in_strength = stand_in.as_ref().map_or(0.0, |c| c.gain(&base) / lambda.max(1.0) / DETECT);
        let probability = |s: f64| (40.0 * (-0.5 * s * DETECT).exp()).min(1.0);
        if strength < 1.0 && stand_in_strength < 2.0 {
            return nothing(base, singles, lambda, probability(strength.max(stand_in_strength)));
        }
        let mut chosen = self.with_second(&base, &first, &named, seen);
        let final_wander = self.wander_of(&chosen);
        // does physics nobody has named do better than one name, and as well as two?
        let mut unexplained = false;
        let mut doubted = None;
        if let Some(u) = &stand_in {
            let extra = |c: &Candidate| PENALTY * (u.parameters() - c.parameters()).max(0.0);
            let gain = u.gain(&base);
            let l = final_wander.clamp(1.0, 3.0);
            let whiter = final_wander > COLOURED && self.wander_of(u) < WHITE;
            let share = match (whiter, u.names() == ["latent_force"]) {
                (true, _) => WHITER_SHARE,
                (_, true) => 3.0 * UNKNOWN_SHARE,
                _ => UNKNOWN_SHARE,
            };
            let beats = |c: &Candidate, m: f64, s: f64| {
                let margin = c.fit.point.chi2 - u.fit.point.chi2 - extra(c);
                margin > m * DETECT * l && margin > s * gain
            };
            let against_pair = chosen.make_up.terms.len() < 2 || beats(&chosen, -2.0, -0.02);
            if beats(&first, UNKNOWN_MARGIN, share) && against_pair {
                unexplained = true;
                chosen = u.clone();
            }
        }
        if !unexplained {
            let left = (final_wander - 1.0) / (base_wander - 1.0).max(0.05);
            if final_wander > 1.6 && left > 0.35 {
                unexplained = true;
                // where something stays unexplained, a second name is not believed
                if chosen.make_up.terms.len() > 1 {
                    doubted = Some(chosen);
                }
                chosen = first.clone();
            }
        }
        let swing = self.swing_left(&chosen, swing);
        if swing.is_some() && !unexplained {
            unexplained = true;
            chosen = first;
        }
        // names that do as well as the chosen ones
        let ties = self.ties(&chosen, &singles, final_wander);
        Decision {
            base,
            singles,
            detected: true,
            false_alarm_probability: probability(strength.max(stand_in_strength)),
            ties,
            unexplained,
            restless,
            swing,
            doubted,
            wander: (base_wander, final_wander),
            chosen,
        }
    }

    /// Names that do as well as each of the chosen ones, where the residual wanders by `lambda`.
    pub fn ties(&self, chosen: &Candidate, singles: &[Candidate], lambda: f64) -> Vec<Vec<&'static str>> {
        let known = [("lowpass_lag", "channel_skew"), ("gravity", "return_spring")];
        chosen
            .make_up
            .terms
            .iter()
            .map(|t| {
                let name = t.mechanism.name;
                let mut v: Vec<&'static str> = Vec::new();
                if chosen.make_up.terms.len() == 1 {
                    for s in singles.iter().filter(|s| s.make_up.terms[0].mechanism.named) {
                        if s.names()[0] != name && s.cost() - chosen.cost() < 6.0 * lambda.max(1.0) {
                            v.push(s.names()[0]);
                        }
                    }
                }
                for (a, b) in known {
                    for (x, y) in [(a, b), (b, a)] {
                        if name == x && !v.contains(&y) && self.candidates().iter().any(|c| c.mechanism.name == y) {
                            v.push(y);
                        }
                    }
                }
                v
            })
            .collect()
    }
}
