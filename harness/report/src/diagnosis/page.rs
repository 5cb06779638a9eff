//! report.html: what a test engineer reads in a minute, the sentence on top.

use super::card::{capital, card};
use super::files::Foot;
use super::handed;
use super::words::{bias, cause, ends, holds_learned, on_body, plain, probability, sensors, share, sigmas, through};
use super::{pictures, rating};
use crate::trace;
use chart::{alike, interval, Chart, Datum, Heat, Page, Style};
use diagnose::phases::PHASES;
use diagnose::run::Outcome;
use diagnose::verdict::{Cause, LevelFit, Missing, Parameter};
use record::{Campaign, Channel, Kind};

/// The whole report.
pub fn html(c: &Campaign, o: &Outcome, foot: &Foot<'_>) -> String {
    let v = &o.verdict;
    let mut page = Page::new(&format!("Diagnosis of {}", c.name)).card(&card(o));
    if foot.is_listed {
        page = page.up("../index.html", "All campaigns");
    }
    let predicted = !o.before.predictions.judged.is_empty();
    if v.invalid.is_none() {
        page = pictures::first_sight(page, c, o);
        page = pictures::over_speed(page, c, o);
        page = levels(page, o);
        page = rating::table(page, c, o);
        page = heat(page, c, o);
        page = causes(page, o);
        for m in &v.missing {
            page = mechanism(page, m);
        }
        page = clipping(page, c, o);
        page = other_sensors(page, o);
        page = experiments(page, o);
        page = learned(page, o);
        page = learned_in_motion(page, o);
        page = latent(page, o);
        page = bias_table(page, c, o);
        page = element(page, o);
        page = body_force(page, o);
        page = candidates(page, o);
        page = facts(page, c, o);
    }
    if !o.findings.caveats.is_empty() {
        page = page.section("To know before believing this").list(&o.findings.caveats);
    }
    if predicted {
        page = page
            .section("Every recording")
            .folded("Show every recording, predicted without its own level", |p| pictures::all(p, c, o));
    }
    let rows = match &v.trace {
        Some(t) => trace::rows(foot.made, t),
        None => foot.made.rows(),
    };
    page.trace(&rows).html()
}

/// Every level predicted without itself: misfit of each channel in its unit, and in multiples of its noise.
fn levels(page: Page, o: &Outcome) -> Page {
    let all = &o.verdict.fit.levels;
    if all.is_empty() {
        return page;
    }
    let found = o.after.is_some();
    let mut page = page
        .section("Misfit of every level, predicted without it")
        .paragraph("Root mean square of reading less prediction, and the same in multiples of the channel's noise.");
    for channel in Channel::ALL.map(Channel::name) {
        let row = |l: &LevelFit| {
            let c = l.channels.iter().find(|c| c.channel == channel)?;
            let many = Datum::said(l.recordings as f64, "1", &l.recordings.to_string());
            let mut row = vec![l.level.clone().into(), many, Datum::number(c.noise, c.unit)];
            row.extend([Datum::number(c.rms.before, c.unit), Datum::fixed(c.over_noise.before, 1)]);
            if found {
                row.extend([Datum::number(c.rms.after, c.unit), Datum::fixed(c.over_noise.after, 1)]);
            }
            Some(row)
        };
        let rows: Vec<Vec<Datum>> = all.iter().filter_map(row).collect();
        if rows.is_empty() {
            continue;
        }
        let first = format!("{channel}, level");
        let mut head = vec![&first, "recordings", "noise", "recalibrated", "over noise"];
        if found {
            head.extend([pictures::after(o), "over noise"]);
        }
        page = page.values(&head, &rows);
    }
    page
}

