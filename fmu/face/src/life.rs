//! An instance's life: its phases, its times, and why a call is refused.

use crate::text;

/// Where an instance stands in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// fmi2Instantiate returned it, or fmi2Reset.
    Instantiated = 0,
    /// Between fmi2EnterInitializationMode and fmi2ExitInitializationMode.
    Initialization = 1,
    /// May step.
    Stepping = 2,
    /// After fmi2Terminate.
    Terminated = 3,
}

impl Phase {
    /// The phase of a byte that [`Phase`] was written as.
    pub fn from_byte(b: u8) -> Option<Phase> {
        match b {
            0 => Some(Phase::Instantiated),
            1 => Some(Phase::Initialization),
            2 => Some(Phase::Stepping),
            3 => Some(Phase::Terminated),
            _ => None,
        }
    }
}

/// Why a call was not done.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The call cannot be done now; the instance is as it was.
    Discard(String),
    /// The call is wrong; the instance is as it was.
    Error(String),
}

/// What a call comes to.
pub type Outcome<T> = Result<T, Refusal>;

/// Times agree within this share of themselves, so that t = i h and a running sum of h both pass.
const TIME_TOLERANCE: f64 = 1e-8;

/// An error that says why.
///
/// # Errors
/// Always.
#[cold]
pub fn error<T>(message: String) -> Outcome<T> {
    Err(Refusal::Error(message))
}

/// What every model's state has: phase, times, and inputs that wait for a finite value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Life {
    /// Phase.
    pub phase: Phase,
    /// Time, s.
    pub time: f64,
    /// End of the experiment, s; infinite where the host named none.
    pub stop: f64,
    /// Which inputs were refused last and wait for a finite value, a bit each.
    pub refused: u8,
}

impl Default for Life {
    /// As fmi2Instantiate leaves it.
    fn default() -> Self {
        Life { phase: Phase::Instantiated, time: 0.0, stop: f64::INFINITY, refused: 0 }
    }
}

impl Life {
    /// Holds a call against the phases it is allowed in.
    ///
    /// # Errors
    /// Names the call and the phase.
    #[inline]
    pub fn require(&self, call: &str, allowed: &[Phase]) -> Outcome<()> {
        if allowed.contains(&self.phase) {
            Ok(())
        } else {
            not_allowed(call, self.phase)
        }
    }

    /// Begins an experiment at `start` s, to end at `stop` s where the host names an end.
    ///
    /// # Errors
    /// Out of order; times that are not finite; a stop before the start.
    pub fn set_up(&mut self, start: f64, stop: Option<f64>) -> Outcome<()> {
        self.require("fmi2SetupExperiment", &[Phase::Instantiated])?;
        let end = stop.unwrap_or(f64::INFINITY);
        if !start.is_finite() || end.is_nan() || end < start {
            return error(text!("start {} s and stop {} s: give finite times, stop not before start", start, end));
        }
        self.stop = end;
        self.time = start;
        Ok(())
    }

    /// Holds a step from `time` s over `step` s against the phase, the time of the instance and its stop time.
    ///
    /// # Errors
    /// Out of order; a step that is none; a time that is not the instance's; a step past the stop time.
    #[inline]
    pub fn step_is_good(&self, time: f64, step: f64) -> Outcome<()> {
        // nearly every step, without a maximum: what fits within the step's own tolerance fits within any
        let end = time + step;
        let near = (time - self.time).abs() <= TIME_TOLERANCE * step && end <= self.stop && end < f64::INFINITY;
        if self.phase == Phase::Stepping && step > 0.0 && step < f64::INFINITY && near {
            return Ok(());
        }
        self.step_is_good_in_detail(time, step)
    }

    #[inline(never)]
    fn step_is_good_in_detail(&self, time: f64, step: f64) -> Outcome<()> {
        self.require("fmi2DoStep", &[Phase::Stepping])?;
        let tolerance = TIME_TOLERANCE * time.abs().max(self.time.abs()).max(step);
        let good = step.is_finite() && step > 0.0 && time.is_finite();
        let end = time + step;
        if good && (time - self.time).abs() <= tolerance && end <= self.stop + tolerance && end < f64::INFINITY {
            return Ok(());
        }
        self.why_no_step(time, step, tolerance)
    }

    #[cold]
    fn why_no_step(&self, time: f64, step: f64, tolerance: f64) -> Outcome<()> {
        if !(step.is_finite() && step > 0.0) {
            return error(text!("communicationStepSize is {}: give a finite step above 0 s", step));
        }
        if !time.is_finite() || (time - self.time).abs() > tolerance {
            return error(text!("currentCommunicationPoint is {} s, the instance stands at {} s", time, self.time));
        }
        error(text!("a step to {} s leads past the stop time {} s, or past all numbers", time + step, self.stop))
    }

    /// Whether an instance can be in it, with the inputs refused among the first `inputs`.
    pub fn is_sound(&self, inputs: u32) -> bool {
        self.time.is_finite() && !self.stop.is_nan() && u32::from(self.refused) >> inputs == 0
    }
}

#[cold]
fn not_allowed(call: &str, phase: Phase) -> Outcome<()> {
    error(text!("{} is not allowed while {:?}", call, phase))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_held_against_each_other() {
        let mut l = Life::default();
        assert!(l.step_is_good(0.0, 1e-3).is_err());
        for (start, stop) in [(f64::NAN, None), (f64::INFINITY, None), (1.0, Some(0.5)), (0.0, Some(f64::NAN))] {
            assert!(l.set_up(start, stop).is_err());
            assert_eq!(l, Life::default());
        }
        l.set_up(1.0, Some(2.0)).unwrap();
        l.phase = Phase::Stepping;
        assert!(l.set_up(1.0, None).is_err());
        let endless = Life { phase: Phase::Stepping, time: 1e308, ..Life::default() };
        assert!(endless.step_is_good(1e308, 1e308).is_err() && endless.step_is_good(1e308, 1e300).is_ok());
        assert!(l.is_sound(0) && Life { refused: 2, ..l }.is_sound(2) && !Life { refused: 2, ..l }.is_sound(1));
        assert!(!Life { time: f64::NAN, ..l }.is_sound(1) && !Life { stop: f64::NAN, ..l }.is_sound(1));
        for (time, step) in [(1.0, 1e-3), (1.0 + 1e-12, 1e-3), (1.0 + 1e-9, 1e-3), (1.0, 1.0 + 1e-9)] {
            assert_eq!(l.step_is_good(time, step), Ok(()), "{} {}", time, step);
        }
        let wrong = [
            (1.0, 0.0),
            (1.0, -1.0),
            (1.0, f64::NAN),
            (1.0, f64::INFINITY),
            (f64::NAN, 1e-3),
            (f64::INFINITY, 1e-3),
            (1.1, 1e-3),
            (0.0, 1e-3),
            (1.0, 1.1),
        ];
        for (time, step) in wrong {
            assert!(matches!(l.step_is_good(time, step), Err(Refusal::Error(_))), "{} {}", time, step);
        }
    }

    #[test]
    fn phases_come_back_from_their_bytes() {
        for p in [Phase::Instantiated, Phase::Initialization, Phase::Stepping, Phase::Terminated] {
            assert_eq!(Phase::from_byte(p as u8), Some(p));
        }
        assert_eq!(Phase::from_byte(4), None);
    }
}
