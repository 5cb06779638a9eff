//! A contact element made of an FMU.

use super::description::{Causality, Description, Kind, Variable};
use super::error::HostError;
use super::fmu::Fmu;
use super::instance::Instance;
use super::state::State;
use anyhow::{anyhow, bail, ensure, Context, Result};
use plant::element::Element;
use record::words::meant;

/// Step of a trial, s, where the force has to be stepped for.
const TRIAL_STEP: f64 = 1e-9;
/// Penetrations at which it is tried whether setting inputs moves the force at once, m.
const PROBES: [f64; 8] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Share of its size, and least, by which an input moves for a difference: the cube root of the rounding.
const NUDGE: f64 = 6.055e-6;

/// Names of the FMU's variables.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// Input, a length, positive into the stop.
    pub penetration: String,
    /// Input, a speed; None where the FMU takes none.
    pub velocity: Option<String>,
    /// Output, a force, positive in compression.
    pub force: String,
}

impl Default for Names {
    fn default() -> Self {
        Names { penetration: "penetration".into(), velocity: Some("velocity".into()), force: "force".into() }
    }
}

/// How a force is had from the FMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coupling {
    /// Set inputs, read the force: setting inputs moves no memory.
    Direct,
    /// Save, set inputs, step by `step` s, read, restore.
    Trial {
        /// Length of the trial step, s.
        step: f64,
    },
    /// The force of the last communication point is held until the next, `step` s later.
    Held {
        /// Macro-step, s, > 0.
        step: f64,
    },
}

/// A Real variable and what a value of it is in SI: SI value = scale * value.
#[derive(Clone, Copy, Debug)]
struct Port {
    reference: u32,
    scale: f64,
}

/// A contact element that is a slave of an FMU.
pub struct FmuElement {
    instance: Instance,
    settings: Vec<(Variable, f64)>,
    inputs: Vec<u32>,
    scales: Vec<f64>,
    force: Port,
    energies: Option<[Port; 2]>,
    coupling: Coupling,
    saved: Option<State>,
    /// (x, v) at the last communication point; None before the first call.
    committed: Option<(f64, f64)>,
    /// Inputs differ from `committed`.
    moved: bool,
    /// Time of the FMU's last communication point, s.
    time: f64,
    /// Steps accepted, and time they took, s.
    accepted: u64,
    elapsed: f64,
    /// Macro-steps done, with held force.
    macro_steps: u64,
    held: f64,
}

impl FmuElement {
    /// A slave of `fmu` with `parameters` (name and value, in the units the FMU gives them), coupled as closely as it
    /// allows: [`Coupling::Direct`] where the force follows the inputs at once (its ModelStructure does not deny it
    /// and a try shows it), else [`Coupling::Trial`] where its state can be saved.
    ///
    /// # Errors
    /// Where a variable is missing, of a wrong kind or of a unit that is no length, speed or force; where the FMU
    /// refuses; where neither coupling is possible, then [`FmuElement::held`] is.
    pub fn new(fmu: &Fmu, parameters: &[(String, f64)], names: &Names) -> Result<FmuElement> {
        let mut e = FmuElement::build(fmu, parameters, names, Coupling::Direct)?;
        let declared = fmu.description().feedthrough(&names.force, &names.penetration);
        if declared != Some(false) && e.follows_at_once()? {
            // what was tried out is thrown away
            drop(e);
            return FmuElement::build(fmu, parameters, names, Coupling::Direct);
        }
        let c = fmu.capabilities();
        if c.can_get_and_set_fmu_state && c.can_handle_variable_communication_step_size {
            drop(e);
            return FmuElement::build(fmu, parameters, names, Coupling::Trial { step: TRIAL_STEP });
        }
        e.committed = None;
        let lacks =
            if c.can_get_and_set_fmu_state { "canHandleVariableCommunicationStepSize" } else { "canGetAndSetFMUstate" };
        bail!(
            "{}: its force does not follow its inputs at once, and without {lacks} it cannot be tried out and taken \
             back; a fixed macro-step with held force is needed",
            fmu.path().display()
        )
    }

    /// As [`FmuElement::new`], with the force held over fixed macro-steps of `step` s, > 0. A held force adds energy:
    /// with h = step * omega the restitution grows by a factor of about exp(pi h / 4).
    ///
    /// # Errors
    /// As [`FmuElement::new`], and where the step is not above 0.
    pub fn held(fmu: &Fmu, parameters: &[(String, f64)], names: &Names, step: f64) -> Result<FmuElement> {
        ensure!(step.is_finite() && step > 0.0, "a macro-step of {step} s; give one above 0, in s");
        FmuElement::build(fmu, parameters, names, Coupling::Held { step })
    }

