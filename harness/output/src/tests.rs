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
        let (rows, kept) = Part::new(&place.join("rows.partial"), |_| true).unwrap();
        assert!(kept.is_empty() && place.join("rows.partial.part").exists());
        std::io::Write::write_all(&mut rows.file().unwrap(), b"2").unwrap();
        let mut a = Answer::begin(&place, "test").unwrap();
        a.take(rows, "rows");
        a.commit().unwrap();
        assert_eq!(files(&place), texts(&[("rows", "2")]));
    }
}

#[test]
fn stages_of_ended_processes_are_cleared_away_and_those_of_others_stay() {
    let t = tempfile::tempdir().unwrap();
    let left = Stage::within(t.path()).unwrap();
    left.folder().make("new").unwrap();
    let path = left.folder().path().to_path_buf();
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
    let path = left.folder().path().to_path_buf();
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
    std::fs::rename(t.path().join("other"), stage.folder().path().join("ready")).unwrap();
    std::fs::rename(stage.folder().path().join("ready/x"), place.join("x")).unwrap();
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

/// A name as stages have it.
#[cfg(unix)]
const STAGE: &str = ".touchdown-stage-00112233445566aa";

/// A place to write to, with a folder of somebody's beside it.
#[cfg(unix)]
fn beside_a_precious_folder() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let t = tempfile::tempdir().unwrap();
    let (place, precious) = (t.path().join("place"), t.path().join("precious"));
    std::fs::create_dir_all(precious.join("below")).unwrap();
    std::fs::create_dir(&place).unwrap();
    for name in ["lock", "new", "below/x"] {
        std::fs::write(precious.join(name), "mine").unwrap();
    }
    (t, place, precious)
}

/// That nothing of the folder is gone or changed.
#[cfg(unix)]
fn is_whole(precious: &Path) {
    assert_eq!(files(precious), texts(&[("lock", "mine"), ("new", "mine"), ("below/x", "mine")]));
}

/// Everything that writes into `place`.
#[cfg(unix)]
fn write_all_ways(place: &Path) {
    probe(place).unwrap();
    write(&place.join("one"), b"1").unwrap();
    drop(std::fs::remove_file(place.join("two")));
    write_new(&place.join("two"), b"2").unwrap();
    answer(&place.join("answer"), &[("x", "1")]);
    answer(place, &[("three", "3")]);
}

