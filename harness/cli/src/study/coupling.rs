//! Error of an impact against macro-steps a contact, for every master and lookahead, against the exact impact.
//!
//! Two FMUs, our contact and our moving bar, both packed here; the bar flies freely (no spring, no magnet), so the
//! exact impact ([`law::impact`]) is the answer. The instant of touch falls on eight phases of a
//! macro-step; what counts is the worst of them.

pub use super::setups::{setups, Adapts, Case, Setup, CASES, PHASES};
use anyhow::{Context, Result};
use host::master::{
    run, Adapt, Bond, Feed, FmuSlave, Input, Lookahead, Moment, Network, Options, Outcome, Output, Part, Slave, Touch,
};
use host::{Fmu, Kind};
use law::impact::{impact, Impact};
use pack::Model;
use rayon::prelude::*;
use serde::Serialize;

/// Errors of one run, relative to the exact impact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Restitution, of itself.
    pub restitution: f64,
    /// Peak force, of itself; the largest of the force at communication points, by a parabola through three.
    pub peak: f64,
    /// Energy of the rebound, of the energy of the impact.
    pub energy: f64,
    /// Energy the FMU reports as dissipated, of the energy of the impact.
    pub reported: f64,
    /// Macro-steps in contact, tried ones included.
    pub steps: f64,
    /// Calls of fmi2DoStep in contact and shortly before, both FMUs.
    pub calls: f64,
}

impl Errors {
    /// The worse of both, steps and calls averaged by `share`.
    fn worse(self, o: Errors, share: f64) -> Errors {
        let most = |a: f64, b: f64| if a.abs() > b.abs() || a.is_nan() { a.abs() } else { b.abs() };
        Errors {
            restitution: most(self.restitution, o.restitution),
            peak: most(self.peak, o.peak),
            energy: most(self.energy, o.energy),
            reported: most(self.reported, o.reported),
            steps: self.steps + share * o.steps,
            calls: self.calls + share * o.calls,
        }
    }
}

/// Both FMUs, opened.
pub struct Pair {
    contact: Fmu,
    bar: Fmu,
    _folder: output::Scratch,
}

impl Pair {
    /// Packs and opens the contact and the bar.
    ///
    /// # Errors
    /// Where their libraries are not built.
    pub fn new() -> Result<Pair> {
        let folder = output::Scratch::new("study")?;
        let open = |m: Model| -> Result<Fmu> { Ok(Fmu::open(&m.into_folder(folder.path(), &[])?)?) };
        Ok(Pair { contact: open(Model::contact())?, bar: open(Model::moving_bar())?, _folder: folder })
    }

    /// Bar (penetration 0, velocity 1) and contact (force 2), connected, initialized with these values.
    ///
    /// # Errors
    /// Where an FMU refuses.
    pub fn network(&self, bar: &[(&str, f64)], contact: &[(&str, f64)]) -> Result<(Network, Vec<f64>)> {
        let reference = |f: &Fmu, name: &str| -> Result<u32> {
            let v = f.description().variable(name).filter(|v| v.kind == Kind::Real);
            Ok(v.with_context(|| format!("{} has no Real {name}", f.path().display()))?.value_reference)
        };
        let made = |f: &Fmu, name: &str, values: &[(&str, f64)], orders: u32| -> Result<Box<dyn Slave>> {
            let mut i = f.instantiate(name, false)?;
            for (n, v) in values {
                i.set_real(&[reference(f, n)?], &[*v])?;
            }
            i.setup_experiment(None, 0.0, None)?;
            i.enter_initialization()?;
            Ok(Box::new(FmuSlave::new(i, Some(orders))))
        };
        let input = |f: &Fmu, name: &str, source: usize| -> Result<Input> {
            let feed = Feed { source, factor: 1.0, offset: 0.0 };
            Ok(Input::real(name, reference(f, name)?, feed))
        };
        let output = |f: &Fmu, name: &str, depends: &[usize]| -> Result<Output> {
            Ok(Output::real(name, reference(f, name)?, depends.to_vec()))
        };
        let (b, c) = (&self.bar, &self.contact);
        let parts = vec![
            Part {
                name: "bar".into(),
                slave: made(b, "bar", bar, 3)?,
                inputs: vec![input(b, "force", 2)?],
                outputs: vec![output(b, "penetration", &[])?, output(b, "velocity", &[])?],
            },
            Part {
                name: "contact".into(),
                slave: made(c, "contact", contact, 1)?,
                inputs: vec![input(c, "penetration", 0)?, input(c, "velocity", 1)?],
                outputs: vec![output(c, "force", &[0, 1])?],
            },
        ];
        let mut n = Network::new(parts)?;
        let mut y = vec![0.0; n.count()];
        n.propagate(&mut y)?;
        for p in &mut n.parts {
            p.slave.ready()?;
        }
        n.propagate(&mut y)?;
        Ok((n, y))
    }

