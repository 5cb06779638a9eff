//! Calls of one slave that are handed over together: to an FMU in a process of its own they cross as one message.

use super::error::HostError;
use super::instance::{Component, Instance};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// One of them. What it borrows is copied where it crosses to another process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Call<'a> {
    /// Sets Reals: references, and a value for each in the variable's unit.
    SetReal(Cow<'a, [u32]>, Cow<'a, [f64]>),
    /// Sets the first time derivatives of Real inputs for the next step: references, and a derivative for each.
    SetRealInputDerivatives(Cow<'a, [u32]>, Cow<'a, [f64]>),
    /// Steps.
    DoStep {
        /// From this time on, s.
        time: f64,
        /// Over this time, s, > 0.
        step: f64,
    },
}

/// The function that reads the values at a batch's end.
pub(super) const GET_REAL: &str = "fmi2GetReal";

impl Call<'_> {
    /// The function that it calls.
    fn function(&self) -> &'static str {
        match self {
            Call::SetReal(..) => "fmi2SetReal",
            Call::SetRealInputDerivatives(..) => "fmi2SetRealInputDerivatives",
            Call::DoStep { .. } => "fmi2DoStep",
        }
    }

    /// Whether there is a value for each reference.
    fn is_even(&self) -> bool {
        match self {
            Call::SetReal(r, v) | Call::SetRealInputDerivatives(r, v) => r.len() == v.len(),
            Call::DoStep { .. } => true,
        }
    }
}

impl Instance {
    /// Makes the calls in order, and reads Reals into `values` after them, in the variables' units. The first that is not well
    /// ends it. Same as the calls one by one; the log of an error is that of the whole batch where the FMU is in a process of
    /// its own.
    ///
    /// # Errors
    /// As the functions called give them: [`Instance::set_real`], [`Instance::set_real_input_derivatives`],
    /// [`Instance::do_step`], [`Instance::get_real`].
    pub fn batch(&mut self, calls: &[Call<'_>], references: &[u32], values: &mut [f64]) -> Result<(), HostError> {
        if calls.is_empty() && references.is_empty() && values.is_empty() {
            return Ok(());
        }
        let interpolates = self.fmu.capabilities().can_interpolate_inputs;
        let crosses = references.len() == values.len()
            && calls.iter().all(|c| c.is_even() && (interpolates || !matches!(c, Call::SetRealInputDerivatives(..))));
        self.alive()?;
        let never_back = !self.holds_states();
        match &mut self.component {
            Some(Component::Apart(a)) if crosses => {
                self.log.begin();
                let done = a.batch(calls, never_back, references, values);
                let reached = done.as_ref().err().map_or(calls.len(), |(at, _)| *at);
                // where one step fails the time is its start, and otherwise the last one's end
                if let Some(Call::DoStep { time, step }) =
                    calls.iter().take(reached + 1).rfind(|c| matches!(c, Call::DoStep { .. }))
                {
                    let is_over = !matches!(calls.get(reached), Some(Call::DoStep { .. }));
                    self.reached(if is_over { time + step } else { *time });
                }
                done.map_err(|(at, t)| self.error(calls.get(at).map_or(GET_REAL, Call::function), *t))
            }
            // what is wrong with a call is said by itself
            _ => {
                for c in calls {
                    match c {
                        Call::SetReal(r, v) => self.set_real(r, v)?,
                        Call::SetRealInputDerivatives(r, v) => {
                            self.set_real_input_derivatives(r, &vec![1; r.len()], v)?;
                        }
                        Call::DoStep { time, step } => self.do_step(*time, *step)?,
                    }
                }
                if references.is_empty() && values.is_empty() {
                    return Ok(());
                }
                self.get_real(references, values)
            }
        }
    }
}