#[cfg(unix)]
fn pipe(path: &Path) {
    let made = std::process::Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

#[test]
#[cfg(unix)]
fn a_link_with_the_name_of_a_stage_is_not_followed() {
    let (_t, place, precious) = beside_a_precious_folder();
    std::os::unix::fs::symlink(&precious, place.join(STAGE)).unwrap();
    write_all_ways(&place);
    is_whole(&precious);
    assert!(place.join(STAGE).is_symlink());
}

#[test]
#[cfg(unix)]
fn a_folder_with_the_name_of_a_stage_that_holds_more_is_the_users() {
    let (_t, place, _) = beside_a_precious_folder();
    std::fs::create_dir_all(place.join(STAGE).join("new")).unwrap();
    for name in ["lock", "new/x", "diary"] {
        std::fs::write(place.join(STAGE).join(name), "mine").unwrap();
    }
    write_all_ways(&place);
    assert_eq!(files(&place.join(STAGE)), texts(&[("lock", "mine"), ("new/x", "mine"), ("diary", "mine")]));
}

#[test]
#[cfg(unix)]
fn a_lock_that_is_a_link_or_a_pipe_is_left_alone() {
    for is_link in [true, false] {
        let (_t, place, precious) = beside_a_precious_folder();
        std::fs::create_dir(place.join(STAGE)).unwrap();
        let lock = place.join(STAGE).join("lock");
        if is_link {
            std::os::unix::fs::symlink(precious.join("lock"), lock).unwrap();
        } else {
            pipe(&lock);
        }
        write_all_ways(&place);
        is_whole(&precious);
    }
}

#[test]
#[cfg(unix)]
fn what_a_stage_holds_is_removed_without_following_links() {
    let (_t, place, precious) = beside_a_precious_folder();
    let left = Stage::within(&place).unwrap();
    let stage = left.folder().path().to_path_buf();
    left.leave();
    std::fs::create_dir(stage.join("new")).unwrap();
    std::os::unix::fs::symlink(&precious, stage.join("new/precious")).unwrap();
    std::fs::hard_link(precious.join("new"), stage.join("new/hard")).unwrap();
    std::os::unix::fs::symlink(&precious, stage.join("ready")).unwrap();
    write_all_ways(&place);
    assert!(!stage.exists());
    is_whole(&precious);
}

/// A stage that a killed process seems to have left, about to put `name` in its place.
#[cfg(unix)]
fn ready(place: &Path, name: &str, text: &str) {
    let left = Stage::within(place).unwrap();
    let ready = left.folder().path().join("ready");
    left.leave();
    std::fs::create_dir(&ready).unwrap();
    std::fs::write(ready.join("x"), text).unwrap();
    let size = text.len();
    let sha256 = Entry::of(&ready.join("x"), "").unwrap().sha256;
    let list = format!("{{\"{name}\": {{\"size\": {size}, \"sha256\": \"{sha256}\", \"command\": \"test\"}}}}");
    let manifest =
        format!("{{\"format\": \"manifest/1\", \"touchdown\": \"0\", \"command\": \"test\", \"files\": {list}}}");
    std::fs::write(ready.join(Manifest::NAME), manifest).unwrap();
}

#[test]
#[cfg(unix)]
fn a_replacement_names_no_file_outside_and_keeps_a_users_file() {
    for name in ["../precious/new", "a/../../precious/new", "./x", "a//x", ""] {
        let (t, place, precious) = beside_a_precious_folder();
        ready(&place, name, "not mine");
        ready(&place, &t.path().join("precious/new").display().to_string(), "not mine");
        write_all_ways(&place);
        is_whole(&precious);
    }
}

#[test]
#[cfg(unix)]
fn a_replacement_that_had_not_begun_is_not_finished_and_one_that_had_is_reported() {
    // as an archive from elsewhere may hold it
    let (_t, place, _) = beside_a_precious_folder();
    std::fs::write(place.join("x"), "mine").unwrap();
    ready(&place, "x", "not mine");
    probe(&place).unwrap();
    assert_eq!(files(&place), texts(&[("x", "mine")]));
    // one file of two is in its place already
    std::fs::write(place.join("y"), "not mine").unwrap();
    let entry = Entry::of(&place.join("y"), "test").unwrap();
    ready(&place, "x", "not mine");
    let stage = std::fs::read_dir(&place).unwrap().map(|e| e.unwrap().path()).find(|p| p.is_dir()).unwrap();
    let mut is = Manifest::read(&stage.join("ready")).unwrap();
    is.files.insert("y".into(), entry);
    std::fs::write(stage.join("ready/manifest.json"), serde_json::to_string(&is).unwrap()).unwrap();
    probe(&place).unwrap();
    assert_eq!(files(&place), texts(&[("x", "not mine"), ("x.kept", "mine"), ("y", "not mine")]));
    let said = finished();
    let own: Vec<&String> = said.iter().filter(|l| l.starts_with(&place.display().to_string())).collect();
    assert!(own.len() == 2 && own[1].ends_with("x was not as touchdown writes it, and is kept as x.kept"), "{said:?}");
}

#[test]
#[cfg(unix)]
fn a_manifest_with_names_outside_removes_and_replaces_nothing() {
    let (t, place, precious) = beside_a_precious_folder();
    std::fs::create_dir(place.join("mine")).unwrap();
    std::os::unix::fs::symlink(&precious, place.join("link")).unwrap();
    let sha256 = Entry::of(&precious.join("new"), "").unwrap().sha256;
    let entry = format!("{{\"size\": 4, \"sha256\": \"{sha256}\", \"command\": \"test\"}}");
    let absolute = t.path().join("precious/new").display().to_string();
    for name in ["../precious/new", "mine/../../precious/new", &absolute, "link/new", "link"] {
        let list = format!("{{\"{name}\": {entry}}}");
        let text =
            format!("{{\"format\": \"manifest/1\", \"touchdown\": \"0\", \"command\": \"test\", \"files\": {list}}}");
        std::fs::write(place.join(Manifest::NAME), text).unwrap();
        write_all_ways(&place);
        is_whole(&precious);
        assert!(place.join("mine").is_dir() && place.join("link").is_symlink(), "{name}");
    }
}

#[test]
#[cfg(unix)]
fn a_link_in_the_place_of_a_folder_of_the_answer_is_kept_or_in_the_way() {
    let (_t, place, precious) = beside_a_precious_folder();
    std::os::unix::fs::symlink(&precious, place.join("below")).unwrap();
    let kept = answer(&place, &[("below/x", "1")]).kept;
    assert_eq!(kept, [Kept { name: "below".into(), kept_as: "below.kept".into() }]);
    is_whole(&precious);
    // where the folder cannot change places
    let (_t, place, precious) = beside_a_precious_folder();
    std::fs::create_dir(place.join("mine")).unwrap();
    std::os::unix::fs::symlink(&precious, place.join("below")).unwrap();
    let a = Answer::begin(&place, "test").unwrap();
    a.write("below/x", b"1").unwrap();
    let e = a.commit().unwrap_err().to_string();
    assert!(e.contains("below is in the way; move it"), "{e}");
    assert!(write_below(&place, "below/x", b"1").unwrap_err().to_string().contains("is no folder of its own"));
    is_whole(&precious);
}

#[test]
#[cfg(unix)]
fn pipes_in_the_place_of_files_of_the_answer_are_kept_and_not_waited_for() {
    let (_t, places) = both_kinds();
    for place in places {
        std::fs::create_dir_all(&place).unwrap();
        pipe(&place.join(Manifest::NAME));
        pipe(&place.join("x"));
        assert!(Manifest::read(&place).is_none());
        assert_eq!(answer(&place, &[("x", "1")]).kept.len(), 2);
        assert_eq!(std::fs::read_to_string(place.join("x")).unwrap(), "1");
    }
}

#[test]
#[cfg(unix)]
fn a_temporary_folder_goes_whatever_its_modes_are() {
    use std::os::unix::fs::PermissionsExt;
    let scratch = Scratch::new("test").unwrap();
    let path = scratch.path().parent().unwrap().to_path_buf();
    let below = scratch.path().join("a/b");
    std::fs::create_dir_all(&below).unwrap();
    assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o700, "others may enter");
    std::fs::write(below.join("x"), "1").unwrap();
    for folder in [&below, &scratch.path().join("a")] {
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o0)).unwrap();
    }
    drop(scratch);
    assert!(!path.exists());
}

