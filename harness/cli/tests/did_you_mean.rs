//! Names that are not known are answered with the nearest that is, wherever one is given.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::Command;

/// What is printed of a command that is refused.
fn printed(arguments: &[&str], folder: &Path) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).current_dir(folder).output().unwrap();
    assert_eq!(run.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(run.stderr).unwrap()
}

fn example(name: &str, from: &str, to: &str, folder: &Path) {
    let text = std::fs::read_to_string(format!("{}/../examples/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    assert!(text.contains(from), "{name} holds no {from}");
    std::fs::write(folder.join(name), text.replacen(from, to, 1)).unwrap();
}

#[test]
fn words_of_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe::default()).unwrap();
    for (arguments, meant) in [
        (&["diagnos"][..], "'diagnose'"),
        (&["compare", "a", "b", "--cfs", "180"], "'--cfc'"),
        (&["study", "couplin"], "'coupling'"),
        (&["fit", "c", "--out", "o", "--method", "simplx"], "'simplex'"),
        (&["mechanisms", "guide_frction"], "\"guide_friction\""),
        (&["init", "c", "--kind", "droptest"], "\"drop-test\""),
        (&["pack", "--out", "x.fmu", "--set", "stifness=1"], "\"stiffness\""),
        (&["pack", "--out", "x.fmu", "--model", "movingbar"], "\"moving-bar\""),
        (&["pack", "--out", "x.fmu", "--binary", "linux_64=x.so"], "\"linux64\""),
        (&["import", "c/r01.csv", "--list", "--map", "acceleratoin=x"], "\"acceleration\""),
        (&["import", "c/r01.csv", "--out", "o", "--map", "force=force:Nn"], "\"nN\""),
        (&["import", "c/r01.csv", "--out", "o", "--map", "force=forse:N"], "\"force\""),
        (&["import", "c/r01.csv", "--list", "--terms", "grvity"], "\"gravity\""),
        (&["import", "c/r01.csv", "--list", "--kind", "indention"], "\"indentation\""),
        (&["import", "c/r01.csv", "--list", "--names", "r{heigth:mm}"], "\"height\""),
        (&["import", "c/r01.csv", "--list", "--mass", "3 kgg"], "\"kg\""),
    ] {
        let e = printed(arguments, dir.path());
        let says = if meant.starts_with('\'') { "tip: a similar " } else { "did you mean " };
        assert!(e.contains(says) && e.contains(meant), "{arguments:?}: {e}");
    }
}

#[test]
fn keys_and_names_of_scenarios_and_systems() {
    let dir = tempfile::tempdir().unwrap();
    for (name, from, to, meant) in [
        ("drop_test.toml", "gravity", "gravty", "\"gravity\""),
        ("contactor_system.toml", "\nstop ", "\nstopp ", "\"stop\""),
        ("contactor_system.toml", "stiffness", "stifness", "\"stiffness\""),
        ("contactor_system.toml", "\"contact.force\"", "\"contact.forse\"", "\"force\""),
        ("contactor_system.toml", "\"contact.force\"", "\"contakt.force\"", "\"contact\""),
        ("contactor_system.toml", "logContact", "logContakt", "\"logContact\""),
    ] {
        example(name, from, to, dir.path());
        let e = printed(&["run", name, "--out", "o"], dir.path());
        assert!(e.contains(&format!("did you mean {meant}?")), "{from} as {to}: {e}");
    }
}
