//! A system file: which FMUs, how they are connected, and how they are stepped.

use crate::value::Value;
use crate::{Description, Isolation};
use anyhow::{anyhow, Context, Result};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// An FMU of the system.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Its name in the system.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// The file, relative to the system's; or `touchdown:contact`, `touchdown:moving-bar`, `touchdown:body-force`, packed on the fly.
    #[schemars(with = "String")]
    pub file: Spanned<String>,
    /// Parameters, inputs and start values by name, in the FMU's units.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Value>")]
    pub set: BTreeMap<String, Spanned<Value>>,
    /// Highest order of input derivatives the FMU takes, where it declares canInterpolateInputs; FMI 2.0 has no
    /// place to declare it. 1 unless given.
    pub input_orders: Option<u32>,
    /// Log categories to switch on; empty: errors only.
    #[serde(default)]
    pub log: Vec<String>,
    /// Relative tolerance that the FMU is given; that of `[master]` unless given.
    pub tolerance: Option<f64>,
}

impl Component {
    /// An FMU of this name in this file, with nothing set.
    pub(crate) fn named(name: String, file: String) -> Component {
        Component {
            name: Spanned::new(0..0, name),
            file: Spanned::new(0..0, file),
            set: BTreeMap::new(),
            input_orders: None,
            log: Vec::new(),
            tolerance: None,
        }
    }

    /// The model of ours that it is, packed on the fly; None of a file.
    pub fn own(&self) -> Option<&str> {
        self.file.get_ref().strip_prefix("touchdown:")
    }
}

/// A connection: to = factor * from + offset, after conversion of the units both ends declare.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// `fmu.output`.
    #[schemars(with = "String")]
    pub from: Spanned<String>,
    /// `fmu.input`.
    #[schemars(with = "String")]
    pub to: Spanned<String>,
    /// Factor, 1 unless given.
    #[serde(default = "one")]
    pub factor: f64,
    /// Offset in the input's unit.
    #[serde(default)]
    pub offset: f64,
    /// Whether the number goes as it is, whatever units both ends declare.
    #[serde(default)]
    pub suppress_unit_conversion: bool,
    /// What values become instead, as pairs: of Integers, Booleans and Enumerations (by number or by the items' names). What
    /// is not listed stays.
    #[serde(default)]
    pub map: Vec<(Value, Value)>,
}

impl Connection {
    /// From one variable to another, values as they are.
    pub(crate) fn plain(from: String, to: String) -> Connection {
        Connection {
            from: Spanned::new(0..0, from),
            to: Spanned::new(0..0, to),
            factor: 1.0,
            offset: 0.0,
            suppress_unit_conversion: false,
            map: Vec::new(),
        }
    }
}

fn one() -> f64 {
    1.0
}

/// How the step adapts.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "lowercase", tag = "by")]
pub enum AdaptBy {
    /// By the bonds' energy residual.
    Energy {
        /// Share of the energy, a step.
        tolerance: f64,
        /// Energy below which that of the bonds does not count as less, J.
        #[serde(default)]
        floor: f64,
        /// s.
        shortest: Option<f64>,
        /// s.
        longest: Option<f64>,
    },
    /// By step doubling.
    Doubling {
        /// Share of each signal's largest value, a step.
        tolerance: f64,
        /// s.
        shortest: Option<f64>,
        /// s.
        longest: Option<f64>,
    },
}

/// `[master]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Master {
    /// gauss-seidel, jacobi, implicit or iterated.
    #[serde(default = "gauss_seidel")]
    #[schemars(with = "String")]
    pub method: Spanned<String>,
    /// held or extrapolated (gauss-seidel, jacobi).
    #[schemars(with = "Option<String>")]
    pub inputs: Option<Spanned<String>>,
    /// mean, linear or cubic (implicit: mean unless given; iterated: cubic).
    #[schemars(with = "Option<String>")]
    pub shape: Option<Spanned<String>>,
    /// Order of stepping, by names; by feedthrough unless given.
    #[serde(default)]
    pub order: Vec<String>,
    /// s.
    #[serde(default)]
    pub start: f64,
    /// s.
    pub stop: f64,
    /// s; the smallest step the FMUs prefer unless given.
    pub step: Option<f64>,
    /// How the step adapts; fixed unless given.
    pub adapt: Option<AdaptBy>,
    /// Relative tolerance that FMUs without one of their own are given; what each one's DefaultExperiment says unless given.
    pub tolerance: Option<f64>,
    /// Share of each signal's largest value to which an iteration has to agree.
    pub iteration_tolerance: Option<f64>,
    /// Most iterations.
    pub iterations: Option<usize>,
}

