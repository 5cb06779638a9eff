//! The verdict: what verdict.json holds, in the format verdict/1 and with keys beyond it.

use crate::decide::Decision;
use crate::element::Packed;
use crate::evidence::{self, Evidences};
use crate::experiment;
use crate::findings::Findings;
use crate::heldout::HeldOut;
use crate::map;
use crate::material::{Effect, Remainder};
use crate::phases::{phases, shares, PHASES};
use crate::rivals::Rival;
use crate::sensors::{Against, Mean, Reading};
use crate::unclipped;
use mechanisms::mechanism::Origin;
use record::{Campaign, Channel};
use serde::Serialize;
use std::collections::BTreeMap;

/// The format's name.
const FORMAT: &str = "verdict/1";

/// What a diagnosis says, built once from the decision and the findings. Plain SI; in JSON what is not finite is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// `verdict/1`.
    pub format: &'static str,
    /// The campaign's folder.
    pub campaign: String,
    /// Why nothing can be judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<Text>,
    pub mismatch: Mismatch,
    /// Mechanisms named, in the order they were found.
    pub missing: Vec<Missing>,
    pub unexplained: Unexplained,
    pub fit: FitQuality,
    /// Every mechanism alone, best first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidates: Option<Vec<CandidateScore>>,
    /// Misfit over noise by level, phase and channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<Vec<Cell>>,
    /// What a reader has to know before believing the rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caveats: Option<Vec<String>>,
    /// The experiment that parts collinear names best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<Experiment>,
    /// The clipped channel's peaks without the clip, by recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_clipping: Option<Vec<Unclipped>>,
    /// This campaign's sensors against others that read the same impacts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub other_sensors: Vec<OtherSensor>,
    /// Where the unexplained force enters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latent_force: Option<LatentForce>,
    /// What became of the contact element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element: Option<Element>,
    /// Probability of every cause weighed, the most probable first: of names, of none, or of "unknown".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub posterior: Vec<Cause>,
    /// The fewest of them that hold the cause with 95 %.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub credible_set: Vec<Names>,
    /// What each name does to the figures a campaign is judged by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<BTreeMap<&'static str, Effect>>,
    /// What is left that no mechanism named explains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remainder: Option<Remainder>,
    /// The evidence of every structure weighed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
}

/// A set of names with its probability; none: nothing is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    pub mechanisms: Vec<&'static str>,
    pub probability: f64,
}

/// A set of names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Names {
    pub mechanisms: Vec<&'static str>,
}

/// What the posterior is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// Sizes of the discrepancy that all recordings share, and of what each may have of its own, share of force.
    pub sizes: Vec<f64>,
    pub own_sizes: Vec<f64>,
    /// Levels of the campaign.
    pub levels: usize,
    pub structures: Vec<WeighedStructure>,
    /// A cause outside the vocabulary, beside a structure.
    pub unknown: Vec<WeighedUnknown>,
}

/// One structure's evidence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighedStructure {
    pub mechanisms: Vec<&'static str>,
    pub forms: Vec<&'static str>,
    pub named: bool,
    pub parameters: usize,
    pub chi2: f64,
    /// ln of the evidence by size of the discrepancy, less what all structures have in common; and the same where the
    /// instruments may drift and hum.
    pub ln_evidence: Vec<Option<f64>>,
    pub ln_evidence_drifting: Vec<Option<f64>>,
    /// Overdispersion of the residual, and of what the likeliest discrepancy leaves of it.
    pub overdispersion: f64,
    pub overdispersion_left: Option<f64>,
    pub at_bound: bool,
    /// Misfit over range on levels not seen, where it was worked out.
    pub heldout_nrmse: Option<f64>,
}

/// The evidence of a cause outside the vocabulary, beside a structure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighedUnknown {
    pub beside: Vec<&'static str>,
    /// Where it enters.
    pub place: String,
    /// ln of the evidence by size of its own, first without a shared discrepancy, then with one.
    pub ln_evidence: Vec<Option<f64>>,
}

fn evidence(e: &Evidences) -> Evidence {
    let finite = |v: &[f64]| v.iter().map(|x| x.is_finite().then_some(*x)).collect();
    let structure = |w: &evidence::Weighed| WeighedStructure {
        mechanisms: w.names.clone(),
        forms: w.forms.clone(),
        named: w.named,
        parameters: w.parameters,
        chi2: w.chi2,
        ln_evidence: finite(&w.ln[0]),
        ln_evidence_drifting: finite(&w.ln[1]),
        overdispersion: w.overdispersion,
        overdispersion_left: w.left.is_finite().then_some(w.left),
        at_bound: w.at_bound,
        heldout_nrmse: w.heldout,
    };
    Evidence {
        sizes: evidence::SIZES.to_vec(),
        own_sizes: evidence::OWN_SIZES.to_vec(),
        levels: e.levels,
        structures: e.structures.iter().map(structure).collect(),
        unknown: e
            .unknown
            .iter()
            .map(|u| WeighedUnknown { beside: u.beside.clone(), place: u.place.words(), ln_evidence: finite(&u.ln) })
            .collect(),
    }
}

