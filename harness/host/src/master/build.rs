//! Makes a network of what a user wrote.

use super::network::{Feed, Input, Map, Network, Output, Part};
use super::options::{Adapt, Bond, Inputs, Lookahead, Method, Options, Shape, Touch};
use super::slave::FmuSlave;
use super::system::{AdaptBy, Component, Connection, System};
use crate::units::{conversion as convert, Named};
use crate::value::Value;
use crate::{Causality, Description, Fmu, Instance, Kind, Variability, Variable};
use anyhow::{anyhow, Context, Result};
use pack::Model;
use record::words::meant;
use std::path::PathBuf;
use toml::Spanned;

/// What of an FMU goes into the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// `fmu.variable [unit]`.
    pub head: String,
    /// Part.
    pub part: usize,
    /// Kind.
    pub kind: Kind,
    /// Reference.
    pub reference: u32,
}

/// A system ready to run.
pub struct Built {
    /// Slaves, initialized.
    pub network: Network,
    /// Outputs at the start.
    pub start: Vec<f64>,
    /// How to step.
    pub options: Options,
    /// What to record.
    pub columns: Vec<Column>,
    /// Every how many macro-steps.
    pub every: u64,
    /// Parquet instead of CSV.
    pub parquet: bool,
    /// What was noticed: algebraic loops, connections of unlike units.
    pub notes: Vec<String>,
    /// FMUs in the order of the system.
    pub(super) fmus: Vec<Fmu>,
    _folder: output::Scratch,
}

impl Built {
    /// Frees the FMUs. What went wrong with that.
    pub fn end(self) -> Vec<String> {
        drop(self.network);
        self.fmus.iter().flat_map(Fmu::complaints).collect()
    }
}

/// An FMU opened, before it is a part.
pub(crate) struct Opened {
    pub name: String,
    pub fmu: Fmu,
    pub inputs: Vec<Input>,
    pub outputs: Vec<Variable>,
}

impl Opened {
    pub fn description(&self) -> &Description {
        self.fmu.description()
    }
}

/// Where a component's FMU is; our own is packed into `folder`.
pub(super) fn file_of(s: &System, c: &Component, folder: &std::path::Path) -> Result<PathBuf> {
    if let Some(model) = c.own() {
        let m = Model::named(model).map_err(|e| s.at(c.file.span(), &e.to_string()))?;
        let path = folder.join(format!("{}.fmu", m.name));
        if !path.exists() {
            m.into_folder(folder, &[])?;
        }
        return Ok(path);
    }
    Ok(s.folder.join(c.file.get_ref()))
}

/// Opens every FMU, connects, sets and initializes them.
///
/// # Errors
/// Names the file, the line, what is wrong there and the cure.
pub fn build(s: &System) -> Result<Built> {
    let folder = output::Scratch::new("system")?;
    let opened = open(s, folder.path())?;
    connected(s, opened, folder)
}

/// FMUs of a system at most: each is unpacked, and has a process of its own.
pub(super) const MOST_FMUS: usize = 1000;

/// Opens every FMU; ours are packed into `folder`.
///
/// # Errors
/// As [`build`].
pub(crate) fn open(s: &System, folder: &std::path::Path) -> Result<Vec<Opened>> {
    let mut opened: Vec<Opened> = Vec::new();
    if let Some(c) = s.fmu.get(MOST_FMUS) {
        return Err(s.at(c.name.span(), &format!("more than {MOST_FMUS} FMUs; run the system in parts")));
    }
    for c in &s.fmu {
        let name = c.name.get_ref();
        if opened.iter().any(|o| &o.name == name) {
            return Err(s.at(c.name.span(), &format!("two FMUs are named {name}; give each its own name")));
        }
        if name.is_empty() || name.contains('.') {
            return Err(s.at(c.name.span(), &format!("{name:?} is no name: give one without a dot")));
        }
        let file = file_of(s, c, folder)?;
        let fmu = Fmu::open_in(&file, &s.isolation).map_err(|e| s.within(c.file.span(), e))?;
        opened.push(Opened { name: name.clone(), fmu, inputs: Vec::new(), outputs: Vec::new() });
    }
    Ok(opened)
}

