//! fixtures/hostile.c as an FMU, run through the command, and what it leaves behind.

use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// What the FMU does at 5 ms of 10 ms, as fixtures/hostile.c numbers it.
#[derive(Clone, Copy)]
pub enum Behaviour {
    Good,
    Segfaults,
    Aborts,
    NeverEnds,
    Exits,
    ExitsInAThread,
    EndsItsThread,
    OverflowsTheStack,
    TakesAllMemory,
    FloodsTheLog,
    LogsALongLine,
    LogsWhatIsNotThere,
    AnswersNan,
    AnswersNonsense,
    Fails,
    IsFatal,
    Prints,
    ChangesRoundingAndTraps,
    ClosesFiles,
    KillsItsGroup,
    LeavesAProcess,
    WritesBeyondInGet,
    DividesByZero,
    ScribblesOverSharedMemory,
    NeverFrees,
    SegfaultsInFree,
    SegfaultsInInitialization,
    CutsSharedMemory,
    IsTracedByItsChild,
    LeavesAProcessOfItsOwnGroup,
    LeavesAProcessOfItsOwnGroupAndCrashes,
    LocksItsFolder,
    LogsWhatSteersATerminal,
}

const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Hostile" guid="{hostile}" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="hostile" canHandleVariableCommunicationStepSize="true"
    canBeInstantiatedOnlyOncePerProcess="true"/>
  <UnitDefinitions>
    <Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit><Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="penetration" valueReference="0" causality="input"><Real unit="m" start="0"/></ScalarVariable>
    <ScalarVariable name="velocity" valueReference="1" causality="input"><Real unit="m/s" start="0"/></ScalarVariable>
    <ScalarVariable name="force" valueReference="2" causality="output"><Real unit="N"/></ScalarVariable>
    <ScalarVariable name="at" valueReference="3" causality="parameter" variability="tunable"><Real unit="s" start="0"/></ScalarVariable>
    <ScalarVariable name="behaviour" valueReference="0" causality="parameter" variability="tunable"><Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" dependencies="1 2"/></Outputs></ModelStructure>
</fmiModelDescription>
"#;

/// The library compiled with a definition, once a process.
fn library(define: &str) -> PathBuf {
    static BUILT: Mutex<Option<TempDir>> = Mutex::new(None);
    let mut built = BUILT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = built.get_or_insert_with(|| TempDir::new().unwrap()).path();
    let out = folder.join(format!("hostile{define}.so"));
    if !out.exists() {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/hostile.c");
        let done = Command::new("cc")
            .args(["-std=c99", "-O1", "-Wall", "-Wextra", "-Wno-infinite-recursion", "-shared", "-fPIC"])
            .arg(format!("-D{define}"))
            .arg("-o")
            .args([&out, &source])
            .args(["-lm", "-lpthread"])
            .output()
            .expect("a C compiler called cc");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    out
}

/// A folder with hostile.fmu, a folder for temporary files, and one for results.
pub struct Place {
    folder: TempDir,
}

/// How a command ended.
pub struct Ended {
    pub code: Option<i32>,
    /// Standard error.
    pub said: String,
    /// Standard output.
    pub answer: String,
    /// Rows of results.csv, or of what there is of it.
    pub rows: Vec<String>,
    /// log.txt, or what there is of it.
    pub log: String,
}

impl Place {
    pub fn new() -> Place {
        Place::compiled("PLAIN")
    }

    /// With the library compiled with a definition.
    pub fn compiled(define: &str) -> Place {
        let folder = TempDir::new().unwrap();
        let mut zip = zip::ZipWriter::new(std::fs::File::create(folder.path().join("hostile.fmu")).unwrap());
        let so = std::fs::read(library(define)).unwrap();
        for (name, bytes) in [("modelDescription.xml", DESCRIPTION.as_bytes()), ("binaries/linux64/hostile.so", &so)] {
            zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap();
        std::fs::create_dir(folder.path().join("tmp")).unwrap();
        Place { folder }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// `touchdown run` of a file with this text; no temporary file and no process of it may stay.
    pub fn run(&self, text: &str, options: &[&str]) -> Ended {
        std::fs::write(self.path().join("file.toml"), text).unwrap();
        let mut arguments = vec!["run", "file.toml", "--out", "out"];
        arguments.extend(options);
        self.touchdown(&arguments)
    }

    /// The command, here, with its own folder for temporary files.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
        c.args(arguments).current_dir(self.path()).env("TMPDIR", self.path().join("tmp"));
        c
    }

    /// The command to its end; no temporary file and no process of it may stay.
    pub fn touchdown(&self, arguments: &[&str]) -> Ended {
        let path = self.folder.path();
        let o = self.command(arguments).output().unwrap();
        let text = |name: &str| std::fs::read_to_string(path.join("out").join(name));
        let of = |name: &str, partial: &str| text(name).or_else(|_| text(partial)).unwrap_or_default();
        let rows = of("results.csv", "results.partial.csv");
        let ended = Ended {
            code: o.status.code(),
            said: String::from_utf8_lossy(&o.stderr).into_owned(),
            answer: String::from_utf8_lossy(&o.stdout).into_owned(),
            rows: rows.lines().skip(1).map(String::from).collect(),
            log: of("log.txt", "log.partial.txt"),
        };
        let left: Vec<_> = std::fs::read_dir(path.join("tmp")).unwrap().flatten().map(|e| e.path()).collect();
        assert!(left.is_empty(), "temporary files stay: {left:?}; {}", ended.said);
        self.holds_no_process();
        ended
    }

    /// No process that was started here runs any more.
    pub fn holds_no_process(&self) {
        assert!(none_run_with(&self.path().join("tmp")), "a process stays");
    }

    /// Text of a system of the FMU alone, 10 ms in steps of 0.1 ms.
    pub fn text(behaviour: Behaviour) -> String {
        format!(
            "[[fmu]]\nname = \"bad\"\nfile = \"hostile.fmu\"\n[fmu.set]\nbehaviour = {}\nat = 0.005\n\
             [master]\nstop = 0.01\nstep = 1e-4\n",
            behaviour as i32
        )
    }

    /// `touchdown run` of that system.
    pub fn system(&self, behaviour: Behaviour, options: &[&str]) -> Ended {
        self.run(&Place::text(behaviour), options)
    }
}

/// Whether within some seconds no process is left that was started with this TMPDIR.
fn none_run_with(tmp: &Path) -> bool {
    let mut wanted = b"TMPDIR=".to_vec();
    wanted.extend(tmp.as_os_str().as_bytes());
    let until = Instant::now() + Duration::from_secs(10);
    loop {
        let processes = std::fs::read_dir("/proc").unwrap().flatten();
        let runs = processes.filter_map(|p| std::fs::read(p.path().join("environ")).ok());
        if !runs.into_iter().any(|e| e.split(|b| *b == 0).any(|v| v == wanted)) {
            return true;
        }
        if Instant::now() > until {
            return false;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

impl Ended {
    /// The FMU died in a function at a time: exit code 4, all named, and the rows until then are there.
    pub fn died(&self, function: &str, time: &str, how: &str) {
        assert_eq!(self.code, Some(4), "{}", self.said);
        for part in ["hostile.fmu", function, how] {
            assert!(self.said.contains(part), "no {part:?} in {}", self.said);
        }
        assert!(self.said.contains(&format!("at simulation time {time}")), "{}", self.said);
    }

    /// It went on to the end.
    pub fn is_whole(&self) {
        assert_eq!(self.code, Some(0), "{}", self.said);
        assert_eq!(self.rows.len(), 101, "{}", self.said);
    }
}
