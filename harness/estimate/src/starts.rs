//! Where a fit of one more mechanism starts: from the form's own starts, scored along their tangents; from the drift of
//! the stiffness with the order of the recordings; from the law of the shallower recordings.

use crate::fitted::Fitted;
use crate::problem::{Linear, Nuisance, Options, Point, Problem};
use crate::structure::Term;
use mechanisms::mechanism::StartsFrom;
use mechanisms::physics::Physics;
use std::sync::Arc;

/// Share of the samples that chi^2 falls to at best: the noise is known to some per cent.
const NOISE_AT_LEAST: f64 = 0.98;
/// Gain in chi^2 that there may be in any case.
const LITTLE: f64 = 100.0;
/// Change of the residual beside the residual from which a start is too far off to lead anywhere.
const FARTHEST: f64 = 10.0;
/// Largest share of the depth that the compliance of the stop is assumed to have had, where a fit starts.
const MOST_COMPLIANCE: f64 = 0.8;
/// Force at the reference depth that a layer is tried with from the law of the shallower recordings, over the peak's.
const LAYER_FORCES: [f64; 3] = [0.1, 0.7, 5.0];
/// Standard deviation of ln stiffness that leaves every recording its own.
const FREE_SCATTER: f64 = 0.3;

/// What fits of a term start from.
fn starts_from(term: &Term) -> StartsFrom {
    term.mechanism.hints.starts_from
}

/// Where a fit starts.
pub struct Start {
    /// Gain in chi^2 expected of it.
    pub gain: f64,
    /// Values of the term's parameters.
    values: Vec<f64>,
    /// What is added to ln F_ref beside them.
    rise: f64,
}

/// Fits that some mechanisms start from: with every recording's stiffness free, and of the shallower recordings.
#[derive(Default)]
pub struct Further {
    drift: Option<Point>,
    shallow: Option<Point>,
}

impl Fitted {
    /// This structure with one more term, fitted from the best of its starts by score, `most_starts` at most. None where
    /// nothing can be simulated.
    pub fn add(&self, term: &Term, most_starts: usize, options: &Options) -> Option<Fitted> {
        let problem = self.problem();
        let linear = problem.linearise(&self.fit.point)?;
        let mut starts = self.scored(&problem, &linear, term);
        starts.truncate(most_starts);
        let further = Further {
            drift: if starts_from(term) == StartsFrom::Drift { self.drift() } else { None },
            shallow: if starts_from(term) == StartsFrom::Shallow { self.shallow() } else { None },
        };
        self.fit_from(&further, term, &starts, options)
    }

    /// The fits that some mechanisms start from.
    pub fn further(&self) -> Further {
        Further { drift: self.drift(), shallow: self.shallow() }
    }

    /// What there is to gain in chi^2; what is near noise has little.
    pub fn most(&self) -> f64 {
        (self.fit.point.chi2 - NOISE_AT_LEAST * self.data.samples() as f64).max(LITTLE)
    }

