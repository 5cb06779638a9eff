//! Every recording as it was read, and as each simulation has it: as given, recalibrated, with the physics found. What a
//! report draws.

use crate::decide::Decision;
use crate::heldout::HeldOut;
use crate::predictions::Predictions;
use assess::bounces::{by_position, noise_reach};
use estimate::fitted::Fitted;
use estimate::problem::{Data, Nuisance};
use estimate::structure::{Law, Term};
use mechanisms::mechanism::Origin;
use plant::simulate::Trace;
use record::{Channel, Kind, GRAVITY};

/// Share of the peak between whose crossings a contact is timed.
const TIMED: f64 = 0.05;
/// Share of the contact time by which a loop reaches beyond touch and leaving.
const MARGIN: f64 = 0.04;
/// Samples before the touch from which the zero of a force is read.
const QUIET: usize = 8;

/// Force over penetration during the first contact, as the channels recorded would give it; NaN outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loop {
    /// m
    pub penetration: Vec<f64>,
    /// N
    pub force: Vec<f64>,
}

/// The first impact of a recording, read off its force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Largest force, N.
    pub peak_force: f64,
    /// Rebound speed over speed at touch (Newton); None where the recording ends in contact. By the impulse; of FMUs, whose other
    /// forces on the body are not known, by the penetration before and after the contact, None without one.
    pub restitution: Option<f64>,
    /// Time between the crossings of 5 % of the peak, s; None where the recording ends before the second.
    pub contact_time: Option<f64>,
}

/// One recording, read or simulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// By channel; empty where there is none.
    pub readings: [Vec<f64>; 3],
    pub hysteresis: Loop,
    pub impact: Option<Impact>,
}

/// The contact of a recording on its own clock, by the best simulation there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// s
    pub touch: f64,
    pub leave: f64,
    /// Speed at touch, m/s.
    pub speed: f64,
}

/// All recordings, in the order of the data, by simulation.
#[derive(Clone, Debug, Default)]
pub struct Courses {
    pub contacts: Vec<Contact>,
    pub measured: Vec<Course>,
    /// With the values of campaign.toml, nothing fitted but the time of touch; None where the campaign gives no k and p.
    pub given: Option<Vec<Course>>,
    /// Without new physics, each predicted without its level.
    pub recalibrated: Vec<Course>,
    /// With the physics found, each predicted without its level; None where nothing was found, or nothing better.
    pub found: Option<Vec<Course>>,
    /// Whether penetration was recorded (or imposed); else it is the force integrated twice, with the zero and the gain fitted to it.
    pub penetration_recorded: bool,
    /// Whether the measuring chain, as it was fitted, does more to the force than a zero and a gain: then nothing is integrated, and
    /// without a penetration recorded there is no loop measured.
    pub chain_bends: bool,
    /// What each recording's channels read where there is nothing, as fitted, in the channel's unit; predictions are without it.
    pub zeros: Vec<[f64; 3]>,
    /// The channel that forces are read from; acceleration times mass where there is no force.
    pub force_from: Option<Channel>,
}

/// Traces of what predicted every recording.
pub struct Traces(Vec<Trace>);

impl Traces {
    /// Of the predictions `of`, made by structures as that of `fitted`.
    pub fn new(fitted: &Fitted, of: &HeldOut) -> Traces {
        let problem = fitted.problem();
        Traces(of.points.iter().enumerate().map(|(r, (theta, local))| problem.predict(theta, r, local).0).collect())
    }
}

