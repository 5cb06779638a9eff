//! The whole state of an instance, and its bytes.

use crate::variables::{Settings, MODEL, PARAMETERS};
use face::bytes::{number, Layout, HEADER};
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

    /// Whether an instance can be in it: every number finite that has to be, every parameter within its range where it
    /// is past initialization.
    fn is_sound(&self) -> bool {
        let finite = |numbers: &[f64]| numbers.iter().all(|v| v.is_finite());
        let m = &self.memory;
        let set = (0..PARAMETERS).all(|i| self.settings.get(i).is_finite());
        let stepping = matches!(self.life.phase, Phase::Stepping | Phase::Terminated);
        self.life.is_sound(2)
            && set
            && (!stepping || self.settings.validate().is_ok())
            && finite(&[m.deepest, m.released, m.work, m.stored])
            && m.deepest >= 0.0
            && finite(&m.relaxation)
            && finite(&self.input)
            && self.slope.iter().all(|v| !v.is_infinite())
            && finite(&self.last)
            && self.acceleration.is_finite()
            && self.step.is_finite()
            && self.step >= 0.0
    }
}

const NUMBERS: usize = PARAMETERS + 4 + BRANCHES + 10;
/// What the bytes of a state look like: phase, inputs refused, numbers; the same on every platform.
pub const LAYOUT: Layout = Layout::new(MODEL, 4, 2 + 8 * NUMBERS);
/// Length of a state in bytes.
pub const BYTES: usize = LAYOUT.length;

/// The state as bytes, little endian.
pub fn to_bytes(s: &State) -> [u8; BYTES] {
    let mut o = [0u8; BYTES];
    let mut n = HEADER;
    let mut put = |b: &[u8]| {
        o[n..n + b.len()].copy_from_slice(b);
        n += b.len();
    };
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
    LAYOUT.seal(&mut o);
    o
}

/// The state of bytes that [`to_bytes`] wrote.
///
/// # Errors
/// What is wrong with them, or with the state that they hold.
pub fn from_bytes(b: &[u8]) -> Result<State, &'static str> {
    let own = LAYOUT.unseal(b)?;
    let phase = Phase::from_byte(own[0]).ok_or("of no known phase")?;
    let mut n = 2;
    let mut take = || {
        n += 8;
        number(own, n - 8)
    };
    let mut settings = Settings::default();
    let mut kept = true;
    for i in 0..PARAMETERS {
        let value = take();
        settings.set(i, value);
        // a choice keeps whole numbers alone
        kept = kept && settings.get(i).to_bits() == value.to_bits();
    }
    let mut memory = Memory { deepest: take(), released: take(), work: take(), stored: take(), ..Memory::default() };
    for f in &mut memory.relaxation {
        *f = take();
    }
    let s = State {
        life: Life { phase, time: take(), stop: take(), refused: own[1] },
        settings,
        memory,
        input: [take(), take()],
        slope: [take(), take()],
        last: [take(), take()],
        acceleration: take(),
        step: take(),
    };
    if kept && s.is_sound() {
        Ok(s)
    } else {
        Err("of a state that no instance can be in")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A state with something in every place.
    fn some() -> State {
        let mut s = State::new(Settings::default());
        s.life.phase = Phase::Stepping;
        s.memory.relaxation = [1.0, 2.0, 3.0];
        s.memory.work = 0.125;
        s.slope = [4.0, 5.0];
        s.life.time = 7.0;
        s.life.refused = 2;
        s
    }

    #[test]
    fn bytes_round_trip_and_damage_is_found() {
        let s = some();
        let b = to_bytes(&s);
        assert_eq!(from_bytes(&b), Ok(s));
        for i in 0..BYTES {
            let mut c = b;
            c[i] ^= 1;
            assert!(from_bytes(&c).is_err(), "byte {}", i);
        }
        assert!(from_bytes(&b[1..]).is_err());
        assert_eq!(&b[8..40], b"HysteresisContact\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0");
    }

    #[test]
    fn a_state_that_no_instance_can_be_in_is_refused_although_its_checksum_is_right() {
        type Change = fn(&mut State);
        let changes: [Change; 12] = [
            |s| s.life.time = f64::NAN,
            |s| s.life.stop = f64::NAN,
            |s| s.life.refused = 4,
            |s| s.memory.stored = f64::INFINITY,
            |s| s.memory.deepest = -1.0,
            |s| s.memory.relaxation[2] = f64::NAN,
            |s| s.input[1] = f64::NAN,
            |s| s.last[0] = f64::NEG_INFINITY,
            |s| s.slope[0] = f64::INFINITY,
            |s| s.step = -1.0,
            |s| s.acceleration = f64::NAN,
            |s| s.settings.set(0, -1.0),
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut s = some();
            change(&mut s);
            assert_eq!(from_bytes(&to_bytes(&s)), Err("of a state that no instance can be in"), "change {}", i);
        }
        // before initialization has ended a parameter may still be out of its range
        let mut s = some();
        s.life.phase = Phase::Initialization;
        s.settings.set(0, -1.0);
        assert_eq!(from_bytes(&to_bytes(&s)), Ok(s));
    }
}
