//! Campaigns in the format `recordings/1`: read, checked, converted to SI.

mod error;
mod fmus;
mod keys;
mod load;
pub mod release;
mod samples;
mod schema;
pub mod statistics;
pub mod units;
pub mod words;

pub use error::{RecordError, RecordErrors, Section};
pub use fmus::{Bond, BondKind, FmuSystem, Free, Written};
pub use keys::{Label, Setting};
pub use load::load;
pub use samples::{read_file, read_wanted, Signals, Wanted, LARGEST};
pub use schema::schema;
use std::path::PathBuf;

/// Gravity, m/s^2, as the format has it; that of every simulation.
pub const GRAVITY: f64 = 9.81;

/// What was done with the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    DropTest,
    ContactorOpening,
    Indentation,
    /// Whatever a system of FMUs simulates.
    System,
}

impl Kind {
    pub const ALL: [Kind; 4] = [Kind::DropTest, Kind::ContactorOpening, Kind::Indentation, Kind::System];
    /// Those whose rig is built in.
    pub const BUILT_IN: [Kind; 3] = [Kind::DropTest, Kind::ContactorOpening, Kind::Indentation];

    /// The kind of that name; a `_` for the `-` does as well.
    pub fn named(name: &str) -> Option<Kind> {
        let name = name.replace('_', "-");
        Kind::ALL.into_iter().find(|k| k.name() == name)
    }

    /// As campaign.toml has it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::DropTest => "drop-test",
            Kind::ContactorOpening => "contactor-opening",
            Kind::Indentation => "indentation",
            Kind::System => "system",
        }
    }

    /// Whether the body starts at rest and is driven: what is loose in it is carried along.
    pub fn starts_driven(self) -> bool {
        matches!(self, Kind::ContactorOpening | Kind::System)
    }

    /// What the simulation of such a campaign holds beside k x^p where campaign.toml does not say it: a weight and a law that
    /// loses energy, which every simulation of an impact has.
    pub fn usual_terms(self) -> &'static [&'static str] {
        match self {
            Kind::DropTest => &["gravity", "hysteresis_damping"],
            Kind::ContactorOpening => &["hysteresis_damping"],
            Kind::Indentation | Kind::System => &[],
        }
    }
}

/// A measured channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    Force,
    Acceleration,
    Penetration,
}

impl Channel {
    pub const ALL: [Channel; 3] = [Channel::Force, Channel::Acceleration, Channel::Penetration];
    pub fn name(self) -> &'static str {
        match self {
            Channel::Force => "force",
            Channel::Acceleration => "acceleration",
            Channel::Penetration => "penetration",
        }
    }
    /// SI unit of its readings.
    pub fn unit(self) -> &'static str {
        match self {
            Channel::Force => "N",
            Channel::Acceleration => "m/s^2",
            Channel::Penetration => "m",
        }
    }
    pub fn index(self) -> usize {
        self as usize
    }
}

/// One column as the file had it: `value_in_file * to_si = SI`.
#[derive(Clone, Debug)]
pub struct Column {
    pub name: String,
    pub unit: String,
    pub to_si: f64,
}

/// A row of a recording's file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// s
    pub time: f64,
    /// The sample it became; rows of one time share it. None: left out.
    pub sample: Option<usize>,
}

/// The rows of a recording's file, in order.
#[derive(Clone, Debug)]
pub struct Rows {
    /// s
    time: Vec<f64>,
    /// The sample that each became; None: every row the sample of its own number.
    samples: Option<Vec<Option<usize>>>,
}

impl Rows {
    /// Rows that became a sample each.
    pub fn alike(time: Vec<f64>) -> Rows {
        Rows { time, samples: None }
    }

    /// Rows and what became of each; as many of one as of the other.
    pub fn of(time: Vec<f64>, samples: Vec<Option<usize>>) -> Rows {
        Rows { time, samples: Some(samples) }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Row `i`, below [`Rows::len`].
    pub fn get(&self, i: usize) -> Row {
        Row { time: self.time[i], sample: self.samples.as_ref().map_or(Some(i), |s| s[i]) }
    }

    /// Every row.
    pub fn iter(&self) -> impl Iterator<Item = Row> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// The samples they became.
    pub fn samples(&self) -> usize {
        match &self.samples {
            Some(s) => s.iter().flatten().max().map_or(0, |last| last + 1),
            None => self.len(),
        }
    }
}

/// A place between two times of a course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    before: usize,
    /// Way from the time before, s, and from that to the next; 0 of 1 at a time itself.
    along: f64,
    step: f64,
}

