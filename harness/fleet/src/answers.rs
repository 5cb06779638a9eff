//! The answers of a fleet, as far as they matter to it.

use crate::register;
use crate::statistics::discoveries;
use anyhow::{anyhow, Context};
use output::Manifest;
use record::Label;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Bytes of a verdict at most.
const MOST: u64 = 1 << 26;
/// Columns of the fleet's table at most, beside those that every fleet has.
const COLUMNS: usize = 1000;
/// By how much a probability may exceed 1, being a sum of rounded ones.
const ROUNDING: f64 = 1e-6;
/// The file of an answer that is read.
const VERDICT: &str = "verdict.json";
/// Why a campaign is lost of which nobody knows anything.
const NEVER: &str = "no process has come to it, or the one that had was ended with all that it knew";

/// A mechanism named.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    pub mechanism: String,
    pub form: String,
    /// 0 to 1
    pub probability: f64,
    /// Largest relative change that it makes to peak force, restitution, contact time or depth; None where none was worked out.
    pub size: Option<f64>,
    /// Parameters that were estimated: name, value, unit.
    pub parameters: Vec<(String, f64, String)>,
}

/// A campaign that was judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub detected: bool,
    /// Probability that noise alone looks as bad, and the least false discovery rate, over the campaigns of the fleet, at which
    /// it counts as one where something is missing.
    pub false_alarm_probability: f64,
    pub false_discovery_rate: f64,
    pub missing: Vec<Named>,
    pub unexplained: bool,
    /// Probability that a mechanism is missing, by its name: the sum over all causes that hold it.
    pub probabilities: BTreeMap<String, f64>,
    /// Probability that nothing is missing.
    pub nothing: f64,
    /// Misfit over range on levels not seen, as given and with what is missing.
    pub before: Option<f64>,
    pub after: Option<f64>,
}

impl Judged {
    /// Probability that `mechanism` is missing.
    pub fn probability_of(&self, mechanism: &str) -> f64 {
        self.probabilities.get(mechanism).copied().unwrap_or(0.0)
    }

    /// The cause in words: names, or that nothing is missing, or that nothing known is more likely than not.
    pub fn cause(&self) -> String {
        match &self.missing[..] {
            [] if !self.detected => NOTHING.into(),
            [] => UNKNOWN.into(),
            all => {
                let mut names: Vec<String> = all.iter().map(|m| m.mechanism.replace('_', " ")).collect();
                names.sort();
                names.join(" and ")
            }
        }
    }

    /// Probability of that: of the names, of nothing, or of all that is left.
    pub fn sure(&self) -> f64 {
        match &self.missing[..] {
            [] if !self.detected => self.nothing,
            [] => 1.0 - self.nothing,
            all => all.iter().map(|m| m.probability).fold(1.0, f64::min),
        }
    }
}

/// Cause of a campaign in which nothing is missing, and of one whose cause has no name.
pub const NOTHING: &str = "nothing missing";
pub const UNKNOWN: &str = "no name more likely than not";

/// What became of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    Judged(Judged),
    /// Its answer says why nothing can be judged.
    Unjudged(String),
    /// It has no answer: why.
    Lost(String),
}

/// A campaign of the fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub campaign: String,
    /// Folder of the answer, or where it would be.
    pub folder: PathBuf,
    /// What its campaign.toml says under `[campaign.columns]`; nothing of a lost one.
    pub columns: BTreeMap<String, Label>,
    pub state: State,
}

impl Answer {
    pub fn judged(&self) -> Option<&Judged> {
        match &self.state {
            State::Judged(j) => Some(j),
            _ => None,
        }
    }
}

/// A fleet's campaigns, what matters first: those lost, those that cannot be judged, those where something is missing by their
/// misfit, the others; by name where that is equal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fleet {
    pub answers: Vec<Answer>,
    /// What could not be read beside answers, and what to do.
    pub complaints: Vec<String>,
    /// The folders that hold answers, or what is known of ones that are lost.
    pub found_in: BTreeSet<PathBuf>,
}

