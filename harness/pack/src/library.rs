//! Shared libraries: found, built, asked what they are, given their start values.

use super::Model;
use anyhow::{anyhow, bail, ensure, Context, Result};
use face::start::{COUNT_OFFSET, GUID_LENGTH, GUID_OFFSET, MARKER, VALUES_OFFSET};
use object::{Architecture, BinaryFormat, FileKind, Object, ObjectSection, ObjectSegment};
use std::ffi::{c_char, CStr};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// The platforms that FMI 2.0 names.
const PLATFORMS: [&str; 5] = ["linux64", "linux32", "win64", "win32", "darwin64"];

/// A platform's shared library.
#[derive(Clone, Debug)]
pub struct Binary {
    /// Platform as FMI 2.0 names it: linux64, win64, win32, darwin64.
    pub platform: String,
    /// The library as it was built.
    pub bytes: Vec<u8>,
}

/// What [`lies_at`] was given.
static LIES_AT: OnceLock<PathBuf> = OnceLock::new();

/// From here on libraries are looked for beside this file: for a library of ours that a program of somebody else's has
/// loaded. What was said first holds.
pub fn lies_at(file: PathBuf) {
    LIES_AT.get_or_init(|| file);
}

/// The file that runs: the program, or what [`lies_at`] was given.
///
/// # Errors
/// As the system gives them.
pub fn program() -> std::io::Result<PathBuf> {
    LIES_AT.get().cloned().map_or_else(std::env::current_exe, Ok)
}

impl Model {
    /// File name of the library inside an FMU.
    ///
    /// # Errors
    /// A platform that FMI 2.0 does not name.
    pub fn library_name(&self, platform: &str) -> Result<String> {
        let ending = match platform {
            "linux64" | "linux32" => "so",
            "win64" | "win32" => "dll",
            "darwin64" => "dylib",
            _ => bail!("platform {platform:?} is not known; {}", record::words::instead(platform, &PLATFORMS)),
        };
        Ok(format!("{}.{ending}", self.name))
    }

    /// The library of this machine, as cargo left it beside the running program: the newest, since `cargo test` leaves
    /// an older one of `cargo build` where it was, and one of another version would be packed wrongly.
    ///
    /// # Errors
    /// Where it is not there: says where it was looked for.
    pub fn built_library(&self) -> Result<Binary> {
        let path = self.built_path()?;
        let bytes =
            input::bytes(&path, input::LIBRARY).with_context(|| format!("{}: cannot be read", path.display()))?;
        Ok(Binary { platform: "linux64".into(), bytes })
    }

    /// Where that library is.
    fn built_path(&self) -> Result<PathBuf> {
        ensure!(platform() == Some("linux64"), "FMI 2.0 has no folder for this machine: pass --binary PLATFORM=FILE");
        let program = program().context("the program's own path is not known: pass --binary linux64=FILE")?;
        let mut looked = Vec::new();
        let mut newest: Option<(SystemTime, PathBuf)> = None;
        let file = format!("lib{}.so", self.stem);
        for folder in program.ancestors().skip(1).take(2) {
            for path in [folder.join(&file), folder.join("deps").join(&file)] {
                match std::fs::metadata(&path).and_then(|m| m.modified()) {
                    Ok(made) if newest.as_ref().is_some_and(|(n, _)| *n >= made) => {}
                    Ok(made) => newest = Some((made, path)),
                    Err(_) => looked.push(path.display().to_string()),
                }
            }
        }
        if let Some((_, path)) = newest {
            return Ok(path);
        }
        bail!(
            "the library of {} is at none of {}: run `cargo build --release --workspace`",
            self.name,
            looked.join(", ")
        )
    }

    /// The libraries to hand out: those that lie ready for other platforms, and this machine's. They lie in `given`, or
    /// else beside the program, in lib/platforms or, in a checkout, where `pack --all-platforms` leaves them; a folder
    /// for each platform as FMI 2.0 names it, as in an unpacked FMU's binaries/.
    ///
    /// # Errors
    /// `given` has none; a library that cannot be read; none at all.
    pub fn libraries(&self, given: Option<&Path>) -> Result<Vec<Binary>> {
        let mut found = match given {
            Some(folder) => {
                let found = self.ready(folder, None)?;
                let wanted = "give a folder with linux64, win64 and the like, as in an unpacked FMU's binaries/";
                ensure!(!found.is_empty(), "{}: holds no library of {}; {wanted}", folder.display(), self.name);
                found
            }
            None => self.beside_the_program()?,
        };
        if !found.iter().any(|b| Some(b.platform.as_str()) == platform()) {
            match self.built_library() {
                Ok(own) => found.insert(0, own),
                Err(e) if found.is_empty() => return Err(e),
                Err(_) => {}
            }
        }
        Ok(found)
    }

