//! The evidence of a fitted structure: the probability of the recordings under it, its parameters integrated out, with a
//! discrepancy of unknown shape in the likelihood (Kennedy and O'Hagan 2001; Laplace's approximation: MacKay 1992,
//! Kass and Raftery 1995, eq. 5).
//!
//! residual = J d(theta) + B c + E e + D d + noise; B: columns that all recordings share, c normal with the discrepancy's
//! size; E: columns of each recording alone, e normal with a size of their own; D: what its instruments may do, d standard
//! normal. What has no prior counts as even between its bounds.

use crate::discrepancy::Columns;
use crate::fitted::{overdispersion_of, Fitted, MOST};
use crate::problem::Equations;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use plant::kernels::{add_scaled, dot};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Normal equations of one recording: globals, shared columns, nuisances, own columns, instruments'.
struct Part {
    a: DMatrix<f64>,
    b: DVector<f64>,
    residual: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// What the likelihood holds beside the structure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beside {
    /// Size of the discrepancy that all recordings share, as a share of force and of the largest readings, 1; 0: none.
    pub size: f64,
    /// The same of what each recording has of its own.
    pub own: f64,
    /// Whether instruments may drift and hum.
    pub instruments: bool,
}

/// A fit with its normal equations, discrepancy included.
pub struct Evidence<'a> {
    fitted: &'a Fitted,
    parts: Vec<Part>,
    globals: usize,
    shared: usize,
    locals: usize,
    own: usize,
    instruments: usize,
    /// Globals that rest at a bound.
    held: Vec<bool>,
}

/// The reduced system at given sizes.
struct Solved {
    /// Indices of globals and shared columns, and of nuisances and own columns, in a part.
    kept: Vec<usize>,
    eliminated: Vec<usize>,
    /// (C^-1 A, C^-1 b) of each recording's eliminated part.
    inner: Vec<(DMatrix<f64>, DVector<f64>)>,
    step: DVector<f64>,
    gradient: DVector<f64>,
    /// b' A^-1 b, and ln det A of what is active.
    fall: f64,
    ln_det: f64,
}