impl Master {
    /// The plain master of one FMU, a second long.
    pub(crate) fn plain() -> Master {
        Master {
            method: gauss_seidel(),
            inputs: None,
            shape: None,
            order: Vec::new(),
            start: 0.0,
            stop: 1.0,
            step: None,
            adapt: None,
            tolerance: None,
            iteration_tolerance: None,
            iterations: None,
        }
    }
}

impl Master {
    /// From the earliest start to the latest end of these default experiments, as far as they say.
    pub(crate) fn within<'a>(self, all: impl Iterator<Item = &'a Description> + Clone) -> Master {
        let start = all.clone().filter_map(|d| d.start_time).fold(f64::INFINITY, f64::min);
        let stop = all.filter_map(|d| d.stop_time).fold(f64::NEG_INFINITY, f64::max);
        let start = if start.is_finite() { start } else { self.start };
        let stop = if stop.is_finite() && stop > start { stop } else { start + (self.stop - self.start) };
        Master { start, stop, ..self }
    }
}

fn gauss_seidel() -> Spanned<String> {
    Spanned::new(0..0, "gauss-seidel".into())
}

/// `[[touch]]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TouchOf {
    /// `fmu.output`.
    #[schemars(with = "String")]
    pub of: Spanned<String>,
    /// Level.
    #[serde(default)]
    pub at: f64,
}

/// `[[lookahead]]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LookaheadOf {
    /// `fmu.parameter`: a tunable Real in s.
    #[schemars(with = "String")]
    pub variable: Spanned<String>,
    /// Coming steps.
    pub steps: f64,
}

/// `[[bond]]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BondOf {
    /// `fmu.output`.
    #[schemars(with = "String")]
    pub force: Spanned<String>,
    /// `fmu.output`.
    #[schemars(with = "String")]
    pub velocity: Spanned<String>,
    /// `fmu.variable` with the work done against the force, J.
    #[schemars(with = "Option<String>")]
    pub work: Option<Spanned<String>>,
    /// `fmu.variable`s that add up to the energy taken, J.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub energy: Vec<Spanned<String>>,
}

/// `[results]`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// `fmu.variable`s; `fmu.*` for all its outputs; all outputs of all FMUs unless given.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub record: Vec<Spanned<String>>,
    /// Every how many macro-steps a row is written; touches always are. 1 unless given.
    pub every: Option<u64>,
    /// Parquet instead of CSV.
    #[serde(default)]
    pub parquet: bool,
}

/// A system of FMUs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct System {
    /// Name.
    pub name: Option<String>,
    /// FMUs.
    pub fmu: Vec<Component>,
    /// Connections.
    #[serde(default)]
    pub connect: Vec<Connection>,
    /// Master.
    pub master: Master,
    /// Touches to land on.
    #[serde(default)]
    pub touch: Vec<TouchOf>,
    /// Lookaheads to keep.
    #[serde(default)]
    pub lookahead: Vec<LookaheadOf>,
    /// Power bonds.
    #[serde(default)]
    pub bond: Vec<BondOf>,
    /// Results.
    #[serde(default)]
    pub results: Results,
    /// The file, for messages.
    #[serde(skip)]
    pub path: PathBuf,
    /// Its text, for the lines of messages; empty for an archive.
    #[serde(skip)]
    pub text: String,
    /// Where FMUs of relative path lie.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Where somebody else's FMUs run.
    #[serde(skip)]
    pub isolation: Isolation,
    /// What was noticed while it was read.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// What keeps unpacked archives.
    #[serde(skip)]
    pub keep: Vec<std::sync::Arc<output::Scratch>>,
}

