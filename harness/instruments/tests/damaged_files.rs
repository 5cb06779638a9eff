//! A good file of every format, cut at many lengths and changed in many bytes: a fault or samples, without a panic, within
//! time and memory. tests/instruments/write_small_files.py wrote the files.

use std::alloc::{GlobalAlloc, Layout, System};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// Memory that reading a damaged file of some kB may take: a reader's pages and blocks; with a library between, its
/// limits for one chunk and one read.
const MEMORY: usize = 64 << 20;
const MEMORY_BY_LIBRARY: usize = 1 << 30;
const TIME: Duration = Duration::from_secs(20);
/// Samples after which a reading is ended.
const SAMPLES: usize = 1 << 22;
const CUTS: usize = 60;
const CHANGES: u64 = 100;

/// Counts the memory that is taken.
struct Counting;

static TAKEN: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: hands every call on to the system's allocator, whose contract it keeps.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(TAKEN.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller's layout is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        TAKEN.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the pointer comes from `alloc` with that layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn good_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("the folder").map(|e| e.expect("an entry").path()).collect();
    files.sort();
    files
}

/// Whether a library reads the file, whose index stands at its end or is spread over it: a file that was cut is refused.
fn is_by_library(path: &Path) -> bool {
    let name = path.file_name().expect("a name").to_string_lossy();
    name == "matlab73.mat" || [".h5", ".parquet", ".xlsx", ".xlsb", ".xls", ".ods"].iter().any(|e| name.ends_with(e))
}

/// Samples of the file, or the text of its fault.
fn read(path: &Path) -> Result<usize, String> {
    let mut source = instruments::open(path).map_err(|e| e.to_string())?;
    let mut samples = 0;
    for group in 0..source.groups().len() {
        let count = &mut |block: &[&[f64]]| {
            assert!(block.iter().all(|c| c.len() == block[0].len() && c.len() <= instruments::BLOCK));
            samples += block.iter().map(|c| c.len()).sum::<usize>();
            if samples > SAMPLES {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        source.read(group, count).map_err(|e| e.to_string())?;
    }
    Ok(samples)
}

/// Reads `bytes` as a file named like `good`, within time and memory.
fn read_damaged(good: &Path, bytes: &[u8], how: &str) -> Result<usize, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(good.file_name().expect("a name"));
    std::fs::write(&path, bytes).expect("written");
    let (begin, before) = (Instant::now(), TAKEN.load(Relaxed));
    MOST.store(before, Relaxed);
    let result = read(&path);
    let (took, memory) = (begin.elapsed(), MOST.load(Relaxed).saturating_sub(before));
    assert!(took < TIME, "{} {how}: took {took:?}", good.display());
    let most = if is_by_library(good) { MEMORY_BY_LIBRARY } else { MEMORY };
    assert!(memory < most, "{} {how}: took {memory} bytes", good.display());
    if let Err(text) = &result {
        assert!(text.contains(&*path.to_string_lossy()) && text.contains("; "), "{} {how}: {text}", good.display());
    }
    result
}

/// Numbers without order, the same in every run: <https://doi.org/10.18637/jss.v008.i14>.
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

#[test]
fn good_files_are_read_cut_and_changed_ones_without_a_panic() {
    let files = good_files();
    assert!(files.len() >= instruments::FORMATS.len(), "a file of every format");
    for good in files {
        let bytes = std::fs::read(&good).expect("readable");
        let whole = read(&good).expect("a good file");
        assert!(whole > 50, "{}: {whole} samples", good.display());
        for cut in (0..CUTS).map(|i| bytes.len() * i / CUTS) {
            let result = read_damaged(&good, &bytes[..cut], &format!("cut at {cut}"));
            let fits =
                if is_by_library(&good) { result.is_err() } else { result.as_ref().map_or(true, |n| *n <= whole) };
            assert!(fits, "{} cut at {cut}: {result:?}", good.display());
        }
        for seed in 1..=CHANGES {
            let mut random = Xorshift(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let mut changed = bytes.clone();
            for _ in 0..=random.below(4) {
                let at = random.below(changed.len());
                changed[at] = random.below(256) as u8;
            }
            let _ = read_damaged(&good, &changed, &format!("changed by seed {seed}"));
        }
    }
}