impl<'a> Evidence<'a> {
    /// Of a fit, with `shared` columns, each recording's `own` and those of its `instruments`. None where the simulation
    /// fails.
    pub fn new(
        fitted: &'a Fitted,
        shared: &Columns,
        own: Option<&Columns>,
        instruments: Option<&Columns>,
    ) -> Option<Evidence<'a>> {
        let problem = fitted.problem();
        let point = fitted.point();
        let globals = problem.model.parameters.len();
        let locals = problem.nuisances().len();
        let parts: Option<Vec<Part>> = (0..fitted.data.records.len())
            .into_par_iter()
            .map(|r| {
                let equations = problem.normal_equations(point, r)?;
                let of = |columns: Option<&'_ Columns>| columns.map_or(Vec::new(), |c| c[r].clone());
                Some(part(equations, globals, &shared[r], [of(own), of(instruments)].concat()))
            })
            .collect();
        let at_bound = |(p, x): (&crate::problem::Parameter, &f64)| *x <= p.lower || *x >= p.upper;
        Some(Evidence {
            fitted,
            parts: parts?,
            globals,
            shared: shared.first().map_or(0, Vec::len),
            locals,
            own: own.and_then(|o| o.first()).map_or(0, Vec::len),
            instruments: instruments.and_then(|o| o.first()).map_or(0, Vec::len),
            held: problem.model.parameters.iter().zip(&point.theta).map(at_bound).collect(),
        })
    }

    fn solve(&self, beside: Beside) -> Option<Solved> {
        let Beside { size, own, instruments } = beside;
        let (g, m, l) = (self.globals, self.shared, self.locals);
        let kept: Vec<usize> = if size > 0.0 { (0..g + m).collect() } else { (0..g).collect() };
        let last = g + m + l + self.own;
        let mut eliminated: Vec<usize> = (g + m..g + m + l).collect();
        // with the precision of each
        let mut precision = vec![0.0; l];
        if own > 0.0 {
            eliminated.extend(g + m + l..last);
            precision.resize(eliminated.len(), own.powi(-2));
        }
        if instruments {
            eliminated.extend(last..last + self.instruments);
            precision.resize(eliminated.len(), 1.0);
        }
        let n = kept.len();
        let (mut s, mut q) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        let (mut fall, mut ln_det) = (0.0, 0.0);
        let mut inner = Vec::with_capacity(self.parts.len());
        for p in &self.parts {
            let mut c =
                DMatrix::from_fn(eliminated.len(), eliminated.len(), |i, j| p.a[(eliminated[i], eliminated[j])]);
            for i in 0..eliminated.len() {
                c[(i, i)] += 1e-12 * (1.0 + c[(i, i)]) + precision[i];
            }
            let cross = DMatrix::from_fn(eliminated.len(), n, |i, j| p.a[(eliminated[i], kept[j])]);
            let b = DVector::from_fn(eliminated.len(), |i, _| p.b[eliminated[i]]);
            let ch = c.cholesky()?;
            let (x, y) = (ch.solve(&cross), ch.solve(&b));
            s += DMatrix::from_fn(n, n, |i, j| p.a[(kept[i], kept[j])]) - cross.transpose() * &x;
            q += DVector::from_fn(n, |i, _| p.b[kept[i]]) - cross.transpose() * &y;
            fall += b.dot(&y);
            ln_det += ln_det_of(&ch);
            inner.push((x, y));
        }
        let parameters = &self.fitted.structure.model().parameters;
        let theta = &self.fitted.point().theta;
        for (j, p) in parameters.iter().enumerate() {
            if let Some((mean, sd)) = p.prior {
                s[(j, j)] += sd.powi(-2);
                q[j] += (mean - theta[j]) / (sd * sd);
            }
        }
        for j in g..n {
            s[(j, j)] += size.powi(-2);
        }
        let gradient = q.clone();
        for j in (0..g).filter(|j| self.held[*j]) {
            s.row_mut(j).fill(0.0);
            s.column_mut(j).fill(0.0);
            s[(j, j)] = 1.0;
            q[j] = 0.0;
        }
        for j in 0..n {
            s[(j, j)] *= 1.0 + 1e-10;
        }
        let ch = s.cholesky()?;
        let step = ch.solve(&q);
        fall += q.dot(&step);
        ln_det += ln_det_of(&ch);
        Some(Solved { kept, eliminated, inner, step, gradient, fall, ln_det })
    }

    /// ln of the evidence, less what all structures of one campaign have in common, with what is `beside` the structure.
    ///
    /// None where the normal matrix is singular.
    pub fn ln(&self, beside: Beside) -> Option<f64> {
        let solved = self.solve(beside)?;
        let mut ln = -0.5 * self.fitted.chi2() + 0.5 * solved.fall - 0.5 * solved.ln_det;
        for (j, p) in self.fitted.structure.model().parameters.iter().enumerate() {
            let width = p.upper - p.lower;
            ln += match (p.prior, self.held[j]) {
                (Some((_, sd)), _) => -sd.ln(),
                (None, false) => 0.5 * TAU.ln() - width.ln(),
                // falls off from the bound as its gradient says
                (None, true) => -(width * solved.gradient[j].abs()).max(1.0).ln(),
            };
        }
        if beside.size > 0.0 {
            ln -= self.shared as f64 * beside.size.ln();
        }
        if beside.own > 0.0 {
            ln -= (self.own * self.parts.len()) as f64 * beside.own.ln();
        }
        ln.is_finite().then_some(ln)
    }

    /// Overdispersion of what is left once parameters, discrepancy and nuisances have moved to where they are likeliest.
    pub fn overdispersion(&self, beside: Beside) -> Option<f64> {
        let solved = self.solve(beside)?;
        let left: Vec<(usize, Vec<f64>)> = self
            .parts
            .iter()
            .zip(&solved.inner)
            .enumerate()
            .map(|(r, (p, (x, y)))| {
                let mut e = p.residual.clone();
                for (at, by) in solved.kept.iter().zip(solved.step.iter()) {
                    add_scaled(&mut e, -by, &p.columns[*at]);
                }
                let inner = y - x * &solved.step;
                for (at, by) in solved.eliminated.iter().zip(inner.iter()) {
                    add_scaled(&mut e, -by, &p.columns[*at]);
                }
                (self.fitted.data.records[r].setup.time.len(), e)
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
    let mut wide = DMatrix::zeros(n, n);
    let mut right = DVector::zeros(n);
    for i in 0..n {
        right[i] = from[i].map_or_else(|| dot(&all[i], &residual), |k| b[k]);
        for j in 0..=i {
            let v = match (from[i], from[j]) {
                (Some(p), Some(q)) => a[(p, q)],
                _ => dot(&all[i], &all[j]),
            };
            wide[(i, j)] = v;
            wide[(j, i)] = v;
        }
    }
    Part { a: wide, b: right, residual, columns: all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discrepancy::{instruments, own, shared};
    use crate::prepare::Prepared;
    use crate::response::Place;
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

    /// b' A^-1 b and ln det A of all recordings' normal equations in one matrix, nothing eliminated.
    fn dense(e: &Evidence<'_>, beside: Beside) -> (f64, f64) {
        let (g, m) = (e.globals, e.shared);
        let own = e.locals + e.own + e.instruments;
        let n = g + m + own * e.parts.len();
        let (mut a, mut b) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (r, p) in e.parts.iter().enumerate() {
            let at = |i: usize| if i < g + m { i } else { i + own * r };
            for i in 0..p.b.len() {
                b[at(i)] += p.b[i];
                for j in 0..p.b.len() {
                    a[(at(i), at(j))] += p.a[(i, j)];
                }
                if i >= g + m {
                    a[(at(i), at(i))] += 1e-12 * (1.0 + p.a[(i, i)]);
                }
                let k = i.wrapping_sub(g + m + e.locals);
                if i >= g + m + e.locals {
                    a[(at(i), at(i))] += if k < e.own { beside.own.powi(-2) } else { 1.0 };
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
            a[(j, j)] += beside.size.powi(-2);
        }
        let ch = a.cholesky().unwrap();
        (b.dot(&ch.solve(&b)), ln_det_of(&ch))
    }

    #[test]
    fn what_is_eliminated_recording_by_recording_is_what_one_large_matrix_gives() {
        let f = fitted();
        let (shared, own) = (shared(&f).unwrap(), own(&f, Place::Contact).unwrap());
        let e = Evidence::new(&f, &shared, Some(&own), Some(&instruments(&f).unwrap())).unwrap();
        assert!(e.held.iter().all(|h| !h));
        let beside = Beside { size: 0.01, own: 0.03, instruments: true };
        let (solved, (fall, ln_det)) = (e.solve(beside).unwrap(), dense(&e, beside));
        assert!((solved.fall - fall).abs() < 1e-6 * fall.abs().max(1.0), "{} {fall}", solved.fall);
        assert!((solved.ln_det - ln_det).abs() < 1e-6 * ln_det.abs(), "{} {ln_det}", solved.ln_det);
    }

    #[test]
    fn noise_alone_prefers_no_discrepancy_and_a_vanishing_one_is_none() {
        let f = fitted();
        let e = Evidence::new(&f, &shared(&f).unwrap(), None, None).unwrap();
        let ln = |size: f64| e.ln(Beside { size, ..Beside::default() }).unwrap();
        assert!((ln(1e-9) - ln(0.0)).abs() < 0.1, "{} {}", ln(1e-9), ln(0.0));
        assert!(ln(0.0) > ln(0.01) && ln(0.01) > ln(0.1), "{} {} {}", ln(0.0), ln(0.01), ln(0.1));
    }
}
