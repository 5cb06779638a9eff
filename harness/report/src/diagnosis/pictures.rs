//! The pictures engineers think in: force over penetration, readings over time with what is left of them, restitution and
//! contact time over speed; measured, as given, recalibrated, with the physics found.

use super::words::unseen;
use chart::{alike, Chart, Page, Style};
use diagnose::courses::{Course, Impact};
use diagnose::run::Outcome;
use estimate::levels::nrmse;
use record::{Campaign, Channel, Kind};

/// Loops drawn at most beside that of the most informative recording.
const LOOPS: usize = 9;
/// Shares of the contact time shown before the touch and after leaving.
const BEFORE: f64 = 0.15;
const AFTER: f64 = 0.4;
/// The same where what was found acts there, at most.
const WIDE: f64 = 3.0;

const GIVEN: &str = "as given";
const RECALIBRATED: &str = "recalibrated";
const FOUND: &str = "physics found";
/// The same where a force stands in for what nobody has named.
const STAND_IN: &str = "with a stand-in";

/// The simulations there are, with name and style, each with all recordings.
pub(super) fn simulations(o: &Outcome) -> Vec<(&'static str, Style, &[Course])> {
    let c = &o.courses;
    let mut all = Vec::new();
    if let Some(given) = &c.given {
        all.push((GIVEN, Style::Given, &given[..]));
    }
    all.push((RECALIBRATED, Style::Before, &c.recalibrated[..]));
    if let Some(found) = &c.found {
        all.push((after(o), Style::After, &found[..]));
    }
    all
}

/// Times of recording `i` from its touch, s.
fn from_touch(c: &Campaign, o: &Outcome, i: usize) -> Vec<f64> {
    let touch = o.courses.contacts.get(i).map_or(0.0, |t| t.touch);
    let zero = if touch.is_finite() && c.kind != Kind::Indentation { touch } else { 0.0 };
    c.recordings[i].time.iter().map(|t| t - zero).collect()
}

fn time_axis(c: &Campaign) -> &'static str {
    if c.kind == Kind::Indentation {
        "time [s]"
    } else {
        "time from touch [s]"
    }
}

/// From when to when the first impact of recording `i` is shown, on its clock, s; None where there is none.
pub(super) fn pulse(c: &Campaign, o: &Outcome, i: usize) -> Option<(f64, f64)> {
    let t = o.courses.contacts.get(i)?;
    let long = t.leave - t.touch;
    if c.kind == Kind::Indentation || !long.is_finite() || long <= 0.0 {
        return None;
    }
    let time = &c.recordings[i].time;
    Some(((t.touch - BEFORE * long).max(*time.first()?), (t.leave + AFTER * long).min(*time.last()?)))
}

/// What of recording `i` is shown first: its pulse, and as much before and after it as shows where what was found acts.
fn window(c: &Campaign, o: &Outcome, i: usize) -> Option<(f64, f64)> {
    let (first, last) = pulse(c, o, i)?;
    let t = o.courses.contacts.get(i)?;
    let time = &c.recordings[i].time;
    let phases: Vec<&str> = o.verdict.mismatch.places.iter().map(|p| p.phase).collect();
    Some(widened((first, last), (t.touch, t.leave), (*time.first()?, *time.last()?), &phases))
}

/// The window `shown` of a contact, both s, with room for the `phases` beside it, as far as it was recorded.
fn widened(shown: (f64, f64), (touch, leave): (f64, f64), recorded: (f64, f64), phases: &[&str]) -> (f64, f64) {
    let beside = WIDE * (leave - touch);
    let first = if phases.contains(&"approach") { (touch - beside).max(recorded.0) } else { shown.0 };
    let last = if phases.contains(&"after") { (leave + beside).min(recorded.1) } else { shown.1 };
    (first.min(shown.0), last.max(shown.1))
}