impl Fleet {
    /// The fleet whose answers are in the folders `outs`. A campaign answered in several is taken from the first.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn read(outs: &[PathBuf]) -> anyhow::Result<Fleet> {
        let mut all: BTreeMap<String, Answer> = BTreeMap::new();
        let mut table = Columns::default();
        let (mut complaints, mut found_in) = (Vec::new(), BTreeSet::new());
        for out in outs {
            let mut names: Vec<String> = Vec::new();
            for entry in std::fs::read_dir(out).with_context(|| {
                format!("{}: cannot be read; give the folder that diagnose --out had", out.display())
            })? {
                let entry = entry.with_context(|| out.display().to_string())?;
                if let (true, Ok(name)) = (entry.path().is_dir(), entry.file_name().into_string()) {
                    names.push(name);
                }
            }
            names.sort();
            for name in names {
                let folder = out.join(&name);
                let is_there = |a: &Answer| !matches!(a.state, State::Lost(_));
                match listed(&folder) {
                    Listed::Yes => drop(found_in.insert(out.clone())),
                    Listed::No => continue,
                    Listed::Unknown => {
                        let cure = "it is not counted; diagnose that campaign again";
                        complaints
                            .push(format!("{}: no manifest.json lists it; {cure}", folder.join(VERDICT).display()));
                        continue;
                    }
                }
                if all.get(&name).is_some_and(is_there) {
                    continue;
                }
                // one answer that was damaged loses no other
                let (columns, state) = read(&folder)
                    .and_then(|(c, s)| {
                        table.take(&c, &s).map(|()| (c, s)).map_err(|why| anyhow!("{}: {why}", folder.display()))
                    })
                    .unwrap_or_else(|e| (BTreeMap::new(), State::Lost(format!("{e:#}"))));
                let answer = Answer { campaign: name.clone(), folder, columns, state };
                // one that is damaged may be whole in another folder
                if is_there(&answer) || !all.contains_key(&name) {
                    all.insert(name, answer);
                }
            }
        }
        for out in outs {
            let of = |e: std::io::Error| anyhow::anyhow!("{}: {e}", out.join(register::FOLDER).display());
            let mut lost = register::lost(out).map_err(of)?;
            let members = register::members(out, &mut |c| complaints.push(c)).map_err(of)?;
            if !members.is_empty() || !lost.is_empty() {
                found_in.insert(out.clone());
            }
            let names: BTreeSet<String> = members.into_iter().map(|m| m.campaign).chain(lost.keys().cloned()).collect();
            for campaign in names {
                let why = lost.remove(&campaign);
                let known = why.is_some();
                let state = State::Lost(why.unwrap_or_else(|| NEVER.into()));
                let a = Answer { folder: out.join(&campaign), campaign, columns: BTreeMap::new(), state };
                match all.get_mut(&a.campaign) {
                    None => drop(all.insert(a.campaign.clone(), a)),
                    // another folder may know why
                    Some(there) if known && there.state == State::Lost(NEVER.into()) => *there = a,
                    // it was diagnosed again, and that was lost: what was answered before holds no more
                    Some(there) if known && there.folder == a.folder => *there = a,
                    Some(_) => {}
                }
            }
        }
        let mut answers: Vec<Answer> = all.into_values().collect();
        hold_false_discoveries(&mut answers);
        // stable: by name where what matters is equal
        answers.sort_by(|a, b| urgency(b).total_cmp(&urgency(a)));
        Ok(Fleet { answers, complaints, found_in })
    }

    pub fn judged(&self) -> impl Iterator<Item = (&Answer, &Judged)> {
        self.answers.iter().filter_map(|a| Some((a, a.judged()?)))
    }

    /// Campaigns without an answer, and why.
    pub fn lost(&self) -> impl Iterator<Item = (&Answer, &str)> {
        let why = |a| match &(a as &Answer).state {
            State::Lost(why) => Some((a, why.as_str())),
            _ => None,
        };
        self.answers.iter().filter_map(why)
    }

    /// Campaigns whose answer says why they cannot be judged.
    pub fn unjudged(&self) -> impl Iterator<Item = (&Answer, &str)> {
        let why = |a| match &(a as &Answer).state {
            State::Unjudged(why) => Some((a, why.as_str())),
            _ => None,
        };
        self.answers.iter().filter_map(why)
    }

    /// Mechanisms that may be missing somewhere, by name.
    pub fn mechanisms(&self) -> Vec<String> {
        let names = self.judged().flat_map(|(_, j)| j.probabilities.keys().cloned());
        names.filter(|m| m != "unknown").collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Columns that a campaign has, by name.
    pub fn columns(&self) -> Vec<String> {
        self.answers.iter().flat_map(|a| a.columns.keys().cloned()).collect::<BTreeSet<_>>().into_iter().collect()
    }
}

