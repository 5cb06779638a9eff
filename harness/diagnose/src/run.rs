//! One campaign from recordings to verdict.

use super::answer::findings::{gather, Findings};
use super::answer::verdict;
use super::bootstrap::bootstrap;
use super::candidate::Candidate;
use super::decide::Decision;
use super::element::{packed, Packed};
use super::heldout::{held_out, HeldOut};
use super::search::{MakeUp, Search, Term};
use super::sensors::against;
use super::weigh::weigh_second;
use estimate::prepare::{prepare, renewed_noise, Guess, Invalid};
use estimate::problem::{Data, Fit, Options, Problem};
use mechanisms::mechanism::Origin;
use rayon::prelude::*;
use record::{Campaign, Kind};
use serde_json::Value;

/// The outcome for one campaign.
pub struct Outcome {
    pub data: Data,
    pub verdict: Value,
    pub before: HeldOut,
    pub after: Option<HeldOut>,
    /// The law to put into the FMU.
    pub law: law::Parameters,
    /// Candidates with their gain in chi^2, best first.
    pub candidates: Vec<(String, f64)>,
    pub findings: Findings,
    /// The element with that law; or why it could not be packed or run.
    pub element: Result<Packed, String>,
    /// Why nothing can be judged; then there may be no predictions.
    pub invalid: Option<String>,
}

/// How a diagnosis is run.
pub struct Settings<'a> {
    /// Nulls of the parametric bootstrap; 0: the theoretical tail.
    pub bootstrap: usize,
    /// Whether to pack the element and predict the recordings through it.
    pub element: bool,
    /// Campaigns of the same run: where one read the same impacts, the two sensors are held against each other.
    pub others: &'a [Campaign],
    /// Told of every stage as it begins.
    pub stage: &'a (dyn Fn(&str) + Sync),
    /// Asked between stages; true ends the diagnosis.
    pub stopped: &'a (dyn Fn() -> bool + Sync),
}

impl Default for Settings<'_> {
    fn default() -> Self {
        Settings { bootstrap: 0, element: true, others: &[], stage: &|_| {}, stopped: &|| false }
    }
}

/// Why a diagnosis gave no outcome.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The recordings themselves are bad.
    #[error(transparent)]
    Recordings(#[from] Invalid),
    /// Told to stop.
    #[error("stopped")]
    Stopped,
}

/// Wander of the residual from which the noise model is not trusted alone, and the share by which levels not seen then
/// have to be predicted better: slow wander has no side, and what follows it predicts next to nothing.
const RESTLESS: f64 = 1.5;
const LEAST_FALL: f64 = 0.005;

/// chi^2 by which the first sample is preferred to the touch as the place where speeds were measured.
const AT_FIRST: f64 = 50.0;
/// Fall of chi^2 from which the speeds are taken to have been measured elsewhere than the base fit had it.
const ELSEWHERE: f64 = 10.0;

/// Prepares a campaign and settles what the base fit has to know first: whether the speed was measured at touch or
/// at the first sample, how far the scatter of an imposed penetration counts, and which samples are spikes.
///
/// # Errors
/// When the recordings cannot be judged at all.
pub fn ready(c: &Campaign) -> Result<(Data, Guess), Invalid> {
    let (data, guess) = prepare(c)?;
    settle(c, data, guess)
}

/// `data` with the speeds meant at the first sample where they were meant at touch, and the other way round.
fn with_speeds_elsewhere(data: &Data) -> Data {
    let mut other = data.clone();
    other.records.iter_mut().for_each(|r| r.at_first = !r.at_first);
    other
}

/// Least chi^2 of the simulation as given, alone or beside one force that acts in flight: one that is missing there
/// would speak for speeds measured where they were not.
fn least_in_flight(c: &Campaign, data: &Data, guess: &Guess) -> f64 {
    let data = data.coarse();
    let search = Search::new(c, &data);
    let base = search.base(c, guess);
    let plain = |t: &Term| {
        t.mechanism.origin == Origin::Motion && t.mechanism.named && t.form.linear && t.form.parameters.len() == 1
    };
    let forces: Vec<Term> = search.candidates().into_iter().filter(plain).collect();
    let quick = Options { iterations: 12, ..Options::default() };
    let beside = |t: &Term| search.add(&MakeUp::default(), &base.point, t, 1, &quick).map(|f| f.point.chi2);
    let beside: Vec<f64> = forces.par_iter().filter_map(beside).collect();
    beside.into_iter().fold(base.point.chi2, f64::min)
}

