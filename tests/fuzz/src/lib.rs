//! What reads other people's bytes, each as a function of any bytes: it ends, without a panic, whatever they are.

use host::master::System;
use host::Description;
use hysteresis_contact::{instance::Instance, state};
use scenario::Scenario;
use std::io::Write;
use std::path::Path;

/// A target: its name, and what it does with bytes.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 8] = [
    ("description", description),
    ("system", system),
    ("ssp", ssp),
    ("scenario", scenario_file),
    ("campaign", campaign),
    ("recording", recording),
    ("state", state_bytes),
    ("calls", face::drive::calls::<Instance>),
];

/// The function of a target's name.
pub fn target(name: &str) -> Option<fn(&[u8])> {
    TARGETS.iter().find(|t| t.0 == name).map(|t| t.1)
}

/// Calls `with` on a file of that name that holds `data`.
fn in_file(name: &str, data: &[u8], with: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, data).expect("a temporary file");
    with(&path);
}

/// modelDescription.xml of an FMU.
fn description(data: &[u8]) {
    drop(Description::read(data));
}

/// A system of FMUs.
fn system(data: &[u8]) {
    in_file("system.toml", data, |path| drop(System::load(path)));
}

/// SystemStructure.ssd of an SSP archive.
fn ssp(data: &[u8]) {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    zip.start_file("SystemStructure.ssd", stored).expect("an entry");
    zip.write_all(data).expect("its bytes");
    let bytes = zip.finish().expect("an archive").into_inner();
    in_file("system.ssp", &bytes, |path| drop(System::load(path)));
}

/// A drop test or a contactor's opening.
fn scenario_file(data: &[u8]) {
    in_file("scenario.toml", data, |path| {
        if let Ok(s) = Scenario::load(path) {
            drop(s.cases());
        }
    });
}

/// campaign.toml, and behind a line `%%` a recording.
fn campaign(data: &[u8]) {
    const PARTED: &[u8] = b"\n%%\n";
    let at = data.windows(PARTED.len()).position(|w| w == PARTED);
    let (toml, csv) = match at {
        Some(at) => (&data[..at], &data[at + PARTED.len()..]),
        None => (data, &b""[..]),
    };
    in_file("campaign.toml", toml, |path| {
        let folder = path.parent().expect("the folder it lies in");
        std::fs::write(folder.join("r01.csv"), csv).expect("a temporary file");
        if let Ok(c) = record::load(folder, &mechanisms::terms()) {
            let finite = |y: &Vec<f64>| y.iter().all(|v| v.abs() <= record::LARGEST);
            for r in &c.recordings {
                assert!(finite(&r.time) && r.channels.iter().flatten().all(finite), "a reading that is none");
            }
        }
    });
}

/// A recording by itself.
fn recording(data: &[u8]) {
    in_file("r.csv", data, |path| {
        if let Ok(s) = record::read_file(path) {
            assert!(s.time.windows(2).all(|w| w[1] > w[0]), "time does not increase");
        }
    });
}

/// Bytes as a state of the element: those that it takes it writes again.
fn state_bytes(data: &[u8]) {
    // the checksum is put right too, so that what lies behind it is reached
    let mut sealed = data.to_vec();
    sealed.resize(state::LAYOUT.length, 0);
    state::LAYOUT.seal(&mut sealed);
    for bytes in [data, &sealed[..]] {
        if let Ok(s) = state::from_bytes(bytes) {
            assert_eq!(state::to_bytes(&s)[..], bytes[..]);
        }
    }
}
