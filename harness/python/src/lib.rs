//! The native half of the Python package `touchdown_impact`: the tasks of the commands, called from Python.
//!
//! Options come in by name and are checked by the tasks; what comes out is the JSON text that the command prints with
//! `--json`. The package makes objects of it. Nothing here is for users.

mod follow;

use pyo3::prelude::*;

pyo3::create_exception!(
    touchdown_impact,
    TouchdownError,
    pyo3::exceptions::PyException,
    "What is wrong, where, and the cure, in the words of the command."
);

/// The words of an error, control characters spelled out: they may come from files, and from names of folders.
fn said(e: &anyhow::Error) -> String {
    format!("{e:#}").lines().map(touchdown::print::spelled_out).collect::<Vec<_>>().join("\n")
}

/// As a Python exception, in the words of the command.
fn error(e: anyhow::Error) -> PyErr {
    TouchdownError::new_err(said(&e))
}

/// As Python's exception for what the system refuses, where it is that; else in the words of the command.
fn of_system(e: anyhow::Error) -> PyErr {
    match e.chain().find_map(|c| c.downcast_ref::<std::io::Error>()) {
        Some(cause) => std::io::Error::new(cause.kind(), said(&e)).into(),
        None => error(e),
    }
}

/// The native module.
#[pymodule(name = "_native")]
mod native {
    use super::follow::followed;
    use super::{error, follow, of_system};
    use anyhow::{Context, Result};
    use estimate::case::Method;
    use pyo3::prelude::*;
    use pyo3::types::{PyBytes, PyDict, PyList};
    use serde::Serialize;
    use serde_json::{json, Value};
    use std::path::PathBuf;
    use std::process::ExitCode;
    use std::sync::atomic::AtomicBool;
    use touchdown::tasks;

    #[pymodule_export]
    use super::TouchdownError;

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");

    /// Where the module lies, and how its process for somebody else's FMU is started: the interpreter and its arguments.
    #[pyfunction]
    fn lies_at(module: PathBuf, interpreter: PathBuf, arguments: Vec<String>) {
        ::pack::lies_at(module);
        host::served_by(interpreter, arguments.into_iter().map(Into::into).collect());
    }

    /// Serves somebody else's FMU in this process, and ends it.
    #[pyfunction]
    fn serve() {
        std::process::exit(i32::from(host::serve() != ExitCode::SUCCESS));
    }

    /// Runs the command line of these words, in a process that does nothing else; its exit code. What it starts processes of its
    /// own by: `program`.
    #[pyfunction]
    fn command(py: Python<'_>, words: Vec<String>, program: Vec<String>) -> u8 {
        tasks::shard::started_by(program.into_iter().map(Into::into).collect());
        let words = std::iter::once("touchdown".to_string()).chain(words).collect();
        let code = py.detach(|| touchdown::commands::main_of(words));
        (0..=u8::MAX).find(|n| ExitCode::from(*n) == code).unwrap_or(2)
    }

    /// What holds somebody else's FMU.
    #[derive(FromPyObject)]
    #[pyo3(from_item_all)]
    struct Fmus {
        in_process: bool,
        fmu_seconds: f64,
        fmu_memory: Option<u64>,
    }

    impl Fmus {
        fn isolation(&self, stop: &'static AtomicBool) -> Result<host::Isolation> {
            tasks::isolation(self.in_process, self.fmu_seconds, self.fmu_memory, stop)
        }
    }

    fn text(value: &impl Serialize) -> Result<String> {
        serde_json::to_string(value).context("the answer cannot be written as JSON")
    }