impl Place {
    /// Where `t` s lies in `time`, which increases and holds one at least; beyond the ends, the end.
    pub fn within(time: &[f64], t: f64) -> Place {
        let next = time.partition_point(|u| *u <= t);
        if next == 0 || next == time.len() {
            return Place::at(next.saturating_sub(1));
        }
        let before = next - 1;
        Place { before, along: t - time[before], step: time[next] - time[before] }
    }

    /// The time number `i` of a course.
    fn at(i: usize) -> Place {
        Place { before: i, along: 0.0, step: 1.0 }
    }

    /// The value there of a course `y`, on a straight line between its times.
    pub fn of(&self, y: &[f64]) -> f64 {
        if self.along == 0.0 {
            y[self.before]
        } else {
            y[self.before] + (y[self.before + 1] - y[self.before]) * self.along / self.step
        }
    }
}

/// One recording, SI.
#[derive(Clone, Debug)]
pub struct Recording {
    pub file: String,
    pub order: f64,
    /// Index into `Campaign::levels`; recordings of one level share it.
    pub level: usize,
    pub drop_height: Option<f64>,
    /// Speed at touch, m/s, and its std.
    pub impact_speed: Option<(f64, f64)>,
    /// Speed at the first sample, m/s, and its std.
    pub start_speed: Option<(f64, f64)>,
    pub spring_preload: Option<f64>,
    /// Values of variables of FMUs in this recording, of a campaign of kind `system`.
    pub set: Vec<Setting>,
    /// s, strictly increasing
    pub time: Vec<f64>,
    /// Times from the first sample to the last, s, at which courses of the whole recording are worked out where `time` holds
    /// a window of them or means; None: `time` holds all samples.
    pub whole: Option<Vec<f64>>,
    /// Indexed by `Channel::index`.
    pub channels: [Option<Vec<f64>>; 3],
    /// The file's columns in order, to write predictions in the same units.
    pub columns: Vec<Column>,
    /// The file's rows, to write a prediction a row.
    pub rows: Rows,
}

impl Recording {
    /// Of samples at `time`, s, strictly increasing, by channel, SI, of a file by itself: nothing else is known of it.
    pub fn of(file: &str, time: Vec<f64>, channels: [Option<Vec<f64>>; 3]) -> Recording {
        Recording {
            file: file.into(),
            order: 1.0,
            level: 0,
            drop_height: None,
            impact_speed: None,
            start_speed: None,
            spring_preload: None,
            set: Vec::new(),
            rows: Rows::alike(time.clone()),
            time,
            whole: None,
            channels,
            columns: Vec::new(),
        }
    }

    /// Times of a course of the whole recording, s.
    pub fn all_times(&self) -> &[f64] {
        self.whole.as_ref().unwrap_or(&self.time)
    }

    /// When the file begins, s: its first row, left out or not.
    pub fn begins(&self) -> f64 {
        if self.rows.is_empty() {
            self.time[0]
        } else {
            self.rows.get(0).time
        }
    }

    /// Where a row lies in a course of the whole recording: at the sample it became; one left out, or of a recording that is
    /// not judged sample by sample, by its time.
    pub fn place(&self, row: &Row) -> Place {
        match row.sample {
            Some(i) if self.whole.is_none() => Place::at(i),
            None if self.whole.is_none() => Place::at(nearest(&self.time, row.time)),
            _ => Place::within(self.all_times(), row.time),
        }
    }

    /// The sample that is judged, the nearest in time to a row.
    pub fn judged_sample_of(&self, row: &Row) -> usize {
        match (&self.whole, row.sample) {
            (None, Some(i)) => i,
            _ => nearest(&self.time, row.time),
        }
    }
}

/// The simulation as the user has it.
#[derive(Clone, Debug, Default)]
pub struct Simulation {
    pub terms: Vec<String>,
    pub k: Option<f64>,
    pub p: Option<f64>,
    pub mu_d: Option<f64>,
}

/// A campaign, checked and in SI.
#[derive(Clone, Debug)]
pub struct Campaign {
    pub dir: PathBuf,
    /// The folder's name (names the output), and the name in the file.
    pub folder: String,
    pub name: String,
    pub kind: Kind,
    pub material: Option<String>,
    /// Who took the recordings.
    pub operator: Option<String>,
    /// `[campaign.columns]`: what a user knows of the campaign and a fleet is searched by, such as batch or temperature.
    pub columns: std::collections::BTreeMap<String, Label>,
    pub moving_mass: Option<f64>,
    pub travel: Option<f64>,
    pub return_spring_rate: Option<f64>,
    pub simulation: Simulation,
    /// The FMUs that simulate it, of a campaign of kind `system`.
    pub system: Option<FmuSystem>,
    /// Value and text of each level, ascending.
    pub levels: Vec<(f64, String)>,
    pub recordings: Vec<Recording>,
    /// What a reader should know that is no error: files not listed, rows merged, pieces and recordings left out.
    pub warnings: Vec<String>,
}

