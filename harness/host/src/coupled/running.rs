//! The FMUs of a system under way in one thread.

use super::layout::{Fed, Layout, Port};
use crate::master::build::{made, set_all, tolerance_of};
use crate::{Call, Instance};
use anyhow::{ensure, Result};
use plant::machine::{Push, Running};
use std::borrow::Cow;
use std::time::Duration;

/// Where on a straight line over a step the values stand that are held over its halves, so that both the integral and its first
/// moment are the line's: a body that they push gets the line's speed and place.
const HALVES: [f64; 2] = [1.0 / 6.0, 5.0 / 6.0];

/// Instances of every FMU, made once and started anew for each run.
pub(super) struct Sitting {
    instances: Vec<Instance>,
    /// Whether they have been started since they were made.
    used: bool,
    /// Whether one of them was not the same after a reset: all are made anew then.
    anew: bool,
}

impl Sitting {
    /// Makes them.
    ///
    /// # Errors
    /// What an FMU refuses.
    pub fn new(l: &Layout) -> Result<Sitting> {
        Ok(Sitting { instances: instances(l)?, used: false, anew: false })
    }

    /// Starts them: the values of recording `set` beside what the system file sets, `free` by [`Layout::free`]. No call takes
    /// longer than `longest`, where that is given.
    ///
    /// # Errors
    /// What an FMU refuses.
    pub fn start<'a>(
        &'a mut self,
        l: &'a Layout,
        set: usize,
        free: &[f64],
        longest: Option<Duration>,
    ) -> Result<Moving<'a>> {
        if self.used && !self.anew {
            // what cannot be reset can be made again
            self.anew = self.instances.iter_mut().any(|i| i.reset().is_err());
        }
        if self.used && self.anew {
            self.instances.clear();
            self.instances = instances(l)?;
        }
        self.used = true;
        if let Some(longest) = longest {
            self.instances.iter_mut().try_for_each(|i| i.hurry(longest))?;
        }
        for (k, (i, c)) in self.instances.iter_mut().zip(&l.system.fmu).enumerate() {
            set_all(&l.system, c, &l.opened[k], i)?;
        }
        let of_set = l.sets.get(set).map_or(&[][..], Vec::as_slice);
        let free = l.free.iter().zip(free).map(|(s, v)| (*s, *v));
        for (s, value) in of_set.iter().copied().chain(free) {
            self.instances[s.part].set_real(&[s.reference], &[value])?;
        }
        for ((i, c), o) in self.instances.iter_mut().zip(&l.system.fmu).zip(&l.opened) {
            i.setup_experiment(tolerance_of(&l.system, c, o.description()), l.start, None)?;
            i.enter_initialization()?;
        }
        let n = l.owner.len();
        let mut m = Moving {
            l,
            instances: &mut self.instances,
            time: l.start,
            y: vec![0.0; n],
            before: vec![0.0; n],
            rates: vec![0.0; n],
            step: 0.0,
            faces: vec![(0.0, 0.0); l.bonds.len()],
            faces_before: vec![(0.0, 0.0); l.bonds.len()],
        };
        // twice: what feeds a bond is known once the motion is
        for _ in 0..2 {
            m.settle_all()?;
        }
        for k in 0..m.instances.len() {
            m.instances[k].exit_initialization()?;
        }
        m.settle_all()?;
        m.before.clone_from(&m.y);
        m.faces_before.clone_from(&m.faces);
        Ok(m)
    }
}

fn instances(l: &Layout) -> Result<Vec<Instance>> {
    l.system.fmu.iter().zip(&l.opened).map(|(c, o)| made(&l.system, c, o)).collect()
}

/// A run under way.
pub(super) struct Moving<'a> {
    l: &'a Layout,
    instances: &'a mut Vec<Instance>,
    time: f64,
    /// Outputs now, at the step's start, and their rates over the step before.
    y: Vec<f64>,
    before: Vec<f64>,
    rates: Vec<f64>,
    /// Length of the step under way, s; 0 at the start.
    step: f64,
    faces: Vec<(f64, f64)>,
    faces_before: Vec<(f64, f64)>,
}

