//! Estimation of a campaign's parameters: Levenberg-Marquardt on whitened residuals, with the
//! nuisances of each recording eliminated (Schur complement), priors on what has a tolerance.

use super::chain::readings;
use super::noise::Noise;
use super::physics::Physics;
use super::simulate::{law_of, simulate, simulate_on, Local, Setup, Trace};
use crate::host::element::Element;
use crate::record::{Channel, Kind};
use hysteresis_contact::law::Parameters as Law;
use nalgebra::{DMatrix, DVector};

/// One recording ready for estimation.
#[derive(Clone, Debug)]
pub struct Record {
    pub setup: Setup,
    pub file: String,
    pub level: usize,
    /// SI readings by channel.
    pub y: [Option<Vec<f64>>; 3],
    /// Weight of each sample (noise sigma over local sigma; 0: left out), by channel.
    pub weight: [Vec<f64>; 3],
    /// Speed and its std, m/s; at the first sample where `at_first`.
    pub speed: Option<(f64, f64)>,
    pub at_first: bool,
    /// Instant of touch (release for a contactor) guessed from the data, s.
    pub start: f64,
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
}

/// Sizes typical of the campaign, SI: what makes parameters dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    pub force: f64,
    pub depth: f64,
    pub speed: f64,
    /// Duration of a contact, s.
    pub duration: f64,
    pub mass: f64,
    /// Length of a recording, s, and its sampling interval, s.
    pub length: f64,
    pub dt: f64,
    /// Depth and speed that anchor F_ref and the damping ratio.
    pub x_ref: f64,
    pub v_ref: f64,
    /// Number of recordings, and largest peak force N (or m times peak acceleration).
    pub orders: f64,
    pub peak: f64,
}

/// A campaign-wide parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: String,
    pub start: f64,
    pub lower: f64,
    pub upper: f64,
    /// Step for differences.
    pub step: f64,
    /// Mean and standard deviation of a tolerance.
    pub prior: Option<(f64, f64)>,
    /// False where it changes the chain alone, so that no new simulation is needed.
    pub dynamic: bool,
}

/// Names the nuisances of a recording, in the order of its vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nuisance {
    Start,
    Speed,
    Stiffness,
    Zero(Channel),
    Offset,
}

/// A model of a campaign: its parameters and how they make physics.
pub struct Model<'a> {
    pub parameters: Vec<Parameter>,
    #[allow(clippy::type_complexity)]
    pub apply: Box<dyn Fn(&[f64], &mut Physics) + Sync + Send + 'a>,
}

/// The state of a fit.
#[derive(Clone, Debug)]
pub struct Point {
    pub theta: Vec<f64>,
    pub locals: Vec<Vec<f64>>,
    /// Squared whitened residuals and priors; infinite where the simulation failed.
    pub chi2: f64,
}

/// A fit: the point reached, with what was needed to get there.
#[derive(Clone, Debug)]
pub struct Fit {
    pub point: Point,
    pub iterations: usize,
    pub converged: bool,
    /// chi^2 by iteration.
    pub objective: Vec<f64>,
    /// Samples in all.
    pub samples: usize,
}

/// Linearisation of a fit: whitened residuals and their sensitivities, recording by recording.
pub struct Linear {
    pub blocks: Vec<Block>,
    /// Cholesky of the reduced normal matrix of the globals.
    reduced: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
}

/// One recording's part.
pub struct Block {
    pub residual: Vec<f64>,
    /// Whitened sensitivities: globals first, then locals.
    pub columns: Vec<Vec<f64>>,
    local: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
    cross: DMatrix<f64>,
}

