//! From conditioned data to data ready for estimation: what takes a fit of the simulation as given.

use crate::condition::{
    by_neighbours, condition, impose, noise_out_of_contact, renewed_noise, spikes_of_course, that_stand_alone,
    Conditioned, Guess, Invalid, BY_NEIGHBOURS,
};
use crate::coupling;
use crate::fitted::Fitted;
use crate::problem::{Data, Options, Record};
use crate::structure::{Structure, Term};
use mechanisms::mechanism::Origin;
use plant::simulate::Trace;
use rayon::prelude::*;
use record::statistics::spread;
use record::{Campaign, Channel, Kind};
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
        let Conditioned { data, guess, unsure } = conditioned;
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
        if base.chi2().is_finite() {
            base = coupling::fine_enough(base, &guess)?;
        }
        if !base.chi2().is_finite() {
            return Err(Invalid(
                "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
            ));
        }
        if c.kind == Kind::Indentation {
            base = at_the_path_read(&base, unsure);
        }
        if c.kind.starts_driven() {
            // at rest, released, flying: no polynomial follows that, the fit does
            let mut renewed = (*base.data).clone();
            renewed.noise = renewed_noise(c, &renewed, &remainders(&base));
            base = base.on(Arc::new(renewed));
        }
        let simulated = simulations(&base);
        let data = without_spikes(&with_growing_noise(&base, &simulated), &simulated).data;
        Ok(Prepared { data, guess, structure })
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

/// Shares of a recording's largest reading below which the noise is that of rest, and from which that of a large signal.
const SMALL: f64 = 0.05;
const LARGE: f64 = 0.5;
/// Samples of each that its noise takes to be known.
const ENOUGH: usize = 30;

/// Traces and readings of every recording at a fit.
type Simulated = Vec<(Trace, [Vec<f64>; 3])>;

fn simulations(base: &Fitted) -> Simulated {
    (0..base.data.records.len()).into_par_iter().map(|r| base.predict(r)).collect()
}

/// What a channel's readings leave of predictions `y`, weighed as the fit does; None where it was not recorded.
fn weighed(rec: &Record, c: Channel, y: &[f64]) -> Option<Vec<f64>> {
    let left = rec.left_of(c, y)?;
    Some(left.iter().zip(&rec.weight[c.index()]).map(|(e, w)| e * w).collect())
}

/// A fit held against the same recordings with each sample weighed by its own noise: what an amplifier, a reference or a fringe
/// count adds to a reading goes with the reading, sigma(y)^2 = sigma^2 + g^2 y^2.
fn with_growing_noise(base: &Fitted, simulated: &Simulated) -> Fitted {
    let mut data = (*base.data).clone();
    for c in Channel::ALL {
        let i = c.index();
        let Some(variance) = growth(base, simulated, c) else { continue };
        let growth = variance / data.noise[i].marginal().powi(2);
        for (rec, (_, y)) in data.records.iter_mut().zip(simulated) {
            for (w, y) in rec.weight[i].iter_mut().zip(&y[i]) {
                *w /= (1.0 + growth * (*w * y).powi(2)).sqrt();
            }
        }
    }
    base.on(Arc::new(data))
}

/// g^2 of a channel, by how much each residual stands off the cubic through its neighbours, which neither a wrong law nor a
/// slow disturbance does; medians, so that neither spikes nor corners count. None with too few samples.
fn growth(base: &Fitted, simulated: &Simulated, c: Channel) -> Option<f64> {
    let i = c.index();
    let (mut small, mut share, mut squares) = (Vec::new(), Vec::new(), Vec::new());
    for (rec, (_, y)) in base.data.records.iter().zip(simulated) {
        let (y, weight) = (&y[i], &rec.weight[i]);
        let Some(e) = weighed(rec, c, y) else { continue };
        let top = record::largest(y);
        for k in (0..e.len()).filter(|k| weight[*k] > 0.0) {
            let Some(off) = by_neighbours(&e, k).map(|v| (e[k] - v).abs() / BY_NEIGHBOURS) else { continue };
            if y[k].abs() < SMALL * top {
                small.push(off);
            } else if y[k].abs() >= LARGE * top {
                let size = (weight[k] * y[k]).abs();
                share.push(off / size);
                squares.push(size.powi(-2));
            }
        }
    }
    if small.len() < ENOUGH || share.len() < ENOUGH {
        return None;
    }
    let at_rest = spread(small).powi(2) * squares.iter().sum::<f64>() / squares.len() as f64;
    Some((spread(share).powi(2) - at_rest).max(0.0))
}

