//! A system of FMUs laid out for the forward model: what is stepped when, where the bonds are, what the channels read.

use crate::master::build::{beyond_bounds, connect, find, open, place, Opened};
use crate::master::network::components;
use crate::master::{Component, Feed, Map, Master, System};
use crate::{Causality, Description, Isolation, Kind, Limits, Variable};
use anyhow::{Context, Result};
use record::{Channel, FmuSystem, Written};
use std::path::Path;
use toml::Spanned;

/// An output, by its place among all that are read, and its value in SI over that in its unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tap {
    pub global: usize,
    pub to_si: f64,
}

/// An input of an FMU that a bond pushes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Port {
    pub part: usize,
    pub reference: u32,
    /// Value in its unit over N.
    pub from_si: f64,
}

/// A bond, found.
#[derive(Clone, Debug)]
pub(super) struct BondAt {
    pub port: Option<Port>,
    pub penetration: Tap,
    pub velocity: Tap,
    /// What feeds the port in the user's system, in N; None where nothing does.
    pub source: Option<Feed>,
}

/// An input that another FMU feeds.
#[derive(Clone, Debug)]
pub(super) struct Fed {
    pub reference: u32,
    pub feed: Feed,
    pub kind: Kind,
    /// Whether it is held over a step, as what is no Real at either end is.
    pub held: bool,
    /// What values become instead.
    pub map: Map,
    /// The bond whose face is fed here, and whether it is the face's speed.
    pub face: Option<(usize, bool)>,
}

/// An FMU with what of it is connected.
#[derive(Clone, Debug)]
pub(super) struct PartAt {
    pub inputs: Vec<Fed>,
    /// References of the outputs that are read, whether all of them are Reals, and the place of the first among all.
    pub outputs: Vec<u32>,
    pub reals: bool,
    pub first: usize,
    /// Bonds that push on it.
    pub bonds: Vec<usize>,
    /// Highest order of input derivatives that it takes.
    pub orders: u32,
    /// Whether it is stepped in two halves, its inputs held over each: it takes no derivatives, and any step.
    pub in_halves: bool,
    /// Whether it follows the motion.
    pub follows: bool,
}

/// A variable that is set for each run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settable {
    pub part: usize,
    pub reference: u32,
}

/// A system laid out.
pub(super) struct Layout {
    pub system: System,
    pub opened: Vec<Opened>,
    pub parts: Vec<PartAt>,
    /// Parts in the order in which they are stepped.
    pub order: Vec<usize>,
    pub bonds: Vec<BondAt>,
    pub channels: [Option<Tap>; 3],
    pub owner: Vec<usize>,
    pub free: Vec<Settable>,
    /// By recording.
    pub sets: Vec<Vec<(Settable, f64)>>,
    pub notes: Vec<String>,
    pub start: f64,
    _folder: output::Scratch,
}

/// The system of a campaign: a file as `touchdown run` takes it, an archive, or one FMU.
pub(crate) fn system_of(path: &Path, isolation: &Isolation) -> Result<System> {
    let mut s =
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("fmu")) { alone(path) } else { System::load(path)? };
    s.isolation = isolation.clone();
    Ok(s)
}

/// One FMU as a system; it has the name of its file, and runs as long as its DefaultExperiment.
fn alone(path: &Path) -> System {
    let name = path.file_stem().map_or("model".into(), |n| n.to_string_lossy().replace('.', "_"));
    let file = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let bare = System::of(vec![Component::named(name.clone(), file)], path, path.parent().unwrap_or(Path::new("")));
    // what is wrong with it is said where it is opened
    let described = Description::in_archive(path).ok();
    let master = described.map_or_else(Master::plain, |d| Master::plain().within(std::iter::once(&d)));
    System { name: Some(name), master, ..bare }
}

/// FMU and variable of a text of campaign.toml.
fn variable<'a>(of: &FmuSystem, s: &System, opened: &'a [Opened], text: &Written) -> Result<(usize, &'a Variable)> {
    let spanned = Spanned::new(0..0, text.text.clone());
    find(s, opened, &spanned).map_err(|e| {
        let said = e.to_string();
        let what = said.split_once(": ").map_or(said.as_str(), |(_, rest)| rest).to_string();
        of.wrong(text.line, what, format!("name a variable of {}", of.file.text)).into()
    })
}

/// Value in SI of one in the unit of `v`.
pub(super) fn to_si(o: &Opened, v: &Variable) -> f64 {
    v.unit.as_ref().and_then(|u| o.description().units.get(u)).map_or(1.0, |u| u.factor)
}

impl Layout {
    /// The system that `of` names, laid out for recordings with these settings.
    ///
    /// # Errors
    /// What is wrong with the system file, or with what campaign.toml says of it: file, line and cure.
    pub fn new(of: &FmuSystem, sets: &[Vec<record::Setting>], isolation: &Isolation) -> Result<Layout> {
        let system = system_of(&of.path(), isolation)
            .map_err(|e| of.wrong(of.file.line, format!("{e:#}"), "name the system that simulates the recordings"))?;
        Layout::of(of, sets, system)
    }

