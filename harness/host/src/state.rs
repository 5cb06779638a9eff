//! Saved states of an instance (FMI 2.0 section 2.1.8).

use super::error::HostError;
use super::instance::{call, Instance};
use std::ffi::c_char;

/// A saved state. It belongs to the instance that made it and goes with it at the latest.
#[derive(Debug)]
#[must_use]
pub struct State {
    owner: u64,
    slot: usize,
}

impl Instance {
    fn can_save(&self) -> Result<(), HostError> {
        if self.fmu().capabilities().can_get_and_set_fmu_state {
            return Ok(());
        }
        Err(self.misuse("this FMU declares no canGetAndSetFMUstate, so its state cannot be saved"))
    }

    fn can_serialize(&self) -> Result<(), HostError> {
        if self.fmu().capabilities().can_serialize_fmu_state {
            return Ok(());
        }
        Err(self.misuse("this FMU declares no canSerializeFMUstate, so its state cannot be written to bytes"))
    }

    fn slot(&self, s: &State) -> Result<usize, HostError> {
        if s.owner == self.id && s.slot < self.states.len() {
            return Ok(s.slot);
        }
        Err(self.misuse("a state of another instance; write it to bytes there and read it here instead"))
    }

    fn keep(&mut self, raw: fmi::fmi2::binding::fmi2FMUstate) -> Result<State, HostError> {
        if raw.is_null() {
            return Err(self.misuse("the FMU answered fmi2OK and handed out no state"));
        }
        let slot = self.free_slots.pop().unwrap_or_else(|| {
            self.states.push(std::ptr::null_mut());
            self.states.len() - 1
        });
        self.states[slot] = raw;
        Ok(State { owner: self.id, slot })
    }

    /// Saves the state.
    ///
    /// # Errors
    /// Where the FMU cannot, or refuses.
    pub fn save(&mut self) -> Result<State, HostError> {
        self.can_save()?;
        let mut raw = std::ptr::null_mut();
        call!(self, fmi2GetFMUstate, &mut raw)?;
        self.keep(raw)
    }

    /// Saves the state over an earlier one, whose memory the FMU uses again.
    ///
    /// # Errors
    /// As [`Instance::save`], and where the state is of another instance.
    pub fn save_into(&mut self, s: &State) -> Result<(), HostError> {
        let slot = self.slot(s)?;
        let mut raw = self.states[slot];
        let done = call!(self, fmi2GetFMUstate, &mut raw);
        // the FMU may have replaced it whatever it answered
        self.states[slot] = raw;
        done
    }

    /// Goes back to a saved state: memory, inputs, parameters and time. The state stays good.
    ///
    /// # Errors
    /// Where the FMU refuses, or the state is of another instance.
    pub fn restore(&mut self, s: &State) -> Result<(), HostError> {
        let raw = self.states[self.slot(s)?];
        call!(self, fmi2SetFMUstate, raw)
    }

    /// Frees a saved state sooner than the instance does.
    ///
    /// # Errors
    /// Where the FMU refuses, or the state is of another instance.
    pub fn free(&mut self, s: State) -> Result<(), HostError> {
        let slot = self.slot(&s)?;
        let mut raw = std::mem::replace(&mut self.states[slot], std::ptr::null_mut());
        self.free_slots.push(slot);
        call!(self, fmi2FreeFMUstate, &mut raw)
    }

    /// A saved state as bytes, for another instance or another process.
    ///
    /// # Errors
    /// Where the FMU cannot, or refuses.
    pub fn serialize(&mut self, s: &State) -> Result<Vec<u8>, HostError> {
        self.can_serialize()?;
        let raw = self.states[self.slot(s)?];
        let mut size = 0;
        call!(self, fmi2SerializedFMUstateSize, raw, &mut size)?;
        let mut bytes = vec![0u8; size];
        call!(self, fmi2SerializeFMUstate, raw, bytes.as_mut_ptr().cast::<c_char>(), size)?;
        Ok(bytes)
    }

    /// A saved state from the bytes of one; [`Instance::restore`] then goes to it.
    ///
    /// # Errors
    /// Where the FMU cannot, or does not take the bytes.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result<State, HostError> {
        self.can_serialize()?;
        let mut raw = std::ptr::null_mut();
        call!(self, fmi2DeSerializeFMUstate, bytes.as_ptr().cast::<c_char>(), bytes.len(), &mut raw)?;
        self.keep(raw)
    }

    /// Whether any saved state could still be restored.
    pub(super) fn holds_states(&self) -> bool {
        self.states.len() > self.free_slots.len()
    }
}
