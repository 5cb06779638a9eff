//! learned_force: a force whose shape is learned, of one of several dependences

use crate::load_history::LoadHistory;
use crate::mechanism::*;
use crate::part::{Motion, Part, Sampling, Wear};
use law::body;
use law::learned::{of_speed, series, series_at, shapes_of_speed, Learned, WithSpeed};
pub use law::learned::{COEFFICIENTS, SPEEDS, TERMS};
use law::parts::LearnedLaw;
use record::Channel;
use std::f64::consts::{PI, SQRT_2};

/// A force learned as a function: series over depth, or over the way before the touch, of what it depends on. No search
/// takes it: its forms are none, and what is learned is asked for by [`dependences`].
pub const MECHANISM: Mechanism = of_origin(Origin::Contact);
const ON_BODY: Mechanism = of_origin(Origin::Motion);
const IN_READING: Mechanism = of_origin(Origin::Chain);

const fn of_origin(origin: Origin) -> Mechanism {
    Mechanism {
        name: "learned_force",
        origin,
        named: false,
        equation: "F = s w(u) sum_j c_j cos(j pi u), for each power of speed or direction that it depends on",
        source: "Solin and Sarkka 2020 (a Gaussian process on a reduced basis)",
        sentence: "a force of a shape of its own",
        cure: "No mechanism known explains it; the report shows the force that was learned.",
        forms: |_| Vec::new(),
        acts: Acts::Reading,
        hints: Hints { is_flexible: true, ..Hints::PLAIN },
    }
}

/// Standard deviation, before anything is seen, of the constant of a series and of what varies about it, share of the scale of
/// force.
const SPREAD: f64 = 1.0;
/// Length over which what varies is alike, share of the range of the series (Matern, smoothness 3/2).
const LENGTH: f64 = 0.25;
/// Range of a series over the depth, share of the largest depth; beyond, its factor stays.
const RANGE: f64 = 1.05;

/// What a learned force depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dependence {
    /// Nothing is learned.
    #[default]
    Nothing,
    /// Between the faces: d(x).
    Depth,
    /// d(x) + c(x) v.
    DepthAndSpeed,
    /// d(x) + h(x) sign(v).
    DepthAndDirection,
    /// d(x) + q(x) v |v|.
    DepthAndSpeedSquared,
    /// c(x) v.
    DepthTimesSpeed,
    /// h(x) sign(v).
    DepthTimesDirection,
    /// q(x) v |v|.
    DepthTimesSpeedSquared,
    /// On the body, in flight too: b(x).
    Place,
    /// b(x) + c(x) v.
    PlaceAndSpeed,
    /// b(x) + c(x) sign(v).
    PlaceAndDirection,
    /// v c(|v|).
    Speed,
    /// The error of a reading, of the reading itself: of force, acceleration or penetration.
    Reading(Channel),
    /// The error of the penetration read, of the force.
    Force,
    /// Factors on stiffness and damping of the contact, by the order of the recordings.
    Order,
}

