//! A scenario's summary: everything but the rows, written as summary.json.

use scenario::{recover, Balance, Bounce, Case, Event, Outcome, Recovered, SensorPeak};
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
    /// Whether Ctrl-C, or an FMU that failed, ended it.
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
    /// What distinguishes it from the others; empty for the only one.
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
    /// What the photo interrupters measure.
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

/// The times, and the speed they give beside the true one.
#[derive(Clone, Debug, Serialize)]
pub struct InterrupterSummary {
    /// Positions, m, negative above the stop.
    pub positions: Vec<f64>,
    /// Times as the clock gives them, s.
    pub times: Vec<f64>,
    /// What the last three give.
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
    let passed: Vec<(f64, f64)> = d.outcome.passages.iter().map(|(t, x)| (tick(*t), *x)).collect();
    let speed = d.outcome.bounces.first()?.impact_speed;
    let last: Option<&[(f64, f64); 3]> = passed.last_chunk();
    let recovered = last.and_then(recover);
    Some(InterrupterSummary {
        positions: passed.iter().map(|s| s.1).collect(),
        times: passed.iter().map(|s| s.0).collect(),
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
        stiffness: c.law.elastic.stiffness,
        exponent: c.law.elastic.exponent,
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
            let (k, p) = (c.law.elastic.stiffness, c.law.elastic.exponent);
            let free = (k / base.law.elastic.stiffness).powf(1.0 / (p + 1.0));
            comparison.push(ComparisonRow {
                name: if c.name.is_empty() { "the scenario's own".into() } else { c.name.clone() },
                stiffness: k,
                deepest: b.deepest,
                peak_force: b.peak_force,
                duration: b.duration,
                peak_ratio: b.peak_force / peak,
                free_ratio: (p == base.law.elastic.exponent).then_some(free),
            });
        }
        if let Some(way) = c.way().filter(|w| b.deepest > *w) {
            let of = if c.name.is_empty() { String::new() } else { format!("{}: ", c.name) };
            remarks.push(format!(
                "{of}a stiffness of {:.4e} N/m^p lets the body sink {:.1} mm, more than the {:.1} mm it moved before \
                 touch, under {:.0} N: no stop does that; look at the unit (1 N/mm is 1000 N/m)",
                c.law.elastic.stiffness,
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
