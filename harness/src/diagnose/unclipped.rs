//! The peak before the clip: what a channel would have read without the limit of its chain.

use super::candidate::Candidate;
use super::search::Search;
use crate::model::chain::readings;
use crate::model::estimate::{Nuisance, Problem};
use crate::record::Channel;

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

/// The channel that clips and its recordings; None where `chosen` holds no clip.
pub fn unclipped(search: &Search<'_>, chosen: &Candidate, wander: f64) -> Option<(Channel, Vec<Unclipped>)> {
    if !chosen.names().contains(&"clipping") {
        return None;
    }
    let model = search.model(&chosen.make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(search.data, &model);
    let point = &chosen.fit.point;
    let channel = problem.physics(&point.theta).clip_channel;
    let covariance = problem.covariance(point);
    let curve = |theta: &[f64], r: usize, keep: bool| -> Vec<f64> {
        let mut p = problem.physics(theta);
        let level = p.clip;
        p.clip = if keep { level } else { f64::INFINITY };
        let (trace, _) = problem.predict(theta, r, &point.locals[r]);
        let mut y = std::mem::take(&mut readings(&p, &trace, &search.data.records[r].setup.time)[channel.index()]);
        for (n, z) in problem.nuisances().iter().zip(&point.locals[r]) {
            if *n == Nuisance::Zero(channel) {
                y.iter_mut().for_each(|v| *v += z);
            }
        }
        y
    };
    let top = |y: &[f64]| y.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut out = Vec::new();
    for (r, rec) in search.data.records.iter().enumerate() {
        let Some(read) = &rec.y[channel.index()] else { continue };
        let free = curve(&point.theta, r, false);
        let peak = top(&free);
        let clipped = peak > 1.002 * top(&curve(&point.theta, r, true));
        let g = point.theta.len();
        let slope: Vec<f64> = (0..g)
            .map(|j| {
                let h = model.parameters[j].step;
                let mut t = point.theta.clone();
                t[j] += h;
                (top(&curve(&t, r, false)) - peak) / h
            })
            .collect();
        let var: f64 = covariance
            .as_ref()
            .map_or(f64::NAN, |c| (0..g).map(|i| (0..g).map(|j| slope[i] * c[(i, j)] * slope[j]).sum::<f64>()).sum());
        let sd = (var.max(0.0) * wander.max(1.0)).sqrt();
        out.push(Unclipped { file: rec.file.clone(), read: top(read), peak, sd, clipped, curve: free });
    }
    Some((channel, out))
}
