//! One campaign from recordings to verdict.

use super::body::{packed_body, PackedBody};
use super::bootstrap::{bootstrap, Bootstrap, Null};
use super::candidate::Candidate;
use super::courses::{Courses, Traces};
use super::decide::Decision;
use super::element::{packed, Packed};
use super::findings::{gather, Findings};
use super::heldout::{held_out, HeldOut};
use super::holding::{self, held};
use super::learned::Learned;
use super::motion::Force;
use super::propose::Pool;
use super::search::Search;
use super::sensors::against;
use super::verdict::Verdict;
use estimate::condition::{condition_on, Invalid};
use estimate::fitted::Fitted;
use estimate::prepare::Prepared;
use estimate::problem::{Data, Options};
use estimate::{Budget, Ended};
use host::Ours;
use mechanisms::mechanism::Origin;
use plant::machine::Machine;
use record::{Campaign, FmuSystem, Kind};
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// The outcome for one campaign. Where nothing can be judged the verdict says why, and there may be no predictions.
pub struct Outcome {
    pub data: Arc<Data>,
    pub verdict: Verdict,
    pub before: HeldOut,
    pub after: Option<HeldOut>,
    /// Every recording as read, and as each simulation has it; empty where nothing could be judged.
    pub courses: Courses,
    /// The law to put into the FMU.
    pub law: law::Parameters,
    pub findings: Findings,
    /// Laws learned as functions of imposed motion, whatever their shape; None where that was not done.
    pub learned: Option<Learned>,
    /// The force learned where it is not, that stands in for an unknown cause; None where there is none.
    pub force: Option<Force>,
    /// The element with that law; or why it could not be packed or run.
    pub element: Result<Packed, String>,
    /// The forces on the body that were found; None where none was.
    pub body: Option<PackedBody>,
    /// The user's system of FMUs with ours at a bond, file by file; None where there is none.
    pub system: Option<Vec<(String, Vec<u8>)>>,
}

/// How a diagnosis is run.
pub struct Settings<'a> {
    /// Nulls of the parametric bootstrap; 0: the theoretical tail.
    pub bootstrap: usize,
    /// The share of these nulls that is judged here; None: all.
    pub replicates: Option<Replicates<'a>>,
    /// Whether to pack the element and predict the recordings through it.
    pub element: bool,
    /// Folder of the element's libraries for other platforms; None: where [`pack::Model::libraries`] looks.
    pub platforms: Option<&'a Path>,
    /// Campaigns of the same run: where one read the same impacts, the two sensors are held against each other.
    pub others: &'a [Campaign],
    /// Called with the name of every stage as it begins.
    pub stage: &'a (dyn Fn(&str) + Sync),
    /// What simulates the campaign where no rig of ours does.
    pub machine: Option<Arc<dyn Machine>>,
    /// When it has to end.
    pub budget: Budget,
}

/// Nulls that several processes judge.
#[derive(Clone, Copy)]
pub struct Replicates<'a> {
    /// Whether the null of this number, from 0 on, is judged here.
    pub holds: &'a (dyn Fn(usize) -> bool + Sync),
    /// Nulls judged here before.
    pub known: &'a [Null],
    /// Hands over those judged here, and takes all that are known; the error in words.
    pub exchange: &'a Exchange<'a>,
}

/// Hands over nulls judged here, and takes all that are known.
pub type Exchange<'a> = dyn Fn(&[Null]) -> Result<Vec<Null>, String> + Sync + 'a;

impl Default for Settings<'_> {
    fn default() -> Self {
        Settings {
            bootstrap: 0,
            replicates: None,
            element: true,
            platforms: None,
            others: &[],
            stage: &|_| {},
            machine: None,
            budget: Budget::default(),
        }
    }
}

/// Why a diagnosis gave no outcome.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The recordings themselves are bad.
    #[error(transparent)]
    Recordings(#[from] Invalid),
    /// The caller asked for an end.
    #[error("interrupted")]
    Interrupted,
    /// Nulls of other replicates are not there yet.
    #[error("{known} of {of} nulls are judged; the other replicates are waited for")]
    Waits { known: usize, of: usize },
    /// The nulls judged here cannot be handed over.
    #[error("{0}")]
    Exchange(String),
}

