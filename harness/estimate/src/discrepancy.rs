//! What a real rig has besides its laws: forces and errors of the instruments that are small and smooth, in numbers that
//! nobody knows (discrepancy: Kennedy and O'Hagan 2001), as columns of readings through the linearised rig.
//!
//! The columns of one campaign share their amplitudes over its recordings: a law that is off is off in all of them. An
//! amplitude of 1 is as large as the contact force, or as the largest reading of a channel.

use crate::fitted::Fitted;
use crate::problem::Data;
use crate::response::{tangents, Place, Response};
use law::Parameters as Law;
use mechanisms::physics::Physics;
use plant::simulate::{law_of, Trace};
use rayon::prelude::*;
use record::{largest, Channel, Kind};
use std::f64::consts::{PI, SQRT_2};
use std::ops::RangeInclusive;

/// Waves over the depth of a force that is conservative, and of one that opposes the motion.
const CONSERVATIVE: usize = 10;
const OPPOSED: usize = 4;
/// Their fundamental's half wave, over the largest depth. A cosine has no slope at the end of its half wave: over the depth
/// itself, a law that is off with a slope at the deepest point would look like a second stop there.
const HALF_WAVE: f64 = 1.25;
/// How small each kind is beside the waves of a conservative force.
const LOSS: f64 = 0.3;
const RATE: f64 = 0.3;
const BODY: f64 = 0.3;
const BENT: f64 = 0.4;
const RINGING: f64 = 0.4;
/// Speed over the largest below which a loss of sign v is smooth.
const SMOOTH: f64 = 0.02;
/// Natural frequencies of small modes of the structure, in cycles a contact, and their damping ratio.
const MODES: [f64; 6] = [3.0, 3.9, 5.0, 6.3, 7.9, 10.0];
const MODE_DAMPING: f64 = 0.03;
/// Most of a sampling rate that such a mode may have.
const RESOLVED: f64 = 0.2;

/// Columns of a campaign: by recording, then by column, the whitened change of its readings by an amplitude of 1.
pub type Columns = Vec<Vec<Vec<f64>>>;

/// One recording's path and readings, as the columns need them.
struct Path<'a> {
    fitted: &'a Fitted,
    record: usize,
    trace: Trace,
    readings: [Vec<f64>; 3],
    physics: Physics,
}

/// Every recording's path through a fit, simulated once.
pub struct Paths<'a> {
    fitted: &'a Fitted,
    of: Vec<Path<'a>>,
}

impl<'a> Paths<'a> {
    /// Of every recording of `fitted`; None where one cannot be simulated.
    pub fn new(fitted: &'a Fitted) -> Option<Paths<'a>> {
        let problem = fitted.problem();
        let of: Option<Vec<Path<'a>>> = (0..fitted.data.records.len())
            .into_par_iter()
            .map(|record| {
                let (trace, readings) = fitted.predict(record);
                let mut physics = problem.physics(&fitted.fit.point.theta);
                let local = problem.local(&fitted.fit.point.locals[record]);
                let own: Law = law_of(&physics, &fitted.data.records[record].setup, &local);
                physics.law = own;
                trace.ok.then_some(Path { fitted, record, trace, readings, physics })
            })
            .collect();
        Some(Paths { fitted, of: of? })
    }

    /// The columns that the recordings share.
    pub fn shared(&self) -> Columns {
        let most = |of: &dyn Fn(&Trace) -> f64| self.of.iter().map(|p| of(&p.trace)).fold(0.0, f64::max).max(1e-300);
        let depth = most(&|t| t.position.iter().cloned().fold(0.0, f64::max));
        let speed = most(&|t| {
            let touching = t.velocity.iter().zip(&t.position).filter(|(_, x)| **x > 0.0);
            touching.map(|(v, _)| v.abs()).fold(0.0, f64::max)
        });
        let mut top = [1e-300f64; 3];
        for r in &self.fitted.data.records {
            for (t, y) in top.iter_mut().zip(&r.y) {
                *t = t.max(y.as_ref().map_or(0.0, |y| largest(y)));
            }
        }
        self.of.par_iter().map(|p| p.shared(depth, speed, top)).collect()
    }

    /// Columns of what each recording may have of its own at `place`: piecewise linear in time, 1 where the contact force
    /// has its campaign's peak (or the channel its largest reading).
    pub fn own(&self, place: Place) -> Columns {
        let data = &self.fitted.data;
        let scale = match place {
            Place::Reading(c) => data.range[c.index()],
            _ => data.scales.peak,
        };
        self.of.par_iter().map(|p| p.own(place, scale)).collect()
    }

    /// Columns of what disturbs a channel of each recording; amplitudes of standard deviation 1.
    pub fn disturbed(&self, of: Disturbed) -> Columns {
        self.of.par_iter().map(|p| p.disturbed(of)).collect()
    }
}

impl Path<'_> {
    fn time(&self) -> &[f64] {
        &self.fitted.data.records[self.record].setup.time
    }