/// A fit held against the same recordings without the samples called spikes.
fn without_spikes(base: &Fitted, simulated: &Simulated) -> Fitted {
    let mut data = (*base.data).clone();
    for (r, channel, k) in spikes(base, simulated) {
        data.records[r].weight[channel][k] = 0.0;
    }
    base.on(Arc::new(data))
}

/// A fit of an indentation held against its recordings with their noise learned where that fit has nothing touching
/// (`unsure`: channels of which it was not known before), the path smoothed by that noise, and what the force read holds
/// beyond that on the smoothed path.
fn at_the_path_read(base: &Fitted, unsure: [bool; 3]) -> Fitted {
    let i = Channel::Penetration.index();
    let mut renewed = (*base.data).clone();
    let of = |(record, (trace, y)): (&Record, (Trace, [Vec<f64>; 3]))| {
        (record.left_of(Channel::Force, &y[Channel::Force.index()]), trace.position)
    };
    let (left, depth): (Vec<_>, Vec<_>) = base.data.records.iter().zip(simulations(base)).map(of).unzip();
    renewed.noise = noise_out_of_contact(&base.data, unsure, &left, &depth);
    let noise = renewed.noise[i];
    for record in &mut renewed.records {
        let spikes = record.y[i].as_ref().map_or_else(Vec::new, |read| spikes_of_course(read, noise.marginal()));
        spikes.into_iter().for_each(|k| record.weight[i][k] = 0.0);
        record.beside_corners = impose(record, noise.low_frequency());
        record.beside_corners.iter().for_each(|k| record.weight[0][*k] = 0.0);
    }
    let base = base.on(Arc::new(renewed));
    let base = without_spikes(&base, &simulations(&base));
    let mut there = (*base.data).clone();
    for (r, record) in there.records.iter_mut().enumerate() {
        let Some(read) = &record.y[i] else { continue };
        (record.off_path, record.weight[0]) = off_path(&base, r, read);
    }
    base.on(Arc::new(there))
}

/// What the force read holds beyond that on the smoothed path, N, and its weights.
///
/// What the penetration's own noise does to the force is its slope times that noise. Held against the smoothed path, a
/// reading keeps the smoother's error, which runs on from sample to sample and looks like physics; at the penetration read
/// with it, it keeps the noise of that one sample, which its weight holds (effective variance: Orear 1982). `read` is the
/// penetration as read.
fn off_path(base: &Fitted, r: usize, read: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (sf, sx) = (base.data.noise[0].marginal(), base.data.noise[2].marginal());
    let record = &base.data.records[r];
    let path = &record.setup.imposed;
    let (t, _) = base.predict(r);
    let power = base.point().theta[1];
    let force = record.y[0].as_deref().unwrap_or(&[]);
    let at = |i: usize| -> (f64, f64) {
        let inside = t.position[i] > 0.0;
        let law = if inside { power * t.force[i].max(0.0) / t.position[i].max(3.0 * sx) } else { 0.0 };
        let slope = local_slope(path, force, &record.weight[0], i, SLOPE_RANGE * sx).unwrap_or(law);
        let off = if record.weight[2][i] > 0.0 { read[i] - path[i] } else { 0.0 };
        let weight = if record.weight[0][i] > 0.0 { sf / (sf * sf + (slope * sx).powi(2)).sqrt() } else { 0.0 };
        (slope * off, weight)
    };
    (0..force.len()).map(at).unzip()
}