    /// The libraries that lie ready where the program is.
    fn beside_the_program(&self) -> Result<Vec<Binary>> {
        let own = self.built_path().ok();
        let made = own.and_then(|p| std::fs::metadata(p).ok()?.modified().ok());
        let program = program().ok();
        for folder in program.iter().flat_map(|p| p.ancestors().skip(1).take(2)) {
            // what was built from an older source than this program is left alone
            for (folder, since) in [(folder.join("lib/platforms"), None), (folder.join("platforms"), made)] {
                let found = self.ready(&folder, since)?;
                if !found.is_empty() {
                    return Ok(found);
                }
            }
        }
        Ok(Vec::new())
    }

    /// The libraries below `folder` that are not older than `since`.
    fn ready(&self, folder: &Path, since: Option<SystemTime>) -> Result<Vec<Binary>> {
        let mut found = Vec::new();
        for platform in PLATFORMS {
            let path = folder.join(platform).join(self.library_name(platform)?);
            let Ok(made) = std::fs::metadata(&path).and_then(|m| m.modified()) else { continue };
            if since.is_none_or(|s| made >= s) {
                let bytes = input::bytes(&path, input::LIBRARY)
                    .with_context(|| format!("{}: cannot be read", path.display()))?;
                found.push(Binary { platform: platform.into(), bytes });
            }
        }
        Ok(found)
    }

    /// The libraries for every platform that can be built here: runs fmu/platforms/build of the checkout the running
    /// program was built in, or else of the current folder's.
    ///
    /// # Errors
    /// No checkout; a build that fails, or misses a tool: what it said stands above, with what to install.
    pub fn libraries_everywhere(&self) -> Result<Vec<Binary>> {
        const SCRIPT: &str = "fmu/platforms/build";
        let (program, here) = (program().ok(), std::env::current_dir().ok());
        let mut folders = program.iter().chain(&here).flat_map(|p| p.ancestors());
        let root = folders.find(|f| f.join(SCRIPT).is_file()).with_context(|| {
            format!("{SCRIPT} is not here: call from a checkout of touchdown, or pass --binary PLATFORM=FILE")
        })?;
        let script = root.join(SCRIPT);
        let done = std::process::Command::new(&script)
            .arg(self.stem)
            .stdin(std::process::Stdio::null())
            .stderr(std::process::Stdio::inherit())
            .output()
            .with_context(|| format!("{}: cannot be run", script.display()))?;
        ensure!(done.status.success(), "{} has failed: it says why above", script.display());
        let said = String::from_utf8_lossy(&done.stdout);
        let read = |p: &str| {
            let path = root.join("target/platforms").join(p).join(self.library_name(p)?);
            let bytes =
                input::bytes(&path, input::LIBRARY).with_context(|| format!("{}: cannot be read", path.display()))?;
            Ok(Binary { platform: p.into(), bytes })
        };
        said.split_whitespace().map(read).collect()
    }
}

/// Reads a library given as PLATFORM=FILE.
///
/// # Errors
/// Not of that form; cannot be read; cut, or of another platform; for this machine and no FMI 2.0 co-simulation library.
pub fn library(given: &str) -> Result<Binary> {
    let (platform, path) =
        given.split_once('=').with_context(|| format!("--binary {given}: give PLATFORM=FILE, e.g. win64=x.dll"))?;
    Model::contact().library_name(platform)?;
    let bytes = input::bytes(Path::new(path), input::LIBRARY)
        .with_context(|| format!("{path}: cannot be read; give the built library"))?;
    whole(&bytes).and_then(|()| is_of(&bytes, platform)).map_err(|why| anyhow!("{path}: {why}"))?;
    if self::platform() == Some(platform) {
        check(&std::fs::canonicalize(path)?)?;
    }
    Ok(Binary { platform: platform.into(), bytes })
}