/// Shows the pulse first, and where what was found acts, where there is one.
fn on_the_pulse(chart: Chart, c: &Campaign, o: &Outcome, i: usize) -> Chart {
    let touch = o.courses.contacts.get(i).map_or(0.0, |t| t.touch);
    match window(c, o, i) {
        Some((first, last)) => chart.focus(first - touch, last - touch),
        None => chart,
    }
}

/// What the simulation with what was found is called.
pub(super) fn after(o: &Outcome) -> &'static str {
    if o.verdict.missing.is_empty() {
        STAND_IN
    } else {
        FOUND
    }
}

/// The recording whose prediction gained most (or, with nothing found, fits worst).
fn most_informative(c: &Campaign, o: &Outcome) -> usize {
    let score = |i: usize| -> f64 {
        let of = |p: &[Vec<f64>; 3]| -> f64 {
            c.recordings[i].channels.iter().zip(p).filter_map(|(y, p)| nrmse(y.as_ref()?, p)).sum()
        };
        of(&o.before.predictions.judged[i]) - o.after.as_ref().map_or(0.0, |a| of(&a.predictions.judged[i]))
    };
    (0..c.recordings.len()).max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(0)
}

/// Name of a recording with its level.
fn named(c: &Campaign, i: usize) -> String {
    let r = &c.recordings[i];
    match c.levels.get(r.level) {
        Some(l) => format!("{}, {}", r.file, l.1),
        None => r.file.clone(),
    }
}

/// Force over penetration of recording `i`.
fn hysteresis(c: &Campaign, o: &Outcome, i: usize, title: &str) -> Chart {
    let time = from_touch(c, o, i);
    let mut chart = Chart::new(title, "penetration [m]", "force [N]");
    if let Some(m) = o.courses.measured.get(i) {
        chart = chart.curve("measured", &m.hysteresis.penetration, &m.hysteresis.force, &time, Style::Measured);
    }
    for (name, style, s) in simulations(o) {
        let Some(s) = s.get(i) else { continue };
        chart = chart.curve(name, &s.hysteresis.penetration, &s.hysteresis.force, &time, style);
    }
    chart
}

/// What a channel read of recording `i`, and as every simulation has it.
fn readings(c: &Campaign, o: &Outcome, i: usize, ch: Channel, title: &str) -> Option<Chart> {
    let r = &c.recordings[i];
    let y = r.channels[ch.index()].as_ref()?;
    let time = from_touch(c, o, i);
    let name = format!("{} [{}]", ch.name(), ch.unit());
    let mut chart = Chart::new(title, time_axis(c), &name).series("measured", &time, y, Style::Measured);
    for (name, style, s) in simulations(o) {
        let Some(s) = s.get(i) else { continue };
        chart = chart.series(name, &time, &s.readings[ch.index()], style);
    }
    if let Some((k, list)) = &o.findings.unclipped {
        if let Some(u) = list.iter().find(|u| *k == ch && u.file == r.file && u.clipped) {
            chart = chart.series("without clipping", &time, &u.curve, Style::Inferred);
        }
    }
    Some(on_the_pulse(chart, c, o, i))
}

/// What a channel read, less its zero as fitted to the recording, less what the recalibrated simulations have.
fn residual(c: &Campaign, o: &Outcome, i: usize, ch: Channel) -> Option<Chart> {
    let y = c.recordings[i].channels[ch.index()].as_ref()?;
    let time = from_touch(c, o, i);
    let zero = o.courses.zeros.get(i).map_or(0.0, |z| z[ch.index()]);
    let mut chart =
        Chart::new("", time_axis(c), &format!("measured \u{2212} simulated [{}]", ch.unit())).without_names();
    for (name, style, s) in simulations(o).into_iter().filter(|s| s.0 != GIVEN) {
        let Some(s) = s.get(i) else { continue };
        let less: Vec<f64> = y.iter().zip(&s.readings[ch.index()]).map(|(a, b)| a - zero - b).collect();
        chart = chart.series(name, &time, &less, style);
    }
    Some(on_the_pulse(chart, c, o, i))
}

