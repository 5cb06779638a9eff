//! What to do next, from the decision and the findings: a step each, the first thing first.

use super::bias::Bias;
use super::decide::Decision;
use super::experiment::Tie;
use super::findings::Findings;
use super::phases::{strongest, PHASES};
use mechanisms::mechanism::{Acts, Mechanism, Origin};
use mechanisms::ALL;
use record::{Campaign, Channel};

/// Probability of having named the right one of a tie from which no experiment is asked for.
pub const SURE: f64 = 0.95;
/// Separation in standard deviations below which an experiment promises little.
pub const LITTLE: f64 = 2.0;
/// Where nothing can be judged.
pub const PUT_RIGHT: &str =
    "Put right what is said above, look at the campaign with `touchdown check`, and diagnose again.";
/// Parameters that are start values of the element.
const SYMBOLS: [&str; 3] = ["k", "p", "mu_d"];
/// Other names at most that a measurement is proposed against.
const OTHERS: usize = 2;

/// The steps for campaign `c`; `fmu`: whether the element was written.
pub fn steps(c: &Campaign, d: &Decision, f: &Findings, fmu: bool) -> Vec<String> {
    let mut v = Vec::new();
    let named: Vec<&Mechanism> = named(d);
    if !f.gates.is_empty() {
        let names = words(&named.iter().map(|m| m.name).collect::<Vec<_>>());
        v.push(format!("Do not build on {names} yet. {}", f.gates.join(" ")));
    } else {
        match &named[..] {
            [one] => v.push(cure(one, true, fmu).into()),
            all => v.extend(all.iter().map(|m| format!("{}: {}", plain(m.name), cure(m, true, fmu)))),
        }
        let mut by_shape: Vec<String> = d.names_by_shape().iter().map(|n| n.cure.into()).collect();
        by_shape.dedup();
        v.extend(by_shape);
        v.extend(at_bonds(c, d, f));
        v.extend(on_body(c, f));
    }
    v.extend(calibration(f).filter(|_| fmu && f.gates.is_empty() && !d.unexplained));
    if f.unclipped.is_some() && named.iter().any(|m| m.hints.limits_reading) {
        v.push(
            "Until the channel has a wider range, take its peaks from without_clipping/, with their intervals.".into(),
        );
    }
    v.extend(other_rates(d));
    v.extend(against_others(c, d, f, &named));
    v.extend(unexplained(c, d, f));
    v.extend(more_recordings(c, d, f));
    let in_the_fmu = named.iter().any(|m| m.origin == Origin::Contact) && f.gates.is_empty();
    if fmu && !in_the_fmu && !d.is_learned() {
        v.push(recalibrated(d, &named, f).into());
    }
    if let Some(instead) = f.instead.as_ref().filter(|_| fmu) {
        v.push(format!("Or put the FMU in the place of the simulation's contact: {instead}."));
    }
    v
}

/// What to do about a name that is not to be relied on.
pub const NOT_RELIED_ON: &str = "It is not to be relied on yet, and no FMU holds it.";
/// What to do about a part of the contact where no FMU of ours was written.
const NOT_WRITTEN: &str =
    "No FMU was written that holds it: put its equation into the contact's law, with the values given here.";

/// What to do about mechanism `m`; `relied_on`: whether it is to be relied on; `fmu`: whether the element was written.
pub fn cure(m: &Mechanism, relied_on: bool, fmu: bool) -> &'static str {
    match m.origin {
        _ if !relied_on => NOT_RELIED_ON,
        Origin::Contact if !fmu && pack::holds(m.name) => NOT_WRITTEN,
        _ => m.cure,
    }
}

