//! What a scenario came to: its summary, its page, its lines on the terminal.

use super::{Chart, Page, Style};
use crate::scenario::{recover, Balance, Bounce, Case, Event, Outcome, Recovered, Row, SensorPeak};
use serde::Serialize;

/// A run that was done.
pub struct Done<'a> {
    /// What was asked.
    pub case: &'a Case,
    /// What came out.
    pub outcome: &'a Outcome,
    /// What stood behind the contact.
    pub element: &'a str,
}

/// Everything but the rows; written as summary.json. Plain SI.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the scenario's file.
    pub scenario: String,
    /// Whether Ctrl-C ended it.
    pub interrupted: bool,
    /// Runs the file asks for.
    pub runs_asked: usize,
    /// Runs done, the last one perhaps in part.
    pub runs: Vec<RunSummary>,
    /// The first impact by tip and drop height, where there are several heights.
    pub by_height: Vec<HeightRow>,
    /// Every comparison beside the scenario's own stiffness.
    pub comparison: Vec<ComparisonRow>,
    /// What cannot be right.
    pub remarks: Vec<String>,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary {
    /// What tells it from the others; empty for the only one.
    pub name: String,
    /// Tip's name.
    pub tip: Option<String>,
    /// Drop height, m.
    pub drop_height: Option<f64>,
    /// All masses, kg.
    pub mass: f64,
    /// k, N/m^p.
    pub stiffness: f64,
    /// p.
    pub exponent: f64,
    /// What stood behind the contact.
    pub element: String,
    /// Steps accepted.
    pub steps: usize,
    /// Whether it came to rest on the stop.
    pub at_rest: bool,
    /// Whether it was cut short.
    pub interrupted: bool,
    /// Its impacts.
    pub impacts: Vec<Bounce>,
    /// Its energy balance, relative.
    pub energy: Balance,
    /// What the sensors make of the first impact.
    pub sensors: Option<SensorSummary>,
    /// What the photo interrupters tell.
    pub photo_interrupters: Option<InterrupterSummary>,
    /// What happened, in order.
    pub events: Vec<Event>,
}

/// Both sensors' peaks.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SensorSummary {
    /// Force transducer.
    pub transducer: SensorPeak,
    /// Accelerometer.
    pub accelerometer: SensorPeak,
}

/// The times, and the speed they tell beside the true one.
#[derive(Clone, Debug, Serialize)]
pub struct InterrupterSummary {
    /// Positions, m, negative above the stop.
    pub positions: Vec<f64>,
    /// Times as the clock tells them, s.
    pub times: Vec<f64>,
    /// What the last three tell.
    pub recovered: Option<Recovered>,
    /// True speed at touch, m/s.
    pub impact_speed: f64,
    /// Recovered over true, less one.
    pub difference: Option<f64>,
}

/// An impact by its height.
#[derive(Clone, Debug, Serialize)]
pub struct HeightRow {
    /// Tip's name.
    pub tip: Option<String>,
    /// Comparison's name.
    pub compare: Option<String>,
    /// Drop height, m.
    pub drop_height: f64,
    /// Speed at touch, m/s.
    pub impact_speed: f64,
    /// Restitution.
    pub restitution: f64,
    /// Largest contact force, N.
    pub peak_force: f64,
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Duration, s.
    pub duration: f64,
}

/// A stiffness beside the scenario's own.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonRow {
    /// The run it belongs to.
    pub name: String,
    /// k, N/m^p.
    pub stiffness: f64,
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Largest contact force, N.
    pub peak_force: f64,
    /// Duration, s.
    pub duration: f64,
    /// Its largest force over that of the scenario's own stiffness.
    pub peak_ratio: f64,
    /// The same for a free, undamped impact: (k/k0)^(1/(p+1)), where the exponent is the same.
    pub free_ratio: Option<f64>,
}

fn interrupters(d: &Done) -> Option<InterrupterSummary> {
    let p = d.case.interrupters?;
    let tick = |t: f64| if p.clock > 0.0 { (t / p.clock).round() * p.clock } else { t };
    let seen: Vec<(f64, f64)> = d.outcome.passages.iter().map(|(t, x)| (tick(*t), *x)).collect();
    let speed = d.outcome.bounces.first()?.impact_speed;
    let last: Option<&[(f64, f64); 3]> = seen.last_chunk();
    let recovered = last.and_then(recover);
    Some(InterrupterSummary {
        positions: seen.iter().map(|s| s.1).collect(),
        times: seen.iter().map(|s| s.0).collect(),
        recovered,
        impact_speed: speed,
        difference: recovered.map(|r| r.impact_speed / speed - 1.0),
    })
}

