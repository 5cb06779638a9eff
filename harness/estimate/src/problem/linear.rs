//! A fit linearised: sensitivities, covariance, and scores of what the fit does not hold.

use super::fit::Part;
use super::{Nuisance, Point, Problem, STIFFNESS_SCALE};
use mechanisms::learned_force::LearnedForces;
use mechanisms::physics::Physics;
use nalgebra::{DMatrix, DVector};
use plant::chain::readings;
use plant::kernels::{add_scaled, dot, products};
use plant::simulate::{simulate, Local, Trace};
use plant::tangent::{tangents, Change, Tangent};
use rayon::prelude::*;
use record::Kind;

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
    /// The residual where Gauss and Newton's step leads: what is fitted has taken its share of it to the last digit. A fit
    /// that ended within its tolerance has not, and a signature that is nearly collinear with it would show that.
    rest: Vec<f64>,
    /// Readings without the channels' zeros.
    bare: [Vec<f64>; 3],
    local: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
    cross: DMatrix<f64>,
}

/// One recording's normal equations.
pub(crate) struct Equations {
    pub residual: Vec<f64>,
    /// Whitened sensitivities: globals first, then nuisances.
    pub columns: Vec<Vec<f64>>,
    /// Normal matrix and gradient, in that order.
    pub a: DMatrix<f64>,
    pub b: DVector<f64>,
}

/// One recording's normal equations with its nuisances eliminated (Schur complement).
struct Eliminated {
    /// What the recording adds to the globals' normal matrix and gradient.
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    local: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    cross: DMatrix<f64>,
    /// The nuisances' step with the globals held.
    alone: DVector<f64>,
}

impl Eliminated {
    /// Of the normal matrix `a` and gradient `b`, `g` globals first. None where the nuisances' matrix fails.
    fn new(a: &DMatrix<f64>, b: &DVector<f64>, g: usize) -> Option<Eliminated> {
        let l = b.len() - g;
        let mut c = a.view((g, g), (l, l)).into_owned();
        for i in 0..l {
            c[(i, i)] += 1e-12 * (1.0 + a[(g + i, g + i)]);
        }
        let cross = a.view((g, 0), (l, g)).into_owned();
        let local = c.cholesky()?;
        let alone = local.solve(&b.rows(g, l).into_owned());
        let normal = a.view((0, 0), (g, g)) - cross.transpose() * local.solve(&cross);
        let gradient = b.rows(0, g) - cross.transpose() * &alone;
        Some(Eliminated { normal, gradient, local, cross, alone })
    }
}

/// Change of a channel's readings over them (root mean squares) up to which a step's difference is a sensitivity; the
/// change that a shorter step aims at, and the least share of a step that it is.
const STRAIGHT: f64 = 0.03;
const AIMED: f64 = 0.01;
const SHORTEST: f64 = 1e-3;
/// Share of a step that is taken where a body of ours bounces: every bounce bends what follows it. FMUs have whole steps, for
/// so short a one may change less than their own integration leaves.
const BOUNCING: f64 = 0.1;

/// How the motion with a changed parameter is had.
#[derive(Clone, Copy)]
enum Motion<'a> {
    /// The parameter does not change it.
    Same,
    /// Along its tangent.
    Along(&'a Tangent),
    /// By another simulation.
    Simulated,
}