    /// How the force is had.
    pub fn coupling(&self) -> Coupling {
        self.coupling
    }

    /// The slave.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Reads any Real variable of the FMU by name, in its own unit.
    ///
    /// # Errors
    /// Where there is no such Real, or the FMU refuses.
    pub fn real(&mut self, name: &str) -> Result<f64> {
        let v = self.instance.fmu().description().variable(name).filter(|v| v.kind == Kind::Real);
        let v = v.with_context(|| format!("{}: has no Real {name}", self.instance.name()))?.value_reference;
        Ok(self.instance.real(v)?)
    }

    fn build(fmu: &Fmu, parameters: &[(String, f64)], names: &Names, coupling: Coupling) -> Result<FmuElement> {
        let d = fmu.description();
        let at = || format!("{}", fmu.path().display());
        let mut ports = vec![port(d, &names.penetration, Causality::Input, LENGTH).with_context(at)?];
        if let Some(v) = &names.velocity {
            ports.push(port(d, v, Causality::Input, SPEED).with_context(at)?);
        }
        let force = port(d, &names.force, Causality::Output, FORCE).with_context(at)?;
        let energy = |name| d.variable(name).and_then(|_| port(d, name, Causality::Output, ENERGY).ok());
        let energies = match (energy("stored_energy"), energy("dissipated_energy")) {
            (Some(a), Some(b)) => Some([a, b]),
            _ => None,
        };
        let settings = parameters.iter().map(|(n, x)| setting(d, n, *x)).collect::<Result<_>>().with_context(at)?;
        Ok(FmuElement {
            instance: fmu.instantiate(&d.model_name, false)?,
            settings,
            inputs: ports.iter().map(|p| p.reference).collect(),
            scales: ports.iter().map(|p| p.scale).collect(),
            force,
            energies,
            coupling,
            saved: None,
            committed: None,
            moved: false,
            time: 0.0,
            accepted: 0,
            elapsed: 0.0,
            macro_steps: 0,
            held: 0.0,
        })
    }

    /// Whether the force moves with the penetration without a step; not where the FMU refuses to be tried.
    ///
    /// # Errors
    /// Where the FMU's process dies of it.
    fn follows_at_once(&mut self) -> Result<bool> {
        let tried = |e: &mut Self| -> Result<bool> {
            e.start(0.0, 0.0)?;
            let first = e.read()?;
            for x in PROBES {
                e.set(x, 0.0)?;
                if e.read()? != first {
                    return Ok(true);
                }
            }
            Ok(false)
        };
        match tried(self) {
            Err(e) if e.downcast_ref::<HostError>().is_some_and(HostError::is_death) => Err(e),
            tried => Ok(tried.unwrap_or(false)),
        }
    }

    /// Initializes the slave at (x, v).
    fn start(&mut self, x: f64, v: f64) -> Result<()> {
        for (variable, value) in &self.settings {
            apply(&mut self.instance, variable, *value)?;
        }
        let tolerance = self.instance.fmu().description().tolerance.filter(|t| *t > 0.0);
        self.instance.setup_experiment(tolerance, 0.0, None)?;
        self.instance.enter_initialization()?;
        self.set(x, v)?;
        self.instance.exit_initialization()?;
        self.committed = Some((x, v));
        self.moved = false;
        match self.coupling {
            Coupling::Direct => {}
            Coupling::Trial { .. } => self.save()?,
            Coupling::Held { .. } => self.held = self.read()?,
        }
        Ok(())
    }

    fn save(&mut self) -> Result<()> {
        match &self.saved {
            Some(s) => self.instance.save_into(s)?,
            None => self.saved = Some(self.instance.save()?),
        }
        Ok(())
    }

    fn back(&mut self) -> Result<()> {
        if let Some(s) = &self.saved {
            self.instance.restore(s)?;
        }
        Ok(())
    }

    #[inline]
    fn set(&mut self, x: f64, v: f64) -> Result<()> {
        self.moved = true;
        let n = self.inputs.len();
        let values = [x / self.scales[0], v / self.scales[n - 1]];
        Ok(self.instance.set_real(&self.inputs, &values[..n])?)
    }

    #[inline]
    fn read(&mut self) -> Result<f64> {
        Ok(self.instance.real(self.force.reference)? * self.force.scale)
    }