fn facts(page: Page, c: &Campaign, o: &Outcome) -> Page {
    let kind = match c.kind {
        Kind::DropTest => "drop test",
        Kind::ContactorOpening => "contactor opening",
        Kind::Indentation => "indentation",
        Kind::System => "system of FMUs",
    };
    let alarm = o.verdict.mismatch.false_alarm_probability;
    let by = match &o.findings.bootstrap {
        Some(b) => format!("{alarm:.3} ({} nulls simulated)", b.nulls),
        None if o.findings.alarm.is_some_and(|a| a.as_bad > 0) => format!("{alarm:.3} (nulls of the residual)"),
        None if o.findings.alarm.is_some() && alarm < 1e-6 => "below 1e-6 (tail of nulls of the residual)".into(),
        None if o.findings.alarm.is_some() => format!("{alarm:.1e} (tail of nulls of the residual)"),
        None if alarm < 1e-6 => "below 1e-6 (theory)".into(),
        None => format!("{alarm:.1e} (theory)"),
    };
    let after = o.after.as_ref().map_or("-".into(), |a| Datum::percent(a.nrmse, 3));
    page.section("The campaign").values(
        &["campaign", "recordings", "levels", "misfit of range before, held out", "after", "false-alarm probability"],
        &[vec![
            kind.into(),
            Datum::said(c.recordings.len() as f64, "1", &c.recordings.len().to_string()),
            c.levels.iter().map(|l| l.1.clone()).collect::<Vec<_>>().join(", ").into(),
            Datum::percent(o.before.nrmse, 3),
            after,
            Datum::said(alarm, "1", &by),
        ]],
    )
}

/// What may be the cause, and how probable each is.
fn causes(page: Page, o: &Outcome) -> Page {
    /// Probability from which a cause is listed.
    const LISTED: f64 = 0.005;
    let v = &o.verdict;
    let row = |c: &Cause| {
        let held = v.credible_set.iter().any(|s| s.mechanisms == c.mechanisms);
        let sure = Datum::said(c.probability, "1", &probability(c.probability));
        vec![cause(&c.mechanisms).into(), sure, if held { "yes" } else { "" }.into()]
    };
    let rows: Vec<Vec<Datum>> = v.posterior.iter().filter(|c| c.probability >= LISTED).map(row).collect();
    if rows.is_empty() {
        return page;
    }
    page.section("Causes weighed").values(&["cause", "probability", "among those that hold the cause with 95 %"], &rows)
}

fn heat(mut page: Page, c: &Campaign, o: &Outcome) -> Page {
    let map = &o.findings.map;
    if map.is_empty() {
        return page;
    }
    page = page.section("Where the mismatch sits");
    for w in &o.verdict.mismatch.places {
        page = page.paragraph(&format!("In the {}: {}.", w.origin, plain(&w.text)));
    }
    let channels: Vec<Channel> = Channel::ALL.into_iter().filter(|ch| map.iter().any(|m| m.channel == *ch)).collect();
    let phases: Vec<usize> = (0..4).filter(|p| map.iter().any(|m| m.phase == *p)).collect();
    let columns: Vec<String> =
        channels.iter().flat_map(|c| phases.iter().map(move |p| format!("{}\n{}", short(*c), PHASES[*p]))).collect();
    let table = |title: &str, after: bool| {
        let mut h = Heat::new(title, &columns);
        for (l, (_, name)) in c.levels.iter().enumerate() {
            let values: Vec<Option<f64>> = channels
                .iter()
                .flat_map(|ch| phases.iter().map(move |p| (*ch, *p)))
                .map(|(ch, p)| {
                    let cell = map.iter().find(|m| m.level == l && m.phase == p && m.channel == ch)?;
                    Some(if after { cell.after } else { cell.before })
                })
                .collect();
            h = h.row(name, &values);
        }
        h
    };
    page = page
        .paragraph("Misfit over noise by level, channel and phase, all recordings fitted; 1 is noise alone.")
        .heat(&table("Recalibrated", false));
    if o.after.is_some() {
        page = page.heat(&table(
            if o.verdict.missing.is_empty() { "With a stand-in for the unknown" } else { "With the physics found" },
            true,
        ));
    }
    page
}

fn short(c: Channel) -> &'static str {
    match c {
        Channel::Force => "force",
        Channel::Acceleration => "accel.",
        Channel::Penetration => "penetr.",
    }
}

/// A mechanism named, its equation, and its parameters with their intervals.
pub(super) fn mechanism(page: Page, m: &Missing) -> Page {
    let between = |p: &Parameter| match p.ci95 {
        Some([low, high]) => Datum::interval(low, high, p.unit),
        None => ends(p, m.intervals_by, interval).into(),
    };
    let row = |(n, p): (&String, &Parameter)| vec![plain(n).into(), Datum::number(p.value, p.unit), between(p)];
    let rows: Vec<Vec<Datum>> = m.parameters.iter().map(row).collect();
    page.section(&format!("{} ({})", capital(&plain(m.mechanism)), m.form))
        .paragraph(&format!("{}.", capital(m.sentence)))
        .paragraph(&format!("{} ({}).", capital(m.equation), m.source))
        .values(&["parameter", "value", &interval_by(m)], &rows)
}

