//! Attacks on what lies beside and below a place that is written to: links, pipes, manifests, several commands at once, and
//! systems that give little. What is not touchdown's own stays as it is, and every command ends by a code that the book has.
#![cfg(target_os = "linux")]

#[path = "fixtures/faults.rs"]
mod fixture;

use fixture::library;
use plant::recipe::{write_campaign, Recipe};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Names that stages had and have.
const STAGES: [&str; 2] = [".touchdown-stage-7-0", ".touchdown-stage-0011223344556677"];
const MINE: &str = "mine\n";

/// A folder with a scenario, and files of somebody's beside the place that is written to.
struct Bench {
    folder: tempfile::TempDir,
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

impl Bench {
    fn new() -> Bench {
        let b = Bench { folder: tempfile::tempdir().unwrap() };
        let scenario = "kind = \"drop_test\"\nmass = 0.5\ndrop_heights = [0.01]\ngravity = true\n\n[contact]\n\
                        stiffness = 1e7\nexponent = 1.5\nhysteresis_damping = 1e6\n";
        std::fs::write(b.at("drop.toml"), scenario).unwrap();
        std::fs::create_dir_all(b.at("precious/below")).unwrap();
        std::fs::create_dir(b.at("out")).unwrap();
        for name in ["precious/a", "precious/below/b", "notes.txt"] {
            std::fs::write(b.at(name), MINE).unwrap();
        }
        b
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
        c.args(arguments).current_dir(self.folder.path());
        c
    }

