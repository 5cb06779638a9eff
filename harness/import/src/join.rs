//! Channels of one recording that lie in several groups of a file, or go by several times in one: each keeps its clock. Those
//! of one clock are put side by side; of others the one with the shortest steps is the recording's, and readings between the
//! samples of the rest lie on the line from one to the next. Rows are never paired across clocks.
//!
//! Every clock but the recording's is read by a thread of its own, which opens the file again: so memory does not grow with
//! the file, however far apart two clocks are.

use crate::amount::brief;
use crate::guess::{columns, Columns, Taken};
use crate::map::Mapped;
use crate::words::{timed, Role, Says};
use crate::{Open, Options};
use instruments::{Channel as Named, Clock, Fault, Group, Sink, Source};
use record::Channel;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{sync_channel, Receiver, SyncSender};

/// Share of a step within which a sample stands for an instant as it is.
const AT: f64 = 1e-6;
/// Blocks that wait between two threads.
const WAITING: usize = 2;

/// Where the times of channels are from.
#[derive(Clone, Debug, PartialEq)]
enum Timer {
    Steps(Clock),
    Column(Taken),
}

/// Channels of one clock.
#[derive(Clone, Debug)]
struct Strand {
    /// Its group in the file.
    group: usize,
    timer: Timer,
    values: Vec<Taken>,
    span: Span,
    /// Its channel is read in few of the rows, every so often: those rows alone are its samples.
    sparse: bool,
}

/// The times of a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    first: f64,
    last: f64,
    samples: u64,
    /// Whether a time lies before the one above it.
    back: bool,
    /// Two strands of one sum have the same times in all rows.
    sum: u64,
    /// Most rows from one sample to the next.
    apart: u64,
}

/// Rows from one reading of a channel to its next from which on blank cells are no readings that were lost.
const SPARSE: u64 = 2;
/// Times that many rows that a channel which is read every so often may be without one.
const LATE: u64 = 2;

impl Span {
    fn step(&self) -> f64 {
        (self.last - self.first) / (self.samples.max(2) - 1) as f64
    }

    fn overlaps(&self, other: &Span) -> bool {
        self.first < other.last && other.first < self.last
    }

    /// Whether these readings stand in few of the rows of `all`, every so often: a channel that is read more slowly than another of
    /// the table.
    fn is_sparse_in(&self, all: &Span) -> bool {
        self.samples > 1
            && all.samples >= SPARSE * self.samples
            && self.apart <= LATE * all.samples.div_ceil(self.samples)
    }

    /// Whether both have the same instants, row by row.
    fn is_one_with(&self, other: &Span) -> bool {
        (self.sum, self.samples) == (other.sum, other.samples)
    }
}

/// Channels of several clocks or groups as one table.
#[derive(Clone, Debug)]
struct Joint {
    group: Group,
    columns: Columns,
    strands: Vec<Strand>,
    /// The strand whose clock is the table's.
    main: usize,
}

/// A group as the import sees it.
#[derive(Clone, Debug)]
enum Made {
    /// As the file has it.
    As(usize),
    Of(Box<Joint>),
}

/// The groups of a file, some of them joined.
#[derive(Clone, Debug)]
pub struct Joined {
    made: Vec<Made>,
    /// As the file has them.
    pub originals: Vec<Group>,
    /// What was joined or resampled.
    pub notes: Vec<String>,
}

impl Joined {
    /// The columns of the `i`-th group, where it was joined.
    pub fn columns(&self, i: usize) -> Option<&Columns> {
        match &self.made[i] {
            Made::As(_) => None,
            Made::Of(j) => Some(&j.columns),
        }
    }

    fn group(&self, i: usize) -> &Group {
        match &self.made[i] {
            Made::As(g) => &self.originals[*g],
            Made::Of(j) => &j.group,
        }
    }
}

/// A group's channels that may be of a recording with those of others.
struct Candidate {
    group: usize,
    strands: Vec<Strand>,
    left: Vec<(String, String)>,
}

impl Candidate {
    fn roles(&self) -> impl Iterator<Item = Role> + '_ {
        self.strands.iter().flat_map(|s| &s.values).map(|v| v.role)
    }
}

/// Whether a group is meant, where `--map` names channels.
pub(crate) fn meant(group: &Group, map: &[Mapped]) -> bool {
    let mut named = map.iter().filter(|m| m.role != Role::Time).peekable();
    named.peek().is_none() || named.any(|m| m.column(group).is_some())
}

