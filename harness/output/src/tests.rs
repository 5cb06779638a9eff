use super::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

fn answer(folder: &Path, files: &[(&str, &str)]) -> Committed {
    let a = Answer::begin(folder, "test").unwrap();
    files.iter().for_each(|(name, text)| a.write(name, text.as_bytes()).unwrap());
    a.commit().unwrap()
}

/// All files below `folder` but for the manifest.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(f) = folders.pop() {
        for path in std::fs::read_dir(f).unwrap().map(|e| e.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.file_name().unwrap() != Manifest::NAME {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                all.insert(name, std::fs::read_to_string(path).unwrap());
            }
        }
    }
    all
}

fn texts(all: &[(&str, &str)]) -> BTreeMap<String, String> {
    all.iter().map(|(n, t)| (n.to_string(), t.to_string())).collect()
}

/// A folder that changes places, and one that cannot, for it holds a folder of the user's.
fn both_kinds() -> (tempfile::TempDir, [PathBuf; 2]) {
    let t = tempfile::tempdir().unwrap();
    let places = [t.path().join("moves"), t.path().join("stays")];
    std::fs::create_dir_all(places[1].join("mine")).unwrap();
    (t, places)
}

#[test]
fn a_place_where_nothing_can_be_written_is_told_before_any_work() {
    let t = tempfile::tempdir().unwrap();
    std::fs::write(t.path().join("file"), b"1").unwrap();
    assert!(probe(&t.path().join("a/b/c")).is_ok() && probe(t.path()).is_ok());
    assert!(probe(&t.path().join("file/b")).is_err());
    assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), 1);
}

#[test]
fn a_file_takes_the_place_of_another_or_says_that_it_is_there() {
    let t = tempfile::tempdir().unwrap();
    let path = t.path().join("a/b");
    write(&path, b"1").unwrap();
    write(&path, b"2").unwrap();
    assert_eq!(write_new(&path, b"3").unwrap_err().kind(), std::io::ErrorKind::AlreadyExists);
    write_new(&t.path().join("a/c"), b"4").unwrap();
    assert_eq!(files(t.path()), texts(&[("a/b", "2"), ("a/c", "4")]));
}

#[test]
fn an_answer_replaces_the_one_before_and_leaves_the_users_files() {
    let (_t, places) = both_kinds();
    for place in places {
        answer(&place, &[("x", "1"), ("below/y", "1"), ("below/z", "1")]);
        std::fs::write(place.join("my.txt"), "mine").unwrap();
        std::fs::write(place.join("below/my.txt"), "mine").unwrap();
        let written = answer(&place, &[("x", "2"), ("below/z", "2")]);
        assert!(written.kept.is_empty());
        let mine = [("my.txt", "mine"), ("below/my.txt", "mine")];
        assert_eq!(files(&place), texts(&[("x", "2"), ("below/z", "2"), mine[0], mine[1]]));
        answer(&place, &[("x", "3")]);
        assert_eq!(files(&place), texts(&[("x", "3"), mine[0], mine[1]]));
        let m = Manifest::read(&place).unwrap();
        assert!(m.is_whole(&place) && m.files.len() == 1 && m.command == "test");
    }
}

#[test]
fn a_file_that_was_changed_since_is_kept_and_reported() {
    let (_t, places) = both_kinds();
    for place in places {
        answer(&place, &[("x.csv", "1"), ("y", "1")]);
        for change in ["a", "b"] {
            std::fs::write(place.join("x.csv"), change).unwrap();
            std::fs::write(place.join("y"), change).unwrap();
            let written = answer(&place, &[("x.csv", "2")]);
            let name = if change == "a" { "x.kept.csv" } else { "x.kept-2.csv" };
            assert_eq!(
                written.notes().collect::<Vec<_>>(),
                [format!("x.csv was not as touchdown writes it, and is kept as {name}")]
            );
        }
        assert_eq!(files(&place), texts(&[("x.csv", "2"), ("x.kept.csv", "a"), ("x.kept-2.csv", "b"), ("y", "b")]));
    }
}

#[test]
fn a_file_that_no_manifest_lists_is_nobodys_to_replace() {
    let (_t, places) = both_kinds();
    for place in places {
        std::fs::create_dir_all(&place).unwrap();
        std::fs::write(place.join("x"), "mine").unwrap();
        std::fs::write(place.join(Manifest::NAME), "mine").unwrap();
        assert_eq!(answer(&place, &[("x", "1")]).kept.len(), 2);
        assert_eq!(files(&place), texts(&[("x", "1"), ("x.kept", "mine"), ("manifest.kept.json", "mine")]));
    }
}

#[test]
fn the_answer_of_another_command_stays_beside_but_for_what_is_replaced() {
    let (_t, places) = both_kinds();
    for place in places {
        let a = Answer::begin(&place, "other").unwrap();
        a.write("x", b"1").unwrap();
        a.write("y", b"1").unwrap();
        a.commit().unwrap();
        assert!(answer(&place, &[("x", "2"), ("z", "2")]).kept.is_empty());
        assert_eq!(files(&place), texts(&[("x", "2"), ("y", "1"), ("z", "2")]));
        // and the first command knows its file again
        let a = Answer::begin(&place, "other").unwrap();
        a.write("y", b"3").unwrap();
        assert!(a.commit().unwrap().kept.is_empty());
        assert_eq!(files(&place), texts(&[("x", "2"), ("y", "3"), ("z", "2")]));
    }
}

