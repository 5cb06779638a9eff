//! `touchdown init` and `touchdown check`: from a folder of recordings to a campaign that is understood.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::Command;

/// Exit code, what was printed, and what was said of errors.
fn touchdown(arguments: &[&str], folder: &Path) -> (Option<i32>, String, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).arg(folder).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (run.status.code(), text(&run.stdout), text(&run.stderr))
}

fn campaign() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), &Recipe::default()).unwrap();
    dir
}

#[test]
fn check_tells_how_a_campaign_is_understood() {
    let (code, said, err) = touchdown(&["check"], campaign().path());
    assert_eq!((code, err.as_str()), (Some(0), ""));
    for s in ["drop-test", "r10.csv", "noise of force: ", "% of its range", "nothing contradicts"] {
        assert!(said.contains(s), "{s:?} is not in {said}");
    }
}

#[test]
fn check_tells_every_contradiction_at_once() {
    let dir = campaign();
    // a force in kN that says N, an acceleration of the other sign, and a height in the wrong unit
    scale(dir.path(), "r02.csv", 1, 1e-3);
    scale(dir.path(), "r05.csv", 2, -1.0);
    let head = dir.path().join("campaign.toml");
    let text = std::fs::read_to_string(&head).unwrap();
    let at = text.rfind("drop_height = ").unwrap() + "drop_height = ".len();
    std::fs::write(&head, format!("{}1{}", &text[..at], &text[at..])).unwrap();
    let (code, said, err) = touchdown(&["check"], dir.path());
    assert_eq!(code, Some(2), "{err}");
    assert!(!said.contains("nothing contradicts"));
    assert_eq!(err.lines().count(), 3, "{err}");
    for s in
        ["r02.csv: force is", "r05.csv: acceleration is positive", "r10.csv: a free fall of 1", "correct drop_height"]
    {
        assert!(err.contains(s), "{s:?} is not in {err}");
    }
}

#[test]
fn heights_in_millimetres_that_say_metres_are_told_by_what_the_push_adds_up_to() {
    let dir = campaign();
    let head = dir.path().join("campaign.toml");
    let text = std::fs::read_to_string(&head).unwrap();
    let line = |l: &str| match l.strip_prefix("drop_height = ") {
        Some(h) => {
            let metres: f64 = h.split(' ').next().unwrap().parse().unwrap();
            format!("drop_height = {}\n", 1e3 * metres)
        }
        None if l.starts_with("impact_speed") => String::new(),
        None => format!("{l}\n"),
    };
    std::fs::write(&head, text.lines().map(line).collect::<String>()).unwrap();
    // a penetration would show it too: force and acceleration alone
    for file in std::fs::read_dir(dir.path()).unwrap().map(|f| f.unwrap().path()) {
        if file.extension().is_some_and(|e| e == "csv") {
            let text = std::fs::read_to_string(&file).unwrap();
            let three = |l: &str| l.split(',').take(3).collect::<Vec<_>>().join(",") + "\n";
            std::fs::write(&file, text.lines().map(three).collect::<String>()).unwrap();
        }
    }
    let (code, said, err) = touchdown(&["check"], dir.path());
    assert_eq!(code, Some(2), "{said}{err}");
    assert_eq!(err.matches("times the speed given").count(), 10, "{err}");
}

#[test]
fn every_error_links_to_a_section_of_the_documentation_that_is_there() {
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/formats/recordings.md"));
    let page = page.unwrap();
    for s in record::Section::ALL {
        assert!(page.contains(&format!("\n## {}\n", s.heading())), "{}", s.heading());
    }
    let dir = campaign();
    let head = dir.path().join("campaign.toml");
    let text = std::fs::read_to_string(&head).unwrap().replace("moving_mass", "moving_mas");
    std::fs::write(&head, text.replace("[simulation]", "[simulation]\nq = 1")).unwrap();
    std::fs::write(dir.path().join("r03.csv"), "time [s],force [kg]\n0,1\n1,x\n").unwrap();
    let (code, _, err) = touchdown(&["check"], dir.path());
    assert_eq!(code, Some(2), "{err}");
    let links: Vec<&str> =
        err.lines().filter_map(|l| l.split_once("; see docs/src/formats/recordings.md#")).map(|l| l.1).collect();
    assert_eq!(links.len(), err.lines().count(), "{err}");
    for anchor in ["rig", "simulation", "units", "missing-values", "number-of-samples"] {
        assert!(links.contains(&anchor), "{anchor}: {err}");
    }
}

