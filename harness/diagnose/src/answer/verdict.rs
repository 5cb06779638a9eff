//! verdict.json: the format verdict/1, and keys beyond it.

use super::findings::Findings;
use crate::acts::{phases, shares, PHASES};
use crate::candidate::Candidate;
use crate::decide::Decision;
use crate::element::Packed;
use crate::heldout::HeldOut;
use crate::map::Cell;
use crate::sensors::{Against, Mean};
use mechanisms::mechanism::Origin;
use record::{Campaign, Channel};
use serde_json::{json, Map, Value};

/// Makes the verdict of a campaign.
pub fn verdict(c: &Campaign, d: &Decision, f: &Findings, before: &HeldOut, after: Option<&HeldOut>) -> Value {
    let mut missing = Vec::new();
    let mut places = Vec::new();
    if d.detected {
        for (i, t) in d.chosen.structure.terms().iter().enumerate() {
            places.push(place(c, d, &f.map, i));
            if t.mechanism.named {
                let others = d.ties.get(i).cloned().unwrap_or_default();
                let mut m = json!({
                    "mechanism": t.mechanism.name,
                    "form": t.form.label,
                    "probability": probability(d, i),
                    "parameters": parameters(f, i),
                    "intervals_by": if f.intervals.get(i).is_some_and(|v| v.profiled) { "profile likelihood" } else { "covariance" },
                    "also_possible": others,
                    "text": format!("{}. {}", t.mechanism.sentence, t.mechanism.cure),
                    "cure": t.mechanism.cure,
                    "equation": t.mechanism.equation,
                    "source": t.mechanism.source,
                });
                if let Some(Some(tie)) = f.ties.get(i) {
                    m["tie"] = json!({
                        "set": tie.set, "trace_sigmas": tie.trace, "rho": tie.rho, "p_right": tie.p_right,
                        "experiments": tie.proposals.iter().map(|p| json!({
                            "name": p.name, "text": p.text, "separation_sigmas": p.sigmas, "p_right": p.p_right,
                        })).collect::<Vec<_>>(),
                    });
                }
                missing.push(m);
            }
        }
    }
    let mut v = json!({
        "format": "verdict/1",
        "campaign": c.folder,
        "mismatch": {"detected": d.detected, "false_alarm_probability": d.false_alarm_probability, "where": places},
        "missing": missing,
        "unexplained": {"detected": d.unexplained, "text": unexplained(d, f)},
        "fit": {
            "before": {"heldout_nrmse": before.nrmse, "chi2": d.base.fit.point.chi2, "converged": d.base.fit.converged},
            "after": {"heldout_nrmse": after.map_or(before.nrmse, |a| a.nrmse), "chi2": d.chosen.fit.point.chi2, "converged": d.chosen.fit.converged},
            "base_bias": bias(d, f),
        },
        "candidates": f.rivals.iter().map(|r| json!({
            "mechanism": r.name, "form": r.form, "origin": r.origin, "chi2_gain": r.gain, "heldout_nrmse": r.heldout,
        })).collect::<Vec<_>>(),
        "map": f.map.iter().map(|m| json!({
            "level": c.levels.get(m.level).map(|l| l.1.clone()), "phase": PHASES[m.phase], "channel": m.channel.name(),
            "before": m.before, "after": m.after,
        })).collect::<Vec<_>>(),
        "caveats": f.caveats,
    });
    if let Some(a) = &f.alarm {
        v["mismatch"]["false_alarm_probability"] = json!(a.probability);
        v["mismatch"]["nulls"] = json!({"drawn": a.nulls, "as_bad": a.as_bad, "directions": a.directions,
            "independent": a.independent, "chi2_gain": a.gain});
    }
    if let Some(b) = &f.bootstrap {
        v["mismatch"]["false_alarm_probability"] = json!(b.probability());
        v["mismatch"]["bootstrap"] = json!({"nulls": b.nulls, "detected": b.detected, "as_bad": b.as_bad});
    }
    if let Some(e) = f.ties.iter().flatten().find_map(|t| t.proposals.first()) {
        v["experiment"] = json!({"name": e.name, "text": e.text, "separation_sigmas": e.sigmas, "p_right": e.p_right});
    }
    if let Some((channel, list)) = &f.unclipped {
        v["without_clipping"] = list
            .iter()
            .map(|u| {
                json!({"recording": u.file, "channel": channel.name(), "unit": unit(*channel), "read": u.read, "peak": u.peak,
                    "ci95": [u.peak - 1.96 * u.sd, u.peak + 1.96 * u.sd], "clipped": u.clipped})
            })
            .collect();
    }
    if !f.sensors.is_empty() {
        v["other_sensors"] = f.sensors.iter().map(other_sensor).collect();
    }
    if let Some(l) = &f.latent {
        v["latent_force"] = json!({"origin": l.place.origin(), "phase": PHASES[l.phase], "unit": l.place.unit(),
            "places": l.scores.iter().map(|(p, g)| json!({"what": p.words(), "chi2_gain": g})).collect::<Vec<_>>()});
    }
    v
}

