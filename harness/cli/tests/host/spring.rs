//! Compiles fixtures/spring.c and packs it as an FMU.

use host::Fmu;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Every capability there is.
pub const ALL: &str = r#"canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true"
    maxOutputDerivativeOrder="1" canRunAsynchronuously="true" canGetAndSetFMUstate="true"
    canSerializeFMUstate="true" providesDirectionalDerivative="true""#;

/// A description of the spring: flags of its CoSimulation element, and the attributes of its output.
pub fn description(flags: &str, output: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<!-- with attributes and elements of a vendor that no schema knows -->
<fmiModelDescription fmiVersion="2.0" modelName="Acme.Spring" guid="{{5b1c0e5e-spring}}" vendorSeat="7"
    generationTool="Acme &amp; Sons" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="spring" {flags} acmeTurbo="yes"/>
  <UnitDefinitions>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/><DisplayUnit name="um" factor="1000"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions><SimpleType name="Depth"><Real quantity="Length" unit="mm"/></SimpleType></TypeDefinitions>
  <LogCategories><Category name="logStatusError"/><Category name="logStatusWarning"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>
  <VendorAnnotations><Tool name="Acme"><acme:colour xmlns:acme="urn:acme" hue="red"/></Tool></VendorAnnotations>
  <ModelVariables>
    <ScalarVariable name="depth" valueReference="0" causality="input" acmeKnob="3"><Real declaredType="Depth" start="0"/></ScalarVariable>
    <ScalarVariable name="speed" valueReference="1" causality="input"><Real unit="m/s" start="0"/></ScalarVariable>
    <ScalarVariable name="push" valueReference="2" causality="output"><Real unit="N"/></ScalarVariable>
    <ScalarVariable name="creep" valueReference="3"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="rate" valueReference="4" causality="parameter" variability="tunable"><Real start="1000"/></ScalarVariable>
    <ScalarVariable name="dash" valueReference="5" causality="parameter" variability="tunable"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="tau" valueReference="6" causality="parameter" variability="fixed"><Real unit="s" start="1e300"/></ScalarVariable>
    <ScalarVariable name="misbehave" valueReference="0" causality="parameter" variability="tunable"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="direct" valueReference="0" causality="parameter" variability="tunable"><Boolean start="false"/></ScalarVariable>
    <ScalarVariable name="label" valueReference="0" causality="parameter" variability="tunable"><String start="spring"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" {output}/></Outputs></ModelStructure>
</fmiModelDescription>
"#
    )
}

/// The compiled library, once a process.
fn library() -> &'static Path {
    static DIR: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    &DIR.get_or_init(|| {
        let dir = TempDir::new().unwrap();
        let out = dir.path().join("spring.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/spring.c");
        let done = Command::new("cc")
            .args(["-std=c99", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", "-o"])
            .args([&out, &source])
            .arg("-lm")
            .output()
            .expect("a C compiler called cc");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        (dir, out)
    })
    .1
}

/// Writes a zip archive of the files.
pub fn archive(path: &Path, files: &[(&str, &[u8])]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// Writes an FMU of the spring with that description into a folder.
pub fn write(folder: &Path, xml: &str) -> PathBuf {
    let path = folder.join("spring.fmu");
    let so = std::fs::read(library()).unwrap();
    archive(&path, &[("modelDescription.xml", xml.as_bytes()), ("binaries/linux64/spring.so", &so)]);
    path
}

/// An FMU of the spring with that description, in a file that goes again once it is open.
pub fn open(xml: &str) -> Fmu {
    let dir = TempDir::new().unwrap();
    Fmu::open(&write(dir.path(), xml)).unwrap()
}

/// The spring with every capability, its output stepped for.
pub fn able() -> Fmu {
    open(&description(ALL, r#"dependencies="""#))
}

/// The spring with every capability, its output declared to follow its inputs.
pub fn direct() -> Fmu {
    open(&description(ALL, r#"dependencies="1 2""#))
}
