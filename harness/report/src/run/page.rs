//! A scenario's page.

use super::lines::headline;
use super::summary::{Done, HeightRow, Summary};
use chart::{Chart, Datum, Page, Style};
use scenario::Row;

/// Most runs drawn in one chart.
const DRAWN: usize = 8;
/// Most impacts of a run in the table.
const IMPACTS: usize = 12;
/// Most rows of a table.
const TABLED: usize = 60;

fn label(d: &Done) -> String {
    if d.case.name.is_empty() {
        "contact".into()
    } else {
        d.case.name.clone()
    }
}

/// A chart of the first impact of every run, its cursor shared with the others of the kind.
fn of_impact(title: &str, axes: (&str, &str), done: &[Done], xy: impl Fn(&Row, f64) -> (f64, f64)) -> Chart {
    let mut c = Chart::new(title, axes.0, axes.1).linked("impact");
    for (i, d) in done.iter().enumerate().take(DRAWN) {
        let (start, end) = match d.outcome.bounces.first() {
            Some(b) => (b.touch, b.separation.unwrap_or(f64::INFINITY) + 0.1 * b.duration),
            None => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let zero = start.max(0.0);
        let rows = d.outcome.rows.iter().filter(|r| r.time >= start && r.time <= end);
        let (along, (x, y)): (Vec<f64>, (Vec<f64>, Vec<f64>)) = rows.map(|r| (r.time - zero, xy(r, zero))).unzip();
        c = if axes.0.starts_with("time") {
            c.series(&label(d), &x, &y, Style::Line(i))
        } else {
            c.curve(&label(d), &x, &y, &along, Style::Line(i))
        };
    }
    c
}

/// A chart of every run's rows over time, its cursor shared with the others of the kind.
fn over_time(title: &str, unit: &str, done: &[Done], y: impl Fn(&Row) -> f64) -> Chart {
    let mut c = Chart::new(title, "time [s]", unit).linked("run");
    for (i, d) in done.iter().enumerate().take(DRAWN) {
        let (t, y): (Vec<f64>, Vec<f64>) = d.outcome.rows.iter().map(|r| (r.time, y(r))).unzip();
        c = c.series(&label(d), &t, &y, Style::Line(i));
    }
    c
}

fn impacts(page: Page, s: &Summary) -> Page {
    let head =
        ["run", "touch", "speed", "deepest", "peak force", "duration", "restitution", "lost", "rebound", "from exact"];
    let mut rows: Vec<Vec<Datum>> = Vec::new();
    for r in &s.runs {
        for b in r.impacts.iter().take(IMPACTS) {
            rows.push(vec![
                r.name.clone().into(),
                Datum::number(b.touch, "s"),
                Datum::number(b.impact_speed, "m/s"),
                Datum::number(b.deepest, "m"),
                Datum::number(b.peak_force, "N"),
                Datum::number(b.duration, "s"),
                Datum::number(b.restitution, "1"),
                Datum::number(b.energy_lost, "J"),
                Datum::maybe(b.rebound_height, "m"),
                b.exact.map_or("-".into(), |e| Datum::said(e.worst(), "1", &format!("{:.1e}", e.worst()))),
            ]);
        }
    }
    rows.truncate(TABLED);
    let more = s.runs.iter().map(|r| r.impacts.len()).sum::<usize>() - rows.len();
    let page = page.section("Impacts").values(&head, &rows);
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
    let rows: Vec<Vec<Datum>> = s
        .by_height
        .iter()
        .take(TABLED)
        .map(|r| {
            vec![
                name(r).into(),
                Datum::number(r.drop_height, "m"),
                Datum::number(r.impact_speed, "m/s"),
                Datum::number(r.restitution, "1"),
                Datum::number(r.peak_force, "N"),
                Datum::number(r.deepest, "m"),
                Datum::number(r.duration, "s"),
            ]
        })
        .collect();
    let head = ["run", "height", "speed", "restitution", "peak force", "deepest", "duration"];
    page = page.section("By drop height").values(&head, &rows);
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
            c = c.marks(if n.is_empty() { "contact" } else { n }, &x, &y, Style::Line(i));
        }
        page = page.chart(&c, "by drop height");
    }
    page
}

fn sensors(mut page: Page, done: &[Done], s: &Summary) -> Page {
    let rows: Vec<Vec<Datum>> = s
        .runs
        .iter()
        .filter_map(|r| r.sensors.map(|p| (r, p)))
        .flat_map(|(r, p)| {
            [("force transducer", p.transducer), ("accelerometer times all masses", p.accelerometer)].map(|(n, p)| {
                vec![
                    r.name.clone().into(),
                    n.into(),
                    Datum::number(p.peak, "N"),
                    Datum::fixed(p.over_contact, 6),
                    Datum::fixed(p.over_contact_if_rigid, 6),
                    Datum::number(p.delay, "s"),
                ]
            })
        })
        .take(TABLED)
        .collect();
    if rows.is_empty() {
        return page;
    }
    let head = ["run", "sensor", "largest reading", "over contact", "the same if rigid", "later by"];
    page = page
        .section("What the sensors read")
        .paragraph(
            "The transducer sits above the tip, so it misses the force that stops the tip; its spring rings with the \
             tip's mass. The accelerometer's reading is turned into a force by all masses.",
        )
        .values(&head, &rows);
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
        page = page.chart(&c, &format!("what the sensors make of the contact force, {}", label(d)));
    }
    page
}

