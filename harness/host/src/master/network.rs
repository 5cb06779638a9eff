//! Slaves and their connections: the order to step them in, and algebraic loops.

use super::slave::Slave;
use crate::Kind;
use anyhow::{bail, ensure, Result};
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Share of its size to which an algebraic loop is solved.
const LOOP_TOLERANCE: f64 = 1e-12;
/// Most Newton steps for an algebraic loop.
const LOOP_STEPS: usize = 50;
/// Share of a value by which it moves for a difference: the cube root of the rounding.
const NUDGE: f64 = 6.055e-6;

/// Where an input comes from: value = factor * output + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feed {
    /// Global output.
    pub source: usize,
    /// Factor, units included.
    pub factor: f64,
    /// Offset, in the input's unit.
    pub offset: f64,
}

impl Feed {
    #[inline]
    pub(crate) fn of(&self, y: &[f64]) -> f64 {
        self.factor * y[self.source] + self.offset
    }
}

/// What values of a source become on their way to an input: (value, value instead). What is not listed stays.
pub type Map = Vec<(f64, f64)>;

/// A connected input.
#[derive(Clone, Debug)]
pub struct Input {
    /// Name.
    pub name: String,
    /// The slave's reference.
    pub reference: u32,
    /// Its type.
    pub kind: Kind,
    /// Its source.
    pub feed: Feed,
    /// Whether it changes from one communication point to the next at once, as what is no Real at either end does:
    /// masters then hold it over a step, and neither extrapolate it nor iterate for it.
    pub held: bool,
    /// What values become instead; empty: what they are.
    pub map: Map,
}

impl Input {
    /// A Real fed by a Real.
    pub fn real(name: &str, reference: u32, feed: Feed) -> Input {
        Input { name: name.into(), reference, kind: Kind::Real, feed, held: false, map: Map::new() }
    }

    /// What becomes of a value that its feed gives.
    fn taken(&self, value: f64) -> f64 {
        self.map.iter().find(|m| m.0 == value).map_or(value, |m| m.1)
    }
}

/// A connected output.
#[derive(Clone, Debug)]
pub struct Output {
    /// Name.
    pub name: String,
    /// The slave's reference.
    pub reference: u32,
    /// Its type. Values of other types than Real are numbers here too: 0 and 1 of a Boolean, of a String its place among
    /// the texts that were read.
    pub kind: Kind,
    /// Places among the part's inputs that it depends on at once.
    pub depends: Vec<usize>,
}

impl Output {
    /// A Real.
    pub fn real(name: &str, reference: u32, depends: Vec<usize>) -> Output {
        Output { name: name.into(), reference, kind: Kind::Real, depends }
    }
}

/// Texts that were read, each once.
#[derive(Default)]
struct Texts {
    all: Vec<String>,
    places: HashMap<String, usize>,
}

impl Texts {
    fn place(&mut self, text: String) -> f64 {
        let next = self.all.len();
        let at = *self.places.entry(text.clone()).or_insert(next);
        if at == next {
            self.all.push(text);
        }
        at as f64
    }

    /// The text at a place; empty before one was read.
    fn at(&self, place: f64) -> &str {
        self.all.get(place as usize).map_or("", String::as_str)
    }
}

/// A slave with its connected ports. Outputs are numbered through all parts, in order: the global outputs.
pub struct Part {
    /// Name.
    pub name: String,
    /// Slave.
    pub slave: Box<dyn Slave>,
    /// Connected inputs.
    pub inputs: Vec<Input>,
    /// Outputs that are connected or watched.
    pub outputs: Vec<Output>,
}

/// What was done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Calls of fmi2DoStep, all slaves together.
    pub steps: u64,
}

/// Slaves, connected.
pub struct Network {
    /// Parts in the order given.
    pub parts: Vec<Part>,
    /// Work done.
    pub work: Work,
    /// First global output of each part.
    pub(super) first: Vec<usize>,
    /// Part of each global output.
    pub(super) owner: Vec<usize>,
    /// Parts in the order they are stepped.
    pub(super) order: Vec<usize>,
    /// Place of each part in that order.
    place: Vec<usize>,
    /// Groups of global outputs in the order they can be computed; more than one, or one that depends on itself, is
    /// an algebraic loop.
    groups: Vec<Vec<usize>>,
    /// Global outputs that feed parts stepped before them, or at the same time.
    pub(super) torn: Vec<usize>,
    /// Whether such an output feeds through to another at once.
    pub(super) reread: bool,
    /// Highest order of input derivatives each part was ever given: from then on it gets them at every step.
    pub(super) derivative_orders: Vec<usize>,
    /// Whether each global output is a Real.
    pub(super) real: Vec<bool>,
    texts: Texts,
}