impl Dependence {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Dependence::Nothing => "nothing",
            Dependence::Depth => "contact: depth",
            Dependence::DepthAndSpeed | Dependence::DepthTimesSpeed => "contact: depth and speed",
            Dependence::DepthAndDirection | Dependence::DepthTimesDirection => "contact: depth and direction",
            Dependence::DepthAndSpeedSquared | Dependence::DepthTimesSpeedSquared => "contact: depth and speed squared",
            Dependence::Place => "body: place",
            Dependence::PlaceAndSpeed => "body: place and speed",
            Dependence::PlaceAndDirection => "body: place and direction",
            Dependence::Speed => "body: speed",
            Dependence::Reading(Channel::Force) => "reading of force: itself",
            Dependence::Reading(Channel::Acceleration) => "reading of acceleration: itself",
            Dependence::Reading(Channel::Penetration) => "reading of penetration: itself",
            Dependence::Force => "reading of penetration: force",
            Dependence::Order => "contact: order",
        }
    }

    /// Where the force acts and what it depends on, in words.
    pub const fn words(self) -> &'static str {
        match self {
            Dependence::Nothing => "on nothing",
            Dependence::Depth => "between the faces, on the depth alone",
            Dependence::DepthAndSpeed | Dependence::DepthTimesSpeed => "between the faces, on the depth and the speed",
            Dependence::DepthAndDirection | Dependence::DepthTimesDirection => {
                "between the faces, on the depth and the direction of the motion"
            }
            Dependence::DepthAndSpeedSquared | Dependence::DepthTimesSpeedSquared => {
                "between the faces, on the depth and the square of the speed"
            }
            Dependence::Place => "on the body, on its place alone",
            Dependence::PlaceAndSpeed => "on the body, on its place and its speed",
            Dependence::PlaceAndDirection => "on the body, on its place and the direction of its motion",
            Dependence::Speed => "on the body, on its speed alone",
            Dependence::Reading(Channel::Force) => "in the reading of the force, on that reading",
            Dependence::Reading(Channel::Acceleration) => "in the reading of the acceleration, on that reading",
            Dependence::Reading(Channel::Penetration) => "in the reading of the penetration, on that reading",
            Dependence::Force => "in the reading of the penetration, on the force",
            Dependence::Order => "between the faces, on the order of the recordings",
        }
    }

    /// Whether a force of this and one of `other` may be learned side by side: they act in different places, so that neither
    /// holds the other.
    pub fn goes_with(self, other: Dependence) -> bool {
        let place = |of: Dependence| (of.origin(), of == Dependence::Order);
        place(self) != place(other)
    }

    /// Where it acts.
    pub fn origin(self) -> Origin {
        self.mechanism().origin
    }

    /// Name of the mechanism whose class it is where its part that depends on the speed takes energy out, and the names that no
    /// function of this class parts from it; None where the vocabulary has no name for the class.
    pub const fn loss(self) -> Option<(&'static str, &'static [&'static str])> {
        match self {
            Dependence::DepthAndSpeed | Dependence::DepthTimesSpeed => {
                Some(("hysteresis_damping", &["viscous_damping"]))
            }
            _ => None,
        }
    }

    /// The forces that it is with its second series at zero, and with its first at zero; None where it has no second, or what is left
    /// is not tried by itself.
    pub const fn contains(self) -> [Option<Dependence>; 2] {
        use Dependence::*;
        match self {
            DepthAndSpeed => [Some(Depth), Some(DepthTimesSpeed)],
            DepthAndDirection => [Some(Depth), Some(DepthTimesDirection)],
            DepthAndSpeedSquared => [Some(Depth), Some(DepthTimesSpeedSquared)],
            PlaceAndSpeed | PlaceAndDirection => [Some(Place), None],
            _ => [None, None],
        }
    }

    /// Where its series stand among the coefficients of a force with two: 1 where the first is none.
    const fn first_series(self) -> usize {
        match self {
            Dependence::DepthTimesSpeed | Dependence::DepthTimesDirection | Dependence::DepthTimesSpeedSquared => 1,
            _ => 0,
        }
    }

    /// Whether it depends on the speed of a body alone.
    pub const fn is_of_speed(self) -> bool {
        matches!(self, Dependence::Speed)
    }

    /// Whether it turns with the direction of the motion.
    pub fn turns(self) -> bool {
        self.goes() == WithSpeed::Direction
    }

    /// Whether it acts between the faces, and not on the body in flight.
    pub const fn is_contact(self) -> bool {
        use Dependence::*;
        self.first_series() == 1 || matches!(self, Depth | DepthAndSpeed | DepthAndDirection | DepthAndSpeedSquared)
    }

    /// How its force goes with the speed.
    const fn goes(self) -> WithSpeed {
        match self {
            Dependence::DepthAndSpeed | Dependence::DepthTimesSpeed => WithSpeed::Linear,
            Dependence::PlaceAndSpeed | Dependence::Speed => WithSpeed::Linear,
            Dependence::DepthAndDirection | Dependence::DepthTimesDirection => WithSpeed::Direction,
            Dependence::PlaceAndDirection => WithSpeed::Direction,
            Dependence::DepthAndSpeedSquared | Dependence::DepthTimesSpeedSquared => WithSpeed::Squared,
            _ => WithSpeed::No,
        }
    }

    /// Series of it.
    pub const fn series(self) -> usize {
        match self {
            Dependence::Nothing => 0,
            Dependence::Depth | Dependence::Place | Dependence::Speed => 1,
            Dependence::Reading(_) | Dependence::Force => 1,
            of if of.first_series() == 1 => 1,
            _ => 2,
        }
    }

    /// Where it sits.
    const fn mechanism(self) -> &'static Mechanism {
        match self {
            Dependence::Place | Dependence::PlaceAndSpeed | Dependence::PlaceAndDirection | Dependence::Speed => {
                &ON_BODY
            }
            Dependence::Reading(_) | Dependence::Force => &IN_READING,
            _ => &MECHANISM,
        }
    }
}