impl Moving<'_> {
    /// Sets inputs to where their sources are and reads outputs, in order; bonds are given what feeds them.
    fn settle_all(&mut self) -> Result<()> {
        for k in self.l.order.clone() {
            for b in self.l.parts[k].bonds.clone() {
                let f = self.l.bonds[b].source.map_or(0.0, |s| s.of(&self.y));
                self.give(b, f)?;
            }
            self.set_inputs(k)?;
            self.read(k)?;
            self.read_faces();
        }
        Ok(())
    }

    /// Puts the faces where the bonds' outputs place them.
    fn read_faces(&mut self) {
        self.faces = (0..self.l.bonds.len()).map(|b| self.motion(b)).collect();
    }

    /// Sets the force of a bond, N.
    fn give(&mut self, b: usize, force: f64) -> Result<()> {
        let Some(port) = self.l.bonds[b].port else { return Ok(()) };
        Ok(self.instances[port.part].set_real(&[port.reference], &[force * port.from_si])?)
    }

    fn end_of(&self, i: &Fed) -> f64 {
        i.feed.factor * self.source_value(i, &self.y, &self.faces) + i.feed.offset
    }

    /// The value of a fed input's source: the output, or the bond's face in its unit.
    fn source_value(&self, i: &Fed, y: &[f64], faces: &[(f64, f64)]) -> f64 {
        match i.face {
            Some((b, true)) => faces[b].1 / self.l.bonds[b].velocity.to_si,
            Some((b, false)) => faces[b].0 / self.l.bonds[b].penetration.to_si,
            None => y[i.feed.source],
        }
    }

    /// Sets the inputs of FMU `k` to where their sources are.
    fn set_inputs(&mut self, k: usize) -> Result<()> {
        self.hold_at_end(k)?;
        let (references, values) = self.ends(k);
        if references.is_empty() {
            return Ok(());
        }
        Ok(self.instances[k].set_real(&references, &values)?)
    }

    /// Sets the inputs of FMU `k` that are held over a step to where their sources are.
    fn hold_at_end(&mut self, k: usize) -> Result<()> {
        self.l.parts[k].inputs.iter().filter(|i| i.held).try_for_each(|i| self.hold(k, i, self.end_of(i)))
    }

    /// The other inputs of FMU `k`, and where their sources are.
    fn ends(&self, k: usize) -> (Vec<u32>, Vec<f64>) {
        self.l.parts[k].inputs.iter().filter(|i| !i.held).map(|i| (i.reference, self.end_of(i))).unzip()
    }

    /// Sets an input that is held over a step.
    fn hold(&mut self, k: usize, i: &Fed, value: f64) -> Result<()> {
        let value = i.map.iter().find(|m| m.0 == value).map_or(value, |m| m.1);
        self.instances[k].set_number(i.kind, i.reference, value)
    }

    fn read(&mut self, k: usize) -> Result<()> {
        let part = &self.l.parts[k];
        if part.outputs.is_empty() {
            return Ok(());
        }
        let to = part.first + part.outputs.len();
        if part.reals {
            self.instances[k].get_real(&part.outputs, &mut self.y[part.first..to])?;
        } else {
            for (i, (r, v)) in part.outputs.iter().zip(&self.l.opened[k].outputs).enumerate() {
                self.y[part.first + i] = self.instances[k].number(v.kind, *r)?;
            }
        }
        self.check(k)
    }

    /// That what was read of FMU `k` are numbers.
    fn check(&self, k: usize) -> Result<()> {
        let part = &self.l.parts[k];
        let to = part.first + part.outputs.len();
        if let Some(i) = (part.first..to).find(|i| !self.y[*i].is_finite()) {
            let name = &self.l.opened[k].outputs[i - part.first].name;
            let of = &self.l.opened[k].name;
            anyhow::bail!("fmi2GetReal of {of}: {name} is {} at {} s", self.y[i], self.time);
        }
        Ok(())
    }

    /// Steps FMU `k` over the step under way, `pushes` into its bonds.
    fn step_part(&mut self, k: usize, pushes: &[Push], stepped: &[bool]) -> Result<()> {
        let (l, h) = (self.l, self.step);
        let part = &l.parts[k];
        let n = part.inputs.len() + part.bonds.len();
        let (mut references, mut starts, mut slopes) =
            (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
        for i in &part.inputs {
            let from = i.feed.factor * self.source_value(i, &self.before, &self.faces_before) + i.feed.offset;
            let known = i.face.is_some() || stepped[l.owner[i.feed.source]];
            if i.held {
                self.hold(k, i, if known { self.end_of(i) } else { from })?;
                continue;
            }
            let slope = if known { (self.end_of(i) - from) / h } else { i.feed.factor * self.rates[i.feed.source] };
            references.push(i.reference);
            starts.push(from);
            slopes.push(slope);
        }
        for b in &part.bonds {
            let Some(port) = l.bonds[*b].port else { continue };
            references.push(port.reference);
            starts.push(pushes[*b].start * port.from_si);
            slopes.push(pushes[*b].slope * port.from_si);
        }
        let mut calls = Vec::new();
        let set = |values: Vec<f64>| {
            (!references.is_empty()).then(|| Call::SetReal(Cow::Borrowed(&references), Cow::Owned(values)))
        };
        if part.orders > 0 {
            calls.extend(set(starts));
            if !references.is_empty() {
                calls.push(Call::SetRealInputDerivatives(Cow::Borrowed(&references), Cow::Owned(slopes)));
            }
            calls.push(Call::DoStep { time: self.time, step: h });
        } else {
            let shares: &[f64] = if part.in_halves { &HALVES } else { &[0.5] };
            let each = h / shares.len() as f64;
            for (i, share) in shares.iter().enumerate() {
                calls.extend(set(starts.iter().zip(&slopes).map(|(s, r)| s + share * h * r).collect()));
                calls.push(Call::DoStep { time: self.time + i as f64 * each, step: each });
            }
        }
        // what answers at once answers to the step's end
        let (mut fed, mut ends) = self.ends(k);
        for b in &part.bonds {
            let Some(port) = l.bonds[*b].port else { continue };
            fed.push(port.reference);
            ends.push(pushes[*b].end * port.from_si);
        }
        let end = (!fed.is_empty()).then_some(Call::SetReal(Cow::Owned(fed), Cow::Owned(ends)));
        if part.reals && part.inputs.iter().all(|i| !i.held) {
            calls.extend(end);
            let to = part.first + part.outputs.len();
            self.instances[k].batch(&calls, &part.outputs, &mut self.y[part.first..to])?;
            return self.check(k);
        }
        self.instances[k].batch(&calls, &[], &mut [])?;
        self.hold_at_end(k)?;
        self.instances[k].batch(end.as_slice(), &[], &mut [])?;
        self.read(k)
    }
}