/// Connects, sets and initializes the FMUs opened.
fn connected(s: &System, mut opened: Vec<Opened>, folder: output::Scratch) -> Result<Built> {
    let mut notes = s.notes.clone();
    let feeds = connect(s, &mut opened, &mut notes)?;
    notes.extend(beyond_bounds(s, &opened));
    let mut options = options(s, &opened, &mut notes)?;
    for b in &s.bond {
        let ports = [(&b.force, FORCE), (&b.velocity, SPEED)].into_iter();
        let energies = b.work.iter().chain(&b.energy).map(|e| (e, ENERGY));
        ports.chain(energies).try_for_each(|(text, unit)| in_si(s, &opened, text, unit))?;
    }
    let mut output = |text: &Spanned<String>| -> Result<(usize, usize)> {
        let (k, v) = find(s, &opened, text)?;
        let v = v.clone();
        if v.kind != Kind::Real {
            return Err(s.at(text.span(), &format!("{} is a {:?}; a Real is needed here", text.get_ref(), v.kind)));
        }
        Ok((k, place(&mut opened[k].outputs, v)))
    };
    let mut touches = Vec::new();
    for t in &s.touch {
        touches.push((output(&t.of)?, t.at));
    }
    let mut bonds = Vec::new();
    for b in &s.bond {
        bonds.push((output(&b.force)?, output(&b.velocity)?));
    }
    let references = |text: &Spanned<String>| -> Result<(usize, u32)> {
        let (k, v) = find(s, &opened, text)?;
        if v.kind != Kind::Real {
            return Err(s.at(text.span(), &format!("{} is a {:?}; a Real is needed here", text.get_ref(), v.kind)));
        }
        Ok((k, v.value_reference))
    };
    for l in &s.lookahead {
        let (part, reference) = references(&l.variable)?;
        let v = find(s, &opened, &l.variable)?.1;
        if v.variability != Variability::Tunable || v.unit.as_deref() != Some("s") {
            let what = format!("{} is no tunable parameter in s, so it cannot be kept ahead", l.variable.get_ref());
            return Err(s.at(l.variable.span(), &what));
        }
        options.lookaheads.push(Lookahead { part, reference, steps: l.steps });
    }
    let first: Vec<usize> = opened
        .iter()
        .scan(0, |n, o| {
            let at = *n;
            *n += o.outputs.len();
            Some(at)
        })
        .collect();
    let global = |(k, i): (usize, usize)| first[k] + i;
    options.touches = touches.iter().map(|(o, level)| Touch { output: global(*o), level: *level }).collect();
    for (b, (force, velocity)) in s.bond.iter().zip(bonds) {
        options.bonds.push(Bond {
            force: global(force),
            velocity: global(velocity),
            work: b.work.as_ref().map(&references).transpose()?,
            energy: b.energy.iter().map(&references).collect::<Result<_>>()?,
        });
    }
    let (columns, every) = (columns(s, &opened)?, s.results.every.unwrap_or(1).max(1));
    let mut slaves: Vec<FmuSlave> = Vec::new();
    for (c, o) in s.fmu.iter().zip(&opened) {
        slaves.push(initialize(s, c, o, &options)?);
    }
    let mut parts = Vec::new();
    for ((k, o), slave) in opened.iter().enumerate().zip(slaves) {
        let mut inputs = o.inputs.clone();
        for (i, f) in inputs.iter_mut().zip(&feeds[k]) {
            i.feed.source = global(*f);
        }
        let d = o.description();
        let depends = |v: &Variable| {
            (0..inputs.len()).filter(|&i| d.feedthrough(&v.name, &inputs[i].name).unwrap_or(true)).collect::<Vec<_>>()
        };
        let outputs = o
            .outputs
            .iter()
            .map(|v| Output {
                name: v.name.clone(),
                reference: v.value_reference,
                kind: v.kind,
                depends: if v.causality == Causality::Output { depends(v) } else { (0..inputs.len()).collect() },
            })
            .collect();
        parts.push(Part { name: o.name.clone(), slave: Box::new(slave), inputs, outputs });
    }
    let mut network = Network::new(parts)?;
    if !s.master.order.is_empty() {
        let mut order = Vec::new();
        for n in &s.master.order {
            let k = opened.iter().position(|o| &o.name == n);
            order.push(k.with_context(|| format!("{}: [master] order: {}", s.path.display(), no_fmu(n, &opened)))?);
        }
        network.set_order(order).with_context(|| format!("{}: [master] order", s.path.display()))?;
    }
    for l in network.loops() {
        notes.push(format!("algebraic loop, solved at every communication point: {}", l.join(", ")));
    }
    let mut start = vec![0.0; network.count()];
    network.propagate(&mut start).with_context(|| format!("{}", s.path.display()))?;
    for k in 0..network.parts.len() {
        network.feed(k, &start)?;
    }
    for p in &mut network.parts {
        p.slave.ready().with_context(|| format!("{}", s.path.display()))?;
    }
    network.propagate(&mut start).with_context(|| format!("{}", s.path.display()))?;
    let fmus = opened.into_iter().map(|o| o.fmu).collect();
    Ok(Built { network, start, options, columns, every, parquet: s.results.parquet, notes, fmus, _folder: folder })
}