    fn of(of: &FmuSystem, sets: &[Vec<record::Setting>], mut system: System) -> Result<Layout> {
        let folder = output::Scratch::new("system")?;
        let mut opened = open(&system, folder.path())?;
        let once = |o: &Opened| o.fmu.capabilities().can_be_instantiated_only_once_per_process && !o.fmu.is_apart();
        if opened.iter().any(once) && Isolation::is_possible() {
            // every thread needs one of its own
            system.isolation = Isolation::Process(Limits::new());
            opened = open(&system, folder.path())?;
        }
        let mut notes = system.notes.clone();
        let feeds = connect(&system, &mut opened, &mut notes)?;
        notes.extend(beyond_bounds(&system, &opened));
        let s = &system;
        // first of all what has to be read, so that places are settled
        let mut taps: Vec<(usize, usize, f64)> = Vec::new();
        let mut tap = |opened: &mut Vec<Opened>, w: &Written| -> Result<usize> {
            let (k, v) = variable(of, s, opened, w)?;
            let v = v.clone();
            if v.kind != Kind::Real || matches!(v.causality, Causality::Input | Causality::Independent) {
                let cure = "name an output of type Real";
                return Err(of.wrong(w.line, format!("{} is not an output of type Real", w.text), cure).into());
            }
            let si = to_si(&opened[k], &v);
            taps.push((k, place(&mut opened[k].outputs, v), si));
            Ok(taps.len() - 1)
        };
        let mut at = Vec::new();
        for b in &of.bonds {
            at.push((tap(&mut opened, &b.penetration)?, tap(&mut opened, &b.velocity)?));
        }
        let mut read = [None; 3];
        for c in Channel::ALL {
            if let Some(w) = &of.channels[c.index()] {
                read[c.index()] = Some(tap(&mut opened, w)?);
            }
        }
        let mut first = Vec::new();
        let mut owner = Vec::new();
        for (k, o) in opened.iter().enumerate() {
            first.push(owner.len());
            owner.extend(o.outputs.iter().map(|_| k));
        }
        let global = |(k, i): (usize, usize)| first[k] + i;
        let tap_of = |t: usize| Tap { global: global((taps[t].0, taps[t].1)), to_si: taps[t].2 };
        let mut bonds = Vec::new();
        for (b, (x, v)) in of.bonds.iter().zip(&at) {
            let (port, source) = match &b.force {
                None => (None, None),
                Some(w) => {
                    let (k, input) = variable(of, s, &opened, w)?;
                    if input.causality != Causality::Input || input.kind != Kind::Real {
                        let names = opened[k].description().names(Causality::Input).join(", ");
                        let cure = format!("name one of {names}, or leave force out");
                        return Err(of.wrong(w.line, format!("{} is no Real input", w.text), cure).into());
                    }
                    let si = to_si(&opened[k], input);
                    let fed = opened[k].inputs.iter().position(|i| i.name == input.name && !i.held);
                    let source = fed.map(|i| {
                        let f = opened[k].inputs[i].feed;
                        Feed { source: global(feeds[k][i]), factor: f.factor * si, offset: f.offset * si }
                    });
                    (Some(Port { part: k, reference: input.value_reference, from_si: 1.0 / si }), source)
                }
            };
            bonds.push(BondAt { port, penetration: tap_of(*x), velocity: tap_of(*v), source });
        }
        let mut free = Vec::new();
        for f in &of.free {
            free.push(settable(of, s, &opened, &f.variable)?);
        }
        let mut settings = Vec::new();
        for set in sets {
            let each = set.iter().map(|v| {
                let w = Written { text: v.variable.clone(), line: v.line };
                Ok((settable(of, s, &opened, &w)?, v.value))
            });
            settings.push(each.collect::<Result<Vec<_>>>()?);
        }
        let mut parts = Vec::new();
        for (k, o) in opened.iter().enumerate() {
            let pushed: Vec<usize> = (0..bonds.len()).filter(|b| bonds[*b].port.is_some_and(|p| p.part == k)).collect();
            let cut = |reference: u32| {
                bonds.iter().any(|b: &BondAt| b.port.is_some_and(|p| p.part == k && p.reference == reference))
            };
            let mut inputs = Vec::new();
            for (i, f) in o.inputs.iter().zip(&feeds[k]) {
                // a Real and another type have references of their own
                if i.kind == Kind::Real && cut(i.reference) {
                    continue;
                }
                if i.kind == Kind::String {
                    let what = format!("{}.{} is fed by a String", o.name, i.name);
                    return Err(of.wrong(of.file.line, what, "leave Strings unconnected in a diagnosis").into());
                }
                inputs.push(Fed {
                    reference: i.reference,
                    feed: Feed { source: global(*f), ..i.feed },
                    kind: i.kind,
                    held: i.held,
                    map: i.map.clone(),
                    face: None,
                });
            }
            let c = o.fmu.capabilities();
            let orders = system.fmu[k].input_orders.unwrap_or(1);
            parts.push(PartAt {
                inputs,
                outputs: o.outputs.iter().map(|v| v.value_reference).collect(),
                reals: o.outputs.iter().all(|v| v.kind == Kind::Real),
                first: first[k],
                orders: if c.can_interpolate_inputs { orders } else { 0 },
                in_halves: !pushed.is_empty()
                    && (!c.can_interpolate_inputs || orders == 0)
                    && c.can_handle_variable_communication_step_size,
                follows: false,
                bonds: pushed,
            });
        }
        let channels = read.map(|r| r.map(tap_of));
        let start = system.master.start;
        let mut layout = Layout {
            order: order_of(&opened, &parts, &owner),
            system,
            opened,
            parts,
            bonds,
            channels,
            owner,
            free,
            sets: settings,
            notes,
            start,
            _folder: folder,
        };
        layout.part_motion_from_contacts();
        Ok(layout)
    }