/// Strongly connected components in reverse topological order of `next` (Tarjan 1972), without recursion's depth
/// being a concern: networks are small.
pub(crate) fn components(next: &[Vec<usize>]) -> Vec<Vec<usize>> {
    struct Search<'a> {
        next: &'a [Vec<usize>],
        index: Vec<usize>,
        low: Vec<usize>,
        on: Vec<bool>,
        stack: Vec<usize>,
        count: usize,
        found: Vec<Vec<usize>>,
    }
    impl Search<'_> {
        fn visit(&mut self, v: usize) {
            self.count += 1;
            self.index[v] = self.count;
            self.low[v] = self.count;
            self.stack.push(v);
            self.on[v] = true;
            for i in 0..self.next[v].len() {
                let w = self.next[v][i];
                if self.index[w] == 0 {
                    self.visit(w);
                    self.low[v] = self.low[v].min(self.low[w]);
                } else if self.on[w] {
                    self.low[v] = self.low[v].min(self.index[w]);
                }
            }
            if self.low[v] == self.index[v] {
                let mut group = Vec::new();
                while let Some(w) = self.stack.pop() {
                    self.on[w] = false;
                    group.push(w);
                    if w == v {
                        break;
                    }
                }
                group.sort_unstable();
                self.found.push(group);
            }
        }
    }
    let n = next.len();
    let mut s = Search {
        next,
        index: vec![0; n],
        low: vec![0; n],
        on: vec![false; n],
        stack: Vec::new(),
        count: 0,
        found: Vec::new(),
    };
    for v in 0..n {
        if s.index[v] == 0 {
            s.visit(v);
        }
    }
    s.found
}

impl Network {
    /// Connects parts, stepped in dependency order: a part whose outputs follow its inputs at once comes after those
    /// it is fed by; otherwise as given.
    ///
    /// # Errors
    /// A source that is none.
    pub fn new(parts: Vec<Part>) -> Result<Network> {
        let mut first = Vec::new();
        let mut owner = Vec::new();
        for (k, p) in parts.iter().enumerate() {
            first.push(owner.len());
            owner.extend(p.outputs.iter().map(|_| k));
        }
        // what each global output depends on at once
        let mut depends: Vec<Vec<usize>> = Vec::new();
        for p in &parts {
            for i in &p.inputs {
                ensure!(
                    i.feed.source < owner.len(),
                    "{}.{}: fed by output {}, which is none",
                    p.name,
                    i.name,
                    i.feed.source
                );
            }
            for o in &p.outputs {
                depends.push(o.depends.iter().map(|&i| p.inputs[i].feed.source).collect());
            }
        }
        let groups = components(&depends);
        let mut after: Vec<Vec<usize>> = vec![Vec::new(); parts.len()];
        for (o, sources) in depends.iter().enumerate() {
            for s in sources {
                if owner[*s] != owner[o] && !after[owner[o]].contains(&owner[*s]) {
                    after[owner[o]].push(owner[*s]);
                }
            }
        }
        let order: Vec<usize> = components(&after).into_iter().flatten().collect();
        let mut place = vec![0; parts.len()];
        for (n, k) in order.iter().enumerate() {
            place[*k] = n;
        }
        let derivative_orders = vec![0; parts.len()];
        let real = parts.iter().flat_map(|p| &p.outputs).map(|o| o.kind == Kind::Real).collect();
        let mut n = Network {
            parts,
            work: Work::default(),
            first,
            owner,
            order,
            place,
            groups,
            torn: vec![],
            reread: false,
            derivative_orders,
            real,
            texts: Texts::default(),
        };
        n.tear();
        Ok(n)
    }

    /// Steps parts in an order of the user's own instead.
    ///
    /// # Errors
    /// Not every part once.
    pub fn set_order(&mut self, order: Vec<usize>) -> Result<()> {
        let mut sorted = order.clone();
        sorted.sort_unstable();
        ensure!(sorted == (0..self.parts.len()).collect::<Vec<_>>(), "the order has to name every FMU once");
        for (n, k) in order.iter().enumerate() {
            self.place[*k] = n;
        }
        self.order = order;
        self.tear();
        Ok(())
    }

