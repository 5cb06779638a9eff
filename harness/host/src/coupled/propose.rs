//! What a campaign of FMUs may look like, proposed from their descriptions.

use super::layout::system_of;
use crate::master::build::{connect, open, Opened};
use crate::{Causality, Isolation, Kind, Variable};
use anyhow::Result;
use std::path::Path;

/// Exponents of kg, m and s.
const FORCE: [i32; 3] = [1, 1, -2];
const LENGTH: [i32; 3] = [0, 1, 0];
const SPEED: [i32; 3] = [0, 1, -1];
pub(super) const ACCELERATION: [i32; 3] = [0, 1, -2];
const MASS: [i32; 3] = [1, 0, 0];
/// Relative standard deviation of a weighed mass.
const WEIGHED: f64 = 0.002;

/// A bond proposed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProposedBond {
    pub name: String,
    /// `fmu.variable`; None where the FMU has no input in N.
    pub force: Option<String>,
    pub penetration: String,
    pub velocity: String,
}

/// What is proposed for a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proposal {
    pub bonds: Vec<ProposedBond>,
    /// `fmu.variable` by channel: force, acceleration, penetration.
    pub channels: [Option<String>; 3],
    /// Variables that calibration may move, with the tolerance of those that have one.
    pub free: Vec<(String, Option<f64>)>,
    /// Parameters of the FMUs that move, which recordings may differ by: name and value in the system file.
    pub settings: Vec<(String, f64)>,
}

pub(super) fn is_of(o: &Opened, v: &Variable, exponents: [i32; 3]) -> bool {
    let unit = v.unit.as_ref().and_then(|u| o.description().units.get(u));
    v.kind == Kind::Real
        && unit.is_some_and(|u| u.exponents[..3] == exponents && u.exponents[3..].iter().all(|e| *e == 0))
}

fn of_kind(o: &Opened, causality: Causality, exponents: [i32; 3]) -> Vec<&Variable> {
    o.description().variables.iter().filter(|v| v.causality == causality && is_of(o, v, exponents)).collect()
}

/// Letters of two names that are alike from either end, in the hope that names of one body begin or end alike.
fn alike(a: &str, b: &str) -> usize {
    let front = a.bytes().zip(b.bytes()).take_while(|(x, y)| x == y).count();
    let back = a.bytes().rev().zip(b.bytes().rev()).take_while(|(x, y)| x == y).count();
    front + back
}

/// The one of `all` whose name is most like `name`; of equals the first.
fn nearest<'a>(name: &str, all: &[&'a Variable]) -> Option<&'a Variable> {
    all.iter().rev().max_by_key(|v| alike(name, &v.name)).copied()
}

/// Proposes bonds, channels and free variables for the system at `path`: an input in N beside outputs in m and m/s of the same
/// FMU is a bond.
///
/// # Errors
/// What is wrong with the system or an FMU.
pub fn propose(path: &Path, isolation: &Isolation) -> Result<Proposal> {
    let s = system_of(path, isolation)?;
    let folder = output::Scratch::new("system")?;
    let mut opened = open(&s, folder.path())?;
    let feeds = connect(&s, &mut opened, &mut Vec::new())?;
    let mut p = Proposal::default();
    let mut contacts = Vec::new();
    for (k, o) in opened.iter().enumerate() {
        let full = |v: &Variable| format!("{}.{}", o.name, v.name);
        let (lengths, speeds) = (of_kind(o, Causality::Output, LENGTH), of_kind(o, Causality::Output, SPEED));
        let forces = of_kind(o, Causality::Input, FORCE);
        for f in &forces {
            let (Some(x), Some(v)) = (nearest(&f.name, &lengths), nearest(&f.name, &speeds)) else { continue };
            let name = if forces.len() > 1 { f.name.clone() } else { o.name.clone() };
            p.bonds.push(ProposedBond { name, force: Some(full(f)), penetration: full(x), velocity: full(v) });
            let fed = o.inputs.iter().position(|i| i.reference == f.value_reference).map(|i| feeds[k][i]);
            if let Some((from, at)) = fed {
                let source = &opened[from];
                contacts.push(from);
                let force = format!("{}.{}", source.name, source.outputs[at].name);
                p.channels[0].get_or_insert(force);
            }
            if let Some(a) = nearest(&f.name, &of_kind(o, Causality::Output, ACCELERATION)) {
                p.channels[1].get_or_insert(full(a));
            }
            p.channels[2].get_or_insert(full(x));
            for m in of_kind(o, Causality::Parameter, MASS) {
                if p.free.iter().all(|f| f.0 != full(m)) {
                    p.free.push((full(m), Some(WEIGHED)));
                }
            }
            for (name, value) in &s.fmu[k].set {
                if let Ok(value) = o.description().number(name, value.get_ref()) {
                    p.settings.push((format!("{}.{name}", o.name), value));
                }
            }
        }
    }
    if p.bonds.is_empty() {
        alone(&opened, &mut p);
    }
    for k in contacts {
        let o = &opened[k];
        let set = s.fmu[k].set.keys().filter_map(|name| o.description().variable(name));
        for v in set.filter(|v| v.kind == Kind::Real && v.causality == Causality::Parameter) {
            p.free.push((format!("{}.{}", o.name, v.name), None));
        }
    }
    p.free.dedup_by(|a, b| a.0 == b.0);
    Ok(p)
}

/// What FMUs without an input in N give: the first output of each kind, and a bond without a force where they report a motion.
fn alone(opened: &[Opened], p: &mut Proposal) {
    for o in opened {
        let first = |exponents| {
            let all = of_kind(o, Causality::Output, exponents);
            all.first().map(|v| format!("{}.{}", o.name, v.name))
        };
        for (channel, exponents) in p.channels.iter_mut().zip([FORCE, ACCELERATION, LENGTH]) {
            *channel = channel.take().or(first(exponents));
        }
        if let (Some(x), Some(v), true) = (first(LENGTH), first(SPEED), p.bonds.is_empty()) {
            p.bonds.push(ProposedBond { name: o.name.clone(), force: None, penetration: x, velocity: v });
        }
    }
}