/// Holds the headers of a shared library against its bytes: a library is mapped when it is loaded, and one that was cut
/// ends the process where its missing part is touched.
///
/// # Errors
/// No library; one that is cut; and the cure.
pub fn whole(bytes: &[u8]) -> Result<(), String> {
    let cut = |why: &dyn std::fmt::Display| format!("it is cut or damaged ({why}); build or copy the library again");
    match FileKind::parse(bytes) {
        // a universal binary of macOS holds one for each processor
        Ok(FileKind::MachOFat32 | FileKind::MachOFat64) => return Ok(()),
        Ok(_) => {}
        Err(_) => return Err("it is no shared library; build or copy the library again".into()),
    }
    let file = object::File::parse(bytes).map_err(|e| cut(&e))?;
    let length = bytes.len() as u64;
    let segments = file.segments().map(|s| s.file_range());
    let sections = file.sections().filter_map(|s| s.file_range());
    for (from, size) in segments.chain(sections) {
        if from.checked_add(size).is_none_or(|end| end > length) {
            return Err(cut(&format!("it has {length} bytes and names more")));
        }
    }
    Ok(())
}

/// Holds the headers of a whole library against the platform it is given for.
///
/// # Errors
/// A library of another platform; and the cure.
fn is_of(bytes: &[u8], platform: &str) -> Result<(), String> {
    let wanted = match platform {
        "linux64" => (BinaryFormat::Elf, Architecture::X86_64),
        "linux32" => (BinaryFormat::Elf, Architecture::I386),
        "win64" => (BinaryFormat::Pe, Architecture::X86_64),
        "win32" => (BinaryFormat::Pe, Architecture::I386),
        // of processors a universal binary may hold several
        _ => return Ok(()),
    };
    let is = object::File::parse(bytes).map(|f| (f.format(), f.architecture())).ok();
    if is == Some(wanted) {
        return Ok(());
    }
    let is = is.map_or("another platform".into(), |(format, of)| format!("{format:?} for {of:?}"));
    Err(format!("it is a library of {is}; give the one that was built for {platform}"))
}

/// The platform of this machine as FMI 2.0 names it; None where it names none.
fn platform() -> Option<&'static str> {
    if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        Some("linux64")
    } else if cfg!(all(target_os = "windows", target_arch = "x86_64")) {
        Some("win64")
    } else if cfg!(all(target_os = "macos", target_arch = "x86_64")) {
        Some("darwin64")
    } else {
        None
    }
}

/// Functions without which no host can step a co-simulation FMU.
const LIFE: [&str; 8] = [
    "fmi2Instantiate",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2GetReal",
    "fmi2SetReal",
    "fmi2DoStep",
    "fmi2FreeInstance",
];

/// Loads a library of this machine and holds it against FMI 2.0.
///
/// # Errors
/// It does not load (a dependency may be missing); it lacks a function; it speaks another version or other types.
fn check(path: &Path) -> Result<()> {
    let named = || format!("{}: give the library that touchdown builds for this machine", path.display());
    // SAFETY: loading runs the library's initialisers; whoever packs a library trusts it to run in this process
    let l = unsafe { libloading::Library::new(path) }.with_context(named)?;
    for name in LIFE {
        // SAFETY: only looked up, never called
        let found = unsafe { l.get::<unsafe extern "C" fn()>(name.as_bytes()) };
        ensure!(found.is_ok(), "{}: has no {name}; {}", path.display(), "give a co-simulation FMU's library");
    }
    for (name, want) in [("fmi2GetVersion", "2.0"), ("fmi2GetTypesPlatform", "default")] {
        // SAFETY: FMI 2.0, section 2.1.4: takes nothing, returns a string that lives as long as the library
        let said = unsafe {
            let ask = l.get::<unsafe extern "C" fn() -> *const c_char>(name.as_bytes()).with_context(named)?;
            let text = ask();
            ensure!(!text.is_null(), "{}: {name} answers null", path.display());
            CStr::from_ptr(text).to_string_lossy().into_owned()
        };
        ensure!(said == want, "{}: {name} answers {said:?}, not {want:?}", path.display());
    }
    Ok(())
}

/// Whether a library is the one of a model as it lies ready or was built here, whatever its GUID and start values.
pub fn is_ours(library: &[u8]) -> bool {
    Model::all().iter().any(|(_, m)| {
        let count = m.defaults.len();
        let Some(plain) = plain(library, count) else { return false };
        let ready =
            m.libraries(None).unwrap_or_default().into_iter().filter(|b| Some(b.platform.as_str()) == platform());
        ready.chain(m.built_library()).any(|own| self::plain(&own.bytes, count).is_some_and(|own| own == plain))
    })
}

