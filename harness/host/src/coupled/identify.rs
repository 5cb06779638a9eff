//! What the forward model has to know of a system of FMUs, found out by running it.

use super::fit::{correlation, is_one, law, steady, Law, Sample};
use super::layout::{to_si, Layout};
use super::propose::{is_of, ACCELERATION};
use super::running::Moving;
use super::Fmus;
use crate::Causality;
use anyhow::{ensure, Result};
use mechanisms::physics::FREE;
use plant::machine::{Along, BondFacts, Facts, FreeFacts, Impact, Machine, NearLaw, Push, Reads, Running};
use record::{BondKind, Campaign, FmuSystem};

/// Steps over a sample of the recordings while the system is run as it is.
const STEPS: f64 = 2.0;
/// Most steps of such a run.
const MOST: f64 = 400_000.0;
/// How far a free variable is moved to see what it does, in its measure.
const MOVED: f64 = 0.02;
/// Change of ln stiffness with the logarithm of a variable from which it is taken to scale the stiffness.
const SCALES: f64 = 0.3;
/// Correlation from which an output is what it is compared with.
const ALIKE: f64 = 0.9;
const SAME: f64 = 0.98;
/// Times the largest acceleration reported from which a difference of the speed is a jump of it.
const JUMPS: f64 = 2.0;
/// Share of the way to the touch at which a force is tried.
const TRIED_AT: f64 = 0.7;
/// Share of the speed by which a tried force has to change it.
const FELT: f64 = 1e-3;
/// Share by which a mass by a derivative may part from the one that a tried force shows.
const AGREE: f64 = 0.02;
/// Farthest that a variable without bounds goes, in its measure; by its logarithm that of the factor: as far as the stiffness
/// goes where the exponent doubles.
const FARTHEST: f64 = 1e3;
const FARTHEST_FACTOR: f64 = 30.0;

/// The system as it ran in one recording, step by step.
#[derive(Default)]
struct Plain {
    time: Vec<f64>,
    /// (x, v, contact force) by bond.
    bonds: Vec<Vec<Sample>>,
    outputs: [Vec<f64>; 3],
}

impl Plain {
    fn note(&mut self, m: &Moving<'_>) {
        self.time.push(m.elapsed());
        for (b, list) in self.bonds.iter_mut().enumerate() {
            let (x, v) = m.motion(b);
            list.push((x, v, m.contact(b)));
        }
        for (c, list) in self.outputs.iter_mut().enumerate() {
            list.push(m.output(c));
        }
    }

    /// Index of the first instant inside at a bond.
    fn touch(&self, b: usize) -> Option<usize> {
        let all = self.bonds.get(b)?;
        (1..all.len()).find(|i| all[*i].0 > 0.0 && all[i - 1].0 <= 0.0)
    }

    /// How the force on the body at bond `b` falls with position, N/m, and speed, N s/m, where nothing touches; `fed`: it is
    /// given what pushes. Zero where that does not make the force steadier by far.
    fn spring(&self, b: usize, mass: f64, fed: bool) -> (f64, f64) {
        let a = self.acceleration(b);
        let flight = self.bonds[b].iter().skip(1).zip(&a).filter(|(s, _)| s.0 < 0.0 && s.1 != 0.0);
        let rows: Vec<(f64, f64, f64)> =
            flight.map(|(s, a)| (s.0, s.1, mass * a + if fed { s.2 } else { 0.0 })).collect();
        steady(&rows)
    }

    /// Whether the force on the body at bond `b` depends on position and speed beyond the surface as it does in flight: then nothing
    /// touches there.
    fn goes_on(&self, b: usize, mass: f64) -> bool {
        let rows = self.bonds[b].iter().skip(1).zip(self.acceleration(b)).map(|(s, a)| (s.0, s.1, mass * a));
        let (beyond, before): (Vec<Sample>, Vec<Sample>) = rows.partition(|s| s.0 > 0.0);
        is_one([&before, &beyond])
    }