impl Courses {
    /// Of a decision: `before` are the traces of its predictions before, `after` those of its predictions after with what is
    /// predicted in the end.
    pub fn new(d: &Decision, before: &Traces, after: Option<(&Traces, &Predictions)>) -> Courses {
        let data = &*d.base.data;
        let view = View::new(data);
        let recalibrated = view.simulated(&d.before.predictions, &before.0, gravity(&d.base));
        let found = after.map(|(t, p)| view.simulated(p, &t.0, gravity(&d.chosen)));
        let best = after.map_or(&before.0, |(t, _)| &t.0);
        let contacts: Vec<Contact> = best.iter().zip(&data.records).map(|(t, r)| contact(t, &r.setup.time)).collect();
        let read = Reading::new(d.simulated());
        // a gain alone can be undone, sample by sample
        let is_gain = |t: &Term| t.mechanism.hints.is_calibration && t.form.parameters.len() == 1;
        let terms = d.simulated().structure.terms();
        let chain_bends = terms.iter().any(|t| t.mechanism.origin == Origin::Chain && !is_gain(t));
        Courses {
            measured: contacts.iter().enumerate().map(|(r, c)| view.measured(r, c, &read, chain_bends)).collect(),
            chain_bends,
            zeros: (0..contacts.len()).map(|r| read.zero(r)).collect(),
            given: d.base.structure.base().law().map(|law| view.given(&d.base, law)),
            recalibrated,
            found,
            contacts,
            penetration_recorded: data.has(Channel::Penetration),
            force_from: view.force_from,
        }
    }
}

/// Gravity that a simulation has, m/s^2.
fn gravity(f: &Fitted) -> f64 {
    f.physics().gravity
}

fn contact(t: &Trace, time: &[f64]) -> Contact {
    let at = time.partition_point(|u| *u < t.touch).min(time.len().saturating_sub(1));
    Contact { touch: t.touch, leave: t.leave, speed: t.velocity.get(at).copied().unwrap_or(f64::NAN) }
}

/// How instruments read, as fitted: a gain for each channel, and each recording's zeros.
struct Reading {
    gain: [f64; 3],
    zeros: Vec<[f64; 3]>,
}

impl Reading {
    fn new(fitted: &Fitted) -> Reading {
        let problem = fitted.problem();
        let of = |local: &Vec<f64>| {
            let mut zero = [0.0; 3];
            for (n, z) in problem.nuisances().iter().zip(local) {
                match n {
                    // a prediction has that of its penetration
                    Nuisance::Zero(Channel::Penetration) => {}
                    Nuisance::Zero(c) => zero[c.index()] = *z,
                    _ => {}
                }
            }
            zero
        };
        Reading { gain: fitted.physics().force_gain.channel, zeros: fitted.point().locals.iter().map(of).collect() }
    }

    /// Zeros of recording `r`; none where nothing was fitted to it.
    fn zero(&self, r: usize) -> [f64; 3] {
        self.zeros.get(r).copied().unwrap_or_default()
    }

    /// Readings of recording `r` without their zeros.
    fn level(&self, r: usize, readings: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
        let zero = self.zero(r);
        [0, 1, 2].map(|i| readings[i].iter().map(|v| v - zero[i]).collect())
    }
}

struct View<'a> {
    data: &'a Data,
    force_from: Option<Channel>,
}

