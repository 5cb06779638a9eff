//! Files that hold very much of something: an error, or an answer, whose length does not grow with them.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

fn touchdown(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).current_dir(folder).output().unwrap()
}

/// What `check` says of a campaign with this recording, in exit code 2.
fn complaint(recording: &str, more: &str) -> String {
    let t = tempfile::tempdir().unwrap();
    let toml = format!(
        "format = \"recordings/1\"\n[campaign]\nkind = \"drop-test\"\n[rig]\nmoving_mass = 0.5\n{more}\n[simulation]\nterms = []\n\
         [[recording]]\nfile = \"r.csv\"\norder = 1\ndrop_height = 0.01\n"
    );
    std::fs::create_dir(t.path().join("c")).unwrap();
    std::fs::write(t.path().join("c/campaign.toml"), toml).unwrap();
    std::fs::write(t.path().join("c/r.csv"), recording).unwrap();
    let o = touchdown(t.path(), &["check", "c"]);
    let said = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(2), "{said:.1000}");
    said
}

/// A table of that many columns.
fn wide(columns: usize) -> String {
    let mut text = String::from("time [s]");
    (1..columns).for_each(|c| write!(text, ",a{c} [N]").unwrap());
    for row in 0..20 {
        write!(text, "\n{row}").unwrap();
        (1..columns).for_each(|c| write!(text, ",{}", (c + row) % 7).unwrap());
    }
    text + "\n"
}

#[test]
fn a_recording_of_very_many_columns_is_refused_in_a_line() {
    let said = complaint(&wide(100_000), "");
    assert!(said.contains("r.csv:1: 100000 columns, more than the 16384 that are read"), "{said:.1000}");
    assert!(said.len() < 1000, "{}", said.len());
    // as many as there may be, none of them known: the first are told, the others counted
    let said = complaint(&wide(16_000), "");
    assert!(said.contains("column \"a999\" is not known") && !said.contains("\"a15999\""), "{said:.1000}");
    assert!(said.contains("faults more are not told"), "{said:.1000}");
}

#[test]
fn a_table_of_very_many_columns_is_imported_or_refused_in_a_line() {
    let t = tempfile::tempdir().unwrap();
    std::fs::write(t.path().join("wide.csv"), wide(100_000)).unwrap();
    let o = touchdown(t.path(), &["import", "wide.csv", "--height", "5mm", "--mass", "0.5", "--out", "c"]);
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(o.status.code() == Some(2) && said.contains("more than 16384 columns"), "{said:.1000}");
}

#[test]
fn a_cell_and_a_key_without_an_end_are_not_repeated_whole() {
    let mut rows = String::from("time [s],force [N]\n");
    (0..20).for_each(|i| writeln!(rows, "{i},0").unwrap());
    let said = complaint(&(rows.clone() + "20," + &"x".repeat(20_000_000) + "\n"), "");
    assert!(said.contains("r.csv:22: force holds \"xxx") && said.len() < 2000, "{}", said.len());
    let said = complaint(&rows, &("k".repeat(10_000_000) + " = 1"));
    assert!(said.contains("kkk... (10000000 bytes)") && said.len() < 2000, "{}", said.len());
    let said = complaint(&rows, &format!("moving_mass_of = \"{}\"", "m".repeat(10_000_000)));
    assert!(said.contains("did you mean \"moving_mass\"?") && said.len() < 2000, "{}", said.len());
}

#[test]
fn very_many_unknown_keys_are_told_up_to_a_thousand_and_counted() {
    let keys = (0..100_000).fold(String::new(), |keys, i| keys + &format!("a{i} = 1\n"));
    let said = complaint("time [s],force [N]\n", &keys);
    assert!(
        (1000..1100).contains(&said.lines().count()) && said.contains("99000 faults more are not told"),
        "{said:.1000}"
    );
}

/// What `check` says, in little memory, of a campaign whose recording has this head and then 2 GiB without a line break.
fn long(head: &str) -> String {
    let t = tempfile::tempdir().unwrap();
    let toml = "format = \"recordings/1\"\n[campaign]\n\
                kind = \"drop-test\"\n[rig]\nmoving_mass = 0.5\n[simulation]\nterms = []\n\
                [[recording]]\nfile = \"r.csv\"\norder = 1\ndrop_height = 0.01\n";
    std::fs::create_dir(t.path().join("c")).unwrap();
    std::fs::write(t.path().join("c/campaign.toml"), toml).unwrap();
    let mut file = std::fs::File::create(t.path().join("c/r.csv")).unwrap();
    std::io::Write::write_all(&mut file, head.as_bytes()).unwrap();
    // a hole: zeros up to the end of the largest file that is read
    file.set_len(2 << 30).unwrap();
    let mut c = Command::new("sh");
    c.args(["-c", "ulimit -v 1000000; exec \"$0\" check c", env!("CARGO_BIN_EXE_touchdown")]);
    let o = c.current_dir(t.path()).output().unwrap();
    let said = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(2), "{said:.1000}");
    said
}