    /// Initializes at the first call, at its point.
    #[inline]
    fn ready(&mut self, x: f64, v: f64) -> Result<()> {
        if self.committed.is_some() {
            return Ok(());
        }
        self.start(x, v)
    }

    /// Sees that the slave stands where the step begins.
    fn stand_at(&mut self, from: (f64, f64)) -> Result<()> {
        self.ready(from.0, from.1)?;
        let (x, v) = self.committed.unwrap_or(from);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()) + 1e-15;
        if close(x, from.0) && close(v, from.1) {
            return Ok(());
        }
        if self.accepted > 0 {
            bail!(
                "{}: a step begins at ({}, {}) and the last one ended at ({x}, {v}): an FMU cannot jump",
                self.instance.name(),
                from.0,
                from.1
            );
        }
        // nothing is accepted yet: begin again where the motion begins
        if let Some(s) = self.saved.take() {
            self.instance.free(s)?;
        }
        self.instance.reset()?;
        self.start(from.0, from.1)
    }

    /// (dF/dx, dF/dv) from the FMU at its inputs; the second is 0 where it takes no velocity.
    fn given_derivatives(&mut self) -> Result<(f64, f64)> {
        let mut d = [0.0; 2];
        for i in 0..self.inputs.len() {
            let mut answer = [0.0];
            let known = [self.inputs[i]];
            self.instance.get_directional_derivative(&[self.force.reference], &known, &[1.0], &mut answer)?;
            d[i] = answer[0] * self.force.scale / self.scales[i];
        }
        Ok((d[0], d[1]))
    }

    fn differences(&mut self, x: f64, v: f64) -> Result<(f64, f64)> {
        let (dx, dv) = (NUDGE * x.abs().max(1e-6), NUDGE * v.abs().max(1e-3));
        let fx = (self.force(x + dx, v)? - self.force(x - dx, v)?) / (2.0 * dx);
        let fv = (self.force(x, v + dv)? - self.force(x, v - dv)?) / (2.0 * dv);
        Ok((fx, fv))
    }

    /// Macro-steps that end within an accepted step; inputs at their ends lie on the straight line.
    fn advance_held(&mut self, from: (f64, f64), to: (f64, f64), dt: f64, step: f64) -> Result<()> {
        let begin = self.elapsed;
        self.elapsed += dt;
        loop {
            let next = (self.macro_steps + 1) as f64 * step;
            if next > self.elapsed * (1.0 + 1e-12) {
                return Ok(());
            }
            let s = ((next - begin) / dt).clamp(0.0, 1.0);
            self.set(from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1))?;
            self.instance.do_step(self.macro_steps as f64 * step, step)?;
            self.macro_steps += 1;
            self.held = self.read()?;
        }
    }
}

impl Element for FmuElement {
    fn force(&mut self, x: f64, v: f64) -> Result<f64> {
        self.ready(x, v)?;
        match self.coupling {
            Coupling::Direct => {
                self.set(x, v)?;
                self.read()
            }
            Coupling::Trial { step } => {
                self.set(x, v)?;
                self.instance.do_step(self.time, step)?;
                let f = self.read()?;
                self.back()?;
                Ok(f)
            }
            Coupling::Held { .. } => Ok(self.held),
        }
    }

    fn derivatives(&mut self, x: f64, v: f64) -> Result<(f64, f64)> {
        self.ready(x, v)?;
        let declared = self.instance.fmu().capabilities().provides_directional_derivative;
        match self.coupling {
            Coupling::Held { .. } => Ok((0.0, 0.0)),
            Coupling::Direct if declared => {
                self.set(x, v)?;
                self.given_derivatives()
            }
            Coupling::Trial { step } if declared => {
                self.set(x, v)?;
                self.instance.do_step(self.time, step)?;
                let d = self.given_derivatives()?;
                self.back()?;
                Ok(d)
            }
            _ => self.differences(x, v),
        }
    }

    fn advance(&mut self, from: (f64, f64), to: (f64, f64), dt: f64) -> Result<()> {
        self.stand_at(from)?;
        if dt <= 0.0 {
            return Ok(());
        }
        match self.coupling {
            Coupling::Held { step } => self.advance_held(from, to, dt, step)?,
            Coupling::Trial { .. } if self.instance.fmu().capabilities().can_interpolate_inputs => {
                self.set(from.0, from.1)?;
                let n = self.inputs.len();
                let last = n - 1;
                let rates = [(to.0 - from.0) / dt / self.scales[0], (to.1 - from.1) / dt / self.scales[last]];
                self.instance.set_real_input_derivatives(&self.inputs, &[1, 1][..n], &rates[..n])?;
                self.instance.do_step(self.time, dt)?;
            }
            _ => {
                self.set(to.0, to.1)?;
                self.instance.do_step(self.time, dt)?;
            }
        }
        self.time += dt;
        self.accepted += 1;
        self.committed = Some(to);
        self.moved = false;
        if let Coupling::Trial { .. } = self.coupling {
            self.save()?;
        }
        Ok(())
    }

