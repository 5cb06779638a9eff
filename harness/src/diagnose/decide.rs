//! From fits to a decision: what is missing, what cannot be told apart, what stays unexplained.

use super::mechanism::{Acts, Origin};
use super::search::{MakeUp, Search, Term, HARD};
use crate::model::estimate::{Fit, Model, Options, Point, Problem};
use crate::model::simulate::{simulate, Local, Setup, Trace};
use crate::record::{Channel, Kind};
use rayon::prelude::*;

/// Gain in chi^2, beyond one parameter and over the wander of the residual, from which a misfit counts as detected.
/// Held to under 1 % false alarms with the maximum over all candidates.
pub const DETECT: f64 = 45.0;
/// The same for a gain beyond a calibration's tolerance, where the prior sets the scale and nothing else inflates it.
pub const DETECT_TOLERANCE: f64 = 15.0;
/// A second effect has to bring this share of what the first brought.
pub const SECOND_SHARE: f64 = 0.03;
/// Wander up to which a residual counts as noise.
pub const WHITE: f64 = 1.25;
/// Penalty of one more parameter, in chi^2.
pub const PENALTY: f64 = 4.0;
/// What stands in for unknown physics has to leave this share less misfit than the best name.
pub const UNKNOWN_SHARE: f64 = 0.06;
/// Share of the best gain from which a candidate is fitted out.
const REFINED_SHARE: f64 = 0.25;
/// Mechanisms fitted in every form, and the share of the best gain within which they have to lie.
const FAMILIES: usize = 4;
const FAMILY_SHARE: f64 = 0.25;
/// Changes of the exponent from which the best candidates are fitted again.
const SHAKES: [f64; 3] = [-0.3, 0.0, 0.3];
/// Samples over which the residual's wander is judged.
const BLOCK: usize = 24;

/// A candidate with its fit.
#[derive(Clone)]
pub struct Candidate {
    pub make_up: MakeUp,
    pub fit: Fit,
}

impl Candidate {
    /// Names in the make-up.
    pub fn names(&self) -> Vec<&'static str> {
        self.make_up.terms.iter().map(|t| t.mechanism.name).collect()
    }
    /// Whether its last effect is a calibration beyond its tolerance.
    fn calibrates(&self) -> bool {
        self.make_up.terms.last().is_some_and(|t| t.mechanism.is_calibration())
    }
    fn parameters(&self) -> f64 {
        self.make_up.terms.iter().map(|t| t.form.parameters.len() as f64).sum()
    }
    /// chi^2 with its penalty.
    pub fn cost(&self) -> f64 {
        // damping with a power of depth next to zero is viscous damping
        let theta = &self.fit.point.theta;
        let viscous_twin = self.make_up.terms.iter().any(|t| match t.form.label {
            "Kuwabara-Kono" => (theta[1] - 1.0).abs() < 0.2,
            "half power" => (theta[1] - 0.5).abs() < 0.2,
            _ => false,
        });
        self.fit.point.chi2 + PENALTY * self.parameters() + if viscous_twin { PENALTY } else { 0.0 }
    }
}

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
    /// A second effect that was not believed because something stays unexplained beside it.
    pub doubted: Option<Candidate>,
    /// Wander of the base's and the chosen model's residual.
    pub wander: (f64, f64),
}

/// How much the whitened residual wanders over blocks, relative to white noise.
pub fn wander(problem: &Problem<'_>, point: &Point) -> f64 {
    let Some(l) = problem.linearise(point) else { return 1.0 };
    let over = |block: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for (r, b) in l.blocks.iter().enumerate() {
            let len = problem.data.records[r].setup.time.len();
            for ch in b.residual.chunks(len) {
                for w in ch.chunks_exact(block) {
                    let m: f64 = w.iter().sum();
                    // a single wild block shall not decide
                    sum += (m * m / block as f64).min(30.0);
                    n += 1.0;
                }
            }
        }
        if n < 10.0 {
            1.0
        } else {
            sum / n
        }
    };
    over(BLOCK).max(over(3 * BLOCK))
}

