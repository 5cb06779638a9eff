//! The whole state, and its bytes.

use face::bytes::{number, Layout, CHECKSUM, HEADER};
use face::{Life, Phase};
use variables::{Settings, INPUTS, MODEL, PARAMETERS};

/// Everything that a later answer depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Phase and times; bit i of the inputs refused is 1 where input i waits for a finite number.
    pub life: Life,
    /// Parameters.
    pub settings: Settings,
    /// Inputs as set: penetration m, velocity m/s, force N.
    pub inputs: [f64; INPUTS],
    /// Velocity at the last communication point, m/s.
    pub velocity: f64,
}

impl State {
    /// Never stepped.
    pub fn new(settings: Settings) -> Self {
        State { life: Life::default(), settings, inputs: [0.0; INPUTS], velocity: 0.0 }
    }

    /// Whether an instance can be in it: every number finite, every parameter within its range where it is past
    /// initialization.
    fn is_sound(&self) -> bool {
        let set = (0..PARAMETERS).all(|i| self.settings.get(i).is_finite());
        let stepping = matches!(self.life.phase, Phase::Stepping | Phase::Terminated);
        self.life.is_sound(INPUTS as u32)
            && set
            && (!stepping || self.settings.validate().is_ok())
            && self.inputs.iter().chain([&self.velocity]).all(|v| v.is_finite())
    }
}

const NUMBERS: usize = PARAMETERS + INPUTS + 3;
/// What the bytes of a state look like: phase, inputs refused, numbers; the same on every platform.
pub const LAYOUT: Layout = Layout::new(MODEL, 2, 2 + 8 * NUMBERS);
/// Length of a state in bytes.
pub const BYTES: usize = LAYOUT.length;

/// The state as bytes, little endian.
pub fn to_bytes(s: &State) -> [u8; BYTES] {
    let mut o = [0u8; BYTES];
    o[HEADER] = s.life.phase as u8;
    o[HEADER + 1] = s.life.refused;
    let numbers =
        (0..PARAMETERS).map(|i| s.settings.get(i)).chain(s.inputs).chain([s.velocity, s.life.time, s.life.stop]);
    for (place, v) in o[HEADER + 2..BYTES - CHECKSUM].chunks_exact_mut(8).zip(numbers) {
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
    let value = |i: usize| number(own, 2 + 8 * i);
    let mut settings = Settings::default();
    for i in 0..PARAMETERS {
        settings.set(i, value(i));
    }
    let n = PARAMETERS;
    let s = State {
        life: Life {
            phase: Phase::from_byte(own[0]).ok_or("of no known phase")?,
            time: value(n + INPUTS + 1),
            stop: value(n + INPUTS + 2),
            refused: own[1],
        },
        settings,
        inputs: [value(n), value(n + 1), value(n + 2)],
        velocity: value(n + INPUTS),
    };
    if s.is_sound() {
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
        s.inputs = [4.0, 5.0, 6.0];
        s.velocity = 7.0;
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
        let changes: [Change; 5] = [
            |s| s.life.time = f64::NAN,
            |s| s.life.refused = 8,
            |s| s.inputs[2] = f64::NAN,
            |s| s.velocity = f64::INFINITY,
            |s| s.settings.set(0, -1.0),
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