/// Samples on either side of one over which the slope of force over penetration is taken.
const SLOPE_SAMPLES: usize = 8;
/// Range of penetration from which the readings themselves determine that slope, in standard deviations of its noise.
const SLOPE_RANGE: f64 = 8.0;

/// Slope of `force` over `path` around sample `i`, N/m, of samples with some weight; None where the path covers less than
/// `range` there.
fn local_slope(path: &[f64], force: &[f64], weight: &[f64], i: usize, range: f64) -> Option<f64> {
    let around = i.saturating_sub(SLOPE_SAMPLES)..(i + SLOPE_SAMPLES + 1).min(path.len());
    let near: Vec<(f64, f64)> = around.filter(|j| weight[*j] > 0.0).map(|j| (path[j], force[j])).collect();
    let (low, high) = near.iter().fold((f64::MAX, f64::MIN), |(a, b), (x, _)| (a.min(*x), b.max(*x)));
    if near.is_empty() || high - low < range {
        return None;
    }
    let n = near.len() as f64;
    let (mx, mf) = near.iter().fold((0.0, 0.0), |(a, b), (x, f)| (a + x / n, b + f / n));
    let (xx, xf) = near.iter().fold((0.0, 0.0), |(xx, xf), (x, f)| (xx + (x - mx).powi(2), xf + (x - mx) * (f - mf)));
    Some(xf / xx)
}

/// The readings less the fit's, by recording and channel.
fn remainders(base: &Fitted) -> Vec<[Option<Vec<f64>>; 3]> {
    let of = |(rec, (_, y)): (&Record, (Trace, [Vec<f64>; 3]))| Channel::ALL.map(|c| rec.left_of(c, &y[c.index()]));
    base.data.records.iter().zip(simulations(base)).map(of).collect()
}

/// Samples on either side of a touch that a touch simulated a little off moves.
const ONSET: usize = 3;

/// Times samples are looked through for spikes: what stands beside a larger one shows once that is gone.
const PASSES: usize = 3;

/// Samples that stand alone far outside the noise: (recording, channel, sample).
fn spikes(base: &Fitted, simulated: &Simulated) -> Vec<(usize, usize, usize)> {
    let data = &base.data;
    let mut out = Vec::new();
    for (r, (rec, (t, y))) in data.records.iter().zip(simulated).enumerate() {
        let touching: Vec<bool> = t.position.iter().map(|x| *x > 0.0).collect();
        for c in data.compared(r) {
            let i = c.index();
            let Some(read) = &rec.y[i] else { continue };
            let e = weighed(rec, c, &y[i]).unwrap_or_default();
            let s = data.noise[i].marginal();
            let mut kept = vec![true; e.len()];
            for _ in 0..PASSES {
                let found: Vec<usize> =
                    (0..e.len()).filter(|k| kept[*k] && is_spike(*k, &e, read, &kept, &touching, s)).collect();
                found.iter().for_each(|k| kept[*k] = false);
                if found.is_empty() {
                    break;
                }
            }
            let found = (0..e.len()).filter(|k| !kept[*k]).collect();
            out.extend(that_stand_alone(found, e.len()).into_iter().map(|k| (r, i, k)));
        }
    }
    out
}

/// Share of what a sample is off its neighbours by which it is off the cubic through them too: a spike is by all of it, one of
/// two beside each other by a third, the crest of a ringing by a tenth or less.
const OFF_CUBIC: f64 = 0.25;
/// Standard deviations of white noise by which a sample and the parabola through the three that follow the next one differ.
const BY_PARABOLA: f64 = 10.5;

