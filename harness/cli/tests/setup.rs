//! `harness/touchdown` where something is missing to build with: it prints what, and what installs it.
#![cfg(unix)]

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the script with these tools alone in PATH, each a script of its own.
fn with_tools(tools: &[(&str, &str)]) -> Output {
    let dir = tempfile::tempdir().unwrap();
    let bin = dir.path().join("bin");
    std::fs::create_dir(&bin).unwrap();
    for (name, text) in tools {
        let path = bin.join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    // a checkout in which nothing is set up
    let harness = dir.path().join("harness");
    std::fs::create_dir(&harness).unwrap();
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for file in ["touchdown", "setup.sh", "requirements.txt"] {
        std::fs::copy(own.join(file), harness.join(file)).unwrap();
    }
    let mut run = Command::new("/bin/sh");
    run.arg(harness.join("touchdown")).arg("--version").env_clear();
    run.env("PATH", &bin).env("HOME", dir.path()).output().unwrap()
}

fn printed(tools: &[(&str, &str)]) -> String {
    let o = with_tools(tools);
    assert_eq!(o.status.code(), Some(2));
    String::from_utf8(o.stderr).unwrap()
}

#[test]
fn all_that_is_missing_is_told_at_once() {
    let e = printed(&[]);
    for part in ["Rust 1.", "https://sh.rustup.rs", "a C compiler", "Python 3.11 or newer with venv", "package manager"]
    {
        assert!(e.contains(part), "{part:?} is not in {e}");
    }
    assert!(!e.contains("not found"), "{e}");
}

#[test]
fn what_is_there_is_not_told_and_debian_gets_its_commands() {
    let e = printed(&[
        ("apt-get", ""),
        ("cargo", ""),
        ("rustc", "echo 'rustc 1.95.0 (x 2026-04-14)'"),
        ("python3", "exit 1"),
    ]);
    assert!(
        e.contains("sudo apt-get install gcc libc6-dev") && e.contains("sudo apt-get install python3 python3-venv"),
        "{e}"
    );
    assert!(!e.contains("Rust"), "{e}");
    let e = printed(&[("cc", ""), ("cargo", ""), ("rustc", "echo 'rustc 1.63.0'"), ("rustup", ""), ("python3", "")]);
    assert!(e.contains("(here is 1.63.0)") && e.contains("rustup update stable"), "{e}");
    assert!(!e.contains("C compiler") && !e.contains("Python"), "{e}");
}

#[test]
fn the_least_rust_is_what_the_crates_ask_for() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rustc = Command::new("rustc").arg("-vV").output().unwrap();
    let here =
        String::from_utf8(rustc.stdout).unwrap().lines().find_map(|l| l.strip_prefix("host: ").map(String::from));
    // crates of other platforms need not have been downloaded
    let of = ["metadata", "--format-version", "1", "--offline", "--filter-platform", &here.unwrap(), "--manifest-path"];
    let o = Command::new(env!("CARGO")).args(of).arg(own.join("Cargo.toml")).output().unwrap();
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let all: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    let minor = |v: &str| v.split('.').nth(1).unwrap().parse::<u32>().unwrap();
    let asked = all["packages"].as_array().unwrap().iter().filter_map(|p| p["rust_version"].as_str());
    let least = asked.map(minor).max().unwrap();
    let script = std::fs::read_to_string(own.join("../setup.sh")).unwrap();
    assert!(script.contains(&format!("\nrust_least=1.{least}\n")), "the crates ask for Rust 1.{least}");
}
