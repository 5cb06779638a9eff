//! The force it takes: what would have to be added, instant by instant, for the simulation to follow each recording.
//!
//! The motion is linearised about the simulated path (contact as a spring k(t) and a damper c(t)), an unknown force
//! d(t) on knots enters as a contact force, as a force on the body, or as an error of one reading, and is estimated
//! by least squares on the whitened residuals with its curvature penalised; the penalty by generalised
//! cross-validation (Golub, Heath and Wahba 1979). Which of the places fits best is the parity test: a contact force
//! shows in force and motion, a body force in motion alone, an error of a reading in that reading alone.

use super::figure::figure;
use super::phases::{over_their_sum, phases, strongest, PHASES};
use estimate::fitted::Fitted;
use estimate::problem::{Nuisance, Point, Problem};
pub use estimate::response::Place;
use estimate::response::Response;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use record::Kind;

/// d(t) of one recording with the half width of its 95 % band.
#[derive(Clone, Debug)]
pub struct Record {
    pub file: String,
    pub level: usize,
    pub time: Vec<f64>,
    pub force: Vec<f64>,
    pub band: Vec<f64>,
}

/// The latent force of a campaign.
#[derive(Clone, Debug)]
pub struct Latent {
    pub place: Place,
    /// Fall of chi^2, less twice the freedom spent, by place; best first.
    pub scores: Vec<(Place, f64)>,
    pub records: Vec<Record>,
    /// What it is and how large, in a few words.
    pub brief: String,
    /// Where it is clearest.
    pub text: String,
    /// Share, by phase, of the squares by which it stands out of its band.
    pub shares: [f64; 4],
}

/// Knots of d(t).
const KNOTS: usize = 64;
/// Penalties tried, relative to the data's weight.
const PENALTIES: [f64; 12] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5];

/// The latent force that the model of `reference` lacks; None where it cannot be simulated.
pub fn latent(reference: &Fitted) -> Option<Latent> {
    let data = &reference.data;
    let problem = reference.problem();
    type Tried = (Place, f64, Vec<(Record, f64)>);
    let mut tried: Vec<Tried> = Place::all(data)
        .into_par_iter()
        .filter_map(|p| {
            let parts: Vec<(Record, f64)> = (0..data.records.len())
                .map(|r| estimate(&problem, &reference.fit.point, r, p))
                .collect::<Option<_>>()?;
            Some((p, parts.iter().map(|q| q.1).sum(), parts))
        })
        .collect();
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let scores: Vec<(Place, f64)> = tried.iter().map(|t| (t.0, t.1)).collect();
    let (place, _, parts) = tried.into_iter().next()?;
    let records: Vec<Record> = parts.into_iter().map(|p| p.0).collect();
    // where it stands clearest out of its band
    let mut best: Option<(f64, usize, usize)> = None;
    let mut by_phase = [0.0; 4];
    for (r, rec) in records.iter().enumerate() {
        let (trace, _) = reference.predict(r);
        let phases = phases(&trace, data);
        for i in 0..rec.time.len() {
            let z = if rec.band[i] > 0.0 { rec.force[i].abs() / rec.band[i] } else { 0.0 };
            by_phase[phases[i]] += (z * z - 1.0).max(0.0);
            if best.is_none_or(|b| z > b.0) {
                best = Some((z, r, i));
            }
        }
    }
    let most = strongest(&by_phase);
    let shares = over_their_sum(by_phase);
    let (z, r, i) = best?;
    let rec = &records[r];
    let channels = data.compared(r).count();
    let apart = if channels > 1 { "" } else { " With one channel the place it enters cannot be identified." };
    let unit = place.unit();
    let brief = format!(
        "{}, {} at its clearest, most in the {} phase",
        place.words(),
        figure(rec.force[i], unit),
        PHASES[most]
    );
    let text = format!(
        "It takes {}. Most of it lies in the {} phase; it is clearest in {} at {}: {} +- {}, {:.1} times its \
         band.{apart}",
        place.words(),
        PHASES[most],
        rec.file,
        figure(rec.time[i], "s"),
        figure(rec.force[i], unit),
        figure(rec.band[i], unit),
        z
    );
    Some(Latent { place, scores, records, brief, text, shares })
}