/// What of a file is to be joined. It is read for times where there is more than one clock.
///
/// # Errors
/// Where the file cannot be read, or clocks contradict each other.
pub fn plan(source: &mut dyn Source, o: &Options) -> Result<Joined, String> {
    let originals = source.groups().to_vec();
    let as_it_is = |originals: Vec<Group>| Joined {
        made: (0..originals.len()).map(Made::As).collect(),
        originals,
        notes: Vec::new(),
    };
    // the user's rate is for rows, and --split-columns says what columns are
    if o.rate.is_some() || o.split_columns {
        return Ok(as_it_is(originals));
    }
    let mut candidates = Vec::new();
    for (i, group) in originals.iter().enumerate() {
        if let Some(c) = candidate(source, &originals, i, group, o)? {
            candidates.push(c);
        }
    }
    let mut made: Vec<Option<Made>> = (0..originals.len()).map(|i| Some(Made::As(i))).collect();
    let mut notes = Vec::new();
    for set in sets(&candidates, &originals) {
        let of: Vec<&Candidate> = set.iter().map(|i| &candidates[*i]).collect();
        let strands: Vec<Strand> = of.iter().flat_map(|c| c.strands.clone()).collect();
        let from_elsewhere = strands.iter().any(|s| matches!(&s.timer, Timer::Column(t) if t.name.is_empty()));
        let own_time = strands.len() == 1 && of.len() == 1 && !from_elsewhere;
        if own_time && first_of_several(&originals[of[0].group], &strands[0], o) {
            continue;
        }
        let joint = joint(&originals, &of, strands, &mut notes)?;
        let Some(joint) = joint else { continue };
        of.iter().for_each(|c| made[c.group] = None);
        // a group that only lent its time
        joint.strands.iter().filter(|s| s.values.is_empty()).for_each(|s| made[s.group] = None);
        made[of[0].group] = Some(Made::Of(Box::new(joint)));
    }
    Ok(Joined { made: made.into_iter().flatten().collect(), originals, notes })
}

/// Whether a group's only strand is what its columns give anyway: its time is the one that would be taken.
fn first_of_several(group: &Group, strand: &Strand, o: &Options) -> bool {
    let Timer::Column(time) = &strand.timer else { return true };
    let Ok(found) = columns(group, &o.map) else { return true };
    found.of(Role::Time).first().is_none_or(|t| t.column == time.column)
}

/// The channels of a group that may be of one recording: at most one of each kind, and each with its time.
fn candidate(
    source: &mut dyn Source,
    originals: &[Group],
    i: usize,
    group: &Group,
    o: &Options,
) -> Result<Option<Candidate>, String> {
    if !meant(group, &o.map) {
        return Ok(None);
    }
    // what is wrong with the map is said where the group is surveyed
    let Ok(found) = columns(group, &o.map) else { return Ok(None) };
    let of = Channel::ALL.map(|c| found.of(Role::Reading(c)));
    if of.iter().any(|c| c.len() > 1) {
        return Ok(None);
    }
    let values: Vec<Taken> = of.iter().flatten().map(|t| (*t).clone()).collect();
    if values.is_empty() {
        return Ok(None);
    }
    let mut times: Vec<&Taken> = found.of(Role::Time);
    let said = times.first().is_some_and(|t| t.why.starts_with("by --map"));
    if let (Some(clock), false) = (group.clock, said) {
        let span = Span {
            first: clock.start,
            last: clock.start + clock.step * (group.samples.max(1) - 1) as f64,
            samples: group.samples,
            back: false,
            sum: sum(sum(0, clock.start), clock.step),
            apart: 1,
        };
        let strands = vec![Strand { group: i, timer: Timer::Steps(clock), values, span, sparse: false }];
        return Ok(Some(Candidate { group: i, strands, left: found.left }));
    }
    if times.is_empty() {
        return elsewhere(source, originals, i, values, found.left, o);
    }
    times.sort_by_key(|t| t.column);
    let own = assigned(&times, &values);
    let mut used: Vec<usize> = own.iter().map(|t| t.column).collect();
    used.sort_unstable();
    used.dedup();
    let of_rows = used.iter().filter_map(|c| times.iter().find(|t| t.column == *c)).map(|t| (*t, None));
    let of_readings = values.iter().zip(&own).map(|(v, t)| (*t, Some(v)));
    let spans = spans(source, i, &of_rows.chain(of_readings).collect::<Vec<_>>())?;
    let (of_rows, of_readings) = spans.split_at(used.len());
    let mut strands: Vec<Strand> = Vec::new();
    for ((value, time), read) in values.into_iter().zip(own).zip(of_readings) {
        let span = of_rows[used.binary_search(&time.column).unwrap_or(0)];
        let timer = Timer::Column(time.clone());
        if read.is_sparse_in(&span) {
            strands.push(Strand { group: i, timer, values: vec![value], span: *read, sparse: true });
            continue;
        }
        match strands.iter_mut().find(|s| s.timer == timer && !s.sparse) {
            Some(s) => s.values.push(value),
            None => strands.push(Strand { group: i, timer, values: vec![value], span, sparse: false }),
        }
    }
    Ok(Some(Candidate { group: i, strands, left: found.left }))
}

