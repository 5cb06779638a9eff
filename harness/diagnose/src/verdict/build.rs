//! How a verdict is built from the decision and the findings.

use super::*;
use crate::body::OnBody;
use crate::decide::Decision;
use crate::element::Packed;
use crate::evidence::LARGE;
use crate::evidence::{self, Evidences};
use crate::experiment;
use crate::findings::Findings;
use crate::heldout::HeldOut;
use crate::learned::{self, Named, OF_ITS_OWN};
use crate::map;
use crate::misfit::{by_channel, over_noise, OfChannel};
use crate::motion::{misfit, Force};
use crate::next;
use crate::phases::{by_strongest, of_force, phases, shares, strongest, PHASES};
use crate::rivals::Rival;
use crate::sensors::{Against, Mean, Reading};
use crate::unclipped;
use estimate::structure::Term;
use mechanisms::mechanism::Origin;
use record::{Campaign, Channel, Kind};

impl Verdict {
    /// The verdict of a campaign.
    pub fn new(c: &Campaign, d: &Decision, f: &Findings, packed: Option<&Packed>) -> Verdict {
        let terms = by_action(d);
        let named = terms.iter().filter(|(i, _)| d.chosen.structure.terms()[*i].mechanism.named);
        let noises = |h: &HeldOut| over_noise(&by_channel(&d.base.data, &h.predictions, None));
        let is_imposed = c.kind == Kind::Indentation;
        let predicted = |h: &HeldOut| Quality {
            heldout_nrmse: Some(h.nrmse),
            heldout_nrmse_of_force: is_imposed.then(|| h.predictions.misfit_of_compared(&d.base.data)),
            heldout_over_noise: noises(h),
            ..Quality::default()
        };
        let quality = |h: &HeldOut, fitted: &estimate::fitted::Fitted| Quality {
            chi2: Some(fitted.chi2()),
            converged: Some(fitted.fit.converged),
            ..predicted(h)
        };
        let after = d.after.as_ref().unwrap_or(&d.before);
        Verdict {
            format: FORMAT,
            campaign: c.folder.clone(),
            columns: c.columns.clone(),
            invalid: None,
            mismatch: mismatch(d, f, places(c, d, f, &terms)),
            missing: named
                .map(|(i, _)| missing(d, f, *i, packed.is_some()))
                .chain(d.names_by_shape().iter().map(|n| by_shape(f, n)))
                .collect(),
            unexplained: Unexplained { detected: d.unexplained, text: unexplained(d, f) },
            next: next::steps(c, d, f, packed.is_some()),
            fit: FitQuality {
                before: quality(&d.before, &d.base),
                // a law that was learned is no fit of the simulation's parameters
                after: if d.is_learned() { predicted(after) } else { quality(after, d.simulated()) },
                base_bias: Some(bias(d, f)),
                folds_agree: d.folds.as_ref().map(|f| f.agreement(&d.chosen.names())),
                windows: d
                    .windows
                    .iter()
                    .map(|(end, names)| Window { contact_times: *end, mechanisms: names.clone() })
                    .collect(),
                levels: levels(c, d),
            },
            candidates: Some(f.rivals.iter().map(candidate).collect()),
            map: Some(f.map.iter().map(|m| cell(c, m)).collect()),
            caveats: Some(f.caveats.clone()),
            experiment: f.ties.iter().flatten().find_map(|t| t.proposals.first()).map(promised),
            without_clipping: f.unclipped.as_ref().map(|(ch, of)| of.iter().map(|u| without_clip(*ch, u)).collect()),
            other_sensors: f.sensors.iter().map(other_sensor).collect(),
            latent_force: f.latent.as_ref().map(|l| LatentForce {
                origin: l.place.origin(),
                phase: PHASES[strongest(&l.shares)],
                unit: l.place.unit(),
                places: l.scores.iter().map(|(p, g)| LatentPlace { what: p.words(), chi2_gain: *g }).collect(),
            }),
            element: Some(element(d, f, packed)),
            body_force: f.on_body.as_ref().map(body_force),
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
            learned: d.learned.as_ref().map(learned).or_else(|| learned_in_motion(d)),
            trace: None,
        }
    }

