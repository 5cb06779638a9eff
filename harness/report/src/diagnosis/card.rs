//! The card on top: what is wrong, how sure that is, what it does, what to do next.

use super::words::{between, by_level, cause, change, misfit, only_scatters, peaks, plain, probability};
use chart::{Card, Chance, Effects};
use diagnose::run::Outcome;
use diagnose::verdict::{Missing, Verdict};

/// Probability from which a cause stands on the card, and how many do at most.
const LISTED: f64 = 0.01;
const MOST: usize = 5;

/// The card of an outcome.
pub fn card(o: &Outcome) -> Card {
    let v = &o.verdict;
    if let Some(why) = &v.invalid {
        return Card {
            wrong: "Nothing can be judged.".into(),
            detail: vec![format!("{}.", capital(&why.text))],
            chances: Vec::new(),
            sure: Vec::new(),
            effects: Vec::new(),
            does: Vec::new(),
            next: v.next.clone(),
        };
    }
    Card {
        wrong: wrong(v),
        detail: detail(o),
        chances: chances(v),
        sure: sure(o),
        effects: effects(v),
        does: does(o),
        next: v.next.iter().map(|t| capital(t)).collect(),
    }
}

/// What is wrong, in one sentence.
pub fn wrong(v: &Verdict) -> String {
    if v.invalid.is_some() {
        return "Nothing can be judged.".into();
    }
    if !v.mismatch.detected {
        return "Nothing is missing: the simulation, recalibrated, follows these recordings within noise and tolerances.".into();
    }
    if only_scatters(v).is_some() {
        return "No physics is missing, but recordings of the same level differ by more than repeats scatter.".into();
    }
    match &v.missing[..] {
        [] => match between(v) {
            Some(causes) => format!("Something is missing, of no cause more likely than not: {causes}."),
            None => "Something is missing that no mechanism known explains.".into(),
        },
        [one] => {
            // a sentence that says so itself needs no name before it
            let what = one.sentence.strip_prefix("the simulation leaves out ");
            format!("The simulation leaves out {}: {}.", plain(one.mechanism), what.unwrap_or(one.sentence))
        }
        several => {
            let names: Vec<String> = several.iter().map(|m| plain(m.mechanism)).collect();
            format!("The simulation leaves out {}.", names.join(" and "))
        }
    }
}

fn detail(o: &Outcome) -> Vec<String> {
    let v = &o.verdict;
    let mut out = Vec::new();
    if v.missing.len() > 1 {
        out.extend(v.missing.iter().map(|m| format!("{}: {}.", capital(&plain(m.mechanism)), m.sentence)));
    }
    for m in v.missing.iter().filter(|m| !m.also_possible.is_empty()) {
        out.push(format!("In the place of {} it may be {}.", plain(m.mechanism), or(&m.also_possible)));
    }
    for (m, place) in v.missing.iter().zip(&v.mismatch.places) {
        let name = if v.missing.len() > 1 { capital(&plain(m.mechanism)) } else { "It".into() };
        out.push(format!(
            "{name} sits in the {}{}, acts most {} and shows most clearly in the {}.",
            origin(place.origin),
            place.bond.as_ref().map_or(String::new(), |b| format!(" at bond {b}")),
            phase(place.phase),
            place.channel
        ));
    }
    if v.unexplained.detected {
        let beside = if v.missing.is_empty() { "" } else { "Beyond that a misfit stays unexplained: " };
        let text = match (&o.force, &o.findings.latent) {
            (Some(f), _) => format!("it acts {} (probability {})", f.words(), probability(f.probability)),
            (None, Some(l)) => format!("it takes {}", l.brief),
            (None, None) => v.unexplained.text.clone(),
        };
        out.push(if beside.is_empty() { format!("{}.", capital(&text)) } else { format!("{beside}{text}.") });
    }
    out
}

fn or(names: &[&str]) -> String {
    names.iter().map(|n| plain(n)).collect::<Vec<_>>().join(" or ")
}

/// Where an origin is, as the verdict names it.
fn origin(name: &str) -> &str {
    match name {
        "chain" => "measuring chain",
        "motion" => "motion of the body",
        other => other,
    }
}

fn phase(name: &str) -> &str {
    match name {
        "approach" => "before the touch",
        "loading" => "while loading",
        "unloading" => "while unloading",
        _ => "after leaving",
    }
}

fn chances(v: &Verdict) -> Vec<Chance> {
    let listed = v.posterior.iter().filter(|c| c.probability >= LISTED).take(MOST);
    listed
        .map(|c| Chance { name: cause(&c.mechanisms), probability: c.probability, said: probability(c.probability) })
        .collect()
}

fn sure(o: &Outcome) -> Vec<String> {
    let v = &o.verdict;
    let mut out = Vec::new();
    out.push(misfit(o));
    out.extend(by_level(o));
    if v.mismatch.detected {
        out.push(format!(
            "Noise alone would look as bad with a probability of {}.",
            rare(v.mismatch.false_alarm_probability)
        ));
    }
    if !o.findings.caveats.is_empty() {
        out.push(format!(
            "{} to know before believing this, at the end of the page.",
            if o.findings.caveats.len() == 1 {
                "There is one thing".into()
            } else {
                format!("There are {} things", o.findings.caveats.len())
            }
        ));
    }
    out
}

/// A small probability: below what any tail is known to, its power of ten is no knowledge.
fn rare(p: f64) -> String {
    if p < 1e-6 {
        "less than one in a million".into()
    } else if p < 1e-3 {
        format!("{p:.0e}")
    } else {
        format!("{p:.3}")
    }
}

fn effects(v: &Verdict) -> Vec<Effects> {
    let of = |m: &Missing| {
        let e = v.material.as_ref()?.get(m.mechanism)?;
        let all = [
            ("peak force", e.peak_force),
            ("restitution", e.restitution),
            ("contact time", e.contact_time),
            ("depth", e.depth),
        ];
        let changes =
            all.into_iter().filter_map(|(what, q)| q.map(|q| (what, change(q).replace('-', "\u{2212}")))).collect();
        let of = if v.missing.len() > 1 { capital(&plain(m.mechanism)) } else { String::new() };
        Some(Effects { of, changes })
    };
    v.missing.iter().filter_map(of).collect()
}

fn does(o: &Outcome) -> Vec<String> {
    let v = &o.verdict;
    let mut out = Vec::new();
    if !effects(v).is_empty() {
        out.push("Beside the same simulation without it, mean of the recordings.".into());
    }
    if let Some(r) = &v.remainder {
        let left = if !v.missing.is_empty() { "Left over after that" } else { "Left over" };
        out.push(format!("{left}: {}; peaks read and simulated differ {}.", r.text, peaks(r)));
    }
    out
}

/// With a capital first letter.
pub fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_are_said_as_they_are_known() {
        assert_eq!(
            (rare(1e-12).as_str(), rare(2e-4).as_str(), rare(0.02).as_str()),
            ("less than one in a million", "2e-4", "0.020")
        );
        assert_eq!((change(-0.0177).as_str(), change(0.5).as_str()), ("-1.77 %", "+50.00 %"));
        assert_eq!(change(5.9), "more than 2 \u{d7}");
        assert_eq!((capital("it takes"), capital("")), ("It takes".to_string(), String::new()));
    }
}
