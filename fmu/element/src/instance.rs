//! One instance of the element: calls in their order, values in and out, steps. No pointer of a host's gets here.

use crate::start;
use crate::state::{self, State};
use crate::variables::{by_reference, Kind, Role, Variable, LOG_CATEGORIES, MODEL, PARAMETER_TABLE};
use face::bytes::Layout;
use face::start::GUID_LENGTH;
use face::text;
use face::{error, Life, Model, Outcome, Phase, Refusal};
use law::{Memory, Reached};

/// Value references that hosts name at every step.
const PENETRATION: u32 = 0;
const VELOCITY: u32 = 1;
const FORCE: u32 = 2;
/// The inputs' bits in [`Life::refused`].
const INPUT_NAMES: [&str; 2] = ["penetration", "velocity"];

/// One instance.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Everything that later answers depend on.
    pub state: State,
    known: Known,
}

/// What has been worked out already. It follows from the state, so it is no part of it.
#[derive(Clone, Copy, Debug)]
struct Known {
    /// Force at the inputs as they stand, N, with nothing ahead; NaN where it has to be worked out.
    force: f64,
    /// Whether the law is the power law with hysteresis damping alone; known once the instance may step.
    power_law: bool,
    /// The end of the last step; None where it has to be worked out.
    last: Option<Reached>,
}

impl Known {
    const NOTHING: Known = Known { force: f64::NAN, power_law: false, last: None };

    /// What is known of a state alone.
    fn of(state: &State) -> Known {
        let power_law = state.life.phase == Phase::Stepping && state.settings.law.keeps_power_law();
        Known { power_law, ..Known::NOTHING }
    }
}

impl Default for Instance {
    fn default() -> Self {
        Instance { state: State::new(start::settings()), known: Known::NOTHING }
    }
}

/// The variable of a value reference.
///
/// # Errors
/// No such variable, or one of another type.
fn find(reference: u32, kind: Kind) -> Outcome<Variable> {
    face::checked(by_reference(reference).map(|v| (v.name, v.kind, v)), reference, kind).map(|(_, v)| v)
}

impl Model for Instance {
    type State = State;
    const NAME: &'static str = MODEL;
    const LOG_CATEGORIES: [&'static str; 4] = LOG_CATEGORIES;
    const LAYOUT: Layout = state::LAYOUT;

    fn guid() -> [u8; GUID_LENGTH] {
        start::guid()
    }

    fn state(&self) -> State {
        self.state
    }

    fn restore(&mut self, state: State) {
        *self = Instance { state, known: Known::of(&state) };
    }

    fn write(state: &State, bytes: &mut [u8]) {
        bytes.copy_from_slice(&state::to_bytes(state));
    }

    fn read(bytes: &[u8]) -> Result<State, &'static str> {
        state::from_bytes(bytes)
    }

    #[inline]
    fn life(&self) -> &Life {
        &self.state.life
    }

    #[inline]
    fn life_mut(&mut self) -> &mut Life {
        &mut self.state.life
    }

    /// fmi2ExitInitializationMode: a contact that starts loaded has been loaded slowly, see
    /// [`law::Parameters::start`].
    ///
    /// # Errors
    /// Out of order; a parameter out of its range; an input not finite.
    fn exit_initialization(&mut self) -> Outcome<()> {
        self.state.life.require("fmi2ExitInitializationMode", &[Phase::Initialization])?;
        self.inputs_are_good()?;
        self.state.settings.validate().map_err(Refusal::Error)?;
        let s = &mut self.state;
        let memory = s.settings.law.start(s.input[0]);
        if !memory.is_finite() {
            return error(text!("a contact that begins at penetration {} m holds no finite energy", s.input[0]));
        }
        s.memory = memory;
        s.last = s.input;
        s.slope = [f64::NAN; 2];
        s.life.phase = Phase::Stepping;
        self.known = Known::of(&self.state);
        Ok(())
    }

