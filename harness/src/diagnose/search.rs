//! Names the missing physics: base fit, every mechanism fitted jointly with it, forward selection with swaps.

use super::mechanism::{Context, Form, Mechanism};
use super::mechanisms::ALL;
use super::prepare::Guess;
use crate::model::estimate::{Data, Fit, Linear, Model, Nuisance, Options, Parameter, Point, Problem};
use crate::model::physics::{Physics, GRAVITY};
use crate::record::{Campaign, Channel, Kind};
use rayon::prelude::*;

/// A mechanism in one of its forms.
#[derive(Clone)]
pub struct Term {
    pub mechanism: &'static Mechanism,
    pub form: Form,
}

/// A model's make-up: the base and the terms added to it.
#[derive(Clone, Default)]
pub struct MakeUp {
    pub terms: Vec<Term>,
}

/// Mechanisms whose effect is far from linear in their parameters, so that a score may miss them.
pub const HARD: [&str; 6] =
    ["base_compliance", "loose_part", "sensor_resonance", "cyclic_softening", "secondary_stiffening", "return_spring"];

/// Samples in a row at one reading that make a flat top.
const FLAT: usize = 4;
/// Standard deviations beyond which a calibration's tolerance is no tolerance.
const WIDEST: f64 = 6.0;
/// Share of the best score from which a form is fitted at all: linear in its first parameter, and others.
const LINEAR_SHARE: f64 = 0.08;
const OTHER_SHARE: f64 = 0.01;
/// Share of the samples that chi^2 falls to at best: the noise is known to some per cent.
const NOISE_AT_LEAST: f64 = 0.98;
/// Expected gain in chi^2 from which a calibration beyond its tolerance is fitted at all.
const HELD_BACK: f64 = 5.0;
/// Gain in chi^2 that there may be in any case.
const LITTLE: f64 = 100.0;
/// Share of a gain found with coarse integration that may be lost by fine, before a candidate is fitted again.
const SHIFTED: f64 = 0.1;
/// Forms of one mechanism that are sifted by fitting.
const FORMS_A_MECHANISM: usize = 2;
const SOFTENING: &str = "cyclic_softening";
/// Standard deviation of ln stiffness that leaves every recording its own.
const FREE_SCATTER: f64 = 0.3;

/// Starts of a fit with the gain in chi^2 expected of each.
type Starts = Vec<(f64, Vec<f64>)>;

/// Everything the search holds fixed.
pub struct Search<'a> {
    pub data: &'a Data,
    pub context: Context,
    pub gravity: bool,
    pub hysteresis: bool,
    /// Mechanisms the simulation holds already, beyond gravity and hysteresis damping.
    pub given: Vec<Term>,
}

