//! The verdict: what verdict.json holds, in the format verdict/1 and with keys beyond it.

use crate::material::{Effect, Remainder};
use record::Label;
use serde::Serialize;
use std::collections::BTreeMap;

mod build;

/// The format's name.
const FORMAT: &str = "verdict/1";

/// What a diagnosis says, built once from the decision and the findings. Plain SI; in JSON what is not finite is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// `verdict/1`.
    pub format: &'static str,
    /// The campaign's folder.
    pub campaign: String,
    /// What campaign.toml says of the campaign under `[campaign.columns]`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub columns: BTreeMap<String, Label>,
    /// Why nothing can be judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<Text>,
    pub mismatch: Mismatch,
    /// Mechanisms named, in the order they were found.
    pub missing: Vec<Missing>,
    pub unexplained: Unexplained,
    /// What to do next, the first thing first.
    pub next: Vec<String>,
    pub fit: FitQuality,
    /// Every mechanism alone, best first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidates: Option<Vec<CandidateScore>>,
    /// Misfit over noise by level, phase and channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<Vec<Cell>>,
    /// What a reader has to know before believing the rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caveats: Option<Vec<String>>,
    /// The experiment that parts collinear names best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<Experiment>,
    /// The clipped channel's peaks without the clip, by recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_clipping: Option<Vec<Unclipped>>,
    /// This campaign's sensors against others that read the same impacts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub other_sensors: Vec<OtherSensor>,
    /// Where the unexplained force enters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latent_force: Option<LatentForce>,
    /// What became of the contact element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element: Option<Element>,
    /// The forces on the body that were found, as an FMU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_force: Option<BodyForce>,
    /// Probability of every cause weighed, the most probable first: of names, of none, or of "unknown".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub posterior: Vec<Cause>,
    /// The fewest of them that hold the cause with 95 %.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub credible_set: Vec<Names>,
    /// What each name does to the figures a campaign is judged by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<BTreeMap<&'static str, Effect>>,
    /// What is left that no mechanism named explains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remainder: Option<Remainder>,
    /// The evidence of every structure weighed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
    /// What was learned as functions, whatever its shape: where the motion is imposed, of sets of classes; where it is not, of one
    /// dependence each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned: Option<LearnedLaw>,
    /// What the answer was made from, and by which version; the same for the same input, so that there is no date in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trace: Option<Trace>,
}

/// What an answer was made from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trace {
    /// Version of touchdown.
    pub touchdown: String,
    /// Who took the recordings, as campaign.toml says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// kg
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moving_mass: Option<f64>,
    /// Recordings judged.
    pub recordings: usize,
    /// Least and largest sampling rate of them, Hz.
    pub sampling_rates: [f64; 2],
    /// Every file that was read, campaign.toml first.
    pub inputs: Vec<Input>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Input {
    /// Its name, as campaign.toml has it.
    pub file: String,
    pub sha256: String,
}

/// What was learned as functions: classes of forces, each with a shape of its own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearnedLaw {
    /// Whether it takes the place of every form: `fit.after` and `predictions/after` are its own.
    pub leads: bool,
    /// Misfit of an elastic law alone and of the law learned, rms over the range of force, 1; in motion, of the simulation as
    /// given and of that with the force learned, mean of rms over range of recordings and channels.
    pub misfit_elastic: f64,
    pub misfit: f64,
    /// Misfit over range on what laws learned without it predict, 1.
    pub heldout_nrmse: Option<f64>,
    /// Classes that are possible.
    pub classes: Vec<LearnedClass>,
    /// Sets of classes that are possible, the likeliest first.
    pub sets: Vec<LearnedSet>,
}

/// A class of forces.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearnedClass {
    pub class: &'static str,
    /// The mechanism of the vocabulary that it is.
    pub mechanism: Option<&'static str>,
    /// The variables that the force depends on, in words; of a form that stands in for a cause without a name, that form in words.
    pub depends_on: String,
    pub probability: f64,
}

/// A set of classes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearnedSet {
    pub classes: Vec<&'static str>,
    pub probability: f64,
    /// rms over the range of force, 1.
    pub misfit: f64,
}

/// A set of names with its probability; none: nothing is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    pub mechanisms: Vec<&'static str>,
    pub probability: f64,
}

/// A set of names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Names {
    pub mechanisms: Vec<&'static str>,
}