    /// Sets a variable of `kind`.
    ///
    /// # Errors
    /// No such variable; not to be set, or not now; a number that is not finite (inputs: discard, and the instance
    /// gives no force and takes no step until a finite one is set).
    fn set(&mut self, reference: u32, kind: Kind, value: f64) -> Outcome<()> {
        let v = find(reference, kind)?;
        if self.state.life.phase == Phase::Terminated {
            return error(text!("{} cannot be set after fmi2Terminate", v.name));
        }
        let input = match v.role {
            Role::Penetration => 0,
            Role::Velocity => 1,
            Role::Parameter(i) => {
                let fixed = PARAMETER_TABLE.get(i).map_or(true, |p| !p.tunable);
                if fixed && self.state.life.phase == Phase::Stepping {
                    return error(text!("{} is fixed: set it before fmi2ExitInitializationMode", v.name));
                }
                if !value.is_finite() {
                    return error(text!("{} is {}: give a finite number", v.name, value));
                }
                let mut changed = self.state.settings;
                changed.set(i, value);
                if self.state.life.phase == Phase::Stepping {
                    changed.validate().map_err(Refusal::Error)?;
                }
                self.state.settings = changed;
                self.known = Known::of(&self.state);
                return Ok(());
            }
            _ => return error(text!("{} is an output: it cannot be set", v.name)),
        };
        if value.is_finite() {
            self.set_input(input, value);
            Ok(())
        } else {
            self.state.life.refused |= 1 << input;
            Err(Refusal::Discard(text!("{} is {}: give a finite number", v.name, value)))
        }
    }

    #[inline]
    fn set_reals(&mut self, references: &[u32], values: &[f64]) -> bool {
        if self.state.life.phase == Phase::Terminated {
            return false;
        }
        match (references, values) {
            (&[PENETRATION, VELOCITY], &[x, v]) if x.is_finite() && v.is_finite() => {
                self.set_input(0, x);
                self.set_input(1, v);
                true
            }
            (&[input @ (PENETRATION | VELOCITY)], &[value]) if value.is_finite() => {
                self.set_input(input as usize, value);
                true
            }
            _ => false,
        }
    }

    /// Value of a variable of `kind`; a Boolean is 0 or 1. Outputs that feed through answer to what was set last.
    ///
    /// # Errors
    /// No such variable; an output before fmi2EnterInitializationMode; a force from inputs that are not finite; an output
    /// that is not finite (discard).
    fn get(&self, reference: u32, kind: Kind) -> Outcome<f64> {
        let v = find(reference, kind)?;
        let s = &self.state;
        match v.role {
            Role::Penetration => return Ok(s.input[0]),
            Role::Velocity => return Ok(s.input[1]),
            Role::Parameter(i) => return Ok(s.settings.get(i)),
            _ => {}
        }
        if s.life.phase == Phase::Instantiated {
            return error(text!("{} is known from fmi2EnterInitializationMode on", v.name));
        }
        let memory = self.memory();
        let value = match v.role {
            Role::Force | Role::ForceNow => {
                self.inputs_are_good()?;
                let ahead = if v.role == Role::Force { self.time_ahead() } else { 0.0 };
                let known = self.known.force;
                if ahead == 0.0 && !known.is_nan() {
                    known
                } else {
                    self.force(&memory, ahead)
                }
            }
            Role::Contact => f64::from(u8::from(s.input[0] > s.settings.law.permanent_set(memory.deepest))),
            Role::BeyondLearned => {
                let [x, v] = s.input;
                f64::from(u8::from(s.settings.law.learned_law.is_beyond(x, v)))
            }
            Role::StoredEnergy => memory.stored,
            Role::DissipatedEnergy => memory.dissipated(),
            Role::DeepestPenetration => memory.deepest,
            Role::PermanentSet => s.settings.law.permanent_set(memory.deepest),
            _ => {
                let v = if s.life.phase == Phase::Initialization { s.input[1] } else { s.last[1] };
                s.settings.law.recommended_step(s.settings.effective_mass, v, memory.stored)
            }
        };
        if value.is_finite() {
            return Ok(value);
        }
        let [x, speed] = s.input;
        Err(Refusal::Discard(text!("at penetration {} m, velocity {} m/s {} is {}", x, speed, v.name, value)))
    }

    #[inline]
    fn real_at_once(&self, reference: u32) -> Option<f64> {
        if reference == FORCE {
            self.force_at_once()
        } else {
            None
        }
    }