/// The force that was learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedForce {
    pub of: Dependence,
    /// Coefficients of the series, N, of a reading in its unit, of factors 1; range of the series, m of depth or way, of a reading or
    /// a force in its own unit, in recordings; and the speed that counts as 1.
    pub learned: Learned,
}

impl Default for LearnedForce {
    fn default() -> Self {
        LearnedForce { of: Dependence::Nothing, learned: Learned::default() }
    }
}

impl LearnedForce {
    /// Factor at `u` of the range, of what depends on no speed.
    #[inline]
    fn factor(&self, u: f64) -> f64 {
        series(&self.learned.coefficients[..TERMS], u)
    }

    /// Puts it into the contact law and the forces on the body, where they can hold it. False where it is neither.
    pub fn put(&self, law: &mut law::Parameters, on_body: &mut body::LearnedForce) -> bool {
        let l = &self.learned;
        let speed = if self.of.goes() == WithSpeed::No { 0.0 } else { l.speed };
        match self.of {
            of if of.is_contact() => {
                let form = LearnedLaw::form_of(of.goes());
                law.learned_law = LearnedLaw { form, shape: *l };
            }
            Dependence::Place | Dependence::PlaceAndSpeed | Dependence::PlaceAndDirection => {
                let turns = self.of.goes() == WithSpeed::Direction;
                *on_body = body::LearnedForce { of_place: Learned { speed, ..*l }, turns, ..Default::default() };
            }
            Dependence::Speed => {
                *on_body = body::LearnedForce::default();
                on_body.of_place.speed = l.speed;
                on_body.of_speed.copy_from_slice(&l.coefficients[..TERMS]);
            }
            _ => return false,
        }
        true
    }

    #[inline]
    fn is_something(&self) -> bool {
        self.of != Dependence::Nothing && self.learned.coefficients.iter().any(|c| *c != 0.0)
    }

    #[inline]
    fn is_on_body(&self) -> bool {
        self.of.origin() == Origin::Motion && self.is_something()
    }

    /// Force of what depends on the speed, N, at a depth and a velocity, m and m/s.
    pub fn with_speed(&self, x: f64, v: f64) -> f64 {
        if self.acts_on_face() {
            self.learned.with_speed_between(self.of.goes(), x, v)
        } else {
            0.0
        }
    }

    /// Power, W, that the part which depends on the speed takes out at a depth and a velocity, m and m/s, by each of its coefficients
    /// where that is 1 N. Their sum with the coefficients as factors is the power of the part.
    pub fn powers(&self, x: f64, v: f64) -> [f64; TERMS] {
        let shapes = self.shapes(&Motion { time: 0.0, x, v, travel: 0.0 });
        std::array::from_fn(|j| shapes[TERMS + j] * v)
    }

    /// Its force by each of the coefficients where that is 1 N, between the faces or on the body: their sum with the coefficients as
    /// factors is the force. All zero of what is no force.
    pub fn shapes(&self, at: &Motion) -> [f64; COEFFICIENTS] {
        match self.of {
            of if of.is_contact() => self.learned.shapes_between(of.goes(), at.x, at.v),
            Dependence::Speed => {
                let mut all = [0.0; COEFFICIENTS];
                all[..TERMS].copy_from_slice(&shapes_of_speed(self.learned.speed, at.v));
                all
            }
            of if of.origin() == Origin::Motion => self.learned.shapes_of_place(of.goes(), at.x, at.v),
            _ => [0.0; COEFFICIENTS],
        }
    }