/// A library with its GUID and start values blanked; None where its block is not there once.
fn plain(library: &[u8], parameters: usize) -> Option<Vec<u8>> {
    let [at] = blocks(library, parameters)[..] else { return None };
    let mut o = library.to_vec();
    o[at + GUID_OFFSET..at + COUNT_OFFSET].fill(0);
    o[at + VALUES_OFFSET..at + VALUES_OFFSET + 8 * parameters].fill(0);
    Some(o)
}

/// Where a library has blocks of start values.
fn blocks(library: &[u8], parameters: usize) -> Vec<usize> {
    library
        .windows(VALUES_OFFSET + 8 * parameters)
        .enumerate()
        // the marker alone may also stand in code that searches for it
        .filter(|(_, w)| w.starts_with(&MARKER) && w[GUID_OFFSET] == b'{' && w[GUID_OFFSET + GUID_LENGTH - 1] == b'}')
        .map(|(i, _)| i)
        .collect()
}

/// A library with GUID and start values of its own.
pub(super) fn patch(library: &[u8], guid: &str, values: &[f64]) -> Result<Vec<u8>> {
    let mut o = library.to_vec();
    let found = blocks(&o, values.len());
    let [at] = found[..] else {
        bail!("has its block of start values {} times, not once: give the library that touchdown builds", found.len());
    };
    let count = usize::from(u16::from_le_bytes([o[at + COUNT_OFFSET], o[at + COUNT_OFFSET + 1]]));
    ensure!(
        count == values.len(),
        "has {count} parameters where this touchdown knows {}: it is another model's or another version's; build it anew",
        values.len()
    );
    o[at + GUID_OFFSET..at + GUID_OFFSET + GUID_LENGTH].copy_from_slice(guid.as_bytes());
    for (i, v) in values.iter().enumerate() {
        let p = at + VALUES_OFFSET + 8 * i;
        o[p..p + 8].copy_from_slice(&v.to_le_bytes());
    }
    Ok(o)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_that_lie_ready_are_taken_by_platform_and_older_ones_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let m = Model::moving_bar();
        let e = format!("{:#}", m.libraries(Some(dir.path())).unwrap_err());
        assert!(e.contains(&dir.path().display().to_string()) && e.contains("unpacked FMU"), "{e}");
        for (platform, file) in [("linux64", "MovingBar.so"), ("win64", "MovingBar.dll"), ("win64", "Other.dll")] {
            std::fs::create_dir_all(dir.path().join(platform)).unwrap();
            std::fs::write(dir.path().join(platform).join(file), platform).unwrap();
        }
        let found = m.libraries(Some(dir.path())).unwrap();
        let found: Vec<(&str, &[u8])> = found.iter().map(|b| (b.platform.as_str(), &b.bytes[..])).collect();
        assert_eq!(found, [("linux64", &b"linux64"[..]), ("win64", b"win64")]);
        let later = SystemTime::now() + std::time::Duration::from_secs(60);
        assert!(m.ready(dir.path(), Some(later)).unwrap().is_empty());
    }

    #[test]
    fn a_library_cut_anywhere_is_refused_with_file_and_cure_and_not_loaded() {
        // this test's own program is a whole ELF file
        let whole = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(super::whole(&whole).and_then(|()| is_of(&whole, "linux64")), Ok(()));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cut.so");
        let n = whole.len();
        for at in [0, 3, 20, 64, 500, 4096, n / 4, n / 2, n - 4096, n - 1] {
            std::fs::write(&path, &whole[..at]).unwrap();
            let e = format!("{:#}", library(&format!("linux64={}", path.display())).unwrap_err());
            assert!(e.contains("cut.so: ") && e.contains("; "), "{at}: {e}");
        }
        for platform in ["win64", "win32", "linux32"] {
            let e = is_of(&whole, platform).unwrap_err();
            assert!(e.ends_with(&format!("Elf for X86_64; give the one that was built for {platform}")), "{e}");
        }
    }

    #[test]
    fn what_is_no_fmi_binary_is_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let text = dir.path().join("x.so");
        std::fs::write(&text, "not a library").unwrap();
        for path in [text.as_path(), Path::new("libc.so.6"), Path::new("libm.so.6")] {
            let why = format!("{:#}", check(path).unwrap_err());
            assert!(why.contains(&path.display().to_string()), "{why}");
        }
    }
}
