//! Bytes made into calls of the C functions, in any order and with any numbers: what fuzzers, sanitizers and the models'
//! own tests run. Only with the feature `drive`; no FMU holds it.

use crate::fmi2::{self, CallbackFunctions, Status, FATAL, OK};
use crate::model::Model;
use std::os::raw::{c_int, c_uint, c_void};
use std::ptr::{null, null_mut};

/// Numbers at which formulas break.
const EDGES: [f64; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-4,
    1e-3,
    0.5,
    5.0,
    1e-300,
    5e-324,
    1e6,
    1e150,
    -1e150,
    1e300,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];
/// Calls of one run at most.
const MOST_CALLS: usize = 400;
/// Values of one call at most.
const MOST: usize = 4;

/// Takes numbers from bytes; zeros where they have ended.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        let (first, rest) = match self.0.split_first() {
            Some(found) => found,
            None => return 0,
        };
        self.0 = rest;
        *first
    }

    fn word(&mut self) -> u64 {
        (0..8).fold(0, |w, _| w << 8 | u64::from(self.byte()))
    }

    /// A value reference: mostly one that models have.
    fn reference(&mut self) -> c_uint {
        match self.byte() {
            b @ 0..=119 => c_uint::from(b) % 10,
            b @ 120..=249 => 100 + c_uint::from(b) % 32,
            _ => self.word() as c_uint,
        }
    }

    /// A number: a usual one, an edge, or any.
    fn number(&mut self) -> f64 {
        match self.byte() {
            b @ 0..=99 => f64::from(b) * 1e-5 - 2e-4,
            b @ 100..=179 => (f64::from(b) - 140.0) * 0.1,
            b @ 180..=229 => EDGES[usize::from(b) % EDGES.len()],
            b @ 230..=244 => 10f64.powi(2 * (i32::from(b) - 235)),
            _ => f64::from_bits(self.word()),
        }
    }

    fn references(&mut self) -> Vec<c_uint> {
        let n = usize::from(self.byte()) % (MOST + 1);
        (0..n).map(|_| self.reference()).collect()
    }
}

/// An instance and what it was last asked.
struct Driven {
    c: *mut c_void,
    time: f64,
}

/// Makes an instance of `M`, calls it as `data` says, and frees it.
///
/// # Panics
/// Where a call answers fmi2Fatal; where a number that is not finite comes with fmi2OK; where a refused call has changed
/// the instance; where a state that was given back does not give the same state again.
pub fn calls<M: Model>(data: &[u8]) {
    let mut bytes = Bytes(data);
    let functions = CallbackFunctions {
        logger: None,
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: null_mut(),
    };
    let mut guid = M::guid().to_vec();
    guid.push(0);
    let name = b"driven\0";
    // SAFETY: strings that end with 0, callbacks that live through the call, and from here on a component of this model
    // that is freed last; every array has the length that is passed
    unsafe {
        let c = fmi2::instantiate::<M>(name.as_ptr().cast(), 1, guid.as_ptr().cast(), null(), &functions, 0, 0);
        assert!(!c.is_null(), "no instance");
        let mut d = Driven { c, time: 0.0 };
        // half of the runs begin as a host does, the others anyhow
        if bytes.byte() % 2 == 0 {
            for _ in 0..bytes.byte() % 6 {
                d.set_real::<M>(&mut bytes);
            }
            fmi2::setup_experiment::<M>(c, 0, 0.0, 0.0, 0, 0.0);
            fmi2::enter_initialization_mode::<M>(c);
            d.set_real::<M>(&mut bytes);
            fmi2::exit_initialization_mode::<M>(c);
        }
        for _ in 0..MOST_CALLS {
            if bytes.0.is_empty() {
                break;
            }
            let status = d.call::<M>(&mut bytes);
            assert_ne!(status, FATAL, "a call has panicked");
        }
        fmi2::free_instance::<M>(c);
    }
}

