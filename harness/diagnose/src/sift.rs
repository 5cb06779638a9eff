//! Sifting: every form of every mechanism scored beside a fit, and those that promise something fitted, coarsely.

use super::search::{MakeUp, Search, Term};
use estimate::problem::{Fit, Linear, Nuisance, Options, Point, Problem};
use mechanisms::physics::Physics;
use rayon::prelude::*;

/// Mechanisms whose effect is far from linear in their parameters, so that a score may miss them.
pub const HARD: [&str; 6] =
    ["base_compliance", "loose_part", "sensor_resonance", "cyclic_softening", "secondary_stiffening", "return_spring"];

/// Share of the best score from which a form is fitted at all: linear in its first parameter, and others.
const LINEAR_SHARE: f64 = 0.12;
const OTHER_SHARE: f64 = 0.01;
/// Share of the samples that chi^2 falls to at best: the noise is known to some per cent.
const NOISE_AT_LEAST: f64 = 0.98;
/// Expected gain in chi^2 from which a calibration beyond its tolerance is fitted at all.
const HELD_BACK: f64 = 5.0;
/// Gain in chi^2 that there may be in any case.
const LITTLE: f64 = 100.0;
/// Change of the residual beside the residual from which a start is too far off to lead anywhere.
const FARTHEST: f64 = 10.0;
/// Largest share of the depth that a stop's giving way is taken to have had, where a fit starts.
const MOST_GIVEN: f64 = 0.8;
/// Share of a gain found with coarse integration that may be lost by fine, before a candidate is fitted again.
const SHIFTED: f64 = 0.1;
/// chi^2 a sample from which a fit is far from noise.
const FAR: f64 = 5.0;
/// Forms fitted first, and the share of their best gain that the others have to have come to when a fit looks whether to
/// give up.
const LEADERS: usize = 6;
const PACE: f64 = 0.1;
/// Forms of one mechanism that are sifted by fitting.
const FORMS_A_MECHANISM: usize = 2;
const SOFTENING: &str = "cyclic_softening";
const LAYER: &str = "secondary_stiffening";
/// Force at the reference depth that a layer is tried with from where the shallower recordings have led, over the peak's.
const LAYER_FORCES: [f64; 3] = [0.1, 0.7, 5.0];
/// Standard deviation of ln stiffness that leaves every recording its own.
const FREE_SCATTER: f64 = 0.3;

/// Where a fit starts.
struct Start {
    /// Gain in chi^2 expected of it.
    gain: f64,
    /// Values of the term's parameters.
    values: Vec<f64>,
    /// What is added to ln F_ref beside them.
    rise: f64,
}

/// Starts, best first.
type Starts = Vec<Start>;