/// The campaign's sensor against one that read the same impacts.
fn other_sensor(a: &Against) -> Value {
    let mean = |m: &Mean, unit: &str| json!({"value": m.value, "unit": unit, "ci95": [m.low, m.high]});
    let (before, after) = a.misfit();
    json!({
        "campaign": a.other,
        "channel": a.channel.name(),
        "mechanism": a.lags().then_some("lowpass_lag"),
        "lag": mean(&a.lag, "s"),
        "gain": mean(&a.gain, "1"),
        "nrmse": {"before": before, "after": after},
        "recordings": a.readings.iter().map(|r| json!({"recording": r.file, "lag": r.lag, "gain": r.gain,
            "nrmse": {"before": r.before, "after": r.after}, "unit": unit(a.channel), "read": r.read,
            "without_limit": r.expected, "limited": r.limited})).collect::<Vec<_>>(),
    })
}

/// What became of the contact element: whether it is right as it is, and the FMU's start values.
pub fn element(d: &Decision, packed: Option<&Packed>) -> Value {
    let mut parts: Vec<Origin> = Vec::new();
    if d.detected {
        parts.extend(d.chosen.structure.terms().iter().filter(|t| t.mechanism.named).map(|t| t.mechanism.origin));
    }
    let right = !parts.contains(&Origin::Contact) && !d.unexplained;
    let text = if d.unexplained {
        "the FMU holds what is known; the force that stays unexplained is not in it"
    } else if !d.detected {
        "the contact element is right: the FMU holds it calibrated to these recordings"
    } else if right {
        "the contact element is right: the FMU holds it calibrated beside what has to be corrected elsewhere"
    } else if parts.iter().all(|p| *p == Origin::Contact) {
        "the FMU holds the mechanism found, switched on and calibrated"
    } else {
        "the FMU holds the contact's share of what was found, switched on and calibrated; correct the rest where it sits"
    };
    let mut v = json!({"right": right, "text": text});
    if let Some(p) = packed {
        let starts = p.starts.iter().map(|(n, x, u)| (n.to_string(), json!({"value": x, "unit": u})));
        v["fmu"] = json!("HysteresisContact.fmu");
        v["starts"] = Value::Object(starts.collect());
        v["predictions_run_through_it"] = json!(p.through.is_some());
        if let Some(t) = &p.through {
            v["largest_difference_over_range"] = json!(t.difference);
        }
    }
    v
}

/// The verdict where nothing can be judged.
pub fn invalid(c: &Campaign, reason: &str, before: Option<f64>) -> Value {
    json!({
        "format": "verdict/1",
        "campaign": c.folder,
        "invalid": {"text": reason},
        "mismatch": {"detected": false, "false_alarm_probability": 1.0, "where": []},
        "missing": [],
        "unexplained": {"detected": false, "text": ""},
        "fit": {"before": {"heldout_nrmse": before}, "after": {"heldout_nrmse": before}},
    })
}

/// SI unit of a channel.
pub fn unit(c: Channel) -> &'static str {
    match c {
        Channel::Force => "N",
        Channel::Acceleration => "m/s^2",
        Channel::Penetration => "m",
    }
}

/// Share of belief among names: by cost where the search fitted rivals, evenly among those that never part.
fn probability(d: &Decision, term: usize) -> f64 {
    let others = d.ties.get(term).map_or(0, Vec::len);
    if d.chosen.structure.terms().len() > 1 {
        return 1.0 / (1.0 + others as f64);
    }
    let scale = 2.0 * d.overdispersion.1.max(1.0);
    let name = d.chosen.names()[term];
    let tied = d.ties.get(term).cloned().unwrap_or_default();
    let rest: f64 = d
        .singles
        .iter()
        .filter(|s| s.is_named() && s.names()[0] != name && !tied.contains(&s.names()[0]))
        .map(|s| (-(s.cost() - d.chosen.cost()).max(0.0) / scale).exp())
        .sum();
    1.0 / (1.0 + others as f64 + rest)
}

