//! The table of a benchmark, in Markdown.

use super::{Pair, Spread};

/// What is wanted of a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Ours over theirs is to be below this.
    Below(f64),
    /// Theirs over ours is to be this or more.
    Times(f64),
    /// Nothing.
    None,
}

/// A line.
#[derive(Clone, Debug)]
pub struct Row {
    what: String,
    ours: String,
    theirs: String,
    ratio: String,
    aim: String,
}

/// Three significant figures.
pub fn figure(x: f64) -> String {
    if !x.is_finite() {
        return "-".into();
    }
    if x == 0.0 {
        return "0".into();
    }
    let digits = (2 - x.abs().log10().floor() as i32).max(0) as usize;
    format!("{x:.digits$}")
}

fn verdict(met: bool) -> &'static str {
    if met {
        "met"
    } else {
        "MISSED"
    }
}

impl Row {
    /// Two sides measured in turn; the ratio's median, least and greatest.
    pub fn of(what: &str, other: &str, pair: &Pair, unit: &str, aim: Aim) -> Row {
        let (s, target) = match aim {
            Aim::Times(t) => {
                let g = pair.gain();
                (g, format!("{} times faster or more: {}", figure(t), verdict(g.median >= t)))
            }
            Aim::Below(t) => {
                let r = pair.ratio();
                (r, format!("{} or less: {}", figure(t), verdict(r.median <= t)))
            }
            Aim::None => (pair.ratio(), String::new()),
        };
        Row {
            what: what.into(),
            ours: format!("{} {unit}", figure(pair.ours().median)),
            theirs: format!("{} {unit}, {other}", figure(pair.theirs().median)),
            ratio: format!("{} ({} to {})", figure(s.median), figure(s.min), figure(s.max)),
            aim: target,
        }
    }

    /// Several of ours beside one of theirs, which may not have arrived: then the ratio is a lower bound.
    pub fn one(what: &str, other: &str, ours: Spread, theirs: (f64, bool), unit: &str, times: f64) -> Row {
        let (other_took, arrived) = theirs;
        let gain = other_took / ours.median;
        let than = if arrived { "" } else { "more than " };
        let target = if times > 0.0 {
            let open = !arrived && gain < times;
            let word = if open { "open: the other was given up" } else { verdict(gain >= times) };
            format!("{} times faster or more: {word}", figure(times))
        } else {
            String::new()
        };
        Row {
            what: what.into(),
            ours: format!("{} {unit}", figure(ours.median)),
            theirs: format!("{than}{} {unit}, {other}", figure(other_took)),
            ratio: format!(
                "{than}{} ({} to {})",
                figure(gain),
                figure(other_took / ours.max),
                figure(other_took / ours.min)
            ),
            aim: target,
        }
    }

    /// A figure of ours with a limit.
    pub fn limit(what: &str, ours: Spread, unit: &str, limit: f64) -> Row {
        Row {
            what: what.into(),
            ours: format!("{} {unit} ({} to {})", figure(ours.median), figure(ours.min), figure(ours.max)),
            theirs: String::new(),
            ratio: figure(ours.median / limit),
            aim: format!("{} {unit} or less: {}", figure(limit), verdict(ours.median <= limit)),
        }
    }
}

/// The rows as a Markdown table.
pub fn markdown(rows: &[Row]) -> String {
    let mut s = String::from("| | touchdown | beside | ratio (least to greatest) | target |\n|---|---|---|---|---|\n");
    for r in rows {
        s += &format!("| {} | {} | {} | {} | {} |\n", r.what, r.ours, r.theirs, r.ratio, r.aim);
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        for (x, s) in [(0.012345, "0.0123"), (1.5, "1.50"), (12345.6, "12346"), (0.0, "0"), (f64::NAN, "-")] {
            assert_eq!(figure(x), s);
        }
    }

    #[test]
    fn a_row_says_whether_its_target_is_met() {
        let pair = Pair { rounds: vec![(1.0, 3.0), (1.0, 4.0), (2.0, 8.0)] };
        let row = |aim| markdown(&[Row::of("a", "b", &pair, "ns", aim)]);
        assert!(row(Aim::Times(4.0)).contains("| 4.00 (3.00 to 4.00) | 4.00 times faster or more: met |"));
        assert!(row(Aim::Times(5.0)).contains("MISSED"));
        assert!(row(Aim::Below(0.25)).contains("met"));
        assert!(row(Aim::Below(0.2)).contains("MISSED"));
        let ours = Spread::of([1.0]);
        let one = |took, arrived| markdown(&[Row::one("a", "b", ours, (took, arrived), "s", 500.0)]);
        assert!(one(600.0, true).contains("or more: met"));
        assert!(one(600.0, false).contains("more than 600") && one(600.0, false).contains("or more: met"));
        assert!(one(100.0, false).contains("open") && one(100.0, true).contains("MISSED"));
        assert!(markdown(&[Row::limit("a", Spread::of([11.0]), "s", 10.0)]).contains("MISSED"));
    }
}
