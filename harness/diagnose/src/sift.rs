//! Sifting: every form of every mechanism scored beside a fit, and those that promise something fitted, coarsely.

use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::Options;
use estimate::starts::{Start, LITTLE};
use estimate::structure::Term;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of the best score from which a form is fitted at all: linear in its first parameter, and others.
const LINEAR_SHARE: f64 = 0.12;
const OTHER_SHARE: f64 = 0.01;
/// Expected gain in chi^2 from which a calibration beyond its tolerance is fitted at all.
const TOLERANCE_GAIN: f64 = 5.0;
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

impl Search {
    /// Scores every candidate beside `from` and fits those that stand a chance, the best forms of each mechanism;
    /// integrates coarsely. Best first.
    pub fn screen(&self, from: &Fitted, candidates: &[Term], starts: usize, options: &Options) -> Vec<Fitted> {
        let coarse = from.on(Arc::new(self.data.coarse()));
        let problem = coarse.problem();
        let point = from.point();
        let Some(linear) = problem.linearise(point) else { return Vec::new() };
        let coarse_base = problem.evaluate(point.theta.clone(), point.locals.clone()).chi2;
        let mut scored: Vec<(&Term, Vec<Start>)> = candidates
            .par_iter()
            .filter(|t| !from.structure.holds(t.name()))
            .map(|t| (t, coarse.scored(&problem, &linear, t)))
            .collect();
        let further = coarse.further();
        let score = |s: &[Start]| s.first().map_or(0.0, |s| s.gain);
        // a step along a tangent may promise more than there is to gain
        let most = from.most();
        let top = scored.iter().map(|(_, s)| score(s)).fold(0.0, f64::max).min(most);
        let options = Options { hopeless: options.hopeless.max(0.003 * top), ceiling: coarse_base + most, ..*options };
        scored.sort_by(|a, b| score(&b.1).total_cmp(&score(&a.1)));
        // a score says little far from noise: of one effect it names the best form, of two not even that
        let far = point.chi2 > FAR * self.data.samples() as f64;
        let unranked = far && from.structure.terms().len() > 1;
        let mut forms: Vec<&str> = Vec::new();
        scored.retain(|(t, s)| {
            // the score says little of what is not linear in its parameters
            let nonlinear = t.mechanism.hints.strongly_nonlinear && starts > 1;
            let plain = t.form.linear && t.form.parameters.len() == 1;
            let small = plain && top <= LITTLE;
            // what a tolerance restrains counts by its prior, however much others promise
            let beyond_tolerance = t.mechanism.hints.is_calibration && score(s) >= TOLERANCE_GAIN;
            let least = if t.form.linear { LINEAR_SHARE } else { OTHER_SHARE } * top;
            forms.push(t.mechanism.name);
            let rank = forms.iter().filter(|f| **f == t.mechanism.name).count();
            (nonlinear && !s.is_empty())
                || beyond_tolerance
                || ((rank <= FORMS_A_MECHANISM || plain)
                    && (score(s) >= least.max(1.0) || small || unranked || far && rank == 1))
        });
        let fitted = |(t, s): &(&Term, Vec<Start>), options: &Options| -> Option<(f64, Fitted)> {
            let s = &s[..s.len().min(if t.form.linear { 1 } else { starts })];
            let found = coarse.fit_from(&further, t, s, options)?;
            let promised = coarse_base - found.chi2();
            let mut found = found.on(self.data.clone());
            found.fit.point = found.problem().evaluate(found.fit.point.theta.clone(), found.fit.point.locals.clone());
            let kept = point.chi2 - found.chi2();
            // what coarse integration shifts can hide a gain, until the rest has followed
            if promised > options.hopeless && kept < promised - options.hopeless.max(SHIFTED * promised) {
                let more = Options { iterations: 3, hopeless: 0.0, ..*options };
                found.fit = found.problem().fit(found.fit.point.clone(), &more);
            }
            Some((promised, found))
        };
        // those that promise most set the pace for the rest
        let (leaders, rest) = scored.split_at(scored.len().min(LEADERS));
        let leaders: Vec<_> = leaders.par_iter().filter_map(|t| fitted(t, &options)).collect();
        let pace = leaders.iter().map(|l| l.0).fold(0.0, f64::max);
        let rest_options = Options { ceiling: options.ceiling.min(coarse_base - PACE * pace), ..options };
        let rest: Vec<_> = rest.par_iter().filter_map(|t| fitted(t, &rest_options)).collect();
        let mut v: Vec<Fitted> = leaders.into_iter().chain(rest).map(|(_, found)| found).collect();
        v.sort_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        v
    }
}