    fn energies(&mut self) -> Result<Option<(f64, f64)>> {
        let Some([stored, dissipated]) = self.energies else { return Ok(None) };
        let (x, v) = self.committed.unwrap_or((0.0, 0.0));
        self.ready(x, v)?;
        if self.moved && self.coupling == Coupling::Direct {
            self.set(x, v)?;
            self.moved = false;
        }
        let mut e = [0.0; 2];
        self.instance.get_real(&[stored.reference, dissipated.reference], &mut e)?;
        Ok(Some((e[0] * stored.scale, e[1] * dissipated.scale)))
    }

    fn longest_step(&self) -> Option<f64> {
        match self.coupling {
            Coupling::Held { step } => Some(((self.macro_steps + 1) as f64 * step - self.elapsed).max(1e-6 * step)),
            _ => None,
        }
    }
}

/// A quantity: its name, exponents of kg, m, s, and the SI units it may be in where the file does not define them.
type Quantity = (&'static str, [i32; 3], &'static [&'static str]);
const LENGTH: Quantity = ("a length", [0, 1, 0], &["m"]);
const SPEED: Quantity = ("a speed", [0, 1, -1], &["m/s", "m.s-1", "m s-1"]);
const FORCE: Quantity = ("a force", [1, 1, -2], &["N", "kg.m/s2", "kg.m.s-2"]);
const ENERGY: Quantity = ("an energy", [1, 2, -2], &["J", "N.m"]);

fn port(d: &Description, name: &str, causality: Causality, quantity: Quantity) -> Result<Port> {
    let wanted = if causality == Causality::Input { "input" } else { "output" };
    let v = d.variable(name).filter(|v| v.causality == causality && v.kind == Kind::Real).ok_or_else(|| {
        let names = d.names(causality);
        let (all, meant) = (list(&names), meant(name, &names));
        anyhow!("has no Real {wanted} {name}; its {wanted}s are: {all}; name the right one{meant}")
    })?;
    Ok(Port { reference: v.value_reference, scale: scale(d, v, quantity)? })
}

fn scale(d: &Description, v: &Variable, (what, exponents, plain): Quantity) -> Result<f64> {
    let Some(unit) = &v.unit else { return Ok(1.0) };
    if let Some(u) = d.units.get(unit) {
        let right = u.exponents[..3] == exponents && u.exponents[3..].iter().all(|&n| n == 0);
        let usable = u.factor.is_finite() && u.factor != 0.0 && u.offset == 0.0;
        ensure!(right && usable, "{} is in {unit}, which is not {what}; name another variable", v.name);
        return Ok(u.factor);
    }
    ensure!(
        plain.contains(&unit.as_str()),
        "{} is in {unit}, which its UnitDefinitions do not define; {} is taken without",
        v.name,
        plain[0]
    );
    Ok(1.0)
}

fn setting(d: &Description, name: &str, value: f64) -> Result<(Variable, f64)> {
    let v = d.variable(name).filter(|v| v.causality == Causality::Parameter).ok_or_else(|| {
        let names = d.names(Causality::Parameter);
        anyhow!("has no parameter {name}; its parameters are: {}{}", list(&names), meant(name, &names))
    })?;
    let whole = value.fract() == 0.0 && value.abs() < f64::from(i32::MAX);
    let fits = match v.kind {
        Kind::Real => true,
        Kind::Integer | Kind::Enumeration => whole,
        Kind::Boolean => value == 0.0 || value == 1.0,
        Kind::String => false,
    };
    ensure!(fits, "parameter {name} is of type {:?} and cannot be {value}", v.kind);
    Ok((v.clone(), value))
}

fn apply(i: &mut Instance, v: &Variable, value: f64) -> Result<()> {
    let reference = [v.value_reference];
    match v.kind {
        Kind::Real => i.set_real(&reference, &[value]),
        Kind::Boolean => i.set_boolean(&reference, &[value != 0.0]),
        _ => i.set_integer(&reference, &[value as i32]),
    }
    .with_context(|| format!("parameter {} = {value}", v.name))
}

fn list(names: &[&str]) -> String {
    if names.is_empty() {
        return "none".into();
    }
    names.join(", ")
}