/// The time of each channel of a group: the one named after it, else the nearest before it, or behind it where the first channel
/// has none before it, else one each in their order.
fn assigned<'a>(times: &[&'a Taken], values: &[Taken]) -> Vec<&'a Taken> {
    let role = |t: &Taken| match timed(&t.name) {
        Says::Role(r) if r != Role::Time => Some(r),
        _ => None,
    };
    let named = |v: &Taken| {
        let mut of = times.iter().filter(|t| role(t) == Some(v.role));
        of.next().filter(|_| of.next().is_none()).copied()
    };
    let all_before = values.iter().all(|v| times.iter().all(|t| t.column < v.column));
    let in_order = all_before && times.len() == values.len() && times.iter().all(|t| role(t).is_none());
    let behind = values.iter().any(|v| times.iter().all(|t| t.column > v.column));
    let mut by_column: Vec<usize> = (0..values.len()).collect();
    by_column.sort_by_key(|i| values[*i].column);
    let one = |(i, v): (usize, &Taken)| {
        if let Some(t) = named(v) {
            return t;
        }
        if in_order {
            let place = by_column.iter().position(|k| *k == i).unwrap_or(0);
            return times[place];
        }
        if all_before {
            return times[0];
        }
        // a time that is named after another channel is not this one's
        let free = || times.iter().filter(|t| role(t).is_none_or(|r| r == v.role));
        if behind {
            return free().find(|t| t.column > v.column).or_else(|| free().next_back()).copied().unwrap_or(times[0]);
        }
        free().rfind(|t| t.column < v.column).or_else(|| free().next()).copied().unwrap_or(times[0])
    };
    values.iter().enumerate().map(one).collect()
}

/// Channels whose time the user names in another group, of as many samples.
fn elsewhere(
    source: &mut dyn Source,
    originals: &[Group],
    i: usize,
    values: Vec<Taken>,
    left: Vec<(String, String)>,
    o: &Options,
) -> Result<Option<Candidate>, String> {
    for (k, other) in originals.iter().enumerate().filter(|g| g.0 != i && g.1.samples == originals[i].samples) {
        let names_time = |m: &&Mapped| m.role == Role::Time && m.column(other).is_some();
        if !o.map.iter().any(|m| names_time(&m)) {
            continue;
        }
        let only: Vec<Mapped> = o.map.iter().filter(names_time).cloned().collect();
        let Ok(found) = columns(other, &only) else { continue };
        let Some(time) = found.taken.iter().find(|t| t.role == Role::Time && t.why.starts_with("by --map")) else {
            continue;
        };
        let span = spans(source, k, &[(time, None)])?[0];
        // the time stands in a strand of its own, without channels
        let of_time = Strand { group: k, timer: Timer::Column(time.clone()), values: Vec::new(), span, sparse: false };
        let nameless = Taken { name: String::new(), ..time.clone() };
        let by_row = Strand { group: i, timer: Timer::Column(nameless), values, span, sparse: false };
        return Ok(Some(Candidate { group: i, strands: vec![of_time, by_row], left }));
    }
    Ok(None)
}