/// Why there is no element where none was asked for.
const NOT_PACKED: &str = "not asked for";

/// Fall of chi^2 from which the speeds are taken to have been measured elsewhere than the base fit had it.
const ELSEWHERE: f64 = 10.0;

/// The data with the speeds measured elsewhere, if the best of the structures tried fits that better: where the simulation
/// as given lacks gravity, the base fit cannot decide.
fn measured_elsewhere(c: &Campaign, pool: &Pool) -> Option<Data> {
    let reported_at_touch = c.recordings.iter().all(|r| r.impact_speed.is_some());
    let best = pool.fits.iter().min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
    if c.kind != Kind::DropTest || !reported_at_touch || best.structure.terms().is_empty() {
        return None;
    }
    let other = Arc::new(best.data.with_speeds_elsewhere());
    let from = &best.fit.point;
    let there = best.on(other);
    let start = there.problem().evaluate(from.theta.clone(), from.locals.clone());
    let fit = there.problem().fit(start, &Options::default());
    (fit.point.chi2 < from.chi2 - ELSEWHERE).then(|| (*there.data).clone())
}

/// Diagnoses a campaign.
///
/// # Errors
/// When the recordings cannot be judged at all.
pub fn diagnose(c: &Campaign) -> Result<Outcome, Invalid> {
    diagnose_with(c, &Settings::default()).map_err(|e| match e {
        Failure::Recordings(i) => i,
        other => Invalid(other.to_string()),
    })
}

/// The base fit carried on until it has converged: what has not converged looks like physics.
fn converged_base(prepared: &Prepared) -> Fitted {
    let base = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
    if base.fit.converged {
        return base;
    }
    base.carried_on()
}

/// Diagnoses a campaign as `settings` say. Where their time is up before it is judged, the outcome says so.
///
/// # Errors
/// [`Failure::Recordings`] when the recordings are bad, [`Failure::Interrupted`] when the caller ends it.
pub fn diagnose_with(c: &Campaign, settings: &Settings<'_>) -> Result<Outcome, Failure> {
    judged(c, settings).or_else(|e| match e {
        Unfinished::Recordings(e) => Err(Failure::Recordings(e)),
        Unfinished::Replicates(e) => Err(e),
        Unfinished::Ended(Ended::Interrupted, _) => Err(Failure::Interrupted),
        Unfinished::Ended(Ended::TimeIsUp, stage) => {
            let reason = format!("the time given was up while {stage}; give it more");
            Ok(unjudged(c, Arc::new(condition_on(c, settings.machine.as_ref())?.data), reason, None))
        }
    })
}

/// Why a campaign is not judged to the end.
enum Unfinished {
    Recordings(Invalid),
    /// Why, and in which stage.
    Ended(Ended, String),
    /// What is wrong with the replicates, or that they are waited for.
    Replicates(Failure),
}

impl From<Invalid> for Unfinished {
    fn from(e: Invalid) -> Self {
        Unfinished::Recordings(e)
    }
}