    /// The verdict where nothing can be judged, for `reason`; `before`: misfit over range of the simulation as given, on
    /// levels its fit did not see.
    pub fn invalid(c: &Campaign, reason: &str, before: Option<f64>) -> Verdict {
        let quality = Quality { heldout_nrmse: before, ..Quality::default() };
        Verdict {
            format: FORMAT,
            campaign: c.folder.clone(),
            columns: c.columns.clone(),
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
            next: vec![next::PUT_RIGHT.into()],
            fit: FitQuality {
                before: quality,
                after: quality,
                base_bias: None,
                folds_agree: None,
                windows: Vec::new(),
                levels: Vec::new(),
            },
            candidates: None,
            map: None,
            caveats: None,
            experiment: None,
            without_clipping: None,
            other_sensors: Vec::new(),
            latent_force: None,
            element: None,
            body_force: None,
            posterior: Vec::new(),
            credible_set: Vec::new(),
            material: None,
            remainder: None,
            evidence: None,
            learned: None,
            trace: None,
        }
    }
}

/// Every level predicted without itself, before and after.
fn levels(c: &Campaign, d: &Decision) -> Vec<LevelFit> {
    let data = &d.base.data;
    let last = d.after.as_ref().unwrap_or(&d.before);
    let of = |l: usize| {
        let [before, after] = [&d.before, last].map(|h| by_channel(data, &h.predictions, Some(l)));
        let channel = |(b, a): (&OfChannel, &OfChannel)| ChannelFit {
            channel: b.channel.name(),
            unit: b.channel.unit(),
            noise: data.noise[b.channel.index()].marginal(),
            rms: BeforeAfter { before: b.rms, after: a.rms },
            over_noise: BeforeAfter { before: b.over_noise, after: a.over_noise },
        };
        Some(LevelFit {
            level: c.levels.get(l)?.1.clone(),
            recordings: data.records.iter().filter(|r| r.level == l).count(),
            over_noise: BeforeAfter { before: over_noise(&before)?, after: over_noise(&after)? },
            channels: before.iter().zip(&after).map(channel).collect(),
        })
    };
    (0..c.levels.len()).filter_map(of).collect()
}