    /// The bond between them, with the work and energies both report.
    ///
    /// # Errors
    /// Where a variable is missing.
    pub fn bond(&self) -> Result<Bond> {
        let reference = |f: &Fmu, name: &str| -> Result<u32> {
            Ok(f.description().variable(name).with_context(|| format!("no {name}"))?.value_reference)
        };
        Ok(Bond {
            force: 2,
            velocity: 1,
            work: Some((0, reference(&self.bar, "work_on_contact")?)),
            energy: vec![
                (1, reference(&self.contact, "stored_energy")?),
                (1, reference(&self.contact, "dissipated_energy")?),
            ],
        })
    }

    fn options(&self, s: &Setup, fineness: f64, duration: f64, energy: f64) -> Result<Options> {
        let step = match s.adapts {
            None => duration / fineness,
            Some(_) => duration / 20.0,
        };
        let variable = s.located || s.adapts.is_some();
        let lookaheads = if variable && s.lookahead != 0.0 {
            let d = self.contact.description();
            let v = d.variable("lookahead_time").context("the contact has no lookahead_time")?;
            vec![Lookahead { part: 1, reference: v.value_reference, steps: s.lookahead }]
        } else {
            Vec::new()
        };
        Ok(Options {
            method: s.method,
            inputs: s.inputs,
            shape: s.shape,
            stop: 40.0 * duration,
            step,
            adapt: s.adapts.map(|a| match a {
                Adapts::Energy => Adapt::Energy { tolerance: fineness, floor: 0.01 * energy },
                Adapts::Doubling => Adapt::Doubling { tolerance: fineness },
            }),
            shortest: 1e-9 * duration,
            longest: if s.adapts.is_some() { duration } else { f64::INFINITY },
            touches: if s.located { vec![Touch { output: 0, level: 0.0 }] } else { Vec::new() },
            lookaheads,
            bonds: vec![self.bond()?],
            ..Options::default()
        })
    }

    /// One impact; `fineness` is macro-steps a contact, or the tolerance where the step adapts; `phase` from 0 to 1.
    ///
    /// # Errors
    /// Where an FMU refuses, or the master cannot go on.
    pub fn errors(&self, s: &Setup, c: &Case, fineness: f64, phase: f64) -> Result<Errors> {
        let exact = exact(c)?;
        let impact_energy = 0.5 * c.mass * c.speed * c.speed;
        let o = self.options(s, fineness, exact.duration, impact_energy)?;
        let away = (3.0 + phase) * o.step * c.speed;
        let bar = [("mass", c.mass), ("start_velocity", c.speed), ("start_penetration", -away)];
        let constant = if o.lookaheads.is_empty() { s.lookahead } else { 0.0 };
        let contact = [
            ("stiffness", c.stiffness),
            ("exponent", c.exponent),
            ("hysteresis_damping", c.damping),
            ("lookahead", constant),
        ];
        let (mut n, y) = self.network(&bar, &contact)?;
        let mut samples: Vec<(f64, f64)> = Vec::new();
        let (mut rebound, mut last) = (0.0, [0.0; 2]);
        let (mut first_call, mut calls, mut dissipated, mut first_step, mut steps) = (0, 0, 0.0, 0, 0);
        let energy = o.bonds[0].energy[1];
        let force =
            self.contact.description().variable("force_at_inputs").context("no force_at_inputs")?.value_reference;
        let done: Outcome = run(&mut n, &o, y, &mut |n: &mut Network, m: &Moment| {
            let [x, v] = [m.y[0], m.y[1]];
            samples.push((m.time, n.parts[1].slave.read(Kind::Real, force)?));
            if x <= 0.0 && v > 0.0 {
                (first_call, first_step) = (n.work.steps, m.steps);
            }
            (rebound, last) = (v, [x, v]);
            calls = n.work.steps;
            steps = m.steps;
            dissipated = n.parts[energy.0].slave.read(Kind::Real, energy.1)?;
            Ok(!(x <= 0.0 && v < 0.0))
        })?;
        if !done.interrupted {
            // never left: all is lost
            rebound = 0.0;
        }
        let tried =
            if done.steps > 0 { done.rejected as f64 * (steps - first_step) as f64 / done.steps as f64 } else { 0.0 };
        Ok(Errors {
            restitution: -rebound / c.speed / exact.restitution - 1.0,
            peak: peak(&samples) / exact.peak_force - 1.0,
            energy: 0.5 * c.mass * rebound * rebound / impact_energy - exact.restitution.powi(2),
            reported: (dissipated - exact.energy_lost) / impact_energy,
            steps: (steps - first_step) as f64 + tried,
            calls: (calls - first_call) as f64,
        })
    }

