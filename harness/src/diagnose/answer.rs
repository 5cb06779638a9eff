//! What a diagnosis leaves on disk: verdict.json, predictions, report.html; and its words for the terminal.

use super::heldout::HeldOut;
use super::run::Outcome;
use crate::files;
use crate::record::{Campaign, Channel, Recording};
use crate::report::{Chart, Page, Style};
use std::path::Path;

/// A recording's prediction in the file's own columns and units.
fn csv(r: &Recording, y: &[Vec<f64>; 3]) -> String {
    let head: Vec<String> = r.columns.iter().map(|c| format!("{} [{}]", c.name, c.unit)).collect();
    let mut s = head.join(",") + "\n";
    let column = |name: &str| Channel::ALL.into_iter().find(|c| c.name() == name);
    for i in 0..r.time.len() {
        for (k, c) in r.columns.iter().enumerate() {
            let v = column(&c.name).map_or(r.time[i], |ch| y[ch.index()][i]);
            if k > 0 {
                s.push(',');
            }
            s += &format!("{:e}", v / c.to_si);
        }
        s.push('\n');
    }
    s
}

fn predictions(c: &Campaign, h: &HeldOut, dir: &Path) -> std::io::Result<()> {
    for (r, y) in c.recordings.iter().zip(&h.readings) {
        files::write(&dir.join(&r.file), csv(r, y).as_bytes())?;
    }
    Ok(())
}

/// The sentence that sums a verdict up.
pub fn sentence(o: &Outcome) -> String {
    let v = &o.verdict;
    let gain = match (&o.before, &o.after) {
        (b, Some(a)) => format!(" Held-out misfit falls from {:.4} to {:.4} of range.", b.nrmse, a.nrmse),
        _ => String::new(),
    };
    let names: Vec<String> = v["missing"]
        .as_array()
        .map(|m| {
            m.iter()
                .map(|m| {
                    let others: Vec<&str> = m["also_possible"]
                        .as_array()
                        .map(|a| a.iter().filter_map(|x| x.as_str()).collect())
                        .unwrap_or_default();
                    let name = m["mechanism"].as_str().unwrap_or("");
                    if others.is_empty() {
                        name.to_string()
                    } else {
                        format!("{name} (not to be told from {} by these recordings)", others.join(", "))
                    }
                })
                .collect()
        })
        .unwrap_or_default();
    let unexplained = v["unexplained"]["detected"].as_bool() == Some(true);
    if v["mismatch"]["detected"].as_bool() != Some(true) {
        "Nothing is missing beyond noise, tolerances and repeat scatter.".into()
    } else if names.is_empty() {
        format!(
            "Something is missing that no mechanism known explains: {}.{gain}",
            v["unexplained"]["text"].as_str().unwrap_or("")
        )
    } else {
        let more = if unexplained { " Beyond that a misfit stays unexplained." } else { "" };
        format!("The simulation leaves out {}.{gain}{more}", names.join(" and "))
    }
}

fn report(c: &Campaign, o: &Outcome) -> String {
    let v = &o.verdict;
    let mut page = Page::new(&format!("Diagnosis of {}", c.name)).sentence(&sentence(o));
    for m in v["missing"].as_array().into_iter().flatten() {
        page = page
            .section(m["mechanism"].as_str().unwrap_or(""))
            .paragraph(m["text"].as_str().unwrap_or(""))
            .paragraph(&format!("{} ({})", m["equation"].as_str().unwrap_or(""), m["source"].as_str().unwrap_or("")));
        let rows: Vec<Vec<String>> = m["parameters"]
            .as_object()
            .into_iter()
            .flatten()
            .map(|(k, p)| {
                let ci = &p["ci95"];
                vec![
                    k.clone(),
                    format!("{:.4e} {}", p["value"].as_f64().unwrap_or(f64::NAN), p["unit"].as_str().unwrap_or("")),
                    format!("{:.4e} to {:.4e}", ci[0].as_f64().unwrap_or(f64::NAN), ci[1].as_f64().unwrap_or(f64::NAN)),
                ]
            })
            .collect();
        page = page.table(&["parameter", "value", "95 % interval"], &rows);
    }
    let bias = &v["fit"]["base_bias"];
    page = page.section("What the calibrated simulation had absorbed").paragraph(&format!(
        "Without the missing physics the fitted force at the reference depth was off by a factor of {:.4}, the exponent by {:+.4}.",
        bias["ln_force_at_reference_depth"].as_f64().unwrap_or(0.0).exp(),
        bias["exponent"].as_f64().unwrap_or(0.0)
    ));
    page = page.section("Where it sits");
    let places: Vec<Vec<String>> = v["mismatch"]["where"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|w| {
            ["origin", "phase", "channel"]
                .iter()
                .map(|k| w[k].as_str().unwrap_or("").to_string())
                .chain([format!("{:.2}", w["share"].as_f64().unwrap_or(0.0))])
                .collect()
        })
        .collect();
    page = page.table(
        &["part of the system", "phase in which it acts", "channel that shows it", "share of its action there"],
        &places,
    );
    page = page.section("Recordings predicted without their own level");
    let mut shown = Vec::new();
    for (i, r) in c.recordings.iter().enumerate() {
        if shown.contains(&r.level) {
            continue;
        }
        shown.push(r.level);
        for ch in Channel::ALL {
            let Some(y) = &r.channels[ch.index()] else { continue };
            let unit = match ch {
                Channel::Force => "N",
                Channel::Acceleration => "m/s^2",
                Channel::Penetration => "m",
            };
            let mut chart =
                Chart::new(&format!("{} {}", r.file, ch.name()), "time [s]", &format!("{} [{unit}]", ch.name()))
                    .series("measured", &r.time, y, Style::Measured)
                    .series("before", &r.time, &o.before.readings[i][ch.index()], Style::Before);
            if let Some(a) = &o.after {
                chart = chart.series("after", &r.time, &a.readings[i][ch.index()], Style::After);
            }
            page = page.figure(&chart.svg(), "");
        }
    }
    let rows: Vec<Vec<String>> =
        o.candidates.iter().take(12).map(|(n, g)| vec![n.clone(), format!("{g:.1}")]).collect();
    page.section("Candidates").table(&["mechanism (form)", "fall in chi^2 against the base"], &rows).html()
}

/// Writes everything to `dir`; verdict.json last, so that its presence says the rest is there.
///
/// # Errors
/// As the file system gives them.
pub fn write(c: &Campaign, o: &Outcome, dir: &Path) -> std::io::Result<()> {
    predictions(c, &o.before, &dir.join("predictions/before"))?;
    predictions(c, o.after.as_ref().unwrap_or(&o.before), &dir.join("predictions/after"))?;
    files::write(&dir.join("report.html"), report(c, o).as_bytes())?;
    let mut text = serde_json::to_string_pretty(&o.verdict).unwrap_or_default();
    text.push('\n');
    files::write(&dir.join("verdict.json"), text.as_bytes())
}