    /// Acceleration at a bond by differences, at every instant but the first and the last.
    fn acceleration(&self, b: usize) -> Vec<f64> {
        let (v, t) = (&self.bonds[b], &self.time);
        (1..t.len().saturating_sub(1)).map(|i| (v[i + 1].1 - v[i - 1].1) / (t[i + 1] - t[i - 1])).collect()
    }
}

/// Step of a plain run, s.
fn step_of(l: &Layout, interval: f64) -> f64 {
    fixed_step(l).unwrap_or(interval / STEPS)
}

/// The step that the FMUs need, where they take no other.
fn fixed_step(l: &Layout) -> Option<f64> {
    let fixed = l.opened.iter().any(|o| !o.fmu.capabilities().can_handle_variable_communication_step_size);
    let preferred = l.opened.iter().filter_map(|o| o.description().step_size).filter(|h| *h > 0.0);
    let step = l.system.master.step.unwrap_or_else(|| preferred.fold(f64::INFINITY, f64::min));
    (fixed && step.is_finite()).then_some(step)
}

/// A plain step: every bond is given what fed it at the step's start.
fn step(m: &mut Moving<'_>, l: &Layout, h: f64, more: Option<(usize, f64)>) -> Result<()> {
    let pushes: Vec<Push> = (0..l.bonds.len())
        .map(|b| {
            let fed = if l.bonds[b].source.is_some() { m.contact(b) } else { 0.0 };
            let f = fed + more.filter(|(c, _)| *c == b).map_or(0.0, |m| m.1);
            Push { start: f, slope: 0.0, end: f }
        })
        .collect();
    m.advance(h, &pushes)?;
    let faces: Vec<(f64, f64)> = (0..l.bonds.len()).map(|b| m.motion(b)).collect();
    m.follow(&faces)
}

/// What is being found out.
struct Identify<'a> {
    fmus: &'a Fmus,
    of: &'a FmuSystem,
    /// By recording: time between samples and length, s.
    recordings: Vec<(f64, f64)>,
}