    /// The command to its end, which comes.
    fn ends(&self, mut command: Command) -> Output {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // a generous wait, that only a failure exhausts
        let until = Instant::now() + Duration::from_secs(120);
        while child.try_wait().unwrap().is_none() {
            if Instant::now() > until {
                child.kill().unwrap();
                panic!("{command:?} does not end");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        child.wait_with_output().unwrap()
    }

    fn run(&self) -> Output {
        self.ends(self.command(&["run", "drop.toml", "--direct", "--out", "out"]))
    }

    fn done(&self) {
        let o = self.run();
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
        let out = self.at("out");
        assert!(output::Manifest::read(&out).unwrap().is_whole(&out));
    }

    /// That nothing of somebody's is gone or changed.
    fn holds(&self) {
        for name in ["precious/a", "precious/below/b", "notes.txt"] {
            assert_eq!(text(&self.at(name)), MINE, "{name}");
        }
        assert_eq!(std::fs::read_dir(self.at("precious")).unwrap().count(), 2);
    }

    /// That no stage was left.
    fn leaves_no_stage(&self) {
        for folder in [self.at(""), self.at("out")] {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                assert!(!entry.file_name().to_string_lossy().starts_with(".touchdown-stage"), "{entry:?}");
            }
        }
    }
}

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A manifest of `run` that lists one file of MINE.
fn manifest(name: &str) -> String {
    let entry = serde_json::json!({"size": MINE.len(), "sha256": hash(), "command": "run"});
    let files = serde_json::Map::from_iter([(name.to_string(), entry)]);
    serde_json::json!({"format": "manifest/1", "touchdown": "0.1.0", "command": "run", "files": files}).to_string()
}

fn hash() -> String {
    static HASHED: OnceLock<String> = OnceLock::new();
    let of = || {
        let t = tempfile::tempdir().unwrap();
        std::fs::write(t.path().join("x"), MINE).unwrap();
        output::Entry::of(&t.path().join("x"), "").unwrap().sha256
    };
    HASHED.get_or_init(of).clone()
}

#[test]
fn links_with_the_names_of_stages_are_followed_by_no_command() {
    for stage in STAGES {
        let b = Bench::new();
        std::fs::create_dir(b.at("campaign")).unwrap();
        std::fs::write(b.at("campaign/r01.csv"), "time [s],force [N]\n0,0\n").unwrap();
        for place in ["campaign", "out", ""] {
            symlink(b.at("precious"), b.at(place).join(stage)).unwrap();
        }
        let o = b.ends(b.command(&["init", "campaign", "--kind", "indentation"]));
        assert_eq!(o.status.code(), Some(0));
        b.done();
        b.holds();
    }
}

#[test]
fn locks_of_stages_that_are_links_or_pipes_are_not_opened() {
    for stage in STAGES {
        for is_link in [true, false] {
            let b = Bench::new();
            for place in ["out", ""] {
                let lock = b.at(place).join(stage).join("lock");
                std::fs::create_dir(lock.parent().unwrap()).unwrap();
                if is_link {
                    symlink(b.at("notes.txt"), lock).unwrap();
                } else {
                    pipe(&lock);
                }
            }
            b.done();
            b.holds();
        }
    }
}

#[test]
fn manifests_that_name_files_elsewhere_touch_none() {
    let names = |b: &Bench| {
        ["../notes.txt", "../precious/a", "mine/../../notes.txt", "link/a"]
            .map(String::from)
            .into_iter()
            .chain([b.at("precious/below/b").display().to_string()])
    };
    for name in names(&Bench::new()) {
        let b = Bench::new();
        // of the answer that is there, in a folder that cannot change places
        std::fs::create_dir(b.at("out/mine")).unwrap();
        symlink(b.at("precious"), b.at("out/link")).unwrap();
        std::fs::write(b.at("out/manifest.json"), manifest(&name)).unwrap();
        b.done();
        b.holds();
        assert!(b.at("out/mine").is_dir() && b.at("out/link").is_symlink());
        for stage in STAGES {
            // of a replacement that seems to have been cut short
            let ready = b.at("out").join(stage).join("ready");
            std::fs::create_dir_all(&ready).unwrap();
            std::fs::write(ready.join("../lock"), "").unwrap();
            std::fs::write(ready.join("x"), MINE).unwrap();
            std::fs::write(ready.join("manifest.json"), manifest(&name)).unwrap();
        }
        b.done();
        b.holds();
    }
}

#[test]
fn pipes_and_links_in_the_place_of_an_answer_are_kept() {
    for name in ["manifest.json", "results.csv", "report.html", "summary.json"] {
        for stays in [false, true] {
            let b = Bench::new();
            if stays {
                std::fs::create_dir(b.at("out/mine")).unwrap();
            }
            pipe(&b.at("out").join(name));
            b.done();
            std::fs::remove_file(b.at("out").join(name)).unwrap();
            symlink(b.at("notes.txt"), b.at("out").join(name)).unwrap();
            b.done();
            b.holds();
        }
    }
}

#[test]
fn commands_that_write_into_one_folder_at_once_leave_one_whole_answer() {
    for stays in [false, true] {
        let b = Bench::new();
        if stays {
            std::fs::create_dir(b.at("out/mine")).unwrap();
        }
        let run = || b.command(&["run", "drop.toml", "--direct", "--quiet", "--out", "out"]);
        let all: Vec<_> = (0..6).map(|_| run().stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap()).collect();
        for child in all {
            let o = child.wait_with_output().unwrap();
            assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
        }
        let out = b.at("out");
        assert!(output::Manifest::read(&out).unwrap().is_whole(&out));
        for entry in std::fs::read_dir(out).unwrap().flatten() {
            assert!(!entry.file_name().to_string_lossy().contains(".kept"), "{entry:?}");
        }
        b.leaves_no_stage();
    }
}

#[test]
fn a_system_that_gives_no_threads_slows_a_command_and_does_not_end_it() {
    let b = Bench::new();
    let recipe = Recipe { samples: 250, interval: 2.8e-5, seed: 1, ..Recipe::default() };
    write_campaign(&b.at("campaign"), &recipe).unwrap();
    for threads in ["0", "1", "2", "3"] {
        for arguments in [
            &["run", "drop.toml", "--direct", "--out", "out"][..],
            &["check", "campaign"],
            &["fit", "campaign", "--out", "fitted"],
        ] {
            let mut c = b.command(arguments);
            c.env("LD_PRELOAD", library()).env("FAULTS_THREADS", threads);
            let o = b.ends(c);
            let said = String::from_utf8_lossy(&o.stderr);
            assert_eq!(o.status.code(), Some(0), "{threads} threads, {arguments:?}: {said}");
            assert!(!said.contains("panicked"), "{said}");
        }
    }
}

#[test]
fn a_thread_that_has_no_memory_to_begin_ends_a_command_as_all_that_runs_out_of_memory() {
    let b = Bench::new();
    let mut c = b.command(&["run", "drop.toml", "--direct", "--out", "out"]);
    c.env("LD_PRELOAD", library()).env("FAULTS_STACKS", "1").env("RUST_BACKTRACE", "1");
    let o = b.ends(c);
    let said = String::from_utf8_lossy(&o.stderr);
    assert_eq!(o.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: memory has run out") && !said.contains("panicked"), "{said}");
    b.done();
    b.leaves_no_stage();
    b.holds();
}

#[test]
#[ignore = "takes minutes: tests/faults/run"]
fn a_diagnosis_ends_where_the_system_gives_few_threads() {
    let b = Bench::new();
    let recipe = Recipe { samples: 250, interval: 2.8e-5, seed: 1, ..Recipe::default() };
    write_campaign(&b.at("campaign"), &recipe).unwrap();
    for threads in ["0", "1", "2", "3"] {
        for options in [&[][..], &["--jobs", "2"], &["--shard", "1/1"]] {
            drop(std::fs::remove_dir_all(b.at("out")));
            let mut c = b.command(&[&["diagnose", "campaign", "--out", "out"], options].concat());
            c.env("LD_PRELOAD", library()).env("FAULTS_THREADS", threads);
            let o = c.output().unwrap();
            let said = String::from_utf8_lossy(&o.stderr);
            assert_eq!(o.status.code(), Some(0), "{threads} threads, {options:?}: {said}");
            assert!(b.at("out/campaign/verdict.json").is_file() && !said.contains("panicked"), "{said}");
        }
    }
}

#[test]
fn limits_of_a_shell_end_a_command_by_a_code_of_the_book_and_leave_nothing() {
    let limits = |letter: &'static str, values: &'static [u32]| values.iter().map(move |v| (letter, *v));
    let all = limits("f", &[0, 1, 4, 16])
        .chain(limits("n", &[3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 20]))
        .chain(limits("v", &[40_000, 50_000, 100_000, 200_000]));
    for (letter, value) in all {
        let b = Bench::new();
        let mut c = Command::new("sh");
        let line = format!("ulimit -{letter} {value}; exec \"$0\" run drop.toml --direct --out out");
        c.args(["-c", &line, env!("CARGO_BIN_EXE_touchdown")]).current_dir(b.folder.path());
        let o = b.ends(c);
        let said = String::from_utf8_lossy(&o.stderr);
        let what = format!("ulimit -{letter} {value}: {:?}: {said}", o.status);
        // below some MB the program itself is not loaded, which says the loader by 127
        let is_loaded = !said.contains("error while loading shared libraries") && !said.contains("cannot map");
        let code = o.status.code();
        let cure = match letter {
            "n" => "raise it, as with ulimit -n",
            "f" => "raise it, as with ulimit -f",
            _ => "error: ",
        };
        assert!(code == Some(0) || code == Some(2) && said.contains(cure) || !is_loaded, "{what}");
        assert!(!said.contains("panicked"), "{what}");
        // where memory runs out the next command clears away what is left
        if letter == "v" {
            b.done();
        }
        b.leaves_no_stage();
        b.holds();
    }
}

#[test]
fn what_is_somebody_elses_in_the_place_of_a_fleet_stays() {
    let b = Bench::new();
    let answer = output::Answer::begin(&b.at("answers/one"), "diagnose").unwrap();
    answer.write("verdict.json", br#"{"mismatch": {"detected": false, "false_alarm_probability": 0.5}, "unexplained": {"detected": false}, "fit": {"before": {"heldout_nrmse": 0.1}, "after": {"heldout_nrmse": 0.1}}}"#).unwrap();
    answer.commit().unwrap();
    let merge = || b.ends(b.command(&["merge", "answers", "--out", "site"]));
    std::fs::create_dir(b.at("site")).unwrap();
    std::fs::write(b.at("site/index.html"), MINE).unwrap();
    let o = merge();
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("is left as it is; move it away"), "{o:?}");
    assert_eq!(text(&b.at("site/index.html")), MINE);
    assert_eq!(std::fs::read_dir(b.at("site")).unwrap().count(), 1, "nothing else is written");
    std::fs::remove_file(b.at("site/index.html")).unwrap();
    for name in ["site/fleet.json", "site/fleet.parquet"] {
        std::fs::write(b.at(name), MINE).unwrap();
    }
    for _ in 0..2 {
        let o = merge();
        assert_eq!(o.status.code(), Some(0), "{o:?}");
    }
    for name in ["site/fleet.kept.json", "site/fleet.kept.parquet"] {
        assert_eq!(text(&b.at(name)), MINE);
    }
    assert_eq!(std::fs::read_dir(b.at("site")).unwrap().count(), 6);
    for index in ["pipe", "link"] {
        std::fs::remove_file(b.at("site/index.html")).unwrap();
        if index == "pipe" {
            pipe(&b.at("site/index.html"));
        } else {
            symlink(b.at("notes.txt"), b.at("site/index.html")).unwrap();
        }
        assert_eq!(merge().status.code(), Some(2), "{index}");
    }
    b.holds();
    // a page that looks like ours is somebody's where it was changed
    std::fs::remove_file(b.at("site/index.html")).unwrap();
    assert_eq!(merge().status.code(), Some(0));
    let page = text(&b.at("site/index.html")).replace("campaign", "ship");
    std::fs::write(b.at("site/index.html"), &page).unwrap();
    assert_eq!(merge().status.code(), Some(2));
    assert_eq!(text(&b.at("site/index.html")), page);
    // an answer that was changed since it was written
    std::fs::write(b.at("answers/one/verdict.json"), text(&b.at("answers/one/verdict.json")) + " ").unwrap();
    let o = b.ends(b.command(&["merge", "answers", "--out", "other"]));
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stdout).contains("verdict.json: is not as it was written"), "{o:?}");
}

#[test]
fn a_merge_that_fails_halfway_leaves_the_answer_before_whole() {
    let b = Bench::new();
    let answer = |name: &str| {
        let a = output::Answer::begin(&b.at("answers").join(name), "diagnose").unwrap();
        a.write("verdict.json", br#"{"mismatch": {"detected": false, "false_alarm_probability": 0.5}, "unexplained": {"detected": false}, "fit": {"before": {"heldout_nrmse": 0.1}, "after": {"heldout_nrmse": 0.1}}}"#).unwrap();
        a.commit().unwrap();
    };
    answer("one");
    assert_eq!(b.ends(b.command(&["merge", "answers", "--out", "site"])).status.code(), Some(0));
    let files = || ["index.html", "fleet.json", "fleet.parquet"].map(|n| std::fs::read(b.at("site").join(n)).unwrap());
    let before = files();
    answer("two");
    // every limit that some file does not fit below
    for blocks in 0..1024 {
        let mut c = Command::new("sh");
        let line = format!("ulimit -f {blocks}; exec \"$0\" merge answers --out site");
        c.args(["-c", &line, env!("CARGO_BIN_EXE_touchdown")]).current_dir(b.folder.path());
        let o = b.ends(c);
        match o.status.code() {
            Some(0) => break,
            code => {
                let said = String::from_utf8_lossy(&o.stderr);
                assert!(code == Some(2) && said.contains("raise it, as with ulimit -f"), "{blocks}: {said}");
                assert!(files() == before, "{blocks}");
            }
        }
    }
    let after = files();
    assert!(before.iter().zip(&after).all(|(a, b)| a != b));
    assert!(output::Manifest::read(&b.at("site")).unwrap().is_whole(&b.at("site")));
    b.leaves_no_stage();
}

#[test]
fn the_demo_writes_through_no_link_and_over_no_file_of_somebodys() {
    for name in [
        "input",
        "drop_test",
        "contactor",
        "fit",
        "diagnosis",
        "same_drops",
        "fmus",
        "HysteresisContact.fmu",
        "index.html",
    ] {
        for is_link in [true, false] {
            let b = Bench::new();
            // a demo that was begun
            let a = output::Answer::begin(&b.at("demo/input"), "demo").unwrap();
            a.write("drop_test.toml", b"").unwrap();
            a.commit().unwrap();
            if name == "input" {
                std::fs::rename(b.at("demo/input"), b.at("begun")).unwrap();
                symlink(b.at("begun"), b.at("demo/input")).unwrap();
            } else if is_link {
                symlink(b.at("precious"), b.at("demo").join(name)).unwrap();
            } else {
                std::fs::write(b.at("demo").join(name), MINE).unwrap();
            }
            let o = b.ends(b.command(&["demo", "--out", "demo"]));
            let said = String::from_utf8_lossy(&o.stderr);
            assert!(
                o.status.code() == Some(2) && said.contains("move it away, or give another --out"),
                "{name}: {said}"
            );
            assert!(name == "input" || is_link || text(&b.at("demo").join(name)) == MINE, "{name}");
            b.holds();
        }
    }
}

#[test]
fn pages_of_the_manual_take_no_place_of_somebodys_files() {
    let b = Bench::new();
    std::fs::create_dir(b.at("man1")).unwrap();
    std::fs::write(b.at("man1/touchdown-run.1"), MINE).unwrap();
    for _ in 0..2 {
        assert_eq!(b.ends(b.command(&["man", "--out", "man1"])).status.code(), Some(0));
    }
    assert_eq!(text(&b.at("man1/touchdown-run.kept.1")), MINE);
    assert!(text(&b.at("man1/touchdown-run.1")).contains(".TH touchdown"));
    assert!(!b.at("man1/touchdown-fit.kept.1").exists(), "ours are replaced");
}

#[test]
fn a_stage_from_elsewhere_swaps_no_recording() {
    let b = Bench::new();
    std::fs::create_dir(b.at("campaign")).unwrap();
    std::fs::write(b.at("campaign/r01.csv"), "time [s],force [N]\n0,0\n").unwrap();
    for stage in STAGES {
        let ready = b.at("campaign").join(stage).join("ready");
        std::fs::create_dir_all(&ready).unwrap();
        std::fs::write(ready.join("../lock"), "").unwrap();
        std::fs::write(ready.join("r01.csv"), MINE).unwrap();
        std::fs::write(ready.join("manifest.json"), manifest("r01.csv")).unwrap();
    }
    let o = b.ends(b.command(&["init", "campaign", "--kind", "indentation"]));
    assert_eq!(o.status.code(), Some(0), "{o:?}");
    assert_eq!(text(&b.at("campaign/r01.csv")), "time [s],force [N]\n0,0\n");
}

#[test]
fn names_that_steer_a_terminal_are_spelled_out_and_those_that_are_no_text_are_told() {
    use std::os::unix::ffi::OsStrExt;
    let b = Bench::new();
    let name = "a\nerror: b\u{1b}[2J";
    let folder = b.at(name);
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(b.at("drop.toml"), folder.join("drop.toml")).unwrap();
    let csv =
        (0..20).fold(String::from("time [s],force [N],penetration [m]\n"), |s, i| s + &format!("{i},{i},{i}e-6\n"));
    std::fs::write(folder.join(format!("{name}.csv")), csv).unwrap();
    let at = |file: &str| format!("{name}/{file}");
    for arguments in [
        vec!["init", name, "--kind", "indentation"],
        vec!["check", name],
        vec!["check", name, "--json"],
        vec!["fit", name, "--out", &at("fitted")],
        vec!["run", &at("drop.toml"), "--direct", "--out", &at("out")],
        vec!["run", &at("none.toml"), "--out", &at("out")],
        vec!["pack", "--out", &at("x.fmu")],
        vec!["merge", name, "--out", &at("site")],
        vec!["import", &at(&format!("{name}.csv")), "--kind", "indentation", "--out", &at("imported")],
    ] {
        let o = b.ends(b.command(&arguments));
        let said = String::from_utf8_lossy(&[o.stdout, o.stderr].concat()).into_owned();
        assert!(matches!(o.status.code(), Some(0 | 2 | 3)), "{arguments:?}: {said}");
        assert!(!said.contains('\u{1b}') && !said.contains("\nerror: b\\u"), "{arguments:?}: {said}");
    }
    // what init has written names the file as it is called
    let toml: toml::Table = text(&folder.join("campaign.toml")).parse().unwrap();
    assert_eq!(toml["recording"][0]["file"].as_str(), Some(format!("{name}.csv").as_str()));
    std::fs::create_dir(b.at("other")).unwrap();
    std::fs::write(b.at("other").join(std::ffi::OsStr::from_bytes(b"r\xff.csv")), "time [s]\n").unwrap();
    let o = b.ends(b.command(&["init", "other", "--kind", "indentation"]));
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(o.status.code() == Some(2) && said.contains("its name is no text in UTF-8"), "{said}");
}

#[test]
fn a_large_file_of_a_manifest_that_is_hashed_keeps_no_command_that_is_to_end() {
    let b = Bench::new();
    b.done();
    // a file with a hole, as large as its list says: what is hashed at most, and takes its time
    let (list, size) = (b.at("out/manifest.json"), 60u64 << 30);
    let mut manifest: serde_json::Value = serde_json::from_str(&text(&list)).unwrap();
    manifest["files"]["report.html"]["size"] = size.into();
    std::fs::write(&list, manifest.to_string()).unwrap();
    std::fs::OpenOptions::new().write(true).open(b.at("out/report.html")).unwrap().set_len(size).unwrap();
    let mut child = b.command(&["run", "drop.toml", "--direct", "--out", "out"]).stderr(Stdio::null()).spawn().unwrap();
    let is_stage = |e: std::fs::DirEntry| e.file_name().to_string_lossy().starts_with(".touchdown-stage");
    while !std::fs::read_dir(b.at("")).unwrap().flatten().any(is_stage) {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it wrote");
    }
    // asked, and asked once more
    for _ in 0..2 {
        std::thread::sleep(Duration::from_millis(500));
        assert!(child.try_wait().unwrap().is_none(), "it was not asked twice");
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    }
    assert_eq!(child.wait().unwrap().code(), Some(143));
    b.leaves_no_stage();
    assert_eq!(std::fs::metadata(b.at("out/report.html")).unwrap().len(), size);
}

#[test]
#[cfg(unix)]
fn an_empty_folder_that_is_named_like_a_stage_stays_and_one_of_a_killed_command_goes() {
    use std::os::unix::fs::PermissionsExt;
    let b = Bench::new();
    let [mine, ours] =
        ["out/.touchdown-stage-0011223344556677", "out/.touchdown-stage-0011223344556688"].map(|n| b.at(n));
    for (folder, mode) in [(&mine, 0o755), (&ours, 0o700)] {
        std::fs::create_dir(folder).unwrap();
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(mode)).unwrap();
    }
    b.done();
    assert!(mine.is_dir() && !ours.exists());
}

#[test]
fn what_begins_as_rows_of_ours_and_is_a_users_is_kept() {
    let b = Bench::new();
    let system = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/contactor_system.toml");
    let system = system.to_str().unwrap();
    const NOTES: &str = "time [s],mine by hand\n1,2\nprecious notes\n";
    for (name, more, code, kept) in [
        ("results.partial.csv", &["--step", "1e-300"][..], 2, "results.partial.kept.csv"),
        ("results.partial.csv.part", &[], 0, "results.partial.csv.kept.part"),
        ("log.partial.txt", &["--step", "1e-300"], 2, "log.partial.txt"),
    ] {
        drop(std::fs::remove_dir_all(b.at("out")));
        std::fs::create_dir(b.at("out")).unwrap();
        std::fs::write(b.at("out").join(name), NOTES).unwrap();
        let o = b.ends(b.command(&[&["run", system, "--out", "out"], more].concat()));
        let said = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(code), "{name}: {said}");
        let found: Vec<String> = std::fs::read_dir(b.at("out"))
            .unwrap()
            .flatten()
            .filter(|e| std::fs::read_to_string(e.path()).is_ok_and(|t| t == NOTES))
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        assert_eq!(found, [kept], "{said}");
        // rows and logs of ours make room without a word
        let again = b.ends(b.command(&[&["run", system, "--out", "out"], more].concat()));
        assert_eq!(again.status.code(), Some(code));
        assert!(!String::from_utf8_lossy(&again.stderr).contains("is kept as"), "{name}: {again:?}");
    }
}

