//! Ctrl-C, SIGTERM, SIGHUP and SIGXCPU end every command: what is finished is there, what is under way leaves nothing.
#![cfg(unix)]

use plant::recipe::{write_campaign, Recipe};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn started(folder: &Path, arguments: &[&str]) -> Child {
    // however the tests were started: `nohup` would have a hangup ignored
    Command::new("env")
        .args(["--default-signal=HUP,INT,TERM", env!("CARGO_BIN_EXE_touchdown")])
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn signal(name: &str, child: &Child) {
    assert!(Command::new("kill").arg(format!("-{name}")).arg(child.id().to_string()).status().unwrap().success());
}

/// Reads lines until one holds `part`.
fn wait_for(part: &str, lines: &mut impl BufRead) {
    let mut all = String::new();
    while lines.read_line(&mut all).unwrap() > 0 {
        if all.contains(part) {
            return;
        }
    }
    panic!("{part:?} was not said in {all}");
}

#[test]
fn what_is_under_way_is_named_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("first"), &Recipe::default()).unwrap();
    write_campaign(&dir.path().join("second"), &Recipe::default()).unwrap();
    // the last as `timeout` does, which signals a process and then its group
    for (names, wanted) in
        [(&["INT"][..], 130), (&["TERM"], 143), (&["HUP"], 129), (&["XCPU"], 152), (&["INT", "INT"], 130)]
    {
        let name = names.join(" and ");
        // the nulls alone take hours: that it ends at all shows that it was asked
        let mut child = started(dir.path(), &["diagnose", "first", "second", "--out", "out", "--bootstrap", "9999"]);
        let mut err = BufReader::new(child.stderr.take().unwrap());
        wait_for(", first: ", &mut err);
        names.iter().for_each(|n| signal(n, &child));
        let code = child.wait().unwrap().code();
        let mut said = String::new();
        err.read_to_string(&mut said).unwrap();
        assert_eq!(code, Some(wanted), "{name}: {said}");
        assert!(said.contains("first is not finished") && said.contains("not begun: second"), "{said}");
        assert!(!dir.path().join("out").exists());
    }
}

#[test]
fn a_fit_that_is_asked_to_end_at_once_writes_nothing_or_a_whole_answer() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe::default()).unwrap();
    let mut child = started(dir.path(), &["fit", "c", "--out", "out"]);
    let mut err = BufReader::new(child.stderr.take().unwrap());
    signal("TERM", &child);
    let code = child.wait().unwrap().code();
    let mut said = String::new();
    err.read_to_string(&mut said).unwrap();
    // asked before it could listen it ends as every process does
    assert!(code.is_none() || code == Some(143), "{said}");
    // on a busy machine it has something by then: what it has is given whole
    let has_answer = dir.path().join("out/manifest.json").exists() && dir.path().join("out/fit.json").exists();
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1 + usize::from(has_answer), "{said}");
}

#[test]
fn a_command_that_does_not_look_ends_all_the_same() {
    let dir = tempfile::tempdir().unwrap();
    for (name, wanted) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let mut child = started(dir.path(), &["study", "coupling", "--out", "out"]);
        let mut err = BufReader::new(child.stderr.take().unwrap());
        wait_for("study", &mut err);
        signal(name, &child);
        let code = child.wait().unwrap().code();
        let mut said = String::new();
        err.read_to_string(&mut said).unwrap();
        assert_eq!(code, Some(wanted), "{name}: {said}");
        assert!(said.contains("nothing more is written"), "{said}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "something was left behind");
    }
}

#[test]
fn what_was_finished_is_there() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["first", "second"] {
        write_campaign(&dir.path().join(name), &Recipe { samples: 250, interval: 2.8e-5, ..Recipe::default() })
            .unwrap();
    }
    let mut child = started(dir.path(), &["diagnose", "first", "second", "--out", "out"]);
    let mut out = BufReader::new(child.stdout.take().unwrap());
    wait_for(":", &mut out);
    signal("INT", &child);
    let said = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&said.stderr).into_owned();
    assert_eq!(said.status.code(), Some(130), "{err}");
    assert!(err.contains("second is not finished") && err.contains("1 campaign"), "{err}");
    let out = dir.path().join("out");
    assert!(out.join("first/verdict.json").exists() && out.join("index.html").exists());
    assert!(!out.join("second").exists());
}

#[test]
fn a_process_started_by_nohup_outlives_its_terminal() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe::default()).unwrap();
    let mut child = Command::new("sh")
        .args(["-c", "trap '' HUP; exec \"$0\" diagnose c --out out --bootstrap 9999", env!("CARGO_BIN_EXE_touchdown")])
        .current_dir(dir.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for(", c: ", &mut BufReader::new(child.stderr.take().unwrap()));
    signal("HUP", &child);
    std::thread::sleep(Duration::from_secs(2));
    assert!(child.try_wait().unwrap().is_none(), "SIGHUP ended it");
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_campaign_whose_time_is_up_is_answered_as_not_judged() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe::default()).unwrap();
    let o = started(dir.path(), &["diagnose", "c", "--out", "out", "--seconds", "0.05"]).wait_with_output().unwrap();
    assert_eq!(o.status.code(), Some(3), "{}", String::from_utf8_lossy(&o.stderr));
    let verdict = std::fs::read_to_string(dir.path().join("out/c/verdict.json")).unwrap();
    assert!(
        verdict.contains("the time given was up while") && dir.path().join("out/c/report.html").exists(),
        "{verdict}"
    );
    let o = started(dir.path(), &["diagnose", "c", "--out", "none", "--seconds", "0"]).wait_with_output().unwrap();
    assert_eq!(o.status.code(), Some(2));
    assert!(!dir.path().join("none").exists());
}