fn interrupter_table(page: Page, s: &Summary) -> Page {
    let rows: Vec<Vec<Datum>> = s
        .runs
        .iter()
        .filter_map(|r| r.photo_interrupters.as_ref().map(|p| (r, p)))
        .take(TABLED)
        .map(|(r, p)| {
            let times: Vec<String> = p.times.iter().map(|t| format!("{t:.9}")).collect();
            vec![
                r.name.clone().into(),
                times.join(", ").into(),
                Datum::maybe(p.recovered.map(|v| v.impact_speed), "m/s"),
                Datum::number(p.impact_speed, "m/s"),
                p.difference.map_or("-".into(), |d| Datum::said(d, "1", &format!("{d:.1e}"))),
                Datum::maybe(p.recovered.map(|v| v.acceleration), "m/s^2"),
            ]
        })
        .collect();
    if rows.is_empty() {
        return page;
    }
    let head = ["run", "times, s", "recovered speed", "true speed", "off by", "acceleration measured"];
    page.section("Photo interrupters")
        .paragraph("The speed at touch by constant acceleration through the last three times (Ahn and Ryu 2005).")
        .values(&head, &rows)
}

fn comparison(page: Page, s: &Summary) -> Page {
    if s.comparison.is_empty() {
        return page;
    }
    let rows: Vec<Vec<Datum>> = s
        .comparison
        .iter()
        .take(TABLED)
        .map(|c| {
            vec![
                c.name.clone().into(),
                Datum::number(c.stiffness, "N/m^p"),
                Datum::number(c.deepest, "m"),
                Datum::number(c.peak_force, "N"),
                Datum::number(c.duration, "s"),
                Datum::fixed(c.peak_ratio, 4),
                c.free_ratio.map_or("-".into(), |f| Datum::fixed(f, 4)),
            ]
        })
        .collect();
    let head = ["run", "stiffness", "deepest", "peak force", "duration", "peak over own", "if free, undamped"];
    page.section("Stiffnesses compared").values(&head, &rows)
}

fn energy(page: Page, done: &[Done], s: &Summary) -> Page {
    let Some(d) = done.first() else { return page };
    let column = |f: &dyn Fn(&Row) -> f64| -> Vec<f64> { d.outcome.rows.iter().map(f).collect() };
    let at = d.case.rig.places();
    let t = column(&|r| r.time);
    let mut c = Chart::new("Energy", "time [s]", "energy [J]")
        .linked("run")
        .series("kinetic", &t, &column(&|r| r.kinetic), Style::Line(0))
        .series("potential", &t, &column(&|r| r.potential), Style::Line(1))
        .series("stored in contact", &t, &column(&|r| r.stored), Style::Line(2))
        .series("dissipated in contact", &t, &column(&|r| r.dissipated), Style::Line(3));
    if d.case.rig.acts_on_the_way() || d.case.rig.count() == 3 {
        c = c.series("work on the way, heat in sensors", &t, &column(&|r| r.state[at.heat]), Style::Line(4));
    }
    let worst = s.runs.iter().filter_map(|r| r.energy.residual).fold(f64::NAN, f64::max);
    let motion = s.runs.iter().map(|r| r.energy.residual_of_motion).fold(0.0, f64::max);
    let balance = if worst.is_nan() {
        "the element does not report its energies".into()
    } else {
        format!("within {worst:.1e} of the largest energy with what the element reports")
    };
    page.section("Energy")
        .paragraph(&format!(
            "Kinetic, potential, stored and dissipated energy together stay what they were: {balance}, within \
             {motion:.1e} with the contact's work integrated along the motion."
        ))
        .chart(&c, &label(d))
}

/// The page of the runs done.
pub fn page(title: &str, done: &[Done], s: &Summary) -> Page {
    let mut p = Page::new(title);
    if s.interrupted {
        let text = format!("Interrupted: {} of {} runs, the last one as far as it came.", s.runs.len(), s.runs_asked);
        p = p.sentence(&text);
    }
    let first = headline(s);
    if !first.is_empty() {
        p = p.sentence(&first);
    }
    for r in s.remarks.iter().take(5) {
        p = p.sentence(r);
    }
    p = p.section("Contact force");
    let time = ("time from touch [s]", "force [N]");
    let time = of_impact("First impact over time", time, done, |r, zero| (r.time - zero, r.force));
    let depth = ("penetration [m]", "force [N]");
    let depth = of_impact("First impact over penetration", depth, done, |r, _| (r.state[0], r.force));
    p = p.chart(&time, "").chart(&depth, "");
    let several = done.iter().any(|d| d.outcome.bounces.len() > 1);
    if several {
        p = p.chart(&over_time("Every impact", "force [N]", done, |r| r.force), "");
    }
    let moves = done.iter().any(|d| d.case.way().is_some());
    if moves {
        p = p.section("Motion");
        let place = over_time("Position", "position [m]", done, |r| r.state[0]);
        let speed = over_time("Velocity", "velocity [m/s]", done, |r| r.state[1]);
        p = p.chart(&place, "the stop's surface is at 0").chart(&speed, "");
        if several {
            let mut c = Chart::new("Rebounds", "impact", "height [m]");
            for (i, d) in done.iter().enumerate().take(DRAWN) {
                let up = d.outcome.bounces.iter().enumerate();
                let (n, up): (Vec<f64>, Vec<f64>) =
                    up.filter_map(|(i, b)| b.rebound_height.map(|h| ((i + 1) as f64, h))).unzip();
                c = c.marks(&label(d), &n, &up, Style::Line(i));
            }
            p = p.chart(&c, "their height, by impact");
        }
    }
    p = impacts(p, s);
    p = comparison(p, s);
    p = heights(p, s);
    p = sensors(p, done, s);
    p = interrupter_table(p, s);
    energy(p, done, s)
}
