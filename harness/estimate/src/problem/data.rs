//! What an estimation starts from: recordings, their noise and scales, and the nuisances each carries.

use crate::budget::Budget;
pub use mechanisms::mechanism::{Parameter, Scales};
use plant::machine::{Machine, Reads};
use plant::noise::Noise;
use plant::simulate::{Local, Setup, COARSE};
use record::{Channel, Kind, Place};

/// One recording ready for estimation.
#[derive(Clone, Debug)]
pub struct Record {
    pub setup: Setup,
    pub file: String,
    /// Times of all samples, s, where the setup's are a window of them or means; see [`Data::whole`].
    pub whole: Option<Vec<f64>>,
    pub level: usize,
    /// SI readings by channel.
    pub y: [Option<Vec<f64>>; 3],
    /// What the force read holds beyond that on an imposed path, N, because the penetration read lies off the smoothed one:
    /// its slope times that distance. Empty where no path is imposed.
    pub off_path: Vec<f64>,
    /// Samples beside a corner of an imposed path, increasing: the rate may be that of either side, and their force does not
    /// count.
    pub beside_corners: Vec<usize>,
    /// Weight of each sample (noise sigma over local sigma; 0: left out), by channel.
    pub weight: [Vec<f64>; 3],
    /// Speed and its std, m/s; at the first sample where `at_first`.
    pub speed: Option<(f64, f64)>,
    pub at_first: bool,
    /// Instant of touch (release for a contactor) guessed from the data, s.
    pub start: f64,
}

impl Record {
    /// What a channel's readings leave of predictions `y`; None where it was not recorded.
    pub fn left_of(&self, c: Channel, y: &[f64]) -> Option<Vec<f64>> {
        let read = self.y[c.index()].as_ref()?;
        let left = read.iter().zip(y).map(|(read, y)| read - y);
        Some(match self.off_path(c) {
            [] => left.collect(),
            off => left.zip(off).map(|(left, off)| left - off).collect(),
        })
    }

    /// What the samples of a channel hold because a path read lies off the smoothed one; empty where nothing.
    pub(super) fn off_path(&self, c: Channel) -> &[f64] {
        if c == Channel::Force {
            &self.off_path
        } else {
            &[]
        }
    }
}

/// A campaign ready for estimation.
#[derive(Clone, Debug)]
pub struct Data {
    pub kind: Kind,
    pub mass: f64,
    pub records: Vec<Record>,
    pub noise: [Noise; 3],
    pub scales: Scales,
    /// Range of each channel over the campaign.
    pub range: [f64; 3],
    /// Standard deviation of ln stiffness between repeats.
    pub repeat_scatter: f64,
    /// Standard deviation of the rise of the free line over the range of an imposed penetration, share of the range of force.
    pub tilt_share: f64,
    /// When every fit of them has to end.
    pub budget: Budget,
}

/// Name of the parameter ln F_ref, the force at the reference depth: what scales every recording's stiffness.
pub const STIFFNESS_SCALE: &str = "ln F_ref";

/// Names the nuisances of a recording, in the order of its vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nuisance {
    /// Instant of touch or of release, s.
    Start,
    /// Speed at touch, m/s.
    Speed,
    /// ln of the factor on the contact's stiffness.
    Stiffness,
    /// Zero of a channel, in its SI unit.
    Zero(Channel),
    /// Reading of an imposed penetration at which the contact begins, m.
    Offset,
    /// Slope of the force's free line over an imposed penetration, N/m: the instrument's own stiffness, or light that
    /// interferes with its beam.
    Tilt,
}

/// Standard deviation of the zero of a displacement sensor beside a stop, m.
const ZERO_OF_WAY: f64 = 5e-6;
/// Share of the range of an imposed penetration by which the point of touch is uncertain: who sets it by eye, or where the
/// force rises out of its noise, sets it late, and a pull before the touch hides it.
const TOUCH_SHARE: f64 = 0.1;
/// Share of the range of force that the free line of an instrument rises by over the range of penetration.
pub(crate) const TILT_SHARE: f64 = 0.003;

