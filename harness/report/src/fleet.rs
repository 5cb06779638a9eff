//! The page of a fleet: what became of every campaign, what grows with what, a map of campaigns by cause.

use crate::trace::Made;
use ::fleet::growth::{points, text, Figure, Growth, Growths};
use ::fleet::{Answer, Fleet, Judged, State};
use chart::{quantity, Cell, Cells, Chart, Page, Shares, Style};
use output::Manifest;
use record::Label;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// Charts of what grows, at most.
const DRAWN: usize = 6;
/// Comparisons in the table of what grows, and of what does not, at most.
const TABLED: usize = 40;
/// Classes that a column of numbers is parted into, and values of one of texts that are distinguished, at most.
const CLASSES: usize = 5;
const VALUES: usize = 12;
/// Names of lost campaigns in the first sentence, at most.
const NAMED: usize = 5;

/// The page's name.
pub const INDEX: &str = "index.html";

/// Sees that nobody else's page has the name of the index in `out`: one that is not as the list of files there has it.
///
/// # Errors
/// Where one has it, and the cure.
pub fn check(out: &Path) -> std::io::Result<()> {
    let refuse = || {
        let why = "is no index of touchdown and is left as it is; move it away, or give another --out";
        Err(std::io::Error::new(std::io::ErrorKind::AlreadyExists, why))
    };
    match std::fs::symlink_metadata(out.join(INDEX)) {
        Err(e) if matches!(e.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => Ok(()),
        _ if Manifest::read(out).is_some_and(|m| m.has(out, INDEX)) => Ok(()),
        _ => refuse(),
    }
}

/// The page, which lies in `out`.
pub fn html(out: &Path, fleet: &Fleet, growths: &Growths, made: &Made) -> String {
    let mut page = Page::new("Fleet").sentence(&sentence(fleet));
    if let Some(g) = headline(growths) {
        page = page.sentence(&g);
    }
    page = without_answer(page, fleet);
    page = map(page, out, fleet);
    page = grown(page, fleet, growths);
    for column in fleet.columns() {
        page = by_column(page, fleet, &column);
    }
    all(page, out, fleet).trace(&made.rows()).html()
}

/// What became of the fleet, in words.
pub fn sentence(fleet: &Fleet) -> String {
    let total = fleet.answers.len();
    let judged = fleet.judged().count();
    let detected: Vec<&Judged> = fleet.judged().map(|(_, j)| j).filter(|j| j.detected).collect();
    let held = detected.iter().filter(|j| j.false_discovery_rate <= fleet::growth::LEVEL).count();
    let mut s = format!("{} judged.", of(judged, total, "was", "were"));
    if judged > 0 {
        s += &match detected.len() {
            0 => " Nothing is missing in any of them.".into(),
            n => format!(
                " In {n} something is missing: {}. {held} of these hold at a false discovery rate of {:.0} %.",
                causes(&detected),
                100.0 * fleet::growth::LEVEL
            ),
        };
    }
    match fleet.unjudged().count() {
        0 => {}
        n => s += &format!(" {n} cannot be judged."),
    }
    let lost: Vec<&str> = fleet.lost().map(|(a, _)| a.campaign.as_str()).collect();
    if !lost.is_empty() {
        let more = if lost.len() > NAMED { format!(" and {} more", lost.len() - NAMED) } else { String::new() };
        let (is, names) = (if lost.len() == 1 { "is" } else { "are" }, lost[..lost.len().min(NAMED)].join(", "));
        s += &format!(" {} {is} lost: {names}{more}.", lost.len());
    }
    s
}

fn of(n: usize, total: usize, one: &str, many: &str) -> String {
    match (n, total) {
        (0, 0) => format!("No campaign {one}"),
        (1, 1) => format!("One campaign {one}"),
        (n, total) if n == total => format!("{n} campaigns {many}"),
        (n, total) => format!("{n} of {total} campaigns {}", if n == 1 { one } else { many }),
    }
}

fn causes(of: &[&Judged]) -> String {
    let said: Vec<String> = by_cause(of.iter().copied()).into_iter().map(|(c, n)| format!("{c} in {n}")).collect();
    said.join(", ")
}

/// Causes with how many have them, the most frequent first.
fn by_cause<'a>(all: impl Iterator<Item = &'a Judged>) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    all.for_each(|j| *counts.entry(j.cause()).or_default() += 1);
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by_key(|c| std::cmp::Reverse(c.1));
    counts
}