impl Search<'_> {
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
        let shallow = if term.mechanism.name == LAYER { self.shallow(make_up, from) } else { None };
        self.fit_from(make_up, from, (drifted.as_ref(), shallow.as_ref()), term, &starts, options)
    }

    /// What there is to gain in chi^2 at a point; what is near noise has little.
    fn most(&self, from: &Point) -> f64 {
        (from.chi2 - NOISE_AT_LEAST * self.data.samples() as f64).max(LITTLE)
    }

    /// Starts of a term by their expected gain in chi^2, best first; amplitudes set to the linear estimate.
    fn score(&self, from: &Point, problem: &Problem<'_>, linear: &Linear, term: &Term) -> Starts {
        let most = self.most(from);
        let c = &self.context;
        let mut scored: Starts = Vec::new();
        let mut nearest: Option<(f64, Start)> = None;
        for s in &term.form.starts {
            let change = |s: &[f64], rise: f64| -> Option<(f64, f64)> {
                let with = |p: &mut Physics| {
                    term.form.apply(s, c, p);
                    p.law.elastic.stiffness *= rise.exp();
                    p.law.hysteresis_damping.coefficient *= rise.exp();
                };
                Some(linear.score(&problem.signature(linear, from, &with, 1.0)?))
            };
            if !term.form.linear {
                let mut rises = vec![0.0];
                rises.extend(self.rise(from, term, s));
                for rise in rises {
                    let Some((sr, ss)) = change(s, rise) else { continue };
                    // of the whole step, or of a part of it where the step can be shortened
                    let part = 0.5 * if sr > 0.0 { sr * sr / ss } else { 0.0 };
                    let start = Start { gain: (2.0 * sr - ss).max(part), values: s.clone(), rise };
                    if ss <= FARTHEST * from.chi2 {
                        scored.push(start);
                    } else if nearest.as_ref().is_none_or(|(n, _)| ss < *n) {
                        nearest = Some((ss, start));
                    }
                }
                continue;
            }
            let Some((mut sr, mut ss)) = change(s, 0.0) else { continue };
            let mut values = s.clone();
            if ss > most {
                // no more than there is to gain: far from here nothing is linear, bounces least of all
                values[0] *= (most / ss).sqrt();
                let Some(nearer) = change(&values, 0.0) else { continue };
                (sr, ss) = nearer;
            }
            let (q, unit) = (&term.form.parameters[0], values[0]);
            let a = (sr / ss * unit).clamp(q.lower.max(-10.0 * unit.abs()), q.upper.min(10.0 * unit.abs()));
            let gain = if a * unit > 0.0 || q.lower < 0.0 { sr * sr / ss } else { 0.0 };
            values[0] = if a == 0.0 { 0.1 * unit } else { a };
            scored.push(Start { gain, values, rise: 0.0 });
        }
        if scored.is_empty() {
            scored.extend(nearest.map(|(_, start)| start));
        }
        scored.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        scored
    }

    /// What a stop that gives takes of the way, the contact itself must be stiffer by: the rise of ln F_ref that keeps
    /// the force at the depth reached. None where nothing gives.
    fn rise(&self, from: &Point, term: &Term, values: &[f64]) -> Option<f64> {
        let s = &self.context.scales;
        let mut p = Physics::default();
        term.form.apply(values, &self.context, &mut p);
        if p.base_stiffness <= 0.0 || p.base_reads {
            return None;
        }
        // the stop is held by its spring, and by its inertia for as long as the contact lasts
        let held = p.base_stiffness + p.base_mass * (std::f64::consts::PI / s.duration).powi(2);
        let share = (s.force / held / s.depth).min(MOST_GIVEN);
        Some(-from.theta[1] * (1.0 - share).ln())
    }

    fn fit_from(
        &self,
        make_up: &MakeUp,
        from: &Point,
        (drifted, shallow): (Option<&Point>, Option<&Point>),
        term: &Term,
        starts: &[Start],
        options: &Options,
    ) -> Option<Fit> {
        let model = self.model(&make_up.with(term.clone()), 1.0, 1.0, 0.0);
        let pr = Problem::new(self.data, &model);
        let mut points = Vec::new();
        let from_drift = drifted.filter(|_| term.mechanism.name == SOFTENING);
        for start in starts {
            let mut theta = from.theta.clone();
            theta[0] += start.rise;
            theta.extend(&start.values);
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
        if let Some(s) = shallow.filter(|_| term.mechanism.name == LAYER) {
            points.extend(self.layered(&pr, s, term).map(|theta| (theta, s.locals.clone())));
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
        if term.mechanism.name == SOFTENING {
            self.without_scatter(locals)
        } else {
            locals.to_vec()
        }
    }

    /// Nuisances with every recording as stiff as the rest.
    pub(super) fn without_scatter(&self, locals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut locals = locals.to_vec();
        if let Some(i) = self.data.nuisances().iter().position(|n| *n == Nuisance::Stiffness) {
            locals.iter_mut().for_each(|l| l[i] = 0.0);
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

    /// `make_up` fitted to the shallower half of the recordings alone: what a layer farther down adds to the rest had
    /// bent the law. None where they are of one level, or all of them.
    pub fn shallow(&self, make_up: &MakeUp, from: &Point) -> Option<Point> {
        if make_up.terms.iter().any(|t| t.mechanism.name == LAYER) {
            return None;
        }
        let records = &self.data.records;
        let mut depths: Vec<f64> = records.iter().map(|r| r.setup.depth).collect();
        depths.sort_by(f64::total_cmp);
        let middle = depths[(depths.len() - 1) / 2];
        let kept: Vec<usize> = (0..records.len()).filter(|r| records[*r].setup.depth <= middle).collect();
        let few = kept.iter().all(|r| records[*r].level == records[kept[0]].level);
        if few || kept.len() == records.len() {
            return None;
        }
        let data = self.data.subset(|r| kept.contains(&r));
        let model = self.model(make_up, 1.0, 1.0, 0.0);
        let pr = Problem::new(&data, &model);
        let locals = kept.iter().map(|r| from.locals[*r].clone()).collect();
        let fit = pr.fit(pr.evaluate(from.theta.clone(), locals), &Options { iterations: 25, ..Options::default() });
        let found = fit.point.chi2.is_finite();
        found.then(|| Point { theta: fit.point.theta, locals: self.without_scatter(&from.locals), chi2: f64::INFINITY })
    }

    /// Where a layer beside the law of the shallower recordings fits best, of a grid of forces and depths.
    fn layered(&self, problem: &Problem<'_>, shallow: &Point, term: &Term) -> Option<Vec<f64>> {
        let tried = term.form.starts.iter().flat_map(|s| LAYER_FORCES.map(|f| [vec![f], s[1..].to_vec()].concat()));
        let with = |values: Vec<f64>| {
            let theta = [shallow.theta.clone(), values].concat();
            (problem.evaluate(theta.clone(), shallow.locals.clone()).chi2, theta)
        };
        let (chi2, theta) = tried.map(with).min_by(|a, b| a.0.total_cmp(&b.0))?;
        chi2.is_finite().then_some(theta)
    }

    /// (rise of ln F_ref, start) of a form of softening that follows the drift best, by a straight line of the
    /// stiffness over the form's own course with order.
    fn softened(&self, drifted: &Point, term: &Term, start: &[f64]) -> (f64, Vec<f64>) {
        let i = self.data.nuisances().iter().position(|n| *n == Nuisance::Stiffness).unwrap_or(0);
        let mut probe = Physics::default();
        let mut t = start.to_vec();
        t[0] = 0.01;
        term.form.apply(&t, &self.context, &mut probe);
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (r, l) in self.data.records.iter().zip(&drifted.locals) {
            let x = (1.0 - probe.softening_factor(&r.setup.taken)) / 0.01;
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
        let shallow = sift.shallow(make_up, &from.point);
        let score = |s: &Starts| s.first().map_or(0.0, |s| s.gain);
        // a step along a tangent may promise more than there is to gain
        let most = self.most(&from.point);
        let top = scored.iter().map(|(_, s)| score(s)).fold(0.0, f64::max).min(most);
        let options = Options { hopeless: options.hopeless.max(0.003 * top), ceiling: coarse_base + most, ..*options };
        scored.sort_by(|a, b| score(&b.1).total_cmp(&score(&a.1)));
        // a score says little far from noise: of one effect it names the best form, of two not even that
        let far = from.point.chi2 > FAR * self.data.samples() as f64;
        let lost = far && make_up.terms.len() > 1;
        let mut forms: Vec<&str> = Vec::new();
        scored.retain(|(t, s)| {
            // the score says little of what is not linear in its parameters
            let hard = HARD.contains(&t.mechanism.name) && starts > 1;
            let plain = t.form.linear && t.form.parameters.len() == 1;
            let small = plain && top <= LITTLE;
            // what a tolerance holds back counts by its prior, however much others promise
            let held = t.mechanism.is_calibration() && score(s) >= HELD_BACK;
            let least = if t.form.linear { LINEAR_SHARE } else { OTHER_SHARE } * top;
            forms.push(t.mechanism.name);
            let rank = forms.iter().filter(|f| **f == t.mechanism.name).count();
            (hard && !s.is_empty())
                || held
                || ((rank <= FORMS_A_MECHANISM || plain)
                    && (score(s) >= least.max(1.0) || small || lost || far && rank == 1 || top <= 20.0))
        });
        let fitted = |(t, s): &(&Term, Starts), options: &Options| -> Option<(f64, (Term, Fit))> {
            let s = &s[..s.len().min(if t.form.linear { 1 } else { starts })];
            let mut fit = sift.fit_from(make_up, &from.point, (drifted.as_ref(), shallow.as_ref()), t, s, options)?;
            let model = self.model(&make_up.with((*t).clone()), 1.0, 1.0, 0.0);
            let fine = Problem::new(self.data, &model);
            let promised = coarse_base - fit.point.chi2;
            fit.point = fine.evaluate(fit.point.theta, fit.point.locals);
            let kept = from.point.chi2 - fit.point.chi2;
            // what coarse integration shifts can hide a gain, until the rest has followed
            if promised > options.hopeless && kept < promised - options.hopeless.max(SHIFTED * promised) {
                fit = fine.fit(fit.point, &Options { iterations: 3, hopeless: 0.0, ..*options });
            }
            Some((promised, ((*t).clone(), fit)))
        };
        // those that promise most set the pace for the rest
        let (leaders, rest) = scored.split_at(scored.len().min(LEADERS));
        let leaders: Vec<_> = leaders.par_iter().filter_map(|t| fitted(t, &options)).collect();
        let pace = leaders.iter().map(|l| l.0).fold(0.0, f64::max);
        let rest_options = Options { ceiling: options.ceiling.min(coarse_base - PACE * pace), ..options };
        let rest: Vec<_> = rest.par_iter().filter_map(|t| fitted(t, &rest_options)).collect();
        let mut v: Vec<(Term, Fit)> = leaders.into_iter().chain(rest).map(|(_, fit)| fit).collect();
        v.sort_by(|a, b| a.1.point.chi2.total_cmp(&b.1.point.chi2));
        v
    }
}
