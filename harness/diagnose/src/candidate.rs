//! What the search asks of a fitted structure: what it costs, what it gains, and whether what it leaves is noise.

use super::evidence::ln_sum;
use super::table::Table;
use estimate::fitted::Fitted;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Gain in chi^2, beyond one parameter and over the overdispersion of the residual, from which a misfit counts as
/// detected. Held to under 1 % false alarms with the maximum over all candidates.
pub const DETECT: f64 = 45.0;
/// The same for a gain beyond a calibration's tolerance, where the prior sets the scale and nothing else inflates it.
pub const DETECT_TOLERANCE: f64 = 11.0;
/// Penalty of one more parameter, in chi^2.
pub const PENALTY: f64 = 4.0;
/// Overdispersion up to which a residual counts as noise.
pub const WHITE: f64 = 1.25;
/// The same where one more effect could hide in what lies between.
pub const WHITE_ALONE: f64 = 1.05;

/// Share of what the base leaves beyond noise up to which what a candidate leaves is a form that is not quite the one
/// present.
const LEFT: f64 = 0.05;

/// Standard deviation of ln of the repeat scatter that rigs have, about the one assumed: a factor of two either way.
const SCATTER_SPREAD: f64 = std::f64::consts::LN_2;
/// Largest scatter, over the one assumed, of a stiffness that something moves between recordings.
const MOVED_AT_MOST: f64 = 100.0;
/// Steps by which both are integrated over, of ln scatter.
const SCATTER_STEP: f64 = 0.05;
/// Share of the mean square of that scatter which may stay where what the recordings differ by has been found.
const EXCESS_SCATTER_LEFT: f64 = 0.2;

/// Gain from which a candidate stands beside one that gains `top` and explains what there is: `share` of that, and in any
/// case what lies less than [`DETECT`] behind it.
pub fn least_beside(top: f64, share: f64) -> f64 {
    (share * top).min(top - DETECT)
}

/// Probability that something moved the stiffness between recordings of one level, rather than that they scatter as a rig's
/// repeats do: of the sum of squares over the square of the scatter assumed, with its degrees of freedom. The scatter of
/// repeats is lognormal about the one assumed; one that something moves lies anywhere from there to [`MOVED_AT_MOST`], ln of it
/// even. `prior`: ln prior odds of the latter.
fn moved_between(sum: f64, freedom: f64, prior: f64) -> f64 {
    let ln_likelihood = |u: f64| -freedom * u - 0.5 * sum * (-2.0 * u).exp();
    let width = MOVED_AT_MOST.ln();
    let mut ln = [Vec::new(), Vec::new()];
    let steps = (2.0 * width / SCATTER_STEP) as i32;
    for u in (-steps / 2..=steps / 2).map(|i| f64::from(i) * SCATTER_STEP) {
        ln[0].push(ln_likelihood(u) - 0.5 * (u / SCATTER_SPREAD).powi(2) - (SCATTER_SPREAD * TAU.sqrt()).ln());
        if u >= 0.0 {
            ln[1].push(ln_likelihood(u) - width.ln());
        }
    }
    let odds = prior + ln_sum(&ln[1]) - ln_sum(&ln[0]);
    1.0 / (1.0 + (-odds).exp())
}

/// A fitted structure, weighed against others.
pub trait Candidate {
    /// Whether its last effect is a calibration beyond its tolerance.
    fn calibrates(&self) -> bool;
    /// chi^2 with its penalty.
    fn cost(&self) -> f64;
    /// Fall of chi^2 from `from`, less the penalty of every parameter beyond one.
    fn gain(&self, from: &Fitted) -> f64;
    /// Whether it explains what `from` leaves: what is left is noise, or so little beside that that its form is not quite
    /// the one present.
    fn explains(&self, from: &Fitted) -> bool;
    /// Root mean square by which ln stiffness differs between recordings of one level, where it is more likely than not that
    /// something between the recordings changed it than that repeats scatter so.
    fn excess_scatter(&self) -> Option<f64>;
    /// The excess scatter where it is still a good share of what it was in another fit (`from`): a course with order that
    /// is not quite the one found leaves a little.
    fn excess_scatter_left(&self, from: Option<f64>) -> Option<f64>;
}

