//! The system of FMUs that a campaign of kind `system` is simulated by, as campaign.toml describes it.

use crate::error::Section;
use crate::keys::{Document, Entries};
use crate::{words, Channel, Kind, RecordError};
use std::path::{Path, PathBuf};

/// A text of campaign.toml with its line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    pub text: String,
    pub line: usize,
}

/// A variable that calibration may move.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    /// `fmu.variable`.
    pub variable: Written,
    /// Relative standard deviation; None: free within the variable's min and max.
    pub tolerance: Option<f64>,
}

/// Which physics may be missing at a bond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BondKind {
    /// That of a contact, and of the body that has it.
    Contact,
    /// That of a body alone.
    Body,
}

impl BondKind {
    pub const ALL: [BondKind; 2] = [BondKind::Contact, BondKind::Body];

    /// As campaign.toml has it.
    pub fn name(self) -> &'static str {
        match self {
            BondKind::Contact => "contact",
            BondKind::Body => "body",
        }
    }
}

/// Where physics may be missing: a force, and the motion that it acts on.
#[derive(Clone, Debug, PartialEq)]
pub struct Bond {
    pub name: Written,
    pub kind: BondKind,
    /// The input that takes a force, N; None where the model has none.
    pub force: Option<Written>,
    /// The output for the penetration, m.
    pub penetration: Written,
    /// The output for its rate, m/s.
    pub velocity: Written,
}

/// A system of FMUs, and how it stands to the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct FmuSystem {
    /// campaign.toml, for messages.
    pub described_in: PathBuf,
    /// The system: a file as `touchdown run` takes it, an SSP archive, or one FMU.
    pub file: Written,
    /// Gravity along the motion, m/s^2: what an accelerometer's reading lacks of the acceleration.
    pub gravity: f64,
    pub free: Vec<Free>,
    pub bonds: Vec<Bond>,
    /// The output that each recorded channel is, by [`Channel::index`].
    pub channels: [Option<Written>; 3],
}

impl FmuSystem {
    /// Path of the system, from where this program runs.
    pub fn path(&self) -> PathBuf {
        self.described_in.parent().map_or_else(PathBuf::new, Path::to_path_buf).join(&self.file.text)
    }

    /// What is wrong at a line of campaign.toml, and the cure.
    pub fn wrong(&self, line: usize, what: impl Into<String>, cure: impl Into<String>) -> RecordError {
        RecordError::new(Section::SystemsOfFmus, &self.described_in, line, what, cure)
    }
}

/// Faults of campaign.toml, gathered.
struct Faults<'a> {
    path: &'a Path,
    errors: &'a mut Vec<RecordError>,
}

impl Faults<'_> {
    fn add(&mut self, line: usize, what: impl Into<String>, cure: impl Into<String>) {
        self.errors.push(RecordError::new(Section::SystemsOfFmus, self.path, line, what, cure));
    }

    /// A variable written `fmu.variable` under `key`; None, and a fault, where it is absent or none.
    fn variable(&mut self, of: &Entries, table: &str, key: &str) -> Option<Written> {
        let cure = format!("write {key} = \"fmu.variable\"");
        let Some(text) = of.text(key) else {
            if !of.given(key) {
                self.add(of.line, format!("{key} is missing under {table}"), cure);
            }
            return None;
        };
        let line = of.line_of(key);
        if !text.split_once('.').is_some_and(|(fmu, variable)| !fmu.is_empty() && !variable.is_empty()) {
            self.add(line, format!("{key} = {text:?} names no variable of an FMU"), cure);
            return None;
        }
        Some(Written { text: text.to_string(), line })
    }
}