impl Problem<'_> {
    /// Residual and sensitivities of recording `r` at a point, by differences; inactive globals have none.
    pub(super) fn part(&self, point: &Point, r: usize, active: &[bool]) -> Option<Part> {
        let data = self.data;
        let rec = &data.records[r];
        let ps = &self.model.parameters;
        let (g, l) = (ps.len(), self.nuisances.len());
        let local = &point.locals[r];
        let phys = self.physics(&point.theta);
        let lo = self.local(local);
        let trace = simulate(&phys, &rec.setup, &lo);
        if !trace.ok {
            return None;
        }
        let bare = readings(&phys, &trace, &rec.setup.time);
        let mut y = bare.clone();
        self.add_zeros(r, &mut y, local);
        let mut residual = Vec::new();
        self.whiten_into(r, &y, Some(&rec.y), &mut residual);
        let mut columns = vec![Vec::new(); g + l];
        let short = if data.kind == Kind::ContactorOpening { BOUNCING } else { 1.0 };
        let mut first = vec![0.0; g + l];
        // how the trace changes with what is learned; the others are simulated again
        let mut tangents = self.tangents(point, r, &phys, &trace, active);
        // sensitivity of the speed at the first sample, and how far the step has changed the readings
        let difference = |phys: &Physics,
                          lo: &Local,
                          zeros: &[f64],
                          motion: Motion<'_>,
                          h: f64,
                          col: &mut Vec<f64>|
         -> Option<(f64, f64)> {
            let t2;
            let t = match motion {
                Motion::Same => &trace,
                Motion::Along(tangent) => {
                    t2 = tangent.moved(&trace, h);
                    &t2
                }
                Motion::Simulated => {
                    t2 = simulate(phys, &rec.setup, lo);
                    if !t2.ok {
                        return None;
                    }
                    &t2
                }
            };
            let mut z = readings(phys, t, &rec.setup.time);
            self.add_zeros(r, &mut z, zeros);
            let mut largest = 0.0f64;
            for c in 0..3 {
                let (mut change, mut all) = (0.0, 0.0);
                for (a, b) in z[c].iter_mut().zip(&y[c]) {
                    let d = *a - b;
                    change += d * d;
                    all += b * b;
                    *a = d / h;
                }
                largest = largest.max(change / all.max(f64::MIN_POSITIVE));
            }
            self.whiten_into(r, &z, None, col);
            Some(((t.first_speed - trace.first_speed) / h, largest.sqrt()))
        };
        for j in 0..g {
            if !active[j] {
                columns[j] = vec![0.0; residual.len()];
                continue;
            }
            let tangent = tangents[j].take();
            let motion = || match &tangent {
                Some(of) => Motion::Along(of),
                None if ps[j].dynamic => Motion::Simulated,
                None => Motion::Same,
            };
            let mut along = |h: f64| {
                let mut theta = point.theta.clone();
                theta[j] += h;
                difference(&self.physics(&theta), &lo, local, motion(), h, &mut columns[j])
            };
            let step = short * ps[j].step;
            let h = if point.theta[j] + step > ps[j].upper { -step } else { step };
            let (slope, change) = along(h)?;
            // what shifts an impact by a share of its duration is no tangent any more
            let shorter = h * (AIMED / change).max(SHORTEST);
            first[j] = if change > STRAIGHT { along(shorter)?.0 } else { slope };
        }
        for (i, n) in self.nuisances.iter().enumerate() {
            if let Some(j) = self.collinear(&point.theta, *n).filter(|j| active[*j]) {
                (columns[g + i], first[g + i]) = (columns[j].clone(), first[j]);
                continue;
            }
            let h = short * data.local_step(*n);
            let mut v = local.clone();
            v[i] += h;
            let lo2 = self.local(&v);
            let motion = match n {
                Nuisance::Zero(_) | Nuisance::Tilt => Motion::Same,
                _ => Motion::Simulated,
            };
            first[g + i] = difference(&phys, &lo2, &v, motion, h, &mut columns[g + i])?.0;
        }
        Some(Part { residual, columns, first, first_speed: trace.first_speed, bare })
    }

    /// How the `trace` of recording `r` changes with each global that is a coefficient of a learned force; None of the others, or where
    /// its motion cannot be followed so.
    fn tangents(
        &self,
        point: &Point,
        r: usize,
        phys: &Physics,
        trace: &Trace,
        active: &[bool],
    ) -> Vec<Option<Tangent>> {
        let ps = &self.model.parameters;
        // most structures hold no such force, and need not be asked parameter by parameter
        if phys.learned_forces == LearnedForces::default() {
            return vec![None; ps.len()];
        }
        let change = |j: usize| {
            let mut theta = point.theta.clone();
            theta[j] += ps[j].step;
            Some((j, Change::between(phys, &self.physics(&theta), ps[j].step)?))
        };
        let moves = (0..ps.len()).filter(|j| active[*j] && ps[*j].dynamic);
        let (of, changes): (Vec<usize>, Vec<Change>) = moves.filter_map(change).unzip();
        let mut all: Vec<Option<Tangent>> = vec![None; ps.len()];
        let local = self.local(&point.locals[r]);
        let found = match changes.is_empty() {
            true => None,
            false => tangents(phys, &self.data.records[r].setup, &local, trace, &changes),
        };
        for (j, tangent) in of.into_iter().zip(found.into_iter().flatten()) {
            all[j] = Some(tangent);
        }
        all
    }

    /// The parameter that is collinear with nuisance `n`, doing to every recording what `n` does to its own: the scale of
    /// the stiffness, where nothing but the hysteresis damping follows it.
    fn collinear(&self, theta: &[f64], n: Nuisance) -> Option<usize> {
        if n != Nuisance::Stiffness {
            return None;
        }
        let j = self.model.parameters.iter().position(|p| p.name == STIFFNESS_SCALE)?;
        let before = self.physics(theta);
        let mut theta = theta.to_vec();
        theta[j] += self.model.parameters[j].step;
        let after = self.physics(&theta);
        let mut scaled = before;
        scaled.law.elastic.stiffness = after.law.elastic.stiffness;
        scaled.law.hysteresis_damping.coefficient = after.law.hysteresis_damping.coefficient;
        let (from, to) = (before.law, after.law);
        let (mu, k) = (from.hysteresis_damping.coefficient, from.elastic.stiffness);
        let ratio = mu * to.elastic.stiffness - to.hysteresis_damping.coefficient * k;
        let alike = ratio.abs() <= 1e-9 * mu * to.elastic.stiffness;
        let mut doubled = from;
        doubled.scale_stiffness(2.0);
        doubled.elastic = from.elastic;
        (scaled == after && alike && doubled == from).then_some(j)
    }

    /// Normal matrix and gradient of a part, priors of the recording included.
    pub(super) fn normal(&self, part: &Part, r: usize, local: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let g = self.model.parameters.len();
        let m = part.columns.len();
        let rec = &self.data.records[r];
        let mut a = DMatrix::zeros(m, m);
        let mut b = DVector::zeros(m);
        for i in 0..m {
            b[i] = dot(&part.columns[i], &part.residual);
        }
        products(&part.columns, 0, |i, j, v| {
            a[(i, j)] = v;
            a[(j, i)] = v;
        });
        for (i, n) in self.nuisances.iter().enumerate() {
            if let Some((mean, s)) = self.data.prior(r, *n) {
                a[(g + i, g + i)] += 1.0 / (s * s);
                b[g + i] += (mean - local[i]) / (s * s);
            }
        }
        if let (true, Some((mean, s))) = (rec.at_first, rec.speed) {
            for i in 0..m {
                b[i] += part.first[i] * (mean - part.first_speed) / (s * s);
                for j in 0..m {
                    a[(i, j)] += part.first[i] * part.first[j] / (s * s);
                }
            }
        }
        (a, b)
    }

    /// One recording's block at a point, with its normal matrix and gradient.
    pub(super) fn block(
        &self,
        point: &Point,
        r: usize,
        active: &[bool],
    ) -> Option<(Block, DMatrix<f64>, DVector<f64>)> {
        let part = self.part(point, r, active)?;
        let (a, b) = self.normal(&part, r, &point.locals[r]);
        let Part { residual, columns, bare, .. } = part;
        let (rest, cross) = (Vec::new(), DMatrix::zeros(0, 0));
        Some((Block { residual, columns, rest, bare, local: None, cross }, a, b))
    }

    /// The normal equations of recording `r` at a point, priors of the recording included. None where the simulation
    /// fails.
    pub(crate) fn normal_equations(&self, point: &Point, r: usize) -> Option<Equations> {
        let (block, a, b) = self.block(point, r, &vec![true; self.model.parameters.len()])?;
        Some(Equations { residual: block.residual, columns: block.columns, a, b })
    }

    /// Linearises at a point.
    pub fn linearise(&self, point: &Point) -> Option<Linear> {
        let ps = &self.model.parameters;
        let g = ps.len();
        // what sits at a bound has no freedom there
        let active: Vec<bool> = (0..g).map(|j| point.theta[j] > ps[j].lower && point.theta[j] < ps[j].upper).collect();
        let mut s = DMatrix::<f64>::zeros(g, g);
        let mut q = DVector::<f64>::zeros(g);
        for (j, p) in ps.iter().enumerate() {
            if let Some((m, sd)) = p.prior {
                s[(j, j)] += 1.0 / (sd * sd);
                q[j] += (m - point.theta[j]) / (sd * sd);
            }
            if !active[j] {
                s[(j, j)] += 1.0;
                q[j] = 0.0;
            }
        }
        let mut blocks = Vec::new();
        let mut own = Vec::new();
        let made: Vec<_> =
            (0..self.data.records.len()).into_par_iter().map(|r| self.block(point, r, &active)).collect();
        for made in made {
            let (mut b, a, gradient) = made?;
            let e = Eliminated::new(&a, &gradient, g)?;
            s += e.normal;
            q += e.gradient;
            b.local = Some(e.local);
            b.cross = e.cross;
            blocks.push(b);
            own.push(e.alone);
        }
        for j in 0..g {
            s[(j, j)] *= 1.0 + 1e-10;
        }
        let reduced = s.cholesky();
        let global = reduced.as_ref().map_or_else(|| DVector::zeros(g), |ch| ch.solve(&q));
        for (b, own) in blocks.iter_mut().zip(&own) {
            let local = match &b.local {
                Some(ch) => own - ch.solve(&(&b.cross * &global)),
                None => own.clone(),
            };
            b.rest.clone_from(&b.residual);
            for (x, column) in global.iter().chain(local.iter()).zip(&b.columns) {
                add_scaled(&mut b.rest, -x, column);
            }
        }
        Some(Linear { blocks, reduced })
    }

    /// Covariance of the globals at a point, nuisances eliminated.
    pub fn covariance(&self, point: &Point) -> Option<DMatrix<f64>> {
        Some(self.linearise(point)?.reduced?.inverse())
    }

    /// Whitened change of the readings of every recording when the physics is `change`d by hand, from the point at
    /// which `linear` was made.
    pub fn signature(
        &self,
        linear: &Linear,
        point: &Point,
        change: &dyn Fn(&mut Physics),
        h: f64,
    ) -> Option<Vec<Vec<f64>>> {
        let mut other = self.physics(&point.theta);
        change(&mut other);
        let mut out = Vec::new();
        for (r, rec) in self.data.records.iter().enumerate() {
            let t = simulate(&other, &rec.setup, &self.local(&point.locals[r]));
            if !t.ok {
                return None;
            }
            let mut y = readings(&other, &t, &rec.setup.time);
            for c in 0..3 {
                for (u, v) in y[c].iter_mut().zip(&linear.blocks[r].bare[c]) {
                    *u = (*u - v) / h;
                }
            }
            let mut w = Vec::new();
            self.whiten_into(r, &y, None, &mut w);
            out.push(w);
        }
        Some(out)
    }

    /// Squared distance of the globals from the optimum in standard errors, by Gauss and Newton's step:
    /// g' S^-1 g of the gradient with everything of the recordings eliminated. What a bound holds takes no part.
    ///
    /// None where the simulation or the normal matrix fails.
    pub fn decrement(&self, point: &Point) -> Option<f64> {
        let ps = &self.model.parameters;
        let g = ps.len();
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
            let e = Eliminated::new(&a, &b, g)?;
            s += e.normal;
            q += e.gradient;
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
}