    fn tear(&mut self) {
        self.torn.clear();
        self.reread = false;
        for (k, p) in self.parts.iter().enumerate() {
            for (i, input) in p.inputs.iter().enumerate() {
                let s = input.feed.source;
                if self.place[self.owner[s]] >= self.place[k] {
                    if !input.held && !self.torn.contains(&s) {
                        self.torn.push(s);
                    }
                    self.reread |= p.outputs.iter().any(|o| o.depends.contains(&i));
                }
            }
        }
        self.torn.sort_unstable();
    }

    /// Names of the parts in the order they are stepped.
    pub fn stepping_order(&self) -> Vec<&str> {
        self.order.iter().map(|&k| self.parts[k].name.as_str()).collect()
    }

    /// Name of a global output, `part.output`.
    pub fn output_name(&self, y: usize) -> String {
        let k = self.owner[y];
        format!("{}.{}", self.parts[k].name, self.parts[k].outputs[y - self.first[k]].name)
    }

    /// The algebraic loops there are, each as the names of its outputs.
    pub fn loops(&self) -> Vec<Vec<String>> {
        let itself = |g: &Vec<usize>| g.len() > 1 || self.depends_on(g[0]).any(|s| s == g[0]);
        self.groups.iter().filter(|g| itself(g)).map(|g| g.iter().map(|&y| self.output_name(y)).collect()).collect()
    }

