//! Names the missing physics: base fit, every mechanism fitted jointly with it, forward selection with swaps.

use estimate::prepare::Guess;
use estimate::problem::{Data, Fit, Model, Options, Parameter, Point, Problem, STIFFNESS_SCALE};
use mechanisms::mechanism::{Context, Form, Mechanism};
use mechanisms::physics::{Physics, GRAVITY};
use mechanisms::ALL;
use rayon::prelude::*;
use record::{largest, Campaign, Channel, Kind};

/// Relative standard deviation of a calibrated gain of force or acceleration.
pub const GAIN: f64 = 0.007;

/// A mechanism in one of its forms.
#[derive(Clone)]
pub struct Term {
    pub mechanism: &'static Mechanism,
    pub form: Form,
}

/// A model's make-up: the base and the terms added to it.
#[derive(Clone, Default)]
pub struct MakeUp {
    pub terms: Vec<Term>,
}

impl MakeUp {
    /// This make-up with one more term.
    pub fn with(&self, term: Term) -> MakeUp {
        let mut terms = self.terms.clone();
        terms.push(term);
        MakeUp { terms }
    }
}

/// Samples in a row at one reading that make a flat top.
const FLAT: usize = 4;
/// Standard deviations beyond which a calibration's tolerance is no tolerance.
const WIDEST: f64 = 6.0;

/// Everything the search holds fixed.
pub struct Search<'a> {
    pub data: &'a Data,
    pub context: Context,
    pub gravity: bool,
    pub hysteresis: bool,
    /// Mechanisms the simulation holds already, beyond gravity and hysteresis damping.
    pub given: Vec<Term>,
}

impl<'a> Search<'a> {
    /// Of a campaign and its prepared data.
    pub fn new(campaign: &Campaign, data: &'a Data) -> Search<'a> {
        let terms = campaign.simulation.terms.clone();
        let mut top = [0.0f64; 3];
        for r in &data.records {
            for (t, y) in top.iter_mut().zip(&r.y) {
                if let Some(y) = y {
                    *t = t.max(largest(y));
                }
            }
        }
        let mut context = Context {
            kind: data.kind,
            has: [data.has(Channel::Force), data.has(Channel::Acceleration), data.has(Channel::Penetration)],
            scales: data.scales,
            terms: Vec::new(),
            top,
            flat: flat_top(data, top),
            ring: if data.kind == Kind::Indentation { None } else { super::ring::line(data, Channel::Force) },
        };
        let given = ALL
            .iter()
            .filter(|m| {
                terms.iter().any(|t| t == m.name)
                    && m.name != "gravity"
                    && m.name != "hysteresis_damping"
                    && !(m.name == "return_spring" && data.kind == Kind::ContactorOpening)
            })
            .filter_map(|m| m.forms(&context).into_iter().next().map(|form| Term { mechanism: m, form }))
            .collect();
        context.terms = terms.clone();
        Search {
            data,
            context,
            gravity: terms.iter().any(|t| t == "gravity") && data.kind == Kind::DropTest,
            hysteresis: terms.iter().any(|t| t == "hysteresis_damping"),
            given,
        }
    }

    /// The model of a make-up, started from the campaign's own law or a guess.
    pub fn model(&self, make_up: &MakeUp, k: f64, p: f64, mu: f64) -> Model<'_> {
        let s = self.data.scales;
        let base = |name: &str, start, lower, upper, step| Parameter {
            name: name.into(),
            start,
            lower,
            upper,
            step,
            prior: None,
            dynamic: true,
        };
        let mut ps =
            vec![base(STIFFNESS_SCALE, (k * s.x_ref.powf(p)).ln(), -60.0, 60.0, 2e-3), base("p", p, 0.8, 4.5, 1e-3)];
        let hysteresis = self.hysteresis;
        if hysteresis {
            ps.push(base("damping ratio", mu * s.v_ref / k, 0.0, 20.0, 1e-3));
        }
        let gravity = self.gravity;
        let mass = self.data.mass;
        let tolerance = |name: &str, sd: f64, dynamic: bool| Parameter {
            name: name.into(),
            start: 0.0,
            lower: -WIDEST * sd,
            upper: WIDEST * sd,
            step: 1e-3,
            prior: Some((0.0, sd)),
            dynamic,
        };
        let mut gains = Vec::new();
        let with_mass = self.data.kind != Kind::Indentation;
        if with_mass {
            for (c, sd) in [(Channel::Force, GAIN), (Channel::Acceleration, GAIN), (Channel::Penetration, 0.003)] {
                if self.data.has(c) {
                    gains.push((ps.len(), c.index()));
                    ps.push(tolerance(&format!("ln gain {}", c.name()), sd, false));
                }
            }
        }
        let at_mass = ps.len();
        if with_mass {
            ps.push(tolerance("ln mass", 0.002, true));
        }
        let mut spans = Vec::new();
        let all: Vec<Term> = self.given.iter().chain(&make_up.terms).cloned().collect();
        for t in &all {
            spans.push(ps.len());
            for (i, q) in t.form.parameters.iter().enumerate() {
                let mut q = q.clone();
                // of a form that extends another, the starts are those of the further parameters
                let lead = t.form.parameters.len() - t.form.starts[0].len();
                q.start = if i >= lead { t.form.starts[0][i - lead] } else { q.start };
                q.name = format!("{}: {}", t.mechanism.name, q.name);
                ps.push(q);
            }
        }
        let context = &self.context;
        Model {
            parameters: ps,
            apply: Box::new(move |th: &[f64], p: &mut Physics| {
                p.law.elastic.exponent = th[1];
                p.law.elastic.stiffness = (th[0] - th[1] * s.x_ref.ln()).exp();
                p.law.hysteresis_damping.coefficient =
                    if hysteresis { th[2] * p.law.elastic.stiffness / s.v_ref } else { 0.0 };
                p.mass = if with_mass { mass * th[at_mass].exp() } else { mass };
                p.gravity = if gravity { GRAVITY } else { 0.0 };
                for (i, c) in &gains {
                    p.gain[*c] = th[*i].exp();
                }
                for (t, at) in all.iter().zip(&spans) {
                    t.form.apply(&th[*at..*at + t.form.parameters.len()], context, p);
                }
            }),
        }
    }