#[test]
fn more_threads_than_a_system_has_are_no_reason_to_end() {
    let b = Bench::new();
    write_campaign(&b.at("campaign"), &Recipe { samples: 250, interval: 2.8e-5, seed: 1, ..Recipe::default() })
        .unwrap();
    let o = b.ends(b.command(&["diagnose", "campaign", "--out", "out", "--jobs", "20000", "--seconds", "0.01"]));
    assert_eq!(o.status.code(), Some(3), "{o:?}");
}

#[test]
#[cfg(target_os = "linux")]
fn an_answer_that_cannot_be_printed_is_a_failure_with_a_cure() {
    let b = Bench::new();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for arguments in [&["run", "drop.toml", "--direct", "--json", "--out", "out"][..], &["--help"], &["--version"]] {
        let mut c = b.command(arguments);
        let o = c.stdout(full()).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("standard output: ") && said.contains("make room there"), "{arguments:?}: {said}");
    }
}

#[test]
fn a_page_of_all_answers_and_a_register_that_cannot_be_written_are_failures() {
    let b = Bench::new();
    write_campaign(&b.at("campaign"), &Recipe { samples: 250, interval: 2.8e-5, seed: 1, ..Recipe::default() })
        .unwrap();
    let diagnose = |more: &[&str]| {
        let o = b.ends(b.command(&[&["diagnose", "campaign", "--out", "out", "--seconds", "0.01"], more].concat()));
        (o.status.code(), String::from_utf8_lossy(&o.stderr).into_owned())
    };
    std::fs::create_dir(b.at("out/index.html")).unwrap();
    let (code, said) = diagnose(&[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("index.html: cannot be written"), "{said}");
    std::fs::create_dir_all(b.at("out/.touchdown-fleet/lost/campaign.json")).unwrap();
    let (code, said) = diagnose(&["--shard", "1/1"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("lost/campaign.json"), "{said}");
}

#[test]
fn an_archive_takes_the_place_of_no_file_of_somebodys_and_of_none_that_it_is_made_of() {
    let b = Bench::new();
    let done = |arguments: &[&str]| {
        let o = b.ends(b.command(arguments));
        (o.status.code(), String::from_utf8_lossy(&o.stderr).into_owned())
    };
    let (code, said) = done(&["pack", "--out", "notes.txt"]);
    assert!(code == Some(0) && said.contains("is kept as notes.kept.txt"), "{said}");
    assert_eq!(text(&b.at("notes.kept.txt")), MINE);
    // one of ours is replaced
    let (code, said) = done(&["pack", "--out", "notes.txt"]);
    assert!(code == Some(0) && !said.contains("kept"), "{said}");
    assert!(!b.at("notes.kept-2.txt").exists());
    let system =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/contactor_system.toml"))
            .unwrap();
    std::fs::write(b.at("s.toml"), system.replace("touchdown:contact", "mine.fmu")).unwrap();
    assert_eq!(done(&["pack", "--out", "mine.fmu"]).0, Some(0));
    let fmu = std::fs::read(b.at("mine.fmu")).unwrap();
    for input in ["s.toml", "mine.fmu", "./mine.fmu"] {
        let (code, said) = done(&["export-ssp", "s.toml", "--out", input]);
        assert!(code == Some(2) && said.contains("--out is a file that is read for it; give another name"), "{said}");
    }
    let packs = ["pack", "--binary", "linux64=mine.fmu", "--out", "mine.fmu"];
    assert_eq!(done(&packs).0, Some(2));
    assert!(std::fs::read(b.at("mine.fmu")).unwrap() == fmu && text(&b.at("s.toml")).contains("mine.fmu"));
    for _ in 0..2 {
        let (code, said) = done(&["export-ssp", "s.toml", "--out", "precious/a"]);
        assert!(code == Some(0), "{said}");
    }
    assert_eq!(text(&b.at("precious/a.kept")), MINE);
    assert!(!b.at("precious/a.kept-2").exists());
}

#[test]
fn an_archive_of_components_with_long_names_can_be_opened_again() {
    let b = Bench::new();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/contactor_system.toml");
    let long = "n".repeat(300);
    let system = std::fs::read_to_string(examples).unwrap();
    let system =
        system.replace("name = \"bar\"", &format!("name = \"{long}\"")).replace("\"bar.", &format!("\"{long}."));
    std::fs::write(b.at("s.toml"), system).unwrap();
    for arguments in [&["export-ssp", "s.toml", "--out", "s.ssp"][..], &["run", "s.ssp", "--out", "of_s"]] {
        let o = b.ends(b.command(arguments));
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    }
}

#[test]
fn rows_that_were_written_stay_where_the_rest_finds_no_room() {
    let b = Bench::new();
    let system = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/contactor_system.toml");
    let system = system.to_str().unwrap();
    for form in ["", " --parquet"] {
        let mut c = Command::new("sh");
        let program = env!("CARGO_BIN_EXE_touchdown");
        let line = format!("ulimit -f 2000; exec {program} run {system} --step 1e-6{form} --out rows");
        c.args(["-c", &line]).current_dir(b.folder.path());
        let o = b.ends(c);
        let said = String::from_utf8_lossy(&o.stderr);
        assert!(o.status.code() == Some(2) && said.contains("ulimit -f"), "{said}");
        let rows = b.at("rows/results.partial.csv");
        match form {
            "" => assert!(said.contains("the results so far are in") && text(&rows).lines().count() > 100, "{said}"),
            _ => assert!(said.contains("the results so far are lost"), "{said}"),
        }
    }
}

#[test]
fn a_list_of_no_campaigns_and_a_file_given_twice_are_refused() {
    let b = Bench::new();
    std::fs::write(b.at("none"), "").unwrap();
    let o = b.ends(b.command(&["diagnose", "--list", "none", "--out", "out"]));
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("no campaign is given"));
    let rows: String = (0..60).map(|i| format!("{},{}\n", i, i % 7)).collect();
    std::fs::write(b.at("a.csv"), format!("time [s],force [N]\n{rows}")).unwrap();
    let o = b.ends(b.command(&["import", "a.csv", "./a.csv", "--height", "5mm", "--mass", "0.3", "--out", "c"]));
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("./a.csv: is given twice; give every file once"));
}

