//! One set of forces: calls in their order, values in and out. No pointer of a host's gets here, no formula stands here.

use crate::start;
use crate::state::{self, State};
use face::bytes::Layout;
use face::start::GUID_LENGTH;
use face::text;
use face::{error, Life, Model, Outcome, Phase, Refusal};
use variables::{by_reference, Kind, Variable, FIRST_PARAMETER, INPUTS, LOG_CATEGORIES, MODEL, SIGNALS};

/// Value references of the outputs.
const FORCE: u32 = 3;
const ADDED: u32 = 4;
const BEYOND: u32 = 5;

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

fn is_input(reference: u32) -> bool {
    (reference as usize) < INPUTS
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
        self.inputs_are_good()?;
        self.state.settings.validate().map_err(Refusal::Error)?;
        self.state.velocity = self.state.inputs[1];
        self.state.life.phase = Phase::Stepping;
        Ok(())
    }

    /// Sets a variable of `kind`.
    ///
    /// # Errors
    /// No such variable; not to be set, or not now; a number that is not finite (an input: discard, and no step is taken
    /// until a finite one is set).
    fn set(&mut self, reference: u32, kind: Kind, value: f64) -> Outcome<()> {
        let v = find(reference, kind)?;
        let s = &mut self.state;
        if s.life.phase == Phase::Terminated {
            return error(text!("{} cannot be set after fmi2Terminate", v.name));
        }
        if is_input(reference) {
            let bit = 1 << reference;
            if !value.is_finite() {
                s.life.refused |= bit;
                return Err(Refusal::Discard(text!("{} is {}: give a finite number", v.name, value)));
            }
            s.life.refused &= !bit;
            s.inputs[reference as usize] = value;
            return Ok(());
        }
        if reference < FIRST_PARAMETER {
            return error(text!("{} is an output: it cannot be set", v.name));
        }
        if s.life.phase == Phase::Stepping {
            return error(text!("{} is fixed: set it before fmi2ExitInitializationMode", v.name));
        }
        if !value.is_finite() {
            return error(text!("{} is {}: give a finite number", v.name, value));
        }
        s.settings.set((reference - FIRST_PARAMETER) as usize, value);
        Ok(())
    }

    /// Value of a variable of `kind`. The outputs answer to the inputs set last.
    ///
    /// # Errors
    /// No such variable; an output before fmi2EnterInitializationMode; an input that was no finite number, or an output that
    /// is none (discard).
    fn get(&self, reference: u32, kind: Kind) -> Outcome<f64> {
        let v = find(reference, kind)?;
        let s = &self.state;
        if is_input(reference) {
            return Ok(s.inputs[reference as usize]);
        }
        if reference >= FIRST_PARAMETER {
            return Ok(s.settings.get((reference - FIRST_PARAMETER) as usize));
        }
        if s.life.phase == Phase::Instantiated {
            return error(text!("{} is known from fmi2EnterInitializationMode on", v.name));
        }
        self.inputs_are_good()?;
        let [x, speed, other] = s.inputs;
        let forces = s.settings.forces();
        if reference == BEYOND {
            return Ok(f64::from(u8::from(forces.learned.is_beyond(x, speed))));
        }
        let added = forces.at(s.life.time, x, speed);
        let value = if reference == FORCE { other - added } else { added };
        if value.is_finite() {
            return Ok(value);
        }
        Err(Refusal::Discard(text!("at penetration {} m, velocity {} m/s {} is {}", x, speed, v.name, value)))
    }

    /// fmi2GetDirectionalDerivative of one output along one input, per unit of the input.
    ///
    /// # Errors
    /// Before fmi2EnterInitializationMode; no such output or input; no finite derivative.
    fn directional(&self, unknown: u32, known: u32) -> Outcome<f64> {
        let s = &self.state;
        if s.life.phase == Phase::Instantiated {
            return s.life.require("fmi2GetDirectionalDerivative", &[]).map(|()| 0.0);
        }
        let u = find(unknown, Kind::Real)?;
        let k = find(known, Kind::Real)?;
        if ![FORCE, ADDED].contains(&unknown) {
            return error(text!("{} is no output: it has no directional derivative", u.name));
        }
        if !is_input(known) {
            return error(text!("{} is no input: derivatives are along inputs", k.name));
        }
        let (by_place, by_speed) = s.settings.forces().slopes(s.life.time, s.inputs[0], s.inputs[1]);
        let added = [by_place, by_speed, 0.0][known as usize];
        let value = match (unknown == FORCE, known) {
            (true, 2) => 1.0,
            (true, _) => -added,
            _ => added,
        };
        if value.is_finite() {
            return Ok(value);
        }
        error(text!("{} has no finite derivative along {} here", u.name, k.name))
    }

    /// fmi2SetRealInputDerivatives: none is taken, for the forces are those of the inputs as they are set.
    ///
    /// # Errors
    /// Always.
    fn set_input_derivative(&mut self, reference: u32, order: i32, _: f64) -> Outcome<()> {
        let phases = [Phase::Instantiated, Phase::Initialization, Phase::Stepping];
        self.state.life.require("fmi2SetRealInputDerivatives", &phases)?;
        let v = find(reference, Kind::Real)?;
        error(text!("derivative {} of {}: inputs are not interpolated", order, v.name))
    }

    /// fmi2GetRealOutputDerivatives: none is given.
    ///
    /// # Errors
    /// Always.
    fn output_derivative(&self, reference: u32, order: i32) -> Outcome<f64> {
        self.state.life.require("fmi2GetRealOutputDerivatives", &[Phase::Stepping, Phase::Terminated])?;
        let v = find(reference, Kind::Real)?;
        error(text!("derivative {} of {}: none is given", order, v.name))
    }

    /// fmi2DoStep from `time` s over `step` s: only the time goes on. Says where the motion turns against the friction.
    ///
    /// # Errors
    /// Out of order; a time that is not where the instance stands; a step that is none, or leads past the stop time; an input
    /// that is not finite (discard, the instance as before).
    fn do_step(&mut self, time: f64, step: f64) -> Outcome<Option<&'static str>> {
        self.state.life.step_is_good(time, step)?;
        self.inputs_are_good()?;
        let s = &mut self.state;
        let turns = s.velocity * s.inputs[1] < 0.0 && s.settings.forces().friction.coulomb > 0.0;
        s.velocity = s.inputs[1];
        s.life.time = time + step;
        Ok(if turns { Some("motion turns, and friction with it") } else { None })
    }
}