/// The system that `d` describes where its kind is `system`; what is wrong with that goes to `errors`. Of another kind:
/// None, and its keys are errors.
pub(crate) fn read(path: &Path, d: &Document, kind: Option<Kind>, errors: &mut Vec<RecordError>) -> Option<FmuSystem> {
    let mut f = Faults { path, errors };
    match kind? {
        Kind::System => {}
        _ => {
            let lists = d.free.iter().chain(&d.bonds).chain(&d.channels).map(|e| e.line);
            let keys = ["system", "gravity"].into_iter().filter(|k| d.simulation.given(k));
            let lines: Vec<usize> = keys.map(|k| d.simulation.line_of(k)).chain(lists).collect();
            let sets = d.sets.iter().flatten().map(|s| s.line);
            for line in lines.into_iter().chain(sets) {
                f.add(line, "this belongs to a campaign of FMUs", "write kind = \"system\", or leave it out");
            }
            return None;
        }
    }
    for key in ["k", "p", "mu_d"].into_iter().filter(|k| d.simulation.given(k)) {
        let cure = "set it in the system file, and list it under [[simulation.free]]";
        f.add(d.simulation.line_of(key), format!("{key} is a parameter of an FMU here"), cure);
    }
    for key in ["moving_mass", "travel", "return_spring_rate"].into_iter().filter(|k| d.rig.given(k)) {
        f.add(d.rig.line_of(key), format!("{key} is what the FMUs hold"), "leave [rig] out");
    }
    let file = d
        .simulation
        .text("system")
        .map(|text| Written { text: text.to_string(), line: d.simulation.line_of("system") });
    if file.is_none() && !d.simulation.given("system") {
        let cure = "add system = \"system.toml\", an .ssp or an .fmu, under [simulation]";
        f.add(d.simulation.line, "system is missing under [simulation]", cure);
    }
    let free = d.free.iter().filter_map(|e| {
        let variable = f.variable(e, "[[simulation.free]]", "variable")?;
        Some(Free { variable, tolerance: e.number("tolerance") })
    });
    let free: Vec<Free> = free.collect();
    let bonds: Vec<Bond> = d.bonds.iter().filter_map(|e| bond(&mut f, e)).collect();
    twice(&mut f, bonds.iter().map(|b| &b.name), "bonds are named");
    twice(&mut f, free.iter().map(|v| &v.variable), "entries free");
    let none = Entries::default();
    let of_channels = d.channels.as_ref().unwrap_or(&none);
    let mut channels = [const { None }; 3];
    for c in Channel::ALL.into_iter().filter(|c| of_channels.given(c.name())) {
        channels[c.index()] = f.variable(of_channels, "[simulation.channels]", c.name());
    }
    if Channel::ALL.into_iter().all(|c| !of_channels.given(c.name())) {
        let cure = "say under [simulation.channels] which output each recorded channel is";
        f.add(of_channels.line, "no channel has an output", cure);
    }
    let gravity = d.simulation.number("gravity").unwrap_or(0.0);
    Some(FmuSystem { described_in: path.to_path_buf(), file: file?, gravity, free, bonds, channels })
}

fn bond(f: &mut Faults<'_>, e: &Entries) -> Option<Bond> {
    let table = "[[simulation.bond]]";
    for key in ["name", "kind"].into_iter().filter(|k| !e.given(k)) {
        f.add(e.line, format!("{key} is missing under {table}"), format!("write {key} = \"...\""));
    }
    let names = BondKind::ALL.map(BondKind::name);
    let kind = e.text("kind").and_then(|text| {
        let found = BondKind::ALL.into_iter().find(|k| k.name() == text);
        if found.is_none() {
            f.add(e.line_of("kind"), format!("kind {text:?} is not known"), words::instead(text, &names));
        }
        found
    });
    let force = if e.given("force") { f.variable(e, table, "force") } else { None };
    let penetration = f.variable(e, table, "penetration");
    let velocity = f.variable(e, table, "velocity");
    let name = Written { text: e.text("name")?.to_string(), line: e.line_of("name") };
    Some(Bond { name, kind: kind?, force, penetration: penetration?, velocity: velocity? })
}

/// Texts that are there more than once.
fn twice<'a>(f: &mut Faults<'_>, all: impl Iterator<Item = &'a Written>, what: &str) {
    let mut seen: Vec<&Written> = Vec::new();
    for w in all {
        if let Some(first) = seen.iter().find(|s| s.text == w.text) {
            let said = format!("two {what} {:?} (first at line {})", w.text, first.line);
            f.add(w.line, said, "leave one out, or give it another name");
        }
        seen.push(w);
    }
}