impl Candidate for Fitted {
    fn calibrates(&self) -> bool {
        self.structure.last().is_some_and(|t| t.mechanism.hints.is_calibration && t.form.parameters.len() == 1)
    }

    fn cost(&self) -> f64 {
        self.chi2() + PENALTY * self.parameters()
    }

    fn gain(&self, from: &Fitted) -> f64 {
        let more = (self.parameters() - from.parameters() - 1.0).max(0.0);
        from.fit.point.chi2 - self.fit.point.chi2 - more * PENALTY
    }

    fn explains(&self, from: &Fitted) -> bool {
        let left = self.overdispersion();
        left <= WHITE || left - 1.0 <= LEFT * (from.overdispersion() - 1.0)
    }

    fn excess_scatter(&self) -> Option<f64> {
        let problem = self.problem();
        let each = self.data.records.iter().zip(&self.fit.point.locals);
        let each = each.map(|(r, l)| (r.level, problem.local(l).stiffness));
        excess_scatter(each, self.data.repeat_scatter, self.overdispersion().max(1.0))
    }

    fn excess_scatter_left(&self, from: Option<f64>) -> Option<f64> {
        self.excess_scatter().filter(|s| from.is_none_or(|f| s * s > EXCESS_SCATTER_LEFT * f * f))
    }
}

/// Root mean square by which a logarithm differs between recordings of one level, of pairs (level, logarithm), where it is more likely
/// than not that something between the recordings changed it than that repeats scatter so; `scatter`: standard deviation of repeats,
/// whose variance slow noise makes up to `slow` times as large.
pub fn excess_scatter(of: impl Iterator<Item = (usize, f64)>, scatter: f64, slow: f64) -> Option<f64> {
    let mut levels: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    of.for_each(|(level, v)| levels.entry(level).or_default().push(v));
    let (sum, freedom) = levels.values().filter(|l| l.len() > 1).fold((0.0, 0.0), |(sum, freedom), l| {
        let mean = l.iter().sum::<f64>() / l.len() as f64;
        (sum + l.iter().map(|s| (s - mean).powi(2)).sum::<f64>(), freedom + l.len() as f64 - 1.0)
    });
    let prior = Table::calibrated().unknown;
    let moved = |sum: f64| moved_between(sum / scatter.powi(2), freedom, prior);
    // slow noise moves what each recording is fitted to, too
    let beyond = freedom > 0.0 && moved(sum) > 0.5 && moved(sum / slow) > 0.5;
    beyond.then(|| (sum / freedom).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scatter_within_what_the_law_is_off_by_is_none_of_the_contact() {
        let each = || [(0, 0.0), (0, 0.08), (1, 0.02), (1, -0.05), (2, 0.3)].into_iter();
        let found = excess_scatter(each(), 0.006, 1.0).unwrap();
        assert!((found - 0.0532).abs() < 1e-3, "{found}");
        assert!(excess_scatter(each(), 0.006f64.hypot(0.05), 1.0).is_none());
        assert!(excess_scatter(each(), 0.006, 100.0).is_none());
        // one recording a level has no repeats
        assert!(excess_scatter([(0, 0.0), (1, 9.0)].into_iter(), 0.006, 1.0).is_none());
    }

    #[test]
    fn repeats_may_scatter_threefold_and_tenfold_is_something_that_moved() {
        let p = |times: f64, freedom: f64| moved_between(times * times * freedom, freedom, Table::calibrated().unknown);
        for freedom in [1.0, 3.0, 5.0, 10.0] {
            assert!(
                p(1.0, freedom) < 0.25 && p(3.0, freedom) < 0.5,
                "{freedom}: {} {}",
                p(1.0, freedom),
                p(3.0, freedom)
            );
        }
        for freedom in [3.0, 5.0, 10.0] {
            assert!(p(10.0, freedom) > 0.9, "{freedom}: {}", p(10.0, freedom));
        }
        // more repeats hold more information
        assert!(p(6.0, 10.0) > p(6.0, 2.0));
    }
}
