//! What recordings of levels that the fit did not see say of a second name and of a third.

use super::candidate::Candidate as _;
use super::decide::Decision;
use super::heldout::{held_out, HeldOut};
use super::search::Search;
use estimate::fitted::Fitted;

/// Ratio of held-out misfits from which a second name is believed although something stays unexplained.
const BELIEVED: f64 = 0.9;
/// The same for a third name beside two that are believed: in forms that are not quite right they leave a remainder that
/// a third absorbs in part.
const THIRD: f64 = 0.75;
/// Ratio of held-out misfits up to which a calibration is kept: one that drifts predicts no better, and is wrong still.
const CALIBRATED: f64 = 1.01;
/// Names at most, and how many of those that may stand beside the ones found are asked what they predict.
const MOST_NAMES: usize = 3;
const FURTHER: usize = 5;
/// Overdispersion of what two names leave, and the share of the misfit not seen that is left, from which a third is sought.
const FAR_FROM_NOISE: f64 = 3.0;
const HALVED: f64 = 0.5;

/// Lets the levels not seen decide on a second name: one that predicts them worse than the first alone goes, one that
/// was doubted for what stays unexplained beside it is believed where it predicts them far better, and better than the
/// simulation as given does.
pub(super) fn weigh_second(search: &Search, d: &mut Decision, before: &HeldOut, after: HeldOut) {
    if let Some(pair) = d.doubted.take() {
        let with = held_out(&pair);
        if with.nrmse < BELIEVED * after.nrmse && with.nrmse < before.nrmse {
            carried_on(search, d, pair, with, BELIEVED);
        }
    } else if d.chosen.structure.terms().len() > 1 {
        let first = d.chosen.names()[0];
        if let Some(single) = d.singles.iter().find(|s| s.names() == [first]) {
            let alone = held_out(single);
            let tolerated = if d.chosen.calibrates() { CALIBRATED } else { 1.0 };
            if alone.nrmse * tolerated < after.nrmse {
                d.chosen = single.clone();
                return;
            }
        }
        if d.overdispersion.1 > FAR_FROM_NOISE && after.nrmse > HALVED * before.nrmse {
            carried_on(search, d, d.chosen.clone(), after, THIRD);
        }
    }
}

/// Further names beside `chosen`, as long as each brings the misfit of levels not seen below `ratio` of what it was.
fn carried_on(search: &Search, d: &mut Decision, mut chosen: Fitted, mut best: HeldOut, ratio: f64) {
    while chosen.structure.terms().len() < MOST_NAMES {
        let next = search
            .further(&chosen, FURTHER)
            .into_iter()
            .map(|c| (held_out(&c), c))
            .min_by(|a, b| a.0.nrmse.total_cmp(&b.0.nrmse));
        match next {
            Some((h, c)) if h.nrmse < ratio * best.nrmse => (best, chosen) = (h, c),
            _ => break,
        }
    }
    d.chosen = chosen;
}