impl Identify<'_> {
    fn layout(&self) -> &Layout {
        &self.fmus.layout
    }

    /// Runs recording `set` with the free variables at `values`, for its length.
    fn plain(&self, set: usize, values: &[f64]) -> Result<Plain> {
        let (interval, length) = self.recordings[set];
        let l = self.layout();
        let h = step_of(l, interval);
        let n = (length / h).ceil();
        ensure!(n <= MOST, "a recording takes {n} steps of {h} s; give [master] of the system a longer step");
        let mut p = Plain { bonds: vec![Vec::new(); l.bonds.len()], ..Plain::default() };
        self.fmus.start(set, values, &mut |m| {
            p.note(m);
            for _ in 0..n as u64 {
                step(m, l, h, None)?;
                p.note(m);
            }
            Ok(())
        })?;
        Ok(p)
    }

    /// Mass that a force at bond `b` moves at once, kg; negative where the force acts into the stop. None where it moves
    /// nothing.
    fn mass(&self, set: usize, values: &[f64], b: usize, at: f64) -> Result<Option<f64>> {
        let l = self.layout();
        let h = step_of(l, self.recordings[set].0);
        let n = (at / h).floor();
        let speed = |f: f64| -> Result<(f64, f64)> {
            let mut v = (0.0, 0.0);
            self.fmus.start(set, values, &mut |m| {
                for _ in 0..n as u64 {
                    step(m, l, h, None)?;
                }
                v.0 = m.motion(b).1;
                step(m, l, h, Some((b, f)))?;
                v.1 = m.motion(b).1;
                Ok(())
            })?;
            Ok(v)
        };
        let (before, free) = speed(0.0)?;
        let mut f = 1.0;
        for _ in 0..16 {
            let change = speed(f)?.1 - free;
            if change.abs() > FELT * before.abs().max(1e-6) {
                return Ok(Some(-f * h / change));
            }
            f *= 10.0;
        }
        Ok(None)
    }

    /// The same mass as the FMU gives it by the directional derivative of an acceleration; None where it has none, or of
    /// several bodies.
    fn mass_by_derivative(&self, set: usize, values: &[f64], b: usize) -> Option<f64> {
        let port = self.layout().bonds[b].port?;
        let o = &self.layout().opened[port.part];
        if !o.fmu.capabilities().provides_directional_derivative {
            return None;
        }
        let outputs = o.description().variables.iter().filter(|v| v.causality == Causality::Output);
        let accelerations: Vec<(u32, f64)> =
            outputs.filter(|v| is_of(o, v, ACCELERATION)).map(|v| (v.value_reference, to_si(o, v))).collect();
        let mut changes = Vec::new();
        let done = self.fmus.start(set, values, &mut |m| {
            let references: Vec<u32> = accelerations.iter().map(|a| a.0).collect();
            changes = m.felt(port, &references)?;
            Ok(())
        });
        if let Err(e) = done {
            self.fmus.keep_trouble(&e);
            return None;
        }
        let felt = changes.iter().zip(&accelerations).map(|(t, (_, si))| t * si * port.from_si);
        match felt.filter(|a| *a != 0.0).collect::<Vec<_>>()[..] {
            [a] if a.is_finite() => Some(1.0 / a.abs()),
            _ => None,
        }
    }

    /// When a force is tried in recording `set`, s from the start.
    fn tried_at(&self, set: usize, plain: &Plain, b: usize) -> f64 {
        let touch = plain.touch(b).map(|i| plain.time[i]);
        TRIED_AT * touch.unwrap_or(self.recordings[set].1)
    }

    /// The law of the contact at bond `b`, from the reported force, or else from how the body moved.
    fn law(&self, plains: &[&Plain], b: usize, mass: f64, reported: bool) -> Option<Law> {
        let mut all = Vec::new();
        for p in plains {
            if reported {
                all.extend_from_slice(&p.bonds[b]);
                continue;
            }
            let a = p.acceleration(b);
            let first = p.touch(b)?;
            let drive = if first >= 3 { mass * a[first - 3] } else { 0.0 };
            let inside = p.bonds[b][1..].iter().zip(&a).map(|((x, v, _), a)| (*x, *v, drive - mass * a));
            all.extend(inside);
        }
        law(&all)
    }
}

impl<'a> Identify<'a> {
    fn new(fmus: &'a Fmus, of: &'a FmuSystem, c: &Campaign) -> Result<Identify<'a>> {
        let most = "list that many at most";
        if let Some(f) = of.free.get(FREE) {
            return Err(of.wrong(f.variable.line, format!("more than {FREE} variables are free"), most).into());
        }
        let recordings = recordings(c);
        Ok(Identify { fmus, of, recordings })
    }

    /// Free variables where the system file has them.
    fn nominal(&self) -> Result<Vec<(crate::Variable, f64)>> {
        self.of.free.iter().map(|f| self.layout().nominal(self.of, &f.variable)).collect()
    }
}

/// Recordings that the FMUs do not run through as the system file has them, and what they refuse.
///
/// # Errors
/// As [`identify`], whatever the recording.
pub(super) fn refused(fmus: &Fmus, of: &FmuSystem, c: &Campaign) -> Result<Vec<(usize, anyhow::Error)>> {
    let id = Identify::new(fmus, of, c)?;
    let values: Vec<f64> = id.nominal()?.iter().map(|n| n.1).collect();
    Ok((0..id.recordings.len()).filter_map(|r| Some((r, id.plain(r, &values).err()?))).collect())
}

/// Bonds whose force acts into the stop.
///
/// # Errors
/// As [`identify`].
pub(super) fn turned(fmus: &Fmus, of: &FmuSystem, c: &Campaign) -> Result<Vec<usize>> {
    let id = Identify::new(fmus, of, c)?;
    let values: Vec<f64> = id.nominal()?.iter().map(|n| n.1).collect();
    let middle = id.recordings.len() / 2;
    let plain = id.plain(middle, &values)?;
    let mut found = Vec::new();
    for b in (0..of.bonds.len()).filter(|b| id.layout().bonds[*b].port.is_some()) {
        let mass = id.mass(middle, &values, b, id.tried_at(middle, &plain, b))?;
        if mass.is_some_and(|m| m < 0.0) {
            found.push(b);
        }
    }
    Ok(found)
}

