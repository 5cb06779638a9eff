//! The answer in words: one sentence, and a short text for the terminal.

use chart::dashed;
use diagnose::bias::Bias;
use diagnose::body::OnBody;
use diagnose::element::Packed;
use diagnose::figure::figure;
use diagnose::material::{Effect, Remainder};
use diagnose::next::{LITTLE, SURE};
use diagnose::run::Outcome;
use diagnose::sensors::{Against, Reading};
use diagnose::verdict::{Cause, Missing, Quality, Unclipped, Verdict};

/// Causes listed where none is more likely than not, at most.
const LIKELIEST: usize = 3;

/// The sentence that sums a verdict up.
pub fn sentence(o: &Outcome) -> String {
    let v = &o.verdict;
    if let Some(why) = &v.invalid {
        return format!("Nothing can be judged: {}.", why.text);
    }
    let gain = if o.after.is_some() { format!(" {}", misfit(o)) } else { String::new() };
    let name = |m: &Missing| {
        let instead = match &m.also_possible[..] {
            [] => String::new(),
            others => format!(", or {} instead", others.join(" or ")),
        };
        format!("{} (probability {}{instead})", m.mechanism, probability(m.probability))
    };
    let names: Vec<String> = v.missing.iter().map(name).collect();
    let unexplained = v.unexplained.detected;
    let takes = match (&o.force, &o.findings.latent) {
        (Some(f), _) => format!(": it acts {} (probability {})", f.words(), probability(f.probability)),
        (None, Some(l)) => format!(": it takes {}", l.brief),
        (None, None) if unexplained => format!(": {}", v.unexplained.text),
        (None, None) => String::new(),
    };
    let of =
        |mechanisms: &[&str]| v.posterior.iter().find(|c| c.mechanisms == mechanisms).map_or(0.0, |c| c.probability);
    if !v.mismatch.detected {
        format!(
            "Nothing is missing beyond noise, tolerances and repeat scatter (probability {}).",
            probability(of(&[]))
        )
    } else if let Some(sure) = only_scatters(v) {
        format!("No physics is missing (probability {}), but {}.", probability(sure), v.unexplained.text)
    } else if names.is_empty() {
        let sure = of(&["unknown"]);
        let how = if sure > 0.0 { format!(" (probability {})", probability(sure)) } else { String::new() };
        match between(v) {
            Some(causes) => format!("Something is missing, of no cause more likely than not ({causes}){takes}.{gain}"),
            None => format!("Something is missing that no mechanism known explains{how}{takes}.{gain}"),
        }
    } else {
        let more = if unexplained { format!(" Beyond that a misfit stays unexplained{takes}.") } else { String::new() };
        format!("The simulation leaves out {}.{gain}{more}", names.join(" and "))
    }
}

/// Probability that nothing is missing, where that is likely and what was found is that recordings of one level differ.
pub fn only_scatters(v: &Verdict) -> Option<f64> {
    let none = v.posterior.iter().find(|c| c.mechanisms.is_empty())?.probability;
    (v.mismatch.detected && v.missing.is_empty() && none > 0.5).then_some(none)
}

/// The likeliest causes with their probabilities, where something is missing and none of them is more likely than not.
pub fn between(v: &Verdict) -> Option<String> {
    if !v.mismatch.detected || !v.missing.is_empty() || v.posterior.iter().any(|c| c.probability > 0.5) {
        return None;
    }
    let listed = |c: &Cause| format!("{} {}", cause(&c.mechanisms), probability(c.probability));
    let causes: Vec<String> = v.posterior.iter().take(LIKELIEST).map(listed).collect();
    (!causes.is_empty()).then(|| causes.join(", "))
}

/// A probability in words: no verdict is certain.
pub fn probability(p: f64) -> String {
    if p > 0.995 {
        "above 0.99".into()
    } else if p < 0.005 {
        "below 0.01".into()
    } else {
        format!("{p:.2}")
    }
}