    /// Turns a bond whose force acts into the stop: a push is its negative.
    pub fn turn(&mut self, b: usize) {
        let bond = &mut self.bonds[b];
        if let Some(p) = &mut bond.port {
            p.from_si = -p.from_si;
        }
        if let Some(s) = &mut bond.source {
            (s.factor, s.offset) = (-s.factor, -s.offset);
        }
    }

    /// Marks what follows the motion: contacts that feed a bond, and what comes behind them. They see the bond's face.
    fn part_motion_from_contacts(&mut self) {
        let moves = |k: usize| self.bonds.iter().any(|b| self.owner[b.penetration.global] == k);
        let mut from = self.order.len();
        let mut faces = Vec::new();
        for (b, bond) in self.bonds.iter().enumerate() {
            let Some(source) = bond.source else { continue };
            let k = self.owner[source.source];
            if !moves(k) {
                from = from.min(self.order.iter().position(|o| *o == k).unwrap_or(from));
                faces.push((k, b, bond.penetration.global, bond.velocity.global));
            }
        }
        for (place, k) in self.order.clone().into_iter().enumerate() {
            self.parts[k].follows = place >= from && !moves(k);
        }
        for (k, b, x, v) in faces {
            for i in &mut self.parts[k].inputs {
                if i.feed.source == x {
                    i.face = Some((b, false));
                } else if i.feed.source == v {
                    i.face = Some((b, true));
                }
            }
        }
    }

    /// The FMU and variable of `w`, and where it stands without being set.
    pub fn nominal(&self, of: &FmuSystem, w: &Written) -> Result<(Variable, f64)> {
        let (k, v) = variable(of, &self.system, &self.opened, w)?;
        let set = self.system.fmu[k].set.get(&v.name).map(|s| s.get_ref());
        let value = match (set, &v.start) {
            (Some(value), _) => self.opened[k].description().number(&v.name, value).ok(),
            (None, Some(crate::Start::Real(x))) => Some(*x),
            _ => None,
        };
        let cure = "set it in the system file";
        let value =
            value.with_context(|| of.wrong(w.line, format!("{} has no start value", w.text), cure).to_string())?;
        Ok((v.clone(), value))
    }
}

fn settable(of: &FmuSystem, s: &System, opened: &[Opened], w: &Written) -> Result<Settable> {
    let (k, v) = variable(of, s, opened, w)?;
    let computed = matches!(v.causality, Causality::Output | Causality::CalculatedParameter | Causality::Independent);
    if v.kind != Kind::Real || computed || v.variability == crate::Variability::Constant {
        let names = opened[k].description().names(Causality::Parameter).join(", ");
        let cure = format!("name a Real parameter: {names}");
        return Err(of.wrong(w.line, format!("{} cannot be set to a number", w.text), cure).into());
    }
    Ok(Settable { part: k, reference: v.value_reference })
}

/// Parts in dependency order, as declared feedthrough gives it; else as written.
fn order_of(opened: &[Opened], parts: &[PartAt], owner: &[usize]) -> Vec<usize> {
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); parts.len()];
    for (k, o) in opened.iter().enumerate() {
        let d = o.description();
        for i in &parts[k].inputs {
            let same = |p: &&crate::master::Input| p.reference == i.reference && p.kind == i.kind;
            let name = o.inputs.iter().find(same).map_or("", |p| p.name.as_str());
            let through = o.outputs.iter().any(|v| d.feedthrough(&v.name, name).unwrap_or(true));
            let from = owner[i.feed.source];
            if through && from != k && !after[k].contains(&from) {
                after[k].push(from);
            }
        }
    }
    components(&after).into_iter().flatten().collect()
}