/// Time between samples and length of every recording, s.
fn recordings(c: &Campaign) -> Vec<(f64, f64)> {
    let of = |r: &record::Recording| {
        let t = r.all_times();
        let length = t[t.len() - 1] - t[0];
        (length / (r.rows.samples().max(2) - 1) as f64, length)
    };
    c.recordings.iter().map(of).collect()
}

/// Finds out what there is to know.
///
/// # Errors
/// What an FMU refuses, or that nothing can be found out of it.
pub(super) fn identify(fmus: &Fmus, of: &FmuSystem, c: &Campaign) -> Result<Facts> {
    let id = Identify::new(fmus, of, c)?;
    let l = &fmus.layout;
    let nominal = id.nominal()?;
    let values: Vec<f64> = nominal.iter().map(|n| n.1).collect();
    let plains: Vec<Plain> = (0..id.recordings.len()).map(|r| id.plain(r, &values)).collect::<Result<_>>()?;
    let middle = plains.len() / 2;
    let mut facts = Facts { gravity: of.gravity, fixed_step: fixed_step(l), ..Facts::default() };
    facts.notes.clone_from(&l.notes);
    let mut derived = Vec::new();
    for (b, (bond, at)) in of.bonds.iter().zip(&l.bonds).enumerate() {
        let p = &plains[middle];
        let felt = if at.port.is_some() { id.mass(middle, &values, b, id.tried_at(middle, p, b))? } else { None };
        // what a tried force says in steps of some length, a derivative says exactly; where they part, it is of something else
        let exact = id
            .mass_by_derivative(middle, &values, b)
            .filter(|m| felt.is_some_and(|f| (m / f.abs() - 1.0).abs() < AGREE));
        let mass = felt.map(|f| exact.map_or(f, |m| m.copysign(f)));
        derived.push(exact.is_some());
        if at.port.is_some() && mass.is_none() {
            facts.notes.push(format!(
                "a force into {} moves nothing at bond {}",
                bond.force.as_ref().map_or("", |f| &f.text),
                bond.name.text
            ));
        }
        let force = &p.outputs[0];
        let inner = |a: &[f64]| a[1..a.len() - 1].to_vec();
        let channel_is_contact = mass.is_some_and(|m| {
            let a: Vec<f64> = p.acceleration(b).iter().map(|a| -m.abs() * a).collect();
            force.iter().all(|f| f.is_finite()) && correlation(&inner(force), &a) > SAME
        });
        let is_contact = bond.kind == BondKind::Contact;
        let goes_on = |p: &Plain| mass.is_some_and(|m| p.goes_on(b, m.abs()));
        let touches = plains.iter().any(|p| p.touch(b).is_some()) && (is_contact || !plains.iter().all(goes_on));
        let inside = at.source.is_none() && touches;
        let reported = at.source.is_some() || (inside && channel_is_contact);
        let all: Vec<&Plain> = plains.iter().collect();
        let spring = mass.map_or((0.0, 0.0), |m| p.spring(b, m.abs(), l.bonds[b].source.is_some()));
        let found = if touches { id.law(&all, b, mass.unwrap_or(1.0).abs(), reported) } else { None };
        facts.bonds.push(BondFacts {
            name: bond.name.text.clone(),
            is_contact,
            takes_force: mass.is_some(),
            turned: at.port.is_some_and(|p| p.from_si < 0.0),
            inside,
            reported: reported && found.is_some(),
            fed: at.source.is_some() && found.is_none(),
            spring,
            mass: Along { at: mass.unwrap_or(1.0).abs().ln(), ..Along::default() },
            law: found.map(near),
        });
    }
    let read = |c: usize| {
        let at = l.channels[c]?;
        let p = &plains[middle];
        let of_bond = |b: usize| match c {
            0 => {
                l.bonds[b].source.is_some_and(|s| s.source == at.global)
                    || (facts.bonds[b].inside && facts.bonds[b].reported)
            }
            1 => is_acceleration(&p.outputs[1], &p.acceleration(b)),
            _ => l.bonds[b].penetration.global == at.global,
        };
        let found = (0..l.bonds.len()).filter(|b| facts.bonds[*b].takes_force).find(|b| of_bond(*b));
        Some(found.map_or(Reads::Output, Reads::Bond))
    };
    facts.channels = [read(0), read(1), read(2)];
    facts.impacts = plains.iter().map(|p| impact(p, &facts)).collect();
    for (i, ((v, at), f)) in nominal.iter().zip(&of.free).enumerate() {
        let measured = id.measure(i, v, *at, f.tolerance, &values, (&plains[middle], &derived), &mut facts)?;
        facts.free.push(measured);
    }
    Ok(facts)
}

