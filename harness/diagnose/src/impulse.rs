//! The impulse that a channel at its limit did not read: the change of speed of the impact bounds it, and with it the peak
//! that an incomplete law gives.

use estimate::problem::{Point, Problem};
use estimate::structure::GAIN;
use record::{largest, Channel, Kind};
use statrs::statistics::Statistics;

/// Standard deviation of the share of the model's excess beyond the limit that was there: where the model leaves more
/// than noise, what it says beyond is a guess to within half.
const GUESSED: f64 = 0.5;
/// Share of the limit up to which a reading has not reached it.
const BELOW: f64 = 0.98;

/// What one recording's readings leave of the body's change of speed, m/s.
struct Balance {
    /// Speed at the start as reported, and its standard deviation.
    speed: f64,
    sd: f64,
    /// How much more speed than in the model there is at the end, where the readings below the limit, and the model
    /// beyond it, lead from there.
    more: f64,
    /// Change of speed by what the model has beyond the limit; 0 where nothing is.
    beyond: f64,
    /// Whether the readings stay below the limit.
    whole: bool,
}

/// Integral over time by trapezoids.
fn integral(time: &[f64], y: impl Fn(usize) -> f64) -> f64 {
    (1..time.len()).map(|i| 0.5 * (y(i) + y(i - 1)) * (time[i] - time[i - 1])).sum()
}

/// Mean and standard deviation that is expected of one more; None of fewer than two.
fn one_more(v: &[f64]) -> Option<(f64, f64)> {
    (v.len() > 1).then(|| (v.mean(), v.std_dev() * (1.0 + 1.0 / v.len() as f64).sqrt()))
}

/// The share of the model's excess beyond the limit of `channel` that was there, with its standard deviation, by
/// recording; (1, 0) where nothing is known of it. `point`: a fit, of which `problem` is, that leaves more than noise.
///
/// The reading of an acceleration, or a force over the mass, adds up to the change of speed. The speed at the start is
/// reported; that at the end is the model's, put right by what the recordings that stayed below the limit show to be wrong
/// with it, as a share of the speed: coefficients of restitution are alike, and fall with speed as the law has it.
pub(super) fn shares(problem: &Problem<'_>, point: &Point, channel: Channel) -> Vec<(f64, f64)> {
    let records = &problem.data.records;
    let unknown = vec![(1.0, 0.0); records.len()];
    let physics = problem.physics(&point.theta);
    let coupled = physics.charge_droop.rate > 0.0 && physics.charge_droop.channel == channel;
    if problem.data.kind != Kind::DropTest || coupled {
        return unknown;
    }
    let gain = physics.force_gain.channel[channel.index()];
    let speed = match channel {
        Channel::Acceleration => 1.0 / gain,
        Channel::Force => -1.0 / (gain * physics.mass),
        Channel::Penetration => return unknown,
    };
    let balance = |r: usize| -> Option<Balance> {
        let (record, local) = (&records[r], &point.locals[r]);
        let read = record.y[channel.index()].as_ref()?;
        let (reported, sd) = record.speed?;
        let (trace, kept, free) = problem.predict_unlimited(&point.theta, r, local);
        let (kept, free) = (&kept[channel.index()], &free[channel.index()]);
        let time = &record.setup.time;
        let fitted = if record.at_first { trace.first_speed } else { problem.local(local).speed };
        Some(Balance {
            speed: reported,
            sd,
            more: reported - fitted + speed * integral(time, |i| read[i] - kept[i]),
            beyond: speed * integral(time, |i| free[i] - kept[i]),
            whole: largest(read) < BELOW * physics.clipping.level,
        })
    };
    let balances: Vec<Option<Balance>> = (0..records.len()).map(balance).collect();
    let whole: Vec<&Balance> = balances.iter().flatten().filter(|b| b.whole && b.beyond == 0.0).collect();
    let ratios: Vec<f64> = whole.iter().map(|b| b.more / b.speed).collect();
    let Some((more, scatter)) = one_more(&ratios) else { return unknown };
    // known no better than the speeds reported
    let reported = whole.iter().map(|b| b.sd / b.speed.abs()).sum::<f64>() / (whole.len() as f64).powf(1.5);
    let more_sd = scatter.max(reported);
    let share = |b: &Balance| -> (f64, f64) {
        let measured = 1.0 + (more * b.speed - b.more) / b.beyond;
        let sd = (b.sd.powi(2) + (more_sd * b.speed).powi(2) + (GAIN * b.speed).powi(2)).sqrt() / b.beyond.abs();
        let (prior, weight) = (GUESSED.powi(-2), sd.powi(-2));
        (((prior + weight * measured) / (prior + weight)).max(0.0), (prior + weight).powf(-0.5))
    };
    balances.iter().map(|b| b.as_ref().filter(|b| b.beyond != 0.0).map_or((1.0, 0.0), share)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unclipped::unclipped;
    use estimate::fitted::Fitted;
    use estimate::prepare::Prepared;
    use estimate::problem::Options;
    use estimate::structure::Term;
    use plant::recipe::{write_campaign, Recipe};
    use record::{load, Campaign};

    const LIMIT: f64 = 1700.0;

    /// Drops onto a layer that nothing in the model knows, the accelerometer alone, with a limit or without.
    fn drops(limit: f64) -> Campaign {
        let mut recipe = Recipe { speed_at_touch: true, ..Recipe::default() };
        recipe.physics.law.secondary_stiffening.stiffness = 6e6;
        recipe.physics.law.secondary_stiffening.depth = 1.5e-4;
        recipe.physics.law.secondary_stiffening.exponent = 1.0;
        (recipe.physics.clipping.level, recipe.physics.clipping.channel) = (limit, Channel::Acceleration);
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &recipe).unwrap();
        let mut c = load(dir.path(), &mechanisms::terms()).unwrap();
        c.recordings.iter_mut().for_each(|r| (r.channels[0], r.channels[2]) = (None, None));
        c
    }

    #[test]
    fn speeds_before_and_after_correct_a_peak_that_a_wrong_law_gives() {
        let without_limit: Vec<f64> = drops(f64::INFINITY)
            .recordings
            .iter()
            .map(|r| largest(r.channels[Channel::Acceleration.index()].as_ref().unwrap()))
            .collect();
        let c = drops(LIMIT);
        let Prepared { data, guess, structure } = Prepared::new(&c).unwrap();
        let base = Fitted::base(&data, &structure, &guess);
        let clip: Term = structure
            .base()
            .candidates()
            .into_iter()
            .find(|t| t.mechanism.hints.limits_reading && t.form.label == "acceleration, hard")
            .unwrap();
        let wrong = base.add(&clip, 2, &Options::default()).unwrap();
        let (_, found) = unclipped(&wrong).unwrap();
        let shares = shares(&wrong.problem(), &wrong.fit.point, Channel::Acceleration);
        // errors of the peaks, and of those that the law has without the speeds
        let (mut by_speeds, mut by_law, mut clipped) = (0.0f64, 0.0f64, 0);
        for ((u, peak), (share, _)) in found.iter().zip(&without_limit).zip(shares).filter(|((u, _), _)| u.clipped) {
            let law = LIMIT + (u.peak - LIMIT) / share;
            by_speeds = by_speeds.max((u.peak / peak - 1.0).abs());
            by_law = by_law.max((law / peak - 1.0).abs());
            clipped += 1;
        }
        assert!(clipped == 6 && by_speeds < 0.02 && by_law > 0.03, "{clipped} {by_speeds} {by_law}");
    }
}
