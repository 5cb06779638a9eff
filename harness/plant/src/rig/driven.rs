//! A contact element in the law's place, driven through a motion.

use crate::element::Element;
use anyhow::Result;

/// A penetration that is contact but no depth, m.
const TINY: f64 = 1e-300;

/// A contact element that takes the law's place in a simulation.
pub(crate) struct Driven<'e> {
    pub element: &'e mut (dyn Element + 'e),
    /// Time, penetration and velocity up to which its memory has moved.
    pub at: (f64, f64, f64),
    /// Whether the surfaces meet during a whole step, where the events that end steps say so; None: they may come to
    /// meet inside one.
    pub inside: Option<bool>,
    /// The instant at which the force is asked, s, for the foreseen rate.
    pub now: f64,
    /// Foreseen rate of the force by the element's memory alone, N/s, from time `since` on.
    pub rate: f64,
    pub since: f64,
    /// The last force asked for: time, penetration, velocity, force.
    last: Option<(f64, f64, f64, f64)>,
    /// The first thing it refused.
    failed: Option<anyhow::Error>,
}

impl<'e> Driven<'e> {
    pub fn new(element: &'e mut (dyn Element + 'e)) -> Driven<'e> {
        Driven { element, at: (0.0, 0.0, 0.0), inside: None, now: 0.0, rate: 0.0, since: 0.0, last: None, failed: None }
    }

    /// Force, N; not a number from the first refusal on.
    pub fn force(&mut self, x: f64, v: f64) -> f64 {
        // one smooth branch a step: which one is settled by the events
        let x = match self.inside {
            None => x,
            Some(true) => x.max(TINY),
            Some(false) => x.min(0.0),
        };
        let now = self.now;
        if let Some((_, _, _, f)) = self.last.filter(|l| (l.0, l.1, l.2) == (now, x, v)) {
            return f;
        }
        if self.failed.is_some() {
            return f64::NAN;
        }
        match self.element.force(x, v) {
            Ok(f) => {
                let f = if self.rate != 0.0 && f > 0.0 { (f + self.rate * (now - self.since)).max(0.0) } else { f };
                self.last = Some((now, x, v, f));
                f
            }
            Err(e) => {
                self.failed = Some(e);
                f64::NAN
            }
        }
    }

    /// (dF/dx N/m, dF/dv N s/m), the memory held; not numbers from the first refusal on.
    pub fn derivatives(&mut self, x: f64, v: f64) -> (f64, f64) {
        if self.failed.is_none() {
            match self.element.derivatives(x, v) {
                Ok(d) => return d,
                Err(e) => self.failed = Some(e),
            }
        }
        (f64::NAN, f64::NAN)
    }

    /// Moves the memory on to (`x` m, `v` m/s) at `t` s; nothing where it stands there or beyond already.
    pub fn advance(&mut self, t: f64, x: f64, v: f64) {
        if t > self.at.0 {
            self.piece((x, v), t - self.at.0);
            self.at.0 = t;
        }
    }

    /// Moves the memory on to (m, m/s) in `dt` s.
    pub fn piece(&mut self, to: (f64, f64), dt: f64) {
        if self.failed.is_none() {
            self.last = None;
            if let Err(e) = self.element.advance((self.at.1, self.at.2), to, dt) {
                self.failed = Some(e);
            }
        }
        (self.at.1, self.at.2) = to;
    }

    /// The next force is asked anew: what is foreseen of it has changed.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// The first thing it refused, once.
    ///
    /// # Errors
    /// That.
    pub fn check(&mut self) -> Result<()> {
        self.failed.take().map_or(Ok(()), Err)
    }
}