fn clipping(page: Page, c: &Campaign, o: &Outcome) -> Page {
    let Some((channel, list)) = &o.findings.unclipped else { return page };
    let rows: Vec<Vec<Datum>> = list
        .iter()
        .filter(|u| u.clipped)
        .map(|u| {
            let level =
                c.recordings.iter().find(|r| r.file == u.file).map_or(String::new(), |r| c.levels[r.level].1.clone());
            let q = channel.unit();
            vec![
                u.file.clone().into(),
                level.into(),
                Datum::number(u.read, q),
                Datum::number(u.peak, q),
                Datum::interval(u.peak - 1.96 * u.sd, u.peak + 1.96 * u.sd, q),
            ]
        })
        .collect();
    page.section("The peak before the clip")
        .values(&["recording", "level", "largest reading", "peak without clipping", "95 % interval"], &rows)
        .paragraph(
            "The green curves show the channel without clipping; they are written to without_clipping/. Where the model \
             leaves more than noise, what it has beyond the limit is scaled until the readings add up to the change of speed.",
        )
}

fn other_sensors(mut page: Page, o: &Outcome) -> Page {
    for (a, words) in o.findings.sensors.iter().zip(sensors(o)) {
        let rows: Vec<Vec<Datum>> = a
            .readings
            .iter()
            .map(|r| {
                let q = a.channel.unit();
                vec![
                    r.file.clone().into(),
                    Datum::number(r.lag, "s"),
                    Datum::number(r.gain, "1"),
                    Datum::percent(r.before, 2),
                    Datum::percent(r.after, 2),
                    Datum::number(r.read, q),
                    Datum::number(r.expected, q),
                ]
            })
            .collect();
        page = page.section(&format!("Beside the sensor of {}", a.other)).paragraph(&words).values(
            &[
                "recording",
                "lag",
                "gain",
                "misfit of range without a lag",
                "with it",
                "largest reading",
                "by the other sensor, without a limit",
            ],
            &rows,
        );
    }
    page
}

fn experiments(mut page: Page, o: &Outcome) -> Page {
    for t in o.findings.ties.iter().flatten() {
        page = page.section(&format!("Collinear in these recordings: {}", plain(&t.set.join(", "))));
        page = page.paragraph(&format!(
            "The trace left after refit is {:.1} sigma long, the closest pair has a cosine of {:.4}: P(right) = {:.2}.",
            t.trace, t.rho, t.p_right
        ));
        if let Some(p) = t.proposals.first() {
            page = page.paragraph(&format!(
                "The experiment that parts them best: {}. Simulated, the names then lie {:.1} sigma apart and P(right) is {:.3}.",
                p.text, p.sigmas, p.p_right
            ));
        }
        let rows: Vec<Vec<Datum>> = t
            .proposals
            .iter()
            .map(|p| vec![p.name.into(), p.text.clone().into(), Datum::fixed(p.sigmas, 1), Datum::fixed(p.p_right, 3)])
            .collect();
        page = page.values(&["experiment", "what to do", "separation after refit [sigma]", "P(right) then"], &rows);
    }
    page
}

