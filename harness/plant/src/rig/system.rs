//! The rig as the integrator sees it.

use super::Rig;
use crate::integrate::{After, Events, State, System, Taken};
use anyhow::Result;

impl Rig<'_> {
    /// Whether the contact element has refused anything.
    ///
    /// # Errors
    /// What it refused.
    #[inline]
    pub(crate) fn check(&self) -> Result<()> {
        match self.element {
            None => Ok(()),
            Some(e) => e.borrow_mut().check(),
        }
    }
}

impl System for Rig<'_> {
    #[inline]
    fn dimension(&self) -> usize {
        self.dimension()
    }
    #[inline]
    fn rates(&self, t: f64, y: &State, dy: &mut State) -> Result<()> {
        self.rates(t, y, dy);
        self.check()
    }
    #[inline]
    fn scale(&self) -> &State {
        self.scale()
    }
    #[inline]
    fn events(&self, t: f64, y: &State, _: Option<&State>, out: &mut Events) -> Result<usize> {
        let n = self.events(t, y, out);
        self.check()?;
        Ok(n)
    }
    #[inline]
    fn accept(&mut self, taken: &Taken<'_>, y: &mut State) -> Result<After> {
        let changed = self.accept(taken.t0 + taken.h, y);
        self.check()?;
        Ok(After { changed, next: f64::INFINITY })
    }
}