#[test]
fn a_second_writer_of_the_same_rows_is_refused_and_what_is_not_rows_is_kept() {
    let t = tempfile::tempdir().unwrap();
    let path = t.path().join("out/rows");
    let new = || Part::new(&path, |f| begins(f, "time"));
    let (first, _) = new().unwrap();
    let e = new().unwrap_err().to_string();
    assert!(e.contains("is being written by another process; wait for its end, or give another --out"), "{e}");
    drop(first);
    assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 0);
    let part = t.path().join("out/rows.part");
    std::fs::write(&part, "time [s]\n").unwrap();
    assert!(new().unwrap().1.is_empty(), "of a run that was killed");
    std::fs::write(&part, "mine").unwrap();
    std::fs::write(&path, "mine too").unwrap();
    let (rows, kept) = new().unwrap();
    assert_eq!(kept.len(), 1);
    assert_eq!(rows.leave(|f| begins(f, "time")).unwrap().map(|k| k.kept_as), Some("rows.kept".into()));
    let all = texts(&[("rows", ""), ("rows.kept", "mine too"), ("rows.kept.part", "mine")]);
    assert_eq!(files(path.parent().unwrap()), all);
}

#[test]
fn rows_are_there_though_another_answer_took_the_place_of_their_folder() {
    let t = tempfile::tempdir().unwrap();
    let place = t.path().join("place");
    answer(&place, &[("x", "1")]);
    let (rows, _) = Part::new(&place.join("rows"), |_| true).unwrap();
    answer(&place, &[("x", "2")]);
    let mut a = Answer::begin(&place, "other").unwrap();
    a.take(rows, "rows");
    a.commit().unwrap();
    assert_eq!(files(&place), texts(&[("x", "2"), ("rows", "")]));
}

