//! Estimation of a campaign's parameters: Levenberg-Marquardt on whitened residuals, with the
//! nuisances of each recording eliminated (Schur complement), priors on what has a tolerance.
//!
//! `data` says what there is to fit, `fit` minimises, `linear` says what is left and how well it is known.

mod data;
mod fit;
mod linear;

use data::local_of;
pub(crate) use data::TILT_SHARE;
use law::Parameters as Law;
use mechanisms::physics::Physics;
use plant::chain::readings;
use plant::element::Element;
use plant::simulate::{law_of, simulate, simulate_on, Local, Trace};
use rayon::prelude::*;
use record::Channel;
use std::sync::Arc;

pub use data::{Data, Nuisance, Parameter, Record, Scales, STIFFNESS_SCALE};
pub use fit::{Fit, Options};
pub(crate) use linear::Equations;
pub use linear::{Block, Linear};

/// Puts the parameters of a model into the physics.
type Apply<'a> = dyn Fn(&[f64], &mut Physics) + Sync + Send + 'a;

/// A model of a campaign: its parameters and how they make physics.
#[derive(Clone)]
pub struct Model<'a> {
    pub parameters: Vec<Parameter>,
    apply: Arc<Apply<'a>>,
}

impl<'a> Model<'a> {
    /// Of its parameters and what puts their values, in the same order, into the physics.
    pub fn new(parameters: Vec<Parameter>, apply: impl Fn(&[f64], &mut Physics) + Sync + Send + 'a) -> Model<'a> {
        Model { parameters, apply: Arc::new(apply) }
    }

    /// Puts the values `theta` into `p`.
    pub fn apply(&self, theta: &[f64], p: &mut Physics) {
        (self.apply)(theta, p);
    }
}

/// The state of a fit.
#[derive(Clone, Debug)]
pub struct Point {
    pub theta: Vec<f64>,
    pub locals: Vec<Vec<f64>>,
    /// Squared whitened residuals and priors; infinite where the simulation failed.
    pub chi2: f64,
}

/// A campaign, a model and the work space that joins them.
pub struct Problem<'a> {
    pub data: &'a Data,
    pub model: &'a Model<'a>,
    nuisances: Vec<Nuisance>,
}

impl<'a> Problem<'a> {
    /// Of a campaign and a model.
    pub fn new(data: &'a Data, model: &'a Model<'a>) -> Self {
        Problem { data, model, nuisances: data.nuisances() }
    }

    /// The point of `theta` and the first guess of the nuisances.
    pub fn start(&self, theta: Vec<f64>) -> Point {
        let locals = (0..self.data.records.len()).map(|r| self.data.local_start(r)).collect();
        self.evaluate(theta, locals)
    }

    /// Physics at `theta`.
    pub fn physics(&self, theta: &[f64]) -> Physics {
        let mut p = Physics { mass: self.data.mass, ..Physics::default() };
        self.model.apply(theta, &mut p);
        p
    }

    /// What a recording's vector of nuisances stands for.
    pub fn local(&self, v: &[f64]) -> Local {
        local_of(&self.nuisances, v)
    }

    /// A recording's trace and readings (zeros included) at a point.
    pub fn predict(&self, theta: &[f64], r: usize, local: &[f64]) -> (Trace, [Vec<f64>; 3]) {
        let p = self.physics(theta);
        let rec = &self.data.records[r];
        let t = simulate(&p, &rec.setup, &self.local(local));
        let mut y = readings(&p, &t, &rec.setup.time);
        self.add_zeros(r, &mut y, local);
        (t, y)
    }

    /// As [`Problem::predict`], with the readings once more as they would be without the limit of the chain.
    pub fn predict_unlimited(&self, theta: &[f64], r: usize, local: &[f64]) -> (Trace, [Vec<f64>; 3], [Vec<f64>; 3]) {
        let (trace, limited) = self.predict(theta, r, local);
        let p = Physics { clipping: Default::default(), ..self.physics(theta) };
        let mut free = readings(&p, &trace, &self.data.records[r].setup.time);
        self.add_zeros(r, &mut free, local);
        (trace, limited, free)
    }

    /// The whitened residual of recording `r` at a point, channel after channel as [`Data::compared`] gives them, with
    /// its trace. None where the simulation fails.
    pub fn residual(&self, point: &Point, r: usize) -> Option<(Trace, Vec<f64>)> {
        let (trace, y) = self.predict(&point.theta, r, &point.locals[r]);
        let mut w = Vec::new();
        self.whiten_into(r, &y, Some(&self.data.records[r].y), &mut w);
        trace.ok.then_some((trace, w))
    }

    /// [`Problem::residual`] of every recording.
    pub fn residuals(&self, point: &Point) -> Option<Vec<(Trace, Vec<f64>)>> {
        (0..self.data.records.len()).into_par_iter().map(|r| self.residual(point, r)).collect()
    }