/// What distinguishes times: FNV-1a of their bits.
fn sum(so_far: u64, time: f64) -> u64 {
    let start = if so_far == 0 { 0xcbf2_9ce4_8422_2325 } else { so_far };
    time.to_bits().to_le_bytes().iter().fold(start, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// The spans of columns of time, of the rows that have a time, or of those in which a channel has a reading too; read once.
fn spans(source: &mut dyn Source, group: usize, of: &[(&Taken, Option<&Taken>)]) -> Result<Vec<Span>, String> {
    let none = Span { first: f64::NAN, last: f64::NAN, samples: 0, back: false, sum: 0, apart: 0 };
    let mut all = vec![(none, 0); of.len()];
    let mut from = 0;
    let read = source.read(group, &mut |block| {
        for ((s, at), (t, value)) in all.iter_mut().zip(of) {
            for (i, v) in block[t.column].iter().enumerate() {
                let v = v * t.factor;
                if !v.is_finite() || value.is_some_and(|c| !block[c.column][i].is_finite()) {
                    continue;
                }
                let row = from + i as u64;
                if s.samples == 0 {
                    (s.first, *at) = (v, row);
                }
                s.back |= v < s.last;
                s.last = v;
                s.samples += 1;
                s.sum = sum(s.sum, v);
                s.apart = s.apart.max(row - *at);
                *at = row;
            }
        }
        from += block.first().map_or(0, |c| c.len()) as u64;
        ControlFlow::Continue(())
    });
    read.map_err(|e| e.to_string())?;
    Ok(all.into_iter().map(|s| s.0).collect())
}

/// Which candidates are of one recording: those of one name, and all where they hold no kind of channel twice.
fn sets(all: &[Candidate], originals: &[Group]) -> Vec<Vec<usize>> {
    let apart = |of: &[usize]| {
        let mut roles: Vec<&'static str> = of.iter().flat_map(|i| all[*i].roles()).map(Role::name).collect();
        let count = roles.len();
        roles.sort_unstable();
        roles.dedup();
        roles.len() == count
    };
    let every: Vec<usize> = (0..all.len()).collect();
    if apart(&every) {
        return if every.is_empty() { Vec::new() } else { vec![every] };
    }
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for i in every {
        let name = &originals[all[i].group].name;
        let same = |s: &&mut Vec<usize>| !name.is_empty() && originals[all[s[0]].group].name == *name;
        match sets.iter_mut().find(same) {
            Some(set) => set.push(i),
            None => sets.push(vec![i]),
        }
    }
    let parts =
        sets.into_iter().flat_map(|s| if apart(&s) { vec![s] } else { s.into_iter().map(|i| vec![i]).collect() });
    parts.collect()
}

/// One table of several strands; None where they are of no one time.
fn joint(
    originals: &[Group],
    of: &[&Candidate],
    strands: Vec<Strand>,
    notes: &mut Vec<String>,
) -> Result<Option<Joint>, String> {
    let shortest = strands.iter().map(|s| s.span.step()).fold(f64::INFINITY, f64::min);
    let main = strands.iter().position(|s| s.span.step() <= shortest * (1.0 + AT)).unwrap_or(0);
    let clock = strands[main].span;
    if !strands.iter().all(|s| s.span.samples > 1 && s.span.overlaps(&clock)) {
        return Ok(None);
    }
    let names = |s: &Strand| {
        let each: Vec<String> = s.values.iter().map(|v| format!("{} ({:?})", v.role.name(), v.name)).collect();
        each.join(" and ")
    };
    let place = |s: &Strand| match &originals[s.group].name {
        name if originals.len() == 1 || name.is_empty() => String::new(),
        name => format!(" of {name:?}"),
    };
    for s in strands.iter().enumerate().filter(|s| s.0 != main).map(|s| s.1) {
        if s.values.is_empty() {
            continue;
        }
        if s.span.is_one_with(&clock) {
            if s.group != strands[main].group && !strands[main].values.is_empty() {
                notes.push(format!(
                    "{}{}: of one clock with {}{}, joined",
                    names(s),
                    place(s),
                    names(&strands[main]),
                    place(&strands[main])
                ));
            }
            continue;
        }
        if s.span.back || clock.back {
            return Err(format!(
                "{} and {} have times of their own, which go back: give each recording a file, or one time for all columns",
                names(&strands[main]),
                names(s)
            ));
        }
        let own = match &s.timer {
            Timer::Column(t) if s.sparse => format!("{:?} in the rows that hold a reading", t.name),
            Timer::Column(t) => format!("{:?}", t.name),
            Timer::Steps(_) => "its steps".to_string(),
        };
        notes.push(format!(
            "{}{} has its own time ({own}, from {} s in steps of {} s): resampled onto that of {} (from {} s in steps of {} s), \
             on straight lines between its samples",
            names(s),
            place(s),
            brief(s.span.first),
            brief(s.span.step()),
            names(&strands[main]),
            brief(clock.first),
            brief(clock.step())
        ));
    }
    let first = &originals[of[0].group];
    let mut group = Group { name: first.name.clone(), samples: strands[main].span.samples, ..Group::default() };
    let mut known: Vec<&(String, String)> = Vec::new();
    for c in of {
        known.extend(originals[c.group].properties.iter().filter(|p| !known.contains(p)).collect::<Vec<_>>());
    }
    group.properties = known.into_iter().cloned().collect();
    let mut found = Columns::default();
    match &strands[main].timer {
        Timer::Steps(c) => group.clock = Some(*c),
        Timer::Column(t) => {
            group.channels.push(Named { name: t.name.clone(), unit: "s".into() });
            found.taken.push(Taken { column: 0, factor: 1.0, ..t.clone() });
        }
    }
    for v in strands.iter().flat_map(|s| s.values.iter().map(move |v| (s.group, v))) {
        let unit = originals[v.0].channels[v.1.column].unit.clone();
        found.taken.push(Taken { column: group.channels.len(), ..v.1.clone() });
        group.channels.push(Named { name: v.1.name.clone(), unit });
    }
    found.left = of.iter().flat_map(|c| c.left.clone()).collect();
    Ok(Some(Joint { group, columns: found, strands, main }))
}

/// A file whose groups are joined as planned.
pub struct Tables<'a> {
    inner: Box<dyn Source>,
    path: PathBuf,
    open: Open<'a>,
    joined: Joined,
    groups: Vec<Group>,
}

/// Opens a file so.
///
/// # Errors
/// Where it cannot be opened.
pub fn opened<'a>(path: &Path, inner: Box<dyn Source>, open: Open<'a>, joined: Joined) -> Tables<'a> {
    let groups = (0..joined.made.len()).map(|i| joined.group(i).clone()).collect();
    Tables { inner, path: path.to_path_buf(), open, joined, groups }
}