/// What the posterior is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// Sizes of the discrepancy that all recordings share, and of what each may have of its own, share of force.
    pub sizes: Vec<f64>,
    pub own_sizes: Vec<f64>,
    /// Levels of the campaign.
    pub levels: usize,
    /// ln of how much likelier the repeated readings at the top of a channel are at the end of its range than by chance; 0
    /// where no channel ends in a flat top.
    pub flat: f64,
    pub structures: Vec<WeighedStructure>,
    /// A cause outside the vocabulary, beside a structure.
    pub unknown: Vec<WeighedUnknown>,
}

/// One structure's evidence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighedStructure {
    pub mechanisms: Vec<&'static str>,
    pub forms: Vec<&'static str>,
    pub named: bool,
    pub parameters: usize,
    pub chi2: f64,
    /// ln of the evidence by size of the discrepancy, less what all structures have in common; and the same where the
    /// instruments may drift, hum and walk.
    pub ln_evidence: Vec<Option<f64>>,
    pub ln_evidence_drifting: Vec<Option<f64>>,
    /// Overdispersion of the residual, and of what the likeliest discrepancy leaves of it.
    pub overdispersion: f64,
    pub overdispersion_left: Option<f64>,
    pub at_bound: bool,
    /// Misfit over range on levels not seen, where it was worked out.
    pub heldout_nrmse: Option<f64>,
}

/// The evidence of a cause outside the vocabulary, beside a structure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighedUnknown {
    pub beside: Vec<&'static str>,
    /// Where it enters.
    pub place: String,
    /// ln of the evidence by size of its own, first without a shared discrepancy, then with one.
    pub ln_evidence: Vec<Option<f64>>,
}

/// A text alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Text {
    pub text: String,
}

/// Whether simulation and recordings differ, how sure that is, and where.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mismatch {
    pub detected: bool,
    /// Probability that noise alone looks as bad.
    pub false_alarm_probability: f64,
    /// The place of every effect found.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// Nulls made of the residual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nulls: Option<Nulls>,
    /// Whole campaigns simulated without the effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<Bootstrapped>,
}

/// Nulls made of the residual, and what they came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Nulls {
    pub drawn: usize,
    pub as_bad: usize,
    pub directions: usize,
    pub independent: f64,
    pub chi2_gain: f64,
}

/// Campaigns simulated without the effect, and what they came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bootstrapped {
    pub nulls: usize,
    pub detected: usize,
    pub as_bad: usize,
}

/// Where the cause of an effect sits, and where it acts most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// contact, motion or chain.
    pub origin: &'static str,
    /// Where FMUs simulate the recordings, the bond and the FMU that moves there; absent of the measuring chain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bond: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fmu: Option<String>,
    /// Probability of every bond where it may sit, the most probable first; absent where there is one alone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bonds: Vec<LikelyBond>,
    pub phase: &'static str,
    pub channel: &'static str,
    /// Share of the effect's action in that phase, 0 to 1.
    pub share: f64,
    /// Levels that show it.
    pub levels: Vec<f64>,
    /// A recording that shows it, and from when to when, s.
    pub recording: Option<String>,
    pub t_start: Option<f64>,
    pub t_end: Option<f64>,
    pub text: String,
}

/// A bond of a system of FMUs, and the probability that an effect sits there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LikelyBond {
    pub bond: String,
    pub fmu: String,
    pub probability: f64,
}

/// A mechanism named.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    pub mechanism: &'static str,
    pub form: &'static str,
    pub probability: f64,
    pub parameters: BTreeMap<String, Parameter>,
    pub intervals_by: &'static str,
    /// Names that these recordings cannot part from it.
    pub also_possible: Vec<&'static str>,
    pub text: String,
    /// What it is, in words.
    pub sentence: &'static str,
    pub cure: &'static str,
    pub equation: &'static str,
    pub source: &'static str,
    /// How it may be parted from the names that fit as well.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tie: Option<Tie>,
}

/// A value with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    pub value: f64,
    pub unit: &'static str,
    /// None of what was not estimated, and where the recordings do not determine it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
    /// Whether it is a constant of the form, not estimated.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub held: bool,
}

/// Names that fit as well, and the experiments that would part them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tie {
    pub set: Vec<&'static str>,
    pub trace_sigmas: f64,
    pub rho: f64,
    pub p_right: f64,
    pub experiments: Vec<Experiment>,
}

/// An experiment and what it promises.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    pub name: &'static str,
    pub text: String,
    pub separation_sigmas: f64,
    pub p_right: f64,
}

/// Whether something stays unexplained, and what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unexplained {
    pub detected: bool,
    pub text: String,
}

