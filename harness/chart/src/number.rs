//! Numbers that are none, in text.

/// What stands where there is no number.
pub const NONE: &str = "\u{2013}";
/// How a number that is not finite is written.
const WRITTEN: [&str; 2] = ["NaN", "inf"];

/// `text` with a dash for every number in it that is not finite: for NaN and inf, signed or not, where they stand as
/// words of their own.
pub fn dashed(text: &str) -> String {
    if !WRITTEN.iter().any(|w| text.contains(w)) {
        return text.into();
    }
    let within = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '/' | '\\');
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((at, word)) = WRITTEN.iter().filter_map(|w| Some((rest.find(w)?, *w))).min() {
        let (before, after) = (&rest[..at], &rest[at + word.len()..]);
        // a full stop ends a sentence where no letter follows it
        let mut follows = after.chars();
        let ends = match follows.next() {
            Some('.') => !follows.next().is_some_and(within),
            c => !c.is_some_and(within),
        };
        let last = before.chars().last().or_else(|| out.chars().last());
        if ends && !last.is_some_and(within) {
            out += before.strip_suffix(['+', '-', '\u{2212}']).unwrap_or(before);
            out += NONE;
        } else {
            out += &rest[..at + word.len()];
        }
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_not_finite_become_dashes_and_words_stay() {
        let nan = f64::NAN;
        let written = format!("goes from {:.2} % to {:+.1e} % ({nan}), {}.", nan, f64::INFINITY, f64::NEG_INFINITY);
        assert_eq!(dashed(&written), "goes from – % to – % (–), –.");
        for text in ["info of inf.csv", "NaN_1, BaNaNa", "/tmp/NaN", "", "1.5 N", "äinf"] {
            assert_eq!(dashed(text), text);
        }
        assert_eq!(dashed("infNaN inf"), "infNaN –");
    }
}
