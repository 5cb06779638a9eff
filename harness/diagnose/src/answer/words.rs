//! The answer in words: one sentence, and a short text for the terminal.

use super::verdict::unit;
use crate::bias::Bias;
use crate::element::Packed;
use crate::run::Outcome;
use crate::sensors::{Against, Reading};
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

/// Probability of having named the right one of a tie from which no experiment is asked for.
const SURE: f64 = 0.95;

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
                let p = number(&m["tie"]["p_right"]);
                if p > SURE {
                    format!("{name} (held open: {}, at P(right) = {p:.2})", others.join(", "))
                } else {
                    format!("{name} (not to be told from {} by these recordings)", others.join(", "))
                }
            }
        })
        .collect();
    let unexplained = v["unexplained"]["detected"].as_bool() == Some(true);
    let takes = match &o.findings.latent {
        Some(l) => format!(": it takes {}", l.brief),
        None if unexplained => format!(": {}", text(&v["unexplained"]["text"])),
        None => String::new(),
    };
    if v["mismatch"]["detected"].as_bool() != Some(true) {
        "Nothing is missing beyond noise, tolerances and repeat scatter.".into()
    } else if names.is_empty() {
        format!("Something is missing that no mechanism known explains{takes}.{gain}")
    } else {
        let more = if unexplained { format!(" Beyond that a misfit stays unexplained{takes}.") } else { String::new() };
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

/// How far off a parameter had been: per cent, or a factor where per cent say little.
pub fn share(b: &Bias) -> String {
    if !b.percent.is_finite() {
        figure(b.before - b.after, &b.unit)
    } else if b.percent.abs() > 300.0 && b.before / b.after > 0.0 {
        format!("by a factor of {}", figure(b.before / b.after, ""))
    } else {
        format!("{:+.2} %", b.percent)
    }
}

/// How far the base had been biased, one text each; only what moved by more than two standard deviations.
pub fn bias(o: &Outcome) -> Vec<String> {
    o.findings
        .bias
        .iter()
        .filter(|b| b.sigmas.abs() > 2.0)
        .map(|b| format!("{} {} ({:.0} sigma)", b.name, share(b), b.sigmas.abs()))
        .collect()
}

/// What to do about it, one text each: correct what was named, part what is tied.
pub fn advice(o: &Outcome) -> Vec<String> {
    let v = &o.verdict;
    let mut out: Vec<String> =
        items(&v["missing"]).map(|m| format!("{}: {}", text(&m["mechanism"]), text(&m["cure"]))).collect();
    let e = &v["experiment"];
    let open = items(&v["missing"]).any(|m| number(&m["tie"]["p_right"]) <= SURE);
    if e.is_object() && open {
        let (sigmas, p) = (number(&e["separation_sigmas"]), number(&e["p_right"]));
        let hope = if sigmas < 2.0 { ", which is little: no experiment tried parts them well" } else { "" };
        out.push(format!(
            "experiment that parts the names best: {} ({sigmas:.1} sigma apart{hope}; P(right) then {p:.2})",
            text(&e["text"])
        ));
    }
    out
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

/// What other sensors on the same impacts say of this campaign's, one text each.
pub fn sensors(o: &Outcome) -> Vec<String> {
    let of = |a: &Against| {
        let (before, after) = a.misfit();
        let ms = |s: f64| figure(1e3 * s, "");
        let lag = if a.lags() {
            format!(
                "lags behind by {} ms (95 %: {} to {}; a first-order low-pass, lowpass_lag: the misfit between the two goes \
                 from {:.2} % to {:.2} % of range)",
                ms(a.lag.value),
                ms(a.lag.low),
                ms(a.lag.high),
                100.0 * before,
                100.0 * after
            )
        } else {
            format!("lags behind by nothing that shows (95 %: {} to {} ms)", ms(a.lag.low), ms(a.lag.high))
        };
        let unit = unit(a.channel);
        let beyond = |r: &Reading| format!("{} {}", r.file, figure(r.expected, unit));
        let limited: Vec<String> = a.readings.iter().filter(|r| r.limited).map(beyond).collect();
        let limit = if limited.is_empty() {
            String::new()
        } else {
            format!(" Without its limit it would have read, by the other sensor: {}.", limited.join(", "))
        };
        format!(
            "Beside {}, which read the same impacts, the {} {lag}; its gain is {} of the other's.{limit}",
            a.other,
            a.channel.name(),
            figure(a.gain.value, "")
        )
    };
    o.findings.sensors.iter().map(of).collect()
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
            text(&m["cure"])
        );
        if m["tie"].is_object() {
            s += &format!(
                "    P(right) = {:.2} against {}\n",
                number(&m["tie"]["p_right"]),
                items(&m["also_possible"]).map(text).collect::<Vec<_>>().join(", ")
            );
        }
    }
    for a in advice(o).iter().skip(items(&v["missing"]).count()) {
        s += &format!("  {a}\n");
    }
    let moved = bias(o);
    if !moved.is_empty() {
        s += &format!("  the calibration had been off: {}\n", moved.join(", "));
    }
    for u in items(&v["without_clipping"]).filter(|u| u["clipped"] == true) {
        s += &format!(
            "  {}: read {}, peak before the clip {} (95 %: {} to {})\n",
            text(&u["recording"]),
            figure(number(&u["read"]), text(&u["unit"])),
            figure(number(&u["peak"]), text(&u["unit"])),
            figure(number(&u["ci95"][0]), ""),
            figure(number(&u["ci95"][1]), text(&u["unit"]))
        );
    }
    for t in sensors(o) {
        s += &format!("  {t}\n");
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