impl Source for Tables<'_> {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        self.inner.notes()
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let joint = match &self.joined.made[group] {
            Made::As(g) => return self.inner.read(*g, sink),
            Made::Of(j) => j.clone(),
        };
        merged(self.inner.as_mut(), &self.path, self.open, &joint, sink)
    }
}

/// Rows of a strand: times, and its readings as in the file.
struct Rows {
    times: Vec<f64>,
    values: Vec<Vec<f64>>,
}

impl Strand {
    /// Its rows in a block whose first row is `from`.
    fn rows(&self, block: &[&[f64]], from: u64) -> Rows {
        let count = block.first().map_or(0, |c| c.len());
        let times = match &self.timer {
            Timer::Steps(c) => (0..count).map(|i| c.start + c.step * (from + i as u64) as f64).collect(),
            // its time stands in another group, row by row
            Timer::Column(t) if t.name.is_empty() => vec![f64::NAN; count],
            Timer::Column(t) => block[t.column].iter().map(|v| v * t.factor).collect(),
        };
        let mut rows = Rows { times, values: self.values.iter().map(|v| block[v.column].to_vec()).collect() };
        if self.sparse {
            let holds: Vec<bool> =
                (0..count).map(|i| rows.times[i].is_finite() && rows.values.iter().any(|v| v[i].is_finite())).collect();
            for column in rows.values.iter_mut().chain([&mut rows.times]) {
                let mut holds = holds.iter();
                column.retain(|_| holds.next() == Some(&true));
            }
        }
        rows
    }
}

