//! Archives that would write or read elsewhere, or never end.

use crate::fixture::Place;
use std::io::Write;
use std::path::Path;

fn archive(path: &Path, files: &[(&str, &[u8])]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// What a system of this FMU is refused with.
fn fmu_refused(files: &[(&str, &[u8])]) -> String {
    let place = Place::new();
    archive(&place.path().join("x.fmu"), files);
    let e = place.run("[[fmu]]\nname = \"x\"\nfile = \"x.fmu\"\n[master]\nstop = 0.01\nstep = 1e-3\n", &[]);
    assert_eq!(e.code, Some(2), "{}", e.said);
    assert!(e.said.contains("file.toml:3: ") && e.said.contains("x.fmu: "), "{}", e.said);
    e.said
}

/// What an SSP archive is refused with.
fn ssp_refused(ssd: &str) -> String {
    let place = Place::new();
    archive(&place.path().join("x.ssp"), &[("SystemStructure.ssd", ssd.as_bytes())]);
    let o = place.touchdown(&["run", "x.ssp", "--out", "out"]);
    assert_eq!(o.code, Some(2), "{}", o.said);
    assert!(o.said.contains("x.ssp: "), "{}", o.said);
    o.said
}

fn structure(component: &str) -> String {
    format!(
        "<SystemStructureDescription version=\"1.0\">\n<System>\n<Elements>\n{component}\n</Elements>\n</System>\n\
         </SystemStructureDescription>"
    )
}

#[test]
fn an_identifier_that_climbs_is_refused() {
    let xml = "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"x\" guid=\"x\">\
               <CoSimulation modelIdentifier=\"../../../x\"/></fmiModelDescription>";
    let said = fmu_refused(&[("modelDescription.xml", xml.as_bytes())]);
    assert!(
        said.contains("modelIdentifier \"../../../x\" is no name of a file; FMI 2.0 wants a C identifier"),
        "{said}"
    );
}

#[test]
fn an_entry_that_climbs_is_refused() {
    let said = fmu_refused(&[("modelDescription.xml", b"<a/>"), ("../escaped", b"x")]);
    assert!(said.contains("\"../escaped\" in it leads out of the archive"), "{said}");
}

#[test]
fn elements_inside_each_other_without_end_are_refused() {
    let deep = "<a>\n".repeat(150_000) + &"</a>".repeat(150_000);
    let said = fmu_refused(&[("modelDescription.xml", deep.as_bytes())]);
    assert!(said.contains("modelDescription.xml:"), "{said}");
    let said = ssp_refused(&deep);
    assert!(said.contains("SystemStructure.ssd:101: more than 100 elements inside each other"), "{said}");
}

#[test]
fn a_source_or_binding_outside_is_refused_with_its_line() {
    let said = ssp_refused(&structure("<Component name=\"a\" source=\"../../x.fmu\"/>"));
    assert!(said.contains("SystemStructure.ssd:4: \"../../x.fmu\" is no path inside the archive"), "{said}");
    let bound = "<Component name=\"a\" source=\"a.fmu\"><ParameterBindings>\
                 <ParameterBinding source=\"/etc/passwd\"/></ParameterBindings></Component>";
    let said = ssp_refused(&structure(bound));
    assert!(said.contains("\"/etc/passwd\" is no path inside the archive"), "{said}");
}
