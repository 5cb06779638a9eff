//! How far predictions of levels not seen are off, level by level and channel by channel: in the channel's unit and in multiples of
//! its noise.

use crate::predictions::Predictions;
use estimate::problem::Data;
use record::Channel;

/// Predictions of a level's recordings in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OfChannel {
    pub channel: Channel,
    /// Root mean square of reading less prediction, unit of the channel.
    pub rms: f64,
    /// The same over the standard deviation of the channel's noise, mean of the recordings, 1.
    pub over_noise: f64,
    /// Recordings that it is of.
    pub recordings: usize,
}

/// Of recording `r` and channel `c`: rms of reading less prediction over the samples that count; None where there is none.
fn rms(data: &Data, p: &Predictions, r: usize, c: Channel) -> Option<f64> {
    let (rec, i) = (&data.records[r], c.index());
    let left = rec.left_of(c, p.judged.get(r)?.get(i)?)?;
    let counted = left.iter().zip(&rec.weight[i]).filter(|(v, w)| **w > 0.0 && v.is_finite());
    let (sum, n) = counted.fold((0.0, 0.0), |(sum, n), (v, _)| (sum + v * v, n + 1.0));
    (n > 0.0).then(|| f64::sqrt(sum / n))
}

/// The channels of the recordings of `level` (None: of all), those compared alone: an imposed motion is none of them.
pub fn by_channel(data: &Data, p: &Predictions, level: Option<usize>) -> Vec<OfChannel> {
    let of = |channel: Channel| {
        let noise = data.noise[channel.index()].marginal();
        let records = (0..data.records.len()).filter(|r| level.is_none_or(|l| data.records[*r].level == l));
        let compared = records.filter(|r| data.compared(*r).any(|c| c == channel));
        let all: Vec<f64> = compared.filter_map(|r| rms(data, p, r, channel)).collect();
        let n = all.len() as f64;
        (!all.is_empty() && noise > 0.0).then(|| OfChannel {
            channel,
            rms: (all.iter().map(|v| v * v).sum::<f64>() / n).sqrt(),
            over_noise: all.iter().sum::<f64>() / (n * noise),
            recordings: all.len(),
        })
    };
    Channel::ALL.into_iter().filter_map(of).collect()
}

/// Misfit in multiples of noise: mean over recordings and channels; None where nothing is compared.
pub fn over_noise(all: &[OfChannel]) -> Option<f64> {
    let n: usize = all.iter().map(|c| c.recordings).sum();
    (n > 0).then(|| all.iter().map(|c| c.over_noise * c.recordings as f64).sum::<f64>() / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimate::prepare::Prepared;
    use plant::recipe::{write_campaign, Recipe};
    use std::convert::Infallible;

    #[test]
    fn readings_themselves_are_off_by_nothing_and_a_shift_by_itself() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let c = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let data = Prepared::new(&c).unwrap().data;
        let shifted = |by: f64| {
            let of = |r: &estimate::problem::Record| {
                [0, 1, 2].map(|i| {
                    let y = r.y[i].clone().unwrap_or_default();
                    y.iter().map(|v| v + by * data.noise[i].marginal()).collect()
                })
            };
            Predictions::new(data.records.iter().map(of).collect(), &data, |_, _| {
                Ok::<_, Infallible>(Default::default())
            })
            .unwrap()
        };
        assert_eq!(over_noise(&by_channel(&data, &shifted(0.0), None)), Some(0.0));
        let all = by_channel(&data, &shifted(3.0), Some(data.records[0].level));
        assert!(!all.is_empty());
        for c in &all {
            assert!((c.over_noise - 3.0).abs() < 1e-9, "{c:?}");
            assert!((c.rms / data.noise[c.channel.index()].marginal() - 3.0).abs() < 1e-9, "{c:?}");
        }
        assert_eq!(over_noise(&by_channel(&data, &shifted(3.0), Some(99))), None);
    }
}
