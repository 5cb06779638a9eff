//! The false-alarm probability, calibrated on the campaign itself: nulls are made of the residual that the chosen
//! model leaves, block by block with random signs (wild bootstrap: Liu 1988; in blocks, Shao 2010), and each is given
//! to every candidate at once. Overdispersion of these recordings is in the nulls, too.
//!
//! The candidates are taken linear here, which makes a thousand nulls cost less than one fit; `bootstrap` simulates and
//! judges whole campaigns instead.

use super::search::Search;
use estimate::fitted::Fitted;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::function::erf::erfc;

/// Nulls drawn.
const NULLS: usize = 999;
/// Least probability reported: a tail says nothing beyond it.
const LEAST: f64 = 1e-16;
/// Samples that keep one sign.
const BLOCK: usize = 48;

/// How often noise alone would look as bad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alarm {
    /// Nulls drawn, and those whose best candidate gained as much as the campaign's.
    pub nulls: usize,
    pub as_bad: usize,
    /// Candidates' directions, and the number of independent ones that would give maxima as large.
    pub directions: usize,
    pub independent: f64,
    /// Gain of the campaign's best candidate, in chi^2.
    pub gain: f64,
    /// (1 + as bad) / (1 + nulls); where no null looked as bad, the tail fitted to them, at most that.
    pub probability: f64,
}

/// The alarm of a campaign whose best candidate gained `gain` in chi^2 over `base`; nulls are made of what `chosen`
/// leaves over. None where nothing can be linearised.
pub fn alarm(search: &Search, base: &Fitted, chosen: &Fitted, gain: f64) -> Option<Alarm> {
    let problem = base.problem();
    let linear = problem.linearise(&base.fit.point)?;
    let left = chosen.residuals()?;
    let context = &base.structure.base().context;
    // of each direction: the share of every block in its score of the left-over residual, over its length
    let parts: Vec<Vec<f64>> = search
        .candidates()
        .par_iter()
        .flat_map_iter(|t| t.form.starts.iter().map(move |s| (t, s)))
        .filter_map(|(t, start)| {
            let s = problem.signature(&linear, &base.fit.point, &|p| t.form.apply(start, context, p), 1.0)?;
            let whole: f64 = s.iter().flatten().map(|v| v * v).sum();
            let s = linear.project(&s);
            let length: f64 = s.iter().flatten().map(|v| v * v).sum();
            if length.is_nan() || length <= 1e-8 * whole {
                return None;
            }
            let blocks = s.iter().zip(&left).flat_map(|(s, (_, left))| {
                s.chunks(BLOCK).zip(left.chunks(BLOCK)).map(|(s, r)| s.iter().zip(r).map(|(s, r)| s * r).sum::<f64>())
            });
            Some(blocks.map(|d| d / length.sqrt()).collect())
        })
        .collect();
    Some(judged(&parts, gain))
}

/// Draws the nulls of `parts` (directions by blocks) and sets `gain` against them.
fn judged(parts: &[Vec<f64>], gain: f64) -> Alarm {
    let blocks = parts.first().map_or(0, Vec::len);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut tops: Vec<f64> = Vec::with_capacity(NULLS);
    for _ in 0..NULLS {
        let signs: Vec<f64> = (0..blocks).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect();
        let score = |d: &Vec<f64>| d.iter().zip(&signs).map(|(d, e)| d * e).sum::<f64>().powi(2);
        tops.push(parts.iter().map(score).fold(0.0, f64::max));
    }
    tops.sort_by(f64::total_cmp);
    let as_bad = tops.iter().filter(|t| **t >= gain).count();
    // scores are normal with the variance of their blocks; the median of the maxima says how many count
    let n = parts.len().max(1) as f64;
    let scale = (parts.iter().flatten().map(|d| d * d).sum::<f64>() / n).max(1.0);
    let beyond = |g: f64| erfc((g.max(0.0) / (2.0 * scale)).sqrt());
    let one = beyond(tops[NULLS / 2]).clamp(1e-12, 1.0 - 1e-12);
    let independent = ((0.5f64).ln() / (-one).ln_1p()).clamp(1.0, n);
    let empirical = (1 + as_bad) as f64 / (1 + NULLS) as f64;
    let probability = if as_bad > 0 { empirical } else { (independent * beyond(gain)).clamp(LEAST, empirical) };
    Alarm { nulls: NULLS, as_bad, directions: parts.len(), independent, gain, probability }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions that each look at blocks of their own, of unit length.
    fn parts(directions: usize, size: f64) -> Vec<Vec<f64>> {
        let per = 24;
        (0..directions)
            .map(|j| {
                let own = |b: usize| if b / per == j { size / (per as f64).sqrt() } else { 0.0 };
                (0..directions * per).map(own).collect()
            })
            .collect()
    }

    #[test]
    fn white_noise_gives_the_tail_of_as_many_chi_squares() {
        let a = judged(&parts(20, 1.0), 9.0);
        // 1 - (1 - P(chi2_1 > 9))^20 = 0.0526
        assert!((a.probability - 0.0526).abs() < 0.02, "{a:?}");
        assert!((10.0..=20.0).contains(&a.independent), "{a:?}");
        let far = judged(&parts(20, 1.0), 60.0);
        assert!(far.as_bad == 0 && far.probability < 1e-12, "{far:?}");
        assert_eq!(judged(&parts(20, 1.0), 0.0).probability, 1.0);
    }

    #[test]
    fn overdispersed_noise_makes_the_same_gain_ordinary() {
        let a = judged(&parts(20, 3.0), 20.0);
        assert!(a.probability > 0.2, "{a:?}");
    }
}