#[test]
fn a_command_works_on_a_small_stack_and_init_takes_a_link_for_something_that_is_there() {
    let b = Bench::new();
    let mut c = Command::new("sh");
    let line = format!("ulimit -s 64; exec {} run drop.toml --direct --out out", env!("CARGO_BIN_EXE_touchdown"));
    c.args(["-c", &line]).current_dir(b.folder.path());
    let o = b.ends(c);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    std::fs::write(b.at("precious/a.csv"), "time,force\n0,1\n").unwrap();
    symlink("/nowhere", b.at("precious/campaign.toml")).unwrap();
    let o = b.ends(b.command(&["init", "precious", "--kind", "drop-test"]));
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("campaign.toml: is there already"));
}

#[test]
fn what_another_user_owns_in_a_shared_folder_is_refused_before_anything_is_replaced() {
    use std::os::unix::{fs::PermissionsExt, process::CommandExt};
    let nobody = 65534;
    let b = Bench::new();
    let open = |path: &Path, mode| std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
    open(b.folder.path(), 0o755);
    // a file of another's in a folder where everybody makes files and nobody moves another's
    std::fs::write(b.at("out/manifest.json"), MINE).unwrap();
    open(&b.at("out"), 0o1777);
    let run = || {
        let mut c = b.command(&["run", "drop.toml", "--direct", "--out", "out"]);
        c.uid(nobody).gid(nobody);
        c
    };
    if !run().args(["--help"]).output().is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: only root has a command run as another user");
        return;
    }
    let o = b.ends(run());
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(
        o.status.code() == Some(2) && said.contains("another user's") && said.contains("give another --out"),
        "{said}"
    );
    assert_eq!(text(&b.at("out/manifest.json")), MINE);
    assert_eq!(std::fs::read_dir(b.at("out")).unwrap().count(), 1, "{said}");
    b.holds();
    b.leaves_no_stage();
}