    #[pyfunction]
    #[pyo3(signature = (campaigns, out, platforms, jobs, bootstrap, seconds, resume, fmus, notify))]
    #[allow(clippy::too_many_arguments)]
    fn diagnose(
        py: Python<'_>,
        campaigns: Vec<PathBuf>,
        out: PathBuf,
        platforms: Option<PathBuf>,
        jobs: Option<usize>,
        bootstrap: usize,
        seconds: Option<f64>,
        resume: bool,
        fmus: Fmus,
        notify: Py<PyAny>,
    ) -> PyResult<String> {
        followed(py, &notify, move |follow| {
            let isolation = fmus.isolation(follow.stop())?;
            let o = tasks::diagnose::Options {
                campaigns,
                out,
                platforms,
                jobs,
                bootstrap,
                seconds,
                resume,
                isolation,
                replicates: None,
                alone: false,
                command: "touchdown_impact.diagnose".into(),
            };
            let done = tasks::diagnose::diagnose(&o, &follow)?;
            let answers: Vec<Value> = done.answers.iter().map(|a| json!([a.campaign, a.answer])).collect();
            let page = done.page.transpose()?;
            let left = [done.batch.left, done.batch.not_begun].concat();
            text(&json!({ "answers": answers, "page": page, "left": left }))
        })
    }

    #[pyfunction]
    fn fit(
        py: Python<'_>,
        campaign: PathBuf,
        out: PathBuf,
        method: String,
        seconds: f64,
        notify: Py<PyAny>,
    ) -> PyResult<String> {
        followed(py, &notify, move |follow| {
            let methods = [("simplex", Method::Simplex), ("lm", Method::LevenbergMarquardt)];
            let i = record::words::place("method", &method, &methods.map(|m| m.0)).map_err(anyhow::Error::msg)?;
            let o = tasks::fit::Options {
                campaign,
                out,
                method: methods[i].1,
                seconds,
                command: "touchdown_impact.fit".into(),
            };
            let done = tasks::fit::fit(&o, follow.as_ref())?;
            text(&json!({ "answer": done, "words": done.words }))
        })
    }

    #[pyfunction]
    #[pyo3(signature = (scenario, out, fmu, direct, parquet, step, stop, fmus, notify))]
    #[allow(clippy::too_many_arguments)]
    fn run(
        py: Python<'_>,
        scenario: PathBuf,
        out: PathBuf,
        fmu: Option<PathBuf>,
        direct: bool,
        parquet: bool,
        step: Option<f64>,
        stop: Option<f64>,
        fmus: Fmus,
        notify: Py<PyAny>,
    ) -> PyResult<String> {
        followed(py, &notify, move |follow| {
            let isolation = fmus.isolation(follow.stop())?;
            let o = tasks::run::Options {
                scenario,
                out,
                fmu,
                direct,
                parquet,
                isolation,
                step,
                stop,
                command: "touchdown_impact.run".into(),
            };
            let done = tasks::run::simulated(&o, follow.as_ref())?;
            match done.failure {
                Some(e) => Err(e),
                None => text(&json!({ "summary": done.summary, "words": done.words })),
            }
        })
    }

    #[pyfunction]
    #[allow(clippy::too_many_arguments)]
    fn pack(
        py: Python<'_>,
        model: String,
        out: PathBuf,
        starts: Vec<(String, String)>,
        binaries: Vec<String>,
        platforms: Option<PathBuf>,
    ) -> PyResult<String> {
        let o = tasks::pack::Options { model, out, starts, binaries, all_platforms: false, platforms };
        py.detach(|| text(&tasks::pack::packed(&o)?)).map_err(error)
    }

    #[pyfunction]
    fn impact(
        mass: f64,
        speed: f64,
        stiffness: f64,
        exponent: f64,
        damping: Option<f64>,
        restitution: Option<f64>,
    ) -> PyResult<String> {
        let o = tasks::impact::Options { mass, speed, stiffness, exponent, damping, restitution };
        tasks::impact::figures(&o).and_then(|f| text(&f)).map_err(error)
    }

    /// The flags of `touchdown import`.
    #[derive(FromPyObject)]
    #[pyo3(from_item_all)]
    struct Import {
        map: Vec<String>,
        rate: Option<f64>,
        names: Option<String>,
        table: Option<PathBuf>,
        height: Option<String>,
        speed: Option<String>,
        preload: Option<String>,
        kind: Option<String>,
        mass: Option<String>,
        travel: Option<String>,
        spring_rate: Option<String>,
        terms: Option<Vec<String>>,
        name: Option<String>,
        material: Option<String>,
        keep_all: bool,
        split_columns: bool,
        least: f64,
        skip_bad: bool,
    }