/// The misfit on what no fit has seen, before and after, in per cent of range and in multiples of noise.
pub fn misfit(o: &Outcome) -> String {
    let fit = &o.verdict.fit;
    let percent = |q: &Quality| 100.0 * q.heldout_nrmse_of_force.or(q.heldout_nrmse).unwrap_or(f64::NAN);
    let range = if fit.before.heldout_nrmse_of_force.is_some() { "the range of force" } else { "range" };
    let noise = |q: &Quality| q.heldout_over_noise.filter(|v| v.is_finite());
    let (before, after) = (&fit.before, &fit.after);
    if o.after.is_none() {
        let noises = noise(before).map_or(String::new(), |n| format!(", {} times the noise", times(n)));
        return format!("On {} the misfit is {:.2} % of {range}{noises}.", unseen(o), percent(before));
    }
    let noises = match (noise(before), noise(after)) {
        (Some(b), Some(a)) => format!(", from {} to {} times the noise", times(b), times(a)),
        _ => String::new(),
    };
    format!(
        "On {} the misfit goes from {:.2} % to {:.2} % of {range}{noises}.",
        unseen(o),
        percent(before),
        percent(after)
    )
}

/// Levels that the misfit is said of one by one, at most; of more the first, the middle and the last.
const LEVELS: usize = 6;

/// The misfit of every level in multiples of noise; None where there is one alone.
pub fn by_level(o: &Outcome) -> Option<String> {
    let all = &o.verdict.fit.levels;
    if all.len() < 2 {
        return None;
    }
    let some = [0, all.len() / 2, all.len() - 1];
    let said = all.iter().enumerate().filter(|(i, _)| all.len() <= LEVELS || some.contains(i)).map(|(_, l)| {
        let (before, after) = (times(l.over_noise.before), times(l.over_noise.after));
        if o.after.is_some() {
            format!("{before} to {after} at {}", l.level)
        } else {
            format!("{before} at {}", l.level)
        }
    });
    Some(format!("Level by level, times the noise: {}.", said.collect::<Vec<_>>().join(", ")))
}

/// A multiple of noise.
fn times(n: f64) -> String {
    if n < 99.95 {
        format!("{n:.1}")
    } else {
        format!("{n:.0}")
    }
}

/// By how much the largest readings and those simulated differ, in words.
pub fn peaks(r: &Remainder) -> String {
    if r.peak_force > 1.0 {
        "by more than a factor of 2".into()
    } else {
        format!("by {:.2} %", 100.0 * r.peak_force)
    }
}

/// A relative change in per cent; one that more than doubles a figure says that.
pub fn change(q: f64) -> String {
    if q > 1.0 {
        "more than 2 \u{d7}".into()
    } else {
        format!("{:+.2} %", 100.0 * q)
    }
}

/// What held-out predictions were made of: levels where there are several, else recordings, else the rest of the one.
pub fn unseen(o: &Outcome) -> &'static str {
    match (o.data.levels().len(), o.data.records.len()) {
        (0 | 1, 0 | 1) => "the rest of the recording, which the fit of its first half cycle did not see,",
        (0 | 1, _) => "recordings the fit did not see",
        _ => "levels the fit did not see",
    }
}

/// A number of standard deviations: beyond ten no error model is right.
pub fn sigmas(s: f64) -> String {
    if s.abs() > 10.0 {
        "far beyond its error".into()
    } else {
        format!("{s:+.1} sigma")
    }
}

/// What a mechanism does to the figures a campaign is judged by, in words; empty where none was worked out.
pub fn material(e: &Effect) -> String {
    let all = [
        ("peak force", e.peak_force),
        ("restitution", e.restitution),
        ("contact time", e.contact_time),
        ("depth", e.depth),
    ];
    let said: Vec<String> = all.iter().filter_map(|(what, q)| q.map(|q| format!("{what} {}", change(q)))).collect();
    said.join(", ")
}

/// Parameters of a mechanism, one text each: name, value, interval or why there is none.
fn parameters(m: &Missing) -> Vec<(String, String, String)> {
    let of = |(name, p): (&String, &diagnose::verdict::Parameter)| {
        let interval = |low, high, unit: &str| format!("95 %: {} to {}", figure(low, ""), figure(high, unit));
        (name.clone(), figure(p.value, p.unit), ends(p, m.intervals_by, interval))
    };
    m.parameters.iter().map(of).collect()
}