    /// fmi2GetDirectionalDerivative of one output along one input, per unit of the input.
    ///
    /// # Errors
    /// Before fmi2EnterInitializationMode; no such output or input.
    fn directional(&self, unknown: u32, known: u32) -> Outcome<f64> {
        if self.state.life.phase == Phase::Instantiated {
            return self.state.life.require("fmi2GetDirectionalDerivative", &[]).map(|()| 0.0);
        }
        self.inputs_are_good()?;
        let u = find(unknown, Kind::Real)?;
        let k = find(known, Kind::Real)?;
        if matches!(u.role, Role::Penetration | Role::Velocity | Role::Parameter(_)) {
            return error(text!("{} is no output: it has no directional derivative", u.name));
        }
        let d = match (u.role, k.role) {
            (Role::Force, Role::Penetration) => self.derivatives(self.time_ahead()).0,
            (Role::Force, Role::Velocity) => self.derivatives(self.time_ahead()).1,
            (Role::ForceNow, Role::Penetration) => self.derivatives(0.0).0,
            (Role::ForceNow, Role::Velocity) => self.derivatives(0.0).1,
            (_, Role::Penetration) | (_, Role::Velocity) => 0.0,
            _ => return error(text!("{} is no input: derivatives are along penetration and velocity", k.name)),
        };
        if d.is_finite() {
            Ok(d)
        } else {
            Err(Refusal::Discard(text!("the derivative of {} along {} is {}", u.name, k.name, d)))
        }
    }

    /// fmi2SetRealInputDerivatives: how fast an input changes from now to the end of the next step.
    ///
    /// # Errors
    /// Out of order; not an input; an order other than 1; not finite.
    fn set_input_derivative(&mut self, reference: u32, order: i32, value: f64) -> Outcome<()> {
        let phases = [Phase::Instantiated, Phase::Initialization, Phase::Stepping];
        self.state.life.require("fmi2SetRealInputDerivatives", &phases)?;
        let v = find(reference, Kind::Real)?;
        let input = match v.role {
            Role::Penetration => 0,
            Role::Velocity => 1,
            _ => return error(text!("{} is no input", v.name)),
        };
        if order != 1 {
            return error(text!("derivative {} of {}: only order 1 is taken", order, v.name));
        }
        if !value.is_finite() {
            return Err(Refusal::Discard(text!("the derivative of {} is {}: give a finite number", v.name, value)));
        }
        self.state.slope[input] = value;
        Ok(())
    }

    /// fmi2GetRealOutputDerivatives, order 1: the rate of the force while penetration changes as set, or with the
    /// velocity where nothing was set, and the velocity as set or as over the last step.
    ///
    /// # Errors
    /// Out of order; an order other than 1; an output whose rate is not given.
    fn output_derivative(&self, reference: u32, order: i32) -> Outcome<f64> {
        self.state.life.require("fmi2GetRealOutputDerivatives", &[Phase::Stepping, Phase::Terminated])?;
        self.inputs_are_good()?;
        let v = find(reference, Kind::Real)?;
        if order != 1 {
            return error(text!("derivative {} of {}: only order 1 is given", order, v.name));
        }
        if matches!(v.role, Role::Penetration | Role::Velocity | Role::Parameter(_)) {
            return error(text!("{} is no output", v.name));
        }
        let ahead = match v.role {
            Role::Force => self.time_ahead(),
            Role::ForceNow => 0.0,
            _ => return Ok(0.0),
        };
        let s = &self.state;
        let or = |set: f64, otherwise: f64| if set.is_nan() { otherwise } else { set };
        let (xs, vs) = (or(s.slope[0], s.input[1]), or(s.slope[1], s.acceleration));
        let (fx, fv) = self.derivatives(ahead);
        let law = &s.settings.law;
        let creep: f64 = law.relaxation_rates(&s.memory, s.input[0], 0.0).iter().sum();
        let rate = fx * xs + fv * vs + creep;
        if rate.is_finite() {
            Ok(rate)
        } else {
            Err(Refusal::Discard(text!("the rate of the force is {}", rate)))
        }
    }

    /// fmi2DoStep from `time` s over `step` s: the memory follows the inputs from where the last step left them to
    /// what is set now, or to where the input derivatives take that by the end of the step. Says where contact began
    /// or ended.
    ///
    /// # Errors
    /// Out of order; a time that is not where the instance stands; a step that is none or leads past the stop time;
    /// inputs that are not finite (discard); an answer that is not finite (discard, the instance as before).
    fn do_step(&mut self, time: f64, step: f64) -> Outcome<Option<&'static str>> {
        let s = &self.state;
        self.state.life.step_is_good(time, step)?;
        self.inputs_are_good()?;
        let [x, v] = s.input;
        let [xs, vs] = s.slope;
        let mut to = s.input;
        if !vs.is_nan() {
            to[1] = v + step * vs;
            to[0] = x + step * (if xs.is_nan() { v + 0.5 * step * vs } else { xs });
        } else if !xs.is_nan() {
            to[0] = x + step * xs;
        }
        let from = s.last;
        if !(to[0].is_finite() && to[1].is_finite()) {
            return Err(Refusal::Discard(text!("the input derivatives lead to {} m, {} m/s", to[0], to[1])));
        }
        let (force, last) = match self.advance_power_law(to) {
            Some((force, last)) => (force, Some(last)),
            None => (self.advance_any(to, step)?, if to == from { self.known.last } else { None }),
        };
        let event = match (from[0] > 0.0, to[0] > 0.0) {
            (false, true) => Some("contact begins"),
            (true, false) => Some("contact ends"),
            _ => None,
        };
        let s = &mut self.state;
        s.acceleration = ((to[1] - from[1]) / step).clamp(f64::MIN, f64::MAX);
        s.input = to;
        s.last = to;
        s.slope = [f64::NAN; 2];
        s.step = step;
        s.life.time = time + step;
        self.known.force = force;
        self.known.last = last;
        Ok(event)
    }
}

