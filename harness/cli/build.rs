//! Tells the program the commit that it is built from: of a checkout that holds this file; else "unknown".

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo:rustc-env=TOUCHDOWN_COMMIT={}", commit(Path::new(&here)).unwrap_or("unknown".into()));
}

/// What git prints; None where it fails, or there is none.
fn git(here: &Path, words: &[&str]) -> Option<String> {
    let done = Command::new("git").arg("-C").arg(here).args(words).output().ok()?;
    let text = String::from_utf8(done.stdout).ok()?;
    done.status.success().then(|| text.trim().to_string())
}

fn commit(here: &Path) -> Option<String> {
    // what a commit or a checkout changes
    for name in ["HEAD", "logs/HEAD"] {
        let path = here.join(git(here, &["rev-parse", "--git-path", name])?);
        if path.exists() {
            println!("cargo:rerun-if-changed={}", path.display());
        }
    }
    // sources unpacked inside somebody else's checkout are not of its commit
    git(here, &["ls-files", "--error-unmatch", "build.rs"])?;
    git(here, &["rev-parse", "HEAD"]).filter(|c| c.len() >= 40 && c.chars().all(|c| c.is_ascii_hexdigit()))
}