fn settle(c: &Campaign, mut data: Data, guess: Guess) -> Result<(Data, Guess), Invalid> {
    // A photo interrupter measures the speed a little before touch. Whether the recordings' first sample or
    // the touch itself is meant shows in the fit: free fall between the two is not free.
    if c.kind == Kind::DropTest && data.records.iter().all(|r| !r.at_first) {
        let first = with_speeds_elsewhere(&data);
        if least_in_flight(c, &first, &guess) < least_in_flight(c, &data, &guess) + AT_FIRST {
            data = first;
        }
    }
    let start = Search::new(c, &data).base(c, &guess);
    if !start.point.chi2.is_finite() {
        return Err(Invalid(
            "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
        ));
    }
    if c.kind == Kind::Indentation {
        let weights = Search::new(c, &data).effective_weights(&start.point);
        for (r, w) in data.records.iter_mut().zip(weights) {
            r.weight[0] = w;
        }
    }
    if c.kind == Kind::ContactorOpening {
        // at rest, released, flying: no polynomial follows that, the fit does
        let left = Search::new(c, &data).left(&start.point);
        data.noise = renewed_noise(c, &data, &left);
    }
    let spikes = Search::new(c, &data).spikes(&start.point);
    for (r, ch, k) in spikes {
        data.records[r].weight[ch][k] = 0.0;
    }
    Ok((data, guess))
}

/// The data with the speeds measured elsewhere, if the decision's model fits that better: where the simulation as given
/// lacks gravity, the base fit cannot tell.
fn measured_elsewhere(c: &Campaign, search: &Search<'_>, d: &Decision) -> Option<Data> {
    let told_at_touch = c.recordings.iter().all(|r| r.impact_speed.is_some());
    if c.kind != Kind::DropTest || !told_at_touch || !d.detected {
        return None;
    }
    let other = with_speeds_elsewhere(search.data);
    let model = search.model(&d.chosen.make_up, 1.0, 1.0, 0.0);
    let problem = Problem::new(&other, &model);
    let from = &d.chosen.fit.point;
    let fit = problem.fit(problem.evaluate(from.theta.clone(), from.locals.clone()), &Options::default());
    (fit.point.chi2 < from.chi2 - ELSEWHERE).then_some(other)
}

/// Diagnoses a campaign.
///
/// # Errors
/// When the recordings cannot be judged at all.
pub fn diagnose(c: &Campaign) -> Result<Outcome, Invalid> {
    diagnose_with(c, &Settings::default()).map_err(|e| match e {
        Failure::Recordings(i) => i,
        Failure::Stopped => Invalid("stopped".into()),
    })
}

/// The base fit taken on until it has converged: what has not converged looks like physics.
fn converged_base(search: &Search<'_>, c: &Campaign, guess: &Guess) -> Fit {
    let fit = search.base(c, guess);
    if fit.converged {
        return fit;
    }
    search.taken_on(&Candidate { make_up: MakeUp::default(), fit }).fit
}

