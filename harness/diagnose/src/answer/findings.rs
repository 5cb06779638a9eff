//! What the answer tells beyond the decision: everything is worked out while the search still stands.

use crate::alarm::{alarm, Alarm};
use crate::bias::{biases, Bias};
use crate::bootstrap::Bootstrap;
use crate::candidate::Candidate;
use crate::decide::Decision;
use crate::experiment::{ties, Tie};
use crate::heldout::HeldOut;
use crate::intervals::{intervals, Intervals};
use crate::latent::{latent, Latent};
use crate::map::{map, Cell};
use crate::rivals::{rivals, Rival};
use crate::search::{MakeUp, Search};
use crate::sensors::Against;
use crate::unclipped::{unclipped, Unclipped};
use estimate::problem::{Options, Problem};
use record::{Campaign, Channel};

/// The findings of one campaign.
#[derive(Default)]
pub struct Findings {
    /// Where the misfit sits, before and after.
    pub map: Vec<Cell>,
    /// Candidates with their held-out scores, best first.
    pub rivals: Vec<Rival>,
    /// How often noise alone would look as bad.
    pub alarm: Option<Alarm>,
    /// Bias of the base parameters by what was left out; empty where nothing was found.
    pub bias: Vec<Bias>,
    /// Intervals of every term chosen.
    pub intervals: Vec<Intervals>,
    /// The tie of every term chosen, where it has one.
    pub ties: Vec<Option<Tie>>,
    /// The force it takes, where something stays unexplained.
    pub latent: Option<Latent>,
    /// The clipped channel and its recordings without the clip.
    pub unclipped: Option<(Channel, Vec<Unclipped>)>,
    pub bootstrap: Option<Bootstrap>,
    /// This campaign's sensor against others that read the same impacts.
    pub sensors: Vec<Against>,
    /// What a reader has to know before believing the rest.
    pub caveats: Vec<String>,
}

/// Quiet samples (nothing touches) below which noise is not learnt from them.
const QUIET: usize = 64;

/// Works the findings out. `stage` is told what is being done.
pub fn gather(
    c: &Campaign,
    search: &Search<'_>,
    d: &Decision,
    before: &HeldOut,
    after: Option<&HeldOut>,
    stage: &dyn Fn(&str),
) -> Findings {
    let wander = d.wander.1.max(1.0);
    stage("mapping the misfit");
    let mut f =
        Findings { map: map(search, &d.base, &d.chosen), caveats: caveats(c, search, d), ..Findings::default() };
    stage("drawing nulls");
    let gain = d.base.fit.point.chi2 - d.singles.iter().map(|s| s.fit.point.chi2).fold(f64::INFINITY, f64::min);
    let gain = gain.max(d.base.fit.point.chi2 - d.chosen.fit.point.chi2);
    f.alarm = alarm(search, &d.base, &d.chosen, if gain.is_finite() { gain } else { 0.0 });
    stage("scoring the rivals on levels they did not see");
    f.rivals = rivals(search, d, after.map(|a| a.nrmse));
    if d.detected {
        stage("finding intervals");
        f.intervals = intervals(search, &d.chosen, wander);
        f.bias = biases(search, &d.base, &d.chosen, wander);
        f.unclipped = unclipped(search, &d.chosen);
        if d.ties.iter().any(|t| !t.is_empty()) {
            stage("simulating experiments that part the ties");
            f.ties = ties(search, d);
        }
    }
    // a stiffness that swings between recordings is no force within one
    if d.unexplained && d.swing.is_none() {
        stage("finding the force it takes");
        f.latent = named_part(search, d).and_then(|r| latent(search, &r));
    }
    if let Some(a) = after {
        if a.nrmse > before.nrmse {
            f.caveats.push("With the mechanisms named, levels not seen are predicted worse than without.".into());
        }
    }
    f
}

/// The chosen model without what merely stands in for the unknown.
fn named_part(search: &Search<'_>, d: &Decision) -> Option<Candidate> {
    if d.chosen.make_up.terms.iter().all(|t| t.mechanism.named) {
        return Some(d.chosen.clone());
    }
    let terms: Vec<_> = d.chosen.make_up.terms.iter().filter(|t| t.mechanism.named).cloned().collect();
    if terms.is_empty() {
        return Some(d.base.clone());
    }
    let make_up = MakeUp { terms };
    let model = search.model(&make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(search.data, &model);
    let mut theta = d.base.fit.point.theta.clone();
    theta.extend(model.parameters[theta.len()..].iter().map(|p| p.start));
    let start = problem.evaluate(theta, d.base.fit.point.locals.clone());
    start.chi2.is_finite().then(|| Candidate { make_up, fit: problem.fit(start, &Options::default()) })
}

/// Samples in which nothing touches, and the channels compared.
fn caveats(c: &Campaign, search: &Search<'_>, d: &Decision) -> Vec<String> {
    let mut v = Vec::new();
    let data = search.data;
    let model = search.model(&d.base.make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(data, &model);
    let mut short: Vec<&str> = Vec::new();
    let quiet: usize = (0..data.records.len())
        .map(|r| {
            let (t, _) = problem.predict(&d.base.fit.point.theta, r, &d.base.fit.point.locals[r]);
            let time = &data.records[r].setup.time;
            if time.last().is_some_and(|end| t.deepest >= *end) {
                short.push(&data.records[r].file);
            }
            time.iter().filter(|s| **s < t.touch || **s > t.leave).count()
        })
        .sum();
    if let Some(first) = short.first() {
        v.push(format!(
            "{} of {} recordings ({first} first) end before the deepest point: nothing is known of unloading there.",
            short.len(),
            data.records.len()
        ));
    }
    if quiet < QUIET {
        v.push(format!(
            "Only {quiet} samples lie outside contact: noise was learnt from neighbouring samples and may be larger \
             than assumed. Record some time before touch."
        ));
    }
    if c.levels.len() < 2 {
        v.push(if data.records.len() > 1 {
            "One level only: what grows with speed or depth cannot be told from what does not, and held-out means \
             without the recording itself."
                .into()
        } else {
            "One recording only: held-out means fitted to its first half cycle.".into()
        });
    }
    let channels = Channel::ALL.into_iter().filter(|c| data.has(*c)).count();
    if channels == 1 {
        v.push("One channel only: errors of the chain, of the motion and of the contact look alike in it.".into());
    }
    let spikes: usize = data
        .records
        .iter()
        .flat_map(|r| r.weight.iter().zip(&r.y).filter(|(_, y)| y.is_some()))
        .map(|(w, _)| w.iter().filter(|w| **w == 0.0).count())
        .sum();
    if spikes > 0 {
        v.push(format!("{spikes} samples that stand alone far outside the noise were left out as spikes."));
    }
    if !d.chosen.fit.converged {
        v.push("The fit with the mechanisms named was still improving when it was stopped.".into());
    }
    v.extend(c.warnings.iter().cloned());
    v
}