/// A text alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Text {
    pub text: String,
}

/// Whether simulation and recordings differ, how sure that is, and where.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mismatch {
    pub detected: bool,
    /// Probability that noise alone looks as bad.
    pub false_alarm_probability: f64,
    /// The place of every effect found.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// Nulls made of the residual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nulls: Option<Nulls>,
    /// Whole campaigns simulated without the effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<Bootstrapped>,
}

/// Nulls made of the residual, and what they came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Nulls {
    pub drawn: usize,
    pub as_bad: usize,
    pub directions: usize,
    pub independent: f64,
    pub chi2_gain: f64,
}

/// Campaigns simulated without the effect, and what they came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bootstrapped {
    pub nulls: usize,
    pub detected: usize,
    pub as_bad: usize,
}

/// Where the cause of an effect sits, and where it acts most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// contact, motion or chain.
    pub origin: &'static str,
    pub phase: &'static str,
    pub channel: &'static str,
    /// Share of the effect's action in that phase, 0 to 1.
    pub share: f64,
    /// Levels that show it.
    pub levels: Vec<f64>,
    /// A recording that shows it, and from when to when, s.
    pub recording: Option<String>,
    pub t_start: Option<f64>,
    pub t_end: Option<f64>,
    pub text: String,
}

/// A mechanism named.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    pub mechanism: &'static str,
    pub form: &'static str,
    pub probability: f64,
    pub parameters: BTreeMap<String, Parameter>,
    pub intervals_by: &'static str,
    /// Names that these recordings cannot part from it.
    pub also_possible: Vec<&'static str>,
    pub text: String,
    pub cure: &'static str,
    pub equation: &'static str,
    pub source: &'static str,
    /// How it may be parted from the names that fit as well.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tie: Option<Tie>,
}

/// A value with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    pub value: f64,
    pub unit: &'static str,
    pub ci95: [f64; 2],
}

/// Names that fit as well, and the experiments that would part them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tie {
    pub set: Vec<&'static str>,
    pub trace_sigmas: f64,
    pub rho: f64,
    pub p_right: f64,
    pub experiments: Vec<Experiment>,
}

/// An experiment and what it promises.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    pub name: &'static str,
    pub text: String,
    pub separation_sigmas: f64,
    pub p_right: f64,
}

/// Whether something stays unexplained, and what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    pub detected: bool,
    pub text: String,
}

/// The fit before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitQuality {
    pub before: Quality,
    pub after: Quality,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_bias: Option<BaseBias>,
    /// Share of the folds that chose the same names without the level they left out, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folds_agree: Option<f64>,
    /// Names that recordings give which are cut so many contact times after the touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<Window>,
}

/// Names that recordings of a certain length give.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Window {
    /// End after the touch, in contact times, 1.
    pub contact_times: f64,
    pub mechanisms: Vec<&'static str>,
}

/// How well one fit does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Misfit over range on levels the fit did not see; None where nothing was predicted.
    pub heldout_nrmse: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chi2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
}

/// How far the simulation's own parameters had been biased.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseBias {
    pub ln_force_at_reference_depth: f64,
    pub exponent: f64,
    pub parameters: Vec<ParameterBias>,
}

/// One parameter without and with the mechanisms found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterBias {
    pub name: &'static str,
    pub unit: String,
    pub before: f64,
    pub after: f64,
    pub percent: f64,
    pub sigmas: f64,
}

/// A mechanism alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateScore {
    pub mechanism: String,
    pub form: String,
    pub origin: &'static str,
    pub chi2_gain: f64,
    pub heldout_nrmse: Option<f64>,
}

/// Misfit over noise of one level, phase and channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    pub level: Option<String>,
    pub phase: &'static str,
    pub channel: &'static str,
    pub before: f64,
    pub after: f64,
}

/// A peak without the clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unclipped {
    pub recording: String,
    pub channel: &'static str,
    pub unit: &'static str,
    pub read: f64,
    pub peak: f64,
    pub ci95: [f64; 2],
    pub clipped: bool,
}

