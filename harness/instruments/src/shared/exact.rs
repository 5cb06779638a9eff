//! Decimal numbers with all their digits: a double holds 15 to 17 of them, a time since 1970 in ns has 19.

use super::cell::Decimal;

/// Digits, at most.
const MOST: usize = 30;
/// Significant digits that every double holds.
const OF_A_DOUBLE: usize = 15;

/// A number: `digits` over ten to the power of `decimals`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exact {
    digits: i128,
    decimals: u32,
    /// Digits written.
    count: usize,
}

impl Exact {
    /// The number in a cell without blanks; None where it has an exponent or groups of thousands.
    pub fn of(cell: &[u8], decimal: Decimal) -> Option<Exact> {
        let separator = if decimal == Decimal::Comma { b',' } else { b'.' };
        let (negative, rest) = match cell {
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            rest => (false, rest),
        };
        let (mut digits, mut decimals, mut count, mut fraction) = (0i128, 0u32, 0, false);
        for b in rest {
            match b {
                b'0'..=b'9' if count < MOST => {
                    digits = 10 * digits + i128::from(b - b'0');
                    count += 1;
                    decimals += u32::from(fraction);
                }
                _ if *b == separator && !fraction => fraction = true,
                _ => return None,
            }
        }
        (count > 0).then_some(Exact { digits: if negative { -digits } else { digits }, decimals, count })
    }

    /// Whether it has more digits than a double holds.
    pub fn is_long(&self) -> bool {
        self.count > OF_A_DOUBLE
    }

    /// As a double, its last digits lost.
    pub fn value(&self) -> f64 {
        self.digits as f64 / 10f64.powi(self.decimals as i32)
    }

    /// This less `other`, of which no digit is lost; None beyond all measure.
    pub fn less(&self, other: &Exact) -> Option<f64> {
        let most = self.decimals.max(other.decimals);
        let to = |e: &Exact| e.digits.checked_mul(10i128.checked_pow(most - e.decimals)?);
        let difference = to(self)?.checked_sub(to(other)?)?;
        Some(difference as f64 / 10f64.powi(most as i32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn less(a: &str, b: &str) -> Option<f64> {
        let of = |t: &str| Exact::of(t.as_bytes(), Decimal::Point);
        of(a)?.less(&of(b)?)
    }

    #[test]
    fn no_digit_of_a_long_number_is_lost() {
        assert_eq!(less("1700000000000020001", "1700000000000000000"), Some(20001.0));
        assert_eq!(less("1700000000.123456789", "1700000000.1234"), Some(5.6789e-5));
        assert_eq!((less("-5", "3"), less("1e5", "3"), less("1.5.5", "3")), (Some(-8.0), None, None));
        assert!(Exact::of(b"1700000000000000000", Decimal::Point).unwrap().is_long());
        assert!(!Exact::of(b"1700000000,5", Decimal::Comma).unwrap().is_long());
    }
}