fn run_summary(d: &Done) -> RunSummary {
    let (c, o) = (d.case, d.outcome);
    let sensors = o.bounces.first().and_then(|b| o.sensors(c, b));
    RunSummary {
        name: c.name.clone(),
        tip: c.tip.clone(),
        drop_height: c.drop_height(),
        mass: c.rig.mass(),
        stiffness: c.law.stiffness,
        exponent: c.law.exponent,
        element: d.element.into(),
        steps: o.rows.len(),
        at_rest: o.at_rest,
        interrupted: o.interrupted,
        impacts: o.bounces.clone(),
        energy: o.balance.relative(),
        sensors: sensors.map(|(transducer, accelerometer)| SensorSummary { transducer, accelerometer }),
        photo_interrupters: interrupters(d),
        events: o.events.clone(),
    }
}

/// The summary of the runs done.
pub fn summary(scenario: &str, done: &[Done], asked: usize, interrupted: bool) -> Summary {
    let mut by_height = Vec::new();
    let mut comparison = Vec::new();
    let mut remarks = Vec::new();
    let several = {
        let mut heights: Vec<f64> = done.iter().filter_map(|d| d.case.drop_height()).collect();
        heights.dedup();
        heights.len() > 1
    };
    let mut own: Option<(&Case, f64)> = None;
    for d in done {
        let Some(b) = d.outcome.bounces.first() else { continue };
        let c = d.case;
        if let (true, Some(h)) = (several, c.drop_height()) {
            by_height.push(HeightRow {
                tip: c.tip.clone(),
                compare: c.compare.clone(),
                drop_height: h,
                impact_speed: b.impact_speed,
                restitution: b.restitution,
                peak_force: b.peak_force,
                deepest: b.deepest,
                duration: b.duration,
            });
        }
        if c.compare.is_none() {
            own = Some((c, b.peak_force));
        }
        let compared = c.compare.is_some() || done.iter().any(|e| e.case.compare.is_some());
        if let (true, Some((base, peak))) = (compared, own) {
            let (k, p) = (c.law.stiffness, c.law.exponent);
            let free = (k / base.law.stiffness).powf(1.0 / (p + 1.0));
            comparison.push(ComparisonRow {
                name: if c.name.is_empty() { "the scenario's own".into() } else { c.name.clone() },
                stiffness: k,
                deepest: b.deepest,
                peak_force: b.peak_force,
                duration: b.duration,
                peak_ratio: b.peak_force / peak,
                free_ratio: (p == base.law.exponent).then_some(free),
            });
        }
        if let Some(way) = c.way().filter(|w| b.deepest > *w) {
            let of = if c.name.is_empty() { String::new() } else { format!("{}: ", c.name) };
            remarks.push(format!(
                "{of}a stiffness of {:.4e} N/m^p lets the body sink {:.1} mm, more than the {:.1} mm it moved before \
                 touch, under {:.0} N: no stop does that; look at the unit (1 N/mm is 1000 N/m)",
                c.law.stiffness,
                1e3 * b.deepest,
                1e3 * way,
                b.peak_force
            ));
        }
    }
    Summary {
        scenario: scenario.into(),
        interrupted,
        runs_asked: asked,
        runs: done.iter().map(run_summary).collect(),
        by_height,
        comparison,
        remarks,
    }
}