    /// As [`Problem::predict`], with the contact of `element` where the law stands else, at least `steps` of them a
    /// contact; `element` is made for the law this recording has at that point.
    ///
    /// # Errors
    /// What `element` and the element it makes refuse.
    pub fn predict_on(
        &self,
        theta: &[f64],
        r: usize,
        local: &[f64],
        element: &dyn Fn(&Law) -> anyhow::Result<Box<dyn Element>>,
        steps: f64,
    ) -> anyhow::Result<(Trace, [Vec<f64>; 3])> {
        let mut p = self.physics(theta);
        let rec = &self.data.records[r];
        let l = self.local(local);
        let mut law = law_of(&p, &rec.setup, &l);
        // what was learned between the faces is the element's, too
        p.learned_forces.give_contact_to(&mut law);
        let t = simulate_on(element(&law)?, steps, &p, &rec.setup, &l)?;
        let mut y = readings(&p, &t, &rec.setup.time);
        self.add_zeros(r, &mut y, local);
        Ok((t, y))
    }

    /// Puts the zeros of the instruments of recording `r` on what an ideal chain would read, and the slope of its free
    /// line: an imposed penetration is read from where its scale has its zero, not from the touch.
    fn add_zeros(&self, r: usize, y: &mut [Vec<f64>; 3], local: &[f64]) {
        for (n, z) in self.nuisances.iter().zip(local) {
            let channel = match n {
                Nuisance::Zero(c) => *c,
                Nuisance::Offset => Channel::Penetration,
                Nuisance::Tilt => {
                    let imposed = &self.data.records[r].setup.imposed;
                    y[Channel::Force.index()].iter_mut().zip(imposed).for_each(|(v, x)| *v += z * x);
                    continue;
                }
                _ => continue,
            };
            y[channel.index()].iter_mut().for_each(|v| *v += z);
        }
    }

    fn whiten_into(
        &self,
        r: usize,
        e: &[Vec<f64>; 3],
        negate_from: Option<&[Option<Vec<f64>>; 3]>,
        out: &mut Vec<f64>,
    ) {
        out.clear();
        let rec = &self.data.records[r];
        let n = rec.setup.time.len();
        let mut weighted = vec![0.0; n];
        for c in self.data.compared(r) {
            let i = c.index();
            let at = out.len();
            out.resize(at + n, 0.0);
            let samples = weighted.iter_mut().zip(&e[i]).zip(&rec.weight[i]);
            match negate_from {
                Some(y) => {
                    let y = y[i].as_ref().expect("compared channels are there");
                    match rec.off_path(c) {
                        [] => samples.zip(y).for_each(|(((t, e), w), y)| *t = (y - e) * w),
                        off => samples.zip(y).zip(off).for_each(|((((t, e), w), y), off)| *t = (y - e - off) * w),
                    }
                }
                // what leaves a channel alone leaves nothing of it
                None if e[i].iter().all(|v| *v == 0.0) => continue,
                None => samples.for_each(|((t, e), w)| *t = e * w),
            }
            self.data.noise[i].whiten(&weighted, &mut out[at..]);
        }
    }

    fn prior_terms(&self, r: usize, local: &[f64], first_speed: f64) -> f64 {
        let mut c = 0.0;
        for (n, x) in self.nuisances.iter().zip(local) {
            if let Some((m, s)) = self.data.prior(r, *n) {
                c += ((x - m) / s).powi(2);
            }
        }
        let rec = &self.data.records[r];
        if let (true, Some((m, s))) = (rec.at_first, rec.speed) {
            c += ((first_speed - m) / s).powi(2);
        }
        c
    }

    fn global_prior(&self, theta: &[f64]) -> f64 {
        self.model.parameters.iter().zip(theta).filter_map(|(p, x)| p.prior.map(|(m, s)| ((x - m) / s).powi(2))).sum()
    }

    /// chi^2 of one recording at a point.
    pub fn chi2_of(&self, theta: &[f64], r: usize, local: &[f64]) -> f64 {
        let (t, y) = self.predict(theta, r, local);
        if !t.ok {
            return f64::INFINITY;
        }
        let mut w = Vec::new();
        self.whiten_into(r, &y, Some(&self.data.records[r].y), &mut w);
        w.iter().map(|x| x * x).sum::<f64>() + self.prior_terms(r, local, t.first_speed)
    }

    /// chi^2 at a point.
    pub fn evaluate(&self, theta: Vec<f64>, locals: Vec<Vec<f64>>) -> Point {
        let parts: Vec<f64> = locals.par_iter().enumerate().map(|(r, l)| self.chi2_of(&theta, r, l)).collect();
        let mut chi2 = self.global_prior(&theta) + parts.iter().sum::<f64>();
        if !chi2.is_finite() {
            chi2 = f64::INFINITY;
        }
        Point { theta, locals, chi2 }
    }