#[test]
#[cfg(target_os = "linux")]
fn a_row_without_an_end_is_refused_before_it_is_whole_in_memory() {
    let said = long("");
    assert!(
        said.contains("r.csv:1: cannot be read (a row has more than 33554432 bytes); close the quotes"),
        "{said:.1000}"
    );
    let said = long("time [s],force [N]\n0,1\n1,\"2");
    assert!(
        said.contains("r.csv:3: cannot be read (a row has more than 33554432 bytes); close the quotes"),
        "{said:.1000}"
    );
}

#[test]
fn a_system_of_very_many_fmus_is_refused_before_any_is_opened() {
    let t = tempfile::tempdir().unwrap();
    let system =
        (0..5000).fold(String::new(), |text, i| text + &format!("[[fmu]]\nname = \"f{i}\"\nfile = \"x.fmu\"\n"));
    std::fs::write(t.path().join("system.toml"), system + "[master]\nstop = 1\nstep = 0.1\n").unwrap();
    let o = touchdown(t.path(), &["run", "system.toml", "--out", "out"]);
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(o.status.code() == Some(2) && said.contains("more than 1000 FMUs; run the system in parts"), "{said}");
}

#[test]
fn an_archive_of_very_many_components_is_refused_before_any_is_opened() {
    use std::io::Write as _;
    let t = tempfile::tempdir().unwrap();
    let head = "<ssd:SystemStructureDescription xmlns:ssd=\"http://ssp-standard.org/SSP1/SystemStructureDescription\" \
                version=\"1.0\" name=\"s\"><ssd:System name=\"s\"><ssd:Elements>";
    let components = (0..5000).fold(String::new(), |text, i| {
        text + &format!("<ssd:Component name=\"f{i}\" type=\"application/x-fmu-sharedlibrary\" source=\"x.fmu\"/>")
    });
    let text = format!("{head}{components}</ssd:Elements></ssd:System></ssd:SystemStructureDescription>");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(t.path().join("s.ssp")).unwrap());
    archive.start_file("SystemStructure.ssd", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(text.as_bytes()).unwrap();
    archive.finish().unwrap();
    let o = touchdown(t.path(), &["run", "s.ssp", "--out", "out"]);
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(
        o.status.code() == Some(2) && said.contains("5000 components, more than the 1000 that run here"),
        "{said:.1000}"
    );
}

#[test]
fn a_text_of_very_many_tables_is_refused_in_a_line() {
    let t = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for table in 0..10_002 {
        write!(text, "Table {table}\ntime [s],force [N]\n0,1\n1,2\n2,1\n3,0\n\n").unwrap();
    }
    std::fs::write(t.path().join("many.csv"), text).unwrap();
    let o = touchdown(t.path(), &["import", "many.csv", "--height", "5mm", "--mass", "0.5", "--out", "c"]);
    let said = String::from_utf8_lossy(&o.stderr);
    assert!(o.status.code() == Some(2) && said.contains("more than 10000 tables"), "{said:.1000}");
}

#[test]
fn files_of_an_answer_that_are_longer_than_any_of_ours_are_not_read() {
    let t = tempfile::tempdir().unwrap();
    let long = |name: &str, bytes: u64| {
        let path = t.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::File::create(path).unwrap().set_len(bytes).unwrap();
    };
    // holes: they take no room
    long("answers/a/verdict.json", (1 << 26) + 1);
    long("answers/a/manifest.json", (1 << 26) + 1);
    long("answers/.touchdown-fleet/lost/b.json", (1 << 28) + 1);
    let o = touchdown(t.path(), &["merge", "answers", "--out", "site"]);
    let said = String::from_utf8_lossy(&o.stderr);
    assert_eq!(o.status.code(), Some(2), "{said:.1000}");
    assert!(said.contains("a/verdict.json: no manifest.json lists it"), "{said:.1000}");
    let page = std::fs::read_to_string(t.path().join("site/fleet.json")).unwrap();
    assert!(page.contains("b.json") && page.contains("cannot be read"), "{page:.1000}");
}