#[test]
fn an_answer_that_is_not_finished_leaves_nothing() {
    let t = tempfile::tempdir().unwrap();
    let place = t.path().join("a/b");
    answer(&place, &[("x", "1")]);
    let a = Answer::begin(&place, "test").unwrap();
    a.write("x", b"2").unwrap();
    drop(a);
    assert_eq!(files(t.path()).get("a/b/x").unwrap(), "1");
    assert_eq!(std::fs::read_dir(t.path().join("a")).unwrap().count(), 1);
}

#[test]
fn a_change_of_one_file_leaves_the_others_of_the_answer() {
    let (_t, places) = both_kinds();
    for place in places {
        answer(&place, &[("x", "1"), ("below/y", "1")]);
        let a = Answer::amend(&place, "other").unwrap();
        a.write("x", b"2").unwrap();
        a.commit().unwrap();
        assert_eq!(files(&place), texts(&[("x", "2"), ("below/y", "1")]));
        let m = Manifest::read(&place).unwrap();
        assert!(m.is_whole(&place) && m.files.len() == 2 && m.command == "test");
    }
}

#[test]
fn rows_written_in_the_folder_are_taken_into_the_answer() {
    let (_t, places) = both_kinds();
    for place in places {
        answer(&place, &[("rows", "1")]);
        let rows = place.join("rows.partial");
        std::fs::write(&rows, "2").unwrap();
        let mut a = Answer::begin(&place, "test").unwrap();
        a.take(&rows, "rows");
        a.commit().unwrap();
        assert_eq!(files(&place), texts(&[("rows", "2")]));
    }
}

#[test]
fn stages_of_ended_processes_are_cleared_away_and_those_of_others_stay() {
    let t = tempfile::tempdir().unwrap();
    let left = Stage::within(t.path()).unwrap();
    std::fs::create_dir(left.path().join("new")).unwrap();
    let path = left.path().to_path_buf();
    stage::sweep(t.path());
    assert!(path.exists());
    left.leave();
    write(&t.path().join("x"), b"1").unwrap();
    assert!(!path.exists());
}

#[test]
fn a_stage_without_a_lock_is_of_a_process_that_was_killed_at_once() {
    let t = tempfile::tempdir().unwrap();
    let left = Stage::within(t.path()).unwrap();
    let path = left.path().to_path_buf();
    left.leave();
    std::fs::remove_file(path.join("lock")).unwrap();
    stage::sweep(t.path());
    assert!(!path.exists());
}

/// Writers in one folder at once, each with its name: every one sweeps while others make their stages.
#[test]
fn many_writers_in_one_folder_leave_each_others_stages_alone() {
    const WRITERS: usize = 16;
    const ROUNDS: usize = 150;
    let t = tempfile::tempdir().unwrap();
    std::thread::scope(|s| {
        for w in 0..WRITERS {
            let folder = t.path();
            s.spawn(move || {
                for i in 0..ROUNDS {
                    let text = format!("{w} {i}");
                    if w % 2 == 0 {
                        write(&folder.join(format!("f{w}")), text.as_bytes()).unwrap();
                    } else {
                        answer(&folder.join(format!("a{w}")), &[("x", &text)]);
                    }
                }
            });
        }
    });
    let all = files(t.path());
    assert_eq!(all.len(), WRITERS);
    assert!(all.values().all(|text| text.ends_with(&format!(" {}", ROUNDS - 1))), "{all:?}");
    assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), WRITERS, "a stage was left");
}

#[test]
fn a_replacement_that_was_cut_short_is_finished_by_the_next_command() {
    let (t, [place, _]) = both_kinds();
    answer(&place, &[("x", "1"), ("y", "1"), ("z", "1")]);
    answer(&t.path().join("other"), &[("x", "2"), ("y", "2")]);
    let stage = Stage::within(&place).unwrap();
    std::fs::rename(t.path().join("other"), stage.path().join("ready")).unwrap();
    std::fs::rename(stage.path().join("ready/x"), place.join("x")).unwrap();
    stage.leave();
    probe(&place).unwrap();
    assert_eq!(files(&place), texts(&[("x", "2"), ("y", "2")]));
    assert!(Manifest::read(&place).unwrap().is_whole(&place));
}

#[test]
#[cfg(unix)]
fn a_link_to_a_folder_stays_a_link() {
    let t = tempfile::tempdir().unwrap();
    let (real, link) = (t.path().join("real"), t.path().join("link"));
    answer(&real, &[("x", "1")]);
    std::os::unix::fs::symlink(&real, &link).unwrap();
    answer(&link, &[("x", "2")]);
    assert!(link.is_symlink());
    assert_eq!(files(&real), texts(&[("x", "2")]));
}