    /// The worst over all phases and cases; a run that fails counts as an error of 1.
    pub fn worst(&self, s: &Setup, cases: &[Case], fineness: f64) -> Errors {
        let total = (cases.len() * PHASES) as f64;
        let mut all = Errors::default();
        for c in cases {
            for i in 0..PHASES {
                let phase = (i as f64 + 0.5) / PHASES as f64;
                let failed =
                    Errors { restitution: 1.0, peak: 1.0, energy: 1.0, reported: 1.0, steps: fineness, calls: 0.0 };
                all = all.worse(self.errors(s, c, fineness, phase).unwrap_or(failed), 1.0 / total);
            }
        }
        all
    }
}

fn exact(c: &Case) -> Result<Impact> {
    impact(c.mass, c.speed, c.stiffness, c.exponent, c.damping).with_context(|| format!("{}: no such impact", c.name))
}

/// The largest of samples (time, value), by the parabola through it and its neighbours.
fn peak(samples: &[(f64, f64)]) -> f64 {
    let Some(i) = (0..samples.len()).max_by(|&a, &b| samples[a].1.total_cmp(&samples[b].1)) else { return 0.0 };
    if i == 0 || i + 1 >= samples.len() {
        return samples[i].1;
    }
    let ((a, fa), (b, fb), (c, fc)) = (samples[i - 1], samples[i], samples[i + 1]);
    let (p, q) = (a - b, c - b);
    if p >= 0.0 || q <= 0.0 {
        return fb;
    }
    let curve = ((fc - fb) / q - (fa - fb) / p) / (q - p);
    let slope = (fa - fb) / p - curve * p;
    if curve >= 0.0 {
        return fb;
    }
    fb - slope * slope / (4.0 * curve)
}

/// Macro-steps a contact that the study goes through.
pub const LADDER: [f64; 7] = [10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0];
/// Finer rungs, to find the least that a target takes.
const FINE: [f64; 30] = [
    5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0, 24.0, 28.0, 34.0, 40.0, 57.0, 80.0, 113.0, 160.0, 226.0, 320.0,
    453.0, 640.0, 905.0, 1280.0, 1810.0, 2560.0, 3620.0, 5120.0, 7240.0, 10240.0, 14480.0,
];
/// Tolerances that adaptive masters go through.
pub const TOLERANCES: [f64; 9] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// What was measured of one master.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Master.
    pub master: &'static str,
    /// Whether its step adapts: then `fineness` are tolerances.
    pub adapts: bool,
    /// Macro-steps a contact, or tolerances.
    pub fineness: Vec<f64>,
    /// Worst errors there.
    pub errors: Vec<Errors>,
    /// Least macro-steps a contact from which on restitution stays within 1e-3 and energy within 2e-3.
    pub steps_for_a_thousandth: Option<f64>,
    /// Least macro-steps a contact from which on restitution stays within 1e-6.
    pub steps_for_a_millionth: Option<f64>,
}

/// A body under gravity on a contact without damping, set down 0.1 % below its rest, for 2000 macro-steps, 40 a
/// period: how far from rest it gets at most, as a share of its depth there. 1e-3 is right.
#[derive(Clone, Debug, Serialize)]
pub struct Rest {
    /// Master.
    pub master: &'static str,
    /// Largest departure from the exact depth, as a share of it.
    pub moves: f64,
}

/// The study.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// The impacts.
    pub cases: Vec<Case>,
    /// A row a master.
    pub rows: Vec<Row>,
    /// Resting.
    pub rest: Vec<Rest>,
}