    /// Starts of a term by their expected gain in chi^2, best first; amplitudes set to the linear estimate. `linear` is
    /// `problem` linearised at this fit.
    pub fn scored(&self, problem: &Problem<'_>, linear: &Linear, term: &Term) -> Vec<Start> {
        let from = &self.fit.point;
        let most = self.most();
        let c = &self.structure.base().context;
        let mut scored: Vec<Start> = Vec::new();
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
                rises.extend(self.rise(term, s));
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

    /// What the compliance of the stop takes of the way, the contact itself must be stiffer by: the rise of ln F_ref that
    /// keeps the force at the depth reached. None where the stop is rigid.
    fn rise(&self, term: &Term, values: &[f64]) -> Option<f64> {
        let c = &self.structure.base().context;
        let s = &c.scales;
        let mut p = Physics::default();
        term.form.apply(values, c, &mut p);
        let share = p.base_compliance.share_of_approach(s.force, s.depth, s.duration)?;
        let share = share.min(MOST_COMPLIANCE);
        Some(-self.structure.exponent(&self.fit.point.theta) * (1.0 - share).ln())
    }

    /// This structure with one more term, fitted from each of `starts` and from what `further` holds for it; the best.
    pub fn fit_from(&self, further: &Further, term: &Term, starts: &[Start], options: &Options) -> Option<Fitted> {
        let from = &self.fit.point;
        let structure = self.structure.with(term.clone());
        let problem = Problem::new(&self.data, structure.model());
        let mut points = Vec::new();
        for start in starts {
            let mut theta = from.theta.clone();
            self.structure.raise(&mut theta, start.rise);
            theta.extend(&start.values);
            points.push((theta, self.locals_for(&from.locals, term)));
        }
        if let Some(d) = further.drift.as_ref().filter(|_| starts_from(term) == StartsFrom::Drift) {
            for start in &term.form.starts {
                let (rise, start) = self.along_drift(d, term, start);
                let mut theta = d.theta.clone();
                self.structure.raise(&mut theta, rise);
                theta.extend(start);
                points.push((theta, self.locals_for(&d.locals, term)));
            }
        }
        if let Some(s) = further.shallow.as_ref().filter(|_| starts_from(term) == StartsFrom::Shallow) {
            points.extend(layered(&problem, s, term).map(|theta| (theta, s.locals.clone())));
        }
        let mut best: Option<crate::problem::Fit> = None;
        for (theta, locals) in points {
            let point = problem.evaluate(theta, locals);
            if !point.chi2.is_finite() {
                continue;
            }
            let f = problem.fit(point, options);
            if best.as_ref().is_none_or(|b| f.point.chi2 < b.point.chi2) {
                best = Some(f);
            }
        }
        let fit = best?;
        Some(Fitted { data: self.data.clone(), structure, fit })
    }

    /// Nuisances to start a term from: for softening, the scatter between repeats, which had absorbed it, starts at zero.
    fn locals_for(&self, locals: &[Vec<f64>], term: &Term) -> Vec<Vec<f64>> {
        if starts_from(term) == StartsFrom::Drift {
            self.data.without_scatter(locals)
        } else {
            locals.to_vec()
        }
    }

    /// Fitted with every recording's stiffness free: how it drifts with order distinguishes softening from what the other
    /// parameters had absorbed of it.
    fn drift(&self) -> Option<Point> {
        if self.structure.base().context.scales.orders < 3.0
            || self.structure.has(|h| h.starts_from == StartsFrom::Drift)
        {
            return None;
        }
        let from = &self.fit.point;
        let mut data = (*self.data).clone();
        data.repeat_scatter = FREE_SCATTER;
        let problem = Problem::new(&data, self.structure.model());
        let start = problem.evaluate(from.theta.clone(), from.locals.clone());
        let fit = problem.fit(start, &Options { iterations: 25, ..Options::default() });
        fit.point.chi2.is_finite().then_some(fit.point)
    }

    /// Fitted to the shallower half of the recordings alone: what a layer farther down adds to the rest had bent the law.
    /// None where they are of one level, or all of them.
    fn shallow(&self) -> Option<Point> {
        if self.structure.has(|h| h.starts_from == StartsFrom::Shallow) {
            return None;
        }
        let from = &self.fit.point;
        let records = &self.data.records;
        let mut depths: Vec<f64> = records.iter().map(|r| r.setup.depth).collect();
        depths.sort_by(f64::total_cmp);
        let middle = depths[(depths.len() - 1) / 2];
        let kept: Vec<usize> = (0..records.len()).filter(|r| records[*r].setup.depth <= middle).collect();
        let few = kept.iter().all(|r| records[*r].level == records[kept[0]].level);
        if few || kept.len() == records.len() {
            return None;
        }
        let data = Arc::new(self.data.subset(|r| kept.contains(&r)));
        let problem = Problem::new(&data, self.structure.model());
        let locals = kept.iter().map(|r| from.locals[*r].clone()).collect();
        let start = problem.evaluate(from.theta.clone(), locals);
        let fit = problem.fit(start, &Options { iterations: 25, ..Options::default() });
        let locals = self.data.without_scatter(&from.locals);
        fit.point.chi2.is_finite().then_some(Point { theta: fit.point.theta, locals, chi2: f64::INFINITY })
    }

    /// (rise of ln F_ref, start) of a form of softening that follows the drift best, by a straight line of the
    /// stiffness over the form's own course with order.
    fn along_drift(&self, drift: &Point, term: &Term, start: &[f64]) -> (f64, Vec<f64>) {
        let i = self.data.nuisances().iter().position(|n| *n == Nuisance::Stiffness).unwrap_or(0);
        let mut unit = Physics::default();
        let mut t = start.to_vec();
        t[0] = 0.01;
        term.form.apply(&t, &self.structure.base().context, &mut unit);
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (r, l) in self.data.records.iter().zip(&drift.locals) {
            let x = (1.0 - unit.wear(&r.setup.history).stiffness) / 0.01;
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
}

/// Where a layer beside the law of the shallower recordings fits best, of a grid of forces and depths.
fn layered(problem: &Problem<'_>, shallow: &Point, term: &Term) -> Option<Vec<f64>> {
    let tried = term.form.starts.iter().flat_map(|s| LAYER_FORCES.map(|f| [vec![f], s[1..].to_vec()].concat()));
    let with = |values: Vec<f64>| {
        let theta = [shallow.theta.clone(), values].concat();
        (problem.evaluate(theta.clone(), shallow.locals.clone()).chi2, theta)
    };
    let (chi2, theta) = tried.map(with).min_by(|a, b| a.0.total_cmp(&b.0))?;
    chi2.is_finite().then_some(theta)
}
