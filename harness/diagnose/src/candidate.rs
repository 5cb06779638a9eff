//! A make-up with its fit: what it gains, and how much its residual still wanders.

use super::search::{MakeUp, Search, Term, GAIN};
use estimate::problem::{Fit, Options, Point, Problem};
use record::{Channel, Kind};

/// Gain in chi^2, beyond one parameter and over the wander of the residual, from which a misfit counts as detected.
/// Held to under 1 % false alarms with the maximum over all candidates.
pub const DETECT: f64 = 45.0;
/// The same for a gain beyond a calibration's tolerance, where the prior sets the scale and nothing else inflates it.
pub const DETECT_TOLERANCE: f64 = 11.0;
/// Standard deviations of a gain's tolerance within which it is none beyond it.
const WITHIN: f64 = 2.0;
/// Penalty of one more parameter, in chi^2.
pub const PENALTY: f64 = 4.0;
/// Wander up to which a residual counts as noise.
pub const WHITE: f64 = 1.25;
/// Iterations within which a fit that is taken on has converged.
const CONVERGED: usize = 200;
/// Samples over which the residual's wander is judged.
const BLOCK: usize = 24;

/// A candidate with its fit.
#[derive(Clone)]
pub struct Candidate {
    pub make_up: MakeUp,
    pub fit: Fit,
}

impl Candidate {
    /// Names in the make-up.
    pub fn names(&self) -> Vec<&'static str> {
        self.make_up.terms.iter().map(|t| t.mechanism.name).collect()
    }
    /// Name of the last effect, empty where there is none.
    pub fn added(&self) -> &'static str {
        self.make_up.terms.last().map_or("", |t| t.mechanism.name)
    }
    /// Names and forms in the make-up.
    pub fn forms(&self) -> Vec<(&'static str, &'static str)> {
        self.make_up.terms.iter().map(|t| (t.mechanism.name, t.form.label)).collect()
    }
    /// Whether its last effect is a calibration beyond its tolerance.
    pub fn calibrates(&self) -> bool {
        self.make_up.terms.last().is_some_and(|t| t.mechanism.is_calibration() && t.form.parameters.len() == 1)
    }
    pub fn parameters(&self) -> f64 {
        self.make_up.terms.iter().map(|t| t.form.parameters.len() as f64).sum()
    }
    /// chi^2 with its penalty.
    pub fn cost(&self) -> f64 {
        // damping with a power of depth next to zero is viscous damping
        let theta = &self.fit.point.theta;
        let viscous_twin = self.make_up.terms.iter().any(|t| match t.form.label {
            "Kuwabara-Kono" => (theta[1] - 1.0).abs() < 0.2,
            "half power" => (theta[1] - 0.5).abs() < 0.2,
            _ => false,
        });
        self.fit.point.chi2 + PENALTY * self.parameters() + if viscous_twin { PENALTY } else { 0.0 }
    }
    /// Fall of chi^2 from `from`, less the penalty of every parameter beyond one.
    pub fn gain(&self, from: &Candidate) -> f64 {
        let more = (self.parameters() - from.parameters() - 1.0).max(0.0);
        from.fit.point.chi2 - self.fit.point.chi2 - more * PENALTY
    }
    /// The gain from `from` beside what counts as detected, where the residual wanders by `wander`.
    pub fn significance(&self, from: &Candidate, wander: f64) -> f64 {
        if self.calibrates() {
            // what tolerances could have been all along is none beyond them
            let beyond = self.fit.point.theta.last().is_some_and(|g| g.abs() > WITHIN * GAIN);
            if beyond {
                self.gain(from) / DETECT_TOLERANCE
            } else {
                0.0
            }
        } else {
            self.gain(from) / wander.max(1.0) / DETECT
        }
    }
}

/// Most that a single block of a residual counts for its wander: one wild block shall not decide.
const WILDEST: f64 = 30.0;

/// Wander of one block of a whitened residual, 1 for white noise, `most` at most.
fn block_wander(w: &[f64], most: f64) -> f64 {
    let m: f64 = w.iter().sum();
    (m * m / w.len() as f64).min(most)
}

/// How much the whitened residual wanders over blocks, relative to white noise.
pub fn wander(problem: &Problem<'_>, point: &Point) -> f64 {
    wander_up_to(problem, point, WILDEST)
}

/// The same where wild blocks count up to `most`: infinity tells how much wider the noise would have to be to hold
/// what the model leaves.
pub fn wander_up_to(problem: &Problem<'_>, point: &Point, most: f64) -> f64 {
    let Some(left) = problem.residuals(point) else { return 1.0 };
    let over = |block: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for (record, (_, residual)) in problem.data.records.iter().zip(&left) {
            for ch in residual.chunks(record.setup.time.len()) {
                for w in ch.chunks_exact(block) {
                    sum += block_wander(w, most);
                    n += 1.0;
                }
            }
        }
        if n < 10.0 {
            1.0
        } else {
            sum / n
        }
    };
    over(BLOCK).max(over(3 * BLOCK))
}