/// How the pictures are to be read.
fn key(o: &Outcome) -> String {
    let given = match &o.courses.given {
        Some(_) => "As given: with k, p and mu_d of campaign.toml, and only the time of touch fitted. ",
        None => "campaign.toml gives no k and p, so that nothing is drawn as given. ",
    };
    let found = match (&o.courses.found, o.verdict.missing.is_empty()) {
        (None, _) => "",
        (_, false) => " Physics found: the same with what is named above.",
        (_, true) => " With a stand-in: the same with a force in the place of the cause that nobody has named.",
    };
    format!(
        "{given}Recalibrated: the best fit without new physics.{found} What is recalibrated is a prediction of {}. Measured \u{2212} \
         simulated is without the zeros fitted to the recording.",
        unseen(o).trim_end_matches(',')
    )
}

/// The most informative recording: its loop, and every channel over time with what is left of it.
pub fn first_sight(mut page: Page, c: &Campaign, o: &Outcome) -> Page {
    let i = most_informative(c, o);
    page = page.section("Force over penetration, and over time").paragraph(&key(o));
    let source = if o.courses.penetration_recorded {
        ""
    } else if o.courses.chain_bends {
        "no penetration was recorded, and the force, as its measuring chain was fitted, cannot be integrated to one: nothing measured is drawn"
    } else {
        "penetration measured: the force integrated twice, with the zero and the gain fitted to it"
    };
    let group = "most-informative";
    let mut charts = vec![hysteresis(c, o, i, &named(c, i)).size(600, 425).linked(group)];
    for ch in Channel::ALL {
        if c.kind == Kind::Indentation && ch == Channel::Penetration {
            continue;
        }
        let title = match ch {
            Channel::Force => "Force",
            Channel::Acceleration => "Acceleration",
            Channel::Penetration => "Penetration",
        };
        let (Some(of), Some(left)) = (readings(c, o, i, ch, title), residual(c, o, i, ch)) else { continue };
        charts.extend([of.size(600, 270).linked(group), left.size(600, 165).linked(group)]);
    }
    let mut charts = alike(charts).into_iter();
    page = page.stack(charts.next().map(|c| (c, source)).into_iter().collect());
    while let (Some(of), Some(left)) = (charts.next(), charts.next()) {
        page = page.stack(vec![(of, "over time"), (left, "")]);
    }
    loops(page, c, o, i)
}

/// The loop of every level but that of recording `shown`.
fn loops(mut page: Page, c: &Campaign, o: &Outcome, shown: usize) -> Page {
    let mut seen = vec![c.recordings[shown].level];
    let mut charts = Vec::new();
    for (i, r) in c.recordings.iter().enumerate() {
        if seen.contains(&r.level) || seen.len() > LOOPS {
            continue;
        }
        seen.push(r.level);
        charts.push(hysteresis(c, o, i, &named(c, i)).linked(&r.file));
    }
    if !charts.is_empty() {
        page = page.section("The loop, level by level");
    }
    alike(charts).iter().fold(page, |page, chart| page.chart(chart, ""))
}

