//! One campaign from recordings to verdict.

use super::decide::{Decision, PHASES};
use super::heldout::{held_out, HeldOut};
use super::prepare::{prepare, Guess, Invalid};
use super::search::Search;
use crate::model::estimate::{Data, Problem};
use crate::record::{Campaign, Kind};
use serde_json::{json, Value};

/// The outcome for one campaign.
pub struct Outcome {
    pub data: Data,
    pub verdict: Value,
    pub before: HeldOut,
    pub after: Option<HeldOut>,
    /// The law to put into the FMU.
    pub law: hysteresis_contact::law::Parameters,
    /// Candidates with their gain in chi^2, best first.
    pub candidates: Vec<(String, f64)>,
}

/// Wander of the residual from which the noise model is not trusted alone.
const RESTLESS: f64 = 1.5;

/// Prepares a campaign and settles what the base fit has to know first: whether the speed was measured at touch or
/// at the first sample, how far the scatter of an imposed penetration counts, and which samples are spikes.
///
/// # Errors
/// When the recordings cannot be judged at all.
pub fn ready(c: &Campaign) -> Result<(Data, Guess), Invalid> {
    let (mut data, guess) = prepare(c)?;
    // A photo interrupter measures the speed a little before touch. Whether the recordings' first sample or
    // the touch itself is meant shows in the fit: free fall between the two is not free.
    if c.kind == Kind::DropTest && data.records.iter().all(|r| !r.at_first) {
        let at_touch = Search::new(c, &data).base(c, &guess).point.chi2;
        let mut first = data.clone();
        first.records.iter_mut().for_each(|r| r.at_first = true);
        let at_first = Search::new(c, &first).base(c, &guess).point.chi2;
        if at_first < at_touch + 50.0 {
            data = first;
        }
    }
    let start = Search::new(c, &data).base(c, &guess);
    if !start.point.chi2.is_finite() {
        return Err(Invalid(
            "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
        ));
    }
    if c.kind == Kind::Indentation {
        let weights = Search::new(c, &data).effective_weights(&start.point);
        for (r, w) in data.records.iter_mut().zip(weights) {
            r.weight[0] = w;
        }
    }
    let spikes = Search::new(c, &data).spikes(&start.point);
    for (r, ch, k) in spikes {
        data.records[r].weight[ch][k] = 0.0;
    }
    Ok((data, guess))
}

/// Diagnoses a campaign.
///
/// # Errors
/// When the recordings cannot be judged at all.
pub fn diagnose(c: &Campaign) -> Result<Outcome, Invalid> {
    let (data, guess) = ready(c)?;
    let search = Search::new(c, &data);
    let base = search.base(c, &guess);
    let mut decision = search.decide(base);
    let before = held_out(&search, &decision.base);
    let mut after = if decision.detected && !decision.chosen.make_up.terms.is_empty() {
        Some(held_out(&search, &decision.chosen))
    } else {
        None
    };
    // where the noise wanders more than its model knows, only what predicts levels not seen better is believed
    if let Some(a) = &after {
        if c.levels.len() > 1 && decision.wander.1 > RESTLESS && a.nrmse > before.nrmse {
            decision.detected = false;
            decision.unexplained = false;
            decision.chosen = decision.base.clone();
            decision.ties.clear();
            after = None;
        }
    }
    let verdict = verdict(c, &search, &decision, &before, after.as_ref());
    let model = search.model(&decision.chosen.make_up, 1.0, 1.0, 0.0);
    let law = Problem::new(&data, &model).physics(&decision.chosen.fit.point.theta).law;
    let candidates = decision
        .singles
        .iter()
        .map(|s| {
            (
                format!("{} ({})", s.names()[0], s.make_up.terms[0].form.label),
                decision.base.fit.point.chi2 - s.fit.point.chi2,
            )
        })
        .collect();
    drop(model);
    Ok(Outcome { verdict, before, after, law, candidates, data: data.clone() })
}