fn mismatch(d: &Decision, f: &Findings, places: Vec<Place>) -> Mismatch {
    let by_nulls = f.alarm.as_ref().map_or(1.0, |a| a.probability);
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
fn missing(d: &Decision, f: &Findings, i: usize, fmu: bool) -> Missing {
    let t = &d.chosen.structure.terms()[i];
    let intervals = f.intervals.get(i);
    let parameters = intervals.iter().flat_map(|v| &v.of);
    let profiled = intervals.is_some_and(|v| v.profiled);
    let cure = next::cure(t.mechanism, f.gates.is_empty(), fmu);
    Missing {
        mechanism: t.mechanism.name,
        form: t.form.label,
        probability: probability(d, i),
        parameters: parameters
            .map(|p| (p.name.to_string(), Parameter { value: p.value, unit: p.unit, ci95: p.ends(), held: p.held }))
            .collect(),
        intervals_by: if profiled { "profile likelihood" } else { "covariance" },
        also_possible: d.ties.get(i).cloned().unwrap_or_default(),
        text: format!("{}. {cure}", t.mechanism.sentence),
        sentence: t.mechanism.sentence,
        cure,
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

/// A name of what was learned, with no form.
fn by_shape(f: &Findings, n: &Named) -> Missing {
    let m = n.mechanism;
    let cure = if f.gates.is_empty() { n.cure } else { next::NOT_RELIED_ON };
    let size = Parameter { value: n.size.value, unit: n.size.unit, ci95: n.size.ci95, held: false };
    Missing {
        mechanism: m.name,
        form: OF_ITS_OWN,
        probability: n.probability,
        parameters: BTreeMap::from([(n.size.name.to_string(), size)]),
        intervals_by: n.size.by,
        also_possible: n.also_possible.clone(),
        text: format!("{}. {cure}", m.sentence),
        sentence: m.sentence,
        cure,
        equation: m.equation,
        source: m.source,
        tie: None,
    }
}

fn learned(l: &learned::Learned) -> LearnedLaw {
    let class = |c: usize| &learn::ALL[c];
    let words = |c: &[usize]| c.iter().map(|c| class(*c).name).collect();
    LearnedLaw {
        leads: l.leads,
        misfit_elastic: l.of.elastic,
        misfit: l.misfit,
        heldout_nrmse: l.heldout.nrmse.is_finite().then_some(l.heldout.nrmse),
        classes: (0..learn::ALL.len())
            .filter(|c| l.of.of(*c) > SHOWN)
            .map(|c| LearnedClass {
                class: class(c).name,
                mechanism: class(c).mechanism,
                depends_on: class(c).depends.into(),
                probability: l.of.of(c),
            })
            .collect(),
        sets: l
            .of
            .sets
            .iter()
            .filter(|s| s.probability > SHOWN)
            .map(|s| LearnedSet { classes: words(&s.law.classes), probability: s.probability, misfit: s.misfit })
            .collect(),
    }
}

/// The sentence of a form that stands in for a cause without a name, and the form's label.
fn as_stand_in(t: &Term) -> String {
    format!("{} (a stand-in, fitted as: {})", t.mechanism.sentence, t.form.label)
}

/// The forces learned in motion, and the forms that stand in for a cause without a name; None where there are neither.
fn learned_in_motion(d: &Decision) -> Option<LearnedLaw> {
    let best = d.force().or(d.forces.first())?;
    let parts = |f: &Force| -> Vec<LearnedClass> {
        let of =
            |class, mechanism, depends_on| LearnedClass { class, mechanism, depends_on, probability: f.probability };
        let learned = f.depends.iter().map(|d| of(d.name(), None, d.words().into()));
        let beside = f.beside.and_then(mechanisms::named);
        let beside = beside.map(|m| of(m.name, Some(m.name).filter(|_| m.named), m.sentence.into()));
        let stands_in = |t: &Term| of(t.name(), None, format!("as though {}", as_stand_in(t)));
        // nothing learned: what stood in before does
        let instead = f.fitted.structure.terms().iter().filter(|t| f.depends.is_empty() && !t.mechanism.named);
        learned.chain(beside).chain(instead.map(stands_in)).collect()
    };
    let mut classes: Vec<LearnedClass> = Vec::new();
    for part in d.forces.iter().flat_map(parts) {
        match classes.iter_mut().find(|c| c.class == part.class) {
            Some(c) => c.probability += part.probability,
            None => classes.push(part),
        }
    }
    classes.retain(|c| c.probability > SHOWN);
    classes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let possible = d.forces.iter().filter(|f| f.probability > SHOWN).map(|f| (f, parts(f)));
    let possible = possible.filter(|(_, parts)| !parts.is_empty());
    let sets = possible.map(|(f, parts)| LearnedSet {
        classes: parts.iter().map(|c| c.class).collect(),
        probability: f.probability,
        misfit: f.misfit,
    });
    Some(LearnedLaw {
        leads: d.force().is_some(),
        misfit_elastic: misfit(&d.base),
        misfit: best.misfit,
        heldout_nrmse: best.heldout.as_ref().map(|h| h.nrmse),
        classes,
        sets: sets.collect(),
    })
}

/// Probability from which classes and sets of them are listed: one in a hundred. Nothing is decided by it.
const SHOWN: f64 = 0.01;

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
    let mean = |m: &Mean, unit| Parameter { value: m.value, unit, ci95: Some([m.low, m.high]), held: false };
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
        mechanism: a.mechanism(),
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
        parts.extend(d.names_by_shape().iter().map(|n| n.mechanism.origin));
    }
    let right = !parts.contains(&Origin::Contact) && !d.unexplained;
    let right = right && !d.is_learned();
    let text = if d.is_learned() {
        "the FMU holds the simulation as given, calibrated; the shape that was learned is not in it"
    } else if !f.gates.is_empty() {
        "the FMU holds the simulation as given, calibrated; what is named is not in it, for it is not to be relied on"
    } else if f.holds_learned.in_contact && f.holds_learned.on_body {
        "the FMU holds the part of the force that was learned between the faces, beside the law calibrated with it; the part on the body \
         is in BodyForce.fmu, and each is right with the other alone; beyond what was learned they hold on, and beyond_learned says so"
    } else if f.holds_learned.in_contact {
        "the FMU holds the force that was learned, beside the law calibrated with it; deeper or faster than it was learned that force \
         holds on, and beyond_learned says so"
    } else if f.holds_learned.on_body {
        "the FMU holds the contact, calibrated beside the force that was learned, which is in BodyForce.fmu"
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
        text: f.instead.as_ref().map_or(text.into(), |i| format!("no FMU holds the shape that was learned; {i}")),
        fmu: packed.map(|_| "HysteresisContact.fmu"),
        platforms: packed.map_or(Vec::new(), |p| p.platforms().into_iter().map(String::from).collect()),
        starts: packed
            .map(|p| p.starts.iter().map(|(n, value, unit)| (*n, StartValue { value: *value, unit })).collect()),
        predictions_run_through_it: packed.map(|_| through.is_some()),
        largest_difference_over_range: through.map(|t| t.difference),
    }
}

fn body_force(b: &OnBody) -> BodyForce {
    let start = |(name, value, unit): &(&'static str, f64, &'static str)| (*name, StartValue { value: *value, unit });
    BodyForce { fmu: "BodyForce.fmu", mechanisms: b.names.clone(), starts: b.starts.iter().map(start).collect() }
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
             by {:.1} %: something between the recordings moved it (temperature, wear, a changed setting, another place)",
            100.0 * s,
            100.0 * d.chosen.data.repeat_scatter
        );
    }
    if let Some(l) = d.learned.as_ref().filter(|l| l.leads) {
        let beside = if l.names.is_empty() { "a force" } else { "beside what is named a force is left" };
        let of = l.law().classes().filter(|c| c.mechanism.is_none()).map(|c| format!(" that depends on {}", c.depends));
        let of: Vec<String> = of.collect();
        return format!("{beside}{}; the law learned leaves {:.1} % of range", of.join(", and one"), 100.0 * l.misfit);
    }
    let what = match d.chosen.structure.terms().iter().find(|t| !t.mechanism.named) {
        _ if d.has_remainder() => format!("beside what is named, {}", learned_words(d)),
        Some(_) if d.force().is_some() => learned_words(d),
        Some(t) => as_stand_in(t),
        None if d.names_something() => {
            format!("beside what is named, {:.0} % of force or more is likelier to be left than less", 100.0 * LARGE)
        }
        None => format!("the residual is overdispersed, {:.1} times white noise", d.overdispersion.1),
    };
    let what = match d.base.structure.base().machine.as_ref().filter(|m| !m.facts().takes_force()) {
        Some(_) => format!("{what}; the FMUs take no force, so that no physics of contact or motion could be tried"),
        None => what,
    };
    match &f.latent {
        Some(l) => format!("{what}. {}", l.text),
        None => what,
    }
}

