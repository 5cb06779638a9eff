//! Readings predicted of every recording: of the samples that are judged, and of the whole recording.

use estimate::levels::nrmse;
use estimate::problem::Data;

/// Readings predicted of every recording, by channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Predictions {
    /// Of the samples that are judged.
    pub judged: Vec<[Vec<f64>; 3]>,
    /// At the times of [`Data::whole`], where not all samples are judged; else empty.
    whole: Vec<[Vec<f64>; 3]>,
}

impl Predictions {
    /// Of what is predicted of the samples judged; `of` predicts recording `r` of the data that it is given, for those of
    /// the whole.
    ///
    /// # Errors
    /// As `of`.
    pub fn new<E>(
        judged: Vec<[Vec<f64>; 3]>,
        data: &Data,
        of: impl Fn(&Data, usize) -> Result<[Vec<f64>; 3], E>,
    ) -> Result<Predictions, E> {
        let whole = match data.whole() {
            Some(whole) => (0..whole.records.len()).map(|r| of(&whole, r)).collect::<Result<_, E>>()?,
            None => Vec::new(),
        };
        Ok(Predictions { judged, whole })
    }

    /// Of each recording from its first sample to its last.
    pub fn of_the_whole(&self) -> &[[Vec<f64>; 3]] {
        if self.whole.is_empty() {
            &self.judged
        } else {
            &self.whole
        }
    }

    /// Puts what `from` has of recording `r` in the place of what stands here.
    pub fn put(&mut self, r: usize, from: &Predictions) {
        for (to, from) in [(&mut self.judged, &from.judged), (&mut self.whole, &from.whole)] {
            if let (Some(to), Some(from)) = (to.get_mut(r), from.get(r)) {
                to.clone_from(from);
            }
        }
    }

    /// Misfit: the mean over recordings and channels of rms(recording - prediction) / range(recording), 1.
    pub fn misfit(&self, data: &Data) -> f64 {
        self.mean_of(data, |_, _| true)
    }

    /// The same of the channels that a fit compares: an imposed motion is none of them, 1.
    pub fn misfit_of_compared(&self, data: &Data) -> f64 {
        self.mean_of(data, |r, c| data.compared(r).any(|of| of.index() == c))
    }

    /// The same of the channels that `counts` says of, by recording and channel.
    fn mean_of(&self, data: &Data, counts: impl Fn(usize, usize) -> bool) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for (r, (rec, p)) in data.records.iter().zip(&self.judged).enumerate() {
            for (c, (y, p)) in rec.y.iter().zip(p).enumerate() {
                let Some(y) = y.as_ref().filter(|_| counts(r, c)) else { continue };
                if let Some(e) = nrmse(y, p) {
                    sum += e;
                    n += 1.0;
                }
            }
        }
        if n > 0.0 {
            sum / n
        } else {
            f64::NAN
        }
    }
}