/// Diagnoses a campaign as `settings` say.
///
/// # Errors
/// [`Failure::Recordings`] when the recordings are bad, [`Failure::Stopped`] when told to stop.
pub fn diagnose_with(c: &Campaign, settings: &Settings<'_>) -> Result<Outcome, Failure> {
    let stage = |text: &str| -> Result<(), Failure> {
        (settings.stage)(text);
        if (settings.stopped)() {
            return Err(Failure::Stopped);
        }
        Ok(())
    };
    stage("learning the noise")?;
    let (data, guess) = prepare(c)?;
    super::plausible::check(c, &data)?;
    stage("fitting the simulation as given")?;
    let (data, guess) = match settle(c, data.clone(), guess) {
        Ok(v) => v,
        Err(e) => return Ok(unjudged(c, data, e.0, None)),
    };
    let mut search = Search::new(c, &data);
    let base = converged_base(&search, c, &guess);
    if !base.converged {
        let reason = format!(
            "the fit of the simulation as given has not converged in {} iterations (chi^2 {:.1} over {} samples), and \
             what has not converged looks like physics; check mass, speeds and units, or calibrate k and p first",
            base.iterations, base.point.chi2, base.samples
        );
        let before = held_out(&search, &Candidate { make_up: Default::default(), fit: base });
        return Ok(unjudged(c, data.clone(), reason, Some(before)));
    }
    stage("searching for what is missing")?;
    let mut decision = search.decide(base);
    let elsewhere;
    if let Some(other) = measured_elsewhere(c, &search, &decision) {
        stage("searching once more, the speeds measured elsewhere")?;
        elsewhere = other;
        search = Search::new(c, &elsewhere);
        decision = search.decide(converged_base(&search, c, &guess));
    }
    stage("predicting levels not seen")?;
    let before = held_out(&search, &decision.base);
    let mut after = if decision.detected && !decision.chosen.make_up.terms.is_empty() {
        Some(held_out(&search, &decision.chosen))
    } else {
        None
    };
    after = weigh_second(&search, &mut decision, &before, after);
    // where the noise wanders more than its model knows, only what predicts levels not seen better is believed
    if let Some(a) = &after {
        if c.levels.len() > 1 && decision.wander.1 > RESTLESS && a.nrmse > (1.0 - LEAST_FALL) * before.nrmse {
            decision.detected = decision.restless;
            decision.unexplained = decision.restless;
            decision.chosen = decision.base.clone();
            decision.ties.clear();
            after = None;
        }
    }
    stage("working out the answer")?;
    let mut findings = gather(c, &search, &decision, &before, after.as_ref(), settings.stage);
    findings.sensors = against(c, settings.others);
    if settings.bootstrap > 0 {
        let n = settings.bootstrap;
        let each = |i: usize| {
            (settings.stage)(&format!("judging null {} of {n}", i + 1));
            !(settings.stopped)()
        };
        let b = bootstrap(c, &guess, &search, &decision.base, n, decision.false_alarm_probability, &each);
        stage("writing")?;
        findings.bootstrap = Some(b);
    }
    let model = search.model(&decision.chosen.make_up, 1.0, 1.0, 0.0);
    let law = Problem::new(search.data, &model).physics(&decision.chosen.fit.point.theta).law;
    drop(model);
    let element = if settings.element {
        stage("running the recordings through the element")?;
        packed(&search, &law, after.as_ref().map(|a| (&decision.chosen, a))).map_err(|e| format!("{e:#}"))
    } else {
        Err("not asked for".into())
    };
    // what is predicted with the mechanisms is what the FMU does
    if let (Some(a), Some(t)) = (&mut after, element.as_ref().ok().and_then(|e| e.through.as_ref())) {
        a.readings.clone_from(&t.readings);
        a.nrmse = t.nrmse;
    }
    if let Err(e) = &element {
        findings.caveats.push(format!("HysteresisContact.fmu is not written: {e}."));
    }
    let mut verdict = verdict::verdict(c, &search, &decision, &findings, &before, after.as_ref());
    verdict["element"] = verdict::element(&decision, element.as_ref().ok());
    let candidates = findings.rivals.iter().map(|r| (format!("{} ({})", r.name, r.form), r.gain)).collect();
    Ok(Outcome { verdict, before, after, law, candidates, findings, element, invalid: None, data: search.data.clone() })
}

/// The outcome where nothing can be judged.
fn unjudged(c: &Campaign, data: Data, reason: String, before: Option<HeldOut>) -> Outcome {
    let before = before.unwrap_or(HeldOut { readings: Vec::new(), nrmse: f64::NAN, points: Vec::new() });
    Outcome {
        verdict: verdict::invalid(c, &reason, before.nrmse.is_finite().then_some(before.nrmse)),
        data,
        before,
        after: None,
        law: Default::default(),
        candidates: Vec::new(),
        findings: Findings { caveats: c.warnings.clone(), ..Findings::default() },
        element: Err("nothing was judged".into()),
        invalid: Some(reason),
    }
}