/// Whether sample `k` stands alone: the residual `e` by 5 `sigma` outside its neighbours', of which out of contact one on
/// either side may be another spike, and outside the smooth course through them, which a ringing follows and a spike does
/// not. Where touch begins or ends, a force that jumps leaves such a residual if it jumps a sample early or late in the
/// simulation: there the reading itself has to stick out of those around it, which no jump does. Only samples `kept` count.
fn is_spike(k: usize, e: &[f64], read: &[f64], kept: &[bool], touching: &[bool], sigma: f64) -> bool {
    let around = |half: usize| k.saturating_sub(half)..(k + half + 1).min(e.len());
    let mut near: Vec<f64> = around(4).filter(|j| j.abs_diff(k) > 1 && kept[*j]).map(|j| e[j]).collect();
    if near.len() < 3 {
        return false;
    }
    near.sort_by(f64::total_cmp);
    let middle = near[near.len() / 2];
    // in contact two samples beside each other may be a peak cut off; elsewhere they are two spikes
    let aside = usize::from(!touching[k] && near.len() > 4);
    let spread = near[near.len() - 1 - aside] - near[aside];
    let off = (e[k] - middle).abs();
    if off <= 5.0 * sigma || off <= 1.5 * spread || off_course(e, k, kept, sigma) <= OFF_CUBIC * off {
        return false;
    }
    let onset = around(ONSET).any(|j| touching[j] != touching[k]);
    let mut others: Vec<f64> = around(4).filter(|j| *j != k && kept[*j]).map(|j| read[j]).collect();
    others.sort_by(f64::total_cmp);
    let (low, high) = (others[aside], others[others.len() - 1 - aside]);
    !onset || read[k] < low - 5.0 * sigma || read[k] > high + 5.0 * sigma
}