/// The law that was learned where no form explains what was read: its force beside the readings, and its classes.
fn learned(mut page: Page, o: &Outcome) -> Page {
    let Some(l) = o.learned.as_ref().filter(|l| l.leads) else { return page };
    page = page.section("What was learned: the force over depth").paragraph(&format!(
        "A sum of functions of depth, direction and time was fitted to the force, the least set that explains it. An elastic law \
         alone leaves {:.2} % of range, the law learned {:.2} %.",
        100.0 * l.of.elastic,
        100.0 * l.misfit
    ));
    let charts = first_of_levels(&l.courses, |c| c.level).map(|c| {
        let mut chart = Chart::new(&c.file, "penetration [m]", "force [N]")
            .curve("read", &c.depth, &c.read, &c.time, Style::Measured)
            .curve("law learned", &c.depth, &c.force, &c.time, Style::Inferred);
        for (class, part) in l.law().classes().zip(&c.parts) {
            chart = chart.curve(class.name, &c.depth, part, &c.time, Style::Given);
        }
        chart
    });
    for chart in alike(charts.collect()) {
        page = page.chart(&chart, "");
    }
    let classes = o.verdict.learned.iter().flat_map(|l| &l.classes);
    let row = |c: &diagnose::verdict::LearnedClass| {
        let name = c.mechanism.map_or("no name of the vocabulary".into(), plain);
        let sure = Datum::said(c.probability, "1", &probability(c.probability));
        vec![c.class.into(), name.into(), c.depends_on.clone().into(), sure]
    };
    page.values(&["class", "mechanism", "depends on", "probability"], &classes.map(row).collect::<Vec<_>>())
        .paragraph("learned/recordings/ holds every recording's curves, learned/law.csv the force over depth.")
}

/// Points of a curve that was learned.
const POINTS: usize = 201;

/// The force that was learned in motion: its curves, what it depends on, and what else was tried.
fn learned_in_motion(mut page: Page, o: &Outcome) -> Page {
    let Some(f) = &o.force else { return page };
    let law = o.verdict.learned.as_ref();
    let why = if o.verdict.missing.is_empty() {
        "No mechanism known explains what was read."
    } else {
        "What is named does not explain all that was read."
    };
    page = page.section("What was learned: a force of a shape of its own").paragraph(&format!(
        "{why} A force whose shape is free was fitted through the simulation, once for each thing that it may depend on; the \
         likeliest acts {}. The simulation as given leaves {:.2} % of range, with it {:.2} %.",
        f.words(),
        100.0 * law.map_or(f64::NAN, |l| l.misfit_elastic),
        100.0 * f.misfit
    ));
    for (columns, rows) in f.tables(POINTS) {
        let column = |i: usize| rows.iter().map(|r| r[i]).collect::<Vec<f64>>();
        let Some((over, curves)) = columns.split_first() else { continue };
        let x = column(0);
        let unit = |c: &str| c.rfind('[').map_or("", |i| &c[i..]).to_string();
        let mut chart = Chart::new("learned", over, &curves.first().map_or(String::new(), |c| unit(c)));
        for (i, name) in curves.iter().enumerate() {
            let name = name.rsplit_once(" [").map_or(*name, |n| n.0);
            chart = chart.series(name, &x, &column(i + 1), if i == 0 { Style::Inferred } else { Style::Given });
        }
        page = page.chart(&chart, "");
    }
    let classes = law.iter().flat_map(|l| &l.classes);
    let row = |c: &diagnose::verdict::LearnedClass| {
        let words = if c.mechanism.is_some() { c.depends_on.to_string() } else { format!("it acts {}", c.depends_on) };
        vec![c.class.into(), words.into(), Datum::said(c.probability, "1", &probability(c.probability))]
    };
    page.values(&["tried", "in words", "probability"], &classes.map(row).collect::<Vec<_>>())
        .paragraph(&format!(
            "learned/law.csv holds the curves; what was learned ends where the recordings end, and is held constant beyond. {}",
            holds_learned(o)
        ))
}

/// The first recording of each level.
fn first_of_levels<T>(all: &[T], level: impl Fn(&T) -> usize) -> impl Iterator<Item = &T> {
    let mut shown = Vec::new();
    all.iter().filter(move |r| {
        let level = level(r);
        let is_first = !shown.contains(&level);
        shown.push(level);
        is_first
    })
}

/// Head of the column of intervals.
fn interval_by(m: &Missing) -> String {
    match m.intervals_by.strip_prefix("none: ") {
        Some(why) => format!("95 % interval ({why})"),
        None => format!("95 % interval by {}", m.intervals_by),
    }
}