impl<'a> View<'a> {
    fn new(data: &'a Data) -> View<'a> {
        let force_from = [Channel::Force, Channel::Acceleration].into_iter().find(|c| data.has(*c));
        View { data, force_from }
    }

    /// Contact force as the readings of one channel have it, N; empty where there is none.
    fn force(&self, readings: &[Vec<f64>; 3]) -> Vec<f64> {
        match self.force_from {
            Some(Channel::Acceleration) => readings[1].iter().map(|a| -self.data.mass * a).collect(),
            _ => readings[0].clone(),
        }
    }

    /// Recording `r` as read by instruments that read as `read`; `bends`: whether they do more than that.
    fn measured(&self, r: usize, c: &Contact, read: &Reading, bends: bool) -> Course {
        let rec = &self.data.records[r];
        let readings = [0, 1, 2].map(|i| rec.y[i].clone().unwrap_or_default());
        let pull = if self.data.kind == Kind::DropTest { GRAVITY } else { 0.0 };
        let level = read.level(r, &readings);
        let penetration = match &rec.y[Channel::Penetration.index()] {
            Some(x) => x.clone(),
            None if bends => vec![f64::NAN; rec.setup.time.len()],
            None => {
                let gain = read.gain[self.force_from.unwrap_or(Channel::Force).index()];
                let force: Vec<f64> = self.force(&level).iter().map(|f| f / gain).collect();
                self.integrated(r, c, &force, pull)
            }
        };
        let mut course = self.course(r, level, penetration, c, pull);
        // what is drawn over time is as it was read
        course.readings = readings;
        course
    }

    /// Penetration by integrating the `force` on the body twice from the touch on, m; NaN before.
    fn integrated(&self, r: usize, c: &Contact, force: &[f64], pull: f64) -> Vec<f64> {
        let setup = &self.data.records[r].setup;
        let (mut x, mut v, mut last) = (0.0, c.speed, c.touch);
        let step = |(t, f): (&f64, &f64)| {
            if *t < c.touch {
                return f64::NAN;
            }
            let (dt, a) = (t - last, pull + (setup.drive(x) - f) / self.data.mass);
            x += dt * (v + 0.5 * dt * a);
            v += dt * a;
            last = *t;
            x
        };
        setup.time.iter().zip(force).map(step).collect()
    }

    fn simulated(&self, p: &Predictions, traces: &[Trace], pull: f64) -> Vec<Course> {
        let of = |(r, (y, t)): (usize, (&[Vec<f64>; 3], &Trace))| self.of_trace(r, y.clone(), t, pull);
        p.judged.iter().zip(traces).enumerate().map(of).collect()
    }

    fn of_trace(&self, r: usize, y: [Vec<f64>; 3], t: &Trace, pull: f64) -> Course {
        let rec = &self.data.records[r];
        let recorded = rec.y[Channel::Penetration.index()].is_some();
        let penetration = if self.data.kind == Kind::Indentation {
            rec.setup.imposed.clone()
        } else if recorded && y[2].len() == rec.setup.time.len() {
            y[2].clone()
        } else {
            t.position.clone()
        };
        self.course(r, y, penetration, &contact(t, &rec.setup.time), pull)
    }

    /// The simulation with the campaign's own values: tolerances at zero, speeds as measured, nothing fitted but the time of
    /// touch. What the campaign lists without values is as recalibrated.
    fn given(&self, base: &Fitted, law: Law) -> Vec<Course> {
        let problem = base.problem();
        let mut theta = base.structure.start(law);
        let valued = theta.len() - base.structure.base().given.iter().map(|t| t.form.parameters.len()).sum::<usize>();
        theta[valued..].copy_from_slice(&base.point().theta[valued..]);
        let pull = problem.physics(&theta).gravity;
        (0..self.data.records.len())
            .map(|r| {
                let mut local = self.data.local_start(r);
                for (i, n) in problem.nuisances().iter().enumerate() {
                    if *n == Nuisance::Start {
                        local[i] = base.point().locals[r][i];
                    }
                }
                let local = problem.fit_local(&theta, r, &local, &|n| n == Nuisance::Start);
                let (t, y) = problem.predict(&theta, r, &local);
                self.of_trace(r, y, &t, pull)
            })
            .collect()
    }

    fn course(&self, r: usize, readings: [Vec<f64>; 3], penetration: Vec<f64>, c: &Contact, pull: f64) -> Course {
        let setup = &self.data.records[r].setup;
        let force = self.force(&readings);
        let moves = self.data.kind != Kind::Indentation;
        let mut impact = if moves {
            let drive = pull + setup.drive(0.0) / self.data.mass;
            read_off(&setup.time, &force, self.data.mass, drive, c)
        } else {
            None
        };
        if let (Some(_), Some(i)) = (self.data.machine(), &mut impact) {
            i.restitution = by_speeds(&setup.time, &readings[Channel::Penetration.index()], c);
        }
        let beyond = MARGIN * (c.leave - c.touch);
        let inside = |t: &f64| !moves || (c.touch - beyond..=c.leave + beyond).contains(t);
        let kept = |v: &[f64]| v.iter().zip(&setup.time).map(|(v, t)| if inside(t) { *v } else { f64::NAN }).collect();
        let hysteresis = Loop { penetration: kept(&penetration), force: kept(&force) };
        Course { readings, hysteresis, impact }
    }
}

/// The first impact in `force` N over `time` s, of a body of `mass` kg that else is accelerated by `pull` m/s^2.
fn read_off(time: &[f64], force: &[f64], mass: f64, pull: f64, c: &Contact) -> Option<Impact> {
    if force.len() != time.len() || c.speed.is_nan() || c.speed <= 0.0 {
        return None;
    }
    let beyond = c.leave - c.touch;
    let near = |i: &usize| (c.touch - 0.2 * beyond..=c.leave + 0.5 * beyond).contains(&time[*i]);
    let quiet: Vec<f64> = (0..time.len()).filter(|i| time[*i] < c.touch - 0.05 * beyond).map(|i| force[i]).collect();
    let zero = if quiet.len() < QUIET { 0.0 } else { quiet.iter().sum::<f64>() / quiet.len() as f64 };
    let f: Vec<f64> = force.iter().map(|v| v - zero).collect();
    let top = (0..time.len()).filter(near).max_by(|a, b| f[*a].total_cmp(&f[*b]))?;
    let limit = TIMED * f[top];
    if f[top].is_nan() || f[top] <= 0.0 {
        return None;
    }
    let before = (0..top).rev().find(|i| f[*i] <= limit)?;
    let after = (top + 1..time.len()).find(|i| f[*i] <= limit);
    let crossing = |a: usize, b: usize| time[a] + (time[b] - time[a]) * (limit - f[a]) / (f[b] - f[a]);
    let first = (0..=before).rev().find(|i| f[*i] <= 0.0).unwrap_or(before);
    let last = after.map(|after| (after..time.len()).find(|i| f[*i] <= 0.0).unwrap_or(after));
    let restitution = last.map(|last| {
        let impulse: f64 = (first..last).map(|i| 0.5 * (f[i] + f[i + 1]).max(0.0) * (time[i + 1] - time[i])).sum();
        impulse / (mass * c.speed) - 1.0 - pull * (time[last] - time[first]) / c.speed
    });
    Some(Impact {
        peak_force: f[top],
        restitution,
        contact_time: after.map(|after| crossing(after - 1, after) - crossing(before, before + 1)),
    })
}

/// Restitution of the contact `c` by the speeds of the penetration read before and after it; None where there are none.
fn by_speeds(time: &[f64], penetration: &[f64], c: &Contact) -> Option<f64> {
    let at = time.partition_point(|t| *t < c.touch);
    let zero = penetration.get(at)?;
    let x: Vec<f64> = penetration.iter().map(|x| x - zero).collect();
    let impacts = by_position(time, &x, noise_reach(time, &x))?.impacts;
    let off = |i: &assess::bounces::Impact| (i.touch - c.touch).abs();
    let nearest = impacts.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    nearest.restitution.filter(|_| off(nearest) < c.leave - c.touch)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impact_is_read_off_its_force() {
        // half a sine of 2 ms on 0.5 kg at 1 m/s that leaves at 0.6 m/s, with a zero that is off
        let (mass, speed, e, duration) = (0.5, 1.0, 0.6, 2e-3);
        let (dt, touch) = (1e-5, 1e-3);
        let impulse = mass * speed * (1.0 + e) + mass * GRAVITY * duration;
        let peak = impulse * std::f64::consts::PI / (2.0 * duration);
        let time: Vec<f64> = (0..500).map(|i| dt * f64::from(i)).collect();
        let pulse = |t: &f64| {
            let u = (t - touch) / duration;
            3.0 + if (0.0..=1.0).contains(&u) { peak * (std::f64::consts::PI * u).sin() } else { 0.0 }
        };
        let force: Vec<f64> = time.iter().map(pulse).collect();
        let c = Contact { touch, leave: touch + duration, speed };
        let i = read_off(&time, &force, mass, GRAVITY, &c).unwrap();
        assert!((i.peak_force / peak - 1.0).abs() < 1e-4, "{i:?}");
        assert!((i.restitution.unwrap() - e).abs() < 1e-3, "{i:?}");
        let timed = duration * (1.0 - 2.0 * TIMED.asin() / std::f64::consts::PI);
        assert!((i.contact_time.unwrap() / timed - 1.0).abs() < 1e-3, "{i:?}");
        // cut in contact: the peak alone is known
        let cut = read_off(&time[..220], &force[..220], mass, GRAVITY, &c).unwrap();
        assert_eq!((cut.restitution, cut.contact_time), (None, None));
        assert!(read_off(&time, &vec![f64::NAN; 500], mass, GRAVITY, &c).is_none());
    }

    #[test]
    fn a_force_is_integrated_without_the_zero_and_the_gain_of_its_instrument() {
        use estimate::prepare::Prepared;
        use plant::recipe::{write_campaign, Recipe};
        let dir = tempfile::tempdir().unwrap();
        let mut recipe = Recipe { speed_at_touch: true, ..Recipe::default() };
        recipe.physics.force_gain.channel[0] = 1.02;
        write_campaign(dir.path(), &recipe).unwrap();
        let mut c = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let deepest = |x: &[f64]| x.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max);
        let made: Vec<f64> = c.recordings.iter().map(|r| deepest(r.channels[2].as_ref().unwrap())).collect();
        for r in &mut c.recordings {
            (r.channels[1], r.channels[2]) = (None, None);
            let force = r.channels[0].as_mut().unwrap();
            let zero = 0.02 * record::range(force);
            force.iter_mut().for_each(|f| *f += zero);
        }
        let Prepared { data, guess, structure } = Prepared::new(&c).unwrap();
        let base = Fitted::base(&data, &structure, &guess);
        let view = View::new(&data);
        let mut read = Reading::new(&base);
        // as though the fit had found them
        read.gain[0] = 1.02;
        for (r, rec) in data.records.iter().enumerate() {
            read.zeros[r] = [0.02 / 1.02 * record::range(rec.y[0].as_ref().unwrap()), 0.0, 0.0];
        }
        let mut errors = Vec::new();
        for (r, made) in made.iter().enumerate() {
            let (trace, _) = base.predict(r);
            let touch =
                Contact { speed: data.records[r].speed.unwrap().0, ..contact(&trace, &data.records[r].setup.time) };
            let off = |read: &Reading| {
                let x = view.measured(r, &touch, read, false).hysteresis.penetration;
                (deepest(&x) / made - 1.0).abs()
            };
            let raw = Reading { gain: [1.0; 3], zeros: vec![[0.0; 3]; data.records.len()] };
            errors.push((off(&read), off(&raw)));
            let none = view.measured(r, &touch, &read, true).hysteresis.penetration;
            assert!(none.iter().all(|x| x.is_nan()), "what the chain bends is not integrated");
        }
        // the deepest reading itself is off by its own zero and noise, some 1 %
        let mean = |of: fn(&(f64, f64)) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
        let (with, without) = (mean(|e| e.0), mean(|e| e.1));
        assert!(with < 0.015 && without > 1.5 * with, "{with} {without}: {errors:?}");
    }