    fn response(&self) -> Response<'_> {
        Response::new(&self.physics, &self.trace, self.time(), self.fitted.data.kind)
    }

    /// Readings weighted and whitened, channel after channel.
    fn whitened(&self, y: &[Vec<f64>; 3]) -> Vec<f64> {
        let data: &Data = &self.fitted.data;
        data.compared(self.record).flat_map(|c| data.whitened(self.record, c, &y[c.index()])).collect()
    }
}

impl Path<'_> {
    fn shared(&self, depth: f64, speed: f64, top: [f64; 3]) -> Vec<Vec<f64>> {
        let data: &Data = &self.fitted.data;
        let n = self.time().len();
        let t = &self.trace;
        let response = self.response();
        let moving = data.kind != Kind::Indentation;
        let takes_force = data.takes_force();
        let mut out = Vec::new();
        let wave = |j: usize, i: usize| (j as f64 * PI * t.position[i].max(0.0) / (HALF_WAVE * depth)).cos();
        let mut force = |place: Place, size: f64, of: &dyn Fn(usize) -> f64| {
            // what no force moves has no discrepancy of force
            if !takes_force {
                return;
            }
            let drive: Vec<f64> = (0..n).map(|i| size * t.force[i] * of(i)).collect();
            out.push(self.whitened(&response.to(&drive, place)));
        };
        for j in 1..=CONSERVATIVE {
            force(Place::Contact, 1.0, &|i| wave(j, i));
        }
        let relative = |i: usize| t.velocity[i] / speed;
        for j in 0..OPPOSED {
            force(Place::Contact, LOSS, &|i| wave(j, i) * relative(i) / relative(i).hypot(SMOOTH));
        }
        force(Place::Contact, RATE, &relative);
        force(Place::Contact, RATE, &|i| relative(i) * relative(i).abs());
        if moving {
            for j in 0..2 {
                force(Place::Motion, BODY, &|i| wave(j, i));
            }
        }
        let channels: Vec<Channel> = data.compared(self.record).collect();
        // a column of a channel that this recording lacks is zero in it
        let lacking = || vec![0.0; channels.len() * n];
        for c in Channel::ALL.into_iter().filter(|c| data.has(*c) && (moving || *c != Channel::Penetration)) {
            let of = &self.readings[c.index()];
            for power in [2, 3] {
                if !channels.contains(&c) {
                    out.push(lacking());
                    continue;
                }
                let bent: Vec<f64> = of
                    .iter()
                    .map(|y| BENT * y.abs() * (y / top[c.index()]).abs().powi(power - 2) * y / top[c.index()])
                    .collect();
                out.push(self.whitened(&response.to(&bent, Place::Reading(c))));
            }
            if !moving || c == Channel::Penetration {
                continue;
            }
            for cycles in MODES {
                let frequency = cycles / data.scales.duration;
                if frequency > RESOLVED / data.scales.dt {
                    continue;
                }
                if !channels.contains(&c) {
                    out.push(lacking());
                    continue;
                }
                let rings: Vec<f64> =
                    ringing(&t.force, self.time(), frequency).iter().map(|z| RINGING * z / self.unit(c)).collect();
                out.push(self.whitened(&response.to(&rings, Place::Reading(c))));
            }
        }
        out
    }

    /// Force that the reading 1 of a channel stands for.
    fn unit(&self, c: Channel) -> f64 {
        if c == Channel::Acceleration {
            self.physics.mass
        } else {
            1.0
        }
    }
}