/// What a force learned in motion depends on, how surely, and what it leaves.
fn learned_words(d: &Decision) -> String {
    let Some(f) = d.force() else { return String::new() };
    format!(
        "a force of a shape of its own, learned and drawn in the report: it acts {}, by what was tried (probability {:.2}); with it \
         the simulation leaves {:.2} % of range, without it {:.2} %",
        f.words(),
        f.probability,
        100.0 * f.misfit,
        100.0 * misfit(&d.base)
    )
}

fn bias(d: &Decision, f: &Findings) -> BaseBias {
    let law = |f: &estimate::fitted::Fitted| {
        let (elastic, s) = (f.physics().law.elastic, f.data.scales);
        (elastic.stiffness.ln() + elastic.exponent * s.x_ref.ln(), elastic.exponent)
    };
    // of FMUs by what their contact nearly follows; of ours as fitted
    let of = |i: usize| match &d.base.structure.base().machine {
        _ if !d.detected => 0.0,
        None => d.base.fit.point.theta[i] - d.chosen.fit.point.theta[i],
        Some(_) => {
            let (b, a) = (law(&d.base), law(&d.chosen));
            let off = if i == 0 { b.0 - a.0 } else { b.1 - a.1 };
            if off.is_finite() {
                off
            } else {
                0.0
            }
        }
    };
    let parameter = |b: &crate::bias::Bias| ParameterBias {
        name: b.name.clone(),
        unit: b.unit.clone(),
        before: b.before,
        after: b.after,
        percent: b.percent,
        sigmas: b.sigmas,
    };
    BaseBias { ln_force_at_reference_depth: of(0), exponent: of(1), parameters: f.bias.iter().map(parameter).collect() }
}