/// The campaign's sensor against one that read the same impacts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherSensor {
    pub campaign: String,
    pub channel: &'static str,
    pub mechanism: Option<&'static str>,
    pub lag: Parameter,
    pub gain: Parameter,
    pub nrmse: BeforeAfter,
    pub recordings: Vec<OtherReading>,
}

/// One recording against the other sensor's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherReading {
    pub recording: String,
    pub lag: f64,
    pub gain: f64,
    pub nrmse: BeforeAfter,
    pub unit: &'static str,
    pub read: f64,
    pub without_limit: f64,
    pub limited: bool,
}

/// A misfit over range, before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    pub before: f64,
    pub after: f64,
}

/// Where the unexplained force enters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatentForce {
    pub origin: &'static str,
    pub phase: &'static str,
    pub unit: &'static str,
    /// Places tried, best first.
    pub places: Vec<LatentPlace>,
}

/// A place where the unexplained force may enter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatentPlace {
    pub what: String,
    pub chi2_gain: f64,
}

/// What became of the contact element: whether it is right as it is, and the FMU's start values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Element {
    pub right: bool,
    pub text: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fmu: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts: Option<BTreeMap<&'static str, StartValue>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predictions_run_through_it: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_difference_over_range: Option<f64>,
}

/// A start value of the FMU.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StartValue {
    pub value: f64,
    pub unit: &'static str,
}

impl Verdict {
    /// The verdict of a campaign.
    pub fn new(
        c: &Campaign,
        d: &Decision,
        f: &Findings,
        before: &HeldOut,
        after: Option<&HeldOut>,
        packed: Option<&Packed>,
    ) -> Verdict {
        let terms = if d.detected { d.chosen.structure.terms() } else { &[] };
        let named = (0..terms.len()).filter(|i| terms[*i].mechanism.named);
        let quality = |nrmse: f64, fitted: &estimate::fitted::Fitted| Quality {
            heldout_nrmse: Some(nrmse),
            chi2: Some(fitted.chi2()),
            converged: Some(fitted.fit.converged),
        };
        Verdict {
            format: FORMAT,
            campaign: c.folder.clone(),
            invalid: None,
            mismatch: mismatch(d, f, (0..terms.len()).map(|i| place(c, d, &f.map, i)).collect()),
            missing: named.map(|i| missing(d, f, i)).collect(),
            unexplained: Unexplained { detected: d.unexplained, text: unexplained(d, f) },
            fit: FitQuality {
                before: quality(before.nrmse, &d.base),
                after: quality(after.map_or(before.nrmse, |a| a.nrmse), &d.chosen),
                base_bias: Some(bias(d, f)),
                folds_agree: d.folds.as_ref().map(|f| f.agreement(&d.chosen.names())),
                windows: d
                    .windows
                    .iter()
                    .map(|(end, names)| Window { contact_times: *end, mechanisms: names.clone() })
                    .collect(),
            },
            candidates: Some(f.rivals.iter().map(candidate).collect()),
            map: Some(f.map.iter().map(|m| cell(c, m)).collect()),
            caveats: Some(f.caveats.clone()),
            experiment: f.ties.iter().flatten().find_map(|t| t.proposals.first()).map(promised),
            without_clipping: f.unclipped.as_ref().map(|(ch, of)| of.iter().map(|u| without_clip(*ch, u)).collect()),
            other_sensors: f.sensors.iter().map(other_sensor).collect(),
            latent_force: f.latent.as_ref().map(|l| LatentForce {
                origin: l.place.origin(),
                phase: PHASES[l.phase],
                unit: l.place.unit(),
                places: l.scores.iter().map(|(p, g)| LatentPlace { what: p.words(), chi2_gain: *g }).collect(),
            }),
            element: Some(element(d, f, packed)),
            posterior: d
                .posterior
                .causes
                .iter()
                .map(|c| Cause { mechanisms: c.names.clone(), probability: c.probability })
                .collect(),
            credible_set: d.posterior.credible_set().iter().map(|c| Names { mechanisms: c.names.clone() }).collect(),
            material: Some(d.chosen.names().into_iter().zip(f.material.iter().copied()).collect()),
            remainder: Some(f.remainder.clone()),
            evidence: Some(evidence(&d.evidence)),
        }
    }

