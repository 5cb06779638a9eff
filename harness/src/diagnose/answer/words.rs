//! The answer in words: one sentence, and a short text for the terminal.

use crate::diagnose::element::Packed;
use crate::diagnose::run::Outcome;
use serde_json::Value;

/// A number with as many digits as a reader wants, and its unit.
pub fn figure(v: f64, unit: &str) -> String {
    let a = v.abs();
    let s = if a == 0.0 {
        "0".into()
    } else if (1e-2..1e4).contains(&a) {
        let digits = (3 - a.log10().floor() as i32).clamp(0, 5) as usize;
        format!("{v:.digits$}")
    } else {
        format!("{v:.3e}")
    };
    if unit.is_empty() || unit == "1" {
        s
    } else {
        format!("{s} {unit}")
    }
}

fn items(v: &Value) -> impl Iterator<Item = &Value> {
    v.as_array().into_iter().flatten()
}

fn text(v: &Value) -> &str {
    v.as_str().unwrap_or("")
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or(f64::NAN)
}

/// The sentence that sums a verdict up.
pub fn sentence(o: &Outcome) -> String {
    let v = &o.verdict;
    if let Some(why) = &o.invalid {
        return format!("Nothing can be judged: {why}.");
    }
    let gain = match (&o.before, &o.after) {
        (b, Some(a)) => format!(
            " On levels the fit did not see the misfit goes from {:.2} % to {:.2} % of range.",
            100.0 * b.nrmse,
            100.0 * a.nrmse
        ),
        _ => String::new(),
    };
    let names: Vec<String> = items(&v["missing"])
        .map(|m| {
            let others: Vec<&str> = items(&m["also_possible"]).map(text).collect();
            let name = text(&m["mechanism"]);
            if others.is_empty() {
                name.to_string()
            } else {
                format!("{name} (not to be told from {} by these recordings)", others.join(", "))
            }
        })
        .collect();
    let unexplained = v["unexplained"]["detected"].as_bool() == Some(true);
    if v["mismatch"]["detected"].as_bool() != Some(true) {
        "Nothing is missing beyond noise, tolerances and repeat scatter.".into()
    } else if names.is_empty() {
        let what = text(&v["unexplained"]["text"]);
        format!("Something is missing that no mechanism known explains: {}.{gain}", what.trim_end_matches('.'))
    } else {
        let more = if unexplained { " Beyond that a misfit stays unexplained." } else { "" };
        format!("The simulation leaves out {}.{gain}{more}", names.join(" and "))
    }
}

/// Parameters of a mechanism, one text each: name, value, interval.
pub fn parameters(m: &Value) -> Vec<(String, String, String)> {
    m["parameters"]
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, p)| {
            let (unit, ci) = (text(&p["unit"]), &p["ci95"]);
            (
                name.clone(),
                figure(number(&p["value"]), unit),
                format!("{} to {}", figure(number(&ci[0]), ""), figure(number(&ci[1]), unit)),
            )
        })
        .collect()
}

/// How far the base had been biased, one text each; only what moved by more than two standard deviations.
pub fn bias(o: &Outcome) -> Vec<String> {
    o.findings
        .bias
        .iter()
        .filter(|b| b.sigmas.abs() > 2.0)
        .map(|b| {
            let by = if b.percent.is_finite() {
                format!("{:+.2} %", b.percent)
            } else {
                figure(b.before - b.after, &b.unit)
            };
            format!("{} {by} ({:.0} sigma)", b.name, b.sigmas.abs())
        })
        .collect()
}

/// What the packed element holds, and how it did.
pub fn through(o: &Outcome, p: &Packed) -> String {
    let what = text(&o.verdict["element"]["text"]);
    match &p.through {
        Some(t) => format!(
            "{what}; the recordings run through it give the predictions after (within {:.0e} of range of the \
             diagnosis' own simulation)",
            t.difference.max(1e-9)
        ),
        None => what.into(),
    }
}

/// A few lines for the terminal: the sentence first.
pub fn summary(o: &Outcome) -> String {
    let v = &o.verdict;
    let mut s = format!("{}: {}\n", text(&v["campaign"]), sentence(o));
    for (m, w) in items(&v["missing"]).zip(items(&v["mismatch"]["where"])) {
        let list: Vec<String> = parameters(m).into_iter().map(|(n, v, ci)| format!("{n} {v} (95 %: {ci})")).collect();
        s += &format!("  {}, {}: {}\n", text(&m["mechanism"]), text(&m["form"]), list.join(", "));
        s += &format!(
            "    sits in {}, acts most in {}, shows most in {}. {}\n",
            text(&w["origin"]),
            text(&w["phase"]),
            text(&w["channel"]),
            text(&m["text"]).split_once(". ").map_or("", |t| t.1)
        );
        if m["tie"].is_object() {
            s += &format!(
                "    P(right) = {:.2} against {}\n",
                number(&m["tie"]["p_right"]),
                items(&m["also_possible"]).map(text).collect::<Vec<_>>().join(", ")
            );
        }
    }
    let e = &v["experiment"];
    if e.is_object() {
        s += &format!(
            "  experiment: {} ({:.1} sigma apart, P(right) then {:.2})\n",
            text(&e["text"]),
            number(&e["separation_sigmas"]),
            number(&e["p_right"])
        );
    }
    let moved = bias(o);
    if !moved.is_empty() {
        s += &format!("  the calibration had been off: {}\n", moved.join(", "));
    }
    for u in items(&v["without_clipping"]).filter(|u| u["clipped"] == true) {
        s += &format!(
            "  {}: read {}, peak before the clip {} (95 %: {} to {})\n",
            text(&u["recording"]),
            figure(number(&u["read"]), ""),
            figure(number(&u["peak"]), ""),
            figure(number(&u["ci95"][0]), ""),
            figure(number(&u["ci95"][1]), "")
        );
    }
    if let Ok(p) = &o.element {
        s += &format!("  HysteresisContact.fmu: {}\n", through(o, p));
    }
    if let Some(b) = &o.findings.bootstrap {
        s += &format!(
            "  false alarm: {} of {} nulls looked as bad; probability at most {:.3}\n",
            b.as_bad,
            b.nulls,
            b.probability()
        );
    }
    for c in &o.findings.caveats {
        s += &format!("  note: {c}\n");
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short_and_carry_their_unit() {
        assert_eq!(figure(0.80123, "N"), "0.8012 N");
        assert_eq!(figure(1234.6, "N"), "1235 N");
        assert_eq!(figure(2.1e-7, "m"), "2.100e-7 m");
        assert_eq!(figure(0.0, "1"), "0");
    }
}
