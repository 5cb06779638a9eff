//! Takes a case to its end on the plant's rig: touch, separation, turning points, the peak of the force and the photo
//! interrupters are found by shortening the step itself until it ends on them.

use super::observed::{Observed, INTERRUPTERS};
use super::outcome::{Balance, Bounce, Event, Moment, Outcome, Row};
use super::plan::{Case, Start};
use super::results::compare_exact;
use super::rig::State as RowState;
use anyhow::{bail, Result};
use host::Element;
use mechanisms::physics::Physics;
use plant::integrate::{Advance, Control, State, Stepper};
use plant::motion::{
    Contact, Motion, BODY_SURFACE, BODY_TURN, CENTRE, FORCE_RATE, FORCE_SIGN, SPRUNG_SURFACE, SPRUNG_TURN, SURFACE,
    TURN,
};
use plant::simulate::Setup;

/// How a case is integrated: to an error a step of 1e-11 of the impact's depth and speed.
pub const CONTROL: Control = Control::exact(1e-11);
/// Most steps of a case.
const MOST_STEPS: usize = 2_000_000;
/// Longest motion, s.
const LONGEST: f64 = 1e4;
/// Speed below which a body inside the stop rests, over its impact speed, where its acceleration says the same.
const QUIET: f64 = 1e-6;
/// Steps between two questions whether to go on.
const WATCHED: usize = 64;

/// Runs a case on a contact element until its last impact is over, or it rests. `watch` is asked now and then
/// whether to go on; where it says no, what there is comes back as interrupted.
///
/// # Errors
/// Where the element refuses, or the motion never ends: too many steps, or a step too small to take.
pub fn simulate(case: &Case, element: &mut dyn Element, watch: &mut dyn FnMut(&Moment) -> bool) -> Result<Outcome> {
    let (outcome, end) = simulate_as_far(case, element, watch);
    end.map(|()| outcome)
}

/// As [`simulate`], with what there is where it fails, as interrupted.
pub fn simulate_as_far(
    case: &Case,
    element: &mut dyn Element,
    watch: &mut dyn FnMut(&Moment) -> bool,
) -> (Outcome, Result<()>) {
    let rig = &case.rig;
    let physics = [rig.gravity_before, rig.gravity_after].map(|g| rig.physics(&case.law, g));
    let setup = rig.setup();
    let contact = Contact::new(element);
    let mut m = Run::new(case, &contact);
    let end = go(&mut m, &physics, &setup, watch);
    m.o.interrupted |= end.is_err();
    (m.o, end)
}

/// Steps to the end, or until `watch` says no.
fn go<'a>(
    m: &mut Run<'a>,
    physics: &'a [Physics; 2],
    setup: &'a Setup,
    watch: &mut dyn FnMut(&Moment) -> bool,
) -> Result<()> {
    let (case, contact) = (m.case, m.contact);
    let remembers = case.law.relaxes() || case.fmu.is_some();
    let mut motion = Motion::new([&physics[0], &physics[1]], setup, contact, remembers);
    let (t, x, v) = start(case)?;
    let y = motion.start(t, x, v);
    let mut observed = Observed::new(case, motion, setup, &physics[0]);
    if x == 0.0 {
        m.touch(&observed, t, &observed.row(&y), v);
    }
    let mut stepper = Stepper::new(&observed, t, &y, LONGEST, &CONTROL)?;
    loop {
        let t = stepper.time();
        let row = observed.row(stepper.state());
        m.record(t, &row, observed.force(stepper.rates()))?;
        if m.o.rows.len().is_multiple_of(WATCHED) {
            let now = Moment { time: t, impacts: m.o.bounces.len(), steps: m.o.rows.len() };
            if !watch(&now) {
                m.o.interrupted = true;
                return Ok(());
            }
        }
        if m.observe(&observed, t, stepper.state(), stepper.rates()) {
            break;
        }
        if m.o.rows.len() >= MOST_STEPS || stepper.done() {
            bail!(
                "the motion has not ended after {t:.3e} s, {} impacts and {} steps: ask for fewer impacts or a higher \
                 rest_height, and look at the units of masses, stiffnesses and lengths",
                m.o.bounces.len(),
                m.o.rows.len()
            );
        }
        let Advance::Step(event) = stepper.advance(&mut observed, &mut |_, _| {})? else {
            bail!(
                "at {t:.6e} s the step has become too small: the contact is too stiff for this mass and speed; look at \
                 the units of stiffness, exponent and mass"
            );
        };
        if let Some(event) = event {
            let row = observed.row(stepper.state());
            if m.happened(event, &observed, stepper.time(), stepper.state()) {
                m.record(stepper.time(), &row, observed.force(stepper.rates()))?;
                break;
            }
        }
    }
    for b in &mut m.o.bounces {
        b.exact = compare_exact(case, b);
    }
    Ok(())
}