impl Driven {
    unsafe fn call<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let c = self.c;
        match b.byte() % 24 {
            0 => fmi2::setup_experiment::<M>(c, 1, b.number(), b.number(), c_int::from(b.byte() % 2), b.number()),
            1 => fmi2::enter_initialization_mode::<M>(c),
            2 => fmi2::exit_initialization_mode::<M>(c),
            3 if b.byte() > 200 => fmi2::terminate::<M>(c),
            4 if b.byte() > 200 => {
                self.time = 0.0;
                fmi2::reset::<M>(c)
            }
            5..=8 => self.set_real::<M>(b),
            9 | 10 => self.set_whole::<M>(b),
            11 | 12 => self.input_derivatives::<M>(b),
            13 => self.output_derivatives::<M>(b),
            14 => self.directional::<M>(b),
            15 => self.states::<M>(b),
            16 => self.bytes::<M>(b),
            17 => {
                let mut n = 0;
                fmi2::get_boolean_status::<M>(c, c_int::from(b.byte() % 8), &mut n)
            }
            18 | 19 => self.get::<M>(&b.references()),
            _ => self.step::<M>(b),
        }
    }

    unsafe fn set_real<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let references = b.references();
        let values: Vec<f64> = references.iter().map(|_| b.number()).collect();
        fmi2::set_real::<M>(self.c, references.as_ptr(), references.len(), values.as_ptr())
    }

    /// Integers and Booleans: all are set, or the state stays as it was.
    unsafe fn set_whole<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let references = b.references();
        let values: Vec<c_int> = references.iter().map(|_| b.word() as c_int % 16).collect();
        let before = self.serialized::<M>();
        let set = if b.byte() % 2 == 0 { fmi2::set_integer::<M> } else { fmi2::set_boolean::<M> };
        let status = set(self.c, references.as_ptr(), references.len(), values.as_ptr());
        assert!(status == OK || self.serialized::<M>() == before, "a refused call has set a value");
        status
    }

    unsafe fn input_derivatives<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let references = b.references();
        let orders: Vec<c_int> = references.iter().map(|_| c_int::from(b.byte() % 8) / 2).collect();
        let values: Vec<f64> = references.iter().map(|_| b.number()).collect();
        let before = self.serialized::<M>();
        let n = references.len();
        let (r, o, v) = (references.as_ptr(), orders.as_ptr(), values.as_ptr());
        let status = fmi2::set_real_input_derivatives::<M>(self.c, r, n, o, v);
        assert!(status == OK || self.serialized::<M>() == before, "a refused call has set an input derivative");
        status
    }

    unsafe fn output_derivatives<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let references = b.references();
        let orders = vec![1; references.len()];
        let mut values = vec![0.0; references.len()];
        let (r, o, v) = (references.as_ptr(), orders.as_ptr(), values.as_mut_ptr());
        let status = fmi2::get_real_output_derivatives::<M>(self.c, r, references.len(), o, v);
        assert!(status != OK || values.iter().all(|v| v.is_finite()), "{:?} {:?}", references, values);
        status
    }

    unsafe fn directional<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let (unknown, known) = (b.references(), b.references());
        let seed: Vec<f64> = known.iter().map(|_| b.number()).collect();
        let mut values = vec![0.0; unknown.len()];
        let (u, k) = (unknown.as_ptr(), known.as_ptr());
        let (m, n) = (unknown.len(), known.len());
        let (s, v) = (seed.as_ptr(), values.as_mut_ptr());
        let status = fmi2::get_directional_derivative::<M>(self.c, u, m, k, n, s, v);
        assert!(status != OK || values.iter().all(|v| v.is_finite()), "{:?} {:?}", unknown, values);
        status
    }

    /// Reads, and looks that what is read is finite.
    unsafe fn get<M: Model>(&mut self, references: &[c_uint]) -> Status {
        let mut values = vec![0.0; references.len()];
        let status = fmi2::get_real::<M>(self.c, references.as_ptr(), references.len(), values.as_mut_ptr());
        assert!(status != OK || values.iter().all(|v| v.is_finite()), "{:?} {:?}", references, values);
        let mut whole = vec![0; references.len()];
        fmi2::get_integer::<M>(self.c, references.as_ptr(), references.len(), whole.as_mut_ptr());
        fmi2::get_boolean::<M>(self.c, references.as_ptr(), references.len(), whole.as_mut_ptr());
        status
    }

    unsafe fn step<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let step = match b.byte() {
            n @ 0..=229 => 1e-6 * f64::from(n + 1),
            _ => b.number(),
        };
        let at = if b.byte() < 250 { self.time } else { b.number() };
        let status = fmi2::do_step::<M>(self.c, at, step, 1);
        fmi2::get_real_status::<M>(self.c, 2, &mut self.time);
        if status == OK {
            for reference in 0..10 {
                self.get::<M>(&[reference]);
            }
        }
        status
    }

    /// Keeps the state, goes on, and comes back to it.
    unsafe fn states<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let mut kept = null_mut();
        let status = fmi2::get_fmu_state::<M>(self.c, &mut kept);
        assert_eq!(status, OK, "no state");
        let before = self.serialized::<M>();
        self.set_real::<M>(b);
        self.step::<M>(b);
        assert_eq!(fmi2::set_fmu_state::<M>(self.c, kept), OK);
        fmi2::get_real_status::<M>(self.c, 2, &mut self.time);
        assert_eq!(self.serialized::<M>(), before, "a state that was given back is another");
        fmi2::free_fmu_state::<M>(self.c, &mut kept)
    }

    /// Reads bytes as a state: its own, with some of them changed, or cut, or any.
    unsafe fn bytes<M: Model>(&mut self, b: &mut Bytes<'_>) -> Status {
        let mut bytes = self.serialized::<M>();
        let whole = bytes.clone();
        match b.byte() % 4 {
            0 => {}
            1 => bytes.truncate(b.word() as usize % (bytes.len() + 1)),
            2 => {
                for _ in 0..b.byte() % 8 {
                    let at = b.word() as usize % bytes.len();
                    bytes[at] = b.byte();
                }
            }
            // changed, and a checksum that is right
            _ => {
                let at = b.word() as usize % bytes.len();
                bytes[at] ^= b.byte();
                M::LAYOUT.seal(&mut bytes);
            }
        }
        let mut kept = null_mut();
        let status = fmi2::de_serialize_fmu_state::<M>(self.c, bytes.as_ptr(), bytes.len(), &mut kept);
        if status == OK {
            assert_eq!(fmi2::set_fmu_state::<M>(self.c, kept), OK);
            fmi2::get_real_status::<M>(self.c, 2, &mut self.time);
            assert_eq!(self.serialized::<M>(), bytes, "bytes that were taken come back otherwise");
            fmi2::free_fmu_state::<M>(self.c, &mut kept);
        } else {
            assert!(kept.is_null() && bytes != whole, "its own state is refused");
        }
        status
    }

    unsafe fn serialized<M: Model>(&mut self) -> Vec<u8> {
        let (mut kept, mut size) = (null_mut(), 0);
        assert_eq!(fmi2::get_fmu_state::<M>(self.c, &mut kept), OK);
        assert_eq!(fmi2::serialized_fmu_state_size::<M>(self.c, kept, &mut size), OK);
        let mut bytes = vec![0; size];
        assert_eq!(fmi2::serialize_fmu_state::<M>(self.c, kept, bytes.as_mut_ptr(), size), OK);
        assert_eq!(fmi2::free_fmu_state::<M>(self.c, &mut kept), OK);
        bytes
    }
}

/// `runs` runs of [`calls`] with bytes drawn from `seed`.
pub fn seeded<M: Model>(seed: u64, runs: usize) {
    // Steele, Lea and Flood 2014: SplitMix64
    let mut state = seed;
    let mut word = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    for _ in 0..runs {
        let data: Vec<u8> = (0..150).flat_map(|_| word().to_le_bytes()).collect();
        calls::<M>(&data);
    }
}