/// How far up a campaign stands.
fn urgency(a: &Answer) -> f64 {
    match &a.state {
        State::Lost(_) => 1e12,
        State::Unjudged(_) => 1e11,
        State::Judged(j) => {
            let misfit = j.before.filter(|b| b.is_finite()).unwrap_or(0.0).clamp(0.0, 1e6);
            misfit + if j.detected { 1e8 } else { 0.0 }
        }
    }
}

fn hold_false_discoveries(answers: &mut [Answer]) {
    let mut judged: Vec<&mut Judged> = answers
        .iter_mut()
        .filter_map(|a| match &mut a.state {
            State::Judged(j) => Some(j),
            _ => None,
        })
        .collect();
    let p: Vec<f64> = judged.iter().map(|j| j.false_alarm_probability).collect();
    judged.iter_mut().zip(discoveries(&p)).for_each(|(j, q)| j.false_discovery_rate = q);
}

/// Whether a folder holds an answer.
enum Listed {
    /// Its list of files says so, whether or not the verdict is there.
    Yes,
    No,
    /// A verdict is there, and no list says that touchdown wrote it.
    Unknown,
}

fn listed(folder: &Path) -> Listed {
    match Manifest::read(folder) {
        Some(m) if m.files.contains_key(VERDICT) => Listed::Yes,
        None if folder.join(VERDICT).is_file() => Listed::Unknown,
        _ => Listed::No,
    }
}

/// What a fleet reads of verdict.json.
#[derive(Deserialize)]
struct Verdict {
    #[serde(default)]
    columns: BTreeMap<String, Label>,
    invalid: Option<Text>,
    mismatch: Mismatch,
    #[serde(default)]
    missing: Vec<Missing>,
    unexplained: Unexplained,
    fit: Fit,
    #[serde(default)]
    posterior: Vec<Cause>,
    material: Option<BTreeMap<String, Effect>>,
}

#[derive(Deserialize)]
struct Text {
    text: String,
}

#[derive(Deserialize)]
struct Mismatch {
    detected: bool,
    #[serde(deserialize_with = "probability")]
    false_alarm_probability: f64,
}

/// A number from 0 to 1, within [`ROUNDING`].
fn probability<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let p = f64::deserialize(from)?;
    match (0.0..=1.0 + ROUNDING).contains(&p) {
        true => Ok(p.min(1.0)),
        false => Err(D::Error::custom(format!("{p} is no probability"))),
    }
}

#[derive(Deserialize)]
struct Missing {
    mechanism: String,
    form: String,
    #[serde(deserialize_with = "probability")]
    probability: f64,
    parameters: BTreeMap<String, Parameter>,
}

#[derive(Deserialize)]
struct Parameter {
    value: Option<f64>,
    unit: String,
    #[serde(default)]
    held: bool,
}

#[derive(Deserialize)]
struct Unexplained {
    detected: bool,
}

#[derive(Deserialize)]
struct Fit {
    before: Quality,
    after: Quality,
}

#[derive(Deserialize)]
struct Quality {
    heldout_nrmse: Option<f64>,
}

#[derive(Deserialize)]
struct Cause {
    mechanisms: Vec<String>,
    #[serde(deserialize_with = "probability")]
    probability: f64,
}

