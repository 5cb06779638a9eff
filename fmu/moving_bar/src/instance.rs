//! One bar: calls in their order, values in and out, steps. No pointer of a host's gets here, no formula stands here.

use crate::bar::{Bar, Motion};
use crate::start;
use crate::state::{self, State};
use face::bytes::Layout;
use face::start::GUID_LENGTH;
use face::text;
use face::{error, Life, Model, Outcome, Phase, Refusal};
use variables::{by_reference, Kind, Variable, FIRST_PARAMETER, LOG_CATEGORIES, MODEL, SIGNALS};

/// Highest order of an input derivative that is taken.
const INPUT_ORDERS: i32 = 3;

/// One instance.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Everything that later answers depend on.
    pub state: State,
}

impl Default for Instance {
    fn default() -> Self {
        Instance { state: State::new(start::settings()) }
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
        self.state = state;
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

    /// fmi2ExitInitializationMode.
    ///
    /// # Errors
    /// Out of order; a parameter out of its range; an input not finite.
    fn exit_initialization(&mut self) -> Outcome<()> {
        self.state.life.require("fmi2ExitInitializationMode", &[Phase::Initialization])?;
        self.input_is_good()?;
        self.state.settings.validate().map_err(Refusal::Error)?;
        self.state.motion = Bar(&self.state.settings).begin();
        self.state.life.phase = Phase::Stepping;
        Ok(())
    }

    /// Sets a variable of `kind`.
    ///
    /// # Errors
    /// No such variable; not to be set, or not now; a number that is not finite (the input: discard, and no step is
    /// taken until a finite one is set).
    fn set(&mut self, reference: u32, kind: Kind, value: f64) -> Outcome<()> {
        let v = find(reference, kind)?;
        if self.state.life.phase == Phase::Terminated {
            return error(text!("{} cannot be set after fmi2Terminate", v.name));
        }
        if reference == 0 {
            self.state.life.refused = u8::from(!value.is_finite());
            if !value.is_finite() {
                return Err(Refusal::Discard(text!("force is {}: give a finite number", value)));
            }
            self.state.push[0] = value;
            return Ok(());
        }
        if reference < FIRST_PARAMETER {
            return error(text!("{} is an output: it cannot be set", v.name));
        }
        if self.state.life.phase == Phase::Stepping {
            return error(text!("{} is fixed: set it before fmi2ExitInitializationMode", v.name));
        }
        if !value.is_finite() {
            return error(text!("{} is {}: give a finite number", v.name, value));
        }
        self.state.settings.set((reference - FIRST_PARAMETER) as usize, value);
        Ok(())
    }

    /// Value of a variable of `kind`; a Boolean is 0 or 1. The acceleration answers to the force set last.
    ///
    /// # Errors
    /// No such variable; an output before fmi2EnterInitializationMode; one that is not finite (discard).
    fn get(&self, reference: u32, kind: Kind) -> Outcome<f64> {
        let v = find(reference, kind)?;
        let s = &self.state;
        if reference == 0 {
            return Ok(s.push[0]);
        }
        if reference >= FIRST_PARAMETER {
            return Ok(s.settings.get((reference - FIRST_PARAMETER) as usize));
        }
        if s.life.phase == Phase::Instantiated {
            return error(text!("{} is known from fmi2EnterInitializationMode on", v.name));
        }
        let m = self.motion();
        let value = match reference {
            1 => m.x,
            2 => m.v,
            3 => {
                self.input_is_good()?;
                Bar(&s.settings).acceleration(&m, s.life.time, s.push[0])
            }
            4 => Bar(&s.settings).drive(s.life.time, m.x, m.v),
            5 => 0.5 * s.settings.mass() * m.v * m.v,
            6 => m.work,
            _ => f64::from(u8::from(m.seated)),
        };
        if value.is_finite() {
            return Ok(value);
        }
        Err(Refusal::Discard(text!("at penetration {} m, velocity {} m/s {} is {}", m.x, m.v, v.name, value)))
    }

    /// fmi2GetDirectionalDerivative of one output along one input, per unit of the input.
    ///
    /// # Errors
    /// Before fmi2EnterInitializationMode; no such output or input.
    fn directional(&self, unknown: u32, known: u32) -> Outcome<f64> {
        if self.state.life.phase == Phase::Instantiated {
            return self.state.life.require("fmi2GetDirectionalDerivative", &[]).map(|()| 0.0);
        }
        let u = find(unknown, Kind::Real)?;
        let k = find(known, Kind::Real)?;
        if unknown == 0 || unknown as usize >= SIGNALS.len() {
            return error(text!("{} is no output: it has no directional derivative", u.name));
        }
        if known != 0 {
            return error(text!("{} is no input: derivatives are along force", k.name));
        }
        let moves = unknown == 3 && !(self.motion().seated);
        Ok(if moves { -1.0 / self.state.settings.mass() } else { 0.0 })
    }

    /// fmi2SetRealInputDerivatives: derivatives of the force at the start of the next step, orders 1 to 3.
    ///
    /// # Errors
    /// Out of order; not the input; another order; not finite.
    fn set_input_derivative(&mut self, reference: u32, order: i32, value: f64) -> Outcome<()> {
        let phases = [Phase::Instantiated, Phase::Initialization, Phase::Stepping];
        self.state.life.require("fmi2SetRealInputDerivatives", &phases)?;
        let v = find(reference, Kind::Real)?;
        if reference != 0 {
            return error(text!("{} is no input", v.name));
        }
        if !(1..=INPUT_ORDERS).contains(&order) {
            return error(text!("derivative {} of force: orders 1 to {} are taken", order, INPUT_ORDERS));
        }
        if !value.is_finite() {
            return Err(Refusal::Discard(text!("derivative {} of force is {}: give a finite number", order, value)));
        }
        self.state.push[order as usize] = value;
        Ok(())
    }

    /// fmi2GetRealOutputDerivatives, order 1: of the penetration the velocity, of that the acceleration under the
    /// force as set.
    ///
    /// # Errors
    /// Out of order; an order other than 1; an output whose rate is not given.
    fn output_derivative(&self, reference: u32, order: i32) -> Outcome<f64> {
        self.state.life.require("fmi2GetRealOutputDerivatives", &[Phase::Stepping, Phase::Terminated])?;
        let v = find(reference, Kind::Real)?;
        if order != 1 {
            return error(text!("derivative {} of {}: only order 1 is given", order, v.name));
        }
        match reference {
            1 => self.get(2, Kind::Real),
            2 => self.get(3, Kind::Real),
            _ => Err(Refusal::Discard(text!("the rate of {} is not given, only of penetration and velocity", v.name))),
        }
    }

    /// fmi2DoStep from `time` s over `step` s, the force as set and as its derivatives take it. Says where the bar
    /// leaves its seat or sits down.
    ///
    /// # Errors
    /// Out of order; a time that is not where the instance stands; a step that is none, too long to resolve, or
    /// leads past the stop time; an input or an answer that is not finite (discard, the instance as before).
    fn do_step(&mut self, time: f64, step: f64) -> Outcome<Option<&'static str>> {
        self.state.life.step_is_good(time, step)?;
        self.input_is_good()?;
        let s = &mut self.state;
        let from = s.motion;
        let to = Bar(&s.settings).advance(&from, s.life.time, step, &s.push).map_err(Refusal::Discard)?;
        if !(to.x.is_finite() && to.v.is_finite() && to.work.is_finite()) {
            return Err(Refusal::Discard(text!("under a force of {} N the bar moves to {} m", s.push[0], to.x)));
        }
        // held from here: the value reached, no derivatives
        let [f, a, b, c] = s.push;
        let reached = f + step * (a + step * (b / 2.0 + step * c / 6.0));
        if !reached.is_finite() {
            return Err(Refusal::Discard(text!("the derivatives of force lead to {} N", reached)));
        }
        s.motion = to;
        s.life.time = time + step;
        s.push = [reached, 0.0, 0.0, 0.0];
        Ok(match (from.seated, to.seated) {
            (true, false) => Some("bar leaves its seat"),
            (false, true) => Some("bar sits down"),
            _ => None,
        })
    }
}

