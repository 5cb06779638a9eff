//! What is written is there whole or not at all, wherever the process is killed, the disk is full or a call fails: every call
//! that changes a file is counted, and some are made to fail in turn. TOUCHDOWN_FAULTS=10 takes ten times as many,
//! TOUCHDOWN_FAULTS=all every call of every command.
#![cfg(target_os = "linux")]

#[path = "fixtures/faults.rs"]
mod fixture;

use fixture::library;
use plant::recipe::{write_campaign, Recipe};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// What a folder holds: files by name.
type Tree = BTreeMap<String, Vec<u8>>;

const KINDS: [&str; 3] = ["kill", "enospc", "eio"];

/// Files below `folder`, but for stages, the rows of a run that was cut short, and the list of diagnoses.
fn tree(folder: &Path) -> Tree {
    let mut all = Tree::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(f) = folders.pop() {
        for entry in std::fs::read_dir(f).into_iter().flatten().map(Result::unwrap) {
            let (path, name) = (entry.path(), entry.file_name().into_string().unwrap());
            // the page beside diagnoses is a file of its own
            if name.starts_with(".touchdown-stage-") || name.contains(".partial.") || name == "index.html" {
                continue;
            }
            if entry.file_type().unwrap().is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                all.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    all
}

fn lay(folder: &Path, tree: &Tree) {
    drop(std::fs::remove_dir_all(folder));
    std::fs::create_dir_all(folder).unwrap();
    for (name, bytes) in tree {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

fn stages(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in std::fs::read_dir(folder).into_iter().flatten().map(|e| e.unwrap().path()) {
        if path.file_name().unwrap().to_string_lossy().starts_with(".touchdown-stage-") {
            found.push(path);
        } else if path.is_dir() {
            found.extend(stages(&path));
        }
    }
    found
}

/// A command, what it finds, and how many of its calls fail in turn of each kind.
struct Case<'a> {
    /// Makes what is there before: run in the folder that `command` runs in. Empty: nothing is there.
    before: &'a [&'a str],
    command: &'a [&'a str],
    /// Files of the user's.
    mine: &'a [(&'a str, &'a str)],
    most: usize,
    /// Whether the folder cannot change places: then a killed process leaves what the next command finishes.
    is_fixed: bool,
}

/// A folder with inputs, and `work`, in which everything is written.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Bench {
        let folder = tempfile::tempdir().unwrap();
        for (name, height) in [("old.toml", "0.01"), ("new.toml", "0.02")] {
            let text = format!(
                "kind = \"drop_test\"\nmass = 0.5\ndrop_heights = [{height}]\ngravity = true\n\n[contact]\nstiffness = 1e7\nexponent = 1.5\nhysteresis_damping = 1e6\n"
            );
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Bench { folder }
    }

    fn campaign(&self, name: &str, seed: u64) {
        let recipe = Recipe { samples: 250, interval: 2.8e-5, seed, ..Recipe::default() };
        write_campaign(&self.folder.path().join(name), &recipe).unwrap();
    }

    fn work(&self) -> PathBuf {
        self.folder.path().join("work")
    }

    /// Runs a command; the call `at` fails as `kind` says, and the number of calls is returned where it came to its end.
    fn run(&self, arguments: &[&str], kind: &str, at: usize) -> (Output, usize) {
        let count = self.folder.path().join("count");
        drop(std::fs::remove_file(&count));
        let o = Command::new(env!("CARGO_BIN_EXE_touchdown"))
            .args(arguments)
            .current_dir(self.folder.path())
            .env("SOURCE_DATE_EPOCH", "0")
            .env("LD_PRELOAD", library())
            .env("FAULTS_FOLDER", self.work())
            .env("FAULTS_KIND", kind)
            .env("FAULTS_AT", at.to_string())
            .env("FAULTS_COUNT", &count)
            .output()
            .unwrap();
        let calls = std::fs::read_to_string(&count).map_or(0, |n| n.trim().parse().unwrap());
        (o, calls)
    }

    fn done(&self, arguments: &[&str]) -> usize {
        let (o, calls) = self.run(arguments, "none", 0);
        assert!(o.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&o.stderr));
        calls
    }

    fn hold(&self, case: &Case) {
        let work = self.work();
        std::fs::create_dir_all(&work).unwrap();
        if !case.before.is_empty() {
            self.done(case.before);
        }
        let mut before = tree(&work);
        before.extend(case.mine.iter().map(|(name, text)| (name.to_string(), text.as_bytes().to_vec())));
        lay(&work, &before);
        let calls = self.done(case.command);
        let after = tree(&work);
        assert_ne!(before, after, "the command makes no difference");
        let most = match std::env::var("TOUCHDOWN_FAULTS").as_deref() {
            Ok("all") => calls,
            Ok(times) => calls.min(case.most * times.parse::<usize>().unwrap()),
            Err(_) => calls.min(case.most),
        };
        assert!(calls > 3, "calls are not seen");
        for (kind, i) in KINDS.iter().flat_map(|k| (0..most).map(move |i| (*k, i))) {
            let at = 1 + (2 * i + 1) * calls / (2 * most);
            lay(&work, &before);
            let (o, _) = self.run(case.command, kind, at);
            let said = String::from_utf8_lossy(&o.stderr).into_owned();
            let what = format!("{:?}, {kind} at call {at} of {calls}: {said}", case.command);
            let now = tree(&work);
            let complained = |part: &str| said.lines().any(|l| l.starts_with("error: ") && l.contains(part));
            if kind == "kill" {
                assert_eq!(o.status.code(), None, "{what}");
            } else if o.status.success() {
                assert!(now == after, "done, but the answer is not there: {what}");
            } else {
                assert!(o.status.code() == Some(2) && complained(""), "{what}");
            }
            if !case.is_fixed {
                assert!(now == before || now == after, "neither old nor new: {what}, {:?}", now.keys());
            } else if now != before && now != after {
                assert!(
                    kind == "kill" || complained("the next command"),
                    "neither old nor new: {what}, {:?}",
                    now.keys()
                );
            }
            let mine =
                |t: &Tree| case.mine.iter().all(|(name, text)| t.get(*name).is_some_and(|b| b == text.as_bytes()));
            assert!(mine(&now), "a file of the user's is gone: {what}");
            // another command that writes there clears away what is left, and finishes what was begun
            self.done(&["run", "old.toml", "--direct", "--out", "work/out"]);
            assert!(stages(&work).is_empty(), "a stage is left: {what}");
            let now = tree(&work);
            assert!(
                mine(&now) && output::Manifest::read(&work.join("out")).unwrap().is_whole(&work.join("out")),
                "{what}"
            );
            assert!(!now.keys().any(|n| n.contains(".kept")), "{what}: {:?}", now.keys());
        }
    }
}