    /// What was learned as a table of so many rows over its range: its columns with their units, and the rows. A force is given at
    /// rest, and into and out of the stop at the speed that counts as 1.
    pub fn table(&self, rows: usize) -> (Vec<&'static str>, Vec<Vec<f64>>) {
        let columns = match self.of {
            Dependence::Depth
            | Dependence::DepthAndSpeed
            | Dependence::DepthAndDirection
            | Dependence::DepthAndSpeedSquared => {
                vec!["penetration [m]", "at rest [N]", "loading [N]", "unloading [N]"]
            }
            Dependence::Place | Dependence::PlaceAndSpeed | Dependence::PlaceAndDirection => {
                vec!["position [m]", "at rest [N]", "to the stop [N]", "from the stop [N]"]
            }
            Dependence::Speed => vec!["speed [m/s]", "force [N]"],
            Dependence::Reading(Channel::Force) => vec!["force [N]", "error of the force read [N]"],
            Dependence::Reading(Channel::Acceleration) => {
                vec!["acceleration [m/s^2]", "error of the acceleration read [m/s^2]"]
            }
            Dependence::Reading(Channel::Penetration) => vec!["penetration [m]", "error of the penetration read [m]"],
            Dependence::Force => vec!["force [N]", "error of the penetration read [m]"],
            Dependence::Order => vec!["recordings before [1]", "stiffness [1]", "damping [1]"],
            _ => Vec::new(),
        };
        let moved = |x: f64, v: f64| match self.of.is_contact() {
            true => self.on_face(x, v, 0.0),
            false => self.on_body(&Motion { time: 0.0, x, v, travel: 0.0 }, 0.0),
        };
        let row = |k: usize| {
            let u = k as f64 / (rows.max(2) - 1) as f64;
            let q = u * self.learned.range;
            match self.of {
                Dependence::Nothing => Vec::new(),
                Dependence::Speed => {
                    let v = u * SPEEDS * self.learned.speed;
                    vec![v, moved(0.0, v)]
                }
                Dependence::Reading(_) | Dependence::Force => vec![q, u * self.factor(u)],
                Dependence::Order => {
                    let before = 2.0 * q;
                    let wear = self.wear(&LoadHistory::alike(before));
                    vec![before, wear.stiffness, wear.damping]
                }
                of => {
                    let x = if of.is_contact() { q } else { -q };
                    vec![x, moved(x, 0.0), moved(x, self.learned.speed), moved(x, -self.learned.speed)]
                }
            }
        };
        (columns, (0..rows).map(row).collect())
    }
}

/// Forces that were learned side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LearnedForces(pub [LearnedForce; SIDE_BY_SIDE]);

/// Forces that are learned side by side at most.
pub const SIDE_BY_SIDE: usize = 2;

impl LearnedForces {
    /// The one that depends on `of`; None where none does.
    pub fn of(&self, of: Dependence) -> Option<&LearnedForce> {
        self.0.iter().find(|f| f.of == of)
    }

    /// Takes what acts between the faces out, and puts it into the contact law.
    pub fn give_contact_to(&mut self, law: &mut law::Parameters) {
        for of in self.0.iter_mut().filter(|of| of.acts_on_face()) {
            of.put(law, &mut body::LearnedForce::default());
            *of = LearnedForce::default();
        }
    }
}

impl Part for LearnedForces {
    #[inline]
    fn acts_on_face(&self) -> bool {
        self.0.iter().any(LearnedForce::acts_on_face)
    }

    #[inline]
    fn on_face(&self, x: f64, v: f64, f: f64) -> f64 {
        self.0.iter().fold(f, |f, of| of.on_face(x, v, f))
    }

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        self.0.iter().fold(f, |f, of| of.on_body(at, f))
    }

    #[inline]
    fn needs_integration(&self) -> bool {
        self.0.iter().any(LearnedForce::needs_integration)
    }

    fn wear(&self, history: &LoadHistory) -> Wear {
        let all = self.0.iter().map(|of| of.wear(history));
        all.fold(Wear { stiffness: 1.0, damping: 1.0 }, |a, b| Wear {
            stiffness: a.stiffness * b.stiffness,
            damping: a.damping * b.damping,
        })
    }

    fn measure(&self, y: &mut [Vec<f64>; 3], at: &Sampling) {
        self.0.iter().for_each(|of| of.measure(y, at));
    }
}

impl Part for LearnedForce {
    #[inline]
    fn acts_on_face(&self) -> bool {
        self.of.is_contact() && self.is_something()
    }