    fn depends_on(&self, y: usize) -> impl Iterator<Item = usize> + '_ {
        let k = self.owner[y];
        let p = &self.parts[k];
        p.outputs[y - self.first[k]].depends.iter().map(move |&i| p.inputs[i].feed.source)
    }

    /// Number of global outputs.
    pub fn count(&self) -> usize {
        self.owner.len()
    }

    /// Sets all inputs of a part from `y`.
    pub(super) fn feed(&mut self, k: usize, y: &[f64]) -> Result<()> {
        if self.parts[k].inputs.is_empty() {
            return Ok(());
        }
        let values: Vec<f64> = self.parts[k].inputs.iter().map(|i| i.feed.of(y)).collect();
        self.put(k, &values)
    }

    /// Sets all inputs of a part to what their feeds give.
    pub(super) fn put(&mut self, k: usize, values: &[f64]) -> Result<()> {
        let Part { slave, inputs, .. } = &mut self.parts[k];
        if inputs.iter().all(|i| i.kind == Kind::Real && i.map.is_empty()) {
            let references: Vec<u32> = inputs.iter().map(|i| i.reference).collect();
            return slave.set(&references, values);
        }
        let mut reals = (Vec::new(), Vec::new());
        for (i, value) in inputs.iter().zip(values) {
            let value = i.taken(*value);
            match i.kind {
                Kind::Real => {
                    reals.0.push(i.reference);
                    reals.1.push(value);
                }
                Kind::String => slave.set_text(i.reference, self.texts.at(value))?,
                kind => slave.set_number(kind, i.reference, value)?,
            }
        }
        if reals.0.is_empty() {
            return Ok(());
        }
        slave.set(&reals.0, &reals.1)
    }

    /// Reads all outputs of a part into `y`.
    pub(super) fn read(&mut self, k: usize, y: &mut [f64]) -> Result<()> {
        let (first, p) = (self.first[k], &mut self.parts[k]);
        if p.outputs.iter().all(|o| o.kind == Kind::Real) {
            if p.outputs.is_empty() {
                return Ok(());
            }
            let references: Vec<u32> = p.outputs.iter().map(|o| o.reference).collect();
            return p.slave.get(&references, &mut y[first..first + references.len()]);
        }
        for place in 0..p.outputs.len() {
            y[first + place] = self.one(k, place)?;
        }
        Ok(())
    }

    /// Reads one output of a part.
    fn one(&mut self, k: usize, place: usize) -> Result<f64> {
        let Part { slave, outputs, .. } = &mut self.parts[k];
        let o = &outputs[place];
        match o.kind {
            Kind::Real => {
                let mut value = [0.0];
                slave.get(&[o.reference], &mut value)?;
                Ok(value[0])
            }
            Kind::String => Ok(self.texts.place(slave.text(o.reference)?)),
            kind => slave.read(kind, o.reference),
        }
    }

    /// Makes every output answer to every input at one instant: in dependency order, algebraic loops solved by
    /// Newton's method.
    ///
    /// # Errors
    /// Where a slave refuses; where a loop has no solution near: names it.
    pub fn propagate(&mut self, y: &mut [f64]) -> Result<()> {
        for g in 0..self.groups.len() {
            let group = self.groups[g].clone();
            let loops = group.len() > 1 || self.depends_on(group[0]).any(|s| s == group[0]);
            if loops {
                self.solve(&group, y)?;
            } else {
                y[group[0]] = self.answer(group[0], y)?;
            }
        }
        Ok(())
    }

    /// A global output from the values it depends on.
    fn answer(&mut self, o: usize, y: &[f64]) -> Result<f64> {
        let k = self.owner[o];
        let place = o - self.first[k];
        if !self.parts[k].outputs[place].depends.is_empty() {
            self.feed(k, y)?;
        }
        self.one(k, place)
    }

    fn residual(&mut self, group: &[usize], y: &[f64]) -> Result<DVector<f64>> {
        let mut r = DVector::zeros(group.len());
        for (i, &o) in group.iter().enumerate() {
            r[i] = self.answer(o, y)? - y[o];
        }
        Ok(r)
    }

    /// Answers of a group in turn until a round changes none: then it was a loop by declaration alone, as of FMUs that
    /// declare no dependencies. As many rounds as outputs settle any such group; where they do not, `y` is left as it was.
    fn settles(&mut self, group: &[usize], y: &mut [f64]) -> Result<bool> {
        let before = y.to_vec();
        for _ in 0..=group.len() {
            let mut changed = false;
            for &o in group {
                let value = self.answer(o, y)?;
                if !value.is_finite() {
                    y.copy_from_slice(&before);
                    return Ok(false);
                }
                changed |= value != y[o];
                y[o] = value;
            }
            if !changed {
                return Ok(true);
            }
        }
        y.copy_from_slice(&before);
        Ok(false)
    }

    fn solve(&mut self, group: &[usize], y: &mut [f64]) -> Result<()> {
        // Newton's differences see little of a force that depends on a penetration some 1e7 times smaller
        if self.settles(group, y)? {
            return Ok(());
        }
        let n = group.len();
        let names = |s: &Self| group.iter().map(|&o| s.output_name(o)).collect::<Vec<_>>().join(", ");
        ensure!(
            group.iter().all(|&o| self.real[o]),
            "algebraic loop of {}: not all of it are Reals, and it does not settle; break it by a part that answers by \
             steps",
            names(self)
        );
        let mut r = self.residual(group, y)?;
        for _ in 0..LOOP_STEPS {
            let small =
                group.iter().enumerate().all(|(i, &o)| r[i].abs() <= LOOP_TOLERANCE * (y[o].abs() + r[i].abs()));
            if small || r.amax() == 0.0 {
                return Ok(());
            }
            // one size for all: a value of zero in a loop of ones has to move too
            let size = group.iter().fold(r.amax(), |a, &o| a.max(y[o].abs()));
            let mut j = DMatrix::zeros(n, n);
            for (c, &o) in group.iter().enumerate() {
                let kept = y[o];
                let d = NUDGE * size;
                y[o] = kept + d;
                let up = self.residual(group, y)?;
                y[o] = kept - d;
                let down = self.residual(group, y)?;
                y[o] = kept;
                j.set_column(c, &((up - down) / (2.0 * d)));
            }
            let Some(step) = j.lu().solve(&-&r) else {
                bail!(
                    "algebraic loop of {}: it fixes no values (its matrix is singular); break it by a part that \
                       answers by steps",
                    names(self)
                );
            };
            // halve the step until the residual falls
            let (from, size) = (y.to_vec(), r.amax());
            let mut share = 1.0;
            loop {
                for (i, &o) in group.iter().enumerate() {
                    y[o] = from[o] + share * step[i];
                }
                r = self.residual(group, y)?;
                if r.amax() < size || share < 1e-6 {
                    break;
                }
                share *= 0.5;
            }
            if r.amax() >= size {
                // no way down: rounding, or no solution
                let scale = group.iter().fold(0.0f64, |a, &o| a.max(from[o].abs()));
                if size <= 1e-9 * scale {
                    y.copy_from_slice(&from);
                    return Ok(());
                }
                break;
            }
        }
        bail!("algebraic loop of {}: no solution found; break it by a part that answers by steps", names(self))
    }

    /// Saves every slave's state in a slot.
    pub(super) fn save(&mut self, slot: usize) -> Result<()> {
        self.parts.iter_mut().try_for_each(|p| p.slave.save(slot))
    }

    /// Takes every slave back to a slot.
    pub(super) fn restore(&mut self, slot: usize) -> Result<()> {
        self.parts.iter_mut().try_for_each(|p| p.slave.restore(slot))
    }
}
