//! Makes a network of what a user wrote.

use super::network::{Feed, Input, Network, Output, Part};
use super::options::{Adapt, Bond, Inputs, Lookahead, Method, Options, Shape, Touch};
use super::slave::FmuSlave;
use super::system::{AdaptBy, Component, System};
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
    fmus: Vec<Fmu>,
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
    let mut notes = Vec::new();
    let feeds = connect(s, &mut opened, &mut notes)?;
    let mut options = options(s, &opened)?;
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

/// (factor, offset) that takes a value in the source's unit to the sink's, where both are defined; a note where they
/// are of different kinds.
fn conversion(from: (&Description, &Variable), to: (&Description, &Variable)) -> Result<(f64, f64), String> {
    let unit = |(d, v): (&Description, &Variable)| v.unit.as_ref().and_then(|u| d.units.get(u)).cloned();
    let (Some(a), Some(b)) = (unit(from), unit(to)) else { return Ok((1.0, 0.0)) };
    if a.exponents != b.exponents {
        return Err(format!(
            "{} is in {}, {} in {}, which are of different kinds",
            from.1.name,
            from.1.unit.as_deref().unwrap_or("1"),
            to.1.name,
            to.1.unit.as_deref().unwrap_or("1")
        ));
    }
    Ok((a.factor / b.factor, (a.offset - b.offset) / b.factor))
}

pub(crate) type Places = Vec<Vec<(usize, usize)>>;

/// Puts connected ports into `opened`; the source of each input as (fmu, place among its outputs).
pub(crate) fn connect(s: &System, opened: &mut [Opened], notes: &mut Vec<String>) -> Result<Places> {
    let mut feeds: Places = vec![Vec::new(); opened.len()];
    for c in &s.connect {
        let (a, from) = find(s, opened, &c.from)?;
        let (b, to) = find(s, opened, &c.to)?;
        let (from, to) = (from.clone(), to.clone());
        if to.causality != Causality::Input || to.kind != Kind::Real {
            let names = opened[b].description().names(Causality::Input).join(", ");
            return Err(
                s.at(c.to.span(), &format!("{} is no Real input; {} has {names}", c.to.get_ref(), opened[b].name))
            );
        }
        if from.kind != Kind::Real || matches!(from.causality, Causality::Input | Causality::Independent) {
            let names = opened[a].description().names(Causality::Output).join(", ");
            return Err(s.at(
                c.from.span(),
                &format!("{} is no Real output; {} has {names}", c.from.get_ref(), opened[a].name),
            ));
        }
        if opened[b].inputs.iter().any(|i| i.name == to.name) {
            return Err(s.at(c.to.span(), &format!("{} is connected twice; leave one connection out", c.to.get_ref())));
        }
        let (factor, offset) = conversion((opened[a].description(), &from), (opened[b].description(), &to))
            .unwrap_or_else(|note| {
                notes.push(format!("{} -> {}: {note}", c.from.get_ref(), c.to.get_ref()));
                (1.0, 0.0)
            });
        let at = place(&mut opened[a].outputs, from);
        let feed = Feed { source: 0, factor: c.factor * factor, offset: c.factor * offset + c.offset };
        opened[b].inputs.push(Input { name: to.name.clone(), reference: to.value_reference, feed });
        feeds[b].push((a, at));
    }
    Ok(feeds)
}

fn options(s: &System, opened: &[Opened]) -> Result<Options> {
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
    let step = m.step.unwrap_or_else(preferred);
    let d = Options::default();
    let file = s.path.display();
    let good = |ok: bool, what: &str| if ok { Ok(()) } else { Err(anyhow!("{file}: [master] {what}")) };
    good(step.is_finite() && step > 0.0, "step: give one above 0, in s; no FMU prefers any")?;
    good(m.start.is_finite() && m.stop.is_finite() && m.stop > m.start, "stop: give a time after start, in s")?;
    let tolerance = m.tolerance.unwrap_or(d.tolerance);
    good(tolerance > 0.0 && tolerance < 1.0, "tolerance: give a number between 0 and 1")?;
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
    i.setup_experiment(None, options.start, None).map_err(|e| refuse(e.into()))?;
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
        (Kind::Boolean, Value::Boolean(b)) => i.set_boolean(&r, &[*b])?,
        (Kind::String, Value::Text(t)) => i.set_string(&r, &[t])?,
        (kind, value) => return Err(anyhow!("{} is of type {kind:?} and cannot be {value:?}", v.name)),
    }
    Ok(())
}