/// What the terminal gets: a line an impact, then comparisons, sensors, interrupters and remarks.
pub fn lines(done: &[Done], s: &Summary) -> Vec<String> {
    let mut out = Vec::new();
    const SHOWN: usize = 10;
    for (r, d) in s.runs.iter().zip(done).take(2 * SHOWN) {
        let of = if r.name.is_empty() { String::new() } else { format!("{}: ", r.name) };
        for (i, b) in r.impacts.iter().enumerate().take(SHOWN) {
            let mut line = format!(
                "{of}impact {}: {:.6} m/s, deepest {:.6e} m, peak {:.6e} N, restitution {:.6}, lasts {:.6e} s",
                i + 1,
                b.impact_speed,
                b.deepest,
                b.peak_force,
                b.restitution,
                b.duration
            );
            if let Some(e) = &b.exact {
                line += &format!("; {:.1e} from exact", e.worst());
            }
            out.push(line);
        }
        if r.impacts.len() > SHOWN {
            out.push(format!("{of}{} impacts in all", r.impacts.len()));
        }
        if r.at_rest {
            out.push(format!("{of}at rest after {:.6} s", d.outcome.rows.last().map_or(0.0, |r| r.time)));
        }
        if let Some(p) = &r.sensors {
            for (name, p) in [("transducer", p.transducer), ("accelerometer", p.accelerometer)] {
                out.push(format!(
                    "{of}{name} tells {:.4} of the contact's peak ({:.4} if rigid), {:.3e} s later",
                    p.over_contact, p.over_contact_if_rigid, p.delay
                ));
            }
        }
        if let Some(p) = &r.photo_interrupters {
            if let (Some(v), Some(off)) = (p.recovered, p.difference) {
                out.push(format!("{of}photo interrupters tell {:.6} m/s, {off:.1e} from true", v.impact_speed));
            }
        }
    }
    if s.runs.len() > 2 * SHOWN {
        out.push(format!("{} runs in all: see summary.json", s.runs.len()));
    }
    for c in s.comparison.iter().filter(|c| c.peak_ratio != 1.0).take(SHOWN) {
        let free = c.free_ratio.map_or(String::new(), |f| format!(" ({f:.3} for a free impact)"));
        out.push(format!("{}: peak {:.3} times the scenario's own{free}", c.name, c.peak_ratio));
    }
    out.extend(s.remarks.iter().take(SHOWN).map(|r| format!("remark: {r}")));
    out
}

/// Most runs drawn in one chart.
const DRAWN: usize = 8;
/// Most rows of a table.
const TABLED: usize = 60;

fn label(d: &Done) -> String {
    if d.case.name.is_empty() {
        "contact".into()
    } else {
        d.case.name.clone()
    }
}

