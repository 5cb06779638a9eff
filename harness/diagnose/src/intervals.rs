//! 95 % intervals of a mechanism's parameters: by profile likelihood where cheap, else from the covariance.

use estimate::fitted::Fitted;
use estimate::problem::{Options, Point, Problem};
use rayon::prelude::*;

/// An interval of one described parameter, SI; NaN to NaN where the recordings do not determine it.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
    pub low: f64,
    pub high: f64,
    /// Whether it is a constant of the form, that no parameter fitted moves.
    pub held: bool,
}

impl Interval {
    /// Its ends, where it was estimated and the recordings determine them.
    pub fn ends(&self) -> Option<[f64; 2]> {
        (!self.held && self.low.is_finite() && self.high.is_finite()).then_some([self.low, self.high])
    }
}

/// The intervals of one term.
#[derive(Clone, Debug, Default)]
pub struct Intervals {
    pub of: Vec<Interval>,
    /// True: profile likelihood (Venzon and Moolgavkar 1988); false: covariance of the linearised fit.
    pub profiled: bool,
}

/// Rise of chi^2 at the ends of a 95 % interval of one parameter.
const RISE: f64 = 3.841;
/// Samples times parameters up to which profiles are cheap: some seconds on one core.
const CHEAP: usize = 1_200_000;
/// Trials per end of an interval.
const TRIALS: usize = 4;

/// Intervals of every term of `chosen`; `overdispersion` inflates the noise's variance where the residual is not white.
pub fn intervals(chosen: &Fitted, overdispersion: f64) -> Vec<Intervals> {
    let problem = chosen.problem();
    let model = chosen.structure.model();
    let context = &chosen.structure.base().context;
    let point = &chosen.fit.point;
    let first = chosen.structure.first_term();
    let count = model.parameters.len() - first;
    let overdispersion = overdispersion.max(1.0);
    let sd: Vec<f64> = match problem.covariance(point) {
        Some(c) => (first..first + count).map(|j| (c[(j, j)].max(0.0) * overdispersion).sqrt()).collect(),
        None => vec![f64::NAN; count],
    };
    let cheap = chosen.data.samples() * model.parameters.len() * count <= CHEAP;
    // ends of every parameter's interval, as whole vectors: the others follow
    let ends: Vec<[Option<Vec<f64>>; 2]> = if cheap {
        (0..count)
            .into_par_iter()
            .map(|k| {
                let end = |side: f64| profile_end(chosen, first + k, side, sd[k], RISE * overdispersion);
                [end(-1.0), end(1.0)]
            })
            .collect()
    } else {
        Vec::new()
    };
    let profiled = cheap && ends.iter().flatten().all(Option::is_some);
    let mut at = first;
    chosen
        .structure
        .terms()
        .iter()
        .map(|t| {
            let n = t.form.parameters.len();
            let values = &point.theta[at..at + n];
            let said = t.form.describe(values, context);
            let held = t.form.held(values, context);
            let mut of: Vec<Interval> = said
                .iter()
                .zip(held)
                .map(|((name, value, unit), held)| Interval {
                    name,
                    value: *value,
                    unit,
                    low: *value,
                    high: *value,
                    held,
                })
                .collect();
            if profiled {
                for theta in ends.iter().flatten().flatten() {
                    for (o, d) in of.iter_mut().zip(t.form.describe(&theta[at..at + n], context)) {
                        o.low = o.low.min(d.1);
                        o.high = o.high.max(d.1);
                    }
                }
            } else {
                let mut var = vec![0.0; of.len()];
                for j in 0..n {
                    let mut v = values.to_vec();
                    v[j] += sd[at - first + j];
                    for (s, (q, d)) in var.iter_mut().zip(t.form.describe(&v, context).iter().zip(&said)) {
                        *s += (q.1 - d.1).powi(2);
                    }
                }
                for (o, s) in of.iter_mut().zip(var) {
                    o.low -= 1.96 * s.sqrt();
                    o.high += 1.96 * s.sqrt();
                }
            }
            at += n;
            Intervals { of, profiled }
        })
        .collect()
}

/// The parameters where the profile of parameter `j` has risen by `rise` on one side, or at its bound.
fn profile_end(chosen: &Fitted, j: usize, side: f64, sd: f64, rise: f64) -> Option<Vec<f64>> {
    if !(sd.is_finite() && sd > 0.0) {
        return None;
    }
    let best = &chosen.fit.point;
    let (mut value, centre) = (best.theta[j] + side * 1.96 * sd, best.theta[j]);
    let mut from: Point = best.clone();
    for trial in 0..TRIALS {
        let mut model = chosen.structure.model().clone();
        let p = &mut model.parameters[j];
        value = value.clamp(p.lower, p.upper);
        let at_bound = value == p.lower || value == p.upper;
        // a parameter between equal bounds is held
        (p.lower, p.upper) = (value, value);
        let problem = Problem::new(&chosen.data, &model);
        let mut theta = from.theta.clone();
        theta[j] = value;
        let start = problem.evaluate(theta, from.locals.clone());
        if !start.chi2.is_finite() {
            return None;
        }
        let f = problem.fit(start, &Options { iterations: 8, tolerance: 1e-6, ..Options::default() });
        let risen = (f.point.chi2 - best.chi2).max(0.0);
        let done = (risen / rise - 1.0).abs() < 0.12 || (at_bound && risen <= rise);
        from = f.point;
        if done {
            return Some(from.theta);
        }
        if trial + 1 < TRIALS {
            // chi^2 rises by the square of the distance, nearly
            value = centre + (value - centre) * (rise / risen.max(0.04 * rise)).sqrt().clamp(0.3, 4.0);
        }
    }
    Some(from.theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_those_of_what_was_estimated_and_can_be_determined() {
        let i = Interval { name: "friction", value: 2.0, unit: "N", low: 1.5, high: 2.5, held: false };
        assert_eq!(i.ends(), Some([1.5, 2.5]));
        assert_eq!(Interval { low: f64::NAN, high: f64::NAN, ..i.clone() }.ends(), None);
        assert_eq!(Interval { held: true, ..i }.ends(), None);
    }
}
