//! What a master asks of a slave, and an FMU as one.

use crate::{Instance, Kind, State};
use anyhow::{bail, ensure, Result};

/// What a slave can do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Abilities {
    /// Its state can be saved and restored.
    pub rollback: bool,
    /// Its steps may differ in size.
    pub variable_step: bool,
    /// Highest order of input derivatives it takes; 0: none.
    pub input_orders: u32,
    /// It gives first derivatives of its outputs.
    pub output_rates: bool,
    /// It gives directional derivatives.
    pub directional: bool,
}

/// A slave. References are the slave's own; values are Reals in its units, times s.
pub trait Slave {
    /// What it can do.
    fn abilities(&self) -> Abilities;

    /// Sets inputs.
    ///
    /// # Errors
    /// Where it refuses; says which slave and why, as all below.
    fn set(&mut self, references: &[u32], values: &[f64]) -> Result<()>;

    /// Sets derivatives of inputs at the start of the next step.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn set_rates(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Result<()>;

    /// Reads outputs.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<()>;

    /// Reads first derivatives of outputs.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn rates(&mut self, references: &[u32], values: &mut [f64]) -> Result<()>;

    /// Derivatives of outputs along `seed` in inputs.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn directional(&mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64], answer: &mut [f64]) -> Result<()>;

    /// Steps from `time` over `step`.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn step(&mut self, time: f64, step: f64) -> Result<()>;

    /// Saves the state in a numbered slot, over what was there.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn save(&mut self, slot: usize) -> Result<()>;

    /// Goes back to the state of a slot.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn restore(&mut self, slot: usize) -> Result<()>;

    /// Ends initialization.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn ready(&mut self) -> Result<()>;

    /// What it has logged, as `status category: text`.
    fn log(&self) -> Vec<String>;

    /// Reads a variable of any kind but String as a number.
    ///
    /// # Errors
    /// As [`Slave::set`].
    fn read(&mut self, kind: Kind, reference: u32) -> Result<f64>;

    /// Sets a variable of any kind but String to a number: a whole one, of a Boolean 0 or not.
    ///
    /// # Errors
    /// As [`Slave::set`]; a number that is none of its kind; where it takes Reals alone.
    fn set_number(&mut self, kind: Kind, _reference: u32, value: f64) -> Result<()> {
        bail!("takes no {kind:?} ({value})")
    }

    /// Sets a String.
    ///
    /// # Errors
    /// As [`Slave::set`]; where it takes none.
    fn set_text(&mut self, _reference: u32, text: &str) -> Result<()> {
        bail!("takes no String ({text:?})")
    }

    /// Reads a String.
    ///
    /// # Errors
    /// As [`Slave::set`]; where it has none.
    fn text(&mut self, _reference: u32) -> Result<String> {
        bail!("has no Strings")
    }
}

/// An instance of an FMU, in initialization, as a slave.
pub struct FmuSlave {
    instance: Instance,
    slots: Vec<Option<State>>,
    abilities: Abilities,
}

impl FmuSlave {
    /// Makes a slave of an instance. FMI 2.0 declares no highest order of input derivatives: `input_orders` gives it
    /// where it is above 1 (None: 1 where canInterpolateInputs).
    pub fn new(instance: Instance, input_orders: Option<u32>) -> FmuSlave {
        let c = instance.fmu().capabilities();
        let abilities = Abilities {
            rollback: c.can_get_and_set_fmu_state,
            variable_step: c.can_handle_variable_communication_step_size,
            input_orders: if c.can_interpolate_inputs { input_orders.unwrap_or(1) } else { 0 },
            output_rates: c.max_output_derivative_order > 0,
            directional: c.provides_directional_derivative,
        };
        FmuSlave { instance, slots: Vec::new(), abilities }
    }

    /// The instance.
    pub fn instance(&mut self) -> &mut Instance {
        &mut self.instance
    }
}