/// Where in a system of FMUs what is named goes: into the system handed back, or by hand, or the input that it lacks.
fn at_bonds(c: &Campaign, d: &Decision, f: &Findings) -> Vec<String> {
    let (Some(system), Some(machine)) = (&c.system, &d.base.structure.base().machine) else { return Vec::new() };
    let of = |t: &estimate::structure::Term| {
        let bond = system.bonds.get(t.bond)?;
        let (name, at, m) = (plain(t.name()), &bond.name.text, t.mechanism);
        let force = &bond.force.as_ref()?.text;
        let fmu = force.split_once('.').map_or(force.as_str(), |f| f.0);
        match (m.origin, m.acts) {
            (Origin::Motion, Acts::Force) if f.on_body.as_ref().is_some_and(|b| b.names.contains(&t.name())) => Some(format!(
                "system/ holds {name} at bond {at}: BodyForce.fmu feeds {force} with {}, besides what it had.",
                m.equation
            )),
            (Origin::Motion, Acts::Force | Acts::Reading) => Some(format!(
                "At bond {at} feed {force} with the force of {name} besides what it has, {}, on the body and positive into the stop, \
                 from {} and {}.",
                m.equation, bond.penetration.text, bond.velocity.text
            )),
            (Origin::Motion, Acts::Push) => Some(format!(
                "No force into {force} holds {name}: FMU {fmu} needs an input for the position of the stop at bond {at} (m) to take \
                 it up from outside, or a stop of its own that moves."
            )),
            (Origin::Motion, Acts::Rider) => Some(format!(
                "At bond {at} the force of {name} answers to the acceleration at once, and no input of FMU {fmu} takes it: make it a \
                 body of its own inside."
            )),
            (Origin::Contact, _) if machine.facts().bonds.get(t.bond).is_some_and(|b| b.inside) => Some(format!(
                "The contact at bond {at} acts inside FMU {fmu}, where nothing takes its place: put {name} into its law there, or feed \
                 {force} with the difference."
            )),
            _ => None,
        }
    };
    d.chosen.structure.terms().iter().filter(|t| t.mechanism.named).filter_map(of).collect()
}

/// What parts friction from what depends on the rate, where that is open.
fn other_rates(d: &Decision) -> Option<String> {
    let open = d.names_by_shape().iter().any(|n| n.also_possible.len() > 1);
    open.then(|| {
        "Press ten times faster, and hold the deepest point: friction stays as it is, damping grows with the rate, and relaxation \
         fades in the hold."
            .into()
    })
}

/// What to do with the forces on the body that were found, where no system of FMUs is handed back.
fn on_body(c: &Campaign, f: &Findings) -> Option<String> {
    let held = f.on_body.as_ref().filter(|_| c.system.is_none())?;
    Some(format!(
        "BodyForce.fmu holds {}: feed its other_force with the contact's force, penetration and velocity with the body's, and \
         the body with its force.",
        held.words()
    ))
}

/// The mechanisms of the vocabulary that are named.
fn named(d: &Decision) -> Vec<&'static Mechanism> {
    if !d.detected {
        return Vec::new();
    }
    d.chosen.structure.terms().iter().map(|t| t.mechanism).filter(|m| m.named).collect()
}

/// A name as it is read.
pub fn plain(name: &str) -> String {
    name.replace('_', " ")
}

/// Names as they are read, in one phrase.
pub fn words(names: &[&str]) -> String {
    names.iter().map(|n| plain(n)).collect::<Vec<_>>().join(" and ")
}

/// What the element is good for that holds none of what is named.
fn recalibrated(d: &Decision, named: &[&Mechanism], f: &Findings) -> &'static str {
    if !f.gates.is_empty() {
        "Until that is settled, HysteresisContact.fmu holds the simulation as given, recalibrated, without what is named."
    } else if f.holds_learned.in_contact && f.holds_learned.on_body {
        "Put HysteresisContact.fmu in the place of the simulation's contact, beside BodyForce.fmu: each holds a part of the force that \
         was learned, and is right with the other alone. Where beyond_learned is true, they are asked for more than the recordings show."
    } else if f.holds_learned.in_contact {
        "Put HysteresisContact.fmu in the place of the simulation's contact: it holds the force that was learned. Where beyond_learned \
         is true, it is asked for more than the recordings show."
    } else if f.holds_learned.on_body {
        "Put HysteresisContact.fmu in the place of the simulation's contact: it is calibrated beside the force in BodyForce.fmu, and \
         right with it alone."
    } else if d.unexplained {
        "HysteresisContact.fmu holds what is known, recalibrated; what stays unexplained is not in it."
    } else if named.is_empty() {
        "Put HysteresisContact.fmu in the place of the simulation's contact: the same law, recalibrated to these recordings."
    } else {
        "Put HysteresisContact.fmu in the place of the simulation's contact: calibrated beside what is corrected elsewhere, \
         it is free of the error that the missing physics had forced on it."
    }
}