impl System {
    /// These FMUs by themselves, read from `path`, their files in `folder`: nothing connected, the plain master.
    pub(crate) fn of(fmu: Vec<Component>, path: &Path, folder: &Path) -> System {
        System {
            name: None,
            fmu,
            connect: Vec::new(),
            master: Master::plain(),
            touch: Vec::new(),
            lookahead: Vec::new(),
            bond: Vec::new(),
            results: Results::default(),
            path: path.to_path_buf(),
            text: String::new(),
            folder: folder.to_path_buf(),
            isolation: crate::Isolation::None,
            notes: Vec::new(),
            keep: Vec::new(),
        }
    }

    /// Whether a file is a system, by its ending or by its tables.
    pub fn is_one(path: &Path) -> bool {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp")) {
            return true;
        }
        let text = input::text(path, input::TEXT).unwrap_or_default();
        text.lines().any(|l| l.trim_start().starts_with("[[fmu]]"))
    }

    /// Reads a system file or an SSP archive.
    ///
    /// # Errors
    /// Names the file, the line and the cure.
    pub fn load(path: &Path) -> Result<System> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp")) {
            return super::ssp::load(path).with_context(|| format!("{}", path.display()));
        }
        let name = path.display();
        let text = input::text(path, input::TEXT)
            .with_context(|| format!("{name}: cannot be read; give the path of a system file"))?;
        let mut s: System = toml::from_str(&text).map_err(|e| {
            let line = e.span().map_or(String::new(), |s| format!("{}:", line_of(&text, s.start)));
            anyhow!("{name}:{line} {}; correct it or leave it out", record::words::with_meant(e.message()))
        })?;
        s.folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        s.path = path.to_path_buf();
        s.text = text;
        Ok(s)
    }

    /// The files of the FMUs that it names, but ours.
    pub fn fmus(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.fmu.iter().filter(|c| c.own().is_none()).map(|c| self.folder.join(c.file.get_ref()))
    }

    /// An error at a place of the file.
    pub(super) fn at(&self, span: std::ops::Range<usize>, what: &str) -> anyhow::Error {
        anyhow!("{}: {what}", self.place(span))
    }

    /// An error with the place of the file that it is about.
    pub(super) fn within(&self, span: std::ops::Range<usize>, e: impl Into<anyhow::Error>) -> anyhow::Error {
        e.into().context(self.place(span))
    }

    fn place(&self, span: std::ops::Range<usize>) -> String {
        if self.text.is_empty() {
            return self.path.display().to_string();
        }
        format!("{}:{}", self.path.display(), line_of(&self.text, span.start))
    }

    /// The name, or the file's.
    pub fn title(&self) -> String {
        let stem = || self.path.file_stem().map_or("system".into(), |n| n.to_string_lossy().into_owned());
        self.name.clone().unwrap_or_else(stem)
    }
}

/// The files that the system at `path` consists of: itself, and the FMUs it names; an archive or one FMU is all there is.
///
/// # Errors
/// As [`System::load`].
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>> {
    let mut all = vec![path.to_path_buf()];
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp") || e.eq_ignore_ascii_case("fmu")) {
        return Ok(all);
    }
    let s = System::load(path)?;
    all.extend(s.fmus());
    Ok(all)
}

fn line_of(text: &str, byte: usize) -> usize {
    1 + text.as_bytes()[..byte.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_an_end_of_its_own_lasts_as_long_as_the_default_experiments() {
        let of = |start, stop| {
            let mut d = Description::default();
            (d.start_time, d.stop_time) = (start, stop);
            d
        };
        let within = |all: &[Description]| {
            let m = Master::plain().within(all.iter());
            (m.start, m.stop)
        };
        assert_eq!(within(&[of(None, Some(1e-3))]), (0.0, 1e-3));
        assert_eq!(within(&[of(Some(2.0), Some(3.0)), of(Some(1.0), Some(2.5)), of(None, None)]), (1.0, 3.0));
        // what is no end is none
        assert_eq!(within(&[of(Some(5.0), Some(5.0))]), (5.0, 6.0));
        assert_eq!(within(&[]), (0.0, 1.0));
    }
}