/// d(t) of one recording and what it gains.
fn estimate(problem: &Problem<'_>, point: &Point, r: usize, place: Place) -> Option<(Record, f64)> {
    let data = problem.data;
    let rec = &data.records[r];
    let time = &rec.setup.time;
    let n = time.len();
    if let Place::Reading(c) = place {
        rec.y[c.index()].as_ref()?;
    }
    let (trace, residual) = problem.residual(point, r)?;
    let physics = problem.physics(&point.theta);
    let indentation = data.kind == Kind::Indentation;
    let response = Response::new(&physics, &trace, time, data.kind);
    // knots where the place can act at all
    let touches: Vec<usize> = (0..n).filter(|i| trace.position[*i] > 0.0).collect();
    let (a, b) = match (place, touches.first(), touches.last()) {
        (Place::Contact, Some(a), Some(b)) if !indentation => (a.saturating_sub(4), (b + 4).min(n - 1)),
        _ => (0, n - 1),
    };
    let knots = KNOTS.min((b - a) / 3).max(4);
    let spacing = (b - a) as f64 / (knots - 1) as f64;
    let hat = |k: usize, i: usize| -> f64 {
        if i < a || i > b {
            return 0.0;
        }
        (1.0 - ((i - a) as f64 / spacing - k as f64).abs()).max(0.0)
    };
    let s = data.scales;
    let whole =
        |y: [Vec<f64>; 3]| -> Vec<f64> { data.compared(r).flat_map(|c| data.whitened(r, c, &y[c.index()])).collect() };
    // columns: d on the knots, then what the fit of this recording was free to move
    let scale = match place {
        Place::Reading(c) => 1e-2 * data.range[c.index()],
        _ => 1e-2 * s.force,
    };
    let nothing = || [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let mut columns: Vec<Vec<f64>> = (0..knots)
        .map(|k| {
            let d: Vec<f64> = (0..n).map(|i| scale * hat(k, i)).collect();
            whole(response.to(&d, place))
        })
        .collect();
    let mut ridge: Vec<f64> = Vec::new();
    for (i, nuisance) in problem.nuisances().iter().enumerate() {
        match nuisance {
            Nuisance::Zero(c) => {
                let mut y = nothing();
                let sd = data.prior(r, *nuisance).map_or(scale, |p| p.1);
                y[c.index()] = vec![sd; n];
                columns.push(whole(y));
            }
            Nuisance::Stiffness | Nuisance::Offset | Nuisance::Tilt | Nuisance::Start | Nuisance::Speed => {
                // differences of the simulation itself
                let h = match nuisance {
                    Nuisance::Start => 1e-2 * s.duration,
                    Nuisance::Speed => rec.speed.map_or(1e-2 * s.speed, |v| v.1.max(1e-3 * v.0)),
                    _ => data.prior(r, *nuisance).map_or(1e-3, |p| p.1),
                };
                let mut l = point.locals[r].clone();
                l[i] += h;
                let (t, y) = problem.predict(&point.theta, r, &l);
                let (_, y0) = problem.predict(&point.theta, r, &point.locals[r]);
                if !t.ok {
                    continue;
                }
                let mut d = nothing();
                for c in 0..3 {
                    d[c] = y[c].iter().zip(&y0[c]).map(|(a, b)| a - b).collect();
                }
                columns.push(whole(d));
            }
        }
        // its prior, or ten times as far as the whole recording lets it move
        let length = columns.last().map_or(0.0, |c| c.iter().map(|v| v * v).sum::<f64>());
        ridge.push((length / 100.0).max(1.0));
    }
    let m = columns.len();
    let rows = residual.len();
    let design = DMatrix::from_fn(rows, m, |i, j| columns[j][i]);
    let target = DVector::from_vec(residual);
    let gram = design.transpose() * &design;
    let right = design.transpose() * &target;
    let mut penalty = DMatrix::<f64>::zeros(m, m);
    for k in 1..knots - 1 {
        for (i, u) in [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)] {
            for (j, w) in [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)] {
                penalty[(i, j)] += u * w;
            }
        }
    }
    let weight = (0..knots).map(|k| gram[(k, k)]).sum::<f64>() / knots as f64;
    let mut best: Option<(f64, f64, DVector<f64>, DMatrix<f64>)> = None;
    let mut least = f64::INFINITY;
    for p in PENALTIES {
        let mut a = &gram + &penalty * (p * weight.max(1e-12));
        for k in 0..knots {
            a[(k, k)] += 1e-9 * weight.max(1e-12) + 1e-6;
        }
        for (j, q) in ridge.iter().enumerate().take(m - knots) {
            a[(knots + j, knots + j)] += q;
        }
        let Some(ch) = a.cholesky() else { continue };
        let x = ch.solve(&right);
        let inverse = ch.inverse();
        let freedom = (&inverse * &gram).trace();
        let left = (&target - &design * &x).norm_squared();
        let gcv = left / (rows as f64 - 1.4 * freedom).max(1.0).powi(2);
        let gain = target.norm_squared() - left - 2.0 * freedom;
        if gcv < least {
            least = gcv;
            best = Some((left / (rows as f64 - freedom).max(1.0), gain, x, inverse));
        }
    }
    let (left, gain, x, inverse) = best?;
    // the noise is what the force leaves over
    let widen = left.max(1.0).sqrt();
    let (mut force, mut band) = (vec![0.0; n], vec![0.0; n]);
    for i in a..=b {
        let u = (i - a) as f64 / spacing;
        let k = (u.floor() as usize).min(knots - 2);
        let w = u - k as f64;
        force[i] = scale * ((1.0 - w) * x[k] + w * x[k + 1]);
        let var = (1.0 - w).powi(2) * inverse[(k, k)]
            + w * w * inverse[(k + 1, k + 1)]
            + 2.0 * w * (1.0 - w) * inverse[(k, k + 1)];
        band[i] = 1.96 * scale * var.max(0.0).sqrt() * widen;
    }
    Some((Record { file: rec.file.clone(), level: rec.level, time: time.clone(), force, band }, gain))
}
