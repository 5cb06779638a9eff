//! What is worked out beyond the decision: map, intervals, ties, bias, latent force, caveats.

use crate::alarm::{alarm, Alarm};
use crate::bias::{biases, Bias};
use crate::body::OnBody;
use crate::bonds::{likely, Likely};
use crate::bootstrap::Bootstrap;
use crate::decide::Decision;
use crate::experiment::{ties, Tie};
use crate::figure::figure;
use crate::gates::{gates, little_measured};
use crate::holding::{instead_words, learned, Holds};
use crate::intervals::{intervals, Intervals};
use crate::latent::{latent, Latent};
use crate::map::{map, Cell};
use crate::material::{effect, remainder, Effect, Remainder};
use crate::posterior::{limits_reading, sorted};
use crate::rivals::{rivals, Rival};
use crate::search::Search;
use crate::sensors::Against;
use crate::unclipped::{unclipped, Unclipped};
use estimate::fitted::Fitted;
use estimate::problem::{Data, Options, Problem};
use estimate::structure::{Structure, Term};
use record::{Campaign, Channel};

/// The findings of one campaign.
#[derive(Default)]
pub struct Findings {
    /// Where the misfit sits, before and after.
    pub map: Vec<Cell>,
    /// Candidates with their held-out scores, best first.
    pub rivals: Vec<Rival>,
    /// What each name does to the figures a campaign is judged by, and what is left.
    pub material: Vec<Effect>,
    pub remainder: Remainder,
    /// How often noise alone would look as bad.
    pub alarm: Option<Alarm>,
    /// Bias of the base parameters by what was left out; empty where nothing was found.
    pub bias: Vec<Bias>,
    /// Intervals of every term chosen.
    pub intervals: Vec<Intervals>,
    /// Probability of each bond of a system of FMUs; empty where there is no choice.
    pub bonds: Vec<Likely>,
    /// The tie of every term chosen, where it has one.
    pub ties: Vec<Option<Tie>>,
    /// The force it takes, where something stays unexplained.
    pub latent: Option<Latent>,
    /// The clipped channel and its recordings without the clip.
    pub unclipped: Option<(Channel, Vec<Unclipped>)>,
    pub bootstrap: Option<Bootstrap>,
    /// This campaign's sensor against others that read the same impacts.
    pub sensors: Vec<Against>,
    /// Which FMUs hold the force that was learned in motion.
    pub holds_learned: Holds,
    /// The equation that the FMUs hold in the place of a law learned of imposed motion, in words; None where there is none.
    pub instead: Option<String>,
    /// What BodyForce.fmu holds; None where it is not written.
    pub on_body: Option<OnBody>,
    /// Why what is named is not handed out in an FMU; these stand among the caveats, too.
    pub gates: Vec<String>,
    /// What a reader has to know before believing the rest.
    pub caveats: Vec<String>,
}

/// Quiet samples (nothing touches) below which noise is not learnt from them.
const QUIET: usize = 64;

/// Works the findings out; `contradictions`: those of what was read. `stage` is called with what is done next.
pub fn gather(
    c: &Campaign,
    contradictions: &[String],
    search: &Search,
    d: &Decision,
    stage: &dyn Fn(&str),
) -> Findings {
    let overdispersion = d.overdispersion.1.max(1.0);
    stage("mapping the misfit");
    let mut f =
        Findings { map: map(&d.base, d.simulated()), caveats: caveats(c, contradictions, d), ..Findings::default() };
    stage("drawing nulls");
    f.alarm = alarm(search, &d.base, &d.chosen, d.gain);
    f.rivals = rivals(d);
    if d.detected {
        stage("finding intervals");
        f.intervals = intervals(&d.chosen, overdispersion);
        // of a law that was learned there is none of the simulation's own parameters, and beside a force learned in the place of an
        // unknown cause they stand for something else
        if !d.is_learned() && (d.force().is_none() || d.has_remainder()) {
            f.bias = biases(&d.base, &d.chosen, overdispersion);
        }
        f.unclipped = unclipped(&d.chosen);
        if d.base.data.machine().is_some() {
            stage("trying the other bonds");
            f.bonds = likely(d);
        }
        f.material = (0..d.chosen.structure.terms().len()).map(|i| effect(&d.chosen, i)).collect();
        if d.ties.iter().any(|t| !t.is_empty()) {
            stage("simulating experiments that part the ties");
            f.ties = ties(search, d);
        }
    }
    f.remainder = match &d.learned {
        Some(l) if l.leads => Remainder::of_a_law_learned(l.misfit, l.peaks(), d.unexplained),
        _ => remainder(d.simulated(), d.unexplained),
    };
    // a stiffness that scatters between recordings is no force within one
    if d.unexplained && d.excess_scatter.is_none() && !d.is_learned() {
        stage("finding the force it takes");
        f.latent = named_part(d).and_then(|r| latent(&r));
    }
    f.gates = gates(d, &f.remainder);
    f.instead = instead_words(d, f.gates.is_empty());
    f.holds_learned = learned(d).filter(|_| f.gates.is_empty()).unwrap_or_default();
    f.caveats.extend(disagreement(c, d));
    f.caveats.extend(cut_short(d));
    f.caveats.extend(learned_shape(d, f.instead.as_deref()));
    if !d.names_something() {
        f.caveats.extend(little_measured(d));
    }
    f.caveats.extend(f.gates.iter().cloned());
    f
}