    /// The verdict where nothing can be judged, for `reason`; `before`: misfit over range of the simulation as given, on
    /// levels its fit did not see.
    pub fn invalid(c: &Campaign, reason: &str, before: Option<f64>) -> Verdict {
        let quality = Quality { heldout_nrmse: before, chi2: None, converged: None };
        Verdict {
            format: FORMAT,
            campaign: c.folder.clone(),
            invalid: Some(Text { text: reason.into() }),
            mismatch: Mismatch {
                detected: false,
                false_alarm_probability: 1.0,
                places: Vec::new(),
                nulls: None,
                bootstrap: None,
            },
            missing: Vec::new(),
            unexplained: Unexplained { detected: false, text: String::new() },
            fit: FitQuality {
                before: quality,
                after: quality,
                base_bias: None,
                folds_agree: None,
                windows: Vec::new(),
            },
            candidates: None,
            map: None,
            caveats: None,
            experiment: None,
            without_clipping: None,
            other_sensors: Vec::new(),
            latent_force: None,
            element: None,
            posterior: Vec::new(),
            credible_set: Vec::new(),
            material: None,
            remainder: None,
            evidence: None,
        }
    }

    /// verdict.json: keys in alphabetical order.
    ///
    /// # Errors
    /// Where a value has no form in JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(&serde_json::to_value(self)?)? + "\n")
    }
}

fn mismatch(d: &Decision, f: &Findings, places: Vec<Place>) -> Mismatch {
    let by_nulls = f.alarm.as_ref().map_or(d.false_alarm_probability, |a| a.probability);
    Mismatch {
        detected: d.detected,
        false_alarm_probability: f.bootstrap.map_or(by_nulls, |b| b.probability()),
        places,
        nulls: f.alarm.as_ref().map(|a| Nulls {
            drawn: a.nulls,
            as_bad: a.as_bad,
            directions: a.directions,
            independent: a.independent,
            chi2_gain: a.gain,
        }),
        bootstrap: f.bootstrap.map(|b| Bootstrapped { nulls: b.nulls, detected: b.detected, as_bad: b.as_bad }),
    }
}

/// Term `i` of what was chosen, as a name.
fn missing(d: &Decision, f: &Findings, i: usize) -> Missing {
    let t = &d.chosen.structure.terms()[i];
    let intervals = f.intervals.get(i);
    let parameters = intervals.iter().flat_map(|v| &v.of);
    let profiled = intervals.is_some_and(|v| v.profiled);
    Missing {
        mechanism: t.mechanism.name,
        form: t.form.label,
        probability: probability(d, i),
        parameters: parameters
            .map(|p| (p.name.to_string(), Parameter { value: p.value, unit: p.unit, ci95: [p.low, p.high] }))
            .collect(),
        intervals_by: if profiled { "profile likelihood" } else { "covariance" },
        also_possible: d.ties.get(i).cloned().unwrap_or_default(),
        text: format!("{}. {}", t.mechanism.sentence, t.mechanism.cure),
        cure: t.mechanism.cure,
        equation: t.mechanism.equation,
        source: t.mechanism.source,
        tie: f.ties.get(i).and_then(Option::as_ref).map(|tie| Tie {
            set: tie.set.clone(),
            trace_sigmas: tie.trace,
            rho: tie.rho,
            p_right: tie.p_right,
            experiments: tie.proposals.iter().map(promised).collect(),
        }),
    }
}

fn promised(p: &experiment::Proposal) -> Experiment {
    Experiment { name: p.name, text: p.text.clone(), separation_sigmas: p.sigmas, p_right: p.p_right }
}

fn candidate(r: &Rival) -> CandidateScore {
    CandidateScore {
        mechanism: r.name.clone(),
        form: r.form.clone(),
        origin: r.origin,
        chi2_gain: r.gain,
        heldout_nrmse: r.heldout,
    }
}

fn cell(c: &Campaign, m: &map::Cell) -> Cell {
    Cell {
        level: c.levels.get(m.level).map(|l| l.1.clone()),
        phase: PHASES[m.phase],
        channel: m.channel.name(),
        before: m.before,
        after: m.after,
    }
}

fn without_clip(channel: Channel, u: &unclipped::Unclipped) -> Unclipped {
    Unclipped {
        recording: u.file.clone(),
        channel: channel.name(),
        unit: channel.unit(),
        read: u.read,
        peak: u.peak,
        ci95: [u.peak - 1.96 * u.sd, u.peak + 1.96 * u.sd],
        clipped: u.clipped,
    }
}

fn other_sensor(a: &Against) -> OtherSensor {
    let mean = |m: &Mean, unit| Parameter { value: m.value, unit, ci95: [m.low, m.high] };
    let (before, after) = a.misfit();
    let reading = |r: &Reading| OtherReading {
        recording: r.file.clone(),
        lag: r.lag,
        gain: r.gain,
        nrmse: BeforeAfter { before: r.before, after: r.after },
        unit: a.channel.unit(),
        read: r.read,
        without_limit: r.expected,
        limited: r.limited,
    };
    OtherSensor {
        campaign: a.other.clone(),
        channel: a.channel.name(),
        mechanism: a.lags().then_some("lowpass_lag"),
        lag: mean(&a.lag, "s"),
        gain: mean(&a.gain, "1"),
        nrmse: BeforeAfter { before, after },
        recordings: a.readings.iter().map(reading).collect(),
    }
}