#[derive(Deserialize)]
struct Effect {
    peak_force: Option<f64>,
    restitution: Option<f64>,
    contact_time: Option<f64>,
    depth: Option<f64>,
}

impl Effect {
    fn size(&self) -> Option<f64> {
        let all = [self.peak_force, self.restitution, self.contact_time, self.depth];
        all.into_iter().flatten().map(f64::abs).filter(|v| v.is_finite()).reduce(f64::max)
    }
}

/// Probability of each mechanism, over all causes that hold it.
fn probabilities(causes: &[Cause]) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    for c in causes {
        for m in c.mechanisms.iter().collect::<BTreeSet<_>>() {
            *all.entry(m.clone()).or_insert(0.0) += c.probability;
        }
    }
    all
}

/// Columns of the fleet's table beside those that every fleet has, by their names, as far as there is room for them.
#[derive(Default)]
struct Columns(BTreeSet<String>);

impl Columns {
    /// Takes in those that an answer brings; or none, and says why.
    fn take(&mut self, columns: &BTreeMap<String, Label>, state: &State) -> Result<(), String> {
        let mut all: BTreeSet<String> = columns.keys().map(|c| format!("column.{c}")).collect();
        if let State::Judged(j) = state {
            all.extend(j.probabilities.keys().map(|m| format!("probability.{m}")));
            for m in &j.missing {
                all.insert(format!("size.{}", m.mechanism));
                all.extend(m.parameters.iter().map(|(name, ..)| format!("parameter.{}.{name}", m.mechanism)));
            }
            if j.missing.len() > COLUMNS {
                return Err(format!("its verdict names more than {COLUMNS} mechanisms; diagnose this campaign again"));
            }
        }
        if all.union(&self.0).take(COLUMNS + 1).count() > COLUMNS {
            let cure = "diagnose this campaign again, or give it fewer [campaign.columns]";
            return Err(format!("with it the table of the fleet has more than {COLUMNS} columns; {cure}"));
        }
        self.0.extend(all);
        Ok(())
    }
}

