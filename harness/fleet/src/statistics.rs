//! Tests that suppose nothing but that campaigns could have come in any order, and their false discoveries held.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Permutations that look as strong, at which a test ends; and permutations at most (Besag and Clifford 1991).
const ENOUGH: usize = 20;
const MOST: usize = 99_999;
/// Statistics closer than this share are equal: sums in another order.
const EQUAL: f64 = 1e-12;
/// Pairs of points that a slope is the median of, at most.
const PAIRS: usize = 500_000;

/// Ranks from 1 on; values that are equal share the mean of theirs.
pub fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut i = 0;
    while i < order.len() {
        let mut j = i + 1;
        while j < order.len() && values[order[j]] == values[order[i]] {
            j += 1;
        }
        // ranks i+1 to j
        let shared = (i + 1 + j) as f64 / 2.0;
        order[i..j].iter().for_each(|k| ranks[*k] = shared);
        i = j;
    }
    ranks
}

/// Rank correlation of Spearman 1904, -1 to 1; 0 where one of both is constant.
pub fn spearman(x: &[f64], y: &[f64]) -> f64 {
    correlation(&centred(ranks(x)), &centred(ranks(y)))
}

fn centred(mut v: Vec<f64>) -> Vec<f64> {
    let mean = v.iter().sum::<f64>() / v.len().max(1) as f64;
    v.iter_mut().for_each(|x| *x -= mean);
    v
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (dot(x, x) * dot(y, y)).sqrt();
    if size > 0.0 {
        dot(x, y) / size
    } else {
        0.0
    }
}

/// Probability that `y` follows `x` up or down as closely by chance: Spearman's correlation under permutations of `y`.
pub fn follows(x: &[f64], y: &[f64], seed: u64) -> f64 {
    let (x, y) = (centred(ranks(x)), centred(ranks(y)));
    permuted(y, seed, |y| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>().abs())
}

/// Probability that `y` differs as much between groups by chance: the statistic of Kruskal and Wallis 1952 under
/// permutations. `group`: of each value its group, from 0 on.
pub fn differs(group: &[usize], y: &[f64], seed: u64) -> f64 {
    let groups = group.iter().max().map_or(0, |g| g + 1);
    let mut sizes = vec![0.0; groups];
    group.iter().for_each(|g| sizes[*g] += 1.0);
    let mut sums = vec![0.0; groups];
    permuted(centred(ranks(y)), seed, move |y| {
        sums.iter_mut().for_each(|s| *s = 0.0);
        group.iter().zip(y).for_each(|(g, v)| sums[*g] += v);
        sums.iter().zip(&sizes).filter(|(_, n)| **n > 0.0).map(|(s, n)| s * s / n).sum()
    })
}

/// Share of the permutations of `y` whose `statistic` is as large as that of `y`. Ends early where it is known not to be
/// small (Besag and Clifford 1991), so that it is a p-value at every length; 1e-5 at least.
fn permuted(mut y: Vec<f64>, seed: u64, mut statistic: impl FnMut(&[f64]) -> f64) -> f64 {
    let least = statistic(&y) * (1.0 - EQUAL);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut as_strong = 0;
    for drawn in 1..=MOST {
        // Durstenfeld 1964
        for i in (1..y.len()).rev() {
            y.swap(i, rng.random_range(0..=i));
        }
        as_strong += usize::from(statistic(&y) >= least);
        if as_strong == ENOUGH {
            return ENOUGH as f64 / drawn as f64;
        }
    }
    (1 + as_strong) as f64 / (1 + MOST) as f64
}

/// Median slope between all pairs of points (Theil 1950, Sen 1968); of many points between pairs at even steps. None where all
/// x are equal.
pub fn slope(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len();
    let step = (n * n.saturating_sub(1) / 2).div_ceil(PAIRS).max(1);
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).step_by(step);
    let mut all: Vec<f64> = pairs.filter(|(i, j)| x[*i] != x[*j]).map(|(i, j)| (y[j] - y[i]) / (x[j] - x[i])).collect();
    all.sort_by(f64::total_cmp);
    let middle = all.len() / 2;
    match all.len() {
        0 => None,
        n if n % 2 == 1 => Some(all[middle]),
        _ => Some(0.5 * (all[middle - 1] + all[middle])),
    }
}

