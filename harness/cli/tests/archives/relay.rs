//! Compiles fixtures/relay.c and packs it with the descriptions that tests want, into FMUs, system files and SSP archives.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Units and types that the descriptions have.
const UNITS: &str = r#"<Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>
    <Unit name="K"><BaseUnit K="1"/></Unit><Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>"#;
const TYPES: &str = r#"<SimpleType name="Rise"><Real unit="degC" relativeQuantity="true" min="-5" max="200" nominal="10"/></SimpleType>
    <SimpleType name="Valve"><Enumeration><Item name="shut" value="1"/><Item name="open" value="4"/></Enumeration></SimpleType>
    <SimpleType name="Lamp"><Enumeration><Item name="off" value="7"/><Item name="on" value="8"/></Enumeration></SimpleType>"#;

fn library() -> &'static Path {
    static DIR: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    &DIR.get_or_init(|| {
        let dir = TempDir::new().unwrap();
        let out = dir.path().join("relay.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/relay.c");
        let mut cc = Command::new("cc");
        cc.args(["-std=c99", "-O1", "-Wall", "-shared", "-fPIC", "-o"]).args([&out, &source]);
        let done = cc.output().expect("a C compiler called cc");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        (dir, out)
    })
    .1
}

/// A variable: `Real.3 input gap unit="mm"` is the Real of reference 3, an input called gap.
fn variable(text: &str) -> String {
    let mut words = text.splitn(4, ' ');
    let (kind, causality, name) = (words.next().unwrap(), words.next().unwrap(), words.next().unwrap());
    let attributes = words.next().unwrap_or_default();
    let (kind, reference) = kind.split_once('.').unwrap();
    let variability = match (causality, kind) {
        ("parameter", _) => "fixed",
        (_, "Real") => "continuous",
        _ => "discrete",
    };
    format!(
        r#"<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}">
        <{kind} {attributes}/></ScalarVariable>"#
    )
}

/// The bytes of an FMU with these variables; `more`: attributes of its CoSimulation element, then of its DefaultExperiment.
pub fn fmu(more: (&str, &str), variables: &[&str]) -> Vec<u8> {
    let outputs = variables.iter().enumerate().filter(|(_, v)| v.contains(" output "));
    let outputs: String = outputs.map(|(i, _)| format!("<Unknown index=\"{}\" dependencies=\"\"/>", i + 1)).collect();
    let variables: String = variables.iter().map(|v| variable(v)).collect();
    let (flags, experiment) = more;
    let xml = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="relay" guid="r">
<CoSimulation modelIdentifier="relay" {flags}/>
<UnitDefinitions>{UNITS}</UnitDefinitions><TypeDefinitions>{TYPES}</TypeDefinitions>
<DefaultExperiment {experiment}/>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"#
    );
    zipped(&[
        ("modelDescription.xml", xml.as_bytes()),
        ("binaries/linux64/relay.so", &std::fs::read(library()).unwrap()),
    ])
}

pub const FREE: &str = r#"canHandleVariableCommunicationStepSize="true""#;

/// The bytes of a zip archive.
pub fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A folder with files in it.
pub fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

/// What a run has come to.
pub struct Ran {
    pub code: Option<i32>,
    /// Both streams.
    pub said: String,
    /// Names of the columns, and the rows.
    pub head: Vec<String>,
    pub rows: Vec<Vec<f64>>,
}

impl Ran {
    /// The last value of a column, by its name without the unit.
    pub fn last(&self, name: &str) -> f64 {
        let at = self.head.iter().position(|h| h.split(" [").next() == Some(name));
        let at = at.unwrap_or_else(|| panic!("no {name} in {:?}: {}", self.head, self.said));
        self.rows.last().unwrap()[at]
    }
}

fn said(o: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&o.stdout), String::from_utf8_lossy(&o.stderr))
}

/// Runs touchdown.
pub fn touchdown(arguments: &[&str]) -> (Option<i32>, String) {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).env("NO_COLOR", "1").output().unwrap();
    (o.status.code(), said(&o))
}

/// Runs a system file or an archive in a folder.
pub fn run(folder: &Path, file: &str, more: &[&str]) -> Ran {
    let out = folder.join("out");
    let _ = std::fs::remove_dir_all(&out);
    let (path, into) = (folder.join(file), out.to_str().unwrap().to_string());
    let (code, said) = touchdown(&[&["run", path.to_str().unwrap(), "--out", &into], more].concat());
    let text = std::fs::read_to_string(out.join("results.csv")).unwrap_or_default();
    let mut lines = text.lines();
    let head = lines.next().unwrap_or_default().split(',').map(String::from).collect();
    let rows = lines.map(|l| l.split(',').map(|c| c.parse().unwrap()).collect()).collect();
    Ran { code, said, head, rows }
}

/// Writes a system file of these FMUs, each a name and a file, and runs it.
pub fn run_toml(folder: &Path, fmus: &[(&str, &str)], rest: &str) -> Ran {
    let fmus: String = fmus.iter().map(|(n, f)| format!("[[fmu]]\nname = \"{n}\"\nfile = \"{f}\"\n")).collect();
    std::fs::write(folder.join("system.toml"), format!("{fmus}{rest}")).unwrap();
    run(folder, "system.toml", &[])
}
