//! The whole state of a bar, and its bytes.

use crate::bar::{Motion, Push};
use face::bytes::{number, Layout, CHECKSUM, HEADER};
use face::{Life, Phase};
use variables::{Settings, MODEL, PARAMETERS};

/// Everything that a later answer depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Phase and times; the inputs refused are 1 where the force waits for a finite number.
    pub life: Life,
    /// Parameters.
    pub settings: Settings,
    /// Motion at the last communication point.
    pub motion: Motion,
    /// Input force and its derivatives up to the third, as set since the last step.
    pub push: Push,
}

impl State {
    /// A bar never stepped.
    pub fn new(settings: Settings) -> Self {
        State { life: Life::default(), settings, motion: Motion::default(), push: [0.0; 4] }
    }

    /// Whether an instance can be in it: every number finite, every parameter within its range where it is past
    /// initialization.
    fn is_sound(&self) -> bool {
        let m = &self.motion;
        let set = (0..PARAMETERS).all(|i| self.settings.get(i).is_finite());
        let stepping = matches!(self.life.phase, Phase::Stepping | Phase::Terminated);
        self.life.is_sound(1)
            && set
            && (!stepping || self.settings.validate().is_ok())
            && [m.x, m.v, m.work].iter().chain(&self.push).all(|v| v.is_finite())
    }
}

const NUMBERS: usize = PARAMETERS + 3 + 2 + 4;
/// What the bytes of a state look like: phase, input refused, seated, numbers; the same on every platform.
pub const LAYOUT: Layout = Layout::new(MODEL, 2, 3 + 8 * NUMBERS);
/// Length of a state in bytes.
pub const BYTES: usize = LAYOUT.length;

/// The state as bytes, little endian.
pub fn to_bytes(s: &State) -> [u8; BYTES] {
    let mut o = [0u8; BYTES];
    o[HEADER] = s.life.phase as u8;
    o[HEADER + 1] = s.life.refused;
    o[HEADER + 2] = u8::from(s.motion.seated);
    let own = [s.motion.x, s.motion.v, s.motion.work, s.life.time, s.life.stop];
    let numbers = (0..PARAMETERS).map(|i| s.settings.get(i)).chain(own).chain(s.push);
    for (place, v) in o[HEADER + 3..BYTES - CHECKSUM].chunks_exact_mut(8).zip(numbers) {
        place.copy_from_slice(&v.to_le_bytes());
    }
    LAYOUT.seal(&mut o);
    o
}

/// The state of bytes that [`to_bytes`] wrote.
///
/// # Errors
/// What is wrong with them, or with the state that they hold.
pub fn from_bytes(b: &[u8]) -> Result<State, &'static str> {
    let own = LAYOUT.unseal(b)?;
    let value = |i: usize| number(own, 3 + 8 * i);
    let mut settings = Settings::default();
    for i in 0..PARAMETERS {
        settings.set(i, value(i));
    }
    let n = PARAMETERS;
    let s = State {
        life: Life {
            phase: Phase::from_byte(own[0]).ok_or("of no known phase")?,
            time: value(n + 3),
            stop: value(n + 4),
            refused: own[1],
        },
        settings,
        motion: Motion { x: value(n), v: value(n + 1), work: value(n + 2), seated: own[2] != 0 },
        push: [value(n + 5), value(n + 6), value(n + 7), value(n + 8)],
    };
    if s.is_sound() && own[2] <= 1 {
        Ok(s)
    } else {
        Err("of a state that no instance can be in")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_round_trip_and_damage_is_found() {
        let mut s = State::new(Settings::default());
        s.life.phase = Phase::Stepping;
        s.motion = Motion { x: 1.0, v: 2.0, seated: true, work: 3.0 };
        s.push = [4.0, 5.0, 6.0, 7.0];
        s.life.time = 8.0;
        let b = to_bytes(&s);
        assert_eq!(from_bytes(&b), Ok(s));
        for i in 0..BYTES {
            let mut c = b;
            c[i] ^= 1;
            assert!(from_bytes(&c).is_err(), "byte {}", i);
        }
        assert!(from_bytes(&b[1..]).is_err());
    }

    #[test]
    fn a_state_that_no_instance_can_be_in_is_refused_although_its_checksum_is_right() {
        type Change = fn(&mut State);
        let changes: [Change; 6] = [
            |s| s.life.time = f64::NAN,
            |s| s.life.refused = 2,
            |s| s.motion.x = f64::NAN,
            |s| s.motion.work = f64::INFINITY,
            |s| s.push[3] = f64::NAN,
            |s| s.settings.set(0, 0.0),
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut s = State::new(Settings::default());
            s.life.phase = Phase::Stepping;
            assert_eq!(from_bytes(&to_bytes(&s)), Ok(s));
            change(&mut s);
            assert!(from_bytes(&to_bytes(&s)).is_err(), "change {}", i);
        }
    }
}