/// How far sample `k` of 5 or more is off the smooth course of those around it: of the cubic through the two on either side;
/// at an end, of the parabola through the three that follow the next one, less 5 standard deviations of what noise does to
/// that. Infinite where one of these is not `kept`: then the others alone decide.
fn off_course(e: &[f64], k: usize, kept: &[bool], sigma: f64) -> f64 {
    let are_kept = |of: &[usize]| of.iter().all(|j| kept[*j]);
    if let Some(there) = by_neighbours(e, k) {
        return if are_kept(&[k - 2, k - 1, k + 1, k + 2]) { (e[k] - there).abs() } else { f64::INFINITY };
    }
    let of = if k < 2 { [k + 2, k + 3, k + 4] } else { [k - 2, k - 3, k - 4] };
    if !are_kept(&of) {
        return f64::INFINITY;
    }
    let there = 6.0 * e[of[0]] - 8.0 * e[of[1]] + 3.0 * e[of[2]];
    (e[k] - there).abs() - 5.0 * BY_PARABOLA * sigma
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use std::f64::consts::TAU;

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
            (0..e.len()).filter(|k| is_spike(*k, &e, read, &vec![true; e.len()], touching, 1.0)).collect()
        };
        assert!(spikes(&read, &touching).is_empty());
        // the residual alone would have it so
        assert_eq!(spikes(&read, &[false; 40]), [20]);
        read[8] = 30.0;
        read[19] = -20.0;
        read[30] += 12.0;
        assert_eq!(spikes(&read, &touching), [8, 19, 30]);
    }

    #[test]
    fn neither_a_ringing_nor_the_end_of_a_bend_is_a_spike() {
        let found = |e: &[f64]| -> Vec<usize> {
            let free = vec![false; e.len()];
            (0..e.len()).filter(|k| is_spike(*k, e, &vec![0.0; e.len()], &vec![true; e.len()], &free, 1.0)).collect()
        };
        for period in 6..40 {
            let ringing: Vec<f64> =
                (0..60).map(|i| 50.0 * (TAU * (f64::from(i) + 0.3) / f64::from(period)).cos()).collect();
            // at an end nothing follows a ringing as fast as four samples see of it
            let inside = found(&ringing).into_iter().filter(|k| period >= 24 || (2..58).contains(k));
            assert_eq!(inside.count(), 0, "period {period}: {:?}", found(&ringing));
        }
        let bend: Vec<f64> = (0..30).map(|i| 2.0 * f64::from(i * i)).collect();
        assert!(found(&bend).is_empty(), "{:?}", found(&bend));
        // a spike at either end, one inside, and two beside each other
        for at in [&[0][..], &[29], &[12], &[12, 13]] {
            let mut spiked: Vec<f64> = bend.iter().map(|e| 0.1 * e).collect();
            at.iter().for_each(|k| spiked[*k] += 400.0);
            assert_eq!(found(&spiked), at);
        }
    }

    #[test]
    fn a_noise_that_grows_with_the_signal_weighs_the_peak_less_and_one_that_does_not_leaves_it() {
        let dir = tempfile::tempdir().unwrap();
        plant::recipe::write_campaign(dir.path(), &plant::recipe::Recipe::default()).unwrap();
        let mut c = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let least = |c: &Campaign| {
            let data = Prepared::new(c).unwrap().data;
            let of = |r: &crate::problem::Record| {
                let at = |k: &usize| r.y[0].as_ref().unwrap()[*k];
                let k = (0..r.weight[0].len()).max_by(|a, b| at(a).total_cmp(&at(b))).unwrap();
                (r.weight[0][k], at(&k) / data.noise[0].marginal())
            };
            data.records.iter().map(of).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
        };
        assert!(least(&c).0 > 0.9, "{:?}", least(&c));
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        for y in c.recordings.iter_mut().filter_map(|r| r.channels[0].as_mut()) {
            for y in y {
                *y *= 1.0 + 0.02 * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
            }
        }
        let (weight, peak) = least(&c);
        let right = 1.0 / (1.0 + (0.02 * peak).powi(2)).sqrt();
        assert!(right < 0.5 && (weight / right - 1.0).abs() < 0.15, "{weight} {right}");
    }

    #[test]
    fn a_right_law_leaves_white_noise_of_indentations_with_a_short_free_line_and_slow_noise() {
        let dir = tempfile::tempdir().unwrap();
        let mut toml = String::from(
            "format = \"recordings/1\"\n[campaign]\nname = \"i\"\nkind = \"indentation\"\n[simulation]\nterms = []\n",
        );
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        for (r, depth) in [2e-6, 3e-6, 4e-6, 6e-6].into_iter().enumerate() {
            let mut csv = String::from("time [s],force [N],penetration [m]\n");
            let mut slow = 0.0;
            for i in 0..440 {
                let free = 22.0;
                let way = if i < 220 { f64::from(i) } else { f64::from(439 - i) };
                let x: f64 = (way - free) / (220.0 - free) * depth;
                // an autoregression of 2 mN, and 4 nm on the path
                slow = 0.7 * slow + 2e-3 * 0.51_f64.sqrt() * normal();
                let force = 4e8 * x.max(0.0).powf(1.6) + slow;
                csv += &format!("{:.6e},{force:.6e},{:.6e}\n", 0.01 * f64::from(i), x + 4e-9 * normal());
            }
            std::fs::write(dir.path().join(format!("r{r}.csv")), csv).unwrap();
            toml += &format!("[[recording]]\nfile = \"r{r}.csv\"\norder = {}\nlevel = {depth:e}\n", r + 1);
        }
        std::fs::write(dir.path().join("campaign.toml"), toml).unwrap();
        let c = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let p = Prepared::new(&c).unwrap();
        let base = Fitted::base(&p.data, &p.structure, &p.guess).carried_on();
        let (a_sample, over) = (base.chi2() / p.data.samples() as f64, base.overdispersion());
        assert!((0.8..1.3).contains(&a_sample) && (0.4..1.8).contains(&over), "{a_sample} {over}");
        let noise = p.data.noise[0];
        assert!((noise.marginal() / 2e-3 - 1.0).abs() < 0.3, "{}", noise.marginal());
        assert!(noise.low_frequency() > 1.4 * noise.marginal(), "{}", noise.low_frequency());
    }
}