    #[inline]
    fn on_face(&self, x: f64, v: f64, f: f64) -> f64 {
        if x <= 0.0 || !self.acts_on_face() {
            return f;
        }
        f + self.learned.between(self.of.goes(), x, v)
    }

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        if !self.is_on_body() {
            return f;
        }
        f + match self.of {
            Dependence::Speed => of_speed(&self.learned.coefficients[..TERMS], self.learned.speed, at.v),
            of => self.learned.of_place(of.goes(), at.x, at.v),
        }
    }

    #[inline]
    fn needs_integration(&self) -> bool {
        self.is_on_body()
    }

    fn wear(&self, history: &LoadHistory) -> Wear {
        if self.of != Dependence::Order {
            return Wear { stiffness: 1.0, damping: 1.0 };
        }
        let (stiffness, damping) = self.learned.coefficients.split_at(TERMS);
        let u = history.recordings / (history.recordings + self.learned.range);
        Wear { stiffness: series(stiffness, u).exp(), damping: series(damping, u).exp() }
    }

    fn measure(&self, y: &mut [Vec<f64>; 3], _: &Sampling) {
        let wrong = |of: &[f64]| {
            let mut factor: Vec<f64> = of.iter().map(|v| v.abs() / self.learned.range).collect();
            series_at(&self.learned.coefficients[..TERMS], &mut factor);
            of.iter().zip(factor).map(|(v, f)| v / self.learned.range * f).collect::<Vec<f64>>()
        };
        let put = |channel: &mut [f64], wrong: Vec<f64>| channel.iter_mut().zip(wrong).for_each(|(v, w)| *v += w);
        match self.of {
            Dependence::Reading(channel) => {
                let channel = &mut y[channel.index()];
                let wrong = wrong(channel);
                put(channel, wrong);
            }
            Dependence::Force => {
                let [force, _, penetration] = y;
                put(penetration, wrong(force));
            }
            _ => {}
        }
    }
}

/// Standard deviation of the coefficient of the term `j` of a series, share of the scale of force: of the constant, and of a
/// Matern process of smoothness 3/2 about it, by its spectral density.
fn spread(j: usize) -> f64 {
    let inverse = 3f64.sqrt() / LENGTH;
    let density = |j: usize| inverse * inverse / (inverse * inverse + (PI * j as f64).powi(2));
    if j == 0 {
        return SPREAD;
    }
    let all: f64 = (1..200).map(|j| density(j).powi(2)).sum();
    SPREAD * density(j) / all.sqrt()
}

/// What a coefficient of 1 stands for: N, the unit of a reading, or a factor e.
pub fn unit(of: Dependence, c: &Context) -> f64 {
    match of {
        Dependence::Reading(channel) => c.top[channel.index()],
        Dependence::Force => c.scales.depth,
        Dependence::Order => 1.0,
        _ => c.scales.force,
    }
}

/// Range of the series of that dependence by so many terms. Between the faces coarse ones reach as deep as a middling impact,
/// for all of their terms are seen by most of the recordings then; those of all terms reach as deep as the deepest.
fn range(of: Dependence, c: &Context, terms: usize) -> f64 {
    match of {
        Dependence::Reading(channel) => RANGE * c.top[channel.index()],
        Dependence::Force => RANGE * c.scales.peak,
        Dependence::Order => 0.5 * c.scales.orders,
        of if of.is_contact() && terms < TERMS => RANGE * c.scales.depth,
        of if of.is_contact() => RANGE * c.scales.deepest,
        _ => 0.5 * c.scales.speed * c.scales.length,
    }
}

/// The force of that dependence with the coefficients `t`: as many of each of its series.
fn of_coefficients(t: &[f64], c: &Context, of: Dependence) -> LearnedForce {
    let mut coefficients = [0.0; COEFFICIENTS];
    let unit = unit(of, c);
    let terms = t.len() / of.series().max(1);
    for (series, t) in coefficients.chunks_mut(TERMS).skip(of.first_series()).zip(t.chunks(terms.max(1))) {
        series.iter_mut().zip(t).for_each(|(a, t)| *a = t * unit);
    }
    LearnedForce { of, learned: Learned { coefficients, range: range(of, c, terms), speed: c.scales.speed } }
}

/// Nodes at which a series is read to be written by more terms: of the highest wave more than thirty.
const NODES: usize = 400;

/// The parameters of a force by series of all terms that is the one by series of `terms` terms with the parameters `t`: each series
/// as it is over its range, and constant beyond, by the orthogonality of the cosines.
pub fn by_all_terms(of: Dependence, c: &Context, t: &[f64], terms: usize) -> Vec<f64> {
    let ratio = range(of, c, TERMS) / range(of, c, terms);
    let at = |k: usize| (k as f64 + 0.5) / NODES as f64;
    let finer = |coarse: &[f64]| -> Vec<f64> {
        let f: Vec<f64> = (0..NODES).map(|k| series(coarse, at(k) * ratio)).collect();
        let shape = |j: usize, u: f64| if j == 0 { 1.0 } else { SQRT_2 * (PI * j as f64 * u).cos() };
        let coefficient = |j: usize| f.iter().enumerate().map(|(k, f)| f * shape(j, at(k))).sum::<f64>() / NODES as f64;
        (0..TERMS).map(coefficient).collect()
    };
    t.chunks(terms).flat_map(finer).collect()
}