#[test]
fn a_folder_that_is_mounted_on_itself_gets_its_answer_and_what_is_mounted_below_a_stage_stays() {
    let b = Bench::new();
    let program = env!("CARGO_BIN_EXE_touchdown");
    let inside = |lines: &str| {
        let mut c = Command::new("unshare");
        c.args(["--mount", "sh", "-c", lines]).current_dir(b.folder.path());
        c
    };
    if !inside("mount --bind out out").output().is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: nothing can be mounted here");
        return;
    }
    for _ in 0..2 {
        let o = b.ends(inside(&format!("mount --bind out out && exec {program} run drop.toml --direct --out out")));
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    }
    assert!(output::Manifest::read(&b.at("out")).unwrap().is_whole(&b.at("out")));
    b.leaves_no_stage();
    // what an ended command left, with somebody's folder mounted in it
    let lines = "mkdir -p t/mounted/x && mount --bind precious t/mounted/x && exec sleep 0";
    assert!(b.ends(inside(lines)).status.success());
    let left = format!(
        "mkdir -p out/{0}/new && printf 'touchdown works here\\n' > out/{0}/lock && chmod 700 out/{0} && mount --bind precious \
         out/{0}/new && exec {program} run drop.toml --direct --out out",
        STAGES[1]
    );
    let o = b.ends(inside(&left));
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
    b.holds();
}