/// What grows, in one sentence; None where nothing was compared.
fn headline(growths: &Growths) -> Option<String> {
    if growths.all.is_empty() {
        return None;
    }
    let mut said: Vec<String> = Vec::new();
    for g in growths.discoveries() {
        let text = format!("{} {} {}", plain(&g.mechanism), verb(g), g.column);
        if !said.contains(&text) {
            said.push(text);
        }
    }
    Some(match said.len() {
        0 => "Nothing grows with a column, and nothing differs between its values.".into(),
        n if n > NAMED => format!("{}; and {} more.", capital(&said[..NAMED].join("; ")), n - NAMED),
        _ => format!("{}.", capital(&said.join("; "))),
    })
}

fn verb(g: &Growth) -> &'static str {
    match g.correlation {
        Some(c) if c < 0.0 => "falls with",
        Some(_) => "grows with",
        None => "differs by",
    }
}

fn plain(name: &str) -> String {
    name.replace('_', " ")
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
}

fn without_answer(page: Page, fleet: &Fleet) -> Page {
    let row = |(a, why): (&Answer, &str)| vec![a.campaign.clone(), why.to_string()];
    let (lost, unjudged): (Vec<_>, Vec<_>) = (fleet.lost().map(row).collect(), fleet.unjudged().map(row).collect());
    let mut page = page;
    if !lost.is_empty() {
        page = page.section("Lost").table(&["campaign", "why it has no answer"], &lost);
    }
    if !unjudged.is_empty() {
        page = page.section("Not judged").table(&["campaign", "why"], &unjudged);
    }
    page
}

fn map(page: Page, out: &Path, fleet: &Fleet) -> Page {
    let mut cells = Cells::default();
    for (cause, _) in by_cause(fleet.judged().map(|(_, j)| j)) {
        let mut of: Vec<(&Answer, &Judged)> = fleet.judged().filter(|(_, j)| j.cause() == cause).collect();
        of.sort_by(|a, b| b.1.sure().total_cmp(&a.1.sure()).then(a.0.campaign.cmp(&b.0.campaign)));
        let cell = |(a, j): (&Answer, &Judged)| Cell {
            said: format!("{}: {cause}, probability {:.2}", a.campaign, j.sure()),
            to: Some(report(out, a)),
            strength: j.sure(),
        };
        cells = cells.row(&cause, of.into_iter().map(cell).collect());
    }
    let rest = |name: &str, of: Vec<(&Answer, &str)>, cells: Cells| match of.len() {
        0 => cells,
        _ => {
            let cell = |(a, why): (&Answer, &str)| Cell {
                said: format!("{}: {why}", a.campaign),
                to: matches!(a.state, State::Unjudged(_)).then(|| report(out, a)),
                strength: 0.0,
            };
            cells.row(name, of.into_iter().map(cell).collect())
        }
    };
    cells = rest("cannot be judged", fleet.unjudged().collect(), cells);
    cells = rest("lost", fleet.lost().collect(), cells);
    page.section("Campaigns by cause")
        .paragraph("A square a campaign, the surer the cause the stronger its colour. Each leads to its report.")
        .cells(&cells)
}

fn figure(g: &Growth) -> String {
    match &g.figure {
        Figure::Probability => "probability that it is missing".into(),
        Figure::Size => "largest change it makes".into(),
        Figure::Parameter(name) => name.replace('_', " "),
    }
}

fn value(g: &Growth, v: f64) -> String {
    match &g.figure {
        Figure::Probability => format!("{v:.2}"),
        Figure::Size => format!("{:.2} %", 100.0 * v),
        Figure::Parameter(_) => quantity(v, &g.unit),
    }
}