/// Whether `output` reports the acceleration that differences of the speed give at every instant but the first and the last. A seat
/// or a joint that stops the body at once makes a difference that is no acceleration: it does not count.
fn is_acceleration(output: &[f64], differences: &[f64]) -> bool {
    let top = output.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let counts = |pair: &(&f64, &f64)| pair.1.abs() <= JUMPS * top;
    let inner = &output[1..output.len().max(2) - 1];
    let (reported, seen): (Vec<f64>, Vec<f64>) = inner.iter().zip(differences).filter(counts).unzip();
    correlation(&reported, &seen) > ALIKE
}

fn near(l: Law) -> NearLaw {
    let plain = |at: f64| Along { at, ..Along::default() };
    NearLaw { stiffness: plain(l.ln_k), exponent: plain(l.p), damping: plain(l.r), ..NearLaw::default() }
}

/// The first impact of a plain run, at its first contact.
fn impact(p: &Plain, facts: &Facts) -> Option<Impact> {
    let peaks = [0, 1, 2].map(|c| {
        let y = &p.outputs[c];
        let top = (0..y.len()).filter(|i| y[*i].is_finite()).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()));
        top.map_or(f64::NAN, |i| p.time[i])
    });
    let b = facts.bonds.iter().position(|b| b.is_contact)?;
    let i = p.touch(b)?;
    let all = &p.bonds[b];
    let share = -all[i - 1].0 / (all[i].0 - all[i - 1].0);
    let touch = p.time[i - 1] + share * (p.time[i] - p.time[i - 1]);
    let depth = all[i..].iter().take_while(|s| s.0 > 0.0).map(|s| s.0).fold(0.0, f64::max);
    Some(Impact { touch, speed: all[i - 1].1.abs(), depth, peaks })
}