/// Runs the study; `done` is called as each master is.
///
/// # Errors
/// Where the FMUs cannot be packed or opened.
pub fn study(done: &(dyn Fn() + Sync)) -> Result<Study> {
    let setups = setups();
    let rows: Vec<Result<(Row, Rest)>> = setups
        .par_iter()
        .map(|s| {
            // FMI 2.0 promises nothing across threads: each thread opens its own
            let pair = Pair::new()?;
            let row = measure(&pair, s);
            let rest = Rest { master: s.name, moves: rest(&pair, s)? };
            done();
            Ok((row, rest))
        })
        .collect();
    let (rows, rest) = rows.into_iter().collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok(Study { cases: CASES.to_vec(), rows, rest })
}

fn measure(pair: &Pair, s: &Setup) -> Row {
    let fineness: Vec<f64> = if s.adapts.is_some() { TOLERANCES.to_vec() } else { LADDER.to_vec() };
    let errors: Vec<Errors> = fineness.iter().map(|f| pair.worst(s, &CASES, *f)).collect();
    let mut row = Row {
        master: s.name,
        adapts: s.adapts.is_some(),
        fineness,
        errors,
        steps_for_a_thousandth: None,
        steps_for_a_millionth: None,
    };
    let thousandth = |e: &Errors| e.restitution <= 1e-3 && e.energy <= 2e-3;
    let millionth = |e: &Errors| e.restitution <= 1e-6;
    if row.adapts {
        let least = |good: &dyn Fn(&Errors) -> bool| row.errors.iter().find(|e| good(e)).map(|e| e.steps);
        (row.steps_for_a_thousandth, row.steps_for_a_millionth) = (least(&thousandth), least(&millionth));
    } else {
        row.steps_for_a_thousandth = from_on(pair, s, &thousandth);
        if row.errors.last().is_some_and(|e| e.restitution < 1e-4) {
            row.steps_for_a_millionth = from_on(pair, s, &millionth);
        }
    }
    row
}

/// The coarsest rung that is good and has good ones after it.
fn from_on(pair: &Pair, s: &Setup, good: &dyn Fn(&Errors) -> bool) -> Option<f64> {
    let mut run = Vec::new();
    for n in FINE {
        if good(&pair.worst(s, &CASES, n)) {
            run.push(n);
            if run.len() > CONFIRMED {
                return Some(run[0]);
            }
        } else {
            run.clear();
        }
    }
    None
}

/// Finer rungs that have to be good too before a rung counts.
const CONFIRMED: usize = 2;

/// Largest departure of a body set down 0.1 % below its rest, as a share of its depth there; infinite where a run
/// fails.
///
/// # Errors
/// Where an FMU refuses.
pub fn rest(pair: &Pair, s: &Setup) -> Result<f64> {
    let c = CASES[2];
    let gravity = mechanisms::physics::GRAVITY;
    // the depth where k x^p = m g, as deep as the law gives it back
    let depth = (c.mass * gravity / c.stiffness).powf(1.0 / c.exponent);
    let period = std::f64::consts::TAU * (depth / (c.exponent * gravity)).sqrt();
    let mut o = pair.options(s, 20.0, 0.5 * period, 0.0)?;
    if let Some(Adapts::Energy | Adapts::Doubling) = s.adapts {
        o.adapt = Some(match s.adapts {
            Some(Adapts::Energy) => Adapt::Energy { tolerance: 1e-4, floor: 0.0 },
            _ => Adapt::Doubling { tolerance: 1e-6 },
        });
        o.longest = 0.5 * period / 20.0;
    }
    o.step = 0.5 * period / 20.0;
    o.stop = 2000.0 * o.step;
    let bar = [("mass", c.mass), ("gravity", gravity), ("start_penetration", 1.001 * depth)];
    let constant = if o.lookaheads.is_empty() { s.lookahead } else { 0.0 };
    let contact = [("stiffness", c.stiffness), ("exponent", c.exponent), ("lookahead", constant)];
    let (mut n, y) = pair.network(&bar, &contact)?;
    let mut moves = 0.0f64;
    let done = run(&mut n, &o, y, &mut |_, m| {
        moves = moves.max((m.y[0] / depth - 1.0).abs());
        Ok(moves < 1.0)
    });
    Ok(if done.is_ok() { moves } else { f64::INFINITY })
}