impl Data {
    /// The nuisances of every recording of this campaign.
    pub fn nuisances(&self) -> Vec<Nuisance> {
        let mut v = match self.kind {
            Kind::DropTest => vec![Nuisance::Start, Nuisance::Speed, Nuisance::Stiffness],
            Kind::ContactorOpening => vec![Nuisance::Start, Nuisance::Stiffness],
            Kind::System if self.touches() => vec![Nuisance::Start, Nuisance::Stiffness],
            Kind::System => vec![Nuisance::Start],
            Kind::Indentation => vec![Nuisance::Stiffness, Nuisance::Offset],
        };
        for c in Channel::ALL {
            if self.has(c) && !(self.kind == Kind::Indentation && c == Channel::Penetration) {
                v.push(Nuisance::Zero(c));
            }
        }
        if self.kind == Kind::Indentation && self.has(Channel::Force) {
            v.push(Nuisance::Tilt);
        }
        v
    }

    /// What simulates its recordings in place of a rig of ours.
    pub fn machine(&self) -> Option<&dyn Machine> {
        let seat = self.records.first()?.setup.machine.as_ref()?;
        Some(&*seat.machine)
    }

    /// Whether force and acceleration are of one body: always of a rig of ours; of FMUs where both are known to be of one bond.
    pub fn are_of_one_body(&self) -> bool {
        self.machine().is_none_or(|m| {
            let [force, acceleration, _] = m.facts().channels;
            matches!((force, acceleration), (Some(Reads::Bond(a)), Some(Reads::Bond(b))) if a == b)
        })
    }

    /// Whether a force can be tried on what moves: always of a rig of ours.
    pub fn takes_force(&self) -> bool {
        self.machine().is_none_or(|m| m.facts().takes_force())
    }

    /// Whether a contact of FMUs takes a force.
    fn touches(&self) -> bool {
        self.machine().is_some_and(|m| m.facts().bonds.iter().any(|b| b.takes_force && b.law.is_some()))
    }

    /// The levels of its recordings, in order, each once.
    pub fn levels(&self) -> Vec<usize> {
        let mut levels: Vec<usize> = self.records.iter().map(|r| r.level).collect();
        levels.sort_unstable();
        levels.dedup();
        levels
    }

    /// Whether any recording has the channel.
    pub fn has(&self, c: Channel) -> bool {
        self.records.iter().any(|r| r.y[c.index()].is_some())
    }