fn read(folder: &Path) -> anyhow::Result<(BTreeMap<String, Label>, State)> {
    let path = folder.join(VERDICT);
    let of = || format!("{}: cannot be read; diagnose this campaign again", path.display());
    let text = input::text(&path, MOST).with_context(of)?;
    anyhow::ensure!(
        Manifest::read(folder).is_some_and(|m| m.has(folder, VERDICT)),
        "{}: is not as it was written, by the hash in its manifest.json; diagnose this campaign again",
        path.display()
    );
    let v: Verdict = serde_json::from_str(&text).with_context(of)?;
    let total: f64 = v.posterior.iter().map(|c| c.probability).sum();
    anyhow::ensure!(
        total <= 1.0 + ROUNDING,
        "{}: its posterior adds up to {total}; diagnose this campaign again",
        path.display()
    );
    if let Some(why) = v.invalid {
        return Ok((v.columns, State::Unjudged(why.text)));
    }
    let material = v.material.unwrap_or_default();
    let named = |m: Missing| Named {
        size: material.get(&m.mechanism).and_then(Effect::size),
        parameters: m
            .parameters
            .into_iter()
            .filter(|(_, p)| !p.held)
            .filter_map(|(name, p)| Some((name, p.value.filter(|v| v.is_finite())?, p.unit)))
            .collect(),
        mechanism: m.mechanism,
        form: m.form,
        probability: m.probability,
    };
    let judged = Judged {
        detected: v.mismatch.detected,
        false_alarm_probability: v.mismatch.false_alarm_probability,
        false_discovery_rate: 1.0,
        missing: v.missing.into_iter().map(named).collect(),
        unexplained: v.unexplained.detected,
        nothing: v.posterior.iter().find(|c| c.mechanisms.is_empty()).map_or(0.0, |c| c.probability),
        probabilities: probabilities(&v.posterior),
        before: v.fit.before.heldout_nrmse,
        after: v.fit.after.heldout_nrmse,
    };
    Ok((v.columns, State::Judged(judged)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An answer as `diagnose` writes it, as far as a fleet reads it.
    pub fn write(out: &Path, campaign: &str, verdict: &serde_json::Value) {
        let a = output::Answer::begin(&out.join(campaign), "diagnose").unwrap();
        a.write("verdict.json", verdict.to_string().as_bytes()).unwrap();
        a.commit().unwrap();
    }

    /// A verdict that names `missing` with the largest change that it makes.
    pub fn verdict(missing: Option<(&str, f64)>, p: f64, misfit: f64, columns: serde_json::Value) -> serde_json::Value {
        let names: Vec<_> = missing
            .iter()
            .map(|(m, size)| {
                serde_json::json!({"mechanism": m, "form": "f", "probability": 0.9,
                    "parameters": {"a": {"value": size, "unit": "N"}, "b": {"value": 1.0, "unit": "1", "held": true}}})
            })
            .collect();
        let causes = match missing {
            Some((m, _)) => {
                serde_json::json!([{"mechanisms": [m], "probability": 0.9}, {"mechanisms": [], "probability": 0.1}])
            }
            None => serde_json::json!([{"mechanisms": [], "probability": 0.97}]),
        };
        let material: BTreeMap<_, _> = missing
            .iter()
            .map(|(m, s)| {
                (m, serde_json::json!({"peak_force": -s, "restitution": null, "contact_time": s / 2.0, "depth": 0.0}))
            })
            .collect();
        serde_json::json!({"columns": columns, "mismatch": {"detected": missing.is_some(), "false_alarm_probability": p},
            "missing": names, "unexplained": {"detected": false, "text": ""}, "posterior": causes, "material": material,
            "fit": {"before": {"heldout_nrmse": misfit}, "after": {"heldout_nrmse": misfit / 2.0}}})
    }

    #[test]
    fn a_number_of_a_verdict_is_read_as_it_was_written() {
        // one that a reader which rounds twice has a bit off
        let text = "0.039478680975385476";
        let read: f64 = serde_json::from_str(text).unwrap();
        assert_eq!(Some(read), text.parse().ok());
    }

    #[test]
    fn what_matters_comes_first_and_the_lost_are_named() {
        let t = tempfile::tempdir().unwrap();
        let out = t.path();
        let none = || serde_json::json!({});
        write(out, "silent", &verdict(None, 0.6, 0.09, none()));
        write(out, "small", &verdict(Some(("wear", 0.01)), 1e-4, 0.01, none()));
        write(out, "large", &verdict(Some(("wear", 0.2)), 1e-9, 0.05, serde_json::json!({"batch": "B", "order": 3})));
        let mut invalid = verdict(None, 1.0, 0.0, none());
        invalid["invalid"] = serde_json::json!({"text": "too short"});
        write(out, "unjudged", &invalid);
        std::fs::create_dir(out.join("mine")).unwrap();
        let member = |n: &str| register::Member { campaign: n.into(), folder: n.into() };
        register::enlist(out, &["silent", "aborted", "never"].map(member)).unwrap();
        register::lose(out, "aborted", "its process was ended by SIGABRT").unwrap();
        let f = Fleet::read(&[out.to_path_buf()]).unwrap();
        let order: Vec<&str> = f.answers.iter().map(|a| a.campaign.as_str()).collect();
        assert_eq!(order, ["aborted", "never", "unjudged", "large", "small", "silent"]);
        let lost: Vec<_> = f.lost().map(|(a, why)| (a.campaign.as_str(), why)).collect();
        assert_eq!(lost, [("aborted", "its process was ended by SIGABRT"), ("never", NEVER)]);
        assert_eq!(f.unjudged().map(|(_, why)| why).collect::<Vec<_>>(), ["too short"]);
        let large = f.answers[3].judged().unwrap();
        assert_eq!((large.cause().as_str(), large.sure(), large.probability_of("wear")), ("wear", 0.9, 0.9));
        assert_eq!(large.missing[0].size, Some(0.2));
        assert_eq!(large.missing[0].parameters, [("a".to_string(), 0.2, "N".to_string())]);
        assert_eq!(f.answers[3].columns["order"], Label::Number(3.0));
        // three campaigns judged: p of 1e-9, 1e-4, 0.6
        let q: Vec<f64> = f.judged().map(|(_, j)| j.false_discovery_rate).collect();
        assert!((q[0] - 3e-9).abs() < 1e-15 && (q[1] - 1.5e-4).abs() < 1e-12 && q[2] == 0.6, "{q:?}");
        assert_eq!((f.mechanisms(), f.columns()), (vec!["wear".to_string()], vec!["batch".into(), "order".into()]));
        assert_eq!(f.answers[5].judged().unwrap().cause(), NOTHING);
    }

    #[test]
    fn a_campaign_lost_in_one_folder_may_be_answered_in_another() {
        let t = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|n| t.path().join(n));
        let members = ["one", "two"].map(|n| register::Member { campaign: n.into(), folder: n.into() });
        register::enlist(&a, &members).unwrap();
        register::enlist(&b, &members).unwrap();
        register::lose(&b, "two", "its time was up").unwrap();
        write(&b, "one", &verdict(None, 0.5, 0.01, serde_json::json!({})));
        let f = Fleet::read(&[a, b]).unwrap();
        assert_eq!(
            f.lost().map(|(x, why)| (x.campaign.as_str(), why)).collect::<Vec<_>>(),
            [("two", "its time was up")]
        );
        assert_eq!(f.judged().count(), 1);
    }

    #[test]
    fn a_campaign_in_a_hidden_folder_is_answered_and_a_verdict_that_was_changed_is_lost() {
        let t = tempfile::tempdir().unwrap();
        let out = t.path();
        for name in [".hidden", "changed"] {
            write(out, name, &verdict(None, 0.5, 0.01, serde_json::json!({})));
        }
        let member = |n: &str| register::Member { campaign: n.into(), folder: n.into() };
        register::enlist(out, &[".hidden", "changed"].map(member)).unwrap();
        let path = out.join("changed/verdict.json");
        std::fs::write(&path, std::fs::read_to_string(&path).unwrap() + " ").unwrap();
        let f = Fleet::read(&[out.to_path_buf()]).unwrap();
        assert_eq!(f.judged().map(|(a, _)| a.campaign.as_str()).collect::<Vec<_>>(), [".hidden"]);
        let lost: Vec<_> = f.lost().collect();
        assert!(lost.len() == 1 && lost[0].1.contains("is not as it was written"), "{lost:?}");
        assert!(f.complaints.is_empty());
    }

    #[test]
    fn a_verdict_of_very_many_causes_is_refused_and_loses_no_other() {
        let t = tempfile::tempdir().unwrap();
        let mut many = verdict(None, 0.5, 0.01, serde_json::json!({}));
        let causes = (0..200_000).map(|i| serde_json::json!({"mechanisms": [format!("m{i}")], "probability": 5e-6}));
        many["posterior"] = causes.collect();
        write(t.path(), "many", &many);
        // of one mechanism, again and again
        let causes = (0..200_000).map(|_| serde_json::json!({"mechanisms": ["wear", "wear"], "probability": 2.5e-6}));
        many["posterior"] = causes.collect();
        write(t.path(), "one", &many);
        let f = Fleet::read(&[t.path().to_path_buf()]).unwrap();
        let lost: Vec<_> = f.lost().map(|(a, why)| (a.campaign.as_str(), why)).collect();
        assert!(lost.len() == 1 && lost[0].0 == "many" && lost[0].1.contains("more than 1000 columns"), "{lost:?}");
        assert!((f.answers[1].judged().unwrap().probability_of("wear") - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_damaged_answer_is_named_and_a_whole_one_in_another_folder_counts() {
        let t = tempfile::tempdir().unwrap();
        let [one, other] = ["one", "other"].map(|n| t.path().join(n));
        for (out, name) in
            [(&one, "gone"), (&one, "folder"), (&one, "unlisted"), (&one, "changed"), (&other, "changed")]
        {
            write(out, name, &verdict(None, 0.5, 0.01, serde_json::json!({})));
        }
        std::fs::remove_file(one.join("gone/verdict.json")).unwrap();
        std::fs::remove_file(one.join("folder/verdict.json")).unwrap();
        std::fs::create_dir(one.join("folder/verdict.json")).unwrap();
        std::fs::write(one.join("unlisted/manifest.json"), "{").unwrap();
        std::fs::write(one.join("changed/verdict.json"), "{}").unwrap();
        for outs in [[one.clone(), other.clone()], [other, one]] {
            let f = Fleet::read(&outs).unwrap();
            assert_eq!(f.lost().map(|l| l.0.campaign.as_str()).collect::<Vec<_>>(), ["folder", "gone"]);
            assert_eq!(f.judged().map(|j| j.0.campaign.as_str()).collect::<Vec<_>>(), ["changed"]);
            let [said] = &f.complaints[..] else { panic!("{:?}", f.complaints) };
            assert!(said.contains("unlisted") && said.contains("diagnose that campaign again"), "{said}");
        }
    }

    #[test]
    fn what_is_no_probability_is_refused() {
        let t = tempfile::tempdir().unwrap();
        let of = |name: &str, change: &dyn Fn(&mut serde_json::Value)| {
            let mut v = verdict(Some(("wear", 0.2)), 1e-9, 0.05, serde_json::json!({}));
            change(&mut v);
            write(t.path(), name, &v);
        };
        of("fine", &|_| ());
        of("above", &|v| v["missing"][0]["probability"] = 7.5.into());
        of("below", &|v| v["mismatch"]["false_alarm_probability"] = (-0.5).into());
        of("sum", &|v| v["posterior"][1]["probability"] = 0.9.into());
        let f = Fleet::read(&[t.path().to_path_buf()]).unwrap();
        let lost: Vec<_> = f.lost().map(|(a, _)| a.campaign.as_str()).collect();
        assert_eq!(lost, ["above", "below", "sum"]);
        assert!(f.lost().all(|(_, why)| why.contains("diagnose this campaign again")));
        assert_eq!(f.judged().count(), 1);
    }

    #[test]
    fn an_answer_of_before_does_not_hide_that_the_last_diagnosis_was_lost() {
        let t = tempfile::tempdir().unwrap();
        let (one, other) = (t.path().join("one"), t.path().join("other"));
        for out in [&one, &other] {
            write(out, "a", &verdict(None, 0.5, 0.01, serde_json::json!({})));
        }
        register::lose(&one, "a", "its process was killed").unwrap();
        let lost = |outs: &[PathBuf]| Fleet::read(outs).unwrap().lost().map(|l| l.1.to_string()).collect::<Vec<_>>();
        assert_eq!(lost(std::slice::from_ref(&one)), ["its process was killed"]);
        // the answer that counts is the first folder's
        assert_eq!(lost(&[one.clone(), other.clone()]), ["its process was killed"]);
        assert!(lost(&[other, one]).is_empty());
    }

    #[test]
    fn a_campaign_is_answered_in_a_folder_that_is_called_as_ours_are() {
        let t = tempfile::tempdir().unwrap();
        for name in [".touchdown-mine", ".touchdown-stage-mine"] {
            write(t.path(), name, &verdict(None, 0.5, 0.01, serde_json::json!({})));
        }
        assert_eq!(Fleet::read(&[t.path().to_path_buf()]).unwrap().judged().count(), 2);
    }

    #[test]
    fn a_verdict_that_is_none_is_a_loss_told_with_its_file() {
        let t = tempfile::tempdir().unwrap();
        write(t.path(), "x", &serde_json::json!({"format": "verdict/1"}));
        write(t.path(), "y", &verdict(None, 0.5, 0.01, serde_json::json!({})));
        let f = Fleet::read(&[t.path().to_path_buf()]).unwrap();
        let lost: Vec<_> = f.lost().map(|(_, why)| why.to_string()).collect();
        assert!(lost[0].contains("x/verdict.json: cannot be read") && lost[0].contains("mismatch"), "{lost:?}");
        assert_eq!((lost.len(), f.judged().count()), (1, 1));
    }
}
