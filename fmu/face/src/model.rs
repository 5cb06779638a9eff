//! What a model is to the interface.

use crate::bytes::Layout;
use crate::life::{error, Life, Outcome, Phase};
use crate::start::GUID_LENGTH;
use crate::text;

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// fmi2Real.
    Real,
    /// fmi2Integer; of an Enumeration too.
    Integer,
    /// fmi2Boolean.
    Boolean,
}

/// A model behind the interface. `Default` is an instance as fmi2Instantiate returns it; times are in s, values in the
/// units of the modelDescription, a Boolean is 0 or 1.
///
/// A call that returns a [`crate::Refusal`] leaves the instance as it was, but for [`Life::refused`].
pub trait Model: Default + Clone {
    /// Everything that later answers depend on.
    type State: Copy;
    /// Name, as the modelDescription has it.
    const NAME: &'static str;
    /// Log categories: warnings, discards, errors, and the model's own events.
    const LOG_CATEGORIES: [&'static str; 4];
    /// What the bytes of a state look like.
    const LAYOUT: Layout;

    /// The GUID that a host has to give.
    fn guid() -> [u8; GUID_LENGTH];
    /// The state.
    fn state(&self) -> Self::State;
    /// Takes up a state that was kept.
    fn restore(&mut self, state: Self::State);
    /// Writes a state into as many bytes as [`Model::LAYOUT`] has.
    fn write(state: &Self::State, bytes: &mut [u8]);
    /// Reads a state that [`Model::write`] wrote: one that an instance can be in.
    ///
    /// # Errors
    /// What is wrong with the bytes, or with the state that they hold.
    fn read(bytes: &[u8]) -> Result<Self::State, &'static str>;
    /// The part of the state that every model has.
    fn life(&self) -> &Life;
    /// The same, to change.
    fn life_mut(&mut self) -> &mut Life;

    /// fmi2ExitInitializationMode.
    ///
    /// # Errors
    /// Out of order; a parameter out of its range; an input not finite.
    fn exit_initialization(&mut self) -> Outcome<()>;
    /// Sets a variable of `kind`.
    ///
    /// # Errors
    /// No such variable; not to be set, or not now; a value that is not finite.
    fn set(&mut self, reference: u32, kind: Kind, value: f64) -> Outcome<()>;
    /// Sets Reals where none of them can be refused; false: nothing was done, each has to be set by itself. A model
    /// does here what hosts do at every step, for it spares the copy that undoing needs.
    #[inline]
    fn set_reals(&mut self, _references: &[u32], _values: &[f64]) -> bool {
        false
    }
    /// Value of a variable of `kind`.
    ///
    /// # Errors
    /// No such variable, or no value yet.
    fn get(&self, reference: u32, kind: Kind) -> Outcome<f64>;
    /// Value of a Real where it needs no more than a look; None: [`Model::get`] has to be asked. A model answers here what
    /// hosts read at every step.
    #[inline]
    fn real_at_once(&self, _reference: u32) -> Option<f64> {
        None
    }
    /// Partial derivative of the output `unknown` along the input `known`, in their units.
    ///
    /// # Errors
    /// Before fmi2EnterInitializationMode; no such output or input; no finite derivative.
    fn directional(&self, unknown: u32, known: u32) -> Outcome<f64>;
    /// Sets the derivative of an input of `order` for the next step, in the input's unit per s^order.
    ///
    /// # Errors
    /// Out of order; no input; an order that is not taken; not finite.
    fn set_input_derivative(&mut self, reference: u32, order: i32, value: f64) -> Outcome<()>;
    /// Derivative of an output of `order`, in the output's unit per s^order.
    ///
    /// # Errors
    /// Out of order; no output; an order that is not given.
    fn output_derivative(&self, reference: u32, order: i32) -> Outcome<f64>;
    /// A step from `time` over `step`; what began or ended in it, for the log.
    ///
    /// # Errors
    /// Out of order; a time that is not the instance's; a step that is none; inputs or answers that are not finite.
    fn do_step(&mut self, time: f64, step: f64) -> Outcome<Option<&'static str>>;

    /// fmi2SetupExperiment.
    ///
    /// # Errors
    /// As [`Life::set_up`].
    fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Outcome<()> {
        self.life_mut().set_up(start, stop)
    }

    /// fmi2EnterInitializationMode.
    ///
    /// # Errors
    /// Out of order.
    fn enter_initialization(&mut self) -> Outcome<()> {
        self.life().require("fmi2EnterInitializationMode", &[Phase::Instantiated])?;
        self.life_mut().phase = Phase::Initialization;
        Ok(())
    }

    /// fmi2Terminate.
    ///
    /// # Errors
    /// Out of order.
    fn terminate(&mut self) -> Outcome<()> {
        self.life().require("fmi2Terminate", &[Phase::Stepping])?;
        self.life_mut().phase = Phase::Terminated;
        Ok(())
    }

    /// fmi2Reset: as fmi2Instantiate returned it.
    fn reset(&mut self) {
        *self = Self::default();
    }
}

/// Holds a variable found (its name, its type and what else the model needs) against the type a host asks for.
///
/// # Errors
/// No such variable, or one of another type.
#[inline]
pub fn checked<T>(found: Option<(&'static str, Kind, T)>, reference: u32, kind: Kind) -> Outcome<(&'static str, T)> {
    match found {
        Some((name, is, rest)) if is == kind => Ok((name, rest)),
        other => not_there(other.map(|(name, is, _)| (name, is)), reference, kind),
    }
}

#[cold]
fn not_there<T>(found: Option<(&'static str, Kind)>, reference: u32, kind: Kind) -> Outcome<T> {
    match found {
        Some((name, is)) => error(text!("{} (value reference {}) is {:?}, not {:?}", name, reference, is, kind)),
        None => error(text!("no variable has value reference {}", reference)),
    }
}
