//! Several campaigns in one call: none ends the others, and what is finished is not done again.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::Command;

/// Runs a diagnosis in `folder`: exit code, and what was printed.
fn diagnose(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg("diagnose")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (o.status.code(), text(&o.stdout), text(&o.stderr))
}

#[test]
fn a_bad_campaign_and_one_that_cannot_be_written_leave_the_others_and_a_rerun_does_what_is_left() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let recipe = Recipe { samples: 250, interval: 2.8e-5, ..Recipe::default() };
    write_campaign(&at("good"), &recipe).unwrap();
    write_campaign(&at("blocked"), &recipe).unwrap();
    std::fs::create_dir_all(at("bad")).unwrap();
    std::fs::write(at("bad/campaign.toml"), "format = 1").unwrap();
    std::fs::create_dir_all(at("out")).unwrap();
    std::fs::write(at("out/blocked"), "mine").unwrap();
    let call = ["bad", "blocked", "good", "--out", "out", "--resume"];

    let (code, said, errors) = diagnose(dir.path(), &call);
    assert_eq!(code, Some(2), "{errors}");
    assert!(said.contains("finished: 1 (good)\nfailed: 2 (bad, blocked)\n"), "{said}");
    assert!(errors.contains("error: bad/campaign.toml") && errors.contains("a file is in the way"), "{errors}");
    let first = output::Manifest::read(&at("out/good")).unwrap();
    assert!(first.is_whole(&at("out/good")) && first.command == "diagnose" && first.input.is_some());

    // a file of the user's beside the answer changes nothing of it
    std::fs::write(at("out/good/mine.txt"), "mine").unwrap();
    let (code, said, errors) = diagnose(dir.path(), &["good", "--out", "out", "--resume"]);
    assert_eq!((code, said.lines().next()), (Some(0), Some("up to date: 1 (good)")), "{errors}");
    let (_, json, _) = diagnose(dir.path(), &["good", "--out", "out", "--resume", "--json"]);
    let answers: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(answers[0]["verdict"]["format"], "verdict/1");

    // other recordings, or an answer that is not whole, are judged anew
    let file = at("good/r01.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.trim_end().rsplit_once('\n').unwrap().0).unwrap();
    let (code, said, errors) = diagnose(dir.path(), &["good", "--out", "out", "--resume"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(!said.contains("up to date"), "{said}");
    let second = output::Manifest::read(&at("out/good")).unwrap();
    assert_ne!(first.input, second.input);
    assert_eq!(std::fs::read_to_string(at("out/good/mine.txt")).unwrap(), "mine");
}
