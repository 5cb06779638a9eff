//! The evidence of a fitted structure: the probability of the recordings under it, its parameters integrated out, with a
//! discrepancy of unknown shape in the likelihood (Kennedy and O'Hagan 2001; Laplace's approximation: MacKay 1992,
//! Kass and Raftery 1995, eq. 5).
//!
//! residual = J d(theta) + B c + E e + D d + noise; B: columns that all recordings share, c normal with the discrepancy's
//! size; E: columns of each recording alone, e normal with a size of their own; D: disturbances of its instruments, d
//! standard normal. What has no prior counts as even between its bounds.

use crate::discrepancy::{Columns, Disturbed, Paths};
use crate::fitted::{overdispersion_of, Fitted, MOST};
use crate::problem::{Equations, Parameter};
use crate::response::Place;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use plant::kernels::{add_scaled, dot, products};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Normal equations of one recording: globals, shared columns, nuisances, own columns place by place, disturbances.
struct Part {
    a: DMatrix<f64>,
    b: DVector<f64>,
    residual: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// A fit with its normal equations, discrepancy included.
pub struct Evidence<'a> {
    fitted: &'a Fitted,
    parts: Vec<Part>,
    globals: usize,
    shared: usize,
    locals: usize,
    /// Columns of each recording alone, at each place asked for.
    own: Vec<usize>,
    /// Columns of each disturbance of a channel.
    disturbances: Vec<(Disturbed, usize)>,
    /// Globals that rest at a bound.
    held: Vec<bool>,
}

/// The normal equations of globals and shared columns, with what belongs to one recording eliminated.
pub struct Reduced<'a> {
    of: &'a Evidence<'a>,
    /// Indices, in a part, of what is eliminated.
    eliminated: Vec<usize>,
    /// (C^-1 A, C^-1 b) of each recording's eliminated part.
    inner: Vec<(DMatrix<f64>, DVector<f64>)>,
    a: DMatrix<f64>,
    b: DVector<f64>,
    /// b' C^-1 b, and ln det C less the precisions', of what is eliminated.
    fall: f64,
    ln_det: f64,
}

/// The reduced equations solved at a size of the discrepancy.
struct Solved {
    step: DVector<f64>,
    gradient: DVector<f64>,
    fall: f64,
    ln_det: f64,
}