#[test]
fn a_page_of_somebodys_and_a_campaign_called_as_a_file_of_all_answers_are_refused_before_anything_is_computed() {
    let b = Bench::new();
    write_campaign(&b.at("c"), &Recipe::default()).unwrap();
    write_campaign(&b.at("fleet.json"), &Recipe::default()).unwrap();
    std::fs::write(b.at("out/index.html"), MINE).unwrap();
    for (campaign, says) in [("c", "is no index of touchdown"), ("fleet.json", "rename the folder")] {
        let o = b.ends(b.command(&["diagnose", campaign, "--out", "out"]));
        let said = String::from_utf8_lossy(&o.stderr);
        assert!(o.status.code() == Some(2) && said.contains(says), "{said}");
    }
    assert_eq!(std::fs::read_dir(b.at("out")).unwrap().count(), 1);
}

#[test]
fn answers_are_up_to_date_in_any_time_and_a_folder_named_by_mistake_is_refused() {
    let b = Bench::new();
    write_campaign(&b.at("c"), &Recipe { samples: 250, interval: 2.8e-5, ..Recipe::default() }).unwrap();
    let diagnosed = |arguments: &[&str]| {
        let o = b.ends(b.command(&[&["diagnose", "c", "--out", "answers", "--resume"], arguments].concat()));
        (o.status.code(), String::from_utf8_lossy(&o.stdout).into_owned())
    };
    let unjudged = diagnosed(&["--seconds", "1e-9"]);
    assert_eq!(unjudged.0, Some(3));
    // no more time: the same; more: judged; less again: what was judged stays
    for (seconds, code, up_to_date) in [("1e-9", 0, true), ("1e6", 0, false), ("1e-9", 0, true), ("1e5", 0, true)] {
        let (ended, said) = diagnosed(&["--seconds", seconds]);
        assert!(ended == Some(code) && said.contains("up to date") == up_to_date, "{seconds}: {ended:?} {said}");
    }
    let o = b.ends(b.command(&["merge", "answers", "precious", "--out", "site"]));
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(o.status.code() == Some(2) && said.contains("precious: holds no answer of touchdown"), "{said}");
    let o = b.ends(b.command(&["merge", "answers", "--out", "site"]));
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
}