/// Units that bonds are in: name, exponents of kg, m, s.
type Si = (&'static str, [i32; 3]);
const FORCE: Si = ("N", [1, 1, -2]);
const SPEED: Si = ("m/s", [0, 1, -1]);
const ENERGY: Si = ("J", [1, 2, -2]);

/// That a variable of a bond is in its SI unit where its FMU defines what it is in: energies of other units would add up to
/// nothing.
fn in_si(s: &System, opened: &[Opened], text: &Spanned<String>, (name, exponents): Si) -> Result<()> {
    let (k, v) = find(s, opened, text)?;
    let Some(Named { name: own, unit: Some(u) }) = opened[k].description().unit_of(v) else { return Ok(()) };
    let right = u.exponents[..3] == exponents && u.exponents[3..7].iter().all(|e| *e == 0);
    if right && (u.factor - 1.0).abs() < 1e-12 {
        return Ok(());
    }
    let what = format!(
        "{} is in {own}, and a bond is in {name}; name a variable in that, or leave the bond out",
        text.get_ref()
    );
    Err(s.at(text.span(), &what))
}

/// Place of a variable among those listed, put there where it is not yet.
pub(crate) fn place(list: &mut Vec<Variable>, v: Variable) -> usize {
    list.iter().position(|w| w.name == v.name).unwrap_or_else(|| {
        list.push(v);
        list.len() - 1
    })
}

/// That no FMU has this name, and which names there are.
fn no_fmu(name: &str, opened: &[Opened]) -> String {
    let names: Vec<&str> = opened.iter().map(|o| o.name.as_str()).collect();
    format!("no FMU is named {name}; give one of {}{}", names.join(", "), meant(name, &names))
}

/// FMU and variable of `fmu.variable`.
pub(crate) fn find<'a>(s: &System, opened: &'a [Opened], text: &Spanned<String>) -> Result<(usize, &'a Variable)> {
    let t = text.get_ref();
    let Some((fmu, variable)) = t.split_once('.') else {
        return Err(s.at(text.span(), &format!("{t}: give fmu.variable")));
    };
    let Some(k) = opened.iter().position(|o| o.name == fmu) else {
        return Err(s.at(text.span(), &no_fmu(fmu, opened)));
    };
    let Some(v) = opened[k].fmu.description().variable(variable) else {
        let d = opened[k].fmu.description();
        let names = [d.names(Causality::Input), d.names(Causality::Output)].concat();
        let near = meant(variable, &[&names[..], &d.names(Causality::Parameter)].concat());
        let names = names.join(", ");
        let text_of = format!("{fmu} has no variable {variable}; its inputs and outputs are {names}{near}");
        return Err(s.at(text.span(), &text_of));
    };
    Ok((k, v))
}

/// A variable of an FMU.
pub(crate) type Of<'a> = (&'a Description, &'a Variable);

