//! Levenberg (1944) and Marquardt (1963), the recordings' nuisances eliminated; sensitivities renewed by differences
//! only where Broyden's (1965) update of them no longer foretells the fall of chi^2.

use super::{Nuisance, Point, Problem};
use nalgebra::{DMatrix, DVector};
use plant::kernels::{add_scaled, dot};
use rayon::prelude::*;

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

/// Options of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub iterations: usize,
    /// Relative change of chi^2 at which it has converged.
    pub tolerance: f64,
    /// Give up after six iterations when chi^2 has not fallen by this much.
    pub hopeless: f64,
    /// Give up after as many when chi^2 still lies above.
    pub ceiling: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options { iterations: 30, tolerance: 1e-5, hopeless: 0.0, ceiling: f64::INFINITY }
    }
}

/// Residual and sensitivities of one recording.
pub(super) struct Part {
    pub residual: Vec<f64>,
    /// Whitened sensitivities: globals first, then locals.
    pub columns: Vec<Vec<f64>>,
    /// Sensitivities of the speed at the first sample, and that speed, m/s.
    pub first: Vec<f64>,
    pub first_speed: f64,
    /// Readings without the channels' zeros.
    pub bare: [Vec<f64>; 3],
}

/// Steps for which updated sensitivities may serve.
const STALE: usize = 3;
/// Share of the fall foretold from which they may go on serving.
const FORETOLD: f64 = 0.5;

impl Part {
    /// Takes the sensitivities to where step `d` has led, by what the residual did on the way (Broyden 1965), and
    /// returns the squared residual they had foretold. `weight`: scale of each parameter in the step's length.
    fn follow(&mut self, d: &[f64], weight: &[f64], residual: Vec<f64>, first_speed: f64) -> f64 {
        let mut expected = self.residual.clone();
        for (c, d) in self.columns.iter().zip(d) {
            if *d != 0.0 {
                add_scaled(&mut expected, -d, c);
            }
        }
        let foretold = dot(&expected, &expected);
        let length: f64 = d.iter().zip(weight).map(|(d, w)| d * d * w).sum();
        if length > 0.0 {
            // what the model changed beyond what the sensitivities said
            for (e, r) in expected.iter_mut().zip(&residual) {
                *e -= r;
            }
            let first_more =
                first_speed - self.first_speed - d.iter().zip(&self.first).map(|(d, f)| d * f).sum::<f64>();
            for (j, c) in self.columns.iter_mut().enumerate() {
                let share = d[j] * weight[j] / length;
                if share != 0.0 {
                    add_scaled(c, share, &expected);
                    self.first[j] += share * first_more;
                }
            }
        }
        self.residual = residual;
        self.first_speed = first_speed;
        foretold
    }
}

/// A trial step: where it leads, what remains there, and the change of each recording's parameters.
struct Trial {
    point: Point,
    residuals: Vec<(Vec<f64>, f64)>,
    change: Vec<Vec<f64>>,
}