fn small(p: f64) -> String {
    if p < 1e-6 {
        "below 1e-6".into()
    } else if p < 0.001 {
        format!("{p:.0e}")
    } else {
        format!("{p:.3}")
    }
}

fn grown(page: Page, fleet: &Fleet, growths: &Growths) -> Page {
    let mut page = page.section("What grows with what");
    if growths.all.is_empty() {
        let why = if fleet.columns().is_empty() {
            "No campaign has columns. Write what you know of each, such as its order, batch or temperature, under \
             [campaign.columns] of its campaign.toml, and diagnose again."
        } else {
            "Too few campaigns were judged to compare anything, or they all look alike."
        };
        return page.paragraph(why);
    }
    let head =
        ["mechanism", "figure", "column", "from", "mean there", "to", "mean there", "correlation", "campaigns", "q"];
    let row = |g: &Growth| {
        vec![
            plain(&g.mechanism),
            figure(g),
            g.column.clone(),
            g.from.of.clone(),
            value(g, g.from.mean),
            g.to.of.clone(),
            value(g, g.to.mean),
            g.correlation.map_or("-".into(), |c| format!("{c:.2}")),
            g.campaigns.to_string(),
            small(g.q),
        ]
    };
    let (found, rest): (Vec<&Growth>, Vec<&Growth>) = growths.all.iter().partition(|g| g.q <= growths.level);
    page = page.paragraph(&format!(
        "{} comparisons of a mechanism with a column, of which {} hold at a false discovery rate of {:.0} % (Benjamini and Hochberg \
         1995). Each p-value is the share of the orders of the campaigns, drawn at random, that look as strong.",
        growths.all.len(),
        found.len(),
        100.0 * growths.level
    ));
    if !found.is_empty() {
        page = page.table(&head, &found.iter().take(TABLED).map(|g| row(g)).collect::<Vec<_>>());
    }
    for g in found.iter().filter(|g| g.correlation.is_some()).take(DRAWN) {
        let (x, y): (Vec<f64>, Vec<f64>) = points(fleet, &g.column, &g.mechanism, &g.figure)
            .into_iter()
            .filter_map(|(l, v)| match l {
                Label::Number(x) => Some((x, v)),
                Label::Text(_) => None,
            })
            .unzip();
        let title = format!("{} by {}", capital(&plain(&g.mechanism)), g.column);
        let unit = if g.unit.is_empty() { "1" } else { &g.unit };
        let chart = Chart::new(&title, &g.column, &format!("{} [{unit}]", figure(g)));
        page = page
            .chart(&chart.marks("campaigns", &x, &y, Style::After), &format!("A point a campaign, q {}.", small(g.q)));
    }
    if !rest.is_empty() {
        let rows: Vec<_> = rest.iter().take(TABLED).map(|g| row(g)).collect();
        page = page.folded("Show what does not hold", |p| p.table(&head, &rows));
    }
    page
}

/// Classes of a column: a name, and which values belong to it.
fn classes(fleet: &Fleet, column: &str) -> Vec<(String, Vec<Label>)> {
    let labels: Vec<Label> = fleet.judged().filter_map(|(a, _)| a.columns.get(column).cloned()).collect();
    let numbers: Option<Vec<f64>> = labels
        .iter()
        .map(|l| match l {
            Label::Number(x) => Some(*x),
            Label::Text(_) => None,
        })
        .collect();
    let Some(mut x) = numbers else {
        let mut names: Vec<String> = labels.iter().map(text).collect();
        names.sort();
        names.dedup();
        if names.len() > VALUES {
            return Vec::new();
        }
        let of = |n: &String| labels.iter().filter(|l| text(l) == *n).cloned().collect();
        return names.iter().map(|n| (n.clone(), of(n))).collect();
    };
    x.sort_by(f64::total_cmp);
    let mut distinct = x.clone();
    distinct.dedup();
    if distinct.len() <= CLASSES {
        return distinct.into_iter().map(|v| (format!("{v}"), vec![Label::Number(v)])).collect();
    }
    // as many values in each, but for those that are equal
    let mut found = Vec::new();
    let each = x.len().div_ceil(CLASSES);
    let mut i = 0;
    while i < x.len() {
        let mut end = (i + each).min(x.len());
        while end < x.len() && x[end] == x[end - 1] {
            end += 1;
        }
        let name = if x[i] == x[end - 1] { format!("{}", x[i]) } else { format!("{} to {}", x[i], x[end - 1]) };
        found.push((name, x[i..end].iter().map(|v| Label::Number(*v)).collect()));
        i = end;
    }
    found
}