/// What a reader has to know of names whose shape was learned; None where there are none.
fn learned_shape(d: &Decision, instead: Option<&str>) -> Option<String> {
    let l = d.learned.as_ref().filter(|l| l.leads && !l.names.is_empty())?;
    let instead = instead.map_or(String::new(), |i| format!(" {i}."));
    let predicts = if d.before.nrmse >= l.heldout.nrmse {
        ""
    } else {
        " What the fit did not see it would predict worse than the simulation as given, which predicts it."
    };
    Some(format!(
        "No equation of the vocabulary has the shape of what is named: the shape is learned, and drawn below. \
         HysteresisContact.fmu does not hold it.{instead}{predicts}"
    ))
}

/// Which folds chose other names, in words; None where all agree.
fn disagreement(c: &Campaign, d: &Decision) -> Option<String> {
    let (folds, own) = match d.learned.as_ref().filter(|l| l.leads) {
        Some(l) => {
            let names = l.names.iter().map(|n| n.mechanism.name).filter(|n| !limits_reading(&[n]));
            (&l.folds, sorted(&names.collect::<Vec<_>>()))
        }
        None => (&d.folds.as_ref()?.names, d.chosen.names()),
    };
    let other = |(out, names): &(Vec<usize>, Vec<&'static str>)| {
        let first = &d.base.data.records[*out.first()?];
        let without = match c.levels.get(first.level).filter(|_| c.levels.len() > 1) {
            Some(level) => level.1.clone(),
            None => first.file.clone(),
        };
        let named = if names.is_empty() { "nothing".into() } else { names.join(" and ") };
        Some(format!("without {without}: {named}"))
    };
    let others: Vec<String> = folds.iter().filter(|(_, n)| *n != own).filter_map(other).collect();
    (!others.is_empty()).then(|| {
        format!(
            "Not every part of the campaign gives the same names; {} of {} folds agree ({}). What is predicted of a level is \
             predicted by the names found without it.",
            folds.len() - others.len(),
            folds.len(),
            others.join("; ")
        )
    })
}

/// Which shorter windows give other names, in words; None where all agree.
fn cut_short(d: &Decision) -> Option<String> {
    let own = d.chosen.names();
    let named = |n: &[&str]| if n.is_empty() { "nothing".into() } else { n.join(" and ") };
    let of = |(end, n): &(f64, Vec<&'static str>)| format!("cut {end} contact times after the touch: {}", named(n));
    let others: Vec<String> = d.windows.iter().filter(|(_, n)| *n != own).map(of).collect();
    let text = format!("Shorter recordings would give other names ({}).", others.join("; "));
    (!others.is_empty()).then_some(text)
}

/// The chosen model without what merely stands in for the unknown.
fn named_part(d: &Decision) -> Option<Fitted> {
    if d.chosen.is_named() {
        return Some(d.chosen.clone());
    }
    let terms: Vec<_> = d.chosen.structure.terms().iter().filter(|t| t.mechanism.named).cloned().collect();
    if terms.is_empty() {
        return Some(d.base.clone());
    }
    let mut theta = d.base.fit.point.theta.clone();
    theta.extend(terms.iter().flat_map(Term::start));
    let structure = Structure::new(d.base.structure.base().clone(), terms);
    let problem = Problem::new(&d.base.data, structure.model());
    let start = problem.evaluate(theta, d.base.fit.point.locals.clone());
    start.chi2.is_finite().then(|| Fitted::from(&d.base.data, structure.clone(), start, &Options::default()))
}

/// Samples in which nothing touches, and the channels compared.
fn caveats(c: &Campaign, contradictions: &[String], d: &Decision) -> Vec<String> {
    let mut v = Vec::new();
    let data = &d.base.data;
    let mut short: Vec<&str> = Vec::new();
    let quiet: usize = (0..data.records.len())
        .map(|r| {
            let (t, _) = d.base.predict(r);
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
    let channels = Channel::ALL.into_iter().filter(|c| data.has(*c)).count();
    if channels == 1 {
        v.push("One channel only: errors of the chain, of the motion and of the contact look alike in it.".into());
    }
    v.extend(spikes(data));
    if !d.chosen.fit.converged {
        v.push("The fit with the mechanisms named was still improving when it was stopped.".into());
    }
    v.extend(contradictions.iter().map(|t| format!("What was read contradicts itself: {t}.")));
    v.extend(c.warnings.iter().cloned());
    v
}

/// Spikes listed one by one.
const LISTED: usize = 8;

/// The samples left out as spikes, with file, time and channel.
fn spikes(data: &Data) -> Option<String> {
    let mut found = Vec::new();
    for r in &data.records {
        for c in Channel::ALL.into_iter().filter(|c| r.y[c.index()].is_some()) {
            let is_spike = |k: &usize| {
                r.weight[c.index()][*k] == 0.0 && (c != Channel::Force || r.beside_corners.binary_search(k).is_err())
            };
            let at = (0..r.setup.time.len()).filter(is_spike).map(|k| figure(r.setup.time[k], "s"));
            found.extend(at.map(|t| format!("{} at {t} ({})", r.file, c.name())));
        }
    }
    let more = found.len().saturating_sub(LISTED);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    let (samples, stand, were) =
        if found.len() == 1 { ("sample", "stands", "was") } else { ("samples", "stand", "were") };
    (!found.is_empty()).then(|| {
        format!(
            "{} {samples} that {stand} alone far outside the noise {were} left out as spikes: {}{rest}.",
            found.len(),
            found[..found.len().min(LISTED)].join(", ")
        )
    })
}