impl<'a> Evidence<'a> {
    /// Of a fit whose recordings hold noise alone: nothing that they share, nothing of their own, no disturbance. None where the
    /// simulation fails.
    pub fn of_noise(fitted: &'a Fitted) -> Option<Evidence<'a>> {
        let globals = fitted.structure.model().parameters.len();
        Evidence::of_parts(fitted, |_, equations| part(equations, globals, &[], Vec::new()))
    }

    /// Of a fit, each recording with something of its own at each of `places`, and with channels that may be `disturbed`. None
    /// where the simulation fails.
    pub fn new(fitted: &'a Fitted, places: &[Place], disturbed: &[Disturbed]) -> Option<Evidence<'a>> {
        let paths = Paths::new(fitted)?;
        let shared = paths.shared();
        let disturbances: Vec<(Disturbed, Columns)> = disturbed.iter().map(|d| (*d, paths.disturbed(*d))).collect();
        let own: Vec<Columns> = places.iter().map(|p| paths.own(*p)).collect();
        let globals = fitted.structure.model().parameters.len();
        let wide = |r: usize, equations: Equations| {
            let disturbances = disturbances.iter().map(|d| &d.1);
            let alone = own.iter().chain(disturbances).flat_map(|columns| columns[r].iter().cloned());
            part(equations, globals, &shared[r], alone.collect())
        };
        let count = |columns: &Columns| columns.first().map_or(0, Vec::len);
        Some(Evidence {
            shared: count(&shared),
            own: own.iter().map(count).collect(),
            disturbances: disturbances.iter().map(|(d, columns)| (*d, count(columns))).collect(),
            ..Evidence::of_parts(fitted, wide)?
        })
    }

    /// The equations of every recording at the end of a fit, each made a part by `part`.
    fn of_parts(fitted: &'a Fitted, part: impl Fn(usize, Equations) -> Part + Sync) -> Option<Evidence<'a>> {
        let problem = fitted.problem();
        let point = fitted.point();
        let all = (0..fitted.data.records.len()).into_par_iter();
        let parts: Option<Vec<Part>> =
            all.map(|r| problem.normal_equations(point, r).map(|equations| part(r, equations))).collect();
        let at_bound = |(p, x): (&Parameter, &f64)| *x <= p.lower || *x >= p.upper;
        Some(Evidence {
            fitted,
            parts: parts?,
            globals: problem.model.parameters.len(),
            shared: 0,
            locals: problem.nuisances().len(),
            own: Vec::new(),
            disturbances: Vec::new(),
            held: problem.model.parameters.iter().zip(&point.theta).map(at_bound).collect(),
        })
    }

    /// The equations with the nuisances eliminated; with them what each recording has of its own, `own`: the index of its
    /// place and its size as a share of the campaign's peak; and the channels that are `disturbed`.
    ///
    /// None where the normal matrix is singular.
    pub fn beside(&self, own: Option<(usize, f64)>, disturbed: &[Disturbed]) -> Option<Reduced<'_>> {
        let (g, m, l) = (self.globals, self.shared, self.locals);
        let mut eliminated: Vec<usize> = (g + m..g + m + l).collect();
        // with the precision of each
        let mut precision = vec![0.0; l];
        let first = |place: usize| g + m + l + self.own[..place].iter().sum::<usize>();
        if let Some((place, size)) = own {
            eliminated.extend(first(place)..first(place + 1));
            precision.resize(eliminated.len(), size.powi(-2));
        }
        let mut from = first(self.own.len());
        for (of, columns) in &self.disturbances {
            if disturbed.contains(of) {
                eliminated.extend(from..from + columns);
            }
            from += columns;
        }
        precision.resize(eliminated.len(), 1.0);
        let n = g + m;
        let (mut a, mut b) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        let (mut fall, mut ln_det) = (0.0, 0.0);
        let mut inner = Vec::with_capacity(self.parts.len());
        for p in &self.parts {
            let mut c =
                DMatrix::from_fn(eliminated.len(), eliminated.len(), |i, j| p.a[(eliminated[i], eliminated[j])]);
            for i in 0..eliminated.len() {
                c[(i, i)] += 1e-12 * (1.0 + c[(i, i)]) + precision[i];
            }
            let cross = DMatrix::from_fn(eliminated.len(), n, |i, j| p.a[(eliminated[i], j)]);
            let right = DVector::from_fn(eliminated.len(), |i, _| p.b[eliminated[i]]);
            let ch = c.cholesky()?;
            let (x, y) = (ch.solve(&cross), ch.solve(&right));
            a += p.a.view((0, 0), (n, n)) - cross.tr_mul(&x);
            b += p.b.rows(0, n) - cross.tr_mul(&y);
            fall += right.dot(&y);
            ln_det += ln_det_of(&ch) - precision.iter().filter(|p| **p > 0.0).map(|p| p.ln()).sum::<f64>();
            inner.push((x, y));
        }
        let theta = &self.fitted.point().theta;
        for (j, p) in self.fitted.structure.model().parameters.iter().enumerate() {
            if let Some((mean, sd)) = p.prior {
                a[(j, j)] += sd.powi(-2);
                b[j] += (mean - theta[j]) / (sd * sd);
            }
        }
        Some(Reduced { of: self, eliminated, inner, a, b, fall, ln_det })
    }
}

impl Reduced<'_> {
    fn solve(&self, size: f64) -> Option<Solved> {
        let g = self.of.globals;
        let n = if size > 0.0 { g + self.of.shared } else { g };
        let mut a = self.a.view((0, 0), (n, n)).into_owned();
        let mut b = self.b.rows(0, n).into_owned();
        for j in g..n {
            a[(j, j)] += size.powi(-2);
        }
        let gradient = b.clone();
        for j in (0..g).filter(|j| self.of.held[*j]) {
            a.row_mut(j).fill(0.0);
            a.column_mut(j).fill(0.0);
            a[(j, j)] = 1.0;
            b[j] = 0.0;
        }
        for j in 0..n {
            a[(j, j)] *= 1.0 + 1e-10;
        }
        let ch = a.cholesky()?;
        let step = ch.solve(&b);
        let fall = self.fall + b.dot(&step);
        Some(Solved { step, gradient, fall, ln_det: self.ln_det + ln_det_of(&ch) })
    }

    /// ln of the evidence, less what all structures of one campaign have in common, with a discrepancy of `size` that all
    /// recordings share (share of force and of the largest readings, 1; 0: none).
    ///
    /// None where the normal matrix is singular.
    pub fn ln(&self, size: f64) -> Option<f64> {
        let solved = self.solve(size)?;
        let fitted = self.of.fitted;
        let mut ln = -0.5 * fitted.chi2() + 0.5 * solved.fall - 0.5 * solved.ln_det;
        for (j, p) in fitted.structure.model().parameters.iter().enumerate() {
            let width = p.upper - p.lower;
            ln += match (p.prior, self.of.held[j]) {
                (Some((_, sd)), _) => -sd.ln(),
                (None, false) => 0.5 * TAU.ln() - width.ln(),
                // falls off from the bound as its gradient says
                (None, true) => -(width * solved.gradient[j].abs()).max(1.0).ln(),
            };
        }
        if size > 0.0 {
            ln -= self.of.shared as f64 * size.ln();
        }
        ln.is_finite().then_some(ln)
    }

    /// Nats that the fit would still gain without a discrepancy, as its linearised equations have it: half the square of the
    /// Newton decrement (Boyd and Vandenberghe 2004, eq. 9.29). Next to none where a fit has come to its end; a step along a
    /// curved valley may gain too little to see while much is left. None where the normal matrix is singular.
    pub fn pending(&self) -> Option<f64> {
        Some(0.5 * self.solve(0.0)?.fall)
    }

    /// Overdispersion of what is left once parameters, discrepancy and nuisances have moved to where they are likeliest.
    pub fn overdispersion(&self, size: f64) -> Option<f64> {
        let solved = self.solve(size)?;
        let n = solved.step.len();
        let of = self.of.parts.iter().zip(&self.inner).enumerate();
        let left: Vec<(usize, Vec<f64>)> = of
            .map(|(r, (p, (x, y)))| {
                let mut e = p.residual.clone();
                for (column, by) in p.columns.iter().zip(solved.step.iter()) {
                    add_scaled(&mut e, -by, column);
                }
                let inner = y - x.columns(0, n) * &solved.step;
                for (at, by) in self.eliminated.iter().zip(inner.iter()) {
                    add_scaled(&mut e, -by, &p.columns[*at]);
                }
                (self.of.fitted.data.records[r].setup.time.len(), e)
            })
            .collect();
        Some(overdispersion_of(left.iter().map(|(n, e)| (*n, &e[..])), MOST))
    }
}

fn ln_det_of(ch: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * ch.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
}

/// A recording's normal equations, widened by columns that all share and by its own.
fn part(of: Equations, globals: usize, shared: &[Vec<f64>], own: Vec<Vec<f64>>) -> Part {
    let Equations { residual, columns, a, b } = of;
    let mut all: Vec<Vec<f64>> = Vec::with_capacity(columns.len() + shared.len() + own.len());
    // where the old ones stand among the new
    let mut from: Vec<Option<usize>> = Vec::new();
    for (j, c) in columns.into_iter().enumerate() {
        if j == globals {
            all.extend(shared.iter().cloned());
            from.extend(shared.iter().map(|_| None));
        }
        all.push(c);
        from.push(Some(j));
    }
    from.extend(own.iter().map(|_| None));
    all.extend(own);
    let n = all.len();
    let right = DVector::from_fn(n, |i, _| from[i].map_or_else(|| dot(&all[i], &residual), |k| b[k]));
    let mut wide = DMatrix::zeros(n, n);
    let mut put = |i: usize, j: usize, v: f64| {
        wide[(i, j)] = v;
        wide[(j, i)] = v;
    };
    products(&all, globals, &mut put);
    // what the equations hold has the priors of the recording besides
    let known: Vec<(usize, usize)> = from.iter().enumerate().filter_map(|(i, k)| Some((i, (*k)?))).collect();
    for (i, p) in &known {
        known.iter().filter(|(j, _)| j <= i).for_each(|(j, q)| put(*i, *j, a[(*p, *q)]));
    }
    Part { a: wide, b: right, residual, columns: all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::Prepared;
    use plant::recipe::{write_campaign, Recipe};

    fn fitted() -> Fitted {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let fit = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
        // two recordings are enough
        let few = std::sync::Arc::new(fit.data.subset(|r| r < 2));
        let start = crate::problem::Problem::new(&few, fit.structure.model())
            .evaluate(fit.point().theta.clone(), fit.point().locals[..2].to_vec());
        Fitted::from(&few, fit.structure.clone(), start, &crate::problem::Options::default())
    }

    /// b' A^-1 b and ln det A of all recordings' normal equations in one matrix, nothing eliminated, every column in it.
    fn dense(e: &Evidence<'_>, size: f64, own_size: f64) -> (f64, f64) {
        let (g, m) = (e.globals, e.shared);
        let own = e.own.iter().sum::<usize>();
        let alone = e.locals + own + e.disturbances.iter().map(|d| d.1).sum::<usize>();
        let n = g + m + alone * e.parts.len();
        let (mut a, mut b) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (r, p) in e.parts.iter().enumerate() {
            let at = |i: usize| if i < g + m { i } else { i + alone * r };
            for i in 0..p.b.len() {
                b[at(i)] += p.b[i];
                for j in 0..p.b.len() {
                    a[(at(i), at(j))] += p.a[(i, j)];
                }
                if i >= g + m {
                    a[(at(i), at(i))] += 1e-12 * (1.0 + p.a[(i, i)]);
                }
                if i >= g + m + e.locals {
                    let of_own = i - (g + m + e.locals) < own;
                    a[(at(i), at(i))] += if of_own { own_size.powi(-2) } else { 1.0 };
                }
            }
        }
        let theta = &e.fitted.point().theta;
        for (j, q) in e.fitted.structure.model().parameters.iter().enumerate() {
            if let Some((mean, sd)) = q.prior {
                a[(j, j)] += sd.powi(-2);
                b[j] += (mean - theta[j]) / (sd * sd);
            }
        }
        for j in g..g + m {
            a[(j, j)] += size.powi(-2);
        }
        let ch = a.cholesky().unwrap();
        (b.dot(&ch.solve(&b)), ln_det_of(&ch) + 2.0 * (own * e.parts.len()) as f64 * own_size.ln())
    }

    #[test]
    fn what_is_eliminated_recording_by_recording_is_what_one_large_matrix_gives() {
        let f = fitted();
        let e = Evidence::new(&f, &[Place::Contact], &Disturbed::all(&f.data)).unwrap();
        assert!(e.held.iter().all(|h| !h));
        let (size, own) = (0.01, 0.03);
        let solved = e.beside(Some((0, own)), &Disturbed::all(&f.data)).unwrap().solve(size).unwrap();
        let (fall, ln_det) = dense(&e, size, own);
        assert!((solved.fall - fall).abs() < 1e-6 * fall.abs().max(1.0), "{} {fall}", solved.fall);
        assert!((solved.ln_det - ln_det).abs() < 1e-6 * ln_det.abs(), "{} {ln_det}", solved.ln_det);
    }

    #[test]
    fn noise_alone_prefers_no_discrepancy_and_a_vanishing_one_is_none() {
        let f = fitted();
        let e = Evidence::new(&f, &[], &[]).unwrap();
        let reduced = e.beside(None, &[]).unwrap();
        let ln = |size: f64| reduced.ln(size).unwrap();
        assert!((ln(1e-9) - ln(0.0)).abs() < 0.1, "{} {}", ln(1e-9), ln(0.0));
        assert!(ln(0.0) > ln(0.01) && ln(0.01) > ln(0.1), "{} {} {}", ln(0.0), ln(0.01), ln(0.1));
    }
}