fn by_column(page: Page, fleet: &Fleet, column: &str) -> Page {
    let classes = classes(fleet, column);
    if classes.len() < 2 {
        return page;
    }
    let names: Vec<String> = classes.iter().map(|c| c.0.clone()).collect();
    let mut shares = Shares::new(&format!("Campaigns by cause and {column}"), &names);
    for (cause, _) in by_cause(fleet.judged().map(|(_, j)| j)) {
        let of = |labels: &[Label]| {
            let has = |a: &Answer| a.columns.get(column).is_some_and(|l| labels.contains(l));
            fleet.judged().filter(|(a, j)| j.cause() == cause && has(a)).count()
        };
        shares = shares.row(&cause, &classes.iter().map(|c| of(&c.1)).collect::<Vec<_>>());
    }
    page.section(&format!("By {column}")).shares(&shares)
}

fn all(page: Page, out: &Path, fleet: &Fleet) -> Page {
    let columns = fleet.columns();
    let mut head = vec!["campaign", "finding", "probability", "misfit", "with it", "false discovery rate"];
    head.extend(columns.iter().map(String::as_str));
    let percent = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or("-".into(), |v| format!("{:.2} %", 100.0 * v));
    let row = |a: &Answer| {
        let mut cells = vec![a.campaign.clone()];
        cells.extend(match &a.state {
            State::Judged(j) => {
                let rest = if j.unexplained && !j.missing.is_empty() { "; a misfit stays unexplained" } else { "" };
                [
                    j.cause() + rest,
                    format!("{:.2}", j.sure()),
                    percent(j.before),
                    percent(j.after),
                    small(j.false_discovery_rate),
                ]
            }
            State::Unjudged(why) => {
                [format!("cannot be judged: {why}"), "-".into(), "-".into(), "-".into(), "-".into()]
            }
            State::Lost(why) => [format!("lost: {why}"), "-".into(), "-".into(), "-".into(), "-".into()],
        });
        cells.extend(columns.iter().map(|c| a.columns.get(c).map_or("-".into(), text)));
        let to = (!matches!(a.state, State::Lost(_))).then(|| report(out, a));
        (to, cells)
    };
    let rows: Vec<_> = fleet.answers.iter().map(row).collect();
    page.section("All campaigns")
        .paragraph(
            "What matters first: what is lost, what cannot be judged, what misses something by its misfit, and the rest. The \
             misfit is over range, on levels that no fit has seen.",
        )
        .ledger(&head, &rows)
}