impl Data {
    /// The nuisances of every recording of this campaign.
    pub fn nuisances(&self) -> Vec<Nuisance> {
        let mut v = match self.kind {
            Kind::DropTest => vec![Nuisance::Start, Nuisance::Speed, Nuisance::Stiffness],
            Kind::ContactorOpening => vec![Nuisance::Start, Nuisance::Stiffness],
            Kind::Indentation => vec![Nuisance::Stiffness, Nuisance::Offset],
        };
        for c in Channel::ALL {
            if self.has(c) && !(self.kind == Kind::Indentation && c == Channel::Penetration) {
                v.push(Nuisance::Zero(c));
            }
        }
        v
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
            Nuisance::Stiffness => Some((0.0, 0.006)),
            Nuisance::Zero(Channel::Penetration) => Some((0.0, (5e-6_f64).min(0.05 * self.range[2]))),
            Nuisance::Zero(c) => Some((0.0, 0.0012 * self.range[c.index()])),
            Nuisance::Offset => Some((0.0, (5e-6_f64).min(0.02 * self.range[2]))),
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

    fn local_step(&self, n: Nuisance) -> f64 {
        match n {
            Nuisance::Start => 2e-3 * self.scales.duration,
            Nuisance::Speed => 1e-3 * self.scales.speed,
            Nuisance::Stiffness => 2e-3,
            Nuisance::Zero(c) => 1e-3 * self.range[c.index()],
            Nuisance::Offset => 1e-3 * self.scales.depth,
        }
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

    /// Samples compared in all.
    pub fn samples(&self) -> usize {
        (0..self.records.len()).map(|r| self.compared(r).map(|_| self.records[r].setup.time.len()).sum::<usize>()).sum()
    }
}

fn local_of(nuisances: &[Nuisance], v: &[f64]) -> Local {
    let mut l = Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 };
    for (n, x) in nuisances.iter().zip(v) {
        match n {
            Nuisance::Start => l.start = *x,
            Nuisance::Speed => l.speed = *x,
            Nuisance::Stiffness => l.stiffness = *x,
            Nuisance::Offset => l.offset = *x,
            Nuisance::Zero(_) => {}
        }
    }
    l
}

/// A campaign, a model and the work space that joins them.
pub struct Problem<'a> {
    pub data: &'a Data,
    pub model: &'a Model<'a>,
    nuisances: Vec<Nuisance>,
}

/// Options of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub iterations: usize,
    /// Relative change of chi^2 at which it has converged.
    pub tolerance: f64,
    /// Give up after four iterations when chi^2 has not fallen by this much.
    pub hopeless: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options { iterations: 30, tolerance: 1e-5, hopeless: 0.0 }
    }
}

impl<'a> Problem<'a> {
    pub fn new(data: &'a Data, model: &'a Model<'a>) -> Self {
        Problem { data, model, nuisances: data.nuisances() }
    }

    /// Start values of model and nuisances.
    pub fn start(&self) -> Point {
        let theta = self.model.parameters.iter().map(|p| p.start).collect();
        let locals = (0..self.data.records.len()).map(|r| self.data.local_start(r)).collect();
        self.evaluate(theta, locals)
    }

    /// Physics at `theta`.
    pub fn physics(&self, theta: &[f64]) -> Physics {
        let mut p = Physics { mass: self.data.mass, ..Physics::default() };
        (self.model.apply)(theta, &mut p);
        p
    }

    /// A recording's trace and readings (zeros included) at a point.
    pub fn predict(&self, theta: &[f64], r: usize, local: &[f64]) -> (Trace, [Vec<f64>; 3]) {
        let p = self.physics(theta);
        let rec = &self.data.records[r];
        let t = simulate(&p, &rec.setup, &local_of(&self.nuisances, local));
        let mut y = readings(&p, &t, &rec.setup.time);
        self.add_zeros(&mut y, local);
        (t, y)
    }

    /// As [`Problem::predict`], with the contact of `element` where the law stands else; `element` is made for the
    /// law this recording has at that point.
    ///
    /// # Errors
    /// What `element` and the element it makes refuse.
    pub fn predict_on(
        &self,
        theta: &[f64],
        r: usize,
        local: &[f64],
        element: &dyn Fn(&Law) -> anyhow::Result<Box<dyn Element>>,
    ) -> anyhow::Result<(Trace, [Vec<f64>; 3])> {
        let p = self.physics(theta);
        let rec = &self.data.records[r];
        let l = local_of(&self.nuisances, local);
        let t = simulate_on(element(&law_of(&p, &rec.setup, &l))?, &p, &rec.setup, &l)?;
        let mut y = readings(&p, &t, &rec.setup.time);
        self.add_zeros(&mut y, local);
        Ok((t, y))
    }