/// Figures of the first impact over its speed.
pub fn over_speed(page: Page, c: &Campaign, o: &Outcome) -> Page {
    let speed: Vec<f64> = o.courses.contacts.iter().map(|t| t.speed).collect();
    let measured: Vec<&Course> = o.courses.measured.iter().collect();
    if !measured.iter().any(|m| m.impact.is_some()) {
        return page;
    }
    let read = match o.courses.force_from {
        Some(Channel::Acceleration) => "acceleration times mass",
        _ => "force",
    };
    let mut page = page.section("Restitution and contact time over impact speed").paragraph(&format!(
        "All read off the {read} of the first impact in one way, measured and simulated alike: restitution by {}, contact time \
         between the crossings of 5 % of the peak. {} recordings.",
        if c.system.is_some() { "the speeds of the penetration before and after" } else { "the impulse" },
        c.recordings.len()
    ));
    let restitutions = measured.iter().filter_map(|m| m.impact.as_ref()?.restitution);
    if let Some(remark) = impossible(restitutions) {
        page = page.paragraph(&remark);
    }
    type Figure = fn(&Impact) -> Option<f64>;
    let figures: [(&str, &str, Figure); 3] = [
        ("Restitution", "restitution [1]", |i| i.restitution),
        ("Contact time", "contact time [s]", |i| i.contact_time),
        ("Peak force", "peak force [N]", |i| Some(i.peak_force)),
    ];
    for (title, axis, of) in figures {
        let values = |all: &mut dyn Iterator<Item = &Course>| -> Vec<f64> {
            all.map(|s| s.impact.as_ref().and_then(of).unwrap_or(f64::NAN)).collect()
        };
        let y = values(&mut measured.iter().copied());
        if y.iter().all(|v| v.is_nan()) {
            continue;
        }
        let mut chart = Chart::new(title, "speed at touch [m/s]", axis).linked("speed").marks(
            "measured",
            &speed,
            &y,
            Style::Measured,
        );
        for (name, style, s) in simulations(o) {
            chart = chart.marks(name, &speed, &values(&mut s.iter()), style);
        }
        page = page.chart(&chart, "");
    }
    page
}

/// A remark on those of the measured `restitutions`, 1, that are below 0 or above 1, as no contact alone has them; None where all lie
/// between.
fn impossible(restitutions: impl Iterator<Item = f64>) -> Option<String> {
    let outside: Vec<String> = restitutions.filter(|e| *e < 0.0 || *e > 1.0).map(|e| format!("{e:.2}")).collect();
    let (is, them) = if outside.len() == 1 { ("lies", "it") } else { ("lie", "them") };
    (!outside.is_empty()).then(|| {
        format!(
            "Measured restitutions outside 0 to 1 ({}) {is} beyond what a contact alone can do: read {them} as a sign that another force \
             acts on the body during the impact, that its speed before or after is not that of a free flight, or that the sign, zero or \
             scale of the channel is wrong.",
            outside.join(", ")
        )
    })
}

/// Every recording and channel, small.
pub fn all(mut page: Page, c: &Campaign, o: &Outcome) -> Page {
    let mut charts: Vec<(Chart, &str)> = Vec::new();
    for i in 0..c.recordings.len() {
        for ch in Channel::ALL {
            if let Some(chart) = readings(c, o, i, ch, &named(c, i)) {
                charts.push((chart.size(400, 230).linked(&format!("all {i}")), ch.name()));
            }
        }
    }
    let (charts, names): (Vec<Chart>, Vec<&str>) = charts.into_iter().unzip();
    for (chart, name) in alike(charts).iter().zip(names) {
        page = page.chart(chart, name);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restitutions_that_no_contact_has_are_remarked() {
        assert_eq!(impossible([0.0, 0.4, 1.0, f64::NAN].into_iter()), None);
        let one = impossible([-0.4, 0.5].into_iter()).unwrap();
        assert!(
            one.contains("(-0.40) lies") && impossible([-0.4, 2.86].into_iter()).unwrap().contains("(-0.40, 2.86) lie"),
            "{one}"
        );
    }

    #[test]
    fn what_acts_before_the_touch_is_in_the_picture() {
        let of = |phases: &[&str]| widened((0.9, 2.4), (1.0, 2.0), (-5.0, 4.0), phases);
        assert_eq!(of(&["loading", "unloading"]), (0.9, 2.4));
        assert_eq!(of(&["approach"]), (-2.0, 2.4));
        // no further than it was recorded
        assert_eq!(of(&["unloading", "after"]), (0.9, 4.0));
    }
}
