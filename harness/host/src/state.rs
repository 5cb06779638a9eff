//! Saved states of an instance (FMI 2.0 section 2.1.8).

use super::error::HostError;
use super::instance::{call, Instance};

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
        if s.owner == self.id && s.slot < self.slots {
            return Ok(s.slot);
        }
        Err(self.misuse("a state of another instance; write it to bytes there and read it here instead"))
    }

    /// Fills a slot that holds no state.
    fn fill(&mut self, fill: impl FnOnce(&mut Self, usize) -> Result<(), HostError>) -> Result<State, HostError> {
        let slot = self.free_slots.pop().unwrap_or_else(|| {
            self.slots += 1;
            self.slots - 1
        });
        match fill(self, slot) {
            Ok(()) => Ok(State { owner: self.id, slot }),
            Err(e) => {
                self.free_slots.push(slot);
                Err(e)
            }
        }
    }

    /// Saves the state.
    ///
    /// # Errors
    /// Where the FMU cannot, or refuses.
    pub fn save(&mut self) -> Result<State, HostError> {
        self.can_save()?;
        self.fill(|i, slot| call!(i, "fmi2GetFMUstate", get_state(slot)))
    }

    /// Saves the state over an earlier one, whose memory the FMU uses again.
    ///
    /// # Errors
    /// As [`Instance::save`], and where the state is of another instance.
    pub fn save_into(&mut self, s: &State) -> Result<(), HostError> {
        let slot = self.slot(s)?;
        call!(self, "fmi2GetFMUstate", get_state(slot))
    }

    /// Goes back to a saved state: memory, inputs, parameters and time. The state stays good.
    ///
    /// # Errors
    /// Where the FMU refuses, or the state is of another instance.
    pub fn restore(&mut self, s: &State) -> Result<(), HostError> {
        let slot = self.slot(s)?;
        call!(self, "fmi2SetFMUstate", set_state(slot))
    }

    /// Frees a saved state sooner than the instance does.
    ///
    /// # Errors
    /// Where the FMU refuses, or the state is of another instance.
    pub fn free(&mut self, s: State) -> Result<(), HostError> {
        let slot = self.slot(&s)?;
        self.free_slots.push(slot);
        call!(self, "fmi2FreeFMUstate", free_state(slot))
    }

    /// A saved state as bytes, for another instance or another process.
    ///
    /// # Errors
    /// Where the FMU cannot, or refuses.
    pub fn serialize(&mut self, s: &State) -> Result<Vec<u8>, HostError> {
        self.can_serialize()?;
        let slot = self.slot(s)?;
        call!(self, "fmi2SerializeFMUstate", serialize(slot))
    }

    /// A saved state from the bytes of one; [`Instance::restore`] then goes to it.
    ///
    /// # Errors
    /// Where the FMU cannot, or does not take the bytes.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result<State, HostError> {
        self.can_serialize()?;
        self.fill(|i, slot| call!(i, "fmi2DeSerializeFMUstate", deserialize(slot, bytes)))
    }

    /// Whether any saved state could still be restored.
    pub(super) fn holds_states(&self) -> bool {
        self.slots > self.free_slots.len()
    }
}