    #[pyfunction]
    fn import_(py: Python<'_>, files: Vec<PathBuf>, out: PathBuf, i: Import, notify: Py<PyAny>) -> PyResult<String> {
        let o = tasks::import::Options {
            files,
            out: Some(out),
            map: i.map,
            rate: i.rate,
            names: i.names,
            table: i.table,
            height: i.height,
            speed: i.speed,
            preload: i.preload,
            kind: i.kind,
            mass: i.mass,
            travel: i.travel,
            spring_rate: i.spring_rate,
            terms: i.terms,
            name: i.name,
            material: i.material,
            keep_all: i.keep_all,
            split_columns: i.split_columns,
            least: i.least,
            skip_bad: i.skip_bad,
            command: "touchdown_impact.import_".into(),
        };
        followed(py, &notify, move |follow| {
            let taken = tasks::import::imported(&o, None, follow.as_ref())?;
            text(&json!({ "taken": taken, "words": tasks::import::words(&taken) }))
        })
    }

    /// A campaign as the diagnosis takes it in, SI; courses as bytes of doubles.
    #[pyfunction]
    fn campaign<'py>(py: Python<'py>, folder: PathBuf) -> PyResult<Bound<'py, PyDict>> {
        touchdown::threads::get_ready(false).map_err(|e| super::TouchdownError::new_err(e.to_string()))?;
        let c = py.detach(|| touchdown::campaign::load(&folder)).map_err(error)?;
        let bytes = |y: &[f64]| PyBytes::new(py, &y.iter().flat_map(|v| v.to_ne_bytes()).collect::<Vec<u8>>());
        let of = PyDict::new(py);
        of.set_item("folder", &c.folder)?;
        of.set_item("name", &c.name)?;
        of.set_item("kind", c.kind.name())?;
        of.set_item("material", &c.material)?;
        of.set_item("mass", c.moving_mass)?;
        of.set_item("travel", c.travel)?;
        of.set_item("spring_rate", c.return_spring_rate)?;
        let simulation = PyDict::new(py);
        simulation.set_item("terms", &c.simulation.terms)?;
        simulation.set_item("k", c.simulation.k)?;
        simulation.set_item("p", c.simulation.p)?;
        simulation.set_item("mu_d", c.simulation.mu_d)?;
        of.set_item("simulation", simulation)?;
        of.set_item("warnings", &c.warnings)?;
        let recordings = PyList::empty(py);
        for r in &c.recordings {
            let one = PyDict::new(py);
            one.set_item("file", &r.file)?;
            one.set_item("order", r.order)?;
            one.set_item("level", &c.levels[r.level].1)?;
            one.set_item("height", r.drop_height)?;
            one.set_item("speed", r.impact_speed)?;
            one.set_item("start_speed", r.start_speed)?;
            one.set_item("preload", r.spring_preload)?;
            one.set_item("time", bytes(&r.time))?;
            for channel in record::Channel::ALL {
                one.set_item(channel.name(), r.channels[channel.index()].as_ref().map(|y| bytes(y)))?;
            }
            recordings.append(one)?;
        }
        of.set_item("recordings", recordings)?;
        Ok(of)
    }

    /// The bytes of a file of an answer.
    #[pyfunction]
    fn bytes_of<'py>(py: Python<'py>, folder: PathBuf, name: String) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| tasks::files::bytes(&folder, &name)).map_err(error)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Hands on a file of an answer; what is to be reported of a file that was in the way.
    #[pyfunction]
    fn copy_out(py: Python<'_>, folder: PathBuf, name: String, out: PathBuf) -> PyResult<Option<String>> {
        py.detach(|| tasks::files::copied(&folder, &name, &out)).map_err(of_system)
    }

    /// Writes the files of a campaign.
    #[pyfunction]
    fn write_campaign(py: Python<'_>, folder: PathBuf, files: Vec<(String, Vec<u8>)>) -> PyResult<()> {
        py.detach(|| tasks::files::campaign(&folder, &files)).map_err(of_system)
    }

    /// The sentence that sums a page of ours up; None where it has none.
    #[pyfunction]
    fn lead(page: &str) -> Option<String> {
        chart::lead(page)
    }

    /// Tasks that were left alone when they were interrupted, and are not over yet.
    #[pyfunction]
    fn left_alone() -> usize {
        follow::left_alone()
    }
}
