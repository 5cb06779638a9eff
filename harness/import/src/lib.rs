//! From the files that instruments write to a campaign of format `recordings/1`.
//!
//! Data go one way: a file's columns get their roles (`guess`), those of several clocks are brought onto one (`join`), parted into recordings that lie side by side (`split`), read
//! once for where the impacts lie (`survey`, `find`), made into a plan with what is known of each recording (`plan`), read a
//! second time for the samples around the impacts (`cut`), and written (`write`). Memory does not grow with the length of a
//! file. Nothing is asked here: what is missing is in the plan.

mod amount;
mod cut;
mod envelope;
mod facts;
mod find;
mod guess;
mod join;
mod list;
mod map;
mod names;
mod page;
mod plan;
mod split;
mod survey;
mod table;
mod words;
mod write;

pub use amount::amount;
pub use facts::Facts;
pub use list::{list, Listed, ListedChannel, ListedGroup};
pub use map::{parse as parse_map, Mapped};
pub use names::Pattern;
pub use page::NAME as PAGE;
pub use plan::{plan, Given, Missing, Plan, Planned};
pub use survey::File;
pub use table::Table;
pub use write::{Outcome, Written};

use instruments::{Fault, Source};
use rayon::prelude::*;
use record::Kind;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Opens a file; `instruments::open`, or a test's own.
pub type Open<'a> = &'a (dyn Fn(&Path) -> Result<Box<dyn Source>, Fault> + Sync);

/// What the user says.
#[derive(Clone, Debug)]
pub struct Options {
    pub map: Vec<Mapped>,
    /// Pattern of the files' names.
    pub names: Option<Pattern>,
    pub table: Option<Table>,
    /// Samples per second, where no file gives time.
    pub rate: Option<f64>,
    pub kind: Option<Kind>,
    /// kg
    pub mass: Option<f64>,
    /// m
    pub travel: Option<f64>,
    /// N/m
    pub spring_rate: Option<f64>,
    /// Said of every recording.
    pub all: Facts,
    /// Asked of files.
    pub asked: BTreeMap<PathBuf, Facts>,
    /// Recordings are not cut, and not parted at impacts.
    pub keep_all: bool,
    /// Columns of one kind are recordings of their own.
    pub split_columns: bool,
    /// Share of a file's hardest impact that another has to reach to be a recording.
    pub least: f64,
    /// Files that hold no recording are left out, not refused.
    pub skip_bad: bool,
    /// The campaign's name.
    pub name: String,
    pub material: Option<String>,
    pub terms: Option<Vec<String>>,
    /// Name and value of each line at the foot of the page: where it comes from.
    pub trace: Vec<(String, String)>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            map: Vec::new(),
            names: None,
            table: None,
            rate: None,
            kind: None,
            mass: None,
            travel: None,
            spring_rate: None,
            all: Facts::default(),
            asked: BTreeMap::new(),
            keep_all: false,
            split_columns: false,
            least: 0.05,
            skip_bad: false,
            name: "campaign".into(),
            material: None,
            terms: None,
            trace: Vec::new(),
        }
    }
}

/// Looks at a file: what it holds, and where the impacts lie.
///
/// # Errors
/// Everything that is not clear or cannot be read, each with the file, the place and the cure.
fn look(path: &Path, o: &Options, open: Open) -> Result<File, Vec<String>> {
    let mut source = open(path).map_err(|e| vec![e.to_string()])?;
    let joined = join::plan(source.as_mut(), o).map_err(|e| vec![format!("{}: {e}", path.display())])?;
    let mut tables = join::opened(path, source, open, joined.clone());
    survey::survey(path, &mut tables, o, Some(&joined))
}

/// Looks at files, several at once, in their order; `done` is called after each.
pub fn look_at(
    paths: &[PathBuf],
    o: &Options,
    open: Open,
    done: &(dyn Fn(&Path) + Sync),
) -> Vec<Result<File, Vec<String>>> {
    let one = |path: &PathBuf| {
        let file = look(path, o, open);
        done(path);
        file
    };
    paths.par_iter().map(one).collect()
}

/// Writes the campaign into the folder `out`, which appears whole or not at all.
///
/// # Errors
/// Everything that keeps it from being written; then nothing is.
pub fn write(out: &Path, files: &[File], plan: &Plan, o: &Options, open: Open) -> Result<Outcome, Vec<String>> {
    let unwritable = |e| vec![write::unwritten(&out.display().to_string(), &e)];
    let answer = output::Answer::begin(out, "import").map_err(unwritable)?;
    let outcome = write::fill(&answer, files, plan, o, open)?;
    answer.commit().map_err(unwritable)?;
    Ok(outcome)
}
