//! The peak before the clip: what a channel would have read without the limit of its chain.

use super::candidate::WHITE;
use super::impulse::shares;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Model, Options, Problem};
use nalgebra::DMatrix;
use record::{largest, Channel};

/// Ratio of a peak to the limit from which a recording has reached it.
const BEYOND: f64 = 1.002;

/// One recording of the clipped channel.
#[derive(Clone, Debug)]
pub struct Unclipped {
    pub file: String,
    /// Largest magnitude read, and the same without the clip with its standard deviation, SI.
    pub read: f64,
    pub peak: f64,
    pub sd: f64,
    /// Whether this recording reached the clip.
    pub clipped: bool,
    /// The channel's curve without the clip, SI.
    pub curve: Vec<f64>,
}

/// The data with noise as wide as what `chosen` leaves, where that is more than noise, and whether it is.
fn tolerant(chosen: &Fitted) -> (Data, bool) {
    let mut data = (*chosen.data).clone();
    let left = chosen.overdispersion_up_to(f64::INFINITY);
    if left > WHITE {
        data.noise.iter_mut().for_each(|n| *n = n.widened(left));
    }
    (data, left > WHITE)
}

/// A covariance with the parameters that lie at a bound held there.
fn within_bounds(mut c: DMatrix<f64>, model: &Model<'_>, theta: &[f64]) -> DMatrix<f64> {
    for (j, (p, t)) in model.parameters.iter().zip(theta).enumerate() {
        let own = c[(j, j)];
        if (*t <= p.lower || *t >= p.upper) && own > 0.0 {
            let column = c.column(j).into_owned();
            c -= &column * column.transpose() / own;
        }
    }
    c
}

/// The channel that clips and its recordings; None where `chosen` holds no clip.
pub fn unclipped(chosen: &Fitted) -> Option<(Channel, Vec<Unclipped>)> {
    if !chosen.structure.has(|h| h.limits_reading) {
        return None;
    }
    let model = chosen.structure.model();
    // What stays unexplained must not bend the nuisances: with noise as wide as that, the speeds measured and the
    // scatter of repeats hold the peak that nobody read.
    let (data, tolerated) = tolerant(chosen);
    let problem = Problem::new(&data, model);
    let start = problem.evaluate(chosen.fit.point.theta.clone(), chosen.fit.point.locals.clone());
    let point = &problem.fit(start, &Options { iterations: 100, ..Options::default() }).point;
    let channel = problem.physics(&point.theta).clipping.channel;
    let covariance = problem.covariance(point).map(|c| within_bounds(c, model, &point.theta));
    // what the model has beyond the limit is held to the impulse, where the law is not all that there is
    let shares = if tolerated { shares(&problem, point, channel) } else { vec![(1.0, 0.0); data.records.len()] };
    let mut out = Vec::new();
    for (r, rec) in chosen.data.records.iter().enumerate() {
        let Some(read) = &rec.y[channel.index()] else { continue };
        let (share, share_sd) = shares[r];
        // what the model reads with the limit and without
        let modelled = |theta: &[f64]| {
            let (_, kept, free) = problem.predict_unlimited(theta, r, &point.locals[r]);
            [kept, free].map(|mut y| std::mem::take(&mut y[channel.index()]))
        };
        let partly = |[kept, free]: &[Vec<f64>; 2]| -> Vec<f64> {
            kept.iter().zip(free).map(|(k, f)| k + share * (f - k)).collect()
        };
        let here = modelled(&point.theta);
        let [limit, model_peak] = [&here[0], &here[1]].map(|y| largest(y));
        let curve = partly(&here);
        let peak = largest(&curve);
        let g = point.theta.len();
        let slope: Vec<f64> = (0..g)
            .map(|j| {
                let h = model.parameters[j].step;
                let mut t = point.theta.clone();
                t[j] += h;
                (largest(&partly(&modelled(&t))) - peak) / h
            })
            .collect();
        let var: f64 = covariance
            .as_ref()
            .map_or(f64::NAN, |c| (0..g).map(|i| (0..g).map(|j| slope[i] * c[(i, j)] * slope[j]).sum::<f64>()).sum());
        let sd = var.max(0.0).sqrt().hypot(share_sd * (model_peak - limit));
        let clipped = model_peak > BEYOND * limit;
        out.push(Unclipped { file: rec.file.clone(), read: largest(read), peak, sd, clipped, curve });
    }
    Some((channel, out))
}
