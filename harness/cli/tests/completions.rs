//! `touchdown completions` and `touchdown man`: what they write is understood by shells and by man.

use std::path::Path;
use std::process::{Command, Output};

fn touchdown(arguments: &[&str]) -> Output {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).output().unwrap();
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    o
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Names of all subcommands.
fn subcommands() -> Vec<String> {
    touchdown::commands::command_line().get_subcommands().map(|c| c.get_name().to_string()).collect()
}

#[test]
fn every_shell_has_a_script_that_knows_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&touchdown(&["completions", shell]).stdout);
        for name in subcommands() {
            assert!(script.contains(&name), "{shell}: {name}");
        }
    }
}

#[test]
fn bash_loads_its_script_and_completes_a_command() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("touchdown.bash");
    std::fs::write(&file, touchdown(&["completions", "bash"]).stdout).unwrap();
    // as if the user had typed `touchdown diag` and pressed the tabulator
    let typed = "set -e; . \"$0\"; complete -p touchdown; COMP_WORDS=(touchdown diag); COMP_CWORD=1; \
                 _touchdown touchdown diag touchdown; echo \"completed: ${COMPREPLY[*]}\"";
    let Ok(o) = Command::new("bash").args(["-c", typed]).arg(&file).output() else {
        assert!(std::env::var("CI").is_err(), "bash is absent");
        return;
    };
    let said = text(&o.stdout);
    assert!(o.status.success(), "{}", text(&o.stderr));
    assert!(said.contains("_touchdown") && said.contains("completed: diagnose\n"), "{said}");
}

/// Names of files in a folder.
fn files(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn every_command_has_a_page_that_groff_takes_without_a_warning() {
    let dir = tempfile::tempdir().unwrap();
    touchdown(&["man", "--out", dir.path().to_str().unwrap()]);
    let pages = files(dir.path());
    for name in subcommands() {
        assert!(pages.contains(&format!("touchdown-{name}.1")), "{name}: {pages:?}");
    }
    for page in ["touchdown.1", "touchdown-study-coupling.1"] {
        assert!(pages.contains(&page.to_string()), "{pages:?}");
    }
    for page in &pages {
        let roff = std::fs::read_to_string(dir.path().join(page)).unwrap();
        for part in [".TH ", ".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS"] {
            assert!(roff.contains(part), "{page}: {part}");
        }
        let Ok(o) = Command::new("groff").args(["-man", "-ww", "-Tutf8", "-z"]).arg(dir.path().join(page)).output()
        else {
            assert!(std::env::var("CI").is_err(), "groff is absent");
            continue;
        };
        assert!(o.status.success() && o.stderr.is_empty(), "{page}: {}", text(&o.stderr));
    }
}

#[test]
fn the_programs_page_is_printed_without_a_folder() {
    assert!(text(&touchdown(&["man"]).stdout).contains(".TH touchdown 1"));
}