/// The fit before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitQuality {
    pub before: Quality,
    pub after: Quality,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_bias: Option<BaseBias>,
    /// Share of the folds that chose the same names without the level they left out, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folds_agree: Option<f64>,
    /// Names that recordings give which are cut so many contact times after the touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<Window>,
    /// Every level predicted without itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<LevelFit>,
}

/// A level predicted by parameters that its recordings had no part in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelFit {
    /// As campaign.toml has it.
    pub level: String,
    pub recordings: usize,
    /// Misfit in multiples of the channels' noise, mean over recordings and channels, 1.
    pub over_noise: BeforeAfter,
    pub channels: Vec<ChannelFit>,
}

/// A level in one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelFit {
    pub channel: &'static str,
    pub unit: &'static str,
    /// Standard deviation of the channel's noise.
    pub noise: f64,
    /// Root mean square of reading less prediction.
    pub rms: BeforeAfter,
    /// The same in multiples of the noise, mean of the level's recordings, 1.
    pub over_noise: BeforeAfter,
}

/// Names that recordings of a certain length give.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Window {
    /// End after the touch, in contact times, 1.
    pub contact_times: f64,
    pub mechanisms: Vec<&'static str>,
}

/// How well one fit does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quality {
    /// Misfit over range on levels the fit did not see; None where nothing was predicted.
    pub heldout_nrmse: Option<f64>,
    /// The same of force alone, where motion is imposed: `heldout_nrmse` is the mean of force and the motion, which is known, 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_nrmse_of_force: Option<f64>,
    /// The same in multiples of the channels' noise, mean over recordings and channels, 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heldout_over_noise: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chi2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
}

/// How far the simulation's own parameters had been biased.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseBias {
    pub ln_force_at_reference_depth: f64,
    pub exponent: f64,
    pub parameters: Vec<ParameterBias>,
}

/// One parameter without and with the mechanisms found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterBias {
    pub name: String,
    pub unit: String,
    pub before: f64,
    pub after: f64,
    pub percent: f64,
    pub sigmas: f64,
}

/// A mechanism alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateScore {
    pub mechanism: String,
    pub form: String,
    pub origin: &'static str,
    pub chi2_gain: f64,
    pub heldout_nrmse: Option<f64>,
}

/// Misfit over noise of one level, phase and channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    pub level: Option<String>,
    pub phase: &'static str,
    pub channel: &'static str,
    pub before: f64,
    pub after: f64,
}

/// A peak without the clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unclipped {
    pub recording: String,
    pub channel: &'static str,
    pub unit: &'static str,
    pub read: f64,
    pub peak: f64,
    pub ci95: [f64; 2],
    pub clipped: bool,
}

/// The campaign's sensor against one that read the same impacts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherSensor {
    pub campaign: String,
    pub channel: &'static str,
    pub mechanism: Option<&'static str>,
    pub lag: Parameter,
    pub gain: Parameter,
    pub nrmse: BeforeAfter,
    pub recordings: Vec<OtherReading>,
}

/// One recording against the other sensor's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherReading {
    pub recording: String,
    pub lag: f64,
    pub gain: f64,
    pub nrmse: BeforeAfter,
    pub unit: &'static str,
    pub read: f64,
    pub without_limit: f64,
    pub limited: bool,
}

/// A misfit before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    pub before: f64,
    pub after: f64,
}

/// Where the unexplained force enters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatentForce {
    pub origin: &'static str,
    pub phase: &'static str,
    pub unit: &'static str,
    /// Places tried, best first.
    pub places: Vec<LatentPlace>,
}

/// A place where the unexplained force may enter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatentPlace {
    pub what: String,
    pub chi2_gain: f64,
}

/// What became of the contact element: whether it is right as it is, and the FMU's start values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Element {
    pub right: bool,
    pub text: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fmu: Option<&'static str>,
    /// Platforms that the FMU runs on, as FMI 2.0 names them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub platforms: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts: Option<BTreeMap<&'static str, StartValue>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predictions_run_through_it: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_difference_over_range: Option<f64>,
}

/// The FMU that holds the forces on the body which were found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BodyForce {
    pub fmu: &'static str,
    pub mechanisms: Vec<&'static str>,
    pub starts: BTreeMap<&'static str, StartValue>,
}

/// A start value of an FMU.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StartValue {
    pub value: f64,
    pub unit: &'static str,
}

impl Verdict {
    /// verdict.json: keys in alphabetical order.
    ///
    /// # Errors
    /// Where a value has no form in JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(&serde_json::to_value(self)?)? + "\n")
    }
}