/// The q-value of every p-value: the least false discovery rate at which it counts as a discovery (Benjamini and Hochberg
/// 1995). Where those with q up to 0.05 are called discoveries, 5 % of them are false in the mean.
pub fn discoveries(p: &[f64]) -> Vec<f64> {
    let n = p.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let (mut q, mut least) = (vec![1.0; n], 1.0f64);
    for (i, k) in order.into_iter().enumerate() {
        least = least.min(p[k] * (n as f64 / (n - i) as f64));
        q[k] = least;
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [3.5, 1.0, 3.5, 2.0]);
        assert!(ranks(&[]).is_empty());
    }

    #[test]
    fn a_correlation_is_that_of_the_ranks() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(spearman(&x, &[1.0, 4.0, 9.0, 16.0, 25.0]), 1.0);
        assert_eq!(spearman(&x, &[5.0, 4.0, 3.0, 2.0, 1.0]), -1.0);
        // 1 - 6 sum d^2 / (n (n^2 - 1)), d = 1, 1, 0, 1, 1
        assert!((spearman(&x, &[2.0, 1.0, 3.0, 5.0, 4.0]) - 0.8).abs() < 1e-12);
        assert_eq!(spearman(&x, &[7.0; 5]), 0.0);
    }

    #[test]
    fn the_probabilities_are_those_of_all_permutations() {
        // of the 120 orders of five values two are as steep as the steepest, and six as (1, 2, 3, 5, 4) or steeper upwards:
        // rho >= 0.9 for the identity and its four neighbours, and as many downwards
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        let steepest = follows(&x, &x, 1);
        assert!((steepest - 2.0 / 120.0).abs() < 0.006, "{steepest}");
        let next = follows(&x, &[1.0, 2.0, 3.0, 5.0, 4.0], 2);
        assert!((next - 10.0 / 120.0).abs() < 0.04, "{next}");
        // two groups of three: of 20 ways to part six values two are as far apart
        let apart = differs(&[0, 0, 0, 1, 1, 1], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 3);
        assert!((apart - 0.1).abs() < 0.05, "{apart}");
        assert_eq!(follows(&x, &[2.0; 5], 4), 1.0);
    }

    #[test]
    fn a_strong_trend_is_told_to_the_last_permutation() {
        let x: Vec<f64> = (0..40).map(f64::from).collect();
        assert_eq!(follows(&x, &x, 5), 1e-5);
        assert_eq!(slope(&x, &x.iter().map(|v| 3.0 - 0.5 * v).collect::<Vec<_>>()), Some(-0.5));
        assert_eq!(slope(&[1.0, 1.0], &[1.0, 2.0]), None);
    }

    #[test]
    fn by_chance_a_p_value_is_below_any_level_no_more_often_than_that() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let x: Vec<f64> = (0..15).map(f64::from).collect();
        let p: Vec<f64> = (0..2000)
            .map(|i| follows(&x, &(0..15).map(|_| rng.random_range(0..4) as f64).collect::<Vec<_>>(), i))
            .collect();
        for level in [0.01, 0.05, 0.2] {
            let share = p.iter().filter(|p| **p <= level).count() as f64 / p.len() as f64;
            let allowed = level + 3.0 * (level * (1.0 - level) / p.len() as f64).sqrt();
            assert!(share <= allowed, "{share} at {level}");
        }
    }

    /// The example of Benjamini and Hochberg 1995, section 4: of 15 comparisons four are discoveries at 0.05.
    #[test]
    fn discoveries_are_those_of_the_paper() {
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0,
        ];
        let q = discoveries(&p);
        assert_eq!(q.iter().filter(|q| **q <= 0.05).count(), 4);
        assert!((q[3] - 0.0095 * 15.0 / 4.0).abs() < 1e-12 && q[14] == 1.0);
        assert!(discoveries(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn q_is_no_less_than_p_and_in_its_order(p in prop::collection::vec(0.0..1.0f64, 0..40)) {
            let q = discoveries(&p);
            for i in 0..p.len() {
                prop_assert!(q[i] >= p[i] && q[i] <= 1.0);
                for j in 0..p.len() {
                    prop_assert!(p[i] > p[j] || q[i] <= q[j]);
                }
            }
        }

        #[test]
        fn ranks_add_up_to_those_without_ties(v in prop::collection::vec(-3i32..3, 0..40)) {
            let v: Vec<f64> = v.into_iter().map(f64::from).collect();
            let n = v.len() as f64;
            prop_assert!((ranks(&v).iter().sum::<f64>() - n * (n + 1.0) / 2.0).abs() < 1e-9);
        }
    }
}