    /// The nuisances, in the order of a recording's vector.
    pub fn nuisances(&self) -> &[Nuisance] {
        &self.nuisances
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::noise::Noise;
    use plant::simulate::Setup;
    use record::Kind;

    #[test]
    fn an_imposed_penetration_is_predicted_as_it_is_read_wherever_its_zero_is() {
        let time: Vec<f64> = (0..40).map(|i| 1e-3 * f64::from(i)).collect();
        let read: Vec<f64> = time.iter().map(|t| 2e-4 - 1e-2 * (t - 0.02).abs()).collect();
        let setup = Setup {
            kind: Kind::Indentation,
            imposed: read.clone(),
            imposed_rate: vec![0.0; read.len()],
            ..Setup::drop_test(time, 2e-4, 1e-2, 0.04)
        };
        let data = Data::of_force(setup, 1.0, 10.0, vec![0.0; read.len()]);
        let model = Model::new(Vec::new(), |_, _| {});
        let problem = Problem::new(&data, &model);
        let zero = 3e-5;
        let local: Vec<f64> =
            problem.nuisances().iter().map(|n| if *n == Nuisance::Offset { zero } else { 0.0 }).collect();
        let (trace, y) = problem.predict(&[], 0, &local);
        let apart = |a: &[f64], by: f64| a.iter().zip(&read).map(|(a, b)| (a - b - by).abs()).fold(0.0, f64::max);
        assert!(apart(&y[2], 0.0) < 1e-15, "{:e}", apart(&y[2], 0.0));
        assert!(apart(&trace.position, -zero) < 1e-15, "the contact starts where the surface is");
    }

    #[test]
    fn a_touch_set_late_and_a_tilted_free_line_leave_stiffness_and_exponent_right() {
        // 2e5 N/m^1.5 to 0.2 mm; the zero stands 12 um late, the free line rises by 0.2 % of the largest force
        let (k, p, late) = (2e5, 1.5, 12e-6);
        let time: Vec<f64> = (0..400).map(|i| 1e-3 * f64::from(i)).collect();
        let x = |t: f64| 2e-4 - 2e-3 * (t - 0.2).abs();
        let read: Vec<f64> = time.iter().map(|t| x(*t) - late).collect();
        let most = k * 2e-4f64.powf(p);
        let force = |t: f64| k * x(t).max(0.0).powf(p) + 0.002 * most * (x(t) - late) / 4e-4;
        let hum = |i: usize| 2e-4 * most * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
        let y: Vec<f64> = time.iter().enumerate().map(|(i, t)| force(*t) + hum(i)).collect();
        let imposed_rate: Vec<f64> = time.iter().map(|t| if *t < 0.2 { 2e-3 } else { -2e-3 }).collect();
        let setup =
            Setup { kind: Kind::Indentation, imposed: read, imposed_rate, ..Setup::drop_test(time, 2e-4, 2e-3, 0.4) };
        let mut data = Data { noise: [Noise::white(1e-4 * most); 3], ..Data::of_force(setup, 1.0, most, y) };
        data.range[2] = 4e-4;
        let parameter = |name: &str| Parameter {
            name: name.into(),
            lower: -50.0,
            upper: 50.0,
            step: 1e-3,
            prior: None,
            dynamic: true,
        };
        let model = Model::new(vec![parameter("ln k"), parameter("p")], |theta, physics: &mut Physics| {
            physics.law.elastic.stiffness = theta[0].exp();
            physics.law.elastic.exponent = theta[1];
        });
        let problem = Problem::new(&data, &model);
        let fit = problem.fit(problem.start(vec![(0.5f64 * k).ln(), 1.4]), &Options::default());
        let [ln_k, exponent] = fit.point.theta[..] else { panic!("two parameters") };
        // what every recording has of its own may take some of the stiffness
        assert!((exponent - p).abs() < 0.01, "{exponent}");
        let at_depth = |ln_k: f64, p: f64| ln_k + p * 2e-4f64.ln();
        assert!((at_depth(ln_k, exponent) - at_depth(k.ln(), p)).abs() < 0.01, "{ln_k} {exponent}");
        let of = |what: Nuisance| problem.nuisances().iter().position(|n| *n == what).map(|i| fit.point.locals[0][i]);
        assert!((of(Nuisance::Offset).expect("an offset") + late).abs() < 1e-6, "{:?}", fit.point.locals);
        let tilt = 0.002 * most / 4e-4;
        assert!((of(Nuisance::Tilt).expect("a tilt") - tilt).abs() < 0.2 * tilt, "{:?}", fit.point.locals);
    }
}