/// Answers of one command put into one folder at once: each whole, none takes another's files for the user's.
#[test]
fn many_answers_in_one_folder_at_once_keep_nothing_and_stay_whole() {
    let (t, places) = both_kinds();
    for place in &places {
        std::thread::scope(|s| {
            for w in 0..8 {
                s.spawn(move || {
                    for i in 0..25 {
                        let text = format!("{w} {i}");
                        assert!(answer(place, &[("x", &text), ("below/y", &text)]).kept.is_empty());
                    }
                });
            }
        });
        let all = files(place);
        assert_eq!(all.keys().collect::<Vec<_>>(), ["below/y", "x"]);
        assert_eq!(all["x"], all["below/y"]);
        assert!(Manifest::read(place).unwrap().is_whole(place));
    }
    assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), places.len(), "a stage was left");
}

/// An answer's folder changes places while another answer, or a file, is put below it for the first time.
#[test]
fn what_is_put_below_a_folder_that_changes_places_is_not_lost() {
    const MINE: usize = 300;
    for round in 0..60 {
        let t = tempfile::tempdir().unwrap();
        let out = t.path().join("out");
        answer(&out, &[("x", "1"), ("below/y", "1")]);
        (0..MINE).for_each(|i| std::fs::write(out.join(format!("mine{i}")), "mine").unwrap());
        std::thread::scope(|s| {
            s.spawn(|| answer(&out, &[("x", "2"), ("below/y", "2")]));
            s.spawn(|| {
                // so that they meet at every stage of the other
                std::thread::sleep(std::time::Duration::from_micros(round * 100));
                answer(&out.join("one"), &[("x", "3")]);
                write(&out.join("below/two"), b"4").unwrap();
                write_below(&out, "three/four", b"5").unwrap();
            });
        });
        let all = files(&out);
        let of = |name: &str| all.get(name).map(String::as_str);
        assert_eq!([of("x"), of("below/y"), of("one/x")], [Some("2"), Some("2"), Some("3")], "{round}");
        assert_eq!([of("below/two"), of("three/four")], [Some("4"), Some("5")], "{round}");
        assert_eq!(all.len(), MINE + 5, "{round}");
        assert!(Manifest::read(&out.join("one")).unwrap().is_whole(&out.join("one")), "{round}");
        assert!(std::fs::read_dir(&out).unwrap().all(|e| !stage::is_stage(&e.unwrap().file_name())), "{round}");
        assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), 1, "{round}");
    }
}

/// A stage moves with the place of its folder after it was made and before it could be opened: it is not left where it is now.
#[test]
#[cfg(unix)]
fn a_stage_that_moved_before_it_was_opened_is_not_left() {
    let t = tempfile::tempdir().unwrap();
    let out = t.path().join("out");
    let name = std::ffi::OsString::from(format!(".touchdown-stage-{}", "0".repeat(16)));
    std::fs::create_dir(&out).unwrap();
    let home = Folder::open(&out).unwrap();
    std::fs::remove_dir(&out).unwrap();
    std::fs::create_dir_all(out.join(&name)).unwrap();
    assert!(Stage::made(home, &name).unwrap().is_none());
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
}

#[test]
#[cfg(unix)]
fn a_file_of_a_list_that_is_larger_than_anything_we_write_is_not_hashed() {
    let t = tempfile::tempdir().unwrap();
    let place = t.path().join("place");
    answer(&place, &[("x", "1")]);
    let mut m = Manifest::read(&place).unwrap();
    // a file with a hole, as large as the list says
    let size = 1 << 42;
    std::fs::File::create(place.join("x")).unwrap().set_len(size).unwrap();
    m.files.get_mut("x").unwrap().size = size;
    std::fs::write(place.join(Manifest::NAME), serde_json::to_string(&m).unwrap()).unwrap();
    assert!(Manifest::read(&place).is_none());
    assert_eq!(answer(&place, &[("x", "2")]).kept.len(), 2);
    assert_eq!(std::fs::read_to_string(place.join("x")).unwrap(), "2");
    assert_eq!(std::fs::metadata(place.join("x.kept")).unwrap().len(), size);
}

fn begins(mut file: std::fs::File, with: &str) -> bool {
    let mut text = String::new();
    std::io::Read::read_to_string(&mut file, &mut text).is_ok() && text.starts_with(with)
}