/// (factor, offset) that takes a value in the source's unit to the sink's; 1 and 0 where one of them has no unit.
///
/// # Errors
/// Why it cannot be converted.
pub(crate) fn conversion((d, from): Of<'_>, (e, to): Of<'_>) -> Result<(f64, f64), String> {
    let (Some(a), Some(b)) = (d.unit_of(from), e.unit_of(to)) else { return Ok((1.0, 0.0)) };
    convert(&a, &b, from.relative || to.relative)
}

/// Whether a value of one type can go to an input of another without losing anything.
fn fits(from: Kind, to: Kind) -> bool {
    use Kind::{Boolean, Enumeration, Integer, Real};
    from == to
        || matches!(
            (from, to),
            (Integer | Enumeration | Boolean, Real) | (Boolean | Enumeration, Integer) | (Integer, Enumeration)
        )
}

/// The entries of a connection's map in numbers.
fn mapped(c: &Connection, from: &Variable, to: &Variable) -> Result<Map, String> {
    let number = |v: &Variable, value: &Value| -> Result<f64, String> {
        match value {
            // an archive names what is mapped by items, and has numbers of what has none
            Value::Text(text) if v.items.is_empty() && text.trim().parse::<i32>().is_ok() => {
                Ok(f64::from(text.trim().parse::<i32>().unwrap_or_default()))
            }
            Value::Text(name) => v.item(name).map(f64::from),
            value => plain_number(value).ok_or_else(|| format!("{value} is no number")),
        }
    };
    c.map.iter().map(|(a, b)| Ok((number(from, a)?, number(to, b)?))).collect()
}

/// The number that a value is, of a Boolean 0 or 1.
fn plain_number(value: &Value) -> Option<f64> {
    match value {
        Value::Boolean(b) => Some(f64::from(u8::from(*b))),
        Value::Integer(n) => Some(*n as f64),
        Value::Real(x) => Some(*x),
        Value::Text(_) => None,
    }
}

pub(crate) type Places = Vec<Vec<(usize, usize)>>;

/// Puts connected ports into `opened`; the source of each input as (fmu, place among its outputs).
pub(crate) fn connect(s: &System, opened: &mut [Opened], notes: &mut Vec<String>) -> Result<Places> {
    let mut feeds: Places = vec![Vec::new(); opened.len()];
    for c in &s.connect {
        let (a, from) = find(s, opened, &c.from)?;
        let (b, to) = find(s, opened, &c.to)?;
        let (from, to) = (from.clone(), to.clone());
        if to.causality != Causality::Input {
            let names = opened[b].description().names(Causality::Input).join(", ");
            return Err(s.at(c.to.span(), &format!("{} is no input; {} has {names}", c.to.get_ref(), opened[b].name)));
        }
        if matches!(from.causality, Causality::Input | Causality::Independent) {
            let names = opened[a].description().names(Causality::Output).join(", ");
            return Err(
                s.at(c.from.span(), &format!("{} is no output; {} has {names}", c.from.get_ref(), opened[a].name))
            );
        }
        if !fits(from.kind, to.kind) {
            let what = format!(
                "{} is a {:?} and {} a {:?}, which cannot hold it; connect it to an input that can",
                c.from.get_ref(),
                from.kind,
                c.to.get_ref(),
                to.kind
            );
            return Err(s.at(c.to.span(), &what));
        }
        let reals = from.kind == Kind::Real && to.kind == Kind::Real;
        if !reals && (c.factor != 1.0 || c.offset != 0.0) {
            let what =
                format!("{} and {} are not both Reals; leave factor and offset out", c.from.get_ref(), c.to.get_ref());
            return Err(s.at(c.to.span(), &what));
        }
        if !c.map.is_empty() && (from.kind == Kind::Real || from.kind == Kind::String) {
            let what = format!("{} is a {:?}, whose values have no map; leave it out", c.from.get_ref(), from.kind);
            return Err(s.at(c.from.span(), &what));
        }
        if opened[b].inputs.iter().any(|i| i.name == to.name) {
            return Err(s.at(c.to.span(), &format!("{} is connected twice; leave one connection out", c.to.get_ref())));
        }
        let map = mapped(c, &from, &to).map_err(|e| s.at(c.from.span(), &format!("map: {e}")))?;
        let (mut factor, mut offset) = (1.0, 0.0);
        if reals && !c.suppress_unit_conversion {
            let found = conversion((opened[a].description(), &from), (opened[b].description(), &to));
            (factor, offset) = found.unwrap_or_else(|why| {
                notes.push(format!(
                    "{} -> {}: their units are {why}: the number goes as it is; define both, or write \
                     suppress_unit_conversion = true where that is right",
                    c.from.get_ref(),
                    c.to.get_ref()
                ));
                (1.0, 0.0)
            });
        }
        let unnamed = |(_, n): &&(String, i32)| to.items.iter().all(|i| i.1 != *n);
        if from.kind == Kind::Enumeration && to.kind == Kind::Enumeration && map.is_empty() {
            if let Some((item, n)) = from.items.iter().find(unnamed) {
                let (a, b) = (c.from.get_ref(), c.to.get_ref());
                notes.push(format!("{a} -> {b}: {item} is {n}, which {b} has no item for; give the connection a map"));
            }
        }
        let at = place(&mut opened[a].outputs, from);
        let feed = Feed { source: 0, factor: c.factor * factor, offset: c.factor * offset + c.offset };
        opened[b].inputs.push(Input {
            name: to.name.clone(),
            reference: to.value_reference,
            kind: to.kind,
            feed,
            held: !reals,
            map,
        });
        feeds[b].push((a, at));
    }
    Ok(feeds)
}