/// The 95 % interval of a parameter as `shown` writes it, or why there is none; `by`: the method of its mechanism's intervals.
pub fn ends(p: &diagnose::verdict::Parameter, by: &str, shown: impl Fn(f64, f64, &str) -> String) -> String {
    match p.ci95 {
        Some([low, high]) => shown(low, high, p.unit),
        None if p.held => "held, not estimated".into(),
        None => by.strip_prefix("none: ").unwrap_or("not determined by these recordings").into(),
    }
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
        .map(|b| format!("{} {} ({})", b.name, share(b), sigmas(b.sigmas)))
        .collect()
}

/// The experiment that parts tied names best, where one is asked for.
fn experiment(o: &Outcome) -> Option<String> {
    let v = &o.verdict;
    let open = v.missing.iter().filter_map(|m| m.tie.as_ref()).any(|t| t.p_right <= SURE);
    let e = v.experiment.as_ref().filter(|_| open)?;
    let (sigmas, p) = (e.separation_sigmas, e.p_right);
    let hope = if sigmas < LITTLE { ", which is little: no experiment tried parts them well" } else { "" };
    Some(format!(
        "experiment that parts the names best: {} ({sigmas:.1} sigma apart{hope}; P(right) then {p:.2})",
        e.text
    ))
}

/// A name as it is read.
pub fn plain(name: &str) -> String {
    name.replace('_', " ")
}

/// A set of names as a cause: none, or one that no mechanism has.
pub fn cause(mechanisms: &[&str]) -> String {
    match mechanisms {
        [] => "nothing is missing".into(),
        ["unknown"] => "a cause that no mechanism known explains".into(),
        _ => plain(&mechanisms.join(" and ")),
    }
}

/// What the packed element holds, and how it did.
pub fn through(o: &Outcome, p: &Packed) -> String {
    let what = o.verdict.element.as_ref().map_or("", |e| &e.text);
    let run = p.through.as_ref().map_or(String::new(), |t| {
        format!(
            "; the recordings run through it give the predictions after (within {:.0e} of range of the diagnosis' own \
             simulation)",
            t.difference.max(1e-9)
        )
    });
    format!("{what}{run}; {}", platforms(&p.platforms()))
}

/// What the packed forces on the body hold, and where they go.
pub fn on_body(b: &OnBody) -> String {
    format!("it holds {} as found; put it between the force of the contact and the body", b.words())
}

/// Which FMUs hold the force that was learned in motion.
pub fn holds_learned(o: &Outcome) -> String {
    let h = o.findings.holds_learned;
    let fmus = [("HysteresisContact.fmu", h.in_contact), ("BodyForce.fmu", h.on_body)];
    let fmus: Vec<&str> = fmus.iter().filter(|f| f.1).map(|f| f.0).collect();
    match &fmus[..] {
        [] => "No FMU holds it.".into(),
        [one] => format!("{one} holds it."),
        all => format!("{} hold it.", all.join(" and ")),
    }
}

/// Where the FMU runs, and how it comes to run elsewhere.
fn platforms(all: &[&str]) -> String {
    match all {
        [one] => format!("it runs on {one} alone, with other platforms after touchdown pack --all-platforms"),
        _ => format!("it runs on {}", all.join(", ")),
    }
}