/// What else the element's start values put right; None where the calibration had absorbed nothing.
fn calibration(f: &Findings) -> Option<String> {
    let off = |b: &&Bias| b.sigmas.abs() > 2.0 && b.percent.is_finite() && SYMBOLS.contains(&b.name.as_str());
    let moved: Vec<String> = f
        .bias
        .iter()
        .filter(off)
        .map(|b| format!("{} by {:+.1} %", b.name, b.percent).replace('-', "\u{2212}"))
        .collect();
    (!moved.is_empty()).then(|| {
        format!(
            "Take its other start values, too: calibrated without the missing physics, the simulation had been off in {}.",
            moved.join(", ")
        )
    })
}

/// What would distinguish what is named from what fits as well.
fn against_others(c: &Campaign, d: &Decision, f: &Findings, named: &[&'static Mechanism]) -> Vec<String> {
    let mut v = Vec::new();
    let mut settled: Vec<&str> = named.iter().map(|m| m.name).collect();
    settled.extend(d.names_by_shape().iter().flat_map(|n| n.also_possible.iter().copied().chain([n.mechanism.name])));
    for t in f.ties.iter().flatten().filter(|t| t.p_right <= SURE) {
        if let Some(text) = by_experiment(t) {
            settled.extend(&t.set);
            v.push(text);
        }
    }
    // among names that nothing parts yet: those of the ties, then of the rest of the credible set
    let tied = d.ties.iter().flatten().copied();
    let credible = d.posterior.credible_set();
    let possible = credible.iter().filter(|c| !c.is_unknown()).flat_map(|c| c.names.iter().copied());
    let mut others: Vec<&str> = tied.chain(possible).filter(|n| !settled.contains(n)).collect();
    let mut seen = Vec::new();
    others.retain(|n| {
        !seen.contains(n) && {
            seen.push(*n);
            true
        }
    });
    let of = |n: &&str| ALL.iter().find(|m| m.name == *n);
    for other in others.iter().filter_map(of).take(OTHERS) {
        v.push(match named.first() {
            Some(first) => {
                format!("To tell {} from {}, {}.", plain(first.name), plain(other.name), apart(c, d, first, other))
            }
            None => format!("{} is not ruled out: to see it, {}.", plain(other.name), shown(c, other)),
        });
    }
    v
}

fn by_experiment(t: &Tie) -> Option<String> {
    let best = t.proposals.first()?;
    let all: Vec<String> = t.set.iter().map(|n| plain(n)).collect();
    Some(if best.sigmas < LITTLE {
        format!(
            "No experiment tried tells {} apart (the best, to {}, by {:.1} sigma): decide by what the rig can have.",
            all.join(" and "),
            best.text,
            best.sigmas
        )
    } else {
        format!(
            "To tell {} apart: {} ({:.1} sigma apart; the right name then has a probability of {:.2}).",
            all.join(" and "),
            best.text,
            best.sigmas,
            best.p_right
        )
    })
}

/// What parts two mechanisms, by where they sit.
fn apart(c: &Campaign, d: &Decision, a: &Mechanism, b: &Mechanism) -> String {
    if a.hints.collinear_with.contains(&b.name) {
        return "look at the rig: recordings of this kind cannot do it".into();
    }
    if a.hints.depends_on_history != b.hints.depends_on_history {
        return "take recordings on a fresh spot or a new part, then the same again on the used one".into();
    }
    match (a.origin, b.origin) {
        (Origin::Chain, Origin::Chain) => "test the chain by itself: a known pulse through transducer and amplifier".into(),
        (Origin::Chain, _) | (_, Origin::Chain) => {
            "record the same impacts with a second sensor: what sits in the measuring chain changes with it, the rest stays"
                .into()
        }
        (Origin::Contact, Origin::Contact) => levels(c),
        _ if d.base.data.has(Channel::Penetration) => {
            "record longer before the touch and after leaving: what acts on the body acts there, too, the contact does not"
                .into()
        }
        _ => "record the penetration as well, from before the touch to after leaving: what acts on the body acts there, too, the \
              contact does not"
            .into(),
    }
}

/// What shows a mechanism that is possible beside nothing.
fn shown(c: &Campaign, m: &Mechanism) -> String {
    match m.origin {
        _ if m.hints.depends_on_history => "repeat the first level last".into(),
        Origin::Chain => "record the same impacts with a second sensor".into(),
        Origin::Motion => "record longer before the touch and after leaving".into(),
        Origin::Contact => levels(c),
    }
}

fn levels(c: &Campaign) -> String {
    match (c.levels.first(), c.levels.last()) {
        (Some(a), Some(b)) if c.levels.len() > 1 => {
            format!("record levels beyond those there are ({} to {})", a.1, b.1)
        }
        _ => "record more levels".into(),
    }
}

/// Where FMUs that take no force would need one; None where they take one, or a rig of ours simulates.
fn without_force(c: &Campaign, d: &Decision) -> Option<String> {
    d.base.structure.base().machine.as_ref().filter(|m| !m.facts().takes_force())?;
    let system = c.system.as_ref()?;
    let place = match system.bonds.first() {
        Some(b) => format!("on the body whose motion {} and {} are", b.penetration.text, b.velocity.text),
        None => {
            let outputs: Vec<&str> = system.channels.iter().flatten().map(|w| w.text.as_str()).collect();
            format!(
                "on the body that {} belong to, with outputs of its penetration (m) and velocity (m/s)",
                outputs.join(", ")
            )
        }
    };
    Some(place)
}

fn unexplained(c: &Campaign, d: &Decision, f: &Findings) -> Option<String> {
    if !d.unexplained {
        return None;
    }
    if let Some(place) = without_force(c, d) {
        return Some(format!(
            "Give the model an input that takes a force, in N, {place}: then it can be said which physics of contact or motion is \
             missing, and not of the measuring chain alone."
        ));
    }
    if d.excess_scatter.is_some() {
        return Some(
            "Find what changed between recordings of one level (temperature, wear, a setting): repeat each level, in mixed order, \
             and note those."
                .into(),
        );
    }
    Some(match &f.latent {
        Some(l) => format!(
            "Look for a cause in the {} that acts most in the {} phase: latent_force/ holds, recording by recording, the force it \
             takes.",
            l.place.origin(),
            PHASES[strongest(&l.shares)]
        ),
        None => "Look at the residuals below: where they stand out of the noise, in every recording alike, the cause acts.".into(),
    })
}

/// What too few recordings or channels leave open.
fn more_recordings(c: &Campaign, d: &Decision, f: &Findings) -> Vec<String> {
    let mut v = Vec::new();
    if c.recordings.len() < 2 {
        v.push("Record more impacts, two or more at each of three levels or more: one alone does not show what holds for all.".into());
    } else if c.levels.len() < 2 {
        v.push("Record at two levels more at least: what grows with speed or depth shows in no other way.".into());
    }
    let channels: Vec<Channel> = Channel::ALL.into_iter().filter(|ch| d.base.data.has(*ch)).collect();
    let open = d.unexplained || !f.gates.is_empty() || d.ties.iter().any(|t| !t.is_empty());
    if let ([only], true) = (&channels[..], open) {
        let other = if *only == Channel::Penetration { "force or acceleration" } else { "the penetration" };
        v.push(format!(
            "Record {other} beside the {}: in one channel contact, motion and measuring chain look alike.",
            only.name()
        ));
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_told_to_be_held_that_no_fmu_holds() {
        let of = |name: &str| mechanisms::named(name).unwrap();
        let held = of("plastic_indentation");
        assert!(cure(held, true, true).contains("now holds it"));
        for (relied_on, fmu) in [(false, true), (false, false), (true, false)] {
            assert!(!cure(held, relied_on, fmu).contains("now holds it"), "{relied_on} {fmu}");
        }
        // what sits elsewhere asks for no FMU
        assert_eq!(cure(of("fluid_drag"), true, false), of("fluid_drag").cure);
    }
}