/// What the system sets beyond the least and largest values that the FMUs declare.
pub(crate) fn beyond_bounds(s: &System, opened: &[Opened]) -> Vec<String> {
    let mut notes = Vec::new();
    for (c, o) in s.fmu.iter().zip(opened) {
        for (name, value) in &c.set {
            let number = plain_number(value.get_ref());
            let (Some(v), Some(x)) = (o.description().variable(name), number) else { continue };
            let (least, most) = v.bounds;
            let unit = v.unit.as_deref().map_or(String::new(), |u| format!(" {u}"));
            let limit = match () {
                () if least.is_some_and(|l| x < l) => least.map(|l| format!("at least {l}")),
                () if most.is_some_and(|m| x > m) => most.map(|m| format!("at most {m}")),
                () => None,
            };
            if let Some(limit) = limit {
                notes.push(format!("{}.{name} = {x}{unit}: the FMU declares {limit}{unit}", o.name));
            }
        }
    }
    notes
}

/// The relative tolerance that an FMU is given: its own in the system, the master's, or what its description says.
pub(crate) fn tolerance_of(s: &System, c: &Component, d: &Description) -> Option<f64> {
    c.tolerance.or(s.master.tolerance).or(d.tolerance).filter(|t| *t > 0.0)
}

/// A step that divides a span into some 500 to 1000: 1, 2 or 5 of a power of ten.
fn some_step(span: f64) -> f64 {
    let least = span / 1000.0;
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power).find(|h| *h >= least * (1.0 - 1e-9)).unwrap_or(least)
}