/// Number of law parameters of the base: ln F_ref, p, damping ratio where it has one.
impl<'a> Search<'a> {
    /// Of a campaign and its prepared data.
    pub fn new(campaign: &Campaign, data: &'a Data) -> Search<'a> {
        let terms = campaign.simulation.terms.clone();
        let mut top = [0.0f64; 3];
        for r in &data.records {
            for (t, y) in top.iter_mut().zip(&r.y) {
                if let Some(y) = y {
                    *t = y.iter().fold(*t, |m, v| m.max(v.abs()));
                }
            }
        }
        let mut context = Context {
            kind: data.kind,
            has: [data.has(Channel::Force), data.has(Channel::Acceleration), data.has(Channel::Penetration)],
            scales: data.scales,
            terms: Vec::new(),
            top,
            ring: if data.kind == Kind::Indentation { None } else { super::ring::line(data, Channel::Force) },
        };
        let given = ALL
            .iter()
            .filter(|m| {
                terms.iter().any(|t| t == m.name)
                    && m.name != "gravity"
                    && m.name != "hysteresis_damping"
                    && !(m.name == "return_spring" && data.kind == Kind::ContactorOpening)
            })
            .filter_map(|m| (m.forms)(&context).into_iter().next().map(|form| Term { mechanism: m, form }))
            .collect();
        context.terms = terms.clone();
        Search {
            data,
            context,
            gravity: terms.iter().any(|t| t == "gravity") && data.kind == Kind::DropTest,
            hysteresis: terms.iter().any(|t| t == "hysteresis_damping"),
            given,
        }
    }

    /// The model of a make-up, started from the campaign's own law or a guess.
    pub fn model(&self, make_up: &MakeUp, k: f64, p: f64, mu: f64) -> Model<'_> {
        let s = self.data.scales;
        let base = |name: &str, start, lower, upper, step| Parameter {
            name: name.into(),
            start,
            lower,
            upper,
            step,
            prior: None,
            dynamic: true,
        };
        let mut ps =
            vec![base("ln F_ref", (k * s.x_ref.powf(p)).ln(), -60.0, 60.0, 2e-3), base("p", p, 0.8, 4.5, 1e-3)];
        let hysteresis = self.hysteresis;
        if hysteresis {
            ps.push(base("damping ratio", mu * s.v_ref / k, 0.0, 20.0, 1e-3));
        }
        let gravity = self.gravity;
        let mass = self.data.mass;
        let tolerance = |name: &str, sd: f64, dynamic: bool| Parameter {
            name: name.into(),
            start: 0.0,
            lower: -WIDEST * sd,
            upper: WIDEST * sd,
            step: 1e-3,
            prior: Some((0.0, sd)),
            dynamic,
        };
        let mut gains = Vec::new();
        let with_mass = self.data.kind != Kind::Indentation;
        if with_mass {
            for (c, sd) in [(Channel::Force, 0.007), (Channel::Acceleration, 0.007), (Channel::Penetration, 0.003)] {
                if self.data.has(c) {
                    gains.push((ps.len(), c.index()));
                    ps.push(tolerance(&format!("ln gain {}", c.name()), sd, false));
                }
            }
        }
        let at_mass = ps.len();
        if with_mass {
            ps.push(tolerance("ln mass", 0.002, true));
        }
        let mut spans = Vec::new();
        let all: Vec<Term> = self.given.iter().chain(&make_up.terms).cloned().collect();
        for t in &all {
            spans.push(ps.len());
            for (i, q) in t.form.parameters.iter().enumerate() {
                let mut q = q.clone();
                q.start = t.form.starts[0][i];
                q.name = format!("{}: {}", t.mechanism.name, q.name);
                ps.push(q);
            }
        }
        let context = &self.context;
        Model {
            parameters: ps,
            apply: Box::new(move |th: &[f64], p: &mut Physics| {
                p.law.exponent = th[1];
                p.law.stiffness = (th[0] - th[1] * s.x_ref.ln()).exp();
                p.law.hysteresis_damping = if hysteresis { th[2] * p.law.stiffness / s.v_ref } else { 0.0 };
                p.mass = if with_mass { mass * th[at_mass].exp() } else { mass };
                p.gravity = if gravity { GRAVITY } else { 0.0 };
                for (i, c) in &gains {
                    p.gain[*c] = th[*i].exp();
                }
                for (t, at) in all.iter().zip(&spans) {
                    (t.form.apply)(&th[*at..*at + t.form.parameters.len()], context, p);
                }
            }),
        }
    }

    /// Fits the base from the campaign's law and from the guess; the better one.
    pub fn base(&self, campaign: &Campaign, guess: &Guess) -> Fit {
        let s = &campaign.simulation;
        let mut starts = Vec::new();
        if let (Some(k), Some(p)) = (s.k, s.p) {
            starts.push((k, p, s.mu_d.unwrap_or(0.0)));
        }
        let v = self.data.scales.v_ref;
        starts.push((guess.k, guess.p, 0.15 * guess.k / v));
        if s.k.is_none() {
            // the same force at 0.6 depth with other powers
            for p in [1.0, 1.5, 2.2, 3.0] {
                let k = guess.k * self.data.scales.x_ref.powf(guess.p - p);
                starts.push((k, p, 0.3 * k / v));
            }
        }
        let fits: Vec<Fit> = starts
            .into_par_iter()
            .map(|(k, p, mu)| {
                let m = self.model(&MakeUp::default(), k, p, mu);
                let pr = Problem::new(self.data, &m);
                let start = pr.start();
                pr.fit(start, &Options { iterations: 40, ..Options::default() })
            })
            .collect();
        fits.into_iter().min_by(|a, b| a.point.chi2.total_cmp(&b.point.chi2)).expect("there is a start")
    }

