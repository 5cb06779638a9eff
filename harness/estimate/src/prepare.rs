//! From conditioned data to data ready for estimation: what takes a fit of the simulation as given.

use crate::condition::{condition, renewed_noise, Conditioned, Guess, Invalid};
use crate::fitted::Fitted;
use crate::problem::{Data, Options};
use crate::structure::{Structure, Term};
use mechanisms::mechanism::Origin;
use rayon::prelude::*;
use record::{Campaign, Kind};
use std::sync::Arc;

/// chi^2 by which the first sample is preferred to the touch as the place where speeds were measured.
const AT_FIRST: f64 = 50.0;

/// A campaign ready for estimation: windowed, its noise known, its spikes left out.
#[derive(Clone)]
pub struct Prepared {
    pub data: Arc<Data>,
    pub guess: Guess,
    /// The simulation as given.
    pub structure: Structure,
}

impl Prepared {
    /// A campaign prepared from its recordings on.
    ///
    /// # Errors
    /// When the recordings cannot be judged at all.
    pub fn new(c: &Campaign) -> Result<Prepared, Invalid> {
        Prepared::from(c, condition(c)?)
    }

    /// Finds out by the base fit whether the speed was measured at touch or at the first sample, how far the scatter of
    /// an imposed penetration counts, what noise a motion had hidden, and which samples are spikes.
    ///
    /// # Errors
    /// When the simulation cannot be brought near the recordings.
    pub fn from(c: &Campaign, conditioned: Conditioned) -> Result<Prepared, Invalid> {
        let Conditioned { data, guess } = conditioned;
        let structure = Structure::given(c, &data);
        let mut data = Arc::new(data);
        // A photo interrupter measures the speed a little before touch. Whether the recordings' first sample or
        // the touch itself is meant shows in the fit: free fall between the two is not free.
        if c.kind == Kind::DropTest && data.records.iter().all(|r| !r.at_first) {
            let first = Arc::new(data.with_speeds_elsewhere());
            if least_in_flight(&first, &structure, &guess) < least_in_flight(&data, &structure, &guess) + AT_FIRST {
                data = first;
            }
        }
        let mut base = Fitted::base(&data, &structure, &guess);
        if !base.chi2().is_finite() {
            return Err(Invalid(
                "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
            ));
        }
        if c.kind == Kind::Indentation {
            let mut weighted = (*data).clone();
            for (r, w) in weighted.records.iter_mut().zip(effective_weights(&base)) {
                r.weight[0] = w;
            }
            base = base.on(Arc::new(weighted));
        }
        if c.kind == Kind::ContactorOpening {
            // at rest, released, flying: no polynomial follows that, the fit does
            let mut renewed = (*data).clone();
            renewed.noise = renewed_noise(c, &data, &remainders(&base));
            base = base.on(Arc::new(renewed));
        }
        let mut data = (*base.data).clone();
        for (r, channel, k) in spikes(&base) {
            data.records[r].weight[channel][k] = 0.0;
        }
        Ok(Prepared { data: Arc::new(data), guess, structure })
    }
}

/// Least chi^2 of the simulation as given, alone or beside one force that acts in flight: one that is missing there
/// would speak for speeds measured where they were not.
fn least_in_flight(data: &Data, structure: &Structure, guess: &Guess) -> f64 {
    let base = Fitted::base(&Arc::new(data.coarse()), structure, guess);
    let plain = |t: &Term| {
        t.mechanism.origin == Origin::Motion && t.mechanism.named && t.form.linear && t.form.parameters.len() == 1
    };
    let forces: Vec<Term> = structure.base().candidates().into_iter().filter(plain).collect();
    let quick = Options { iterations: 12, ..Options::default() };
    let with = |t: &Term| base.add(t, 1, &quick).map(|f| f.chi2());
    let with: Vec<f64> = forces.par_iter().filter_map(with).collect();
    with.into_iter().fold(base.chi2(), f64::min)
}