fn parameters(f: &Findings, term: usize) -> Map<String, Value> {
    f.intervals
        .get(term)
        .iter()
        .flat_map(|i| &i.of)
        .map(|i| (i.name.to_string(), json!({"value": i.value, "unit": i.unit, "ci95": [i.low, i.high]})))
        .collect()
}

fn unexplained(d: &Decision, f: &Findings) -> String {
    if !d.unexplained {
        return String::new();
    }
    if let Some(s) = d.excess_scatter {
        return format!(
            "the contact's stiffness differs by {:.1} % (rms) between recordings of the same level, where repeats scatter \
             by {:.1} %: something between the recordings moved it (temperature, wear, a changed setting)",
            100.0 * s,
            100.0 * d.chosen.data.repeat_scatter
        );
    }
    let what = match d.chosen.structure.terms().iter().find(|t| !t.mechanism.named) {
        Some(t) => format!("{} (a stand-in, fitted as: {})", t.mechanism.sentence, t.form.label),
        None => format!("the residual still wanders {:.1} times more than noise", d.overdispersion.1),
    };
    match &f.latent {
        Some(l) => format!("{what}. {}", l.text),
        None => what,
    }
}

fn bias(d: &Decision, f: &Findings) -> Value {
    let (b, a) = (&d.base.fit.point.theta, &d.chosen.fit.point.theta);
    let of = |i: usize| if d.detected { b[i] - a[i] } else { 0.0 };
    json!({
        "ln_force_at_reference_depth": of(0),
        "exponent": of(1),
        "parameters": f.bias.iter().map(|b| json!({"name": b.name, "unit": b.unit, "before": b.before, "after": b.after,
            "percent": b.percent, "sigmas": b.sigmas})).collect::<Vec<_>>(),
    })
}

/// Where the cause of term `i` sits.
fn place(c: &Campaign, d: &Decision, map: &[Cell], i: usize) -> Value {
    let t = &d.chosen.structure.terms()[i];
    let acts = shares(&d.chosen, i);
    let strongest = (0..4).max_by(|a, b| acts[*a].total_cmp(&acts[*b])).unwrap_or(1);
    let mut by_channel = [0.0; 3];
    let mut by_level = vec![0.0; c.levels.len()];
    for m in map {
        by_channel[m.channel.index()] += m.gain.max(0.0);
        by_level[m.level] += m.gain.max(0.0);
    }
    let channel = (0..3).max_by(|a, b| by_channel[*a].total_cmp(&by_channel[*b])).unwrap_or(0);
    let most = by_level.iter().cloned().fold(0.0, f64::max);
    let levels: Vec<f64> = c
        .levels
        .iter()
        .zip(&by_level)
        .filter(|(l, g)| l.0.is_finite() && **g >= 0.3 * most)
        .map(|(l, _)| l.0)
        .collect();
    let span = span(d, strongest, &by_level);
    json!({
        "origin": t.mechanism.origin.name(),
        "phase": PHASES[strongest],
        "channel": Channel::ALL[channel].name(),
        "share": acts[strongest],
        "levels": levels,
        "recording": span.as_ref().map(|s| s.0.clone()),
        "t_start": span.as_ref().map(|s| s.1),
        "t_end": span.as_ref().map(|s| s.2),
        "text": format!("{} acts most in the {} phase and shows most clearly in {}",
            if t.mechanism.named { t.mechanism.name } else { "what is missing" },
            PHASES[strongest], Channel::ALL[channel].name()),
    })
}

/// (recording, first and last sample time) of a phase's first stretch in the first recording of the level that shows most.
fn span(d: &Decision, which: usize, by_level: &[f64]) -> Option<(String, f64, f64)> {
    let level = (0..by_level.len()).max_by(|a, b| by_level[*a].total_cmp(&by_level[*b]))?;
    let data = &d.chosen.data;
    let r = data.records.iter().position(|r| r.level == level)?;
    let (trace, _) = d.chosen.predict(r);
    let rec = &data.records[r];
    // its first stretch
    let phases = phases(&trace);
    let first = phases.iter().position(|p| *p == which)?;
    let length = phases[first..].iter().take_while(|p| **p == which).count();
    Some((rec.file.clone(), rec.setup.time[first], rec.setup.time[first + length - 1]))
}