/// A chart of every run's rows.
fn chart(title: &str, axes: (&str, &str), done: &[Done], xy: impl Fn(&Row) -> (f64, f64), during: bool) -> String {
    let mut c = Chart::new(title, axes.0, axes.1);
    for (i, d) in done.iter().enumerate().take(DRAWN) {
        let b = d.outcome.bounces.first();
        let (start, end) = match (during, b) {
            (true, Some(b)) => (b.touch, b.separation.unwrap_or(f64::INFINITY) + 0.1 * b.duration),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let zero = if during { start.max(0.0) } else { 0.0 };
        let rows = d.outcome.rows.iter().filter(|r| r.time >= start && r.time <= end);
        let (x, y): (Vec<f64>, Vec<f64>) =
            rows.map(|r| if axes.0.starts_with("time") { (r.time - zero, xy(r).1) } else { xy(r) }).unzip();
        c = c.series(&label(d), &x, &y, Style::Line(i));
    }
    c.svg()
}

fn number(v: f64) -> String {
    format!("{v:.6e}")
}

fn impacts(page: Page, s: &Summary) -> Page {
    let head = [
        "run",
        "touch, s",
        "speed, m/s",
        "deepest, m",
        "peak force, N",
        "duration, s",
        "restitution",
        "lost, J",
        "rebound, m",
        "from exact",
    ];
    let mut rows: Vec<Vec<String>> = Vec::new();
    for r in &s.runs {
        for b in &r.impacts {
            let mut row = vec![r.name.clone()];
            let f = [b.touch, b.impact_speed, b.deepest, b.peak_force, b.duration, b.restitution, b.energy_lost];
            row.extend(f.iter().map(|v| number(*v)));
            row.push(b.rebound_height.map_or("-".into(), number));
            row.push(b.exact.map_or("-".into(), |e| format!("{:.1e}", e.worst())));
            rows.push(row);
        }
    }
    let more = rows.len().saturating_sub(TABLED);
    rows.truncate(TABLED);
    let page = page.section("Impacts").table(&head, &rows);
    if more > 0 {
        page.paragraph(&format!("{more} more impacts are in summary.json."))
    } else {
        page
    }
}

fn heights(mut page: Page, s: &Summary) -> Page {
    if s.by_height.is_empty() {
        return page;
    }
    let name = |r: &HeightRow| [r.tip.clone(), r.compare.clone()].into_iter().flatten().collect::<Vec<_>>().join(", ");
    let rows: Vec<Vec<String>> = s
        .by_height
        .iter()
        .take(TABLED)
        .map(|r| {
            let f = [r.drop_height, r.impact_speed, r.restitution, r.peak_force, r.deepest, r.duration];
            std::iter::once(name(r)).chain(f.iter().map(|v| number(*v))).collect()
        })
        .collect();
    let head = ["run", "height, m", "speed, m/s", "restitution", "peak force, N", "deepest, m", "duration, s"];
    page = page.section("By drop height").table(&head, &rows);
    let mut names: Vec<String> = s.by_height.iter().map(name).collect();
    names.sort();
    names.dedup();
    for (title, unit, of) in [
        ("Peak force", "peak force [N]", (|r| r.peak_force) as fn(&HeightRow) -> f64),
        ("Restitution", "restitution [1]", |r| r.restitution),
    ] {
        let mut c = Chart::new(title, "drop height [m]", unit);
        for (i, n) in names.iter().enumerate().take(DRAWN) {
            let mut at: Vec<(f64, f64)> =
                s.by_height.iter().filter(|r| name(r) == *n).map(|r| (r.drop_height, of(r))).collect();
            at.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (x, y): (Vec<f64>, Vec<f64>) = at.into_iter().unzip();
            c = c.series(if n.is_empty() { "contact" } else { n }, &x, &y, Style::Line(i));
        }
        page = page.figure(&c.svg(), &format!("{title} by drop height"));
    }
    page
}

fn sensors(mut page: Page, done: &[Done], s: &Summary) -> Page {
    let rows: Vec<Vec<String>> = s
        .runs
        .iter()
        .filter_map(|r| r.sensors.map(|p| (r, p)))
        .flat_map(|(r, p)| {
            [("force transducer", p.transducer), ("accelerometer times all masses", p.accelerometer)].map(|(n, p)| {
                vec![
                    r.name.clone(),
                    n.into(),
                    number(p.peak),
                    format!("{:.6}", p.over_contact),
                    format!("{:.6}", p.over_contact_if_rigid),
                    number(p.delay),
                ]
            })
        })
        .take(TABLED)
        .collect();
    if rows.is_empty() {
        return page;
    }
    let head = ["run", "sensor", "largest reading, N or m/s^2", "over contact", "the same if rigid", "later by, s"];
    page = page
        .section("What the sensors read")
        .paragraph(
            "The transducer sits above the tip, so it misses the force that stops the tip; its spring rings with the \
             tip's mass. The accelerometer's reading is turned into a force by all masses.",
        )
        .table(&head, &rows);
    for d in done.iter().take(2) {
        let Some(b) = d.outcome.bounces.first() else { continue };
        let end = b.separation.unwrap_or(f64::INFINITY) + 0.5 * b.duration;
        let rows: Vec<&Row> = d.outcome.rows.iter().filter(|r| r.time >= b.touch && r.time <= end).collect();
        let t: Vec<f64> = rows.iter().map(|r| r.time - b.touch).collect();
        let all = d.case.rig.mass();
        let read = |f: &dyn Fn((f64, f64)) -> f64| -> Vec<f64> {
            rows.iter().map(|r| d.case.rig.sensors(&r.state).map_or(f64::NAN, f)).collect()
        };
        let contact: Vec<f64> = rows.iter().map(|r| r.force).collect();
        let c = Chart::new("Sensors and contact", "time from touch [s]", "force [N]")
            .series("contact", &t, &contact, Style::Line(0))
            .series("transducer", &t, &read(&|s| s.0), Style::Line(1))
            .series("accelerometer x mass", &t, &read(&|s| -all * s.1), Style::Line(2));
        page = page.figure(&c.svg(), &format!("What the sensors make of the contact force, {}", label(d)));
    }
    page
}

fn interrupter_table(page: Page, s: &Summary) -> Page {
    let rows: Vec<Vec<String>> = s
        .runs
        .iter()
        .filter_map(|r| r.photo_interrupters.as_ref().map(|p| (r, p)))
        .take(TABLED)
        .map(|(r, p)| {
            let times: Vec<String> = p.times.iter().map(|t| format!("{t:.9}")).collect();
            vec![
                r.name.clone(),
                times.join(", "),
                p.recovered.map_or("-".into(), |v| number(v.impact_speed)),
                number(p.impact_speed),
                p.difference.map_or("-".into(), |d| format!("{d:.1e}")),
                p.recovered.map_or("-".into(), |v| number(v.acceleration)),
            ]
        })
        .collect();
    if rows.is_empty() {
        return page;
    }
    let head = ["run", "times, s", "recovered speed, m/s", "true speed, m/s", "off by", "acceleration told, m/s^2"];
    page.section("Photo interrupters")
        .paragraph("The speed at touch by constant acceleration through the last three times (Ahn and Ryu 2005).")
        .table(&head, &rows)
}

fn comparison(page: Page, s: &Summary) -> Page {
    if s.comparison.is_empty() {
        return page;
    }
    let rows: Vec<Vec<String>> = s
        .comparison
        .iter()
        .take(TABLED)
        .map(|c| {
            vec![
                c.name.clone(),
                number(c.stiffness),
                number(c.deepest),
                number(c.peak_force),
                number(c.duration),
                format!("{:.4}", c.peak_ratio),
                c.free_ratio.map_or("-".into(), |f| format!("{f:.4}")),
            ]
        })
        .collect();
    let head =
        ["run", "stiffness, N/m^p", "deepest, m", "peak force, N", "duration, s", "peak over own", "if free, undamped"];
    page.section("Stiffnesses compared").table(&head, &rows)
}

fn energy(page: Page, done: &[Done], s: &Summary) -> Page {
    let Some(d) = done.first() else { return page };
    let column = |f: &dyn Fn(&Row) -> f64| -> Vec<f64> { d.outcome.rows.iter().map(f).collect() };
    let at = d.case.rig.places();
    let t = column(&|r| r.time);
    let mut c = Chart::new("Energy", "time [s]", "energy [J]")
        .series("kinetic", &t, &column(&|r| r.kinetic), Style::Line(0))
        .series("potential", &t, &column(&|r| r.potential), Style::Line(1))
        .series("stored in contact", &t, &column(&|r| r.stored), Style::Line(2))
        .series("dissipated in contact", &t, &column(&|r| r.dissipated), Style::Line(3));
    if d.case.rig.friction > 0.0 || d.case.rig.count() == 3 {
        c = c.series("heat elsewhere", &t, &column(&|r| r.state[at.heat]), Style::Line(4));
    }
    let worst = s.runs.iter().filter_map(|r| r.energy.residual).fold(f64::NAN, f64::max);
    let motion = s.runs.iter().map(|r| r.energy.residual_of_motion).fold(0.0, f64::max);
    let told = if worst.is_nan() {
        "the element does not tell its energies".into()
    } else {
        format!("within {worst:.1e} of the largest energy with what the element tells")
    };
    page.section("Energy")
        .paragraph(&format!(
            "Kinetic, potential, stored and dissipated energy together stay what they were: {told}, within \
             {motion:.1e} with the contact's work integrated along the motion."
        ))
        .figure(&c.svg(), &format!("Energy against time, {}", label(d)))
}

/// The page of the runs done.
pub fn page(title: &str, done: &[Done], s: &Summary) -> Page {
    let mut p = Page::new(title);
    if s.interrupted {
        let text = format!("Interrupted: {} of {} runs, the last one as far as it came.", s.runs.len(), s.runs_asked);
        p = p.sentence(&text);
    }
    for r in s.remarks.iter().take(5) {
        p = p.sentence(r);
    }
    p = impacts(p, s);
    p = comparison(p, s);
    p = heights(p, s);
    p = p.section("Contact force");
    let time = chart("Force", ("time from touch [s]", "force [N]"), done, |r| (r.time, r.force), true);
    p = p.figure(&time, "Force against time, first impact");
    let depth = chart("Force", ("penetration [m]", "force [N]"), done, |r| (r.state[0], r.force), true);
    p = p.figure(&depth, "Force against penetration, first impact");
    let several = done.iter().any(|d| d.outcome.bounces.len() > 1);
    if several {
        let all = chart("Force", ("time [s]", "force [N]"), done, |r| (r.time, r.force), false);
        p = p.figure(&all, "Force against time, every impact");
    }
    let moves = done.iter().any(|d| d.case.way().is_some());
    if moves {
        p = p.section("Motion");
        let place = chart("Position", ("time [s]", "position [m]"), done, |r| (r.time, r.state[0]), false);
        p = p.figure(&place, "Position against time; the stop's surface is at 0");
        let speed = chart("Velocity", ("time [s]", "velocity [m/s]"), done, |r| (r.time, r.state[1]), false);
        p = p.figure(&speed, "Velocity against time");
        let (n, up): (Vec<f64>, Vec<f64>) = done
            .iter()
            .flat_map(|d| d.outcome.bounces.iter().enumerate())
            .filter_map(|(i, b)| b.rebound_height.map(|h| ((i + 1) as f64, h)))
            .unzip();
        if several && done.len() == 1 {
            let c = Chart::new("Rebounds", "impact", "height [m]").series("rebound", &n, &up, Style::Line(0));
            p = p.figure(&c.svg(), "Height of the rebound after each impact");
        }
    }
    p = sensors(p, done, s);
    p = interrupter_table(p, s);
    energy(p, done, s)
}
