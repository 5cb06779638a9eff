//! A contact element as a body's integrator sees it.

use anyhow::Result;
use law::{Memory, Parameters};

/// A contact element: force from penetration and velocity, with a memory that moves only when a step is accepted.
pub trait Element {
    /// Force, N, positive in compression, at penetration `x` m and velocity `v` m/s, with the memory as it stands.
    ///
    /// # Errors
    /// Where the element refuses: the message says which element and why.
    fn force(&mut self, x: f64, v: f64) -> Result<f64>;

    /// (dF/dx N/m, dF/dv N s/m), the memory held.
    ///
    /// # Errors
    /// As [`Element::force`].
    fn derivatives(&mut self, x: f64, v: f64) -> Result<(f64, f64)>;

    /// Accepts a step of `dt` s from (`x0`, `v0`) to (`x1`, `v1`), m and m/s: the memory moves on.
    ///
    /// # Errors
    /// As [`Element::force`].
    fn advance(&mut self, from: (f64, f64), to: (f64, f64), dt: f64) -> Result<()>;

    /// (stored J, dissipated J) so far; None where the element does not report them.
    ///
    /// # Errors
    /// As [`Element::force`].
    fn energies(&mut self) -> Result<Option<(f64, f64)>>;

    /// Longest step, s, the integrator should take next; None: any. An element that holds its force between
    /// communication points gives the time to the next one.
    fn longest_step(&self) -> Option<f64> {
        None
    }
}

/// The law called directly: what the FMU answers, without the FMU. A trial is taken from where the last step ended,
/// as [`Parameters::tried`] has it; a motion that begins in contact finds it loaded slowly.
#[derive(Clone, Debug)]
pub struct Direct {
    law: Parameters,
    memory: Memory,
    /// (x, v) at the end of the last step; None before the first call.
    last: Option<(f64, f64)>,
    accepted: bool,
}

impl Direct {
    /// An element never touched.
    pub fn new(law: Parameters) -> Self {
        Direct { law, memory: Memory::default(), last: None, accepted: false }
    }

    fn start(&mut self, at: (f64, f64)) -> (f64, f64) {
        self.memory = self.law.start(at.0);
        self.last = Some(at);
        at
    }

    /// The memory as it is while (`x`, `v`) is tried.
    fn tried(&mut self, x: f64, v: f64) -> Memory {
        let last = match self.last {
            Some(last) => last,
            None => self.start((x, v)),
        };
        self.law.tried(&self.memory, last, (x, v))
    }
}

impl Element for Direct {
    fn force(&mut self, x: f64, v: f64) -> Result<f64> {
        let memory = self.tried(x, v);
        Ok(self.law.force(&memory, x, v))
    }

    fn derivatives(&mut self, x: f64, v: f64) -> Result<(f64, f64)> {
        let memory = self.tried(x, v);
        let (mut fx, fv) = self.law.derivatives(&memory, x, v);
        if self.law.relaxes() && self.law.pushes(&memory, x, v) {
            fx += self.law.relaxation_slope(x);
        }
        Ok((fx, fv))
    }

    fn advance(&mut self, from: (f64, f64), to: (f64, f64), dt: f64) -> Result<()> {
        if !self.accepted {
            self.start(from);
        }
        if dt > 0.0 {
            self.memory = self.law.advance(&self.memory, from.0, from.1, to.0, to.1, dt);
            self.last = Some(to);
            self.accepted = true;
        }
        Ok(())
    }

    fn energies(&mut self) -> Result<Option<(f64, f64)>> {
        Ok(Some((self.memory.stored, self.memory.dissipated())))
    }
}