impl Running for Moving<'_> {
    fn advance(&mut self, h: f64, pushes: &[Push]) -> Result<()> {
        ensure!(h > 0.0, "a step of {h} s at {} s", self.time);
        self.step = h;
        self.before.clone_from(&self.y);
        self.faces_before.clone_from(&self.faces);
        let mut stepped = vec![false; self.instances.len()];
        for k in self.l.order.clone().into_iter().filter(|k| !self.l.parts[*k].follows) {
            self.step_part(k, pushes, &stepped)?;
            stepped[k] = true;
        }
        self.read_faces();
        Ok(())
    }

    fn motion(&self, bond: usize) -> (f64, f64) {
        let Some(b) = self.l.bonds.get(bond) else { return (0.0, 0.0) };
        (self.y[b.penetration.global] * b.penetration.to_si, self.y[b.velocity.global] * b.velocity.to_si)
    }

    fn follow(&mut self, faces: &[(f64, f64)]) -> Result<()> {
        self.faces.clone_from_slice(faces);
        let l = self.l;
        let mut stepped: Vec<bool> = l.parts.iter().map(|p| !p.follows).collect();
        for k in l.order.clone().into_iter().filter(|k| l.parts[*k].follows) {
            self.step_part(k, &[], &stepped)?;
            stepped[k] = true;
        }
        for (i, rate) in self.rates.iter_mut().enumerate() {
            *rate = (self.y[i] - self.before[i]) / self.step;
        }
        self.time += self.step;
        Ok(())
    }

    fn contact(&self, bond: usize) -> f64 {
        match self.l.bonds[bond].source {
            Some(feed) => feed.of(&self.y),
            None => self.output(0),
        }
    }

    fn output(&self, channel: usize) -> f64 {
        self.l.channels[channel].map_or(f64::NAN, |t| self.y[t.global] * t.to_si)
    }
}

impl Moving<'_> {
    /// Change of outputs `references` with a bond's force, each in its unit, as the FMU gives it.
    ///
    /// # Errors
    /// What it refuses.
    pub fn felt(&mut self, port: Port, references: &[u32]) -> Result<Vec<f64>> {
        let mut changes = vec![0.0; references.len()];
        if !references.is_empty() {
            self.instances[port.part].get_directional_derivative(
                references,
                &[port.reference],
                &[1.0],
                &mut changes,
            )?;
        }
        Ok(changes)
    }

    /// Time reached, s from the start.
    pub fn elapsed(&self) -> f64 {
        self.time - self.l.start
    }

    /// What the FMUs said last; None where their logs are empty.
    pub fn said(&self) -> Option<String> {
        self.instances.iter().find_map(|i| i.log().last().map(|l| format!("{}: {}", i.name(), l.message)))
    }
}

/// An error with what the FMUs said last.
pub(super) fn with_log(m: &Moving<'_>, e: anyhow::Error) -> anyhow::Error {
    match m.said() {
        Some(said) => e.context(format!("the FMUs said last {said:?}")),
        None => e,
    }
}
