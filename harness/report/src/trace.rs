//! Where a page comes from: when and by what it was made, of which files, and what was recorded.

use anyhow::Result;
use chart::quantity;
use chrono::DateTime;
use diagnose::verdict::{Input, Trace};
use record::Campaign;
use std::time::{SystemTime, UNIX_EPOCH};

/// Name and value of a line of the page's foot, in their order.
pub type Rows = Vec<(String, String)>;

/// What made a page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Made {
    /// When, s since 1970-01-01; None where nothing is said of that.
    pub at: Option<i64>,
    /// The commit that touchdown was built from; "unknown" where it was built without one.
    pub commit: String,
    /// The command as typed; empty where there was none.
    pub command: String,
}

impl Made {
    /// Of this moment, or of the time that SOURCE_DATE_EPOCH sets: with it the same input gives the same pages.
    ///
    /// # Errors
    /// SOURCE_DATE_EPOCH is no time.
    pub fn now(commit: &str, command: &str) -> Result<Made> {
        let clock = || SystemTime::now().duration_since(UNIX_EPOCH).ok().and_then(|d| i64::try_from(d.as_secs()).ok());
        Ok(Made { at: pack::source_date()?.or_else(clock), commit: commit.into(), command: command.into() })
    }

    /// The same without a date but that of SOURCE_DATE_EPOCH: for pages that are the same whenever they are made.
    ///
    /// # Errors
    /// SOURCE_DATE_EPOCH is no time.
    pub fn dateless(commit: &str, command: &str) -> Result<Made> {
        Ok(Made { at: pack::source_date()?, commit: commit.into(), command: command.into() })
    }

    /// Its lines.
    pub fn rows(&self) -> Rows {
        let mut rows = Rows::new();
        if let Some(t) = self.at.and_then(|s| DateTime::from_timestamp(s, 0)) {
            rows.push(("date".into(), t.format("%Y-%m-%d %H:%M:%S UTC").to_string()));
        }
        rows.push(("made by".into(), format!("touchdown {}, commit {}", env!("CARGO_PKG_VERSION"), self.commit)));
        if !self.command.is_empty() {
            rows.push(("command".into(), self.command.clone()));
        }
        rows
    }
}

/// What the answer of campaign `c` is made from; `inputs`: the files read for it.
pub fn of_campaign(c: &Campaign, inputs: &[Input]) -> Trace {
    let rates = c.recordings.iter().filter_map(|r| rate(&r.time));
    let (low, high) = rates.fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r), b.max(r)));
    Trace {
        touchdown: env!("CARGO_PKG_VERSION").into(),
        operator: c.operator.clone(),
        moving_mass: c.moving_mass,
        recordings: c.recordings.len(),
        sampling_rates: if high > 0.0 { [low, high] } else { [0.0, 0.0] },
        inputs: inputs.to_vec(),
    }
}

/// Samples a second, by the median distance of two, Hz; None of fewer than two.
fn rate(time: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let rate = 1.0 / steps.get(steps.len() / 2)?;
    // times have digits enough for a rate of six
    format!("{rate:.5e}").parse().ok()
}

/// The lines of an answer's page.
pub fn rows(made: &Made, t: &Trace) -> Rows {
    let mut rows = made.rows();
    let [low, high] = t.sampling_rates;
    let rates = match low / high {
        r if r.is_nan() => "not known".into(),
        r if r > 0.9999 => quantity(high, "Hz"),
        _ => chart::interval(low, high, "Hz"),
    };
    let mut add = |name: &str, text: String| rows.push((name.into(), text));
    add("recordings", format!("{}, sampled at {rates}", t.recordings));
    if let Some(m) = t.moving_mass {
        add("moving mass", quantity(m, "kg"));
    }
    if let Some(who) = &t.operator {
        add("operator", who.clone());
    }
    rows.extend(files(&t.inputs));
    rows
}

/// The line of the files read; None where there is none.
pub fn files(inputs: &[Input]) -> Option<(String, String)> {
    let all: Vec<String> =
        inputs.iter().map(|i| format!("{} {}", i.sha256, i.file.replace(char::is_control, "?"))).collect();
    (!all.is_empty()).then(|| ("input, SHA-256".into(), all.join("\n")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use record::Kind;

    fn made(at: Option<i64>) -> Made {
        Made { at, commit: "unknown".into(), command: "touchdown diagnose a --out b".into() }
    }

    #[test]
    fn a_page_says_when_by_what_and_from_what_it_was_made() {
        let c = Campaign {
            operator: Some("A. N. Other".into()),
            moving_mass: Some(0.5),
            ..Campaign::of("a", Kind::DropTest, vec![])
        };
        let input = Input { file: "r1\u{7}.csv".into(), sha256: "ab".into() };
        let t = of_campaign(&c, &[input]);
        let rows = rows(&made(Some(0)), &t);
        let said = |name: &str| rows.iter().find(|r| r.0 == name).map(|r| r.1.as_str());
        assert_eq!(said("date"), Some("1970-01-01 00:00:00 UTC"));
        assert_eq!(said("command"), Some("touchdown diagnose a --out b"));
        assert!(said("made by").unwrap().ends_with(", commit unknown"));
        assert_eq!((said("moving mass"), said("operator")), (Some("0.5000 kg"), Some("A. N. Other")));
        assert_eq!((said("recordings"), said("input, SHA-256")), (Some("0, sampled at not known"), Some("ab r1?.csv")));
        // no date where there is none, and none beyond what a calendar has
        assert!([None, Some(i64::MAX)].iter().all(|at| made(*at).rows()[0].0 == "made by"));
    }

    #[test]
    fn a_rate_is_that_of_most_samples() {
        let time: Vec<f64> = (0..100).map(|i| 1e-5 * f64::from(i) + if i > 90 { 0.5 } else { 0.0 }).collect();
        assert_eq!((rate(&time), rate(&time[..1]), rate(&[1.0, 1.0])), (Some(1e5), None, None));
    }
}