fn judged(c: &Campaign, settings: &Settings<'_>) -> Result<Outcome, Unfinished> {
    let running = RefCell::new(String::from("reading"));
    // fits end early where the budget is over: nothing that came of them may be relied on
    let in_time = || match settings.budget.over() {
        Some(why) => Err(Unfinished::Ended(why, running.borrow().clone())),
        None => Ok(()),
    };
    let stage = |text: &str| -> Result<(), Unfinished> {
        in_time()?;
        running.replace(text.into());
        (settings.stage)(text);
        Ok(())
    };
    stage("learning the noise")?;
    let mut conditioned = condition_on(c, settings.machine.as_ref())?;
    conditioned.data.budget = settings.budget;
    let agreed = super::plausible::check(c, &conditioned.data)?;
    stage("fitting the simulation as given")?;
    let mut prepared = match Prepared::from(c, conditioned.clone()) {
        Ok(v) => v,
        Err(e) => {
            in_time()?;
            return Ok(unjudged(c, Arc::new(conditioned.data), e.0, None));
        }
    };
    let base = converged_base(&prepared);
    in_time()?;
    if !base.fit.converged {
        let reason = format!(
            "the fit of the simulation as given has not converged in {} iterations (chi^2 {:.1} over {} samples), and \
             what has not converged looks like physics; check mass, speeds and units, or calibrate k and p first",
            base.fit.iterations,
            base.chi2(),
            base.fit.samples
        );
        let before = held_out(&base);
        return Ok(unjudged(c, prepared.data, reason, Some(before)));
    }
    stage("searching for what is missing")?;
    let mut search = Search::new(&prepared);
    let mut pool = search.propose(base);
    if let Some(other) = measured_elsewhere(c, &pool) {
        stage("searching once more, the speeds measured elsewhere")?;
        prepared.data = Arc::new(other);
        search = Search::new(&prepared);
        pool = search.propose(converged_base(&prepared));
    }
    stage("predicting levels not seen")?;
    let mut decision = Decision::new(pool);
    stage("choosing names without each level, and in shorter windows")?;
    decision.choose_again();
    if decision.may_learn() {
        stage("learning what is missing as a function")?;
        decision.learn(c);
    }
    if decision.may_learn_in_motion() {
        stage("learning what is missing as a function")?;
        decision.learn_in_motion();
    }
    stage("working out the answer")?;
    let mut findings = gather(c, &agreed.contradictions, &search, &decision, settings.stage);
    findings.sensors = against(c, settings.others);
    if settings.bootstrap > 0 {
        let n = settings.bootstrap;
        let each = |i: usize| {
            (settings.stage)(&format!("judging null {} of {n}", i + 1));
            settings.budget.over().is_none()
        };
        let known = settings.replicates.map_or(&[][..], |r| r.known);
        let here =
            |i: &usize| settings.replicates.is_none_or(|r| (r.holds)(*i) && known.iter().all(|k| k.number != *i));
        let numbers = (0..n).filter(here);
        let mut nulls = bootstrap(c, &prepared.guess, &decision.base, numbers, decision.strength(), &each);
        in_time()?;
        if let Some(r) = &settings.replicates {
            nulls.extend(known);
            nulls = (r.exchange)(&nulls).map_err(|e| Unfinished::Replicates(Failure::Exchange(e)))?;
            nulls.sort_by_key(|k| k.number);
            nulls.dedup_by_key(|k| k.number);
            nulls.retain(|k| k.number < n);
            if nulls.len() < n {
                return Err(Unfinished::Replicates(Failure::Waits { known: nulls.len(), of: n }));
            }
        }
        findings.bootstrap = Some(Bootstrap::of(&nulls));
    }
    let relied_on = findings.gates.is_empty();
    // a law fitted beside what stands in for the unknown is none without it
    let calibrated = &held(&decision, findings.holds_learned, relied_on).clone();
    let (law, _) = holding::law(calibrated);
    // of FMUs, where our element can take the place of a contact of theirs
    let replaces = c.system.as_ref().is_none_or(|s| host::replaceable(s, calibrated.structure.bond()));
    let has_remainder = decision.has_remainder();
    let element = if settings.element && replaces && law.elastic.stiffness > 0.0 {
        stage("running the recordings through the element")?;
        let holds_all = !decision.is_learned() && (decision.force().is_none() || findings.holds_learned.any());
        let through = decision.after.as_ref().filter(|_| relied_on && c.kind != Kind::System && holds_all);
        let through = through.map(|a| (decision.simulated(), a));
        let binaries = pack::Model::contact().libraries(settings.platforms);
        let of_nearest = holding::instead(&decision, relied_on).map(|(f, _)| f.overdispersion());
        let overdispersion = of_nearest.unwrap_or(decision.overdispersion.1).max(1.0);
        let packing = |binaries| packed(binaries, calibrated, overdispersion, &law, through);
        binaries.and_then(packing).map_err(|e| format!("{e:#}"))
    } else {
        Err(NOT_PACKED.into())
    };
    let on_body = if settings.element { packed_body(calibrated, settings.platforms) } else { Ok(None) };
    let on_body = on_body.unwrap_or_else(|e| {
        findings.caveats.push(format!("BodyForce.fmu is not written: {e:#}."));
        None
    });
    findings.on_body = on_body.as_ref().map(|b| b.holds.clone());
    let traces = Traces::new(&decision.base, &decision.before);
    let traces_after = decision.after.as_ref().map(|a| Traces::new(decision.simulated(), a));
    // what is predicted with the mechanisms is what the FMU does
    if let (Some(a), Some(t)) = (&mut decision.after, element.as_ref().ok().and_then(|e| e.through.as_ref())) {
        a.predictions.clone_from(&t.predictions);
        a.nrmse = t.predictions.misfit(&prepared.data);
    }
    // a law learned leads with predictions of its own
    let by_folds = !has_remainder && !decision.is_learned();
    if let (Some(a), Some(f), true) = (&mut decision.after, &decision.folds, by_folds) {
        f.put_in(a, &decision.chosen);
    }
    // what would be predicted worse is predicted by the simulation as given: a name is no reason to do worse
    let worse = decision.after.as_ref().is_some_and(|a| a.nrmse > decision.before.nrmse);
    if worse {
        decision.after = Some(decision.before.clone());
    }
    let better = traces_after.as_ref().zip(decision.after.as_ref()).filter(|_| !worse);
    let courses = Courses::new(&decision, &traces, better.map(|(t, a)| (t, &a.predictions)));
    in_time()?;
    if let Some(m) = &settings.machine {
        findings.caveats.extend(m.facts().notes.iter().cloned());
        findings.caveats.extend(m.troubles().into_iter().map(|t| format!("What an FMU refused was left out: {t}.")));
    }
    if let Some(e) = element.as_ref().err().filter(|_| c.kind != Kind::System) {
        findings.caveats.push(format!("HysteresisContact.fmu is not written: {e}."));
    }
    // a contact that nothing is missing in stays as it is where forces on the body are what was found
    let in_contact = calibrated.structure.terms().iter().any(|t| t.mechanism.origin == Origin::Contact);
    let ours = element.as_ref().ok().filter(|_| on_body.is_none() || in_contact);
    let system = match &c.system {
        Some(of) if ours.is_some() || on_body.is_some() => Some(handed_back(of, ours, on_body.as_ref(), calibrated)),
        _ => None,
    };
    let system =
        system.and_then(|s| s.map_err(|e| findings.caveats.push(format!("system/ is not written: {e:#}."))).ok());
    let verdict = Verdict::new(c, &decision, &findings, element.as_ref().ok());
    let force = decision.force().cloned();
    let Decision { before, after, learned, .. } = decision;
    Ok(Outcome {
        learned,
        force,
        verdict,
        before,
        after,
        courses,
        law,
        findings,
        element,
        body: on_body,
        system,
        data: prepared.data,
    })
}

