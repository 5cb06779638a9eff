//! The whole state of a bar, and its bytes.

use crate::bar::{Motion, Push};
use face::bytes::{number, seal, unseal};
use face::{Life, Phase};
use variables::{Settings, PARAMETERS};

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
}

const MAGIC: [u8; 8] = *b"tdmoveb1";
const NUMBERS: usize = PARAMETERS + 3 + 2 + 4;
/// Length of a state in bytes: magic, phase, refused, seated, numbers, checksum; the same on every platform.
pub const BYTES: usize = 8 + 3 + 8 * NUMBERS + 8;

/// The state as bytes, little endian.
pub fn to_bytes(s: &State) -> [u8; BYTES] {
    let mut o = [0u8; BYTES];
    o[..8].copy_from_slice(&MAGIC);
    o[8] = s.life.phase as u8;
    o[9] = s.life.refused;
    o[10] = u8::from(s.motion.seated);
    let own = [s.motion.x, s.motion.v, s.motion.work, s.life.time, s.life.stop];
    let numbers = (0..PARAMETERS).map(|i| s.settings.get(i)).chain(own).chain(s.push);
    for (place, v) in o[11..BYTES - 8].chunks_exact_mut(8).zip(numbers) {
        place.copy_from_slice(&v.to_le_bytes());
    }
    seal(&mut o);
    o
}

/// The state of bytes that [`to_bytes`] wrote.
///
/// # Errors
/// What is wrong with them.
pub fn from_bytes(b: &[u8]) -> Result<State, &'static str> {
    unseal(b, BYTES, MAGIC)?;
    let value = |i: usize| number(b, 11 + 8 * i);
    let mut settings = Settings::default();
    for i in 0..PARAMETERS {
        settings.set(i, value(i));
    }
    let n = PARAMETERS;
    Ok(State {
        life: Life {
            phase: Phase::from_byte(b[8]).ok_or("of no known phase")?,
            time: value(n + 3),
            stop: value(n + 4),
            refused: b[9],
        },
        settings,
        motion: Motion { x: value(n), v: value(n + 1), work: value(n + 2), seated: b[10] != 0 },
        push: [value(n + 5), value(n + 6), value(n + 7), value(n + 8)],
    })
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
}