    /// Channels that the fit compares, in order.
    pub fn compared(&self, r: usize) -> impl Iterator<Item = Channel> + '_ {
        let indentation = self.kind == Kind::Indentation;
        Channel::ALL
            .into_iter()
            .filter(move |c| self.records[r].y[c.index()].is_some() && !(indentation && *c == Channel::Penetration))
    }

    /// (mean, std) of a nuisance of a recording, where it has one.
    pub fn prior(&self, r: usize, n: Nuisance) -> Option<(f64, f64)> {
        match n {
            Nuisance::Start => None,
            Nuisance::Speed => self.records[r].speed.filter(|_| !self.records[r].at_first),
            Nuisance::Stiffness => Some((0.0, self.repeat_scatter)),
            Nuisance::Zero(Channel::Penetration) => Some((0.0, self.zero_of_way())),
            Nuisance::Zero(c) => Some((0.0, 0.0012 * self.range[c.index()])),
            Nuisance::Offset => Some((0.0, TOUCH_SHARE * self.range[2])),
            Nuisance::Tilt => Some((0.0, self.tilt_scale())),
        }
    }

    /// First guess of the nuisances.
    pub fn local_start(&self, r: usize) -> Vec<f64> {
        let rec = &self.records[r];
        self.nuisances()
            .into_iter()
            .map(|n| match n {
                Nuisance::Start => rec.start,
                Nuisance::Speed => rec.speed.map_or(self.scales.speed, |s| s.0),
                _ => 0.0,
            })
            .collect()
    }

    /// Standard deviation of the zero of a penetration that is not imposed, m: it is set no better than a reading is.
    fn zero_of_way(&self) -> f64 {
        let noise = self.noise[Channel::Penetration.index()].marginal();
        ZERO_OF_WAY.max(noise).min(0.05 * self.range[2])
    }

    /// Slope of the free line that is usual, N/m.
    fn tilt_scale(&self) -> f64 {
        self.tilt_share * self.range[0] / self.range[2]
    }

    /// Change of a nuisance by which its sensitivity is worked out.
    pub fn local_step(&self, n: Nuisance) -> f64 {
        match n {
            Nuisance::Start => 2e-3 * self.scales.duration,
            Nuisance::Speed => 1e-3 * self.scales.speed,
            Nuisance::Stiffness => 2e-3,
            Nuisance::Zero(c) => 1e-3 * self.range[c.index()],
            Nuisance::Offset => 1e-3 * self.scales.depth,
            Nuisance::Tilt => self.tilt_scale(),
        }
    }

    /// The same with coarser integration, for fits that have only to come near. Bounces grow what a step leaves: there
    /// it stays as it is.
    pub fn coarse(&self) -> Data {
        let mut d = self.clone();
        if !self.kind.starts_driven() {
            d.records.iter_mut().for_each(|r| r.setup.control.tolerance = COARSE);
        }
        d
    }

    /// The same with the speeds meant at the first sample where they were meant at touch, and the other way round.
    pub fn with_speeds_elsewhere(&self) -> Data {
        let mut other = self.clone();
        other.records.iter_mut().for_each(|r| r.at_first = !r.at_first);
        other
    }

    /// Nuisances with every recording as stiff as the rest.
    pub fn without_scatter(&self, locals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut locals = locals.to_vec();
        if let Some(i) = self.nuisances().iter().position(|n| *n == Nuisance::Stiffness) {
            locals.iter_mut().for_each(|l| l[i] = 0.0);
        }
        locals
    }

    /// Keeps only the recordings whose index `keep` accepts.
    pub fn subset(&self, keep: impl Fn(usize) -> bool) -> Data {
        let mut d = self.clone();
        let mut i = 0;
        d.records.retain(|_| {
            i += 1;
            keep(i - 1)
        });
        d
    }

    /// `e` of a channel of recording `r`, weighted and whitened by its noise.
    pub fn whitened(&self, r: usize, c: Channel, e: &[f64]) -> Vec<f64> {
        let i = c.index();
        let weighted: Vec<f64> = e.iter().zip(&self.records[r].weight[i]).map(|(e, w)| e * w).collect();
        let mut out = vec![0.0; e.len()];
        self.noise[i].whiten(&weighted, &mut out);
        out
    }

    /// One recording of the force alone, of a body of `mass` kg, in white noise; scales of its setup and of `force` N.
    pub fn of_force(setup: Setup, mass: f64, force: f64, y: Vec<f64>) -> Data {
        let (n, dt) = (y.len(), setup.time[1] - setup.time[0]);
        let scales = Scales {
            force,
            depth: setup.depth,
            speed: setup.speed,
            duration: setup.duration,
            mass,
            length: n as f64 * dt,
            dt,
            x_ref: 0.6 * setup.depth,
            v_ref: setup.speed,
            orders: 1.0,
            peak: force,
            deepest: setup.depth,
        };
        let (kind, depth) = (setup.kind, setup.depth);
        let record = Record {
            setup,
            file: "r01.csv".into(),
            whole: None,
            level: 0,
            y: [Some(y), None, None],
            off_path: Vec::new(),
            beside_corners: Vec::new(),
            weight: [vec![1.0; n], vec![1.0; n], vec![1.0; n]],
            speed: None,
            at_first: false,
            start: 0.0,
        };
        Data {
            kind,
            mass,
            records: vec![record],
            noise: [Noise::white(1.0); 3],
            scales,
            range: [force, 0.0, depth],
            repeat_scatter: 0.006,
            tilt_share: TILT_SHARE,
            budget: Budget::default(),
        }
    }

    /// To predict every sample of the recordings, judged or not: the same with the setups' times in place of those
    /// judged. None where all are judged.
    pub fn whole(&self) -> Option<Data> {
        if self.records.iter().all(|r| r.whole.is_none()) {
            return None;
        }
        let mut d = self.clone();
        for r in &mut d.records {
            let Some(whole) = r.whole.clone() else { continue };
            for imposed in [&mut r.setup.imposed, &mut r.setup.imposed_rate] {
                if !imposed.is_empty() {
                    *imposed = whole.iter().map(|t| Place::within(&r.setup.time, *t).of(imposed)).collect();
                }
            }
            r.setup.time = whole;
        }
        Some(d)
    }

    /// Samples compared in all.
    pub fn samples(&self) -> usize {
        (0..self.records.len()).map(|r| self.compared(r).map(|_| self.records[r].setup.time.len()).sum::<usize>()).sum()
    }
}

pub(super) fn local_of(nuisances: &[Nuisance], v: &[f64]) -> Local {
    let mut l = Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 };
    for (n, x) in nuisances.iter().zip(v) {
        match n {
            Nuisance::Start => l.start = *x,
            Nuisance::Speed => l.speed = *x,
            Nuisance::Stiffness => l.stiffness = *x,
            Nuisance::Offset => l.offset = *x,
            Nuisance::Zero(_) | Nuisance::Tilt => {}
        }
    }
    l
}
