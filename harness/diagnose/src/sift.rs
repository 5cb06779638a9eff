//! Sifting: every form of every mechanism scored beside a fit, and those that promise something fitted, coarsely.

use super::candidate::{least_beside, Candidate};
#[cfg(doc)]
use super::posterior::POSSIBLE;
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::{Linear, Options, Problem};
use estimate::starts::Start;
use estimate::structure::Term;
use rayon::prelude::*;

/// Share of the best score from which a form is fitted at all: linear in its first parameter, and others.
const LINEAR_SHARE: f64 = 0.12;
const OTHER_SHARE: f64 = 0.01;
/// Expected gain in chi^2 from which a calibration beyond its tolerance is fitted at all.
const TOLERANCE_GAIN: f64 = 5.0;
/// Gain in chi^2 below which no mechanism comes out possible: -2 ln of [`POSSIBLE`], the likelihood ratio at its best.
const NO_EVIDENCE: f64 = 6.0;
/// Share of what there is to gain to which a form is fitted here.
const CLOSE: f64 = 1e-3;
const CLOSE_AT_LEAST: f64 = 1e-4;
/// chi^2 a sample from which a fit is far from noise.
const FAR: f64 = 5.0;
/// Forms fitted first, and the share of their best gain that the others have to have come to when a fit looks whether to
/// give up; that share where the best of the first explains what there is.
const LEADERS: usize = 6;
const PACE: f64 = 0.1;
const PACE_EXPLAINED: f64 = 0.5;
/// Forms of one mechanism that are sifted by fitting.
const FORMS_A_MECHANISM: usize = 2;

/// The `candidates` that may stand beside `from`, with their starts scored along their tangents; `linear` is `problem`
/// linearised at `from`.
fn scored<'t>(
    from: &Fitted,
    problem: &Problem<'_>,
    linear: &Linear,
    candidates: &'t [Term],
) -> Vec<(&'t Term, Vec<Start>)> {
    let admitted = candidates.par_iter().filter(|t| from.structure.takes(t));
    admitted.map(|t| (t, from.scored(problem, linear, t))).collect()
}

/// Gain in chi^2 that the best of a term's starts promises.
fn promised(starts: &[Start]) -> f64 {
    starts.first().map_or(0.0, |s| s.gain)
}

impl Search {
    /// The most that any mechanism beside `from` promises to gain in chi^2, by the score of its tangents alone: a whole
    /// residual that looks like noise may still hold what one direction shows.
    pub fn promise(&self, from: &Fitted) -> f64 {
        let problem = from.problem();
        let Some(linear) = problem.linearise(from.point()) else { return 0.0 };
        scored(from, &problem, &linear, &self.candidates()).iter().map(|(_, s)| promised(s)).fold(0.0, f64::max)
    }

    /// Scores every candidate beside `from` and fits those that stand a chance, the best forms of each mechanism. Best
    /// first.
    pub fn screen(&self, from: &Fitted, candidates: &[Term], starts: usize, options: &Options) -> Vec<Fitted> {
        let problem = from.problem();
        let point = from.point();
        let Some(linear) = problem.linearise(point) else { return Vec::new() };
        let mut scored = scored(from, &problem, &linear, candidates);
        let further = from.further();
        // a step along a tangent may promise more than there is to gain
        let most = from.most();
        let top = scored.iter().map(|(_, s)| promised(s)).fold(0.0, f64::max).min(most);
        let tolerance = options.tolerance.max((CLOSE * top / point.chi2).min(CLOSE_AT_LEAST));
        let hopeless = options.hopeless.max(0.003 * top);
        let options = Options { tolerance, hopeless, ceiling: point.chi2 + most, ..*options };
        scored.sort_by(|a, b| promised(&b.1).total_cmp(&promised(&a.1)));
        // a score says little far from noise: of one effect it names the best form, of two not even that
        let far = point.chi2 > FAR * self.data.samples() as f64;
        let unranked = far && from.structure.terms().len() > 1;
        let mut forms: Vec<&str> = Vec::new();
        scored.retain(|(t, s)| {
            // the score says little of what is not linear in its parameters
            let nonlinear = t.mechanism.hints.strongly_nonlinear && starts > 1;
            let plain = t.form.linear && t.form.parameters.len() == 1;
            // what a tolerance restrains counts by its prior, however much others promise
            let beyond_tolerance = t.mechanism.hints.is_calibration && promised(s) >= TOLERANCE_GAIN;
            let least = if t.form.linear { LINEAR_SHARE } else { OTHER_SHARE } * top;
            forms.push(t.mechanism.name);
            let rank = forms.iter().filter(|f| **f == t.mechanism.name).count();
            (nonlinear && !s.is_empty())
                || beyond_tolerance
                || ((rank <= FORMS_A_MECHANISM || plain)
                    && (promised(s) >= least.max(NO_EVIDENCE) || unranked || far && rank == 1))
        });
        let fitted = |(t, s): &(&Term, Vec<Start>), options: &Options| -> Option<Fitted> {
            let s = &s[..s.len().min(if t.form.linear { 1 } else { starts })];
            from.fit_from(&further, t, s, options)
        };
        // those that promise most set the pace for the rest
        let (leaders, rest) = scored.split_at(scored.len().min(LEADERS));
        let leaders: Vec<_> = leaders.par_iter().filter_map(|t| fitted(t, &options)).collect();
        let best = leaders.iter().min_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        let pace = best.map_or(0.0, |l| {
            let gain = (point.chi2 - l.chi2()).max(0.0);
            if l.explains(from) {
                least_beside(gain, PACE_EXPLAINED).max(0.0)
            } else {
                PACE * gain
            }
        });
        let rest_options = Options { ceiling: options.ceiling.min(point.chi2 - pace), ..options };
        let rest: Vec<_> = rest.par_iter().filter_map(|t| fitted(t, &rest_options)).collect();
        let mut v: Vec<Fitted> = leaders.into_iter().chain(rest).collect();
        v.sort_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        v
    }
}
