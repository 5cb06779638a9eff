//! What a diagnosis leaves on disk: verdict.json, predictions, report.html and what goes with them.

use super::{handed, page};
use crate::trace::Made;
use diagnose::heldout::HeldOut;
use diagnose::run::Outcome;
use output::{Answer, Committed};
use record::{Campaign, Channel, Recording};
use std::fmt::Write;
use std::path::Path;

/// A recording's prediction in the file's own columns and units, a row for each of the file's; one that was left out
/// holds the prediction for the nearest time there is.
fn csv(r: &Recording, y: &[Vec<f64>; 3]) -> String {
    let head: Vec<String> = r.columns.iter().map(|c| format!("{} [{}]", c.name, c.unit)).collect();
    let mut s = head.join(",") + "\n";
    let course = |name: &str| Channel::ALL.into_iter().find(|c| c.name() == name).map(|c| &y[c.index()]);
    let columns: Vec<(Option<&Vec<f64>>, f64)> = r.columns.iter().map(|c| (course(&c.name), c.to_si)).collect();
    for row in r.rows.iter() {
        let place = r.place(&row);
        for (k, (course, to_si)) in columns.iter().enumerate() {
            let v = course.map_or(row.time, |y| place.of(y));
            let comma = if k > 0 { "," } else { "" };
            // writing to a String does not fail
            let _ = write!(s, "{comma}{:e}", v / to_si);
        }
        s.push('\n');
    }
    s
}

fn predictions(c: &Campaign, h: &HeldOut, answer: &Answer, folder: &str) -> std::io::Result<()> {
    for (r, y) in c.recordings.iter().zip(h.predictions.of_the_whole()) {
        answer.write(&format!("{folder}/{}", r.file), csv(r, y).as_bytes())?;
    }
    Ok(())
}

/// latent_force/<recording>.csv: time, d, and the ends of its 95 % band.
fn latent(o: &Outcome, answer: &Answer) -> std::io::Result<()> {
    let Some(l) = &o.findings.latent else { return Ok(()) };
    let u = l.place.unit();
    for r in &l.records {
        let mut s = format!("time [s],d [{u}],low [{u}],high [{u}]\n");
        for ((t, f), b) in r.time.iter().zip(&r.force).zip(&r.band) {
            s += &format!("{t:e},{f:e},{:e},{:e}\n", f - b, f + b);
        }
        answer.write(&format!("latent_force/{}", r.file), s.as_bytes())?;
    }
    Ok(())
}

/// Rows of the law learned.
const ROWS: usize = 201;

/// learned/recordings/<recording>.csv: time, depth, force as read, of the law learned, and of each class of it;
/// learned/law.csv: the force over depth, or over what else a force depends on that was learned in motion; law_2.csv of the one
/// beside it.
fn learned(o: &Outcome, answer: &Answer) -> std::io::Result<()> {
    if let Some(f) = &o.force {
        for (i, (columns, rows)) in f.tables(ROWS).into_iter().enumerate() {
            let mut s = columns.join(",") + "\n";
            for row in rows {
                let row: Vec<String> = row.iter().map(|v| format!("{v:e}")).collect();
                let _ = writeln!(s, "{}", row.join(","));
            }
            let name = if i == 0 { "learned/law.csv".into() } else { format!("learned/law_{}.csv", i + 1) };
            answer.write(&name, s.as_bytes())?;
        }
    }
    let Some(l) = o.learned.as_ref().filter(|l| l.leads) else { return Ok(()) };
    let classes: Vec<&str> = l.law().classes().map(|c| c.name).collect();
    for c in &l.courses {
        let mut s = String::from("time [s],penetration [m],read [N],law [N]");
        classes.iter().for_each(|n| s += &format!(",{n} [N]"));
        s.push('\n');
        for i in 0..c.time.len() {
            let _ = write!(s, "{:e},{:e},{:e},{:e}", c.time[i], c.depth[i], c.read[i], c.force[i]);
            for p in &c.parts {
                let _ = write!(s, ",{:e}", p[i]);
            }
            s.push('\n');
        }
        answer.write(&format!("learned/recordings/{}", c.file), s.as_bytes())?;
    }
    let mut s = String::from("penetration [m],loading [N],unloading [N]\n");
    for [x, on, back] in l.table(ROWS).unwrap_or_default() {
        let _ = writeln!(s, "{x:e},{on:e},{back:e}");
    }
    answer.write("learned/law.csv", s.as_bytes())
}