    /// Weights of an imposed penetration: where the force rises steeply the scatter of the penetration
    /// counts as well (effective variance: Orear 1982).
    pub fn effective_weights(&self, point: &Point) -> Vec<Vec<f64>> {
        let model = self.model(&MakeUp::default(), 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let sx = self.data.noise[2].marginal();
        let sf = self.data.noise[0].marginal();
        (0..self.data.records.len())
            .map(|r| {
                let (t, _) = problem.predict(&point.theta, r, &point.locals[r]);
                let n = t.force.len();
                (0..n)
                    .map(|i| {
                        let (a, b) = (i.saturating_sub(6), (i + 6).min(n - 1));
                        let dx = (t.position[b] - t.position[a]).abs();
                        let slope = if dx > 2.0 * sx { (t.force[b] - t.force[a]).abs() / dx } else { 0.0 };
                        let own = if t.position[i] > 0.0 {
                            point.theta[1] * t.force[i].max(0.0) / t.position[i].max(3.0 * sx)
                        } else {
                            0.0
                        };
                        sf / (sf * sf + (slope.max(own) * sx).powi(2)).sqrt()
                    })
                    .collect()
            })
            .collect()
    }

    /// Samples that stand alone far outside the noise, by recording and channel: (recording, channel, sample).
    pub fn spikes(&self, point: &Point) -> Vec<(usize, usize, usize)> {
        let model = self.model(&MakeUp::default(), 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let mut out = Vec::new();
        for (r, rec) in self.data.records.iter().enumerate() {
            let (_, y) = problem.predict(&point.theta, r, &point.locals[r]);
            for c in self.data.compared(r) {
                let i = c.index();
                let Some(read) = &rec.y[i] else { continue };
                let e: Vec<f64> = read.iter().zip(&y[i]).zip(&rec.weight[i]).map(|((a, b), w)| (a - b) * w).collect();
                let s = self.data.noise[i].marginal();
                for k in 0..e.len() {
                    let mut near: Vec<f64> = (k.saturating_sub(4)..(k + 5).min(e.len()))
                        .filter(|j| j.abs_diff(k) > 1)
                        .map(|j| e[j])
                        .collect();
                    near.sort_by(f64::total_cmp);
                    let middle = near[near.len() / 2];
                    let spread = near[near.len() - 1] - near[0];
                    if (e[k] - middle).abs() > 5.0 * s && (e[k] - middle).abs() > 1.5 * spread {
                        out.push((r, i, k));
                    }
                }
            }
        }
        out
    }

    /// Index of the first parameter of the make-up's terms.
    pub fn first_term(&self, model: &Model<'_>, make_up: &MakeUp) -> usize {
        model.parameters.len() - make_up.terms.iter().map(|t| t.form.parameters.len()).sum::<usize>()
    }

    /// Fits `make_up` plus `term` from `from` (a fit of `make_up`), from its best starts by score.
    pub fn add(
        &self,
        make_up: &MakeUp,
        from: &Point,
        term: &Term,
        most_starts: usize,
        options: &Options,
    ) -> Option<Fit> {
        let base_model = self.model(make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &base_model);
        let linear = problem.linearise(from)?;
        let mut starts = self.score(from, &problem, &linear, term);
        starts.truncate(most_starts);
        let drifted = if term.mechanism.name == SOFTENING { self.drifted(make_up, from) } else { None };
        self.fit_from(make_up, from, drifted.as_ref(), term, &starts, options)
    }

    /// Starts of a term by their expected gain in chi^2, best first; amplitudes set to the linear estimate.
    fn score(&self, from: &Point, problem: &Problem<'_>, linear: &Linear, term: &Term) -> Starts {
        let mut scored: Starts = Vec::new();
        for s in &term.form.starts {
            let c = &self.context;
            let Some(sig) = problem.signature(linear, from, &|p| (term.form.apply)(s, c, p), 1.0) else { continue };
            let (sr, ss) = linear.score(&sig);
            let mut start = s.clone();
            let q = &term.form.parameters[0];
            let z2;
            if term.form.linear {
                let a = (sr / ss * s[0]).clamp(q.lower.max(-10.0 * s[0].abs()), q.upper.min(10.0 * s[0].abs()));
                z2 = if a * s[0] > 0.0 || q.lower < 0.0 { sr * sr / ss } else { 0.0 };
                start[0] = if a == 0.0 { 0.1 * s[0] } else { a };
            } else {
                // gain of taking the whole step, or of a part of it where the step can be shortened
                z2 = (2.0 * sr - ss).max(0.5 * if sr > 0.0 { sr * sr / ss } else { 0.0 });
            }
            scored.push((z2, start));
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        scored
    }

    fn fit_from(
        &self,
        make_up: &MakeUp,
        from: &Point,
        drifted: Option<&Point>,
        term: &Term,
        starts: &[(f64, Vec<f64>)],
        options: &Options,
    ) -> Option<Fit> {
        let mut next = make_up.clone();
        next.terms.push(term.clone());
        let model = self.model(&next, 1.0, 1.0, 0.0);
        let pr = Problem::new(self.data, &model);
        let mut points = Vec::new();
        let from_drift = drifted.filter(|_| term.mechanism.name == SOFTENING);
        for (_, start) in starts {
            let mut theta = from.theta.clone();
            theta.extend(start);
            points.push((theta, self.settled(&from.locals, term)));
        }
        if let Some(d) = from_drift {
            for start in &term.form.starts {
                let (rise, start) = self.softened(d, term, start);
                let mut theta = d.theta.clone();
                theta[0] += rise;
                theta.extend(start);
                points.push((theta, self.settled(&d.locals, term)));
            }
        }
        let mut best: Option<Fit> = None;
        for (theta, locals) in points {
            let point = pr.evaluate(theta, locals);
            if !point.chi2.is_finite() {
                continue;
            }
            let f = pr.fit(point, options);
            if best.as_ref().is_none_or(|b| f.point.chi2 < b.point.chi2) {
                best = Some(f);
            }
        }
        best
    }

    /// Nuisances to start a term from: for softening, what the scatter between repeats had taken up goes back.
    fn settled(&self, locals: &[Vec<f64>], term: &Term) -> Vec<Vec<f64>> {
        let mut locals = locals.to_vec();
        if term.mechanism.name == SOFTENING {
            if let Some(i) = self.data.nuisances().iter().position(|n| *n == Nuisance::Stiffness) {
                locals.iter_mut().for_each(|l| l[i] = 0.0);
            }
        }
        locals
    }

    /// `make_up` fitted with every recording's stiffness free: how it drifts with order tells softening apart from
    /// what the other parameters had made of it.
    pub fn drifted(&self, make_up: &MakeUp, from: &Point) -> Option<Point> {
        if self.context.scales.orders < 3.0 || make_up.terms.iter().any(|t| t.mechanism.name == SOFTENING) {
            return None;
        }
        let mut data = self.data.clone();
        data.repeat_scatter = FREE_SCATTER;
        let model = self.model(make_up, 1.0, 1.0, 0.0);
        let pr = Problem::new(&data, &model);
        let start = pr.evaluate(from.theta.clone(), from.locals.clone());
        let fit = pr.fit(start, &Options { iterations: 25, ..Options::default() });
        fit.point.chi2.is_finite().then_some(fit.point)
    }

    /// (rise of ln F_ref, start) of a form of softening that follows the drift best, by a straight line of the
    /// stiffness over the form's own course with order.
    fn softened(&self, drifted: &Point, term: &Term, start: &[f64]) -> (f64, Vec<f64>) {
        let i = self.data.nuisances().iter().position(|n| *n == Nuisance::Stiffness).unwrap_or(0);
        let mut probe = Physics::default();
        let mut t = start.to_vec();
        t[0] = 0.01;
        (term.form.apply)(&t, &self.context, &mut probe);
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (r, l) in self.data.records.iter().zip(&drifted.locals) {
            let x = (1.0 - probe.softening_factor(r.setup.order)) / 0.01;
            let y = l[i].exp();
            n += 1.0;
            sx += x;
            sy += y;
            sxx += x * x;
            sxy += x * y;
        }
        let slope = (n * sxy - sx * sy) / (n * sxx - sx * sx).max(1e-12);
        let level = (sy - slope * sx) / n;
        let q = &term.form.parameters[0];
        t[0] = (-slope / level).clamp(q.lower + 1e-4, q.upper);
        (level.max(0.05).ln(), t)
    }

    /// The channel whose recordings of different levels end in one and the same reading, several samples long: no
    /// impact does that, a range does.
    pub fn flat_tops(&self) -> Option<Channel> {
        [Channel::Force, Channel::Acceleration].into_iter().find(|c| {
            let i = c.index();
            let top = self.context.top[i];
            let mut levels: Vec<usize> = self
                .data
                .records
                .iter()
                .filter(|r| {
                    r.y[i]
                        .as_ref()
                        .is_some_and(|y| y.windows(FLAT).any(|w| w.iter().all(|v| (v.abs() - top).abs() <= 1e-9 * top)))
                })
                .map(|r| r.level)
                .collect();
            levels.sort_unstable();
            levels.dedup();
            levels.len() > 1
        })
    }

    /// All terms that could be added.
    pub fn candidates(&self) -> Vec<Term> {
        let have: Vec<&str> = self.given.iter().map(|t| t.mechanism.name).collect();
        ALL.iter()
            .filter(|m| !have.contains(&m.name))
            .flat_map(|m| (m.forms)(&self.context).into_iter().map(move |form| Term { mechanism: m, form }))
            .collect()
    }

    /// Scores every candidate beside `make_up` and fits those that stand a chance, the best forms of each
    /// mechanism; integrates coarsely. Best first.
    pub fn screen(
        &self,
        make_up: &MakeUp,
        from: &Fit,
        candidates: &[Term],
        starts: usize,
        options: &Options,
    ) -> Vec<(Term, Fit)> {
        let data = self.data.coarse();
        let sift = Search { data: &data, context: self.context.clone(), given: self.given.clone(), ..*self };
        let base_model = sift.model(make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(&data, &base_model);
        let Some(linear) = problem.linearise(&from.point) else { return Vec::new() };
        let coarse_base = problem.evaluate(from.point.theta.clone(), from.point.locals.clone()).chi2;
        let mut scored: Vec<(&Term, Starts)> = candidates
            .par_iter()
            .filter(|t| !make_up.terms.iter().any(|u| u.mechanism.name == t.mechanism.name))
            .map(|t| (t, sift.score(&from.point, &problem, &linear, t)))
            .collect();
        let drifted = sift.drifted(make_up, &from.point);
        let score = |s: &Starts| s.first().map_or(0.0, |s| s.0);
        // a step along a tangent may promise more than there is to gain; what is near noise has little
        let most = (from.point.chi2 - NOISE_AT_LEAST * self.data.samples() as f64).max(LITTLE);
        let top = scored.iter().map(|(_, s)| score(s)).fold(0.0, f64::max).min(most);
        let options = Options { hopeless: options.hopeless.max(0.003 * top), ..*options };
        scored.sort_by(|a, b| score(&b.1).total_cmp(&score(&a.1)));
        let mut forms: Vec<&str> = Vec::new();
        scored.retain(|(t, s)| {
            // the score says little of what is not linear in its parameters
            let hard = HARD.contains(&t.mechanism.name) && starts > 1;
            let small = t.form.linear && t.form.parameters.len() == 1 && top <= LITTLE;
            // what a tolerance holds back counts by its prior, however much others promise
            let held = t.mechanism.is_calibration() && score(s) >= HELD_BACK;
            let least = if t.form.linear { LINEAR_SHARE } else { OTHER_SHARE } * top;
            forms.push(t.mechanism.name);
            let rank = forms.iter().filter(|f| **f == t.mechanism.name).count();
            hard || held
                || ((rank <= FORMS_A_MECHANISM || small) && (score(s) >= least.max(1.0) || small || top <= 20.0))
        });
        let mut v: Vec<(Term, Fit)> = scored
            .into_par_iter()
            .filter_map(|(t, mut s)| {
                s.truncate(if t.form.linear { 1 } else { starts });
                let mut fit = sift.fit_from(make_up, &from.point, drifted.as_ref(), t, &s, &options)?;
                let mut next = make_up.clone();
                next.terms.push(t.clone());
                let model = self.model(&next, 1.0, 1.0, 0.0);
                let fine = Problem::new(self.data, &model);
                let promised = coarse_base - fit.point.chi2;
                fit.point = fine.evaluate(fit.point.theta, fit.point.locals);
                let kept = from.point.chi2 - fit.point.chi2;
                // what coarse integration shifts can hide a gain, until the rest has followed
                if promised > options.hopeless && kept < promised - options.hopeless.max(SHIFTED * promised) {
                    fit = fine.fit(fit.point, &Options { iterations: 3, hopeless: 0.0, ..options });
                }
                Some((t.clone(), fit))
            })
            .collect();
        v.sort_by(|a, b| a.1.point.chi2.total_cmp(&b.1.point.chi2));
        v
    }
}