fn latent(mut page: Page, o: &Outcome) -> Page {
    let Some(l) = &o.findings.latent else { return page };
    page = page.section("Unexplained: the force it takes").paragraph(&l.text);
    let charts = first_of_levels(&l.records, |r| r.level).map(|r| {
        let low: Vec<f64> = r.force.iter().zip(&r.band).map(|(f, b)| f - b).collect();
        let high: Vec<f64> = r.force.iter().zip(&r.band).map(|(f, b)| f + b).collect();
        Chart::new(&r.file, "time [s]", &format!("d [{}]", l.place.unit())).band(&r.time, &low, &high).series(
            "d(t), 95 % band",
            &r.time,
            &r.force,
            Style::Inferred,
        )
    });
    for chart in alike(charts.collect()) {
        page = page.chart(&chart, "");
    }
    let rows: Vec<Vec<Datum>> = l.scores.iter().map(|(p, g)| vec![p.words().into(), Datum::fixed(*g, 0)]).collect();
    page.values(&["modelled as", "fall of chi^2, less twice the freedom spent"], &rows)
        .paragraph("Every recording's curve is in latent_force/.")
}

/// What the calibration had absorbed, beside what campaign.toml gives.
fn bias_table(page: Page, c: &Campaign, o: &Outcome) -> Page {
    if o.findings.bias.is_empty() {
        return page;
    }
    let moved = bias(o);
    let said = if moved.is_empty() {
        "The calibration had absorbed nothing beyond two sigma.".to_string()
    } else {
        format!("Calibrated without the missing physics, the simulation had been off: {}.", moved.join(", "))
    };
    let given = |name: &str| match name {
        "k" => c.simulation.k,
        "p" => c.simulation.p,
        "mu_d" => c.simulation.mu_d,
        _ => None,
    };
    let rows: Vec<Vec<Datum>> = o
        .findings
        .bias
        .iter()
        .map(|b| {
            vec![
                b.name.clone().into(),
                Datum::maybe(given(&b.name), &b.unit),
                Datum::number(b.before, &b.unit),
                Datum::number(b.after, &b.unit),
                Datum::said(b.percent / 100.0, "1", &share(b)),
                Datum::said(b.sigmas, "1", &sigmas(b.sigmas)),
            ]
        })
        .collect();
    page.section("How far the calibration had been biased").paragraph(&said).values(
        &["parameter", "as given", "recalibrated without it", "with it", "off by", "off by, over its error"],
        &rows,
    )
}

fn element(page: Page, o: &Outcome) -> Page {
    let Ok(p) = &o.element else { return page };
    let page = page
        .section("Back in the simulator: HysteresisContact.fmu")
        .paragraph(&format!("{}.", capital(&through(o, p))));
    handed::starts(page, o, p)
}

fn body_force(page: Page, o: &Outcome) -> Page {
    let Some(b) = &o.findings.on_body else { return page };
    let row =
        |(name, value, unit): &(&'static str, f64, &'static str)| vec![(*name).into(), Datum::number(*value, unit)];
    page.section("Back in the simulator: BodyForce.fmu")
        .paragraph(&format!("{}.", capital(&on_body(b))))
        .values(&["parameter", "start value"], &b.starts.iter().map(row).collect::<Vec<_>>())
}

fn candidates(page: Page, o: &Outcome) -> Page {
    let score = |h: Option<f64>| h.map_or("-".into(), |h| Datum::percent(h, 3));
    let none = || Datum::from("");
    let mut rows = vec![vec!["(recalibrated, none)".into(), none(), none(), score(Some(o.before.nrmse)), none()]];
    let wrong = o
        .findings
        .rivals
        .iter()
        .filter(|r| !r.chosen && !r.tied)
        .filter_map(|r| r.heldout.map(|h| (h, r.name.clone())))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    for r in o.findings.rivals.iter().take(12) {
        let mark = if r.chosen && !r.named {
            "stand-in for the unknown"
        } else if r.chosen {
            "named"
        } else if r.tied {
            "tied"
        } else if wrong.as_ref().is_some_and(|w| w.1 == r.name) {
            "best wrong name"
        } else {
            ""
        };
        rows.push(vec![
            format!("{} ({})", plain(&r.name), r.form).into(),
            r.origin.into(),
            Datum::fixed(r.gain, 1),
            score(r.heldout),
            mark.into(),
        ]);
    }
    page.section("Candidates, each alone")
        .values(&["mechanism (form)", "part", "fall of chi^2", "misfit of range, held out", ""], &rows)
        .paragraph("Held-out misfit is worked out for the names that matter; fall of chi^2 for all.")
}