impl Slave for FmuSlave {
    fn abilities(&self) -> Abilities {
        self.abilities
    }

    fn set(&mut self, references: &[u32], values: &[f64]) -> Result<()> {
        Ok(self.instance.set_real(references, values)?)
    }

    fn set_rates(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Result<()> {
        Ok(self.instance.set_real_input_derivatives(references, orders, values)?)
    }

    fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<()> {
        Ok(self.instance.get_real(references, values)?)
    }

    fn rates(&mut self, references: &[u32], values: &mut [f64]) -> Result<()> {
        let orders = vec![1; references.len()];
        Ok(self.instance.get_real_output_derivatives(references, &orders, values)?)
    }

    fn directional(&mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64], answer: &mut [f64]) -> Result<()> {
        Ok(self.instance.get_directional_derivative(unknowns, knowns, seed, answer)?)
    }

    fn step(&mut self, time: f64, step: f64) -> Result<()> {
        Ok(self.instance.do_step(time, step)?)
    }

    fn save(&mut self, slot: usize) -> Result<()> {
        while self.slots.len() <= slot {
            self.slots.push(None);
        }
        match &self.slots[slot] {
            Some(s) => self.instance.save_into(s)?,
            None => self.slots[slot] = Some(self.instance.save()?),
        }
        Ok(())
    }

    fn restore(&mut self, slot: usize) -> Result<()> {
        match self.slots.get(slot).and_then(Option::as_ref) {
            Some(s) => Ok(self.instance.restore(s)?),
            None => bail!("{}: nothing was saved to go back to", self.instance.name()),
        }
    }

    fn ready(&mut self) -> Result<()> {
        Ok(self.instance.exit_initialization()?)
    }

    fn log(&self) -> Vec<String> {
        let dropped = Some(self.instance.log_dropped()).filter(|n| *n > 0);
        let dropped = dropped.map(|n| format!("{n} earlier lines are left out")).into_iter();
        let lines = self.instance.log();
        dropped.chain(lines.iter().map(|l| format!("{} {}: {}", l.status, l.category, l.message))).collect()
    }

    fn read(&mut self, kind: Kind, reference: u32) -> Result<f64> {
        self.instance.number(kind, reference)
    }

    fn set_number(&mut self, kind: Kind, reference: u32, value: f64) -> Result<()> {
        self.instance.set_number(kind, reference, value)
    }

    fn set_text(&mut self, reference: u32, text: &str) -> Result<()> {
        Ok(self.instance.set_string(&[reference], &[text])?)
    }

    fn text(&mut self, reference: u32) -> Result<String> {
        Ok(self.instance.get_string(&[reference])?.swap_remove(0))
    }
}

impl Instance {
    /// Reads a variable of any kind but String as a number.
    pub(crate) fn number(&mut self, kind: Kind, reference: u32) -> Result<f64> {
        Ok(match kind {
            Kind::Real => self.real(reference)?,
            Kind::Boolean => f64::from(u8::from(self.get_boolean(&[reference])?[0])),
            Kind::Integer | Kind::Enumeration => {
                let mut v = [0];
                self.get_integer(&[reference], &mut v)?;
                f64::from(v[0])
            }
            Kind::String => bail!("{}: a String is no number", self.name()),
        })
    }

    /// Sets a variable of any kind but String to a number.
    pub(crate) fn set_number(&mut self, kind: Kind, reference: u32, value: f64) -> Result<()> {
        let r = [reference];
        match kind {
            Kind::Real => self.set_real(&r, &[value])?,
            Kind::Boolean => self.set_boolean(&r, &[value != 0.0])?,
            Kind::Integer | Kind::Enumeration => {
                let whole = value.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&value);
                ensure!(whole, "{}: {value} is no Integer", self.name());
                self.set_integer(&r, &[value as i32])?;
            }
            Kind::String => bail!("{}: a number is no String", self.name()),
        }
        Ok(())
    }
}
