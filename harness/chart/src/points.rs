//! The points of a chart as its page holds them for a file of values: columns of numbers in few bytes.
//!
//! A column is its name, a power of ten and whole numbers times that; of these the differences that are shortest. All of it is
//! text, deflated (RFC 1951) and written in base 64 (RFC 4648). `script.js` reads it.

use flate2::write::DeflateEncoder;
use flate2::Compression;
use std::io::Write;

/// Digits of the largest value of a column: more than any instrument has.
const DIGITS: i32 = 12;
/// Most times that differences are taken of differences.
const ORDERS: usize = 4;
/// Largest power of ten that a column is written in, either way: beyond it numbers leave the range of a double.
const POWER: i32 = 280;

/// A column: its name with its unit, as in `force [N]`, and its values; one that is not finite is a gap.
pub(crate) struct Column {
    pub name: String,
    pub values: Vec<f64>,
}

/// Columns for a page; empty where there is nothing in them.
pub(crate) fn encoded(columns: &[Column]) -> String {
    if columns.iter().all(|c| c.values.is_empty()) {
        return String::new();
    }
    let text: String = columns.iter().map(|c| written(c) + "\n").collect();
    let mut deflated = DeflateEncoder::new(Vec::new(), Compression::best());
    // writing to memory does not fail
    let bytes = deflated.write_all(text.as_bytes()).and_then(|()| deflated.finish()).unwrap_or_default();
    base64(&bytes)
}

/// A column as one line: its name, power of ten and order of differences, parted by tabs, then its numbers, parted by blanks.
fn written(c: &Column) -> String {
    let largest = c.values.iter().filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
    let power = if largest > 0.0 { largest.log10().floor() as i32 + 1 - DIGITS } else { 0 };
    let power = power.clamp(-POWER, POWER);
    let whole = |v: &f64| v.is_finite().then(|| (v * 10f64.powi(-power)).round() as i64);
    let mut numbers: Vec<Option<i64>> = c.values.iter().map(whole).collect();
    let (mut best, mut order) = (joined(&numbers), 0);
    for k in 1..=ORDERS {
        numbers = differences(&numbers);
        let text = joined(&numbers);
        if text.len() < best.len() {
            (best, order) = (text, k);
        }
    }
    let name = c.name.replace(char::is_control, " ");
    format!("{name}\t{power}\t{order}\t{best}")
}

/// Each number less the one before it, gaps left out; the first less zero.
fn differences(numbers: &[Option<i64>]) -> Vec<Option<i64>> {
    let mut last = 0;
    let of = |n: &Option<i64>| n.map(|n| n.wrapping_sub(std::mem::replace(&mut last, n)));
    numbers.iter().map(of).collect()
}

fn joined(numbers: &[Option<i64>]) -> String {
    let text: Vec<String> = numbers.iter().map(|n| n.map_or("-".into(), |n| n.to_string())).collect();
    text.join(" ")
}

/// Bytes in base 64.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut s = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            s.push(if i > group.len() { '=' } else { char::from(letter) });
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::DeflateDecoder;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngSeed};
    use std::io::Read;

    /// Columns as the page's script reads them.
    fn read(text: &str) -> Vec<(String, Vec<f64>)> {
        let mut bits: Vec<u8> = Vec::new();
        let letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for group in text.as_bytes().chunks(4) {
            let of = |c: &u8| letters.find(char::from(*c)).unwrap_or(0) as u32;
            let all = group.iter().fold(0, |b, c| b << 6 | of(c));
            let count = 3 - group.iter().filter(|c| **c == b'=').count();
            bits.extend(all.to_be_bytes()[1..].iter().take(count));
        }
        let mut all = String::new();
        DeflateDecoder::new(&bits[..]).read_to_string(&mut all).unwrap();
        let column = |line: &str| {
            let parts: Vec<&str> = line.split('\t').collect();
            let order: usize = parts[2].parse().unwrap();
            let mut n: Vec<Option<i64>> = parts[3].split(' ').map(|w| w.parse().ok()).collect();
            for _ in 0..order {
                let mut sum = 0;
                n.iter_mut().flatten().for_each(|v| {
                    sum += *v;
                    *v = sum;
                });
            }
            let value = |v: Option<i64>| v.map_or(f64::NAN, |v| format!("{v}e{}", parts[1]).parse().unwrap());
            (parts[0].to_string(), n.into_iter().map(value).collect())
        };
        all.lines().map(column).collect()
    }

    #[test]
    fn base_64_is_that_of_the_standard() {
        // RFC 4648, section 10
        let of = |t: &str| base64(t.as_bytes());
        assert_eq!((of(""), of("f"), of("fo")), ("".into(), "Zg==".into(), "Zm8=".into()));
        assert_eq!((of("foo"), of("foobar")), ("Zm9v".into(), "Zm9vYmFy".into()));
    }

    #[test]
    fn a_smooth_curve_takes_few_bytes_and_keeps_its_digits() {
        let values: Vec<f64> = (0..2000).map(|i| 1234.5 * (1e-3 * f64::from(i)).sin()).collect();
        let text = encoded(&[Column { name: "force [N]".into(), values: values.clone() }]);
        assert!(text.len() < 3 * values.len(), "{}", text.len());
        let (name, got) = read(&text).remove(0);
        assert_eq!(name, "force [N]");
        assert!(values.iter().zip(&got).all(|(a, b)| (a - b).abs() < 1e-8), "{:?}", &got[..3]);
        assert_eq!(encoded(&[Column { name: "x".into(), values: vec![] }]), "");
    }

    proptest! {
        #![proptest_config(Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() })]
        #[test]
        fn any_numbers_come_back_and_what_is_none_is_a_gap(values in vec(any::<f64>(), 1..40), scale in -12..12i32) {
            let ordinary: Vec<f64> = values.iter().map(|v| (v % 1.0) * 10f64.powi(scale)).collect();
            for values in [values, ordinary] {
                let (_, got) = read(&encoded(&[Column { name: "a\tb\n".into(), values: values.clone() }])).remove(0);
                let largest = values.iter().filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
                prop_assert_eq!(values.len(), got.len());
                for (a, b) in values.iter().zip(&got) {
                    prop_assert_eq!(a.is_finite(), b.is_finite());
                    prop_assert!(!(1e-280..1e280).contains(&largest) || !a.is_finite() || (a - b).abs() <= 1e-11 * largest, "{a} {b}");
                }
            }
        }
    }
}