/// Time s, position m and velocity m/s at which a case begins.
fn start(case: &Case) -> Result<(f64, f64, f64)> {
    let rig = &case.rig;
    Ok(match (case.start, rig.spring) {
        (Start::Held, Some(s)) => {
            // the bar leaves when the holding force has faded to what the rest overcomes
            let (held, p) =
                (rig.parts.residual_magnetism, Physics { residual_magnetism: Default::default(), ..rig.parts });
            let at_rest = rig.setup().motion(0.0, -s.travel, 0.0);
            let drive = p.on_body(&at_rest, s.preload) + rig.mass() * rig.gravity_before;
            let free = drive - p.guide_friction.coulomb * (1.0 + p.guide_friction.stribeck_excess);
            if free <= 0.0 {
                bail!("the bar never leaves: friction and the forces of [motion] hold it against {:.4} N", s.preload);
            }
            let t = if held.force > free { held.time * (held.force / free).ln() } else { 0.0 };
            if !t.is_finite() {
                bail!(
                    "the bar never leaves: the magnet holds it with {} N and has no magnet_time to fade in",
                    held.force
                );
            }
            (t, -s.travel, 0.0)
        }
        (Start::Touch(v), _) => (0.0, 0.0, v),
        (Start::Fall(h), _) => (0.0, -h, 0.0),
        (Start::Held, None) => bail!("a bar is held, but there is no spring to drive it"),
    })
}

/// What is seen of a case under way.
struct Run<'a> {
    case: &'a Case,
    contact: &'a Contact<'a>,
    o: Outcome,
    /// Gravity along +x at the last row, m/s^2.
    gravity: f64,
    /// Energy that left the books when gravity was switched off, J.
    dropped: f64,
    /// Energy at the first row, J: with what the element reports, and with the contact's work instead.
    first: Option<[f64; 2]>,
    /// Where the centre of mass last turned inside the stop, m.
    last_turn: Option<f64>,
    /// Impulse of the contact before this impact, N s.
    touch_impulse: f64,
}