impl Search<'_> {
    fn wander_of(&self, c: &Candidate) -> f64 {
        let m = self.model(&c.make_up, 1.0, 1.0, 0.0);
        wander(&Problem::new(self.data, &m), &c.fit.point)
    }

    /// Best form of each mechanism, refined where it stands a chance.
    fn expand(&self, from: &Candidate, quick: &Options, starts: usize, keep: usize) -> Vec<Candidate> {
        let list = self.candidates();
        let first = self.screen(&from.make_up, &from.fit, &list, starts, quick);
        let sifted = first.clone();
        let mut best: Vec<(Term, Fit)> = Vec::new();
        for (t, f) in first {
            let cost = |t: &Term, f: &Fit| f.point.chi2 + PENALTY * t.form.parameters.len() as f64;
            match best.iter_mut().find(|b| b.0.mechanism.name == t.mechanism.name) {
                Some(b) if cost(&b.0, &b.1) <= cost(&t, &f) => {}
                Some(b) => *b = (t, f),
                None => best.push((t, f)),
            }
        }
        best.sort_by(|a, b| a.1.point.chi2.total_cmp(&b.1.point.chi2));
        let top = best.first().map_or(0.0, |b| from.fit.point.chi2 - b.1.point.chi2);
        if top < 0.5 * DETECT_TOLERANCE {
            return best.into_iter().map(|(t, f)| self.candidate(from, t, f)).collect();
        }
        // refine: what is among the best, and what is hard to fit and so may have been missed
        let mut rank = 0;
        let refine: Vec<(usize, usize)> = best
            .iter()
            .enumerate()
            .filter_map(|(i, (t, f))| {
                let gain = from.fit.point.chi2 - f.point.chi2;
                let is_hard = HARD.contains(&t.mechanism.name);
                if (rank < keep && (rank < 2 || gain > REFINED_SHARE * top))
                    || (is_hard && gain > 0.1 * top && keep > 3)
                {
                    rank += 1;
                    Some((i, if is_hard { 2 } else { 1 }))
                } else {
                    None
                }
            })
            .collect();
        let slow = Options { iterations: 60, ..Options::default() };
        let refined: Vec<(usize, Term, Fit)> = refine
            .into_par_iter()
            .filter_map(|(i, starts)| {
                let (t, f) = &best[i];
                // go on from where the quick fit stopped
                let mut next = from.make_up.clone();
                next.terms.push(t.clone());
                let m = self.model(&next, 1.0, 1.0, 0.0);
                let p = Problem::new(self.data, &m);
                let mut out = p.fit(f.point.clone(), &slow);
                if starts > 1 {
                    if let Some(g) = self.add(
                        &from.make_up,
                        &from.fit.point,
                        t,
                        starts + 1,
                        &Options { iterations: 18, ..Options::default() },
                    ) {
                        if g.point.chi2 < out.point.chi2 {
                            out = p.fit(g.point, &slow);
                        }
                    }
                }
                Some((i, t.clone(), out))
            })
            .collect();
        for (i, t, f) in refined {
            if f.point.chi2 <= best[i].1.point.chi2 {
                best[i] = (t, f);
            }
        }
        let mut v: Vec<Candidate> = best.into_iter().map(|(t, f)| self.candidate(from, t, f)).collect();
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        if keep > 3 {
            self.families(from, &mut v, &sifted, &slow);
        }
        v
    }

    /// The best few mechanisms in every form they have: which one describes best shows only when all are fitted out.
    fn families(&self, from: &Candidate, v: &mut [Candidate], sifted: &[(Term, Fit)], options: &Options) {
        let Some(best) = v.first().map(|c| c.cost()) else { return };
        let gain = from.fit.point.chi2 - best;
        let near: Vec<usize> =
            (0..v.len()).filter(|i| v[*i].cost() - best < (FAMILY_SHARE * gain).max(DETECT)).take(FAMILIES).collect();
        let others: Vec<(usize, Term)> = near
            .iter()
            .flat_map(|i| {
                let i = *i;
                let had = &v[i].make_up.terms[from.make_up.terms.len()];
                self.candidates()
                    .into_iter()
                    .filter(|t| t.mechanism.name == had.mechanism.name && t.form.label != had.form.label)
                    .map(move |t| (i, t))
                    .collect::<Vec<_>>()
            })
            .collect();
        let fitted: Vec<(usize, Candidate)> = others
            .into_par_iter()
            .filter_map(|(i, t)| {
                let before =
                    sifted.iter().find(|s| s.0.mechanism.name == t.mechanism.name && s.0.form.label == t.form.label);
                let quick = Options { iterations: 12, ..Options::default() };
                let start = match before {
                    Some((_, f)) => f.point.clone(),
                    None => self.add(&from.make_up, &from.fit.point, &t, 2, &quick)?.point,
                };
                let mut next = from.make_up.clone();
                next.terms.push(t);
                let model = self.model(&next, 1.0, 1.0, 0.0);
                let fit = Problem::new(self.data, &model).fit(start, options);
                Some((i, Candidate { make_up: next, fit }))
            })
            .collect();
        for (i, c) in fitted {
            if c.cost() < v[i].cost() {
                v[i] = c;
            }
        }
        let shaken: Vec<(usize, Candidate)> = near
            .into_par_iter()
            .flat_map_iter(|i| SHAKES.map(|d| (i, d)))
            .filter_map(|(i, d)| Some((i, self.shaken(&v[i], d, options)?)))
            .collect();
        for (i, c) in shaken {
            if c.cost() < v[i].cost() {
                v[i] = c;
            }
        }
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// A candidate fitted again from another exponent at the same force and from tolerances of zero: the ridge of
    /// stiffness and exponent holds false bottoms. None where that leads no lower.
    fn shaken(&self, c: &Candidate, by: f64, options: &Options) -> Option<Candidate> {
        let model = self.model(&c.make_up, 1.0, 1.0, 0.0);
        let coarse = self.data.coarse();
        let sift = Problem::new(&coarse, &model);
        let mut theta = c.fit.point.theta.clone();
        let q = &model.parameters[1];
        theta[1] = (theta[1] + by).clamp(q.lower + 0.05, q.upper - 0.05);
        for (t, q) in theta.iter_mut().zip(&model.parameters) {
            if let Some((mean, _)) = q.prior {
                *t = mean;
            }
        }
        let start = sift.evaluate(theta, c.fit.point.locals.clone());
        let quick = sift.fit(start, &Options { iterations: 14, ..Options::default() });
        // it has to have come near at least
        let near = c.fit.point.chi2 + DETECT + 0.02 * (quick.objective[0] - c.fit.point.chi2).max(0.0);
        if !quick.point.chi2.is_finite() || quick.point.chi2 > near {
            return None;
        }
        let fine = Problem::new(self.data, &model);
        let start = fine.evaluate(quick.point.theta, quick.point.locals);
        let fit = fine.fit(start, options);
        (fit.point.chi2 < c.fit.point.chi2).then(|| Candidate { make_up: c.make_up.clone(), fit })
    }

    /// The best few named candidates with one more effect than `from`.
    pub fn further(&self, from: &Candidate, most: usize) -> Vec<Candidate> {
        let quick = Options { iterations: 12, hopeless: 3.0, ..Options::default() };
        let mut v = self.expand(from, &quick, 2, 6);
        v.retain(|c| c.make_up.terms.iter().all(|t| t.mechanism.named));
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        v.truncate(most);
        v
    }

    /// The last term of a pair alone, fitted from the pair's own values.
    fn without_first(&self, pair: &Candidate) -> Option<Candidate> {
        let model = self.model(&pair.make_up, 1.0, 1.0, 0.0);
        let at = self.first_term(&model, &pair.make_up);
        let n = pair.make_up.terms.first()?.form.parameters.len();
        let mut theta = pair.fit.point.theta.clone();
        theta.drain(at..at + n);
        let make_up = MakeUp { terms: pair.make_up.terms[1..].to_vec() };
        let model = self.model(&make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let start = problem.evaluate(theta, pair.fit.point.locals.clone());
        if !start.chi2.is_finite() {
            return None;
        }
        let fit = problem.fit(start, &Options { iterations: 60, ..Options::default() });
        Some(Candidate { make_up, fit })
    }

    fn candidate(&self, from: &Candidate, t: Term, fit: Fit) -> Candidate {
        let mut make_up = from.make_up.clone();
        make_up.terms.push(t);
        Candidate { make_up, fit }
    }

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
        self.polish(&mut base, &singles);
        singles.retain(|c| c.fit.point.chi2 <= base.fit.point.chi2 + 1.0);
        let base_wander = self.wander_of(&base);
        let gain_of = |c: &Candidate, from: &Candidate| {
            from.fit.point.chi2 - c.fit.point.chi2 - (c.parameters() - from.parameters() - 1.0).max(0.0) * PENALTY
        };
        let significant = |c: &Candidate, from: &Candidate, lambda: f64| -> f64 {
            let gain = gain_of(c, from);
            if c.calibrates() {
                gain / DETECT_TOLERANCE
            } else {
                gain / lambda.max(1.0) / DETECT
            }
        };
        let nothing = |base: Candidate, singles, lambda, p| Decision {
            chosen: base.clone(),
            base,
            singles,
            detected: false,
            false_alarm_probability: p,
            ties: Vec::new(),
            unexplained: false,
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
        if significant(&first, &base, lambda) < 1.0 {
            if let Some(g) = named.iter().find(|c| c.calibrates() && significant(c, &base, lambda) >= 1.0) {
                first = (*g).clone();
            }
        }
        // what can be seen without any fit comes first
        let flat = self.flat_tops();
        if flat.is_some() {
            if let Some(c) = named.iter().find(|c| c.names() == ["clipping"]) {
                first = (*c).clone();
            }
        }
        let seen = first.names() == ["clipping"] && flat.is_some();
        let strength = significant(&first, &base, lambda);
        let stand_in = singles.iter().find(|c| !c.make_up.terms[0].mechanism.named).cloned();
        let stand_in_strength = stand_in.as_ref().map_or(0.0, |c| gain_of(c, &base) / lambda.max(1.0) / DETECT);
        let probability = |s: f64| (40.0 * (-0.5 * s * DETECT).exp()).min(1.0);
        if strength < 1.0 && stand_in_strength < 2.0 {
            return nothing(base, singles, lambda, probability(strength.max(stand_in_strength)));
        }
        let total = gain_of(&first, &base).max(1.0);
        // a second effect, tried beside the few best first ones
        let mut chosen = first.clone();
        let lambda_first = self.wander_of(&first);
        if lambda_first > 1.05 || total < 3000.0 {
            let beam: Vec<Candidate> = if seen {
                vec![first.clone()]
            } else {
                named.iter().take(2).filter(|c| gain_of(c, &base) > 0.8 * total).map(|c| (*c).clone()).collect()
            };
            let mut pairs: Vec<Candidate> = Vec::new();
            for c in beam {
                let (starts, keep) = if seen { (2, 6) } else { (1, 3) };
                let quick = Options { iterations: 9, hopeless: 3.0, ..Options::default() };
                let v = self.expand(&c, &quick, starts, keep);
                pairs.extend(v.into_iter().filter(|p| p.make_up.terms.iter().all(|t| t.mechanism.named)).take(3));
            }
            pairs.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
            if let Some(pair) = pairs.first() {
                let l2 = self.wander_of(pair);
                let s2 = significant(pair, &first, l2);
                // what takes the residual back to noise is believed sooner than what merely shrinks it
                let white = l2 < WHITE && l2 < lambda_first - 0.01;
                let by_tolerance = pair.calibrates();
                let share = match (by_tolerance, white) {
                    (true, _) => 0.0,
                    (_, true) => 0.15 * SECOND_SHARE,
                    _ => SECOND_SHARE,
                };
                if s2 >= 1.0 && gain_of(pair, &first) > share * total {
                    chosen = pair.clone();
                    // the second may do without the first, from where the pair has led it
                    if let Some(alone) = self.without_first(pair) {
                        if significant(pair, &alone, l2) < 1.0 || gain_of(pair, &alone) < share * total {
                            chosen = alone;
                        }
                    }
                }
            }
        }
        let final_wander = self.wander_of(&chosen);
        // does physics nobody has named do better than one name, and as well as two?
        let mut unexplained = false;
        let mut doubted = None;
        if let Some(u) = &stand_in {
            let extra = |c: &Candidate| PENALTY * (u.parameters() - c.parameters()).max(0.0);
            let share = if u.names() == ["latent_force"] { 3.0 * UNKNOWN_SHARE } else { UNKNOWN_SHARE };
            let gain = gain_of(u, &base);
            let l = final_wander.clamp(1.0, 3.0);
            let beats = |c: &Candidate, m: f64, s: f64| {
                let margin = c.fit.point.chi2 - u.fit.point.chi2 - extra(c);
                margin > m * DETECT * l && margin > s * gain
            };
            let against_pair = chosen.make_up.terms.len() < 2 || beats(&chosen, -2.0, -0.02);
            if beats(&first, 2.0, share) && against_pair {
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
        // names that do as well as the chosen ones
        let ties = self.ties(&chosen, &singles, final_wander);
        Decision {
            base,
            singles,
            detected: true,
            false_alarm_probability: probability(strength.max(stand_in_strength)),
            ties,
            unexplained,
            doubted,
            wander: (base_wander, final_wander),
            chosen,
        }
    }

    fn ties(&self, chosen: &Candidate, singles: &[Candidate], lambda: f64) -> Vec<Vec<&'static str>> {
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

    /// Share of a term's own action in approach, loading, unloading and after, over all recordings.
    pub fn acts(&self, chosen: &Candidate, term: usize) -> [f64; 4] {
        let model: Model<'_> = self.model(&chosen.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let mut without = chosen.make_up.clone();
        let t = without.terms.remove(term);
        let start: usize = self.first_term(&model, &chosen.make_up)
            + chosen.make_up.terms[..term].iter().map(|t| t.form.parameters.len()).sum::<usize>();
        let mut theta = chosen.fit.point.theta.clone();
        theta.drain(start..start + t.form.parameters.len());
        let base_model = self.model(&without, 1.0, 1.0, 0.0);
        let base_problem = Problem::new(self.data, &base_model);
        let (with, bare) = (problem.physics(&chosen.fit.point.theta), base_problem.physics(&theta));
        let mut share = [0.0; 4];
        for (r, rec) in self.data.records.iter().enumerate() {
            let local = &chosen.fit.point.locals[r];
            let (trace, y) = problem.predict(&chosen.fit.point.theta, r, local);
            if !trace.ok {
                continue;
            }
            let n = trace.force.len();
            let strength: Vec<f64> = match t.mechanism.acts {
                Acts::Force(f) => (0..n).map(|i| f(trace.position[i], trace.velocity[i], &with).abs()).collect(),
                Acts::Struck => {
                    let body = with.mass - with.loose_mass;
                    let borne = if with.loose_borne { with.loose_mass * with.gravity } else { 0.0 };
                    let drive = |x: f64| rec.setup.preload - rec.setup.rate * (x + rec.setup.travel);
                    (0..n)
                        .map(|i| {
                            (body * trace.acceleration[i] + trace.force[i] - drive(trace.position[i]) - borne).abs()
                        })
                        .collect()
                }
                Acts::Push => trace.force.iter().map(|f| f.abs()).collect(),
                Acts::Reading if t.mechanism.origin == Origin::Chain => {
                    let c = if self.data.has(Channel::Force) { Channel::Force } else { Channel::Acceleration };
                    let z = crate::model::chain::readings(&bare, &trace, &rec.setup.time);
                    y[c.index()].iter().zip(&z[c.index()]).map(|(a, b)| (a - b).abs()).collect()
                }
                Acts::Reading => {
                    // both laws along the same path
                    let imposed = Setup {
                        kind: Kind::Indentation,
                        imposed: trace.position.clone(),
                        imposed_rate: trace.velocity.clone(),
                        ..rec.setup.clone()
                    };
                    let l = Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 };
                    let (a, b) = (simulate(&with, &imposed, &l), simulate(&bare, &imposed, &l));
                    a.force.iter().zip(&b.force).map(|(a, b)| (a - b).abs()).collect()
                }
            };
            for (i, s) in strength.iter().enumerate() {
                share[phase(&trace, rec.setup.time[i])] += s;
            }
        }
        let sum: f64 = share.iter().sum();
        if sum > 0.0 {
            share.iter_mut().for_each(|s| *s /= sum);
        }
        share
    }
}

/// Index of the phase an instant lies in: approach, loading, unloading, after.
pub fn phase(t: &Trace, time: f64) -> usize {
    if time < t.touch {
        0
    } else if time < t.deepest {
        1
    } else if time < t.leave {
        2
    } else {
        3
    }
}

/// Words for the phases.
pub const PHASES: [&str; 4] = ["approach", "loading", "unloading", "after"];
