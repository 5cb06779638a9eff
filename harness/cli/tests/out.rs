//! `--out` is checked before anything is read or computed: the inputs named here do not exist, and nobody looks for them.

use std::path::Path;
use std::process::Command;

/// Every command with `--out`, less its value; whether it writes one file.
const COMMANDS: [(&[&str], bool); 11] = [
    (&["demo"], false),
    (&["diagnose", "none"], false),
    (&["export-ssp", "none.toml"], true),
    (&["fit", "none"], false),
    (&["import", "none.csv"], false),
    (&["man"], false),
    (&["merge", "none"], false),
    (&["pack", "--binary", "linux64=none.so"], true),
    (&["paper"], false),
    (&["run", "none.toml"], false),
    (&["study", "coupling"], false),
];

/// What is printed of a place that cannot be written.
fn printed(command: &[&str], out: &Path) -> String {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(command).arg("--out").arg(out).output().unwrap();
    assert_eq!(o.status.code(), Some(2), "{command:?}");
    assert!(o.stdout.is_empty(), "{command:?} printed an answer");
    let e = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(e.lines().count(), 1, "{command:?}: {e}");
    assert!(e.starts_with(&format!("error: {}: ", out.display())) && e.contains("--out"), "{command:?}: {e}");
    e
}

#[test]
fn a_file_or_folder_in_the_way_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("mine");
    std::fs::write(&file, "mine").unwrap();
    for (command, writes_file) in COMMANDS {
        let e = printed(command, if writes_file { dir.path() } else { &file });
        assert!(e.contains("is in the way"), "{e}");
        let e = printed(command, &file.join("below/it"));
        assert!(e.contains(&format!("{} is no folder", file.display())), "{e}");
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "something was left behind");
}

#[test]
#[cfg(target_os = "linux")]
fn a_place_where_nobody_may_write_is_named() {
    // not even root makes files there
    for (command, _) in COMMANDS {
        let e = printed(command, Path::new("/proc/none/out"));
        assert!(e.contains("cannot be written (") && e.contains("give --out a place that can"), "{e}");
    }
}

#[test]
fn every_command_that_has_out_is_checked_here() {
    let program = touchdown::commands::command_line();
    let has_out = |c: &clap::Command| c.get_arguments().any(|a| a.get_id() == "out");
    let mut with: Vec<&str> = Vec::new();
    for c in program.get_subcommands() {
        if has_out(c) || c.get_subcommands().any(has_out) {
            with.push(c.get_name());
        }
    }
    let mut here: Vec<&str> = COMMANDS.iter().map(|c| c.0[0]).collect();
    with.sort_unstable();
    here.sort_unstable();
    assert_eq!(with, here);
}