    fn add_zeros(&self, y: &mut [Vec<f64>; 3], local: &[f64]) {
        for (n, z) in self.nuisances.iter().zip(local) {
            if let Nuisance::Zero(c) = n {
                y[c.index()].iter_mut().for_each(|v| *v += z);
            }
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
        let mut tmp = vec![0.0; n];
        for c in self.data.compared(r) {
            let i = c.index();
            let w = &rec.weight[i];
            match negate_from {
                Some(y) => {
                    let y = y[i].as_ref().expect("compared channels are there");
                    for k in 0..n {
                        tmp[k] = (y[k] - e[i][k]) * w[k];
                    }
                }
                None => {
                    for k in 0..n {
                        tmp[k] = e[i][k] * w[k];
                    }
                }
            }
            let at = out.len();
            out.resize(at + n, 0.0);
            self.data.noise[i].whiten(&tmp, &mut out[at..]);
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
        let mut chi2 = self.global_prior(&theta);
        for (r, l) in locals.iter().enumerate() {
            chi2 += self.chi2_of(&theta, r, l);
            if !chi2.is_finite() {
                chi2 = f64::INFINITY;
                break;
            }
        }
        Point { theta, locals, chi2 }
    }

    fn block(&self, point: &Point, r: usize, active: &[bool]) -> Option<(Block, DMatrix<f64>, DVector<f64>)> {
        let data = self.data;
        let rec = &data.records[r];
        let ps = &self.model.parameters;
        let (g, l) = (ps.len(), self.nuisances.len());
        let local = &point.locals[r];
        let phys = self.physics(&point.theta);
        let lo = local_of(&self.nuisances, local);
        let trace = simulate(&phys, &rec.setup, &lo);
        if !trace.ok {
            return None;
        }
        let mut y = readings(&phys, &trace, &rec.setup.time);
        self.add_zeros(&mut y, local);
        let mut residual = Vec::new();
        self.whiten_into(r, &y, Some(&rec.y), &mut residual);
        let mut columns = vec![Vec::new(); g + l];
        let mut first = vec![0.0; g + l];
        let difference =
            |phys: &Physics, lo: &Local, zeros: &[f64], again: bool, h: f64, col: &mut Vec<f64>| -> Option<f64> {
                let t2;
                let t = if again {
                    t2 = simulate(phys, &rec.setup, lo);
                    if !t2.ok {
                        return None;
                    }
                    &t2
                } else {
                    &trace
                };
                let mut z = readings(phys, t, &rec.setup.time);
                self.add_zeros(&mut z, zeros);
                for c in 0..3 {
                    for (a, b) in z[c].iter_mut().zip(&y[c]) {
                        *a = (*a - b) / h;
                    }
                }
                self.whiten_into(r, &z, None, col);
                Some((t.first_speed - trace.first_speed) / h)
            };
        for j in 0..g {
            if !active[j] {
                columns[j] = vec![0.0; residual.len()];
                continue;
            }
            let mut th = point.theta.clone();
            let h = if th[j] + ps[j].step > ps[j].upper { -ps[j].step } else { ps[j].step };
            th[j] += h;
            let p2 = self.physics(&th);
            let mut col = std::mem::take(&mut columns[j]);
            first[j] = difference(&p2, &lo, local, ps[j].dynamic, h, &mut col)?;
            columns[j] = col;
        }
        for (i, n) in self.nuisances.iter().enumerate() {
            let h = data.local_step(*n);
            let mut v = local.clone();
            v[i] += h;
            let lo2 = local_of(&self.nuisances, &v);
            let again = !matches!(n, Nuisance::Zero(_));
            let mut col = std::mem::take(&mut columns[g + i]);
            first[g + i] = difference(&phys, &lo2, &v, again, h, &mut col)?;
            columns[g + i] = col;
        }
        let m = g + l;
        let mut a = DMatrix::zeros(m, m);
        let mut b = DVector::zeros(m);
        for i in 0..m {
            b[i] = dot(&columns[i], &residual);
            for j in 0..=i {
                let v = dot(&columns[i], &columns[j]);
                a[(i, j)] = v;
                a[(j, i)] = v;
            }
        }
        for (i, n) in self.nuisances.iter().enumerate() {
            if let Some((mean, s)) = data.prior(r, *n) {
                a[(g + i, g + i)] += 1.0 / (s * s);
                b[g + i] += (mean - local[i]) / (s * s);
            }
        }
        if let (true, Some((mean, s))) = (rec.at_first, rec.speed) {
            for i in 0..m {
                b[i] += first[i] * (mean - trace.first_speed) / (s * s);
                for j in 0..m {
                    a[(i, j)] += first[i] * first[j] / (s * s);
                }
            }
        }
        Some((Block { residual, columns, local: None, cross: DMatrix::zeros(0, 0) }, a, b))
    }

    /// Minimises chi^2 from `point`.
    pub fn fit(&self, mut point: Point, options: &Options) -> Fit {
        let ps = &self.model.parameters;
        let (g, l, nr) = (ps.len(), self.nuisances.len(), self.data.records.len());
        let mut lambda = 1e-3;
        let mut objective = vec![point.chi2];
        let mut converged = false;
        let mut iterations = 0;
        let samples = self.data.samples();
        let first_chi2 = point.chi2;
        let mut small = 0;
        'outer: while iterations < options.iterations && point.chi2.is_finite() {
            iterations += 1;
            let all = vec![true; g];
            let mut parts = Vec::with_capacity(nr);
            for r in 0..nr {
                match self.block(&point, r, &all) {
                    Some(b) => parts.push((b.1, b.2)),
                    None => break 'outer,
                }
            }
            let mut grad = DVector::<f64>::zeros(g);
            let mut diag = DMatrix::<f64>::zeros(g, g);
            for (j, p) in ps.iter().enumerate() {
                if let Some((m, s)) = p.prior {
                    diag[(j, j)] += 1.0 / (s * s);
                    grad[j] += (m - point.theta[j]) / (s * s);
                }
            }
            for (a, b) in &parts {
                diag += a.view((0, 0), (g, g));
                grad += b.rows(0, g);
            }
            // parameters held at a bound by their gradient take no step
            let held: Vec<bool> = (0..g)
                .map(|j| {
                    (point.theta[j] <= ps[j].lower && grad[j] <= 0.0)
                        || (point.theta[j] >= ps[j].upper && grad[j] >= 0.0)
                })
                .collect();
            let mut tries = 0;
            loop {
                tries += 1;
                let mut s = diag.clone();
                let mut q = grad.clone();
                for j in 0..g {
                    s[(j, j)] += lambda * diag[(j, j)] + 1e-12;
                }
                let mut solved = Vec::with_capacity(nr);
                let mut good = true;
                for (a, b) in &parts {
                    let mut c = a.view((g, g), (l, l)).into_owned();
                    for i in 0..l {
                        c[(i, i)] += lambda * a[(g + i, g + i)] + 1e-12 * (1.0 + a[(g + i, g + i)]);
                    }
                    let bt = a.view((g, 0), (l, g)).into_owned();
                    let bl = b.rows(g, l).into_owned();
                    match c.cholesky() {
                        Some(ch) => {
                            let x = ch.solve(&bt);
                            let y = ch.solve(&bl);
                            s -= bt.transpose() * &x;
                            q -= bt.transpose() * &y;
                            solved.push((x, y));
                        }
                        None => {
                            good = false;
                            break;
                        }
                    }
                }
                let mut accepted = false;
                if good {
                    for j in 0..g {
                        if held[j] {
                            for k in 0..g {
                                s[(j, k)] = 0.0;
                                s[(k, j)] = 0.0;
                            }
                            s[(j, j)] = 1.0;
                            q[j] = 0.0;
                        }
                    }
                    if let Some(ch) = s.cholesky() {
                        let step = ch.solve(&q);
                        let theta: Vec<f64> =
                            (0..g).map(|j| (point.theta[j] + step[j]).clamp(ps[j].lower, ps[j].upper)).collect();
                        let taken = DVector::from_iterator(g, (0..g).map(|j| theta[j] - point.theta[j]));
                        let locals: Vec<Vec<f64>> = (0..nr)
                            .map(|r| {
                                let (x, y) = &solved[r];
                                let d = y - x * &taken;
                                (0..l)
                                    .map(|i| {
                                        let mut v = point.locals[r][i] + d[i];
                                        if self.nuisances[i] == Nuisance::Speed {
                                            let at = point.locals[r][i].abs();
                                            v = v.clamp(0.5 * at, 2.0 * at);
                                        }
                                        v
                                    })
                                    .collect()
                            })
                            .collect();
                        let next = self.evaluate(theta, locals);
                        if next.chi2 < point.chi2 {
                            let gain = point.chi2 - next.chi2;
                            point = next;
                            objective.push(point.chi2);
                            lambda = (lambda * 0.1).max(1e-9);
                            accepted = true;
                            small = if gain < options.tolerance * point.chi2 + 1e-3 { small + 1 } else { 0 };
                            if small >= 2 {
                                converged = true;
                            }
                        } else if next.chi2.is_finite() && next.chi2 - point.chi2 < 1e-7 * point.chi2 {
                            converged = true;
                        }
                    }
                }
                if accepted || converged {
                    break;
                }
                lambda = if lambda < 1e-4 { 1e-3 } else { lambda * 10.0 };
                if tries > 9 {
                    converged = lambda > 1e3;
                    break 'outer;
                }
            }
            if converged {
                break;
            }
            if iterations == 4 && options.hopeless > 0.0 && first_chi2 - point.chi2 < options.hopeless {
                break;
            }
        }
        Fit { point, iterations, converged, objective, samples }
    }

    /// Linearises at a point.
    pub fn linearise(&self, point: &Point) -> Option<Linear> {
        let ps = &self.model.parameters;
        let (g, l) = (ps.len(), self.nuisances.len());
        // what sits at a bound has no freedom there
        let active: Vec<bool> = (0..g).map(|j| point.theta[j] > ps[j].lower && point.theta[j] < ps[j].upper).collect();
        let mut s = DMatrix::<f64>::zeros(g, g);
        for (j, p) in ps.iter().enumerate() {
            if let Some((_, sd)) = p.prior {
                s[(j, j)] += 1.0 / (sd * sd);
            }
            if !active[j] {
                s[(j, j)] += 1.0;
            }
        }
        let mut blocks = Vec::new();
        for r in 0..self.data.records.len() {
            let (mut b, a, _) = self.block(point, r, &active)?;
            let mut c = a.view((g, g), (l, l)).into_owned();
            for i in 0..l {
                c[(i, i)] += 1e-12 * (1.0 + a[(g + i, g + i)]);
            }
            let bt = a.view((g, 0), (l, g)).into_owned();
            let ch = c.cholesky()?;
            s += a.view((0, 0), (g, g)) - bt.transpose() * ch.solve(&bt);
            b.local = Some(ch);
            b.cross = bt;
            blocks.push(b);
        }
        for j in 0..g {
            s[(j, j)] *= 1.0 + 1e-10;
        }
        Some(Linear { blocks, reduced: s.cholesky() })
    }

    /// Covariance of the globals at a point, nuisances eliminated.
    pub fn covariance(&self, point: &Point) -> Option<DMatrix<f64>> {
        Some(self.linearise(point)?.reduced?.inverse())
    }

    /// Whitened change of the readings of every recording when the physics is `changed` by hand.
    pub fn signature(&self, point: &Point, change: &dyn Fn(&mut Physics), h: f64) -> Option<Vec<Vec<f64>>> {
        let base = self.physics(&point.theta);
        let mut other = base;
        change(&mut other);
        let mut out = Vec::new();
        for (r, rec) in self.data.records.iter().enumerate() {
            let lo = local_of(&self.nuisances, &point.locals[r]);
            let (a, b) = (simulate(&base, &rec.setup, &lo), simulate(&other, &rec.setup, &lo));
            if !a.ok || !b.ok {
                return None;
            }
            let (ya, mut yb) = (readings(&base, &a, &rec.setup.time), readings(&other, &b, &rec.setup.time));
            for c in 0..3 {
                for (u, v) in yb[c].iter_mut().zip(&ya[c]) {
                    *u = (*u - v) / h;
                }
            }
            let mut w = Vec::new();
            self.whiten_into(r, &yb, None, &mut w);
            out.push(w);
        }
        Some(out)
    }

    /// Fits only the nuisances named of recording `r`, the rest held; returns them.
    pub fn fit_local(&self, theta: &[f64], r: usize, start: &[f64], which: &dyn Fn(Nuisance) -> bool) -> Vec<f64> {
        let mut v = start.to_vec();
        let idx: Vec<usize> = (0..v.len()).filter(|i| which(self.nuisances[*i])).collect();
        let point0 = Point { theta: theta.to_vec(), locals: vec![], chi2: 0.0 };
        let g = theta.len();
        let none = vec![false; g];
        let mut best = self.chi2_of(theta, r, &v);
        let mut lambda = 1e-3;
        for _ in 0..20 {
            let mut p = point0.clone();
            p.locals = vec![Vec::new(); r + 1];
            p.locals[r] = v.clone();
            let Some((_, a, b)) = self.block(&p, r, &none) else { break };
            let mut improved = false;
            for _ in 0..8 {
                let k = idx.len();
                let mut s = DMatrix::zeros(k, k);
                let mut q = DVector::zeros(k);
                for (i, gi) in idx.iter().enumerate() {
                    q[i] = b[g + gi];
                    for (j, gj) in idx.iter().enumerate() {
                        s[(i, j)] = a[(g + gi, g + gj)];
                    }
                    s[(i, i)] *= 1.0 + lambda;
                    s[(i, i)] += 1e-12;
                }
                let Some(ch) = s.cholesky() else { break };
                let d = ch.solve(&q);
                let mut w = v.clone();
                for (i, gi) in idx.iter().enumerate() {
                    w[*gi] += d[i];
                    if self.nuisances[*gi] == Nuisance::Speed {
                        w[*gi] = w[*gi].clamp(0.5 * v[*gi].abs(), 2.0 * v[*gi].abs());
                    }
                }
                let c = self.chi2_of(theta, r, &w);
                if c < best {
                    improved = best - c > 1e-6 * best;
                    best = c;
                    v = w;
                    lambda = (lambda * 0.1_f64).max(1e-9);
                    break;
                }
                lambda *= 10.0;
            }
            if !improved {
                break;
            }
        }
        v
    }

    /// Squared distance of the globals from the optimum in standard errors, as Gauss and Newton's step tells it:
    /// g' S^-1 g of the gradient with everything of the recordings eliminated. What a bound holds takes no part.
    ///
    /// None where the simulation or the normal matrix fails.
    pub fn decrement(&self, point: &Point) -> Option<f64> {
        let ps = &self.model.parameters;
        let (g, l) = (ps.len(), self.nuisances.len());
        let all = vec![true; g];
        let mut s = DMatrix::<f64>::zeros(g, g);
        let mut q = DVector::<f64>::zeros(g);
        for (j, p) in ps.iter().enumerate() {
            if let Some((m, sd)) = p.prior {
                s[(j, j)] += 1.0 / (sd * sd);
                q[j] += (m - point.theta[j]) / (sd * sd);
            }
        }
        for r in 0..self.data.records.len() {
            let (_, a, b) = self.block(point, r, &all)?;
            let mut c = a.view((g, g), (l, l)).into_owned();
            for i in 0..l {
                c[(i, i)] += 1e-12 * (1.0 + a[(g + i, g + i)]);
            }
            let bt = a.view((g, 0), (l, g)).into_owned();
            let ch = c.cholesky()?;
            s += a.view((0, 0), (g, g)) - bt.transpose() * ch.solve(&bt);
            q += b.rows(0, g) - bt.transpose() * ch.solve(&b.rows(g, l).into_owned());
        }
        for j in 0..g {
            let held = (point.theta[j] <= ps[j].lower && q[j] <= 0.0) || (point.theta[j] >= ps[j].upper && q[j] >= 0.0);
            if held {
                s.row_mut(j).fill(0.0);
                s.column_mut(j).fill(0.0);
                q[j] = 0.0;
                s[(j, j)] = 1.0;
            }
            s[(j, j)] *= 1.0 + 1e-10;
        }
        let step = s.cholesky()?.solve(&q);
        Some(q.dot(&step).max(0.0))
    }

    /// The nuisances, in the order of a recording's vector.
    pub fn nuisances(&self) -> &[Nuisance] {
        &self.nuisances
    }
}

impl Linear {
    /// (s.r, |s|^2 with everything fitted projected out) of a signature.
    pub fn score(&self, s: &[Vec<f64>]) -> (f64, f64) {
        let g = self.blocks[0].cross.ncols();
        let mut sr = 0.0;
        let mut ss = 0.0;
        let mut b = DVector::<f64>::zeros(g);
        for (bl, s) in self.blocks.iter().zip(s) {
            sr += dot(s, &bl.residual);
            ss += dot(s, s);
            let l = bl.columns.len() - g;
            let local = DVector::from_iterator(l, (0..l).map(|i| dot(s, &bl.columns[g + i])));
            if let Some(ch) = &bl.local {
                let x = ch.solve(&local);
                ss -= local.dot(&x);
                b -= bl.cross.transpose() * x;
            }
            for j in 0..g {
                b[j] += dot(s, &bl.columns[j]);
            }
        }
        if let Some(ch) = &self.reduced {
            ss -= b.dot(&ch.solve(&b));
        }
        (sr, ss.max(1e-12))
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut s = [0.0; 4];
    let n = a.len().min(b.len());
    let m = n / 4 * 4;
    let mut i = 0;
    while i < m {
        s[0] += a[i] * b[i];
        s[1] += a[i + 1] * b[i + 1];
        s[2] += a[i + 2] * b[i + 2];
        s[3] += a[i + 3] * b[i + 3];
        i += 4;
    }
    let mut t = (s[0] + s[1]) + (s[2] + s[3]);
    while i < n {
        t += a[i] * b[i];
        i += 1;
    }
    t
}