    #[test]
    fn of_fmus_restitution_is_that_of_the_speeds_whatever_drives_the_body() {
        // in at 0.8 m/s, driven by 40 m/s^2, out at 0.5 m/s; a zero that is off, and noise
        let (touch, leave, e) = (2e-3, 3e-3, 0.5 / 0.8);
        let way = |t: f64| {
            if t < touch {
                0.8 * (t - touch) - 20.0 * (t - touch).powi(2)
            } else if t < leave {
                let u = t - touch;
                0.8 * u - 0.5 * 1600.0 * u * u
            } else {
                -0.5 * (t - leave) + 20.0 * (t - leave).powi(2)
            }
        };
        let time: Vec<f64> = (0..500).map(|i| 1e-5 * f64::from(i)).collect();
        let noise = |i: usize| 1e-7 * ((i * 7919 % 101) as f64 / 101.0 - 0.5);
        let x: Vec<f64> = time.iter().enumerate().map(|(i, t)| 3e-4 + way(*t) + noise(i)).collect();
        let c = Contact { touch, leave, speed: 0.8 };
        let got = by_speeds(&time, &x, &c).unwrap();
        assert!((got / e - 1.0).abs() < 0.01, "{got} {e}");
        assert!(by_speeds(&time, &[], &c).is_none());
        assert!(by_speeds(&time[..250], &x[..250], &c).is_none());
    }
}
