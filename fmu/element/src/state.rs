//! The whole state of an instance, and its bytes.

use crate::variables::{Settings, PARAMETERS};
use face::bytes::{number, seal, unseal};
use face::{Life, Phase};
use law::{Memory, BRANCHES};

/// Everything that a later answer depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Phase and times; bit 0 of the inputs refused is the penetration, bit 1 the velocity.
    pub life: Life,
    /// Parameters.
    pub settings: Settings,
    /// Memory of the law at the last communication point.
    pub memory: Memory,
    /// Inputs (penetration m, velocity m/s) as set.
    pub input: [f64; 2],
    /// Their derivatives as set since the last step; NaN for none.
    pub slope: [f64; 2],
    /// Inputs at the end of the last step.
    pub last: [f64; 2],
    /// Rate of change of the velocity over the last step, m/s^2.
    pub acceleration: f64,
    /// Size of the last step, s; 0 before any.
    pub step: f64,
}

impl State {
    /// A state never stepped.
    pub fn new(settings: Settings) -> Self {
        State {
            life: Life::default(),
            settings,
            memory: Memory::default(),
            input: [0.0; 2],
            slope: [f64::NAN; 2],
            last: [0.0; 2],
            acceleration: 0.0,
            step: 0.0,
        }
    }
}

const MAGIC: [u8; 8] = *b"tdstate2";
const NUMBERS: usize = PARAMETERS + 4 + BRANCHES + 10;
/// Length of a state in bytes: magic, phase, refused, numbers, checksum; the same on every platform.
pub const BYTES: usize = 8 + 2 + 8 * NUMBERS + 8;

/// The state as bytes, little endian.
pub fn to_bytes(s: &State) -> [u8; BYTES] {
    let mut o = [0u8; BYTES];
    let mut n = 0;
    let mut put = |b: &[u8]| {
        o[n..n + b.len()].copy_from_slice(b);
        n += b.len();
    };
    put(&MAGIC);
    let life = &s.life;
    put(&[life.phase as u8, life.refused]);
    for i in 0..PARAMETERS {
        put(&s.settings.get(i).to_le_bytes());
    }
    let m = &s.memory;
    for v in [m.deepest, m.released, m.work, m.stored].iter().chain(&m.relaxation) {
        put(&v.to_le_bytes());
    }
    let rest = [
        life.time,
        life.stop,
        s.input[0],
        s.input[1],
        s.slope[0],
        s.slope[1],
        s.last[0],
        s.last[1],
        s.acceleration,
        s.step,
    ];
    for v in rest {
        put(&v.to_le_bytes());
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
    let phase = Phase::from_byte(b[8]).ok_or("of no known phase")?;
    let mut n = 10;
    let mut take = || {
        n += 8;
        number(b, n - 8)
    };
    let mut settings = Settings::default();
    for i in 0..PARAMETERS {
        settings.set(i, take());
    }
    let mut memory = Memory { deepest: take(), released: take(), work: take(), stored: take(), ..Memory::default() };
    for f in &mut memory.relaxation {
        *f = take();
    }
    Ok(State {
        life: Life { phase, time: take(), stop: take(), refused: b[9] },
        settings,
        memory,
        input: [take(), take()],
        slope: [take(), take()],
        last: [take(), take()],
        acceleration: take(),
        step: take(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_round_trip_and_damage_is_found() {
        let mut s = State::new(Settings::default());
        s.life.phase = Phase::Stepping;
        s.memory.relaxation = [1.0, 2.0, 3.0];
        s.memory.work = 0.125;
        s.slope = [4.0, 5.0];
        s.life.time = 7.0;
        s.life.refused = 2;
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