/// Wander of a force or acceleration in contact that no noise has, and how many times that in flight it has to be.
const RESTLESS: f64 = 3.0;
const RESTLESS_RATIO: f64 = 2.5;
/// Blocks in contact from which that is judged.
const RESTLESS_BLOCKS: f64 = 10.0;

/// Mean square of what repeats differ by in stiffness, over that of repeat scatter, which no scatter has; and the degrees
/// of freedom from which it is judged.
const SWING: f64 = 12.0;
const SWING_FREEDOM: f64 = 2.0;
/// Share of that square which may stay where what the recordings differ by has been found.
const SWING_LEFT: f64 = 0.2;

impl Search<'_> {
    /// Root mean square by which ln stiffness differs between recordings of one level, where that is more than repeats
    /// scatter by: something between the recordings moved it.
    pub fn swing(&self, c: &Candidate) -> Option<f64> {
        let model = self.model(&c.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let of = |level: usize| -> Vec<f64> {
            let own = self.data.records.iter().zip(&c.fit.point.locals).filter(|(r, _)| r.level == level);
            own.map(|(_, l)| problem.local(l).stiffness).collect()
        };
        let levels = self.data.records.iter().map(|r| r.level).max().unwrap_or(0);
        let (sum, freedom) = (0..=levels).map(of).filter(|l| l.len() > 1).fold((0.0, 0.0), |(sum, freedom), l| {
            let mean = l.iter().sum::<f64>() / l.len() as f64;
            (sum + l.iter().map(|s| (s - mean).powi(2)).sum::<f64>(), freedom + l.len() as f64 - 1.0)
        });
        let (square, most) = (sum / freedom, SWING * self.data.repeat_scatter.powi(2));
        let beyond = freedom >= SWING_FREEDOM
            && square > most
            // noise that wanders moves what each recording is fitted to, too
            && square > most * wander(&problem, &c.fit.point);
        beyond.then(|| square.sqrt())
    }

    /// The swing of `c` where it is still a good share of what it was in `from`: a course with order that is not quite
    /// the one found leaves a little.
    pub fn swing_left(&self, c: &Candidate, from: Option<f64>) -> Option<f64> {
        self.swing(c).filter(|s| from.is_none_or(|f| s * s > SWING_LEFT * f * f))
    }

    /// Whether force or acceleration wander while the faces touch and not while they do not: noise knows nothing of the
    /// contact, what does is physics, whatever its name.
    pub fn restless_contact(&self, c: &Candidate) -> bool {
        if self.data.kind == Kind::Indentation {
            return false;
        }
        let model = self.model(&c.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let Some(left) = problem.residuals(&c.fit.point) else { return false };
        // by channel, in flight and in contact: sum over blocks, and their number
        let mut sums = [[(0.0, 0.0); 2]; 3];
        for (r, (trace, residual)) in left.iter().enumerate() {
            let n = self.data.records[r].setup.time.len();
            for (channel, e) in self.data.compared(r).zip(residual.chunks(n)) {
                for (w, f) in e.chunks_exact(BLOCK).zip(trace.force.chunks_exact(BLOCK)) {
                    let touching = usize::from(4 * f.iter().filter(|f| f.abs() > 0.0).count() > BLOCK);
                    let s = &mut sums[channel.index()][touching];
                    s.0 += block_wander(w, WILDEST);
                    s.1 += 1.0;
                }
            }
        }
        [Channel::Force, Channel::Acceleration].iter().any(|c| {
            let [(flight, n), (contact, m)] = sums[c.index()];
            m >= RESTLESS_BLOCKS
                && n >= RESTLESS_BLOCKS
                && contact / m > RESTLESS
                && contact / m > RESTLESS_RATIO * (flight / n)
        })
    }

    /// Wander of a candidate's residual.
    pub fn wander_of(&self, c: &Candidate) -> f64 {
        let m = self.model(&c.make_up, 1.0, 1.0, 0.0);
        wander(&Problem::new(self.data, &m), &c.fit.point)
    }

    /// `from` with one more term, fitted from `start`.
    pub fn fitted(&self, from: &Candidate, term: Term, start: Point, options: &Options) -> Candidate {
        let make_up = from.make_up.with(term);
        let model = self.model(&make_up, 1.0, 1.0, 0.0);
        let fit = Problem::new(self.data, &model).fit(start, options);
        Candidate { make_up, fit }
    }

    /// `c` fitted on from where it stands, until it has converged.
    pub fn taken_on(&self, c: &Candidate) -> Candidate {
        let model = self.model(&c.make_up, 1.0, 1.0, 0.0);
        let options = Options { iterations: CONVERGED, ..Options::default() };
        Candidate {
            make_up: c.make_up.clone(),
            fit: Problem::new(self.data, &model).fit(c.fit.point.clone(), &options),
        }
    }

    /// `from` with one more term, and its fit.
    pub fn candidate(&self, from: &Candidate, t: Term, fit: Fit) -> Candidate {
        Candidate { make_up: from.make_up.with(t), fit }
    }
}