impl Instance {
    fn input_is_good(&self) -> Outcome<()> {
        if self.state.life.refused == 0 {
            return Ok(());
        }
        Err(Refusal::Discard(text!("force was set to no finite number: set it again")))
    }

    fn motion(&self) -> Motion {
        if self.state.life.phase == Phase::Initialization {
            Bar(&self.state.settings).begin()
        } else {
            self.state.motion
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free() -> Instance {
        let mut i = Instance::default();
        i.set(109, Kind::Real, 1.0).unwrap();
        i.setup_experiment(0.0, None).unwrap();
        i.enter_initialization().unwrap();
        assert_eq!(i.get(2, Kind::Real), Ok(1.0));
        i.exit_initialization().unwrap();
        i
    }

    #[test]
    fn calls_out_of_order_wrong_references_and_bad_numbers_are_refused_and_change_nothing() {
        let mut i = Instance::default();
        assert!(i.do_step(0.0, 1e-3).is_err());
        assert!(i.get(1, Kind::Real).is_err());
        let mut i = free();
        let before = i.state;
        assert!(matches!(i.set(0, Kind::Real, f64::NAN), Err(Refusal::Discard(_))));
        assert!(matches!(i.do_step(0.0, 1e-3), Err(Refusal::Discard(_))));
        i.set(0, Kind::Real, 0.0).unwrap();
        assert_eq!(i.state, before);
        for wrong in [i.set(1, Kind::Real, 1.0), i.set(100, Kind::Real, 2.0), i.set(8, Kind::Real, 1.0)] {
            assert!(matches!(wrong, Err(Refusal::Error(_))));
        }
        assert!(i.set_input_derivative(0, 4, 1.0).is_err() && i.output_derivative(1, 2).is_err());
        assert!(i.do_step(0.5, 1e-3).is_err() && i.do_step(0.0, 0.0).is_err());
        i.do_step(0.0, 1e-3).unwrap();
        assert_eq!(i.get(1, Kind::Real), Ok(1e-3));
    }

    #[test]
    fn rates_and_directional_derivatives_agree_with_differences() {
        let mut i = free();
        i.set(0, Kind::Real, 3.0).unwrap();
        assert_eq!(i.output_derivative(1, 1), Ok(1.0));
        assert_eq!(i.output_derivative(2, 1), Ok(-3.0));
        assert_eq!(i.directional(3, 0), Ok(-1.0));
        assert_eq!(i.directional(1, 0), Ok(0.0));
        i.set_input_derivative(0, 1, 10.0).unwrap();
        i.do_step(0.0, 0.1).unwrap();
        assert!((i.get(2, Kind::Real).unwrap() - (1.0 - 0.3 - 0.05)).abs() < 1e-15);
        // the input stands where its derivative took it
        assert_eq!(i.get(0, Kind::Real), Ok(4.0));
    }

    #[test]
    fn calls_in_any_order_with_any_numbers_do_no_harm() {
        face::drive::seeded::<Instance>(2, if cfg!(miri) { 3 } else { 1000 });
    }
}