/// Multiplies one column of a recording by `factor`.
fn scale(dir: &Path, file: &str, column: usize, factor: f64) {
    let path = dir.join(file);
    let row = |l: &str| {
        let mut cells: Vec<String> = l.split(',').map(str::to_string).collect();
        if let Some(v) = cells.get(column).and_then(|c| c.parse::<f64>().ok()) {
            cells[column] = format!("{:e}", v * factor);
        }
        cells.join(",")
    };
    let text: Vec<String> = std::fs::read_to_string(&path).unwrap().lines().map(row).collect();
    std::fs::write(path, text.join("\n") + "\n").unwrap();
}

#[test]
fn init_lists_the_recordings_and_check_tells_what_is_left_to_fill_in() {
    let dir = campaign();
    let head = dir.path().join("campaign.toml");
    std::fs::remove_file(&head).unwrap();
    let (code, said, err) = touchdown(&["init", "--kind", "drop_test"], dir.path());
    assert_eq!(code, Some(0), "{err}");
    assert!(said.contains("10 recordings"), "{said}");
    let (code, _, err) = touchdown(&["check"], dir.path());
    assert_eq!(code, Some(2));
    assert!(err.contains("moving_mass") && err.contains("r10.csv: neither impact_speed"), "{err}");
    // filled in, it is understood
    let mut level = 0;
    let filled: Vec<String> = std::fs::read_to_string(&head)
        .unwrap()
        .lines()
        .map(|l| match l {
            l if l.starts_with("# moving_mass") => "moving_mass = 0.5".into(),
            l if l.starts_with("# impact_speed") => {
                level += 1;
                format!("impact_speed = {}", 0.3 + 0.1 * f64::from((level - 1) / 2))
            }
            l => l.into(),
        })
        .collect();
    std::fs::write(&head, filled.join("\n")).unwrap();
    let c = record::load(dir.path(), &mechanisms::terms());
    assert_eq!(c.unwrap().recordings.len(), 10);
    // what is there is not written over
    let (code, _, err) = touchdown(&["init", "--kind", "drop-test"], dir.path());
    assert_eq!(code, Some(2));
    assert!(err.contains("is there already"), "{err}");
    assert_eq!(std::fs::read_to_string(&head).unwrap(), filled.join("\n"));
}

#[test]
fn every_kind_has_a_template_and_another_word_finds_the_nearest() {
    for kind in record::Kind::BUILT_IN {
        let dir = campaign();
        std::fs::remove_file(dir.path().join("campaign.toml")).unwrap();
        let (code, _, err) = touchdown(&["init", "--kind", kind.name()], dir.path());
        assert_eq!(code, Some(0), "{err}");
        let text = std::fs::read_to_string(dir.path().join("campaign.toml")).unwrap();
        assert!(text.contains(&format!("kind = \"{}\"", kind.name())) && text.contains("order = 10"));
        // every key that is offered is known: an error about one would say so
        let offered = |l: &str| l.strip_prefix("# ").and_then(|l| l.split_once(" =")).map(|(key, _)| key.to_string());
        let filled: Vec<String> =
            text.lines().map(|l| offered(l).map_or(l.to_string(), |key| format!("{key} = 1"))).collect();
        assert!(filled.iter().filter(|l| l.ends_with(" = 1")).count() > 10);
        std::fs::write(dir.path().join("campaign.toml"), filled.join("\n")).unwrap();
        let (_, _, err) = touchdown(&["check"], dir.path());
        assert!(!err.contains("not known"), "{err}");
    }
    let empty = tempfile::tempdir().unwrap();
    let (code, _, err) = touchdown(&["init", "--kind", "drop-test"], empty.path());
    assert!(code == Some(2) && err.contains("no CSV file"), "{err}");
    let (code, _, err) = touchdown(&["init", "--kind", "droptest"], empty.path());
    assert!(code == Some(2) && err.contains("drop-test"), "{err}");
}