const MINE: [(&str, &str); 2] = [("out/mine.txt", "mine"), ("beside.txt", "mine")];

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_scenario() {
    Bench::new().hold(&Case {
        before: &["run", "old.toml", "--direct", "--out", "work/out", "--parquet"],
        command: &["run", "new.toml", "--direct", "--out", "work/out"],
        mine: &MINE,
        most: 10,
        is_fixed: false,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_scenario_that_is_the_first_in_its_folder() {
    Bench::new().hold(&Case {
        before: &[],
        command: &["run", "new.toml", "--direct", "--out", "work/out"],
        mine: &[],
        most: 5,
        is_fixed: false,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_scenario_in_a_folder_that_cannot_change_places() {
    Bench::new().hold(&Case {
        before: &["run", "old.toml", "--direct", "--out", "work/out", "--parquet"],
        command: &["run", "new.toml", "--direct", "--out", "work/out"],
        mine: &[("out/mine/mine.txt", "mine")],
        most: 10,
        is_fixed: true,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_system_of_fmus() {
    let bench = Bench::new();
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/contactor_system.toml")).unwrap();
    let text =
        text.replacen("stop = 0.1 ", "stop = 0.02 ", 1) + "\n[results]\nrecord = [\"contact.force\"]\nevery = 20\n";
    std::fs::write(bench.folder.path().join("system.toml"), text).unwrap();
    bench.hold(&Case {
        before: &["run", "old.toml", "--direct", "--out", "work/out"],
        command: &["run", "system.toml", "--out", "work/out"],
        mine: &MINE,
        most: 3,
        is_fixed: false,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_fit() {
    let bench = Bench::new();
    bench.campaign("campaign", 1);
    bench.hold(&Case {
        before: &["run", "old.toml", "--direct", "--out", "work/out"],
        command: &["fit", "campaign", "--out", "work/out"],
        mine: &MINE,
        most: 2,
        is_fixed: false,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_diagnosis() {
    let bench = Bench::new();
    bench.campaign("out", 1);
    let command = ["diagnose", "out", "--out", "work"];
    bench.hold(&Case { before: &[], command: &command, mine: &[], most: 1, is_fixed: false });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn an_fmu() {
    Bench::new().hold(&Case {
        before: &["pack", "--out", "work/out/contact.fmu", "--set", "stiffness=1e6"],
        command: &["pack", "--out", "work/out/contact.fmu"],
        mine: &MINE,
        most: 4,
        is_fixed: false,
    });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn an_imported_campaign() {
    let bench = Bench::new();
    bench.campaign("campaign", 1);
    let facts = ["--height", "5mm", "--mass", "0.5", "--out", "work/out"];
    let command = [&["import", "campaign/r01.csv", "campaign/r02.csv"], &facts[..]].concat();
    bench.hold(&Case { before: &[], command: &command, mine: &[("beside.txt", "mine")], most: 5, is_fixed: false });
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn the_beginning_of_a_campaign() {
    let mine = [("out/r01.csv", "time [s],force [N]\n0,0\n")];
    let command = ["init", "work/out", "--kind", "drop-test"];
    Bench::new().hold(&Case { before: &[], command: &command, mine: &mine, most: 5, is_fixed: false });
}