fn options(s: &System, opened: &[Opened], notes: &mut Vec<String>) -> Result<Options> {
    let m = &s.master;
    let wrong = |v: &Spanned<String>, may: &str| s.at(v.span(), &format!("{:?}: give {may}", v.get_ref()));
    let method = match m.method.get_ref().as_str() {
        "gauss-seidel" => Method::GaussSeidel,
        "jacobi" => Method::Jacobi,
        "implicit" => Method::Implicit,
        "iterated" => Method::Iterated,
        _ => return Err(wrong(&m.method, "gauss-seidel, jacobi, implicit or iterated")),
    };
    let inputs = match m.inputs.as_ref().map(|v| (v, v.get_ref().as_str())) {
        None | Some((_, "held")) => Inputs::Held,
        Some((_, "extrapolated")) => Inputs::Extrapolated,
        Some((v, _)) => return Err(wrong(v, "held or extrapolated")),
    };
    let shape = match m.shape.as_ref().map(|v| (v, v.get_ref().as_str())) {
        None if method == Method::Implicit => Shape::Mean,
        None | Some((_, "cubic")) => Shape::Cubic,
        Some((_, "mean")) => Shape::Mean,
        Some((_, "linear")) => Shape::Linear,
        Some((v, _)) => return Err(wrong(v, "mean, linear or cubic")),
    };
    let preferred = || {
        let all = opened.iter().filter_map(|o| o.description().step_size).filter(|h| *h > 0.0);
        all.fold(f64::INFINITY, f64::min)
    };
    let d = Options::default();
    let file = s.path.display();
    let good = |ok: bool, what: &str| if ok { Ok(()) } else { Err(anyhow!("{file}: [master] {what}")) };
    good(m.start.is_finite() && m.stop.is_finite() && m.stop > m.start, "stop: give a time after start, in s")?;
    let mut step = m.step.unwrap_or_else(preferred);
    // an archive has no place of the standard's own for a step
    if m.step.is_none() && !step.is_finite() && s.text.is_empty() {
        step = some_step(m.stop - m.start);
        notes.push(format!("no step is given and no FMU prefers one: {step} s is taken; give another with --step"));
    }
    good(step.is_finite() && step > 0.0, "step: give one above 0, in s (or --step); no FMU prefers any")?;
    let of_fmus = s.fmu.iter().filter_map(|c| c.tolerance).chain(m.tolerance);
    good(of_fmus.into_iter().all(|t| t > 0.0 && t < 1.0), "tolerance: give a number between 0 and 1")?;
    let tolerance = m.iteration_tolerance.unwrap_or(d.tolerance);
    good(tolerance > 0.0 && tolerance < 1.0, "iteration_tolerance: give a number between 0 and 1")?;
    let (adapt, shortest, longest) = match m.adapt {
        None => (None, None, None),
        Some(AdaptBy::Energy { tolerance, floor, shortest, longest }) => {
            (Some(Adapt::Energy { tolerance, floor: floor.max(0.0) }), shortest, longest)
        }
        Some(AdaptBy::Doubling { tolerance, shortest, longest }) => {
            (Some(Adapt::Doubling { tolerance }), shortest, longest)
        }
    };
    if let Some(Adapt::Energy { tolerance, .. } | Adapt::Doubling { tolerance }) = adapt {
        good(tolerance > 0.0 && tolerance < 1.0, "adapt.tolerance: give a number between 0 and 1")?;
        let watched = !s.bond.is_empty() || matches!(adapt, Some(Adapt::Doubling { .. }));
        good(watched, "adapt by energy: give a [[bond]] to watch")?;
    }
    Ok(Options {
        method,
        inputs,
        shape,
        start: m.start,
        stop: m.stop,
        step,
        adapt,
        shortest: shortest.unwrap_or(1e-9 * step),
        longest: longest.unwrap_or(f64::INFINITY),
        tolerance,
        iterations: m.iterations.unwrap_or(d.iterations).max(1),
        ..d
    })
}

fn columns(s: &System, opened: &[Opened]) -> Result<Vec<Column>> {
    let column = |k: usize, v: &Variable| Column {
        head: match &v.unit {
            Some(u) => format!("{}.{} [{u}]", opened[k].name, v.name),
            None => format!("{}.{}", opened[k].name, v.name),
        },
        part: k,
        kind: v.kind,
        reference: v.value_reference,
    };
    let outputs = |k: usize| {
        let all = opened[k].description().variables.iter();
        all.filter(|v| v.causality == Causality::Output && v.kind != Kind::String)
    };
    let mut columns: Vec<Column> = Vec::new();
    if s.results.record.is_empty() {
        for k in 0..opened.len() {
            columns.extend(outputs(k).map(|v| column(k, v)));
        }
    }
    for r in &s.results.record {
        match r.get_ref().strip_suffix(".*") {
            Some(fmu) => {
                let Some(k) = opened.iter().position(|o| o.name == fmu) else {
                    return Err(s.at(r.span(), &no_fmu(fmu, opened)));
                };
                columns.extend(outputs(k).map(|v| column(k, v)));
            }
            None => {
                let (k, v) = find(s, opened, r)?;
                if v.kind == Kind::String {
                    let what = format!("{} is a String, and results are numbers; leave it out", r.get_ref());
                    return Err(s.at(r.span(), &what));
                }
                columns.push(column(k, v));
            }
        }
    }
    let mut seen = std::collections::HashSet::new();
    columns.retain(|c| seen.insert(c.head.clone()));
    Ok(columns)
}

