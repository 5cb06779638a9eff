//! Least squares of two terms: f = a A + b B.

/// Sums over rows (A, B, f).
#[derive(Clone, Copy, Debug, Default)]
pub struct TwoTerms {
    aa: f64,
    ab: f64,
    bb: f64,
    af: f64,
    bf: f64,
    ff: f64,
}

impl FromIterator<(f64, f64, f64)> for TwoTerms {
    fn from_iter<I: IntoIterator<Item = (f64, f64, f64)>>(rows: I) -> TwoTerms {
        let mut s = TwoTerms::default();
        for (a, b, f) in rows {
            s.aa += a * a;
            s.ab += a * b;
            s.bb += b * b;
            s.af += a * f;
            s.bf += b * f;
            s.ff += f * f;
        }
        s
    }
}

impl TwoTerms {
    /// (a, b) of both terms; None where they are alike: less than the share `least` of the squares' product is left of their
    /// determinant.
    pub fn both(&self, least: f64) -> Option<(f64, f64)> {
        let det = self.aa * self.bb - self.ab * self.ab;
        let solved = || ((self.bb * self.af - self.ab * self.bf) / det, (self.aa * self.bf - self.ab * self.af) / det);
        (det > least * self.aa * self.bb).then(solved)
    }

    /// (a, 0) of the first term alone; not a number where it is zero throughout.
    pub fn first(&self) -> (f64, f64) {
        (self.af / self.aa, 0.0)
    }

    /// Sum of f squared.
    pub fn square(&self) -> f64 {
        self.ff
    }

    /// Sum of squares that `of` leaves, one of [`TwoTerms::both`], [`TwoTerms::first`] and (0, 0).
    pub fn rest(&self, of: (f64, f64)) -> f64 {
        self.ff - of.0 * self.af - of.1 * self.bf
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_terms_are_found_again_and_what_they_leave_is_what_was_added() {
        let rows = |noise: f64| -> TwoTerms {
            let of = |i: i32| {
                let (a, b) = (f64::from(i), f64::from(i * i % 7));
                (a, b, 2.0 * a - 0.5 * b + noise * if i % 2 == 0 { 1.0 } else { -1.0 })
            };
            (1..40).map(of).collect()
        };
        let exact = rows(0.0);
        let (a, b) = exact.both(1e-9).unwrap();
        assert!((a - 2.0).abs() < 1e-12 && (b + 0.5).abs() < 1e-12, "{a} {b}");
        assert!(exact.rest((a, b)).abs() < 1e-9 * exact.square());
        let noisy = rows(0.1);
        let rest = noisy.rest(noisy.both(1e-9).unwrap());
        assert!(rest > 0.3 && rest < 0.39 + 1e-9, "{rest}");
        assert!(noisy.rest(noisy.first()) > rest && noisy.rest((0.0, 0.0)) == noisy.square());
        let alike: TwoTerms = (1..9).map(|i| (f64::from(i), 3.0 * f64::from(i), 1.0)).collect();
        assert_eq!(alike.both(1e-9), None);
    }
}