impl Instance {
    /// Sets an input to a finite value.
    #[inline]
    fn set_input(&mut self, input: usize, value: f64) {
        let s = &mut self.state;
        s.life.refused &= !(1 << input);
        if s.input[input] != value {
            self.known.force = f64::NAN;
        }
        s.input[input] = value;
    }

    /// The force, N, where it needs no memory of its own: while stepping, with nothing ahead, without relaxation, and
    /// finite. None otherwise.
    #[inline]
    fn force_at_once(&self) -> Option<f64> {
        let s = &self.state;
        if s.life.phase != Phase::Stepping || s.life.refused != 0 || self.time_ahead() != 0.0 {
            return None;
        }
        if !self.known.force.is_nan() {
            return Some(self.known.force);
        }
        let (law, [x, v]) = (&s.settings.law, s.input);
        let f = if self.known.power_law && x > 0.0 {
            law.force_power_law(&law.reached(x, v))
        } else if law.relaxes() {
            return None;
        } else {
            law.force(&s.memory, x, v)
        };
        if f.is_finite() {
            Some(f)
        } else {
            None
        }
    }

    #[inline]
    fn inputs_are_good(&self) -> Outcome<()> {
        if self.state.life.refused == 0 {
            return Ok(());
        }
        for (i, name) in INPUT_NAMES.iter().enumerate() {
            if self.state.life.refused & (1 << i) != 0 {
                return Err(Refusal::Discard(text!("{} was set to no finite number: set it again", name)));
            }
        }
        Ok(())
    }

    /// Moves the memory to the inputs `to` where the law is the power law and the contact stays closed: the force there,
    /// N, and the point. None, nothing done, otherwise.
    #[inline]
    fn advance_power_law(&mut self, to: [f64; 2]) -> Option<(f64, Reached)> {
        let (s, known) = (&mut self.state, &self.known);
        let from = s.last;
        // a contact held still remembers nothing new
        if !known.power_law || to == from || from[0] <= 0.0 || to[0] <= 0.0 {
            return None;
        }
        let law = &s.settings.law;
        let from = match known.last {
            Some(reached) => reached,
            None => law.reached(from[0], from[1]),
        };
        let to = law.reached(to[0], to[1]);
        law.advance_power_law(&mut s.memory, &from, &to).map(|force| (force, to))
    }

    /// Moves the memory to the inputs `to` over `step` s. The force there, N; NaN where it does not follow from inputs
    /// and memory alone.
    ///
    /// # Errors
    /// An answer that is not finite (discard, the memory as before).
    #[inline(never)]
    fn advance_any(&mut self, to: [f64; 2], step: f64) -> Outcome<f64> {
        let s = &mut self.state;
        let (law, from) = (&s.settings.law, s.last);
        // a contact held still remembers nothing new, unless it relaxes
        let timeless = !law.relaxes();
        let held = timeless && to == from;
        if held && !self.known.force.is_nan() {
            return Ok(self.known.force);
        }
        let memory = if held { s.memory } else { law.advance(&s.memory, from[0], from[1], to[0], to[1], step) };
        let force = law.force(&memory, to[0], to[1]);
        if !(force.is_finite() && memory.is_finite()) {
            let message = text!(
                "at penetration {} m, velocity {} m/s force is {} N, work {} J",
                to[0],
                to[1],
                force,
                memory.work
            );
            return Err(Refusal::Discard(message));
        }
        s.memory = memory;
        Ok(if timeless { force } else { f64::NAN })
    }

    /// The memory that answers are given from: while initializing, that of the inputs as they are set.
    fn memory(&self) -> Memory {
        let s = &self.state;
        if s.life.phase == Phase::Initialization {
            s.settings.law.start(s.input[0])
        } else {
            s.memory
        }
    }