/// The chosen terms with the shares of their action by phase; first the one in whose phase most acts of all that is missing.
fn by_action(d: &Decision) -> Vec<(usize, [f64; 4])> {
    let terms = if d.detected { d.chosen.structure.terms().len() } else { 0 };
    let each: Vec<[f64; 4]> = (0..terms).map(|i| shares(&d.chosen, i)).collect();
    by_strongest(&each).into_iter().map(|i| (i, each[i])).collect()
}

/// Where what is missing sits: the `terms` chosen that have a name and what has a name and no form, in the order of both; then what
/// stands in for the unexplained, or where that sits if nothing does.
fn places(c: &Campaign, d: &Decision, f: &Findings, terms: &[(usize, [f64; 4])]) -> Vec<Place> {
    let missing = "what is missing";
    let all = d.chosen.structure.terms();
    let of_term = |(i, shares): &(usize, [f64; 4])| {
        let (m, bond) = (all[*i].mechanism, all[*i].bond);
        let bond = (m.origin != Origin::Chain).then_some(bond);
        let cause = Located { origin: m.origin.name(), what: if m.named { m.name } else { missing }, bond };
        place(c, d, f, &cause, shares)
    };
    let (named, standing_in): (Vec<_>, Vec<_>) = terms.iter().partition(|(i, _)| all[*i].mechanism.named);
    let mut v: Vec<Place> = named.into_iter().map(of_term).collect();
    v.extend(d.names_by_shape().iter().map(|n| of_shape(c, d, n)));
    v.extend(standing_in.into_iter().map(of_term));
    if d.unexplained && terms.iter().all(|(i, _)| all[*i].mechanism.named) {
        if d.excess_scatter.is_some() {
            let cause = Located { origin: Origin::Contact.name(), what: "what differs between recordings", bond: None };
            v.push(place(c, d, f, &cause, &of_force(&d.chosen)));
        } else if let Some(l) = &f.latent {
            let cause = Located { origin: l.place.origin(), what: missing, bond: None };
            v.push(place(c, d, f, &cause, &l.shares));
        }
    }
    v
}

/// Where a name sits whose shape was learned; it shows in the force, where that was read.
fn of_shape(c: &Campaign, d: &Decision, n: &Named) -> Place {
    let strongest = strongest(&n.shares);
    let phase = PHASES[strongest];
    let channel = shows_in(d, [0.0; 3]).name();
    Place {
        origin: n.mechanism.origin.name(),
        bond: None,
        fmu: None,
        bonds: Vec::new(),
        phase,
        channel,
        share: n.shares[strongest],
        levels: c.levels.iter().filter(|l| l.0.is_finite()).map(|l| l.0).collect(),
        recording: None,
        t_start: None,
        t_end: None,
        text: format!("{} acts most in the {phase} phase and shows most clearly in {channel}", n.mechanism.name),
    }
}

/// A cause to be placed.
struct Located<'a> {
    origin: &'static str,
    what: &'a str,
    /// Index of its bond, where it sits at one of a system of FMUs.
    bond: Option<usize>,
}