/// What a mode of that natural frequency, Hz, rings with while `force` acts on it, less what it follows at rest.
fn ringing(force: &[f64], time: &[f64], frequency: f64) -> Vec<f64> {
    let w = 2.0 * PI * frequency;
    let (mut z, mut u) = (0.0f64, 0.0f64);
    let mut out = vec![0.0; force.len()];
    for i in 1..force.len() {
        let h = time[i] - time[i - 1];
        // steps short enough for the explicit rule
        let steps = (w * h / 0.2).ceil().max(1.0) as usize;
        let h = h / steps as f64;
        for k in 0..steps {
            let share = (k as f64 + 0.5) / steps as f64;
            let f = force[i - 1] + share * (force[i] - force[i - 1]);
            u += h * (w * w * (f - z) - 2.0 * MODE_DAMPING * w * u);
            z += h * u;
        }
        out[i] = z - force[i];
    }
    out
}

/// Knots over which a recording's own unknown is spread.
const KNOTS: usize = 16;

impl Path<'_> {
    fn own(&self, place: Place, scale: f64) -> Vec<Vec<f64>> {
        let data: &Data = &self.fitted.data;
        let n = self.time().len();
        let absent = match place {
            Place::Reading(c) => !data.compared(self.record).any(|d| d == c),
            _ => false,
        };
        let touches: Vec<usize> = (0..n).filter(|i| self.trace.position[*i] > 0.0).collect();
        let (a, b) = match (place, touches.first(), touches.last()) {
            (Place::Contact, Some(a), Some(b)) => (a.saturating_sub(2), (b + 2).min(n - 1)),
            _ => (0, n - 1),
        };
        let spacing = ((b - a) as f64 / (KNOTS - 1) as f64).max(1.0);
        let response = self.response();
        (0..KNOTS)
            .map(|k| {
                let drive: Vec<f64> = (0..n)
                    .map(|i| {
                        if absent || i < a || i > b {
                            return 0.0;
                        }
                        scale * (1.0 - ((i - a) as f64 / spacing - k as f64).abs()).max(0.0)
                    })
                    .collect();
                self.whitened(&response.to(&drive, place))
            })
            .collect()
    }
}

/// What the instrument of a channel may do to every recording besides its noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disturbance {
    /// A line and an arc over the recording, from a zero that has drifted before it.
    Drift,
    /// The hum of mains of 50 Hz, with its harmonics.
    Hum50,
    /// The hum of mains of 60 Hz, with its harmonics.
    Hum60,
    /// A random walk, less the line and the arc.
    Walk,
}

impl Disturbance {
    /// All of them.
    pub const ALL: [Disturbance; 4] = [Disturbance::Drift, Disturbance::Hum50, Disturbance::Hum60, Disturbance::Walk];
    /// Sets of them that so many channels may have, none included: a rig has one mains, which may hum in each.
    pub fn sets(channels: u32) -> usize {
        4usize.pow(channels) * (2usize.pow(channels + 1) - 1)
    }
}

/// A disturbance of the readings of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Disturbed {
    pub channel: Channel,
    pub by: Disturbance,
}

impl Disturbed {
    /// Every disturbance of every channel of `data`.
    pub fn all(data: &Data) -> Vec<Disturbed> {
        let channels = Channel::ALL.into_iter().filter(|c| data.has(*c));
        channels.flat_map(|channel| Disturbance::ALL.map(|by| Disturbed { channel, by })).collect()
    }

