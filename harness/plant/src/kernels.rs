//! The few loops over samples in which a fit spends its time, compiled for the processor they run on. Nothing is fused
//! or reordered between versions: every processor gives the same bits.

use multiversion::multiversion;
use std::ops::Range;

/// Partial sums of a scalar product, and of four at once.
const SUMS: usize = 16;
const SUMS_OF_FOUR: usize = 8;
/// Samples whitened at once.
const LANES: usize = 8;

/// Scalar product of the shorter length.
#[multiversion(targets("x86_64+avx2"))]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, a_rest) = a[..n].as_chunks::<SUMS>();
    let (b, b_rest) = b[..n].as_chunks::<SUMS>();
    let mut s = [0.0; SUMS];
    for (a, b) in a.iter().zip(b) {
        for i in 0..SUMS {
            s[i] += a[i] * b[i];
        }
    }
    let mut t = pairwise(&s);
    for (a, b) in a_rest.iter().zip(b_rest) {
        t += a * b;
    }
    t
}

/// Scalar products with four columns at once, each at least as long as `a`: one alone waits for memory.
#[multiversion(targets("x86_64+avx2"))]
pub fn dots(a: &[f64], columns: [&[f64]; 4]) -> [f64; 4] {
    let columns = columns.map(|b| &b[..a.len()]);
    let (whole, rest) = a.as_chunks::<SUMS_OF_FOUR>();
    let mut s = [[0.0; SUMS_OF_FOUR]; 4];
    for (k, a) in whole.iter().enumerate() {
        for (s, b) in s.iter_mut().zip(&columns) {
            let b = &b[SUMS_OF_FOUR * k..SUMS_OF_FOUR * (k + 1)];
            for i in 0..SUMS_OF_FOUR {
                s[i] += a[i] * b[i];
            }
        }
    }
    let mut t = s.map(|s| pairwise(&s));
    for (k, a) in rest.iter().enumerate() {
        for (t, b) in t.iter_mut().zip(&columns) {
            *t += a * b[SUMS_OF_FOUR * whole.len() + k];
        }
    }
    t
}

/// The samples from the first to the last of a column that are not 0; empty where all are.
fn support(column: &[f64]) -> Range<usize> {
    let first = column.iter().position(|v| *v != 0.0).unwrap_or(column.len());
    let end = column.iter().rposition(|v| *v != 0.0).map_or(first, |last| last + 1);
    first..end
}

/// Calls `put` with i, j and the scalar product of the columns i and j, for every i and j <= i with i from `from` on. A column that is 0
/// outside of a contact costs what the contact costs. All columns have one length.
pub fn products(columns: &[Vec<f64>], from: usize, mut put: impl FnMut(usize, usize, f64)) {
    let supports: Vec<Range<usize>> = columns.iter().map(|c| support(c)).collect();
    for i in from..columns.len() {
        for first in (0..=i).step_by(4) {
            let few = first..(first + 4).min(i + 1);
            let begin = supports[few.clone()].iter().map(|s| s.start).min().unwrap_or(0).max(supports[i].start);
            let end = supports[few.clone()].iter().map(|s| s.end).max().unwrap_or(0).min(supports[i].end);
            let within = |j: usize| columns[j].get(begin..end).unwrap_or_default();
            if few.len() == 4 {
                let four = dots(within(i), [first, first + 1, first + 2, first + 3].map(within));
                few.zip(four).for_each(|(j, v)| put(i, j, v));
            } else {
                few.for_each(|j| put(i, j, dot(within(i), within(j))));
            }
        }
    }
}

/// Sum of a power of two of terms, halves added.
#[inline(always)]
fn pairwise<const N: usize>(s: &[f64; N]) -> f64 {
    let mut s = *s;
    let mut n = N;
    while n > 1 {
        n /= 2;
        for i in 0..n {
            s[i] += s[i + n];
        }
    }
    s[0]
}

/// to += factor from, over the shorter length.
#[multiversion(targets("x86_64+avx2"))]
pub fn add_scaled(to: &mut [f64], factor: f64, from: &[f64]) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += factor * f;
    }
}

/// What `coefficients` do not foretell of the samples `e` from those before them, times `scale`, into `out`, from as
/// many samples on as there are coefficients: the first of them that of the sample just before.
#[multiversion(targets("x86_64+avx2"))]
pub fn innovations(e: &[f64], coefficients: &[f64], scale: f64, out: &mut [f64]) {
    let n = e.len().min(out.len());
    let mut i = coefficients.len();
    // several samples at once, so that the sums do not wait for each other
    while i + LANES <= n {
        let mut v = [0.0; LANES];
        v.copy_from_slice(&e[i..i + LANES]);
        for (k, a) in coefficients.iter().enumerate() {
            let before = &e[i - 1 - k..i - 1 - k + LANES];
            for j in 0..LANES {
                v[j] -= a * before[j];
            }
        }
        for j in 0..LANES {
            out[i + j] = v[j] * scale;
        }
        i += LANES;
    }
    while i < n {
        let mut v = e[i];
        for (k, a) in coefficients.iter().enumerate() {
            v -= a * e[i - 1 - k];
        }
        out[i] = v * scale;
        i += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, w: f64) -> Vec<f64> {
        (0..n).map(|i| (i as f64 * w).sin()).collect()
    }

    #[test]
    fn products_are_those_of_the_plain_sum() {
        for n in [0, 1, 7, 8, 15, 16, 17, 53, 700] {
            let columns = [wave(n, 0.1), wave(n, 0.2), wave(n, 0.3), wave(n, 0.4)];
            let a = wave(n, 0.7);
            let plain = |b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for (product, b) in dots(&a, columns.each_ref().map(|c| &c[..])).iter().zip(&columns) {
                assert!((product - plain(b)).abs() < 1e-12, "{n}");
                assert!((dot(&a, b) - plain(b)).abs() < 1e-12, "{n}");
            }
        }
    }

    #[test]
    fn products_of_all_pairs_are_those_of_the_plain_sum_wherever_the_columns_are_zero() {
        let n = 90;
        let part = |from: usize, to: usize, w: f64| {
            let mut v = wave(n, w);
            (0..n).filter(|i| !(from..to).contains(i)).for_each(|i| v[i] = 0.0);
            v
        };
        let mut columns: Vec<Vec<f64>> = (0..9).map(|k| part(7 * k, 90 - 3 * k, 0.1 + 0.05 * k as f64)).collect();
        columns.extend([vec![0.0; n], part(0, 5, 0.3), part(80, 90, 0.3), part(0, 90, 0.2)]);
        for from in [0, 3] {
            let mut seen = 0;
            products(&columns, from, |i, j, v| {
                let plain: f64 = columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
                assert!((v - plain).abs() < 1e-12, "{i} {j}: {v} {plain}");
                seen += 1;
            });
            assert_eq!(seen, (from..columns.len()).map(|i| i + 1).sum::<usize>());
        }
    }

    #[test]
    fn innovations_are_what_the_coefficients_leave() {
        // a sine is foretold by its two last samples, exactly
        let (w, n) = (0.3, 41);
        let e = wave(n, w);
        let mut out = vec![7.0; n];
        innovations(&e, &[2.0 * w.cos(), -1.0], 2.0, &mut out);
        assert_eq!(out[..2], [7.0; 2]);
        assert!(out[2..].iter().all(|v| v.abs() < 1e-13), "{out:?}");
        innovations(&e, &[], 2.0, &mut out);
        assert!(out.iter().zip(&e).all(|(o, e)| *o == 2.0 * e));
    }
}