impl Linear {
    /// (s.r, |s|^2 with everything fitted projected out) of a signature.
    pub fn score(&self, s: &[Vec<f64>]) -> (f64, f64) {
        let g = self.blocks[0].cross.ncols();
        let mut sr = 0.0;
        let mut ss = 0.0;
        let mut b = DVector::<f64>::zeros(g);
        for (bl, s) in self.blocks.iter().zip(s) {
            sr += dot(s, &bl.rest);
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

    /// A signature with everything fitted projected out.
    pub fn project(&self, s: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let g = self.blocks[0].cross.ncols();
        let mut b = DVector::<f64>::zeros(g);
        let locals: Vec<DVector<f64>> = self
            .blocks
            .iter()
            .zip(s)
            .map(|(bl, s)| {
                let l = bl.columns.len() - g;
                let local = DVector::from_iterator(l, (0..l).map(|i| dot(s, &bl.columns[g + i])));
                if let Some(ch) = &bl.local {
                    b -= bl.cross.transpose() * ch.solve(&local);
                }
                for j in 0..g {
                    b[j] += dot(s, &bl.columns[j]);
                }
                local
            })
            .collect();
        let global = self.reduced.as_ref().map_or_else(|| DVector::zeros(g), |ch| ch.solve(&b));
        self.blocks
            .iter()
            .zip(s)
            .zip(&locals)
            .map(|((bl, s), local)| {
                let mut out = s.clone();
                for j in 0..g {
                    add_scaled(&mut out, -global[j], &bl.columns[j]);
                }
                if let Some(ch) = &bl.local {
                    let x = ch.solve(&(local - &bl.cross * &global));
                    for (i, x) in x.iter().enumerate() {
                        add_scaled(&mut out, -x, &bl.columns[g + i]);
                    }
                }
                out
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::{Data, Model, Parameter};
    use plant::integrate::Control;
    use plant::simulate::{tolerance, Setup};
    use record::Channel;

    /// A bar of 0.3 kg that a spring throws against its stop, where it bounces.
    fn bouncing() -> Data {
        let time: Vec<f64> = (0..1500).map(|i| 1e-5 * f64::from(i)).collect();
        let n = time.len();
        let setup = Setup {
            kind: Kind::ContactorOpening,
            travel: 3e-3,
            preload: 90.0,
            rate: 3e3,
            control: Control::dense(tolerance(Kind::ContactorOpening)),
            ..Setup::drop_test(time, 2e-4, 1.0, 4e-4)
        };
        Data::of_force(setup, 0.3, 1e3, vec![0.0; n])
    }

    /// A friction that counts in units of 100 N, beside a law that is known; differences by a step of so many units.
    fn friction(step: f64) -> Model<'static> {
        let friction = Parameter { name: "friction".into(), lower: 0.0, upper: 1.0, step, prior: None, dynamic: true };
        let apply = |t: &[f64], p: &mut Physics| {
            (p.law.elastic.stiffness, p.law.elastic.exponent, p.law.hysteresis_damping.coefficient) = (3e7, 1.2, 6e6);
            p.guide_friction.coulomb = 100.0 * t[0];
        };
        Model::new(vec![friction], apply)
    }

    /// Sensitivity of the force to it.
    fn sensitivity(data: &Data, step: f64) -> Vec<f64> {
        let model = friction(step);
        let problem = Problem::new(data, &model);
        let mut part = problem.part(&problem.start(vec![0.02]), 0, &[true]).unwrap();
        part.columns.swap_remove(0)
    }

    #[test]
    fn chi2_of_a_body_that_bounces_has_no_steps_of_its_own() {
        let model = friction(1e-3);
        let mut data = bouncing();
        let recorded = Problem::new(&data, &model).predict(&[0.02], 0, &data.local_start(0)).1;
        data.records[0].y[0] = Some(recorded[0].clone());
        let problem = Problem::new(&data, &model);
        let chi2: Vec<f64> = (0..40).map(|i| problem.start(vec![0.03 + 1e-5 * f64::from(i)]).chi2).collect();
        let differences = |v: &[f64]| v.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>();
        let first = differences(&chi2);
        let second = differences(&first);
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(largest(&second) < 0.01 * largest(&first), "{chi2:?}");
    }

    #[test]
    fn a_step_that_shifts_a_bounce_is_shortened_until_its_difference_is_a_sensitivity() {
        let data = bouncing();
        assert!(data.has(Channel::Force));
        let tangent = sensitivity(&data, 1e-4);
        let apart = |s: &[f64]| {
            let square = |v: f64| v * v;
            let off: f64 = s.iter().zip(&tangent).map(|(a, b)| square(a - b)).sum();
            (off / dot(&tangent, &tangent)).sqrt()
        };
        // two newtons more shift the last bounce by a share of its duration
        let by_step = sensitivity(&data, 0.02 / BOUNCING);
        assert!(apart(&by_step) < 0.1, "{}", apart(&by_step));
    }
}
