//! An FMU: its archive unpacked, its description read, its binary loaded where it runs in this process.

use super::archive;
use super::description::{Capabilities, Description};
use super::error::HostError;
use super::here;
use super::isolation::{Isolation, Limits};
use super::xml;
use fmi::fmi2::binding::Fmi2Binding;
use output::Scratch;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex, PoisonError};

/// An FMI 2.0 co-simulation FMU, ready to be instantiated. Clones share it; the unpacked folder and the loaded binary
/// live as long as any clone or instance. Threads may share it and make instances each for itself.
#[derive(Clone)]
pub struct Fmu(Arc<Loaded>);

/// Fields drop in this order: the binary is unloaded before its file goes.
pub(super) struct Loaded {
    /// None where its instances have processes of their own.
    pub(super) binding: Option<Arc<Fmi2Binding>>,
    /// What holds those.
    pub(super) limits: Option<Limits>,
    pub(super) library: PathBuf,
    pub(super) description: Description,
    pub(super) capabilities: Capabilities,
    pub(super) guid: CString,
    pub(super) resources: CString,
    /// Instances there are.
    pub(super) alive: AtomicUsize,
    /// An instance has answered fmi2Fatal: none may be called any more.
    pub(super) fatal: Arc<AtomicBool>,
    complaints: Mutex<Vec<String>>,
    path: PathBuf,
    folder: Scratch,
}

impl std::fmt::Debug for Fmu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Fmu({}, {})", self.0.description.model_name, self.0.path.display())
    }
}

impl Loaded {
    /// Keeps what went wrong where there was nobody to report it to.
    pub(super) fn complain(&self, what: String) {
        self.complaints.lock().unwrap_or_else(PoisonError::into_inner).push(what);
    }
}

impl Fmu {
    /// Unpacks `path` into a temporary folder, reads its description and loads its binary into this process.
    ///
    /// # Errors
    /// Names the file, what is wrong and the cure: not a zip archive, no modelDescription.xml or a bad one, another
    /// version of FMI, no co-simulation, no binary for this platform (and for which there is one), a binary that does
    /// not load.
    pub fn open(path: &Path) -> Result<Fmu, HostError> {
        Fmu::open_in(path, &Isolation::None)
    }

    /// As [`Fmu::open`]. With [`Isolation::Process`] each instance gets a process of its own, which loads the binary,
    /// so that what is wrong with the binary is reported by [`Fmu::instantiate`]; but for the libraries of our own FMUs,
    /// known by their bytes, which are loaded here.
    ///
    /// # Errors
    /// As [`Fmu::open`].
    pub fn open_in(path: &Path, isolation: &Isolation) -> Result<Fmu, HostError> {
        Fmu::load(path, isolation).map_err(|why| HostError::Open { path: path.to_path_buf(), why })
    }

    fn load(path: &Path, isolation: &Isolation) -> Result<Fmu, String> {
        let folder = archive::unpack(path, &archive::FMU)?;
        let xml = xml::read(&folder.path().join("modelDescription.xml"))
            .map_err(|why| format!("modelDescription.xml {why}"))?;
        let description = Description::read(&xml).map_err(with_cure)?;
        let Some(capabilities) = description.co_simulation.clone() else {
            let has = if description.model_exchange { ", only model exchange" } else { "" };
            return Err(format!("no co-simulation in it{has}; export it for co-simulation"));
        };
        let library = archive::binary(folder.path(), &capabilities.model_identifier)?;
        let bytes = input::bytes(&library, input::LIBRARY).map_err(|e| format!("its binary cannot be read ({e})"))?;
        pack::whole(&bytes).map_err(|why| format!("its binary does not load: {why}"))?;
        let limits = match isolation.limits() {
            Some(limits) if !pack::is_ours(&bytes) => Some(limits.clone()),
            _ => None,
        };
        let binding = if limits.is_some() { None } else { Some(Arc::new(here::load(&library)?)) };
        let guid = CString::new(description.guid.as_str()).map_err(|_| "its GUID holds a zero byte".to_string())?;
        let resources = CString::new(archive::uri(&folder.path().join("resources")))
            .map_err(|_| "the temporary folder's name holds a zero byte".to_string())?;
        Ok(Fmu(Arc::new(Loaded {
            binding,
            limits,
            library,
            description,
            capabilities,
            guid,
            resources,
            alive: AtomicUsize::new(0),
            fatal: Arc::new(AtomicBool::new(false)),
            complaints: Mutex::default(),
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

    /// What went wrong while instances in processes of their own were freed and unloaded, each reported once.
    pub fn complaints(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.complaints.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether its instances have processes of their own.
    pub fn is_apart(&self) -> bool {
        self.0.binding.is_none()
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