#[test]
fn a_file_that_is_none_of_ours_is_kept_beside() {
    let t = tempfile::tempdir().unwrap();
    let put = |text: &str| write_keeping(t.path(), "x.txt", text.as_bytes(), |f| begins(f, "ours")).unwrap();
    assert!(put("ours 1").is_none() && put("ours 2").is_none());
    std::fs::write(t.path().join("x.txt"), "mine").unwrap();
    assert_eq!(put("ours 3").map(|k| k.kept_as).as_deref(), Some("x.kept.txt"));
    assert_eq!(files(t.path()), texts(&[("x.txt", "ours 3"), ("x.kept.txt", "mine")]));
}

#[test]
#[cfg(unix)]
fn a_users_folder_that_looks_like_a_stage_is_left_alone() {
    let (_t, place, _) = beside_a_precious_folder();
    std::fs::create_dir_all(place.join(STAGE).join("new")).unwrap();
    std::fs::write(place.join(STAGE).join("new/x"), "mine").unwrap();
    for lock in ["", "mine"] {
        std::fs::write(place.join(STAGE).join("lock"), lock).unwrap();
        write_all_ways(&place);
        assert_eq!(files(&place.join(STAGE)), texts(&[("lock", lock), ("new/x", "mine")]));
    }
}

#[test]
#[cfg(unix)]
fn a_stage_that_could_not_be_removed_whole_is_known_by_its_lock_and_goes_later() {
    let t = tempfile::tempdir().unwrap();
    let stage = Stage::within(t.path()).unwrap();
    let path = stage.folder().path().to_path_buf();
    // deeper than anything is removed
    let deep = path.join("new").join("a/".repeat(300));
    std::fs::create_dir_all(&deep).unwrap();
    drop(stage);
    assert!(path.join("lock").exists() && path.join("new").exists());
    std::fs::remove_dir_all(path.join("new")).unwrap();
    stage::sweep(t.path());
    assert!(!path.exists());
}

#[test]
fn a_name_that_is_too_long_to_be_kept_is_cut_and_one_that_is_never_free_ends() {
    let long = format!("{}.csv", "r".repeat(250));
    let kept = crate::carry::kept_name(&format!("predictions/{long}"), |_| true);
    let file = kept.rsplit('/').next().unwrap();
    assert!(kept.starts_with("predictions/r") && file.len() <= 255 && file.ends_with(".kept.csv"), "{kept}");
    assert!(crate::carry::kept_name("a.csv", |_| false).starts_with("a.kept-"));
    assert_eq!(crate::carry::kept_name("a.csv", |n| n != "a.kept.csv"), "a.kept-2.csv");
}

#[test]
#[cfg(unix)]
fn a_file_whose_name_is_no_utf8_is_the_users() {
    use std::os::unix::ffi::OsStrExt;
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    answer(&out, &[("x\u{fffd}.csv", "ours")]);
    let mine = out.join(std::ffi::OsStr::from_bytes(b"x\xff.csv"));
    std::fs::write(&mine, "precious").unwrap();
    answer(&out, &[("y.csv", "new")]);
    assert_eq!(std::fs::read_to_string(mine).unwrap(), "precious");
}

#[test]
#[cfg(unix)]
fn one_file_takes_the_place_of_files_alone() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("precious"), "mine").unwrap();
    let link = dir.path().join("link");
    std::os::unix::fs::symlink("precious", &link).unwrap();
    let e = crate::write(&link, b"new").unwrap_err();
    assert!(e.to_string().contains("is no file"), "{e}");
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(std::fs::read_to_string(dir.path().join("precious")).unwrap(), "mine");
    crate::write(&dir.path().join("precious"), b"new").unwrap();
    assert_eq!(std::fs::read_to_string(dir.path().join("precious")).unwrap(), "new");
}

#[test]
#[cfg(unix)]
fn a_folder_that_an_answer_is_put_into_keeps_its_owner_and_its_group() {
    use std::os::unix::fs::{chown, MetadataExt};
    let t = tempfile::tempdir().unwrap();
    let place = t.path().join("a");
    answer(&place, &[("x", "1")]);
    if chown(&place, Some(4321), Some(5432)).is_err() {
        eprintln!("skipped: this user cannot give a folder to another");
        return;
    }
    answer(&place, &[("x", "2")]);
    let m = std::fs::metadata(&place).unwrap();
    assert_eq!((m.uid(), m.gid()), (4321, 5432));
    assert_eq!(files(&place), texts(&[("x", "2")]));
}