    /// Fits the base from the campaign's law and from the guess; the better one.
    pub fn base(&self, campaign: &Campaign, guess: &Guess) -> Fit {
        let s = &campaign.simulation;
        let mut starts = Vec::new();
        if let (Some(k), Some(p)) = (s.k, s.p) {
            starts.push((k, p, s.mu_d.unwrap_or(0.0)));
        }
        let v = self.data.scales.v_ref;
        starts.push((guess.k, guess.p, 0.15 * guess.k / v));
        if s.k.is_none() {
            // the same force at 0.6 depth with other powers
            for p in [1.0, 1.5, 2.2, 3.0] {
                let k = guess.k * self.data.scales.x_ref.powf(guess.p - p);
                starts.push((k, p, 0.3 * k / v));
            }
        }
        let fits: Vec<Fit> = starts
            .into_par_iter()
            .map(|(k, p, mu)| {
                let m = self.model(&MakeUp::default(), k, p, mu);
                let pr = Problem::new(self.data, &m);
                let start = pr.start();
                pr.fit(start, &Options { iterations: 40, ..Options::default() })
            })
            .collect();
        fits.into_iter().min_by(|a, b| a.point.chi2.total_cmp(&b.point.chi2)).expect("there is a start")
    }

    /// Weights of an imposed penetration: where the force rises steeply the scatter of the penetration
    /// counts as well (effective variance: Orear 1982).
    pub fn effective_weights(&self, point: &Point) -> Vec<Vec<f64>> {
        let model = self.model(&MakeUp::default(), 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let sx = self.data.noise[2].marginal();
        let sf = self.data.noise[0].marginal();
        (0..self.data.records.len())
            .map(|r| {
                let (t, _) = problem.predict(&point.theta, r, &point.locals[r]);
                let n = t.force.len();
                (0..n)
                    .map(|i| {
                        let (a, b) = (i.saturating_sub(6), (i + 6).min(n - 1));
                        let dx = (t.position[b] - t.position[a]).abs();
                        let slope = if dx > 2.0 * sx { (t.force[b] - t.force[a]).abs() / dx } else { 0.0 };
                        let own = if t.position[i] > 0.0 {
                            point.theta[1] * t.force[i].max(0.0) / t.position[i].max(3.0 * sx)
                        } else {
                            0.0
                        };
                        sf / (sf * sf + (slope.max(own) * sx).powi(2)).sqrt()
                    })
                    .collect()
            })
            .collect()
    }

    /// What the base at `point` leaves of the readings, by recording and channel.
    pub fn left(&self, point: &Point) -> Vec<[Option<Vec<f64>>; 3]> {
        let model = self.model(&MakeUp::default(), 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let records = self.data.records.iter().enumerate();
        records
            .map(|(r, rec)| {
                let (_, y) = problem.predict(&point.theta, r, &point.locals[r]);
                let less = |i: usize| -> Option<Vec<f64>> {
                    let read = rec.y[i].as_ref()?;
                    Some(read.iter().zip(&y[i]).map(|(a, b)| a - b).collect())
                };
                [less(0), less(1), less(2)]
            })
            .collect()
    }

    /// Samples that stand alone far outside the noise, by recording and channel: (recording, channel, sample).
    pub fn spikes(&self, point: &Point) -> Vec<(usize, usize, usize)> {
        let model = self.model(&MakeUp::default(), 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let mut out = Vec::new();
        for (r, rec) in self.data.records.iter().enumerate() {
            let (_, y) = problem.predict(&point.theta, r, &point.locals[r]);
            for c in self.data.compared(r) {
                let i = c.index();
                let Some(read) = &rec.y[i] else { continue };
                let e: Vec<f64> = read.iter().zip(&y[i]).zip(&rec.weight[i]).map(|((a, b), w)| (a - b) * w).collect();
                let s = self.data.noise[i].marginal();
                for k in 0..e.len() {
                    let mut near: Vec<f64> = (k.saturating_sub(4)..(k + 5).min(e.len()))
                        .filter(|j| j.abs_diff(k) > 1)
                        .map(|j| e[j])
                        .collect();
                    near.sort_by(f64::total_cmp);
                    let middle = near[near.len() / 2];
                    let spread = near[near.len() - 1] - near[0];
                    if (e[k] - middle).abs() > 5.0 * s && (e[k] - middle).abs() > 1.5 * spread {
                        out.push((r, i, k));
                    }
                }
            }
        }
        out
    }

    /// A make-up and its parameters (of `model`) without its term `i`.
    pub fn drop_term(&self, model: &Model<'_>, make_up: &MakeUp, theta: &[f64], i: usize) -> (MakeUp, Vec<f64>) {
        let (mut rest, mut theta) = (make_up.clone(), theta.to_vec());
        let before: usize = rest.terms[..i].iter().map(|t| t.form.parameters.len()).sum();
        let at = self.first_term(model, make_up) + before;
        let gone = rest.terms.remove(i);
        theta.drain(at..at + gone.form.parameters.len());
        (rest, theta)
    }

    /// Index of the first parameter of the make-up's terms.
    pub fn first_term(&self, model: &Model<'_>, make_up: &MakeUp) -> usize {
        model.parameters.len() - make_up.terms.iter().map(|t| t.form.parameters.len()).sum::<usize>()
    }

    /// All terms that could be added, in forms that stand for themselves.
    pub fn candidates(&self) -> Vec<Term> {
        self.terms().into_iter().filter(|t| t.form.extends.is_none()).collect()
    }

    /// The forms that extend that of `term`.
    pub fn extensions(&self, term: &Term) -> Vec<Term> {
        let extends = |t: &Term| t.mechanism.name == term.mechanism.name && t.form.extends == Some(term.form.label);
        self.terms().into_iter().filter(extends).collect()
    }

    fn terms(&self) -> Vec<Term> {
        let have: Vec<&str> = self.given.iter().map(|t| t.mechanism.name).collect();
        ALL.iter()
            .filter(|m| !have.contains(&m.name))
            .flat_map(|m| m.forms(&self.context).into_iter().map(move |form| Term { mechanism: m, form }))
            .collect()
    }
}

/// Whether readings stay at `top`, the largest of their campaign, several samples long.
pub fn flat(y: &[f64], top: f64) -> bool {
    y.windows(FLAT).any(|w| w.iter().all(|v| (v.abs() - top).abs() <= 1e-9 * top))
}

/// The channel whose recordings of different levels end in one and the same reading, `top`, several samples long: no
/// impact does that, a range does.
fn flat_top(data: &Data, top: [f64; 3]) -> Option<Channel> {
    [Channel::Force, Channel::Acceleration].into_iter().find(|c| {
        let i = c.index();
        let ends = data.records.iter().filter(|r| r.y[i].as_ref().is_some_and(|y| flat(y, top[i])));
        let mut levels: Vec<usize> = ends.map(|r| r.level).collect();
        levels.sort_unstable();
        levels.dedup();
        levels.len() > 1
    })
}
