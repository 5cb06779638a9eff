//! How the FMU handed back describes itself: its campaign, what was found, and the values it holds.

use super::card::capital;
use super::page::mechanism;
use super::words::{self, plain, through};
use chart::{interval, quantity, Datum, Page};
use diagnose::element::Packed;
use diagnose::intervals::Interval;
use diagnose::run::Outcome;
use diagnose::verdict::Missing;
use pack::Label;
use record::Campaign;
use std::time::UNIX_EPOCH;

/// The label of the FMU of a campaign.
pub fn label(c: &Campaign, o: &Outcome, p: &Packed) -> Label {
    let description = description(c, o);
    let mut page = Page::new("").sentence(&description).paragraph(&format!("{}.", capital(&through(o, p))));
    for m in held(o) {
        page = mechanism(page, m);
    }
    page = starts(page.section("Start values"), o, p);
    Label {
        name: Some(c.folder.clone()),
        description: Some(description),
        made: newest(c),
        page: Some(page),
        speeds: speeds(o),
        ..Label::default()
    }
}

/// The start values of the FMU, each with its interval where it was calibrated.
pub fn starts(page: Page, o: &Outcome, p: &Packed) -> Page {
    let found = |name: &str| held(o).find_map(|m| m.parameters.get(name)).and_then(|f| f.ci95);
    let own = |name: &str| p.calibrated.iter().find(|i| i.name == name).and_then(Interval::ends);
    let row = |(name, value, unit): &(&'static str, f64, &'static str)| {
        let shown = pack::item(name, *value).map_or_else(|| Datum::number(*value, unit), Datum::from);
        let ends = found(name).or(own(name));
        vec![(*name).into(), shown, ends.map_or("".into(), |[low, high]| Datum::interval(low, high, unit))]
    };
    let rows: Vec<Vec<Datum>> = p.starts.iter().map(row).collect();
    page.values(&["parameter", "start value", "95 % interval"], &rows)
}

/// The mechanisms named that the FMU holds.
fn held(o: &Outcome) -> impl Iterator<Item = &Missing> {
    let relied_on = o.findings.gates.is_empty();
    o.verdict.missing.iter().filter(move |m| relied_on && pack::holds(m.mechanism))
}

/// Campaign and findings in a sentence or two.
fn description(c: &Campaign, o: &Outcome) -> String {
    let mut found: Vec<String> = held(o).map(in_short).collect();
    if let Some(f) = o.force.as_ref().filter(|_| o.findings.holds_learned.in_contact) {
        found.push(format!("a force of a shape of its own, learned: it acts {}", f.words()));
    }
    let what = if found.is_empty() { "no further mechanism".into() } else { found.join("; ") };
    let many = c.recordings.len();
    let text = format!("Contact calibrated to {many} recordings of the campaign {}, with {what}", c.name);
    // not every host shows more than ASCII
    text.replace('\u{2212}', "-").replace('\u{b5}', "u")
}

/// A mechanism with its values and their intervals.
fn in_short(m: &Missing) -> String {
    let value = |(name, p): (&String, &diagnose::verdict::Parameter)| {
        let ends = words::ends(p, m.intervals_by, interval);
        format!("{} {} (95 %: {ends})", plain(name), quantity(p.value, p.unit))
    };
    let values: Vec<String> = m.parameters.iter().map(value).collect();
    format!("{} ({}): {}", plain(m.mechanism), m.form, values.join(", "))
}

/// Time of the newest of a campaign's files, s since 1970-01-01; None where no file has one.
fn newest(c: &Campaign) -> Option<i64> {
    let files = c.recordings.iter().map(|r| c.dir.join(&r.file)).chain([c.dir.join("campaign.toml")]);
    let changed = |f: std::path::PathBuf| std::fs::metadata(f).ok()?.modified().ok()?.duration_since(UNIX_EPOCH).ok();
    files.filter_map(changed).max().and_then(|d| i64::try_from(d.as_secs()).ok())
}

/// Least and largest speed at touch of the recordings, m/s; empty where none is known.
fn speeds(o: &Outcome) -> Vec<f64> {
    let known = o.courses.contacts.iter().map(|t| t.speed).filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = known.fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    let mut ends = if high > 0.0 { vec![low, high] } else { Vec::new() };
    ends.dedup_by(|a, b| (*a - *b).abs() < 0.01 * *b);
    ends
}
