//! An FMU: its archive unpacked, its description read, its binary loaded.

use super::archive;
use super::description::{Capabilities, Description};
use super::error::HostError;
use fmi::fmi2::binding::Fmi2Binding;
use std::ffi::{c_char, CStr, CString};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::Arc;

/// An FMI 2.0 co-simulation FMU, ready to be instantiated. Clones share it; the unpacked folder and the loaded binary
/// live as long as any clone or instance. Threads may share it and make instances each for itself.
#[derive(Clone)]
pub struct Fmu(Arc<Loaded>);

/// Fields drop in this order: the binary is unloaded before its file goes.
pub(super) struct Loaded {
    pub(super) binding: Fmi2Binding,
    pub(super) description: Description,
    pub(super) capabilities: Capabilities,
    pub(super) guid: CString,
    pub(super) resources: CString,
    /// Instances there are.
    pub(super) alive: AtomicUsize,
    /// An instance has answered fmi2Fatal: none may be called any more.
    pub(super) fatal: AtomicBool,
    path: PathBuf,
    folder: tempfile::TempDir,
}

impl std::fmt::Debug for Fmu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Fmu({}, {})", self.0.description.model_name, self.0.path.display())
    }
}

/// The text a function without arguments hands out.
fn answer(f: &Result<unsafe extern "C" fn() -> *const c_char, impl std::fmt::Display>) -> Option<String> {
    let f = f.as_ref().ok()?;
    // SAFETY: FMI 2.0 section 2.1.4: a terminated string, callable at any time
    let s = unsafe { f() };
    if s.is_null() {
        return None;
    }
    Some(unsafe { CStr::from_ptr(s) }.to_string_lossy().into_owned())
}

impl Fmu {
    /// Unpacks `path` into a temporary folder, reads its description and loads its binary.
    ///
    /// # Errors
    /// Names the file, what is wrong and the cure: not a zip archive, no modelDescription.xml or a bad one, another
    /// version of FMI, no co-simulation, no binary for this platform (and for which there is one), a binary that does
    /// not load.
    pub fn open(path: &Path) -> Result<Fmu, HostError> {
        Fmu::load(path).map_err(|why| HostError::Open { path: path.to_path_buf(), why })
    }

    fn load(path: &Path) -> Result<Fmu, String> {
        let folder = archive::unpack(path)?;
        let xml = std::fs::read(folder.path().join("modelDescription.xml"))
            .map_err(|e| format!("modelDescription.xml cannot be read ({e})"))?;
        let description = Description::read(&xml).map_err(with_cure)?;
        let Some(capabilities) = description.co_simulation.clone() else {
            let has = if description.model_exchange { ", only model exchange" } else { "" };
            return Err(format!("no co-simulation in it{has}; export it for co-simulation"));
        };
        let library = archive::binary(folder.path(), &capabilities.model_identifier)?;
        let bytes = input::bytes(&library, input::LIBRARY).map_err(|e| format!("its binary cannot be read ({e})"))?;
        pack::whole(&bytes).map_err(|why| format!("its binary does not load: {why}"))?;
        // SAFETY: loading runs the binary's initializers; whoever opens an FMU trusts it to run in this process
        let binding = unsafe { Fmi2Binding::new(&library) }
            .map_err(|e| format!("its binary does not load: {}; export it again for this platform", with_cause(&e)))?;
        if let Some(version) = answer(&binding.fmi2GetVersion).filter(|v| v != "2.0" && !v.starts_with("2.0.")) {
            return Err(format!("its description says FMI 2.0 and its binary FMI {version}; export it again"));
        }
        if let Some(types) = answer(&binding.fmi2GetTypesPlatform).filter(|t| t != "default") {
            return Err(format!(
                "its binary is built for the types of platform {types}, this host has the default ones"
            ));
        }
        let guid = CString::new(description.guid.as_str()).map_err(|_| "its GUID holds a zero byte".to_string())?;
        let resources = CString::new(archive::uri(&folder.path().join("resources")))
            .map_err(|_| "the temporary folder's name holds a zero byte".to_string())?;
        Ok(Fmu(Arc::new(Loaded {
            binding,
            description,
            capabilities,
            guid,
            resources,
            alive: AtomicUsize::new(0),
            fatal: AtomicBool::new(false),
            path: path.to_path_buf(),
            folder,
        })))
    }

    /// What modelDescription.xml says.
    pub fn description(&self) -> &Description {
        &self.0.description
    }

    /// What it can do in co-simulation.
    pub fn capabilities(&self) -> &Capabilities {
        &self.0.capabilities
    }

    /// The file it was opened from.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// The folder it is unpacked in, as long as this or an instance lives.
    pub fn folder(&self) -> &Path {
        self.0.folder.path()
    }

    #[inline]
    pub(super) fn loaded(&self) -> &Loaded {
        &self.0
    }
}

/// What is wrong with a description has one cure where it names none itself.
fn with_cure(why: String) -> String {
    if why.contains("; ") || why.contains(", export") {
        why
    } else {
        why + "; export it again"
    }
}

fn with_cause(e: &dyn std::error::Error) -> String {
    let mut text = e.to_string();
    if let Some(cause) = e.source() {
        text += &format!(" ({cause})");
    }
    text
}
