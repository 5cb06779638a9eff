//! What helps where a binary does not load: the library that it lacks, and what installs it.

use std::path::Path;

/// Libraries whose package is not called as Debian names the others, by how their names begin, and what installs them.
const OTHERS: [(&str, &str); 12] = [
    ("libgcc_s.so", "sudo apt-get install libgcc-s1"),
    ("libz.so", "sudo apt-get install zlib1g"),
    ("libcrypto.so.1.1", "install OpenSSL 1.1, whose package is libssl1.1"),
    ("libcrypto.so", "sudo apt-get install libssl3"),
    ("libGL.so", "sudo apt-get install libgl1"),
    ("libjvm.so", "sudo apt-get install default-jre"),
    ("libtbb.so.2", "sudo apt-get install libtbb2"),
    ("libmw", "install the MATLAB Runtime of the release that exported it"),
    ("libmcl", "install the MATLAB Runtime of the release that exported it"),
    ("libSimulationRuntime", "install the OpenModelica that exported it"),
    ("libOpenModelica", "install the OpenModelica that exported it"),
    ("libomc", "install the OpenModelica that exported it"),
];

/// The library that the message of a loader names as missing.
fn library(why: &str) -> Option<&str> {
    let before = why.split(": cannot open shared object file").next().filter(|b| b.len() < why.len())?;
    let name = before.rsplit([' ', '(', '"', '`', '\'']).next()?;
    let name = name.rsplit('/').next()?;
    name.contains(".so").then_some(name)
}

/// Debian's package of a library by the rule for their names: libgfortran.so.5 is in libgfortran5.
fn package(library: &str) -> Option<String> {
    let (name, version) = library.split_once(".so.")?;
    // libpython3.11.so.1.0 is in libpython3.11
    if name.starts_with("libpython") {
        return Some(name.to_string());
    }
    let name = name.to_lowercase().replace('_', "-");
    let version = version.split('.').next()?;
    let dash = if name.ends_with(|c: char| c.is_ascii_digit()) { "-" } else { "" };
    Some(format!("{name}{dash}{version}"))
}

/// Whether the file system that a file lies on runs no programs.
#[cfg(unix)]
fn forbids_programs(file: &Path) -> bool {
    use rustix::fs::{statvfs, StatVfsMountFlags};
    statvfs(file).is_ok_and(|s| s.f_flag.contains(StatVfsMountFlags::NOEXEC))
}

#[cfg(not(unix))]
fn forbids_programs(_: &Path) -> bool {
    false
}

/// The cure for the message `why` of a loader about the file `of`.
pub(super) fn cure(why: &str, of: &Path) -> String {
    if why.contains("undefined symbol: _Py") || why.contains("undefined symbol: Py") {
        return "it runs in the Python it was exported with: start this with LD_PRELOAD=PATH/libpython3.N.so, that Python's \
                library"
            .into();
    }
    if why.contains("Too many open files") {
        return "raise the limit of open files, as with ulimit -n".into();
    }
    if why.contains("failed to map segment") && (why.contains("Operation not permitted") || forbids_programs(of)) {
        return "the folder that it is unpacked in forbids programs; set TMPDIR to one that does not (noexec)".into();
    }
    if why.contains("failed to map segment")
        || why.contains("Cannot allocate memory")
        || why.contains("cannot allocate memory")
    {
        return "give it more memory with --fmu-memory, or raise the limit of memory, as with ulimit -v".into();
    }
    if let Some(library) = library(why) {
        let other = OTHERS.iter().find(|o| library.starts_with(o.0)).map(|o| o.1.to_string());
        let install = other.or_else(|| Some(format!("sudo apt-get install {}", package(library)?)));
        let install = install.unwrap_or_else(|| "install the tool that exported it".into());
        return format!(
            "{library} is missing: {install} (on Debian and Ubuntu `apt-file search {library}` names its package), or name \
             its folder in LD_LIBRARY_PATH"
        );
    }
    let version = |of: &str| {
        let at = why.find(of)?;
        let text: String = why[at..].chars().take_while(|c| c.is_ascii_alphanumeric() || "_.+".contains(*c)).collect();
        why.contains("not found").then_some(text)
    };
    if let Some(version) = version("GLIBCXX_").or_else(|| version("CXXABI_")) {
        return format!("it asks for a newer libstdc++6 ({version}): install that, or export it on an older system");
    }
    if let Some(version) = version("GLIBC_") {
        return format!("it asks for a newer system ({version}): run it there, or export it on an older one");
    }
    "export it again for this platform".into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_named_with_what_installs_it() {
        for (why, says) in [
            ("libgfortran.so.5: cannot open shared object file: No such file", "sudo apt-get install libgfortran5 "),
            ("dlopen (libpython3.8.so.1.0: cannot open shared object file)", "sudo apt-get install libpython3.8 "),
            ("liblapack.so.3: cannot open shared object file", "sudo apt-get install liblapack3 "),
            ("libz.so.1: cannot open shared object file", "sudo apt-get install zlib1g "),
            ("libmwmclmcrrt.so.9.9: cannot open shared object file", "MATLAB Runtime"),
            ("libfoo.so: cannot open shared object file", "install the tool that exported it"),
            ("/lib/libc.so.6: version `GLIBC_2.38' not found (required by x.so)", "newer system (GLIBC_2.38)"),
            ("libstdc++.so.6: version `GLIBCXX_3.4.32' not found", "newer libstdc++6 (GLIBCXX_3.4.32)"),
            ("x.so: undefined symbol: PyExc_ValueError", "LD_PRELOAD"),
            ("x.so: failed to map segment from shared object", "give it more memory with --fmu-memory"),
            ("x.so: failed to map segment from shared object: Operation not permitted", "set TMPDIR"),
            ("file too short", "export it again for this platform"),
        ] {
            let cure = cure(why, Path::new("x.so"));
            assert!(cure.contains(says), "{why}: {cure}");
        }
    }
}
