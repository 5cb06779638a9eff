//! A scenario on the terminal.

use super::summary::{ComparisonRow, Done, RunSummary, Summary};
use chart::dashed;

/// Most impacts of a run, and most comparisons, that are printed.
const SHOWN: usize = 5;
/// Most runs that are printed.
const RUNS: usize = 20;

/// The sentence a reader should take away; empty where nothing touched.
pub fn headline(s: &Summary) -> String {
    let all: Vec<(&RunSummary, f64)> =
        s.runs.iter().filter_map(|r| r.impacts.first().map(|b| (r, b.peak_force))).collect();
    let Some((first, _)) = all.first() else { return String::new() };
    let Some(b) = first.impacts.first() else { return String::new() };
    if all.len() == 1 {
        let met = format!(
            "It meets the stop at {:.3} m/s, sinks {:.4} mm under {:.1} N at most",
            b.impact_speed,
            1e3 * b.deepest,
            b.peak_force
        );
        let mut text = match b.separation {
            Some(_) => {
                format!("{met} and leaves with {:.4} of its speed after {:.4} ms.", b.restitution, 1e3 * b.duration)
            }
            None => format!("{met} and has not left it at the end."),
        };
        if first.impacts.len() > 1 {
            let end = if first.at_rest { " until it rests" } else { "" };
            text += &format!(" {} impacts{end}.", first.impacts.len());
        }
        return text;
    }
    let least = all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(&all[0]);
    let most = all.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(&all[0]);
    let name = |r: &RunSummary| if r.name.is_empty() { "the scenario's own".to_string() } else { r.name.clone() };
    format!(
        "{} runs: the largest force of the first impact goes from {:.1} N ({}) to {:.1} N ({}).",
        all.len(),
        least.1,
        name(least.0),
        most.1,
        name(most.0)
    )
}

/// What the terminal gets: a line an impact, sensors, interrupters, the comparison as a table, remarks.
pub fn lines(done: &[Done], s: &Summary) -> Vec<String> {
    let mut out = Vec::new();
    for (r, d) in s.runs.iter().zip(done).take(RUNS) {
        let of = if r.name.is_empty() { String::new() } else { format!("{}: ", r.name) };
        for (i, b) in r.impacts.iter().enumerate().take(SHOWN) {
            let mut line = format!(
                "{of}impact {}: {:.6} m/s, deepest {:.6e} m, peak {:.6e} N, ",
                i + 1,
                b.impact_speed,
                b.deepest,
                b.peak_force
            );
            line += &match b.separation {
                Some(_) => format!("restitution {:.6}, lasts {:.6e} s", b.restitution, b.duration),
                None => "has not left the stop at the end".into(),
            };
            if let Some(h) = b.rebound_height {
                line += &format!(", rebounds {h:.4e} m");
            }
            if let Some(e) = &b.exact {
                line += &format!("; {:.1e} from exact", e.worst());
            }
            out.push(line);
        }
        if r.impacts.len() > SHOWN {
            out.push(format!("{of}{} impacts in all", r.impacts.len()));
        }
        if r.at_rest {
            out.push(format!("{of}at rest after {:.6} s", d.outcome.rows.last().map_or(0.0, |r| r.time)));
        }
        if let Some(p) = &r.sensors {
            for (name, p) in [("transducer", p.transducer), ("accelerometer", p.accelerometer)] {
                let late = if p.delay < 0.0 { "earlier" } else { "later" };
                out.push(format!(
                    "{of}{name} reads {:.4} of the contact's peak ({:.4} if rigid), {:.3} us {late}",
                    p.over_contact,
                    p.over_contact_if_rigid,
                    1e6 * p.delay.abs()
                ));
            }
        }
        if let Some(p) = &r.photo_interrupters {
            if let (Some(v), Some(off)) = (p.recovered, p.difference) {
                out.push(format!("{of}photo interrupters give {:.6} m/s, {off:.1e} from true", v.impact_speed));
            }
        }
    }
    if s.runs.len() > RUNS {
        out.push(format!("{} runs in all: see summary.json", s.runs.len()));
    }
    out.extend(comparison(&s.comparison));
    out.extend(s.remarks.iter().take(SHOWN).map(|r| format!("remark: {r}")));
    out.iter().map(|line| dashed(line)).collect()
}

/// Comparisons as a table whose columns line up.
fn comparison(all: &[ComparisonRow]) -> Vec<String> {
    if all.is_empty() {
        return Vec::new();
    }
    let head =
        ["first impact", "k [N/m^p]", "deepest [mm]", "peak [N]", "lasts [ms]", "peak over own", "if free, undamped"];
    let mut rows = vec![head.map(String::from)];
    rows.extend(all.iter().take(2 * SHOWN).map(|c| {
        [
            c.name.clone(),
            format!("{:.4e}", c.stiffness),
            format!("{:.4}", 1e3 * c.deepest),
            format!("{:.1}", c.peak_force),
            format!("{:.4}", 1e3 * c.duration),
            format!("{:.4}", c.peak_ratio),
            c.free_ratio.map_or("-".into(), |f| format!("{f:.4}")),
        ]
    }));
    let wide: Vec<usize> =
        (0..head.len()).map(|j| rows.iter().map(|r| r[j].chars().count()).max().unwrap_or(0)).collect();
    let line = |r: &[String; 7]| {
        let cells: Vec<String> = r
            .iter()
            .zip(&wide)
            .enumerate()
            .map(|(j, (c, &w))| if j == 0 { format!("{c:<w$}") } else { format!("{c:>w$}") })
            .collect();
        format!("| {} |", cells.join(" | "))
    };
    let mut out: Vec<String> = rows.iter().map(line).collect();
    let rule: Vec<String> = wide
        .iter()
        .enumerate()
        .map(|(j, &w)| if j == 0 { "-".repeat(w + 2) } else { "-".repeat(w + 1) + ":" })
        .collect();
    out.insert(1, format!("|{}|", rule.join("|")));
    out
}
