//! Campaigns that FMUs simulate.

mod failing;
mod foreign;
mod ours;
#[allow(dead_code)]
#[path = "../archives/relay.rs"]
mod relay;
mod two_bonds;

use std::path::Path;
use std::process::Command;

/// (exit code, standard output, standard error) of the command in `dir`.
fn touchdown(args: &[&str], dir: &Path) -> (Option<i32>, String, String) {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(args).current_dir(dir).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (o.status.code(), text(&o.stdout), text(&o.stderr))
}

/// The verdict on the campaign in `dir`, in its folder `out`, and what was said.
fn diagnosed(dir: &Path, options: &[&str]) -> (serde_json::Value, String) {
    let (code, _, said) = touchdown(&[&["diagnose", ".", "--out", "out", "--quiet"], options].concat(), dir);
    let answer = std::fs::read_dir(dir.join("out")).unwrap_or_else(|_| panic!("{said}"));
    let folder = answer.flatten().find(|f| f.path().join("verdict.json").exists()).unwrap_or_else(|| panic!("{said}"));
    let text = std::fs::read_to_string(folder.path().join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(code, Some(0), "{said} {}", verdict["invalid"]);
    (verdict, said)
}