/// The link from a page in `out` to the report of `a`.
fn report(out: &Path, a: &Answer) -> String {
    // of a folder that is not there yet, that of the nearest above it which is
    let whole = |p: &Path| {
        let p = std::path::absolute(p).unwrap_or_else(|_| p.to_path_buf());
        let there = p.ancestors().find_map(|a| Some((a.canonicalize().ok()?, p.strip_prefix(a).ok()?)));
        there.map_or(p.clone(), |(above, below)| above.join(below))
    };
    let (from, to) = (whole(out), whole(&a.folder).join("report.html"));
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(to.components().skip(common)).collect();
    let parts: Vec<String> =
        way.components().map(|c| super::diagnosis::encoded(&c.as_os_str().to_string_lossy())).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use fleet::growth::growths;
    use fleet::Named;

    fn judged(cause: Option<(&str, f64)>, misfit: f64) -> State {
        let missing: Vec<Named> = cause
            .iter()
            .map(|(m, size)| Named {
                mechanism: m.to_string(),
                form: "f".into(),
                probability: 0.9,
                size: Some(*size),
                parameters: Vec::new(),
            })
            .collect();
        State::Judged(Judged {
            detected: cause.is_some(),
            false_alarm_probability: 0.01,
            false_discovery_rate: 0.02,
            missing,
            unexplained: false,
            nothing: if cause.is_none() { 0.9 } else { 0.0 },
            probabilities: cause.iter().map(|(m, _)| (m.to_string(), 0.9)).collect(),
            before: Some(misfit),
            after: None,
        })
    }

    fn fleet(out: &Path) -> Fleet {
        let mut answers = Vec::new();
        let mut push = |name: &str, state: State, columns: &[(&str, Label)]| {
            let columns = columns.iter().map(|(n, l)| (n.to_string(), l.clone())).collect();
            answers.push(Answer { campaign: name.into(), folder: out.join(name), columns, state });
        };
        push("gone <1>", State::Lost("its process was ended by SIGABRT".into()), &[]);
        push("short", State::Unjudged("too short".into()), &[]);
        for i in 0..24 {
            let cause = (i >= 8).then_some(("guide_friction", 0.01 * f64::from(i)));
            let batch = Label::Text(["A", "B"][i as usize % 2].into());
            push(&format!("c{i:02}"), judged(cause, 0.1), &[("order", Label::Number(f64::from(i))), ("batch", batch)]);
        }
        Fleet { answers, complaints: Vec::new(), ..Fleet::default() }
    }

    #[test]
    fn the_page_says_what_is_lost_what_grows_and_where_every_report_is() {
        let t = tempfile::tempdir().unwrap();
        let f = fleet(t.path());
        let g = growths(&f);
        let h = html(t.path(), &f, &g, &Made::default());
        assert!(h.contains("24 of 26 campaigns were judged. In 16 something is missing: guide friction in 16."), "{h}");
        assert!(h.contains("1 cannot be judged. 1 is lost: gone &lt;1&gt;."));
        assert!(h.contains("Guide friction grows with order."));
        assert!(
            h.contains("ended by SIGABRT") && h.contains("too short") && h.contains("Campaigns by cause and batch")
        );
        assert!(h.contains("href=\"c23/report.html\"") && !h.contains("gone%20%3C1%3E/report.html"));
        assert_eq!(h.matches("<a href=\"short/report.html\"").count(), 2);
        assert!(h.contains("<svg class=\"chart\"") && !h.contains("<1>"));
        assert_eq!(h, html(t.path(), &f, &growths(&f), &Made::default()), "twice the same");
    }

    #[test]
    fn a_page_elsewhere_leads_back_to_the_answers() {
        let t = tempfile::tempdir().unwrap();
        let (here, there) = (t.path().join("page"), t.path().join("node 1/answers"));
        std::fs::create_dir_all(there.join("c")).unwrap();
        std::fs::create_dir_all(&here).unwrap();
        let a = Answer {
            campaign: "c".into(),
            folder: there.join("c"),
            columns: Default::default(),
            state: judged(None, 0.1),
        };
        assert_eq!(report(&here, &a), "../node%201/answers/c/report.html");
        // a page's folder need not be there yet
        assert_eq!(report(&t.path().join("new/page"), &a), "../../node%201/answers/c/report.html");
        assert_eq!(report(&there.join("page"), &a), "../c/report.html");
    }

    #[test]
    fn a_fleet_without_columns_is_told_how_to_write_them() {
        let t = tempfile::tempdir().unwrap();
        let mut f = fleet(t.path());
        f.answers.iter_mut().for_each(|a| a.columns.clear());
        assert!(html(t.path(), &f, &growths(&f), &Made::default()).contains("[campaign.columns]"));
        assert!(html(t.path(), &Fleet::default(), &Growths::default(), &Made::default())
            .contains("No campaign was judged."));
    }
}