    /// How far ahead of the inputs the law is evaluated, s.
    #[inline]
    fn time_ahead(&self) -> f64 {
        self.state.settings.lookahead * self.state.step + self.state.settings.lookahead_time
    }

    /// Where the law is evaluated: at the inputs as set, penetration `ahead` s further on; and the memory there.
    fn ahead(&self, memory: &Memory, ahead: f64) -> (Memory, f64, f64) {
        let s = &self.state;
        let (x, v) = (s.input[0] + ahead * s.input[1], s.input[1]);
        if s.life.phase == Phase::Initialization {
            (*memory, x, v)
        } else {
            (s.settings.law.tried(memory, (s.last[0], s.last[1]), (x, v)), x, v)
        }
    }

    #[inline]
    fn force(&self, memory: &Memory, ahead: f64) -> f64 {
        let (tried, x, v) = self.ahead(memory, ahead);
        self.state.settings.law.force(&tried, x, v)
    }

    /// (dF/dx N/m, dF/dv N s/m) at the inputs as set, the penetration `ahead` s further on, the memory held.
    fn derivatives(&self, ahead: f64) -> (f64, f64) {
        let s = &self.state;
        let (tried, x, v) = self.ahead(&self.memory(), ahead);
        let (mut fx, mut fv) = s.settings.law.derivatives(&tried, x, v);
        if s.settings.law.relaxes() && s.settings.law.pushes(&tried, x, v) {
            fx += s.settings.law.relaxation_slope(x);
        }
        fv += fx * ahead;
        (fx, fv)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instance that steps, its stiffness and one further parameter set.
    fn stepping(further: &str, value: f64) -> Instance {
        let mut i = Instance::default();
        i.enter_initialization().unwrap();
        let reference = |name: &str| PARAMETER_TABLE.iter().position(|p| p.name == name).unwrap();
        i.state.settings.set(reference("stiffness"), 1e6);
        i.state.settings.set(reference("hysteresis_damping"), 1e5);
        i.state.settings.set(reference(further), value);
        i.exit_initialization().unwrap();
        i
    }

    #[test]
    fn what_is_known_is_what_would_be_worked_out_to_the_last_bit() {
        let laws = [
            ("exponent", 1.7),
            ("yield_penetration", 1e-4),
            ("adhesion_force", 3.0),
            ("relaxation_stiffness", 1e5),
            ("viscous_damping", 20.0),
            ("lookahead", 0.5),
        ];
        for (name, value) in laws {
            let mut i = stepping(name, value);
            let mut seed = 1u32;
            let mut random = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(seed >> 8) / f64::from(1 << 24)
            };
            for n in 0..2000 {
                // held, set to the same, or moved, a little or far, in and out of contact
                let (x, v) = match n % 5 {
                    0 => (i.state.input[0], i.state.input[1]),
                    1 | 2 => (i.state.input[0] * (1.0 + 1e-3 * random()), i.state.input[1] - 1e-3 * random()),
                    _ => (4e-4 * random() - 1e-4, 2.0 * random() - 1.0),
                };
                if n % 3 != 0 {
                    i.set(0, Kind::Real, x).unwrap();
                    i.set(1, Kind::Real, v).unwrap();
                }
                let before = i.state;
                i.do_step(i.state.life.time, 1e-5).unwrap();
                let mut fresh = Instance::default();
                fresh.restore(before);
                fresh.do_step(before.life.time, 1e-5).unwrap();
                assert_eq!(i.state.memory, fresh.state.memory, "{} step {}", name, n);
                let ([x0, v0], [x1, v1], law) = (before.last, i.state.last, &before.settings.law);
                if [x0, v0] != [x1, v1] || law.relaxes() {
                    let whole = law.advance(&before.memory, x0, v0, x1, v1, 1e-5);
                    assert_eq!(i.state.memory, whole, "{} step {}", name, n);
                }
                fresh.restore(i.state);
                for output in [2, 3, 4, 5, 6, 7, 8, 9] {
                    let kind = if output == 3 { Kind::Boolean } else { Kind::Real };
                    let (a, b) = (i.get(output, kind).unwrap(), fresh.get(output, kind).unwrap());
                    assert_eq!(a.to_bits(), b.to_bits(), "{} output {} step {}", name, output, n);
                }
            }
        }
    }

    #[test]
    fn calls_in_any_order_with_any_numbers_do_no_harm() {
        face::drive::seeded::<Instance>(1, if cfg!(miri) { 3 } else { 1000 });
    }
}
