//! The calibrated numbers that turn evidence into probabilities, and what they weigh.

use crate::evidence::{ln_sum, Weighed, LARGE, SIZES};
use serde::Deserialize;

/// What turns evidence into probabilities.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// ln of what differences of ln evidence are divided by.
    pub temperature: f64,
    /// Power of the least overdispersion left, on that.
    pub overdispersion: f64,
    /// ln of the difference from which on evidence counts by its logarithm.
    pub tail: f64,
    /// What is added to `temperature` and to `tail` where the most evidence of all is without a discrepancy: the laws
    /// are right to the noise.
    pub noise_temperature: f64,
    pub noise_tail: f64,
    /// ln prior of one mechanism, of several, and of an unknown cause, over that of nothing.
    pub single: f64,
    pub pair: f64,
    pub unknown: f64,
    /// ln weight of a stand-in, of what each recording has of its own, of a large discrepancy, among the unknown; and of a
    /// large discrepancy and a small one of each recording's own beside what is known.
    pub stand_in: f64,
    pub own: f64,
    pub large: f64,
    pub large_known: f64,
    pub own_known: f64,
    /// Powers of the overdispersion that a structure leaves, on the weight of its large discrepancy among the unknown and
    /// beside what is known: where next to nothing is left, the discrepancy is no reason to doubt the names.
    pub large_left: f64,
    pub large_known_left: f64,
    /// ln weight of instruments that are disturbed: that drift, hum or walk.
    pub drift: f64,
    /// Weight of ln(1 + nats that such instruments explain) on every cause that has them, but the unknown: instruments
    /// that explain very much are more likely something that nobody has named.
    pub disturbed: f64,
    /// ln weight of the discrepancy's sizes, a step, and of none at all.
    pub size: f64,
    pub none: f64,
    /// ln weight of each parameter of the mechanisms added: forms were chosen among many.
    pub parameter: f64,
    /// ln weight of a structure with a parameter at a bound, and of any name where there is one level only.
    pub bound: f64,
    pub one_level: f64,
    /// Weights of the ln of how many times better a structure predicts levels not seen than the simulation as given, and of
    /// how many times worse.
    pub heldout: f64,
    pub worse: f64,
    /// ln weight of names that limit a reading where readings end in a flat top: no impact makes one.
    pub flat: f64,
    /// Weight of ln(1 + nats that the best structure with these names has over the best without them): what is needed by
    /// all that explain much is likely there, whatever else is.
    pub needed: f64,
    /// Weight of ln(1 + nats that the best structure with these names and more has over the best with these alone): what
    /// is part of an explanation that works may be right and not all.
    pub completed: f64,
    /// Probability that a set has to add up to, to hold the cause with 95 %.
    pub level: f64,
    /// What laws that are learned as functions are weighed by.
    pub learned: learn::Numbers,
}

impl Table {
    /// The table that `tests/calibrate` wrote.
    ///
    /// # Panics
    /// Never: the file is part of the build, and a test reads it.
    pub fn calibrated() -> Table {
        serde_json::from_str(include_str!("../calibration.json")).expect("the calibration is a table")
    }

    /// ln weight of predictions of levels not seen, `better` times better than those of the simulation as given (its ln).
    pub fn of_heldout(&self, better: f64) -> f64 {
        self.heldout * better.max(0.0) + self.worse * (-better).max(0.0)
    }

    /// ln weight of the discrepancy's size of this index.
    pub fn of_size(&self, i: usize) -> f64 {
        if i == 0 {
            self.none
        } else {
            self.size * (i - 1) as f64
        }
    }

    /// ln evidence of a structure over all discrepancies that are small print, weighted.
    pub fn mass(&self, w: &Weighed) -> f64 {
        let of_parameters = self.parameter * w.parameters as f64;
        let each = w.ln.iter().enumerate().flat_map(|(drifts, of)| {
            let small = of.iter().enumerate().filter(|(i, ln)| SIZES[*i] < LARGE && ln.is_finite());
            small.map(move |(i, ln)| ln + self.of_size(i) + drifts as f64 * self.drift + of_parameters)
        });
        ln_sum(&each.collect::<Vec<_>>())
    }
}