/// The user's system with the element `e` in the place of the contact at the bond of `f`, the forces `on_body` beside it, and
/// the free variables as `f` has them: files by their names.
fn handed_back(
    of: &FmuSystem,
    e: Option<&Packed>,
    on_body: Option<&PackedBody>,
    f: &Fitted,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let machine = f.structure.base().machine.as_ref();
    let free = machine.map_or(Vec::new(), |m| {
        let free = f.structure.free(&f.point().theta);
        m.facts().free.iter().zip(free).map(|(v, away)| (v.name.clone(), v.value(away))).collect()
    });
    let bond = f.structure.bond();
    let element = e.map(Packed::plain).transpose()?;
    let ours = Ours {
        element: element.as_deref(),
        body: on_body.map(|b| &b.fmu[..]),
        turned: machine.is_some_and(|m| m.facts().bonds.get(bond).is_some_and(|b| b.turned)),
    };
    host::handed_back(of, bond, &free, &ours)
}

/// The outcome where nothing can be judged.
fn unjudged(c: &Campaign, data: Arc<Data>, reason: String, before: Option<HeldOut>) -> Outcome {
    let before = before.unwrap_or(HeldOut { nrmse: f64::NAN, ..HeldOut::default() });
    Outcome {
        verdict: Verdict::invalid(c, &reason, before.nrmse.is_finite().then_some(before.nrmse)),
        data,
        before,
        after: None,
        courses: Courses::default(),
        learned: None,
        force: None,
        law: Default::default(),
        findings: Findings { caveats: c.warnings.clone(), ..Findings::default() },
        element: Err("nothing was judged".into()),
        body: None,
        system: None,
    }
}
