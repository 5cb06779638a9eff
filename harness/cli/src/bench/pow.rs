//! What the law's power function costs beside the platform's.

use super::{cpu_seconds, Pair};
use law::elementary::pow;
use std::hint::black_box;

/// Exponents with a path of their own, which the target wants no slower than the platform's.
pub const COMMON: [f64; 4] = [1.0, 1.5, 2.0, 3.0];
/// Others.
pub const OTHERS: [f64; 5] = [0.5, 2.5, 1.1, 1.96, 2.79];
/// Calls a round and base.
const REPEATS: usize = 100;

/// 4096 bases, m: penetrations from 1e-6 to 1e-2.
fn bases() -> Vec<f64> {
    // xorshift (Marsaglia 2003)
    let mut state = 88172645463325252u64;
    (0..4096)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            10f64.powf(-6.0 + 4.0 * (state >> 11) as f64 / 9007199254740992.0)
        })
        .collect()
}

/// Nanoseconds of CPU time a call; every call waits for the one before (`chained`) or not.
fn cost(chained: bool, xs: &[f64], p: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let mut kept = 0.0;
    let start = cpu_seconds();
    for _ in 0..REPEATS {
        for &x in xs {
            // 0 times the last result changes nothing, but has to be known first
            let y = f(if chained { x + 0.0 * kept } else { x }, black_box(p));
            kept = if chained { y } else { kept + y };
        }
    }
    let ns = (cpu_seconds() - start) * 1e9 / (REPEATS * xs.len()) as f64;
    black_box(kept);
    ns
}

/// Ours beside the platform's, ns a call, `rounds` times in turn, for the power `p`; every call waits for the one
/// before (`chained`), as the stages of an integrator do, or not.
pub fn against_platform(p: f64, chained: bool, rounds: usize) -> Pair {
    let xs = bases();
    let mut pair = Pair::default();
    // the first round warms tables and branches
    for round in 0..=rounds {
        let both = (cost(chained, &xs, p, pow), cost(chained, &xs, p, f64::powf));
        if round > 0 {
            pair.rounds.push(both);
        }
    }
    pair
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_compute_the_same() {
        for p in COMMON.iter().chain(&OTHERS) {
            for x in bases() {
                let (a, b) = (pow(x, *p), x.powf(*p));
                assert!((a - b).abs() <= 4.0 * f64::EPSILON * b, "{x}^{p}: {a} and {b}");
            }
        }
        assert_eq!(against_platform(1.5, true, 2).rounds.len(), 2);
    }
}