impl<'a> Run<'a> {
    fn new(case: &'a Case, contact: &'a Contact<'a>) -> Run<'a> {
        Run {
            case,
            contact,
            o: Outcome {
                rows: Vec::new(),
                bounces: Vec::new(),
                events: Vec::new(),
                balance: Balance::default(),
                passages: Vec::new(),
                at_rest: false,
                interrupted: false,
            },
            gravity: case.rig.gravity_before,
            dropped: 0.0,
            first: None,
            last_turn: None,
            touch_impulse: 0.0,
        }
    }

    /// The tip has met the surface: an impact begins, or goes on. `speed`: of the centre of mass, m/s.
    fn touch(&mut self, observed: &Observed<'_>, t: f64, row: &RowState, speed: f64) {
        let rig = &self.case.rig;
        self.dropped += rig.potential(self.gravity, row);
        self.gravity = observed.motion.gravity();
        self.dropped -= rig.potential(self.gravity, row);
        match self.o.bounces.last_mut().filter(|b| b.rebound_height.is_none()) {
            Some(b) => b.touches += 1,
            None => {
                let b = Bounce { touch: t, impact_speed: speed, touches: 1, peak_time: t, ..Bounce::default() };
                self.o.bounces.push(b);
                self.touch_impulse = row[rig.places().impulse];
            }
        }
        self.last_turn = None;
    }

    /// Looks at the state: the impact's deepest point and peak so far, and whether all is over.
    fn observe(&mut self, observed: &Observed<'_>, t: f64, y: &State, dy: &State) -> bool {
        let (case, motion) = (self.case, &observed.motion);
        let row = observed.row(y);
        let (place, speed) = motion.centre(y);
        let Some(b) = self.o.bounces.last_mut() else { return false };
        let v = b.impact_speed;
        if !motion.inside() {
            let reach = case.rig.reach(&row, speed);
            return case.impacts == 1 && b.separation.is_some() && speed <= 0.0 && place <= -reach;
        }
        let force = observed.force(dy);
        b.deepest = b.deepest.max(row[0]);
        if force > b.peak_force {
            (b.peak_force, b.peak_time) = (force, t);
        }
        b.impulse = row[case.rig.places().impulse] - self.touch_impulse;
        let pushed = (motion.face(dy).1 * motion.depth(v) / v).abs();
        let quiet = speed.abs() < v * QUIET && pushed < v * QUIET && t > b.touch;
        self.o.at_rest |= quiet;
        quiet
    }

    /// What an event means: whether it ends all.
    fn happened(&mut self, event: usize, observed: &Observed<'_>, t: f64, y: &State) -> bool {
        let motion = &observed.motion;
        let row = observed.row(y);
        let (place, speed) = motion.centre(y);
        note(&mut self.o, event, t, &row, (place, speed));
        match event {
            SURFACE if row[1] > 0.0 => {
                let at_surface = self.case.interrupters.is_some_and(|p| p.last_to_touch == 0.0);
                let all = self.case.interrupters.map_or(0, |p| p.count);
                if self.o.bounces.is_empty() && at_surface && self.o.passages.len() < all {
                    self.o.passages.push((t, 0.0));
                }
                self.touch(observed, t, &row, speed);
            }
            SURFACE => self.separate(t, &row, speed),
            FORCE_SIGN => {
                if let Some(b) = self.o.bounces.last_mut() {
                    b.force_ends = (row[1] < 0.0).then_some(t);
                }
            }
            i if i >= INTERRUPTERS => self.o.passages.push((t, row[0])),
            _ => {}
        }
        let turns = if motion.several() { CENTRE } else { TURN };
        if event != turns {
            return false;
        }
        if motion.inside() {
            self.deepest(place)
        } else {
            self.top(-place)
        }
    }

    /// The tip has left the surface; `speed`: of the centre of mass, m/s.
    fn separate(&mut self, t: f64, row: &RowState, speed: f64) {
        let rig = &self.case.rig;
        self.last_turn = None;
        if let Some(b) = self.o.bounces.last_mut() {
            b.separation = Some(t);
            b.impulse = row[rig.places().impulse] - self.touch_impulse;
            b.duration = t - b.touch;
            b.restitution = -speed / b.impact_speed;
            b.energy_lost = 0.5 * rig.mass() * (b.impact_speed * b.impact_speed - speed * speed);
        }
    }

    /// A rebound is at its top: whether it was the last, or so low that the body rests.
    fn top(&mut self, height: f64) -> bool {
        let impacts = self.o.bounces.len();
        let Some(b) = self.o.bounces.last_mut() else { return false };
        b.rebound_height = Some(height);
        self.o.at_rest = height < self.case.rest_height;
        self.o.at_rest || impacts >= self.case.impacts
    }

    /// The bodies turn inside the stop: whether they turned there before, and so rest.
    fn deepest(&mut self, place: f64) -> bool {
        let least = self.case.rest_height.max(1e-12);
        self.o.at_rest = self.last_turn.is_some_and(|x| (place - x).abs() < least);
        self.last_turn = Some(place);
        self.o.at_rest
    }

    /// Puts the state on record, with the contact's force, N, and the energies.
    fn record(&mut self, t: f64, row: &RowState, force: f64) -> Result<()> {
        let rig = &self.case.rig;
        let at = rig.places();
        let (kinetic, potential) = (rig.kinetic(row), rig.potential(self.gravity, row) + rig.in_sensors(row));
        let reported = self.contact.energies()?;
        let (stored, dissipated) = reported.unwrap_or((f64::NAN, f64::NAN));
        let rest = kinetic + potential + row[at.heat] + row[at.holding] + self.dropped;
        let now = [rest + stored + dissipated, rest + row[at.work]];
        let then = *self.first.get_or_insert(now);
        let b = &mut self.o.balance;
        b.scale = b.scale.max(kinetic).max(row[at.work].abs());
        // absolute until the end, where the scale is known
        b.residual = reported.map(|_| b.residual.unwrap_or(0.0).max((now[0] - then[0]).abs()));
        b.residual_of_motion = b.residual_of_motion.max((now[1] - then[1]).abs());
        (b.heat_outside_contact, b.work_against_holding) = (row[at.heat], row[at.holding]);
        self.o.rows.push(Row { time: t, state: *row, force, stored, dissipated, kinetic, potential });
        Ok(())
    }
}

/// Puts an event on record.
fn note(o: &mut Outcome, i: usize, t: f64, y: &RowState, (place, speed): (f64, f64)) {
    let (mass, position, velocity) = match i {
        CENTRE => ("centre", place, speed),
        BODY_SURFACE | BODY_TURN => ("body", y[2], y[3]),
        SPRUNG_SURFACE | SPRUNG_TURN => ("accelerometer", y[4], y[5]),
        _ => ("tip", y[0], y[1]),
    };
    let turn = if position > 0.0 { "deepest" } else { "top" };
    let pass = if velocity > 0.0 { "touch" } else { "separation" };
    let what = match i {
        SURFACE | BODY_SURFACE | SPRUNG_SURFACE => pass,
        TURN | CENTRE | BODY_TURN | SPRUNG_TURN => turn,
        FORCE_RATE => "peak_force",
        FORCE_SIGN if y[1] < 0.0 => "force_ends",
        FORCE_SIGN => "force_returns",
        _ => "interrupter",
    };
    o.events.push(Event { time: t, mass, what, position, velocity });
}
