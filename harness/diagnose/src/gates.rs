//! What keeps a finding from being handed out in an FMU: each reason in plain words.

use super::candidate::WHITE;
use super::decide::Decision;
use super::material::{remainder, Remainder};

/// Reasons why what `d` names, leaving `left`, is not to be relied on; empty where there is none, or no mechanism was named.
pub fn gates(d: &Decision, left: &Remainder) -> Vec<String> {
    let mut v = Vec::new();
    if !d.names_something() {
        return v;
    }
    let bounds = d.chosen.at_bounds();
    if !bounds.is_empty() {
        v.push(format!("{} rests at a bound: its value is the bound's, not the recordings'.", bounds.join(", ")));
    }
    if d.after.as_ref().is_some_and(|a| a.nrmse > d.before.nrmse) {
        let what = if d.evidence.levels > 1 { "levels" } else { "recordings" };
        v.push(format!(
            "With the mechanisms named, {what} not seen would be predicted worse; they are predicted by the simulation as given."
        ));
    }
    v.extend(little_measured(d));
    if d.overdispersion.1 > WHITE {
        let (left, was) = (left.share_of_range, remainder(&d.base, false).share_of_range);
        if left > was - left {
            v.push(format!(
                "The fit stays far from the recordings: of a slow misfit of {:.2} % of range it leaves {:.2} %.",
                100.0 * was,
                100.0 * left
            ));
        }
    }
    v
}

/// What one recording alone, or one level alone, cannot show; None where there is more.
pub fn little_measured(d: &Decision) -> Option<String> {
    if d.base.data.records.len() < 2 {
        Some(
            "One recording only: what holds for every impact cannot be separated from what belongs to this one; held-out \
             means fitted to its first half cycle."
                .into(),
        )
    } else if d.evidence.levels < 2 {
        Some(
            "One level only: what grows with speed or depth cannot be distinguished from what does not, and held-out means \
             without the recording itself."
                .into(),
        )
    } else {
        None
    }
}