/// Weights of an imposed penetration: where the force rises steeply the scatter of the penetration
/// counts as well (effective variance: Orear 1982).
fn effective_weights(base: &Fitted) -> Vec<Vec<f64>> {
    let sx = base.data.noise[2].marginal();
    let sf = base.data.noise[0].marginal();
    (0..base.data.records.len())
        .map(|r| {
            let (t, _) = base.predict(r);
            let n = t.force.len();
            (0..n)
                .map(|i| {
                    let (a, b) = (i.saturating_sub(6), (i + 6).min(n - 1));
                    let dx = (t.position[b] - t.position[a]).abs();
                    let slope = if dx > 2.0 * sx { (t.force[b] - t.force[a]).abs() / dx } else { 0.0 };
                    let own = if t.position[i] > 0.0 {
                        base.point().theta[1] * t.force[i].max(0.0) / t.position[i].max(3.0 * sx)
                    } else {
                        0.0
                    };
                    sf / (sf * sf + (slope.max(own) * sx).powi(2)).sqrt()
                })
                .collect()
        })
        .collect()
}

/// The readings less the fit's, by recording and channel.
fn remainders(base: &Fitted) -> Vec<[Option<Vec<f64>>; 3]> {
    let records = base.data.records.iter().enumerate();
    records
        .map(|(r, rec)| {
            let (_, y) = base.predict(r);
            let less = |i: usize| -> Option<Vec<f64>> {
                let read = rec.y[i].as_ref()?;
                Some(read.iter().zip(&y[i]).map(|(a, b)| a - b).collect())
            };
            [less(0), less(1), less(2)]
        })
        .collect()
}

/// Samples on either side of a touch that a touch simulated a little off moves.
const ONSET: usize = 3;

/// Samples that stand alone far outside the noise: (recording, channel, sample).
fn spikes(base: &Fitted) -> Vec<(usize, usize, usize)> {
    let data = &base.data;
    let mut out = Vec::new();
    for (r, rec) in data.records.iter().enumerate() {
        let (t, y) = base.predict(r);
        let touching: Vec<bool> = t.position.iter().map(|x| *x > 0.0).collect();
        for c in data.compared(r) {
            let i = c.index();
            let Some(read) = &rec.y[i] else { continue };
            let e: Vec<f64> = read.iter().zip(&y[i]).zip(&rec.weight[i]).map(|((a, b), w)| (a - b) * w).collect();
            let s = data.noise[i].marginal();
            out.extend((0..e.len()).filter(|k| is_spike(*k, &e, read, &touching, s)).map(|k| (r, i, k)));
        }
    }
    out
}

/// Whether sample `k` stands alone: the residual `e` by 5 `sigma` outside its neighbours'. Where touch begins or ends, a
/// force that jumps leaves such a residual if it jumps a sample early or late in the simulation: there the reading itself
/// has to stick out of those around it, which no jump does.
fn is_spike(k: usize, e: &[f64], read: &[f64], touching: &[bool], sigma: f64) -> bool {
    let around = |half: usize| k.saturating_sub(half)..(k + half + 1).min(e.len());
    let mut near: Vec<f64> = around(4).filter(|j| j.abs_diff(k) > 1).map(|j| e[j]).collect();
    near.sort_by(f64::total_cmp);
    let middle = near[near.len() / 2];
    let spread = near[near.len() - 1] - near[0];
    let off = (e[k] - middle).abs();
    if off <= 5.0 * sigma || off <= 1.5 * spread {
        return false;
    }
    let onset = around(ONSET).any(|j| touching[j] != touching[k]);
    let others = || around(4).filter(|j| *j != k).map(|j| read[j]);
    let (low, high) = others().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
    !onset || read[k] < low - 5.0 * sigma || read[k] > high + 5.0 * sigma
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_stands_alone_and_a_jump_simulated_a_sample_late_is_none() {
        // a viscous damper: the force jumps as it touches
        let step = |from: usize| -> Vec<f64> {
            (0..40).map(|i| if i < from { 0.0 } else { 50.0 + 2.0 * (i - from) as f64 }).collect()
        };
        let (mut read, simulated) = (step(20), step(21));
        let touching: Vec<bool> = simulated.iter().map(|f| *f > 0.0).collect();
        let spikes = |read: &[f64], touching: &[bool]| -> Vec<usize> {
            let e: Vec<f64> = read.iter().zip(&simulated).map(|(a, b)| a - b).collect();
            (0..e.len()).filter(|k| is_spike(*k, &e, read, touching, 1.0)).collect()
        };
        assert!(spikes(&read, &touching).is_empty());
        // the residual alone would have it so
        assert_eq!(spikes(&read, &[false; 40]), [20]);
        read[8] = 30.0;
        read[19] = -20.0;
        read[30] += 12.0;
        assert_eq!(spikes(&read, &touching), [8, 19, 30]);
    }
}