/// What other sensors on the same impacts say of this campaign's, one text each.
pub fn sensors(o: &Outcome) -> Vec<String> {
    let of = |a: &Against| {
        let (before, after) = a.misfit();
        let ms = |s: f64| figure(1e3 * s, "");
        let lag = if let Some(mechanism) = a.mechanism() {
            format!(
                "lags behind by {} ms (95 %: {} to {}; a first-order low-pass, {mechanism}: the misfit between the two goes \
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
        let unit = a.channel.unit();
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
    // a folder's name may hold anything
    let mut s = format!("{}: {}\n", v.campaign.replace(char::is_control, "?"), sentence(o));
    if let Some(levels) = by_level(o).filter(|_| v.invalid.is_none()) {
        s += &format!("  {levels}\n");
    }
    for (m, w) in v.missing.iter().zip(&v.mismatch.places) {
        let list: Vec<String> = parameters(m).into_iter().map(|(n, v, ci)| format!("{n} {v} ({ci})")).collect();
        s += &format!("  {}, {}: {}\n", m.mechanism, m.form, list.join(", "));
        s += &format!("    sits in {}, acts most in {}, shows most in {}. {}\n", w.origin, w.phase, w.channel, m.cure);
        let does = v.material.as_ref().and_then(|all| all.get(m.mechanism)).map_or(String::new(), material);
        if !does.is_empty() {
            s += &format!("    it changes {does}\n");
        }
        if let Some(t) = &m.tie {
            s += &format!("    P(right) = {:.2} against {}\n", t.p_right, m.also_possible.join(", "));
        }
    }
    if let Some(r) = v.remainder.as_ref().filter(|_| v.mismatch.detected && only_scatters(v).is_none()) {
        s += &format!("  left over: {}; peaks read and simulated differ {}\n", r.text, peaks(r));
    }
    if let Some(e) = experiment(o) {
        s += &format!("  {e}\n");
    }
    let moved = bias(o);
    if !moved.is_empty() {
        s += &format!("  the calibration had been off: {}\n", moved.join(", "));
    }
    let clipped = |u: &&Unclipped| u.clipped;
    for u in v.without_clipping.iter().flatten().filter(clipped) {
        s += &format!(
            "  {}: read {}, peak before the clip {} (95 %: {} to {})\n",
            u.recording,
            figure(u.read, u.unit),
            figure(u.peak, u.unit),
            figure(u.ci95[0], ""),
            figure(u.ci95[1], u.unit)
        );
    }
    for t in sensors(o) {
        s += &format!("  {t}\n");
    }
    if let Ok(p) = &o.element {
        s += &format!("  HysteresisContact.fmu: {}\n", through(o, p));
    }
    if let Some(b) = &o.findings.on_body {
        s += &format!("  BodyForce.fmu: {}\n", on_body(b));
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
    dashed(&s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::page::mechanism;
    use chart::{Card, Chance, Effects, Heat, Page};
    use diagnose::verdict::Parameter;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngSeed};

    /// A mechanism with these values.
    fn missing([value, low, high, p]: [f64; 4]) -> Missing {
        let parameter = Parameter { value, unit: "N", ci95: Some([low, high]), held: false };
        Missing {
            mechanism: "fluid_drag",
            form: "quadratic",
            text: String::new(),
            equation: "F = c v^2",
            source: "Newton 1687",
            sentence: "the air drags",
            cure: "add it",
            probability: p,
            parameters: [("drag".to_string(), parameter)].into(),
            intervals_by: "curvature",
            also_possible: Vec::new(),
            tie: None,
        }
    }

    proptest! {
        #![proptest_config(Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() })]
        #[test]
        fn no_page_prints_a_number_that_is_none(values in prop::array::uniform4(prop_oneof![
            prop::num::f64::ANY,
            Just(f64::NAN),
            Just(f64::INFINITY),
            Just(f64::NEG_INFINITY),
            Just(1.7e308),
        ])) {
            let [a, b, percent, s] = values;
            let moved = Bias { name: "k".into(), before: a, after: b, percent, sigmas: s, unit: "N/m".into() };
            let effect = Effect { peak_force: Some(a), restitution: Some(b), contact_time: Some(percent), depth: None };
            let texts = vec![share(&moved), sigmas(s), material(&effect), format!("{:.2} % of range", 100.0 * a)];
            let card = Card {
                wrong: sigmas(a),
                detail: texts.clone(),
                chances: vec![Chance { name: "none".into(), probability: a, said: probability(a) }],
                sure: texts.clone(),
                effects: vec![Effects { of: String::new(), changes: vec![("peak force", format!("{b:+.2} %"))] }],
                does: texts.clone(),
                next: texts.clone(),
            };
            let heat = Heat::new("misfit", &["force".into()]).row("1 m", &[Some(a)]);
            let page = Page::new("x").card(&card).list(&texts).heat(&heat).table(&["a"], std::slice::from_ref(&texts));
            let html = mechanism(page, &missing(values)).html();
            let body = html.split("<main").nth(1).or(html.split("<body").nth(1)).unwrap();
            let text = body.split("<script").next().unwrap();
            let none = |w: &str| w == "NaN" || w == "inf";
            prop_assert!(!text.split(|c: char| !c.is_alphanumeric()).any(none), "{text}");
        }
    }
}