impl Identify<'_> {
    /// How free variable `i` is measured, and what it does to masses and contacts.
    #[allow(clippy::too_many_arguments)]
    fn measure(
        &self,
        i: usize,
        v: &crate::Variable,
        at: f64,
        tolerance: Option<f64>,
        values: &[f64],
        (plain, derived): (&Plain, &[bool]),
        facts: &mut Facts,
    ) -> Result<FreeFacts> {
        let set = self.recordings.len() / 2;
        let w = &self.of.free[i].variable;
        let moved = |by: f64| -> Vec<f64> {
            let mut values = values.to_vec();
            values[i] += by;
            values
        };
        let mut size = at.abs();
        if size == 0.0 {
            size = self.size_of(set, plain, &moved)?.ok_or_else(|| {
                self.of.wrong(w.line, format!("{} moves nothing", w.text), "leave it out of [[simulation.free]]")
            })?;
        }
        let bonds = facts.bonds.len();
        let laws = |p: &Plain| -> Vec<Option<Law>> {
            let of = |(b, f): (usize, &BondFacts)| f.law.and_then(|_| self.law(&[p], b, f.mass.at.exp(), f.reported));
            facts.bonds.iter().enumerate().map(of).collect()
        };
        let has_law = facts.bonds.iter().any(|b| b.law.is_some());
        let laws_with = |by: f64| -> Result<Vec<Option<Law>>> {
            Ok(if has_law { laws(&self.plain(set, &moved(by))?) } else { vec![None; bonds] })
        };
        let before = laws(plain);
        // where an FMU refuses one way, the other may do
        let (way, mut after) = match laws_with(MOVED * size) {
            Ok(after) => (MOVED, after),
            Err(e) => {
                self.fmus.keep_trouble(&e);
                (-MOVED, laws_with(-MOVED * size)?)
            }
        };
        let relative = |b: usize| {
            let (Some(x), Some(y)) = (before[b], after[b]) else { return 0.0 };
            let at_depth = |l: Law| l.ln_k + l.p * facts.impacts[set].map_or(0.0, |i| i.depth.max(1e-12).ln());
            if (y.p - x.p).abs() > 1e-3 {
                0.0
            } else {
                (at_depth(y) - at_depth(x)) / way
            }
        };
        let by_logarithm = at > 0.0 && (tolerance.is_some() || (0..bonds).any(|b| relative(b) > SCALES));
        if by_logarithm {
            after = laws_with(at * way.exp() - at)?;
        }
        let to = if by_logarithm { at * way.exp() } else { at + way * size };
        for b in 0..bonds {
            let slope = |x: f64, y: f64| (y - x) / way;
            // what goes by factors of a variable's logarithm is straight in its own
            let by_factors = |x: f64, y: f64| {
                if by_logarithm && x > 0.0 && y > 0.0 {
                    x * slope(x.ln(), y.ln())
                } else {
                    slope(x, y)
                }
            };
            if let (Some(x), Some(y), Some(l)) = (before[b], after[b], &mut facts.bonds[b].law) {
                l.stiffness.slopes[i] = slope(x.ln_k, y.ln_k);
                l.exponent.slopes[i] = by_factors(x.p, y.p);
                l.damping.slopes[i] = by_factors(x.r, y.r);
                l.straight[i] = !by_logarithm;
            }
            if facts.bonds[b].takes_force {
                let moved = moved(to - values[i]);
                let exact = if derived[b] { self.mass_by_derivative(set, &moved, b) } else { None };
                let mass = match exact {
                    Some(m) => Some(m),
                    None => self.mass(set, &moved, b, self.tried_at(set, plain, b))?,
                };
                if let Some(m) = mass {
                    facts.bonds[b].mass.slopes[i] = slope(facts.bonds[b].mass.at, m.abs().ln());
                }
            }
        }
        let (low, high) = v.bounds;
        let bounds = if by_logarithm {
            let widest = (at * (-FARTHEST_FACTOR).exp(), at * FARTHEST_FACTOR.exp());
            (low.filter(|l| *l > 0.0).map_or(widest.0, |l| l.max(widest.0)), high.map_or(widest.1, |h| h.min(widest.1)))
        } else {
            (low.unwrap_or(at - FARTHEST * size), high.unwrap_or(at + FARTHEST * size))
        };
        let unit = v.unit.clone().unwrap_or_else(|| "1".into());
        Ok(FreeFacts { name: w.text.clone(), unit, nominal: at, by_logarithm, size, bounds, tolerance })
    }

    /// A change of a variable that stands at zero by which the system moves otherwise; None where none does.
    fn size_of(&self, set: usize, plain: &Plain, moved: &dyn Fn(f64) -> Vec<f64>) -> Result<Option<f64>> {
        let course = |p: &Plain| -> Vec<f64> {
            p.bonds.iter().flatten().map(|s| s.1).chain(p.outputs.iter().flatten().copied()).collect()
        };
        let before = course(plain);
        let scale = before.iter().filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
        for power in -9..13 {
            let size = 10f64.powi(power);
            // what refuses a value this large has shown enough
            let Ok(p) = self.plain(set, &moved(size)) else { break };
            let change = course(&p)
                .iter()
                .zip(&before)
                .map(|(a, b)| (a - b).abs())
                .filter(|d| d.is_finite())
                .fold(0.0, f64::max);
            if change > FELT * scale {
                return Ok(Some(size));
            }
        }
        Ok(None)
    }
}