impl Problem<'_> {
    /// Minimises chi^2 from `point`; ends where it is when the data's budget is over.
    pub fn fit(&self, mut point: Point, options: &Options) -> Fit {
        let ps = &self.model.parameters;
        let (g, nr) = (ps.len(), self.data.records.len());
        let mut lambda = 1e-3;
        let mut objective = vec![point.chi2];
        let mut converged = false;
        let mut iterations = 0;
        let samples = self.data.samples();
        let first_chi2 = point.chi2;
        let mut small = 0;
        let mut parts: Vec<Part> = Vec::new();
        let mut stale = 0;
        let all = vec![true; g];
        let over = || self.data.budget.over().is_some();
        'outer: while iterations < options.iterations && point.chi2.is_finite() && !over() {
            iterations += 1;
            if parts.is_empty() {
                let part = |r: usize| if over() { None } else { self.part(&point, r, &all) };
                let made: Option<Vec<_>> = (0..nr).into_par_iter().map(part).collect();
                let Some(made) = made else { break 'outer };
                parts = made;
                stale = 0;
            }
            let normals: Vec<_> =
                parts.par_iter().enumerate().map(|(r, p)| self.normal(p, r, &point.locals[r])).collect();
            let mut tries = 0;
            loop {
                tries += 1;
                if over() {
                    break 'outer;
                }
                let trial = self.step(&point, &normals, lambda);
                let mut accepted = false;
                if let Some(t) = trial {
                    let next = t.point;
                    if next.chi2 < point.chi2 {
                        let gain = point.chi2 - next.chi2;
                        let fresh = stale == 0;
                        let foretold: f64 = parts
                            .par_iter_mut()
                            .zip(t.residuals)
                            .enumerate()
                            .map(|(r, (part, (residual, speed)))| {
                                let weight: Vec<f64> =
                                    (0..t.change[r].len()).map(|j| normals[r].0[(j, j)].max(1e-30)).collect();
                                let squares = part.follow(&t.change[r], &weight, residual, speed);
                                squares + self.prior_terms(r, &next.locals[r], speed)
                            })
                            .collect::<Vec<f64>>()
                            .iter()
                            .sum::<f64>()
                            + self.global_prior(&next.theta);
                        stale += 1;
                        if stale > STALE || gain < FORETOLD * (point.chi2 - foretold) {
                            parts.clear();
                        }
                        point = next;
                        objective.push(point.chi2);
                        lambda = (lambda * 0.1).max(1e-9);
                        accepted = true;
                        small = if gain < options.tolerance * point.chi2 + 1e-3 { small + 1 } else { 0 };
                        if small >= 2 {
                            if fresh {
                                converged = true;
                            } else {
                                // sensitivities of its own have to agree that nothing more is to be gained
                                parts.clear();
                                small = 1;
                            }
                        }
                    } else if stale == 0 && next.chi2.is_finite() && next.chi2 - point.chi2 < 1e-7 * point.chi2 {
                        converged = true;
                    }
                }
                if accepted || converged {
                    break;
                }
                if stale > 0 {
                    parts.clear();
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
            let fallen = first_chi2 - point.chi2;
            if iterations == 6 && (options.hopeless > 0.0 && fallen < options.hopeless || point.chi2 > options.ceiling)
            {
                break;
            }
        }
        Fit { point, iterations, converged, objective, samples }
    }

    /// The damped step from `point`; None where the normal matrix fails.
    fn step(&self, point: &Point, normals: &[(DMatrix<f64>, DVector<f64>)], lambda: f64) -> Option<Trial> {
        let ps = &self.model.parameters;
        let (g, l, nr) = (ps.len(), self.nuisances.len(), normals.len());
        let mut q = DVector::<f64>::zeros(g);
        let mut s = DMatrix::<f64>::zeros(g, g);
        for (j, p) in ps.iter().enumerate() {
            if let Some((m, sd)) = p.prior {
                s[(j, j)] += 1.0 / (sd * sd);
                q[j] += (m - point.theta[j]) / (sd * sd);
            }
        }
        for (a, b) in normals {
            s += a.view((0, 0), (g, g));
            q += b.rows(0, g);
        }
        // parameters held at a bound by their gradient take no step
        let held: Vec<bool> = (0..g)
            .map(|j| (point.theta[j] <= ps[j].lower && q[j] <= 0.0) || (point.theta[j] >= ps[j].upper && q[j] >= 0.0))
            .collect();
        for j in 0..g {
            s[(j, j)] += lambda * s[(j, j)] + 1e-12;
        }
        let mut solved = Vec::with_capacity(nr);
        for (a, b) in normals {
            let mut c = a.view((g, g), (l, l)).into_owned();
            for i in 0..l {
                c[(i, i)] += lambda * a[(g + i, g + i)] + 1e-12 * (1.0 + a[(g + i, g + i)]);
            }
            let bt = a.view((g, 0), (l, g)).into_owned();
            let ch = c.cholesky()?;
            let x = ch.solve(&bt);
            let y = ch.solve(&b.rows(g, l).into_owned());
            s -= bt.transpose() * &x;
            q -= bt.transpose() * &y;
            solved.push((x, y));
        }
        for j in (0..g).filter(|j| held[*j]) {
            s.row_mut(j).fill(0.0);
            s.column_mut(j).fill(0.0);
            s[(j, j)] = 1.0;
            q[j] = 0.0;
        }
        let step = s.cholesky()?.solve(&q);
        let theta: Vec<f64> = (0..g).map(|j| (point.theta[j] + step[j]).clamp(ps[j].lower, ps[j].upper)).collect();
        let global = DVector::from_iterator(g, (0..g).map(|j| theta[j] - point.theta[j]));
        let mut change = Vec::with_capacity(nr);
        let locals: Vec<Vec<f64>> = solved
            .iter()
            .zip(&point.locals)
            .map(|((x, y), from)| {
                let d = y - x * &global;
                let to: Vec<f64> = (0..l).map(|i| self.stepped(i, from[i], d[i])).collect();
                change.push(global.iter().cloned().chain(to.iter().zip(from).map(|(a, b)| a - b)).collect());
                to
            })
            .collect();
        let (point, residuals) = self.look(theta, locals);
        Some(Trial { point, residuals, change })
    }

    /// Nuisance `i` after a step `by` from `from`: a speed keeps its order of magnitude.
    fn stepped(&self, i: usize, from: f64, by: f64) -> f64 {
        let to = from + by;
        match self.nuisances[i] {
            Nuisance::Speed => to.clamp(0.5 * from.abs(), 2.0 * from.abs()),
            _ => to,
        }
    }

    /// A point with what remains of each recording there, and its speed at the first sample.
    fn look(&self, theta: Vec<f64>, locals: Vec<Vec<f64>>) -> (Point, Vec<(Vec<f64>, f64)>) {
        let looks: Vec<(Vec<f64>, f64, f64)> = locals
            .par_iter()
            .enumerate()
            .map(|(r, l)| {
                let (t, y) = self.predict(&theta, r, l);
                let mut w = Vec::new();
                if !t.ok {
                    return (w, 0.0, f64::INFINITY);
                }
                self.whiten_into(r, &y, Some(&self.data.records[r].y), &mut w);
                let chi2 = dot(&w, &w) + self.prior_terms(r, l, t.first_speed);
                (w, t.first_speed, chi2)
            })
            .collect();
        let mut chi2 = self.global_prior(&theta) + looks.iter().map(|l| l.2).sum::<f64>();
        if !chi2.is_finite() {
            chi2 = f64::INFINITY;
        }
        (Point { theta, locals, chi2 }, looks.into_iter().map(|(w, v, _)| (w, v)).collect())
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
            if self.data.budget.over().is_some() {
                break;
            }
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
                    w[*gi] = self.stepped(*gi, v[*gi], d[i]);
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
}