    /// Whether both may be in one campaign: a rig has one mains.
    pub fn goes_with(self, other: Disturbed) -> bool {
        !matches!(
            (self.by, other.by),
            (Disturbance::Hum50, Disturbance::Hum60) | (Disturbance::Hum60, Disturbance::Hum50)
        )
    }
}

/// Standard deviation of a drift, of a hum, and of how far a random walk goes over a recording, in that of the noise.
const DISTURBED: f64 = 5.0;
/// Half waves of a random walk over a recording; the cosine of number j has an amplitude of sqrt(2)/(pi j) of the way it
/// goes (Karhunen 1947, Loeve 1948).
const HALF_WAVES: RangeInclusive<usize> = 3..=12;
/// Multiples of the mains' frequency in its hum. Rectifiers draw near enough rectangular currents, whose harmonic h has an
/// amplitude of 1/h, even ones where their halves differ.
const HARMONICS: [f64; 4] = [1.0, 2.0, 3.0, 5.0];

/// The hum of mains of that frequency, Hz: sine and cosine of each harmonic.
fn hum(mains: f64, time: &[f64]) -> Vec<Vec<f64>> {
    let phase = |h: f64| time.iter().map(move |t| 2.0 * PI * h * mains * (t - time[0]));
    let of = |h: &f64| [phase(*h).map(|p| p.sin() / h).collect(), phase(*h).map(|p| p.cos() / h).collect()];
    HARMONICS.iter().flat_map(of).collect()
}

impl Path<'_> {
    fn disturbed(&self, of: Disturbed) -> Vec<Vec<f64>> {
        let data: &Data = &self.fitted.data;
        let time = self.time();
        let n = time.len();
        let (first, last) = (time[0], time[n - 1]);
        let along = |i: usize| 2.0 * (time[i] - first) / (last - first) - 1.0;
        let shapes: Vec<Vec<f64>> = match of.by {
            Disturbance::Drift => {
                let arc = |i: usize| 1.5 * along(i) * along(i) - 0.5;
                vec![vec![1.0; n], (0..n).map(along).collect(), (0..n).map(arc).collect()]
            }
            Disturbance::Hum50 => hum(50.0, time),
            Disturbance::Hum60 => hum(60.0, time),
            Disturbance::Walk => HALF_WAVES
                .map(|j| j as f64)
                .map(|j| (0..n).map(|i| SQRT_2 / (PI * j) * (0.5 * PI * j * (along(i) + 1.0)).cos()).collect())
                .collect(),
        };
        let is_read = data.compared(self.record).any(|c| c == of.channel);
        // a path that is imposed where it is not read changes the force
        let stiffness = match (data.kind, of.channel) {
            (Kind::Indentation, Channel::Penetration) if !is_read => tangents(&self.physics, &self.trace, time),
            _ => Vec::new(),
        };
        let sd = DISTURBED * data.noise[of.channel.index()].marginal();
        let readings = |shape: &Vec<f64>| {
            let mut y = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            if is_read {
                y[of.channel.index()] = shape.iter().map(|s| sd * s).collect();
            } else if !stiffness.is_empty() {
                y[Channel::Force.index()] = shape.iter().zip(&stiffness).map(|(s, (k, _))| -k * sd * s).collect();
            }
            self.whitened(&y)
        };
        shapes.iter().map(readings).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sets_of_disturbances_are_those_with_one_mains() {
        let channels = [Channel::Force, Channel::Acceleration];
        let all: Vec<Disturbed> =
            channels.iter().flat_map(|c| Disturbance::ALL.map(|by| Disturbed { channel: *c, by })).collect();
        let possible = (0..1usize << all.len()).filter(|set| {
            let of: Vec<Disturbed> = (0..all.len()).filter(|i| set >> i & 1 == 1).map(|i| all[i]).collect();
            of.iter().all(|a| of.iter().all(|b| a.goes_with(*b)))
        });
        assert_eq!(possible.count(), Disturbance::sets(2));
    }
}