impl Instance {
    fn inputs_are_good(&self) -> Outcome<()> {
        for (i, signal) in SIGNALS.iter().take(INPUTS).enumerate() {
            if self.state.life.refused & (1 << i) != 0 {
                let name = signal.name;
                return Err(Refusal::Discard(text!("{} was set to no finite number: set it again", name)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With friction 3 N, a spring of 20 N/m and a magnet that fades, stepping.
    fn stepping() -> Instance {
        let mut i = Instance::default();
        for (reference, value) in [(100, 3.0), (110, 20.0), (112, 5.0), (113, 1e-3), (114, 0.01)] {
            i.set(reference, Kind::Real, value).unwrap();
        }
        i.setup_experiment(0.0, None).unwrap();
        i.enter_initialization().unwrap();
        i.exit_initialization().unwrap();
        i
    }

    #[test]
    fn what_comes_in_goes_on_with_the_forces_beside_it() {
        let mut i = stepping();
        for (reference, value) in [(0, -1e-3), (1, 0.5), (2, 100.0)] {
            i.set(reference, Kind::Real, value).unwrap();
        }
        // against the motion 3 N, the spring drives on with 0.02 N, the magnet holds with 5 N
        let added = -3.0 + 0.02 - 5.0;
        assert!((i.get(ADDED, Kind::Real).unwrap() - added).abs() < 1e-12);
        assert!((i.get(FORCE, Kind::Real).unwrap() - (100.0 - added)).abs() < 1e-12);
        i.do_step(0.0, 0.01).unwrap();
        let later = -3.0 + 0.02 - 5.0 * (-1f64).exp();
        assert!((i.get(ADDED, Kind::Real).unwrap() - later).abs() < 1e-12);
        i.set(1, Kind::Real, -0.5).unwrap();
        assert_eq!(i.do_step(0.01, 0.01), Ok(Some("motion turns, and friction with it")));
    }

    #[test]
    fn directional_derivatives_agree_with_differences() {
        let mut i = stepping();
        i.set(0, Kind::Real, 2e-4).unwrap();
        i.set(1, Kind::Real, 2e-3).unwrap();
        for unknown in [FORCE, ADDED] {
            for known in 0..3 {
                let h = 1e-7;
                let at = |by: f64| {
                    let mut moved = i.clone();
                    moved.set(known, Kind::Real, i.get(known, Kind::Real).unwrap() + by).unwrap();
                    moved.get(unknown, Kind::Real).unwrap()
                };
                let (d, want) = (i.directional(unknown, known).unwrap(), (at(h) - at(-h)) / (2.0 * h));
                assert!((d - want).abs() < 1e-5 * (1.0 + want.abs()), "{} {}: {} {}", unknown, known, d, want);
            }
        }
        assert!(i.directional(0, 0).is_err() && i.directional(FORCE, 100).is_err());
    }

    #[test]
    fn calls_out_of_order_wrong_references_and_bad_numbers_are_refused_and_change_nothing() {
        let mut i = Instance::default();
        assert!(i.do_step(0.0, 1e-3).is_err() && i.get(FORCE, Kind::Real).is_err());
        let mut i = stepping();
        let before = i.state;
        assert!(matches!(i.set(1, Kind::Real, f64::NAN), Err(Refusal::Discard(_))));
        assert!(matches!(i.do_step(0.0, 1e-3), Err(Refusal::Discard(_))));
        assert!(matches!(i.get(FORCE, Kind::Real), Err(Refusal::Discard(_))));
        i.set(1, Kind::Real, 0.0).unwrap();
        assert_eq!(i.state, before);
        for wrong in [i.set(3, Kind::Real, 1.0), i.set(100, Kind::Real, 2.0), i.set(5, Kind::Real, 1.0)] {
            assert!(matches!(wrong, Err(Refusal::Error(_))));
        }
        assert!(i.set_input_derivative(0, 1, 1.0).is_err() && i.output_derivative(3, 1).is_err());
        assert!(i.do_step(0.5, 1e-3).is_err() && i.do_step(0.0, 0.0).is_err());
    }

    #[test]
    fn calls_in_any_order_with_any_numbers_do_no_harm() {
        face::drive::seeded::<Instance>(3, if cfg!(miri) { 3 } else { 1000 });
    }
}