/// Makes an instance, sets what the file sets and enters initialization.
fn initialize(s: &System, c: &Component, o: &Opened, options: &Options) -> Result<FmuSlave> {
    let refuse = |e: anyhow::Error| s.within(c.name.span(), e);
    let mut i = made(s, c, o)?;
    set_all(s, c, o, &mut i)?;
    i.setup_experiment(tolerance_of(s, c, o.description()), options.start, None).map_err(|e| refuse(e.into()))?;
    i.enter_initialization().map_err(|e| refuse(e.into()))?;
    Ok(FmuSlave::new(i, c.input_orders))
}

/// Makes an instance that logs what the file asks for.
pub(crate) fn made(s: &System, c: &Component, o: &Opened) -> Result<Instance> {
    let refuse = |e: anyhow::Error| s.within(c.name.span(), e);
    let mut i = o.fmu.instantiate(&o.name, false).map_err(|e| refuse(e.into()))?;
    if !c.log.is_empty() {
        let known = &o.description().log_categories;
        if let Some(n) = c.log.iter().find(|n| !known.contains(n)) {
            let (all, meant) = (known.join(", "), meant(n, known));
            return Err(refuse(anyhow!("log: {n} is no category of {}; give some of {all}{meant}", o.name)));
        }
        let names: Vec<&str> = c.log.iter().map(String::as_str).collect();
        i.set_debug_logging(true, &names).map_err(|e| refuse(e.into()))?;
    }
    Ok(i)
}

/// Sets what the file sets.
pub(crate) fn set_all(s: &System, c: &Component, o: &Opened, i: &mut Instance) -> Result<()> {
    for (name, value) in &c.set {
        let Some(v) = o.description().variable(name) else {
            let names = o.description().names(Causality::Parameter);
            let (all, meant) = (names.join(", "), meant(name, &names));
            return Err(
                s.at(value.span(), &format!("{} has no variable {name}; its parameters are {all}{meant}", o.name))
            );
        };
        if matches!(v.causality, Causality::Output | Causality::CalculatedParameter | Causality::Independent) {
            return Err(s.at(value.span(), &format!("{name} of {} is an {:?} and cannot be set", o.name, v.causality)));
        }
        set(i, v, value.get_ref()).map_err(|e| s.within(value.span(), e))?;
    }
    Ok(())
}

/// Sets a variable of any kind.
fn set(i: &mut Instance, v: &Variable, value: &Value) -> Result<()> {
    let r = [v.value_reference];
    match (v.kind, value) {
        (Kind::Real, Value::Real(x)) => i.set_real(&r, &[*x])?,
        (Kind::Real, Value::Integer(n)) => i.set_real(&r, &[*n as f64])?,
        (Kind::Integer | Kind::Enumeration, Value::Integer(n)) => {
            let n = i32::try_from(*n).map_err(|_| anyhow!("{} = {n} is beyond an Integer", v.name))?;
            i.set_integer(&r, &[n])?;
        }
        (Kind::Integer | Kind::Enumeration, Value::Real(x)) if x.fract() == 0.0 && x.abs() < 2e9 => {
            i.set_integer(&r, &[*x as i32])?;
        }
        (Kind::Enumeration, Value::Text(name)) => i.set_integer(&r, &[v.item(name).map_err(|e| anyhow!(e))?])?,
        (Kind::Boolean, Value::Integer(n @ (0 | 1))) => i.set_boolean(&r, &[*n == 1])?,
        (Kind::Boolean, Value::Boolean(b)) => i.set_boolean(&r, &[*b])?,
        (Kind::String, Value::Text(t)) => i.set_string(&r, &[t])?,
        (kind, value) => return Err(anyhow!("{} is of type {kind:?} and cannot be {value:?}", v.name)),
    }
    Ok(())
}