/// without_clipping/<recording>.csv: the clipped channel as its chain would have read it without a limit, a row for each
/// of the file's.
fn unclipped(c: &Campaign, o: &Outcome, answer: &Answer) -> std::io::Result<()> {
    let Some((channel, list)) = &o.findings.unclipped else { return Ok(()) };
    for u in list {
        let Some(r) = c.recordings.iter().find(|r| r.file == u.file) else { continue };
        let column = |name: &str| r.columns.iter().find(|c| c.name == name);
        let (Some(t), Some(y)) = (column("time"), column(channel.name())) else { continue };
        let mut s = format!("time [{}],{} [{}]\n", t.unit, y.name, y.unit);
        for row in r.rows.iter() {
            s += &format!("{:e},{:e}\n", row.time / t.to_si, u.curve[r.judged_sample_of(&row)] / y.to_si);
        }
        answer.write(&format!("without_clipping/{}", u.file), s.as_bytes())?;
    }
    Ok(())
}

/// Whether an answer may take the place of `dir`: nothing there, an empty folder, or an earlier answer.
///
/// # Errors
/// Says why not: a campaign or somebody's files would be lost.
pub fn check_folder(dir: &Path) -> std::io::Result<()> {
    let refuse = |why: &str| Err(std::io::Error::new(std::io::ErrorKind::AlreadyExists, why.to_string()));
    if dir.is_symlink() {
        return refuse("is a link, which no answer is written through; move it away, or give another --out");
    }
    if !dir.exists() {
        return Ok(());
    }
    if !dir.is_dir() {
        return refuse("a file is in the way; give another --out");
    }
    if dir.join("campaign.toml").exists() {
        return refuse("holds a campaign, which an answer would replace; give another --out");
    }
    if std::fs::read_dir(dir)?.next().is_some() && !dir.join("verdict.json").exists() {
        return refuse("holds files that are no answer of touchdown; empty it or give another --out");
    }
    Ok(())
}

/// What a report is made by, and whether there is a page of all campaigns above it.
pub struct Foot<'a> {
    pub made: &'a Made,
    pub is_listed: bool,
}

/// Writes everything to `dir`, which appears whole or stays as it was; `input` is the hash of all that the answer depends on.
///
/// # Errors
/// As the file system gives them.
pub fn write(
    c: &Campaign,
    o: &Outcome,
    dir: &Path,
    input: Option<String>,
    foot: &Foot<'_>,
) -> std::io::Result<Committed> {
    check_folder(dir)?;
    let answer = Answer::begin(dir, "diagnose")?.of_input(input);
    if !o.before.predictions.judged.is_empty() {
        predictions(c, &o.before, &answer, "predictions/before")?;
        predictions(c, o.after.as_ref().unwrap_or(&o.before), &answer, "predictions/after")?;
    }
    latent(o, &answer)?;
    learned(o, &answer)?;
    unclipped(c, o, &answer)?;
    if let Ok(e) = &o.element {
        let fmu = e.fmu(handed::label(c, o, e)).map_err(|e| std::io::Error::other(format!("{e:#}")))?;
        answer.write("HysteresisContact.fmu", &fmu)?;
    }
    if let Some(b) = &o.body {
        answer.write("BodyForce.fmu", &b.fmu)?;
    }
    for (name, bytes) in o.system.iter().flatten() {
        answer.write(&format!("system/{name}"), bytes)?;
    }
    answer.write("report.html", page::html(c, o, foot).as_bytes())?;
    answer.write("verdict.json", o.verdict.json().map_err(std::io::Error::other)?.as_bytes())?;
    answer.commit()
}