fn element(d: &Decision, f: &Findings, packed: Option<&Packed>) -> Element {
    let mut parts: Vec<Origin> = Vec::new();
    if d.detected {
        parts.extend(d.chosen.structure.terms().iter().filter(|t| t.mechanism.named).map(|t| t.mechanism.origin));
    }
    let right = !parts.contains(&Origin::Contact) && !d.unexplained;
    let text = if !f.gates.is_empty() {
        "the FMU holds the simulation as given, calibrated; what is named is not in it, for it is not to be relied on"
    } else if d.unexplained {
        "the FMU holds what is known, calibrated; what stays unexplained is not in it"
    } else if !d.detected {
        "the contact element is right: the FMU holds it calibrated to these recordings"
    } else if right {
        "the contact element is right: the FMU holds it calibrated beside what has to be corrected elsewhere"
    } else if parts.iter().all(|p| *p == Origin::Contact) {
        "the FMU holds the mechanism found, switched on and calibrated"
    } else {
        "the FMU holds the contact's share of what was found, switched on and calibrated; correct the rest where it sits"
    };
    let through = packed.and_then(|p| p.through.as_ref());
    Element {
        right,
        text,
        fmu: packed.map(|_| "HysteresisContact.fmu"),
        starts: packed
            .map(|p| p.starts.iter().map(|(n, value, unit)| (*n, StartValue { value: *value, unit })).collect()),
        predictions_run_through_it: packed.map(|_| through.is_some()),
        largest_difference_over_range: through.map(|t| t.difference),
    }
}

/// Probability that term `term`'s mechanism is missing; evenly shared with names that no recordings part from it.
fn probability(d: &Decision, term: usize) -> f64 {
    let t = &d.chosen.structure.terms()[term];
    let held = |n: &&&str| d.ties.get(term).is_some_and(|tie| tie.contains(n));
    let alike = t.mechanism.hints.collinear_with.iter().filter(held).count();
    d.posterior.of(t.name()) / (1 + alike) as f64
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
        None => format!("the residual is overdispersed, {:.1} times white noise", d.overdispersion.1),
    };
    match &f.latent {
        Some(l) => format!("{what}. {}", l.text),
        None => what,
    }
}

fn bias(d: &Decision, f: &Findings) -> BaseBias {
    let (b, a) = (&d.base.fit.point.theta, &d.chosen.fit.point.theta);
    let of = |i: usize| if d.detected { b[i] - a[i] } else { 0.0 };
    let parameter = |b: &crate::bias::Bias| ParameterBias {
        name: b.name,
        unit: b.unit.clone(),
        before: b.before,
        after: b.after,
        percent: b.percent,
        sigmas: b.sigmas,
    };
    BaseBias { ln_force_at_reference_depth: of(0), exponent: of(1), parameters: f.bias.iter().map(parameter).collect() }
}

/// Where the cause of term `i` sits.
fn place(c: &Campaign, d: &Decision, map: &[map::Cell], i: usize) -> Place {
    let t = &d.chosen.structure.terms()[i];
    let shares = shares(&d.chosen, i);
    let strongest = (0..4).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(1);
    let mut by_channel = [0.0; 3];
    let mut by_level = vec![0.0; c.levels.len()];
    for m in map {
        by_channel[m.channel.index()] += m.gain.max(0.0);
        by_level[m.level] += m.gain.max(0.0);
    }
    let channel = (0..3).max_by(|a, b| by_channel[*a].total_cmp(&by_channel[*b])).unwrap_or(0);
    let channel = Channel::ALL[channel].name();
    let most = by_level.iter().cloned().fold(0.0, f64::max);
    let levels = c.levels.iter().zip(&by_level).filter(|(l, g)| l.0.is_finite() && **g >= 0.3 * most);
    let span = span(d, strongest, &by_level);
    let phase = PHASES[strongest];
    Place {
        origin: t.mechanism.origin.name(),
        phase,
        channel,
        share: shares[strongest],
        levels: levels.map(|(l, _)| l.0).collect(),
        recording: span.as_ref().map(|s| s.0.clone()),
        t_start: span.as_ref().map(|s| s.1),
        t_end: span.as_ref().map(|s| s.2),
        text: format!(
            "{} acts most in the {phase} phase and shows most clearly in {channel}",
            if t.mechanism.named { t.mechanism.name } else { "what is missing" },
        ),
    }
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