/// Of the channels that were read the one with the largest `gains`, by channel; the first of equals.
fn shows_in(d: &Decision, gains: [f64; 3]) -> Channel {
    let read = Channel::ALL.into_iter().filter(|c| d.base.data.has(*c));
    let more = |a: Channel, b: Channel| if gains[b.index()] > gains[a.index()] { b } else { a };
    read.reduce(more).unwrap_or(Channel::Force)
}

/// Where a cause sits, by the `shares` of its action.
fn place(c: &Campaign, d: &Decision, f: &Findings, cause: &Located<'_>, shares: &[f64; 4]) -> Place {
    let strongest = strongest(shares);
    let mut by_channel = [0.0; 3];
    let mut by_level = vec![0.0; c.levels.len()];
    for m in &f.map {
        by_channel[m.channel.index()] += m.gain.max(0.0);
        by_level[m.level] += m.gain.max(0.0);
    }
    let channel = shows_in(d, by_channel).name();
    let most = by_level.iter().cloned().fold(0.0, f64::max);
    let levels = c.levels.iter().zip(&by_level).filter(|(l, g)| l.0.is_finite() && **g >= 0.3 * most);
    let span = span(d, strongest, &by_level);
    let phase = PHASES[strongest];
    let bond = cause.bond.and_then(|i| named_bond(c, i));
    let bonds = f.bonds.iter().filter(|_| bond.is_some()).filter_map(|l| {
        let (bond, fmu) = named_bond(c, l.bond)?;
        Some(LikelyBond { bond, fmu, probability: l.probability })
    });
    let bonds: Vec<LikelyBond> = bonds.collect();
    let at = bond.as_ref().map_or(String::new(), |(name, fmu)| {
        let here = bonds.iter().find(|l| l.bond == *name);
        let sure = here.map_or(String::new(), |l| format!(" (probability {:.2})", l.probability));
        format!(" sits at bond {name} of FMU {fmu}{sure},")
    });
    let (bond, fmu) = bond.unzip();
    Place {
        origin: cause.origin,
        bond,
        fmu,
        bonds,
        phase,
        channel,
        share: shares[strongest],
        levels: levels.map(|(l, _)| l.0).collect(),
        recording: span.as_ref().map(|s| s.0.clone()),
        t_start: span.as_ref().map(|s| s.1),
        t_end: span.as_ref().map(|s| s.2),
        text: format!("{}{at} acts most in the {phase} phase and shows most clearly in {channel}", cause.what),
    }
}

/// Name of bond `i` of a system of FMUs, and of the FMU that moves there.
fn named_bond(c: &Campaign, i: usize) -> Option<(String, String)> {
    let b = c.system.as_ref()?.bonds.get(i)?;
    let fmu = b.penetration.text.split_once('.').map_or("", |(fmu, _)| fmu);
    Some((b.name.text.clone(), fmu.to_string()))
}

/// (recording, first and last sample time) of a phase's first stretch in the first recording of the level that shows most.
fn span(d: &Decision, which: usize, by_level: &[f64]) -> Option<(String, f64, f64)> {
    let level = (0..by_level.len()).max_by(|a, b| by_level[*a].total_cmp(&by_level[*b]))?;
    let data = &d.chosen.data;
    let r = data.records.iter().position(|r| r.level == level)?;
    let (trace, _) = d.chosen.predict(r);
    let rec = &data.records[r];
    // its first stretch
    let phases = phases(&trace, data);
    let first = phases.iter().position(|p| *p == which)?;
    let length = phases[first..].iter().take_while(|p| **p == which).count();
    Some((rec.file.clone(), rec.setup.time[first], rec.setup.time[first + length - 1]))
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
        flat: e.flat,
        structures: e.structures.iter().map(structure).collect(),
        unknown: e
            .unknown
            .iter()
            .map(|u| WeighedUnknown { beside: u.beside.clone(), place: u.place.words(), ln_evidence: finite(&u.ln) })
            .collect(),
    }
}