/// The forms of a force of one dependence, as the first and as one beside it.
macro_rules! forms_of {
    ($of:expr) => {
        (
            $of,
            [
                |t, c, p| p.learned_forces.0[0] = of_coefficients(t, c, $of),
                |t, c, p| p.learned_forces.0[1] = of_coefficients(t, c, $of),
            ],
        )
    };
}

/// The forms of all that can be learned of a campaign whose motion is not imposed, as the force of this index of those side by
/// side, by series of so many terms, at most [`TERMS`]: what each depends on is its label. A fit starts from no force at all, which
/// is the structure that it contains.
pub fn dependences(c: &Context, index: usize, terms: usize) -> Vec<(Dependence, &'static Mechanism, Form)> {
    use Dependence::*;
    if c.scales.depth <= 0.0 || c.scales.speed <= 0.0 || c.scales.length <= 0.0 {
        return Vec::new();
    }
    let form = |(of, apply): (Dependence, [Apply; SIDE_BY_SIDE])| {
        let parameter = |i: usize| {
            let sd = spread(i % terms);
            let name = format!("coefficient {}", i + 1);
            Parameter {
                prior: Some((0.0, sd)),
                dynamic: of.origin() != Origin::Chain,
                ..parameter(&name, -50.0, 50.0, 1e-3)
            }
        };
        let parameters: Vec<Parameter> = (0..of.series() * terms).map(parameter).collect();
        let starts = vec![vec![0.0; parameters.len()]];
        let form = Form {
            label: of.words(),
            parameters,
            starts,
            linear: false,
            extends: None,
            apply: apply[index],
            describe: |_, _| Vec::new(),
        };
        (of, of.mechanism(), form)
    };
    let mut all = vec![
        form(forms_of!(Depth)),
        form(forms_of!(DepthAndSpeed)),
        form(forms_of!(DepthAndDirection)),
        form(forms_of!(DepthAndSpeedSquared)),
        form(forms_of!(DepthTimesSpeed)),
        form(forms_of!(DepthTimesDirection)),
        form(forms_of!(DepthTimesSpeedSquared)),
        form(forms_of!(Place)),
        form(forms_of!(PlaceAndSpeed)),
        form(forms_of!(PlaceAndDirection)),
        form(forms_of!(Speed)),
    ];
    let [force, acceleration, penetration] = c.has;
    if force {
        all.push(form(forms_of!(Reading(Channel::Force))));
    }
    if acceleration {
        all.push(form(forms_of!(Reading(Channel::Acceleration))));
    }
    if penetration {
        all.push(form(forms_of!(Reading(Channel::Penetration))));
        all.push(form(forms_of!(Force)));
    }
    if c.scales.orders >= 3.0 {
        all.push(form(forms_of!(Order)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_varies_is_as_likely_beforehand_as_the_constant_and_shorter_waves_are_less_likely() {
        let varies: f64 = (1..200).map(|j| spread(j).powi(2)).sum();
        assert!((varies - SPREAD * SPREAD).abs() < 1e-9);
        assert!((2..TERMS).all(|j| spread(j) < spread(j - 1)));
    }

    #[test]
    fn a_force_between_the_faces_begins_at_the_touch_and_one_on_the_body_acts_in_flight() {
        let mut force = LearnedForce {
            of: Dependence::DepthAndSpeed,
            learned: Learned { range: 2.0, speed: 4.0, ..Learned::default() },
        };
        assert!(!force.acts_on_face());
        (force.learned.coefficients[0], force.learned.coefficients[TERMS]) = (3.0, 5.0);
        assert!(force.acts_on_face() && !force.needs_integration());
        assert_eq!((force.on_face(-0.1, 1.0, 7.0), force.on_face(0.0, 1.0, 7.0)), (7.0, 7.0));
        assert!(
            (force.on_face(1.0, 2.0, 7.0) - (7.0 + (1.0 - (-0.5f64 / law::learned::RISE).exp()) * (3.0 + 5.0 * 0.5)))
                .abs()
                < 1e-12
        );
        let at = |x: f64, v: f64| Motion { time: 0.0, x, v, travel: 0.0 };
        assert_eq!(force.on_body(&at(-1.0, 2.0), 7.0), 7.0);
        force.of = Dependence::PlaceAndSpeed;
        assert!((force.on_body(&at(-1.0, 2.0), 7.0) - (7.0 - 5.5)).abs() < 1e-12);
        assert!(!force.acts_on_face() && force.needs_integration());
    }

    #[test]
    fn the_powers_of_the_coefficients_make_up_what_depends_on_the_speed_takes_out() {
        let mut force = LearnedForce {
            of: Dependence::DepthAndSpeed,
            learned: Learned { range: 2.0, speed: 4.0, ..Learned::default() },
        };
        (force.learned.coefficients[0], force.learned.coefficients[TERMS], force.learned.coefficients[TERMS + 3]) =
            (3.0, 5.0, -2.0);
        for (x, v) in [(0.5, 2.0), (1.5, -1.0)] {
            let powers = force.powers(x, v);
            let want = force.with_speed(x, v) * v;
            assert!((5.0 * powers[0] - 2.0 * powers[3] - want).abs() < 1e-12 * want.abs());
            assert!(powers[0] > 0.0, "a constant factor of the speed takes energy out on the way in and back");
        }
    }

    #[test]
    fn an_error_of_a_reading_moves_that_reading_alone() {
        let mut force = LearnedForce { of: Dependence::Force, learned: Learned { range: 10.0, ..Learned::default() } };
        force.learned.coefficients[0] = 1e-3;
        let mut y = [vec![5.0, -5.0], vec![1.0, 1.0], vec![0.0, 0.0]];
        force.measure(&mut y, &Sampling { dt: 1.0, before: 0.0 });
        assert_eq!(y, [vec![5.0, -5.0], vec![1.0, 1.0], vec![5e-4, -5e-4]]);
    }

    #[test]
    fn a_series_by_all_terms_is_the_one_by_few() {
        let mut c = crate::catalogue::plain(record::Kind::DropTest);
        c.scales.deepest = 1.4 * c.scales.depth;
        let few: Vec<f64> = (0..24).map(|j| (1.7 * j as f64).sin() / (1 + j % 12) as f64).collect();
        for (of, within) in [(Dependence::DepthAndSpeed, 0.03), (Dependence::PlaceAndSpeed, 1e-4)] {
            let coarse = of_coefficients(&few, &c, of).learned;
            let all = of_coefficients(&by_all_terms(of, &c, &few, 12), &c, of).learned;
            let largest =
                (0..50).map(|k| series(&coarse.coefficients[..TERMS], k as f64 / 50.0).abs()).fold(0.0, f64::max);
            for k in 0..50 {
                let x = 1.2 * coarse.range * k as f64 / 50.0;
                for from in [0, TERMS] {
                    let at = |l: &Learned| series(&l.coefficients[from..from + TERMS], x / l.range);
                    assert!((at(&coarse) - at(&all)).abs() < within * largest, "{of:?} {x}");
                }
            }
        }
    }

    #[test]
    fn what_goes_into_an_fmu_does_there_what_it_did_here() {
        use Dependence::*;
        let mut learned = Learned { range: 2e-3, speed: 0.7, ..Learned::default() };
        (learned.coefficients[0], learned.coefficients[3], learned.coefficients[TERMS + 1]) = (5.0, -2.0, 1.5);
        for of in
            [Depth, DepthAndSpeed, DepthAndDirection, DepthAndSpeedSquared, Place, PlaceAndSpeed, Speed, Force, Order]
        {
            let force = LearnedForce { of, learned };
            let (mut law, mut on_body) = (law::Parameters::default(), body::LearnedForce::default());
            let held = force.put(&mut law, &mut on_body);
            assert_eq!(held, ![Force, Order].contains(&of));
            for (x, v) in [(1e-3, 0.4), (-1e-3, -0.3), (3e-3, -1.8), (-5e-3, 0.0)] {
                let between = if law.learned_law.acts() { law.learned_law.force(x, v) } else { 0.0 };
                assert_eq!(between, force.on_face(x, v, 0.0), "{of:?}");
                let at = Motion { time: 0.0, x, v, travel: 0.0 };
                let (there, here) = (on_body.on(x, v, 0.0), force.on_body(&at, 0.0));
                assert!((there - here).abs() < 1e-12, "{of:?}: {there} {here}");
            }
        }
    }
}