/// Sends a strand's rows until nobody takes them.
fn feed(path: &Path, open: Open, strand: &Strand, to: &SyncSender<Result<Rows, Fault>>) {
    let mut from = 0;
    let read = open(path).and_then(|mut source| {
        source.read(strand.group, &mut |block| {
            let rows = strand.rows(block, from);
            from += rows.times.len() as u64;
            match to.send(Ok(rows)) {
                Ok(()) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        })
    });
    if let Err(e) = read {
        // nobody waits for it where the reading was given up
        drop(to.send(Err(e)));
    }
}

/// Takes a strand's rows one after the other.
struct Cursor {
    from: Receiver<Result<Rows, Fault>>,
    /// Rows are those of the main strand.
    paired: bool,
    width: usize,
    rows: Rows,
    at: usize,
    before: Option<(f64, [f64; 3])>,
    after: Option<(f64, [f64; 3])>,
    begun: bool,
}

impl Cursor {
    fn next(&mut self) -> Result<Option<(f64, [f64; 3])>, Fault> {
        while self.at >= self.rows.times.len() {
            match self.from.recv() {
                Ok(rows) => (self.rows, self.at) = (rows?, 0),
                Err(_) => return Ok(None),
            }
        }
        let mut y = [f64::NAN; 3];
        y.iter_mut().zip(&self.rows.values).for_each(|(y, v)| *y = v[self.at]);
        self.at += 1;
        Ok(Some((self.rows.times[self.at - 1], y)))
    }

    /// The next row that has a time.
    fn next_timed(&mut self) -> Result<Option<(f64, [f64; 3])>, Fault> {
        loop {
            match self.next()? {
                Some((t, _)) if !t.is_finite() => {}
                other => return Ok(other),
            }
        }
    }

    /// Readings at `time`, which never falls; NaN before the first sample and after the last.
    fn at(&mut self, time: f64) -> Result<[f64; 3], Fault> {
        if self.paired {
            return Ok(self.next()?.map_or([f64::NAN; 3], |r| r.1));
        }
        if !self.begun {
            self.after = self.next_timed()?;
            self.begun = true;
        }
        while self.after.is_some_and(|a| a.0 < time) {
            self.before = self.after;
            self.after = self.next_timed()?;
        }
        let none = [f64::NAN; 3];
        Ok(match (self.before, self.after) {
            _ if !time.is_finite() => none,
            (Some(b), Some(a)) => {
                let share = (time - b.0) / (a.0 - b.0);
                if share < AT {
                    b.1
                } else if share > 1.0 - AT {
                    a.1
                } else {
                    [0, 1, 2].map(|i| b.1[i] + share * (a.1[i] - b.1[i]))
                }
            }
            (None, Some(a)) if a.0 == time => a.1,
            _ => none,
        })
    }
}

/// Hands the rows of a joint to `sink`.
fn merged(inner: &mut dyn Source, path: &Path, open: Open, j: &Joint, sink: &mut Sink) -> Result<(), Fault> {
    let main = &j.strands[j.main];
    std::thread::scope(|scope| {
        let mut cursors: Vec<Option<Cursor>> = Vec::new();
        for (i, s) in j.strands.iter().enumerate() {
            if i == j.main {
                cursors.push(None);
                continue;
            }
            let (to, from) = sync_channel(WAITING);
            scope.spawn(move || feed(path, open, s, &to));
            let (paired, rows) = (s.span.is_one_with(&main.span), Rows { times: Vec::new(), values: Vec::new() });
            let width = s.values.len();
            cursors.push(Some(Cursor { from, paired, width, rows, at: 0, before: None, after: None, begun: false }));
        }
        let mut row = 0;
        let mut fault = None;
        let read = inner.read(main.group, &mut |block| {
            let own = main.rows(block, row);
            row += own.times.len() as u64;
            let mut columns: Vec<Vec<f64>> = Vec::new();
            if matches!(main.timer, Timer::Column(_)) {
                columns.push(own.times.clone());
            }
            for cursor in &mut cursors {
                let Some(c) = cursor else {
                    columns.extend(own.values.iter().cloned());
                    continue;
                };
                let at = columns.len();
                columns.extend((0..c.width).map(|_| Vec::with_capacity(own.times.len())));
                for t in &own.times {
                    match c.at(*t) {
                        Ok(y) => columns[at..].iter_mut().zip(y).for_each(|(c, v)| c.push(v)),
                        Err(e) => {
                            fault = Some(e);
                            return ControlFlow::Break(());
                        }
                    }
                }
            }
            let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            sink(&slices)
        });
        // the threads end once nobody takes their rows
        drop(cursors);
        read.and(fault.map_or(Ok(()), Err))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guess::tests::group;
    use crate::survey::{survey, File};
    use instruments::Memory;

    fn memory(groups: &[(&str, &[(&str, &str)])], samples: &[Vec<Vec<f64>>]) -> Memory {
        let of = |(name, columns): &(&str, &[(&str, &str)])| {
            let g = group(columns);
            Group { name: name.to_string(), ..g }
        };
        let mut m = Memory { groups: groups.iter().map(of).collect(), samples: samples.to_vec(), notes: Vec::new() };
        for (g, s) in m.groups.iter_mut().zip(&m.samples) {
            g.samples = s.iter().map(Vec::len).max().unwrap_or(0) as u64;
        }
        m
    }

    /// The rows that come of a file, its survey and what was said.
    type Taken = (Vec<Vec<f64>>, File, Vec<String>);

    fn read(make: &(dyn Fn() -> Memory + Sync), map: &str) -> Result<Taken, String> {
        let map = if map.is_empty() { Vec::new() } else { crate::map::parse(map).unwrap() };
        let o = Options { map, keep_all: true, ..Options::default() };
        let open = |_: &Path| Ok(Box::new(make()) as Box<dyn Source>);
        let path = Path::new("a.csv");
        let mut inner: Box<dyn Source> = Box::new(make());
        let joined = plan(inner.as_mut(), &o)?;
        let mut source = opened(path, inner, &open, joined.clone());
        let file = survey(path, &mut source, &o, Some(&joined)).map_err(|e| e.join("\n"))?;
        let mut rows: Vec<Vec<f64>> = Vec::new();
        source
            .read(0, &mut |block| {
                rows.resize(block.len(), Vec::new());
                rows.iter_mut().zip(block).for_each(|(r, b)| r.extend_from_slice(b));
                ControlFlow::Continue(())
            })
            .map_err(|e| e.to_string())?;
        Ok((rows, file, joined.notes))
    }

    fn pulse(t: f64) -> f64 {
        if (0.010..0.012).contains(&t) {
            (std::f64::consts::PI * (t - 0.010) / 0.002).sin()
        } else {
            0.0
        }
    }

    fn course(start: f64, step: f64, n: usize) -> [Vec<f64>; 2] {
        let t: Vec<f64> = (0..n).map(|i| start + step * i as f64).collect();
        let y = t.iter().map(|t| pulse(*t)).collect();
        [t, y]
    }

    #[test]
    fn a_channel_read_in_every_fourth_row_keeps_its_readings_and_the_others_theirs() {
        let [t, force] = course(0.0, 1e-4, 400);
        let slow = |from: usize| -> Vec<f64> {
            (0..400).map(|i| if i % 4 == from { 1e-3 * t[i] } else { f64::NAN }).collect()
        };
        let names = [("Time", "s"), ("Force", "N"), ("Position", "m")];
        let make = || memory(&[("", &names)], &[vec![t.clone(), force.clone(), slow(0)]]);
        let (rows, _, notes) = read(&make, "").unwrap();
        assert_eq!(rows[0].len(), 400);
        assert_eq!(rows[1], force);
        // between its samples it lies on the line from one to the next
        assert!((0..397).all(|i| (rows[2][i] - 1e-3 * t[i]).abs() < 1e-15), "{:?}", &rows[2][..9]);
        assert!(notes[0].contains("in the rows that hold a reading"), "{notes:?}");
        // a stretch that was lost is not filled
        let mut lost = force.clone();
        lost[100..320].fill(f64::NAN);
        let make = || memory(&[("", &names)], &[vec![t.clone(), lost.clone(), slow(0)]]);
        let (rows, ..) = read(&make, "").unwrap();
        assert!(rows[1][100..320].iter().all(|v| v.is_nan()));
    }

    #[test]
    fn a_second_time_column_is_the_time_of_its_own_channel() {
        for names in [
            [("Time", "s"), ("Force", "N"), ("Time", "s"), ("Acceleration", "m/s^2")],
            [("time 1", "s"), ("force", "N"), ("time 2", "s"), ("acceleration", "m/s^2")],
            [("Time - force", "s"), ("x1", "N"), ("Time - acc", "s"), ("x2", "m/s^2")],
        ] {
            for (start, step, n) in [(2e-3, 1e-5, 2500), (0.0, 2e-5, 1250)] {
                let make = move || {
                    let ([t1, f], [t2, a]) = (course(0.0, 1e-5, 2500), course(start, step, n));
                    memory(&[("", &names)], &[vec![t1, f, t2, a]])
                };
                let (rows, file, notes) = read(&make, "").unwrap();
                assert_eq!(file.seen.len(), 1);
                let off = rows[1].iter().zip(&rows[2]).map(|(f, a)| (f - a).abs()).filter(|d| d.is_finite());
                assert!(off.fold(0.0, f64::max) < 2e-3, "{names:?}");
                assert!(notes[0].contains("has its own time"), "{notes:?}");
            }
        }
    }

    #[test]
    fn times_are_found_by_the_names_of_channels_in_any_order() {
        let make = || {
            let ([t1, f], [t2, a]) = (course(0.0, 1e-5, 2500), course(2e-3, 1e-5, 2500));
            let names = [("acceleration", "m/s^2"), ("force", "N"), ("time_acc", "s"), ("time_force", "s")];
            memory(&[("", &names)], &[vec![a, f, t2, t1]])
        };
        let (rows, ..) = read(&make, "").unwrap();
        let off = rows[1].iter().zip(&rows[2]).map(|(f, a)| (f - a).abs()).filter(|d| d.is_finite());
        assert!(off.fold(0.0, f64::max) < 1e-3);
    }

    #[test]
    fn groups_of_one_clock_are_joined_and_those_of_others_resampled() {
        for late in [0.0, 2e-3] {
            let make = move || {
                let ([t1, f], [t2, a]) = (course(0.0, 1e-5, 2500), course(late, 1e-5, 2500));
                let (force, acceleration) = ([("t", "s"), ("F", "N")], [("t", "s"), ("a", "m/s^2")]);
                memory(&[("A", &force), ("B", &acceleration)], &[vec![t1, f], vec![t2, a]])
            };
            let (rows, file, notes) = read(&make, "").unwrap();
            assert_eq!((file.groups.len(), file.seen.len(), rows.len()), (1, 1, 3));
            let off = rows[1].iter().zip(&rows[2]).map(|(f, a)| (f - a).abs()).filter(|d| d.is_finite());
            assert!(off.fold(0.0, f64::max) < 1e-3);
            let said = if late > 0.0 { "has its own time" } else { "of one clock" };
            assert!(notes[0].contains(said), "{notes:?}");
        }
    }

    #[test]
    fn groups_of_clocks_that_start_apart_are_resampled() {
        let make = || {
            let ([_, f], [_, a]) = (course(0.0, 1e-5, 2500), course(2e-3, 1e-5, 2500));
            let mut m = memory(&[("A", &[("F", "N")]), ("A", &[("a", "m/s^2")])], &[vec![f], vec![a]]);
            m.groups[0].clock = Some(Clock { start: 0.0, step: 1e-5 });
            m.groups[1].clock = Some(Clock { start: 2e-3, step: 1e-5 });
            m
        };
        let (rows, ..) = read(&make, "").unwrap();
        let off = rows[0].iter().zip(&rows[1]).map(|(f, a)| (f - a).abs()).filter(|d| d.is_finite());
        assert!(off.fold(0.0, f64::max) < 1e-3);
    }

    #[test]
    fn a_time_of_another_group_is_taken_where_the_map_names_it() {
        let make = || {
            let [t, f] = course(0.5, 1e-5, 2500);
            memory(&[("", &[("axis0", "")]), ("drop/sensors", &[("force", "N")])], &[vec![t], vec![f]])
        };
        let (rows, file, _) = read(&make, "time=axis0:s,force=drop/sensors/force:kN").unwrap();
        assert_eq!((rows[0][0], rows.len(), file.seen.len()), (0.5, 2, 1));
        assert!((rows[0][2499] - 0.52499).abs() < 1e-9);
    }

    #[test]
    fn times_that_go_back_are_not_paired_by_row() {
        let make = || {
            let ([t1, f], [t2, a]) = (course(0.0, 1e-5, 500), course(1e-3, 1e-5, 500));
            let twice = |y: &Vec<f64>| [y.clone(), y.clone()].concat();
            let names = [("Time", "s"), ("Force", "N"), ("Time", "s"), ("Acceleration", "m/s^2")];
            memory(&[("", &names)], &[vec![twice(&t1), twice(&f), twice(&t2), twice(&a)]])
        };
        assert!(read(&make, "").map(|_| ()).unwrap_err().contains("give each recording a file"));
    }
}