fn verdict(c: &Campaign, search: &Search<'_>, d: &Decision, before: &HeldOut, after: Option<&HeldOut>) -> Value {
    let model = search.model(&d.chosen.make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(search.data, &model);
    let covariance = if d.detected { problem.covariance(&d.chosen.fit.point) } else { None };
    let mut at = search.first_term(&model, &d.chosen.make_up);
    let theta = &d.chosen.fit.point.theta;
    let mut missing = Vec::new();
    let mut places = Vec::new();
    if d.detected {
        for (i, t) in d.chosen.make_up.terms.iter().enumerate() {
            let n = t.form.parameters.len();
            let values = &theta[at..at + n];
            let described = (t.form.describe)(values, &search.context);
            // intervals by carrying each parameter's own deviation through the description
            let mut parameters = serde_json::Map::new();
            let mut low: Vec<f64> = described.iter().map(|d| d.1).collect();
            let mut high = low.clone();
            if let Some(cov) = &covariance {
                let mut var = vec![0.0; described.len()];
                for j in 0..n {
                    let sd = cov[(at + j, at + j)].max(0.0).sqrt() * d.wander.1.max(1.0).sqrt();
                    let mut v = values.to_vec();
                    v[j] += sd;
                    for (s, q) in var.iter_mut().zip((t.form.describe)(&v, &search.context).iter().zip(&described)) {
                        *s += (q.0 .1 - q.1 .1).powi(2);
                    }
                }
                for (k, s) in var.iter().enumerate() {
                    low[k] -= 1.96 * s.sqrt();
                    high[k] += 1.96 * s.sqrt();
                }
            }
            for (k, (name, value, unit)) in described.iter().enumerate() {
                parameters.insert(name.to_string(), json!({"value": value, "unit": unit, "ci95": [low[k], high[k]]}));
            }
            let acts = search.acts(&d.chosen, i);
            let strongest = (0..4).max_by(|a, b| acts[*a].total_cmp(&acts[*b])).unwrap_or(1);
            places.push(json!({
                "origin": t.mechanism.origin.name(),
                "phase": PHASES[strongest],
                "channel": channel_of(search, d, i),
                "share": acts[strongest],
                "levels": c.levels.iter().map(|l| l.0).filter(|v| v.is_finite()).collect::<Vec<_>>(),
                "text": format!("{} acts most in the {} phase", t.mechanism.name, PHASES[strongest]),
            }));
            if t.mechanism.named {
                let others = d.ties.get(i).cloned().unwrap_or_default();
                missing.push(json!({
                    "mechanism": t.mechanism.name,
                    "form": t.form.label,
                    "probability": 1.0 / (1.0 + others.len() as f64),
                    "parameters": parameters,
                    "also_possible": others,
                    "text": format!("{}. {}", t.mechanism.sentence, t.mechanism.cure),
                    "equation": t.mechanism.equation,
                    "source": t.mechanism.source,
                }));
            }
            at += n;
        }
    }
    let text = if d.unexplained {
        match d.chosen.make_up.terms.first() {
            Some(t) if !t.mechanism.named => {
                format!("{} (a stand-in, fitted as: {})", t.mechanism.sentence, t.form.label)
            }
            _ => format!("the residual still wanders {:.1} times more than noise", d.wander.1),
        }
    } else {
        String::new()
    };
    let b = &d.base.fit.point.theta;
    let a = &d.chosen.fit.point.theta;
    let bias = |i: usize| if d.detected { b[i] - a[i] } else { 0.0 };
    json!({
        "format": "verdict/1",
        "campaign": c.folder,
        "mismatch": {"detected": d.detected, "false_alarm_probability": d.false_alarm_probability, "where": places},
        "missing": missing,
        "unexplained": {"detected": d.unexplained, "text": text},
        "fit": {
            "before": {"heldout_nrmse": before.nrmse, "chi2": d.base.fit.point.chi2, "converged": d.base.fit.converged},
            "after": {"heldout_nrmse": after.map_or(before.nrmse, |a| a.nrmse), "chi2": d.chosen.fit.point.chi2, "converged": d.chosen.fit.converged},
            "base_bias": {"ln_force_at_reference_depth": bias(0), "exponent": bias(1)},
        },
    })
}

/// The channel in which removing the term raises the misfit most.
fn channel_of(search: &Search<'_>, d: &Decision, _term: usize) -> &'static str {
    let base = search.model(&d.base.make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(search.data, &base);
    let Some(l) = problem.linearise(&d.base.fit.point) else { return "force" };
    let mut sum = [0.0; 3];
    for (r, b) in l.blocks.iter().enumerate() {
        let n = search.data.records[r].setup.time.len();
        for (k, ch) in search.data.compared(r).enumerate() {
            sum[ch.index()] += b.residual[k * n..(k + 1) * n].iter().map(|x| x * x).sum::<f64>() / n as f64;
        }
    }
    let best = (0..3).max_by(|a, b| sum[*a].total_cmp(&sum[*b])).unwrap_or(0);
    crate::record::Channel::ALL[best].name()
}