impl Campaign {
    /// Values of the levels: the numbers that they are, or that their texts begin with where the rest is the same in all, as in
    /// "5 N" and "10 N". None where a level has none.
    pub fn values_of_levels(&self) -> Option<Vec<f64>> {
        if self.levels.iter().all(|l| l.0.is_finite()) {
            return Some(self.levels.iter().map(|l| l.0).collect());
        }
        let is_of_a_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
        let parts = |text: &str| {
            let rest = text.trim_start_matches(is_of_a_number);
            let value: f64 = text[..text.len() - rest.len()].parse().ok()?;
            Some((value, rest.trim().to_string()))
        };
        let parted: Vec<(f64, String)> = self.levels.iter().map(|l| parts(l.1.trim())).collect::<Option<_>>()?;
        let first = parted.first()?.1.clone();
        parted.iter().all(|p| p.1 == first).then(|| parted.iter().map(|p| p.0).collect())
    }

    /// Of recordings in a folder, whose levels are called by their index: nothing else is known of it.
    pub fn of(folder: &str, kind: Kind, recordings: Vec<Recording>) -> Campaign {
        let levels = recordings.iter().map(|r| r.level + 1).max().unwrap_or(0);
        Campaign {
            dir: folder.into(),
            folder: folder.into(),
            name: folder.into(),
            kind,
            material: None,
            operator: None,
            columns: Default::default(),
            moving_mass: None,
            travel: None,
            return_spring_rate: None,
            simulation: Simulation::default(),
            system: None,
            levels: (0..levels).map(|i| (i as f64, i.to_string())).collect(),
            recordings,
            warnings: Vec::new(),
        }
    }

    /// Keeps the recordings for which `keep` holds, and the levels that are left.
    pub fn retain(&mut self, mut keep: impl FnMut(&Recording) -> bool) {
        self.recordings.retain(|r| keep(r));
        let used: Vec<usize> =
            (0..self.levels.len()).filter(|l| self.recordings.iter().any(|r| r.level == *l)).collect();
        self.levels = used.iter().map(|l| self.levels[*l].clone()).collect();
        for r in &mut self.recordings {
            r.level = used.partition_point(|l| *l < r.level);
        }
    }
}

/// Index of the time nearest to `t` in `time`, which increases and holds one at least.
fn nearest(time: &[f64], t: f64) -> usize {
    let next = time.partition_point(|u| *u < t).min(time.len() - 1);
    let last = next.saturating_sub(1);
    if (t - time[last]).abs() < (time[next] - t).abs() {
        last
    } else {
        next
    }
}

/// Largest reading less the least, in the readings' unit; below zero where there are none.
pub fn range(y: &[f64]) -> f64 {
    let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    high - low
}

/// Share of the largest reading from which a pulse is distinguished from what lies around it.
const PULSE: f64 = 0.05;

/// First and last time, in s, of the stretch about the largest magnitude of `y` in which readings stay above 5 % of it; None
/// where there is none, or it is all there is.
pub fn pulse(time: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let n = time.len().min(y.len());
    let top = (0..n).filter(|i| y[*i].is_finite()).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()))?;
    let low = |i: &usize| y[*i].abs() <= PULSE * y[top].abs();
    let first = (0..top).rev().find(low)?;
    let last = (top + 1..n).find(low)?;
    Some((time[first], time[last]))
}

/// Largest magnitude, in the readings' unit; zero where there are none.
pub fn largest(y: &[f64]) -> f64 {
    y.iter().fold(0.0, |m, v| v.abs().max(m))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_is_what_stands_about_the_largest_reading() {
        let t: Vec<f64> = (0..9).map(f64::from).collect();
        assert_eq!(pulse(&t, &[0.0, 0.1, 4.0, 9.0, 5.0, 0.2, 3.0, 0.0, 0.0]), Some((1.0, 5.0)));
        assert_eq!(pulse(&t, &[0.0, 0.0, -8.0, 0.0]), Some((1.0, 3.0)));
        assert_eq!((pulse(&t, &[1.0; 9]), pulse(&t, &[]), pulse(&t, &[f64::NAN])), (None, None, None));
    }
}
