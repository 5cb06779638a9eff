//! TDMS, MAT, MDF and WAV files that are cut, damaged or long: no panic, bounded time, bounded memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{Read as _, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Counts the bytes that are allocated, and the most of them at a time.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
/// One test at a time, so that the counts are of one.
static ALONE: Mutex<()> = Mutex::new(());

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size(), Ordering::Relaxed);
        System.alloc(layout)
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        System.dealloc(place, layout)
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// The bytes that `act` holds at most at a time, beyond those held before.
fn most_held<T>(act: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let answer = act();
    (answer, MOST.load(Ordering::Relaxed).saturating_sub(before))
}

/// The samples of each group, and the notes; or what is wrong with the file.
type Read = Result<(Vec<u64>, Vec<String>), String>;

/// Reads all of a file.
fn read(path: &Path) -> Read {
    let mut source = instruments::open(path).map_err(|e| e.to_string())?;
    let groups = source.groups().to_vec();
    let mut samples = Vec::new();
    for (i, group) in groups.iter().enumerate() {
        let mut count = 0;
        let done = source.read(i, &mut |block| {
            assert_eq!(block.len(), group.channels.len());
            assert!(block.iter().all(|c| c.len() == block[0].len() && c.len() <= instruments::BLOCK));
            count += block[0].len() as u64;
            ControlFlow::Continue(())
        });
        done.map_err(|e| e.to_string())?;
        assert_eq!(count, group.samples);
        samples.push(count);
    }
    Ok((samples, source.notes().to_vec()))
}

fn numbers(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state >> 33
    }
}

/// Cuts and damages a good file: each is read or refused with its name and a cure, in little memory and time.
fn mistreat(good: &[u8], extension: &str) {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("file.{extension}"));
    let try_one = |bytes: &[u8], what: &str| -> bool {
        // a file that is new need not be flushed, as one that is overwritten is by some file systems
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, bytes).unwrap();
        let start = Instant::now();
        let (answer, held) = most_held(|| read(&path));
        assert!(held < 64 << 20, "{what}: {held} bytes were held");
        assert!(start.elapsed() < Duration::from_secs(10), "{what}: {:?}", start.elapsed());
        if let Err(message) = &answer {
            assert!(message.contains("file.") && message.contains("; "), "{what}: {message}");
        }
        answer.is_ok()
    };
    assert!(try_one(good, "the good file"));
    let step = (good.len() / 400).max(1);
    let read_cut = (0..good.len()).step_by(step).filter(|cut| try_one(&good[..*cut], &format!("cut to {cut}"))).count();
    assert!(read_cut > 0, "a file that lacks its last bytes gives what is whole");
    let mut next = numbers(7);
    let mut refused = 0;
    for round in 0..1000 {
        let mut bytes = good.to_vec();
        for _ in 0..1 + next() % 3 {
            // the first bytes are hit more often: they hold what the file claims of itself
            let within = if next().is_multiple_of(2) { bytes.len().min(600) } else { bytes.len() };
            let at = next() as usize % within;
            let value = [0, 0xFF, 0x7F, 0x80, 1 << (next() % 8), bytes[at] ^ (1 << (next() % 8))][next() as usize % 6];
            bytes[at] = value;
        }
        refused += usize::from(!try_one(&bytes, &format!("damage {round}")));
    }
    assert!(refused > 0);
}

/// Bytes put one after the other.
#[derive(Default, Clone)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn raw(mut self, bytes: &[u8]) -> Bytes {
        self.0.extend_from_slice(bytes);
        self
    }

    fn u16(self, n: u16) -> Bytes {
        self.raw(&n.to_le_bytes())
    }

    fn u32(self, n: u32) -> Bytes {
        self.raw(&n.to_le_bytes())
    }

    fn u64(self, n: u64) -> Bytes {
        self.raw(&n.to_le_bytes())
    }

    fn f64(self, n: f64) -> Bytes {
        self.raw(&n.to_le_bytes())
    }

    /// Text after its length.
    fn text(self, text: &str) -> Bytes {
        self.u32(text.len() as u32).raw(text.as_bytes())
    }

    /// Zeros up to a multiple of 8.
    fn padded(mut self) -> Bytes {
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        self
    }
}

fn wave(n: usize) -> Vec<u8> {
    (0..n).flat_map(|i| ((i as f64 * 0.1).sin() * 1000.0).to_le_bytes()).collect()
}

fn wav_head(data: u32) -> Bytes {
    let head = Bytes::default().raw(b"RIFF").u32(36 + data).raw(b"WAVEfmt ").u32(16).u16(1).u16(2).u32(50_000);
    head.u32(200_000).u16(4).u16(16).raw(b"data").u32(data)
}

#[test]
fn wav() {
    mistreat(&wav_head(4000).raw(&wave(500)).0, "wav");
}

fn tdms_segment(flags: u32, objects: &[Bytes], data: &[u8]) -> Bytes {
    let mut meta = Bytes::default().u32(objects.len() as u32);
    for object in objects {
        meta = meta.raw(&object.0);
    }
    let lead = Bytes::default().raw(b"TDSm").u32(flags).u32(4713).u64((meta.0.len() + data.len()) as u64);
    lead.u64(meta.0.len() as u64).raw(&meta.0).raw(data)
}

fn tdms_channel(name: &str, kind: u32, values: u64) -> Bytes {
    Bytes::default().text(&format!("/'G'/'{name}'")).u32(20).u32(kind).u32(1).u64(values)
}

#[test]
fn tdms() {
    let scaled =
        tdms_channel("force", 2, 50).u32(5).text("unit_string").u32(0x20).text("kN").text("NI_Number_Of_Scales");
    let scaled = scaled.u32(7).u32(1).text("NI_Scale[0]_Scale_Type").u32(0x20).text("Linear");
    let scaled = scaled.text("NI_Scale[0]_Linear_Slope").u32(10).f64(0.5);
    let scaled = scaled.text("NI_Scale[0]_Linear_Y_Intercept").u32(10).f64(1.0);
    let plain = tdms_channel("x", 10, 50).u32(1).text("wf_increment").u32(10).f64(1e-3);
    let daqmx = Bytes::default().text("/'D'/'raw'").u32(0x1269).u32(u32::MAX).u32(1).u64(25).u32(1);
    let daqmx = daqmx.u32(3).u32(0).u32(2).u32(0).u32(0).u32(1).u32(4).u32(0);
    let data = &wave(70)[..500];
    let file = tdms_segment(14, &[scaled, plain], data).raw(&tdms_segment(8, &[], data).0[..]);
    let file = file.raw(&tdms_segment(46, &[tdms_channel("x", 10, 50).u32(0)], &wave(50)).0);
    let file = file.raw(&tdms_segment(14 | 128, &[daqmx], &wave(50)).0);
    mistreat(&file.0, "tdms");
}

fn mat_element(kind: u32, data: &[u8]) -> Bytes {
    Bytes::default().u32(kind).u32(data.len() as u32).raw(data).padded()
}

fn mat_head(class: u32, rows: u32, columns: u32, name: &str) -> Bytes {
    let flags = mat_element(6, &Bytes::default().u32(class).u32(0).0);
    flags.raw(&mat_element(5, &Bytes::default().u32(rows).u32(columns).0).0).raw(&mat_element(1, name.as_bytes()).0)
}

fn mat_matrix(name: &str, rows: u32, columns: u32) -> Bytes {
    let data = mat_element(9, &wave((rows * columns) as usize));
    mat_element(14, &mat_head(6, rows, columns, name).raw(&data.0).0)
}

fn mat_file(elements: &[Bytes]) -> Vec<u8> {
    let mut file = Bytes::default().raw(&[b' '; 124]).u16(0x100).raw(b"IM");
    for element in elements {
        file = file.raw(&element.0);
    }
    file.0
}

fn mat_struct() -> Bytes {
    let fields =
        mat_head(2, 1, 1, "rec").raw(&mat_element(5, &4u32.to_le_bytes()).0).raw(&mat_element(1, b"x\0\0\0t\0\0\0").0);
    mat_element(14, &fields.raw(&mat_matrix("", 60, 2).0).raw(&mat_matrix("", 60, 1).0).0)
}

#[test]
fn mat_of_version_5() {
    mistreat(&mat_file(&[mat_matrix("x", 40, 3), mat_struct()]), "mat");
}

#[test]
fn mat_compressed() {
    let packed = |element: Bytes| {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(&element.0).unwrap();
        let data = encoder.finish().unwrap();
        Bytes::default().u32(15).u32(data.len() as u32).raw(&data)
    };
    mistreat(&mat_file(&[packed(mat_matrix("x", 40, 3)), packed(mat_struct())]), "mat");
}

#[test]
fn mat_of_version_4() {
    let variable = |name: &str, rows: u32| {
        Bytes::default()
            .u32(0)
            .u32(rows)
            .u32(2)
            .u32(0)
            .u32(2)
            .raw(name.as_bytes())
            .raw(&[0])
            .raw(&wave(2 * rows as usize))
    };
    mistreat(&variable("x", 50).raw(&variable("y", 30).0).0, "mat");
}

/// A file of blocks; a block is put after the ones that it links to.
struct Mdf(Vec<u8>);

impl Mdf {
    fn new() -> Mdf {
        let head = Bytes::default().raw(b"MDF     4.10    tests   ").u32(0).u16(410).raw(&[0; 34]);
        Mdf(head.raw(&[0; 104]).0)
    }

    fn block(&mut self, kind: &[u8; 2], links: &[u64], data: &[u8]) -> u64 {
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        let at = self.0.len() as u64;
        let size = 24 + 8 * links.len() as u64 + data.len() as u64;
        let head = Bytes::default().raw(b"##").raw(kind).u32(0).u64(size).u64(links.len() as u64);
        self.0.extend(links.iter().fold(head, |b, l| b.u64(*l)).raw(data).0);
        at
    }

    fn channel(&mut self, name: &str, after: u64, kind: [u8; 4], at: u32, bits: u32, conversion: u64) -> u64 {
        let name = self.block(b"TX", &[], name.as_bytes());
        let data = Bytes::default().raw(&kind).u32(at).u32(bits).u32(0).u32(0).raw(&[0; 52]);
        self.block(b"CN", &[after, 0, name, 0, conversion, 0, 0, 0], &data.0)
    }

    fn group(&mut self, channel: u64, after: u64, id: u64, count: u64, size: u32) -> u64 {
        let data = Bytes::default().u64(id).u64(count).u64(0).u32(size).u32(0);
        self.block(b"CG", &[after, channel, 0, 0, 0, 0], &data.0)
    }

    fn zipped(&mut self, raw: &[u8], columns: u32) -> u64 {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(raw).unwrap();
        let packed = encoder.finish().unwrap();
        let head = Bytes::default().raw(b"DT").raw(&[u8::from(columns > 0), 0]).u32(columns);
        self.block(b"DZ", &[], &head.u64(raw.len() as u64).u64(packed.len() as u64).raw(&packed).0)
    }

    /// The file whose first data group is at `at`.
    fn finish(mut self, at: u64) -> Vec<u8> {
        let head = Bytes::default().raw(b"##HD").u32(0).u64(104).u64(6).u64(at).raw(&[0; 40]).raw(&[0; 32]);
        self.0[64..168].copy_from_slice(&head.0);
        self.0
    }
}

#[test]
fn mdf() {
    let mut file = Mdf::new();
    let linear = Bytes::default().u16(1).u16(0).u16(0).u16(2).f64(0.0).f64(0.0).f64(1.0).f64(2.0);
    let linear = file.block(b"CC", &[0, 0, 0, 0], &linear.0);
    let table = (0..8).fold(Bytes::default().u16(4).u16(0).u16(0).u16(8).f64(0.0).f64(0.0), |b, i| b.f64(f64::from(i)));
    let table = file.block(b"CC", &[0, 0, 0, 0], &table.0);
    let x = file.channel("x", 0, [0, 0, 4, 0], 8, 64, linear);
    let y = file.channel("y", x, [0, 0, 2, 3], 16, 12, table);
    let time = file.channel("t", y, [2, 1, 4, 0], 0, 64, 0);
    let group = file.group(time, 0, 0, 60, 20);
    let blocks = [file.block(b"DT", &[], &wave(50)), file.zipped(&wave(50), 20), file.zipped(&wave(50), 0)];
    let lengths = Bytes::default().u32(1).u32(3).u64(400);
    let list = file.block(b"DL", &[0, blocks[0], blocks[1], blocks[2]], &lengths.0);
    let list = file.block(b"HL", &[list], &[0; 8]);
    let mixed = file.channel("z", 0, [0, 0, 0, 0], 0, 16, 0);
    let other = file.channel("w", 0, [0, 0, 0, 0], 1, 8, 0);
    let other = file.group(other, 0, 2, 25, 2);
    let mixed = file.group(mixed, other, 1, 25, 3);
    let records: Vec<u8> = (0..50u8).flat_map(|i| if i % 2 == 0 { vec![1, i, i, i] } else { vec![2, i, i] }).collect();
    let first = file.0.len().next_multiple_of(8) as u64;
    // the data lie last, so that a cut takes samples
    let second = first + 64;
    assert_eq!(file.block(b"DG", &[second, group, list, 0], &[0; 8]), first);
    assert_eq!(file.block(b"DG", &[0, mixed, second + 64, 0], &[1, 0, 0, 0, 0, 0, 0, 0]), second);
    file.block(b"DT", &[], &records);
    mistreat(&file.finish(first), "mf4");
}

/// A file of that head, and zeros up to `length`, which the file system need not store.
fn long(folder: &Path, name: &str, head: &[u8], length: u64) -> std::path::PathBuf {
    let path = folder.join(name);
    let mut file = std::fs::File::create(&path).unwrap();
    file.write_all(head).unwrap();
    file.set_len(length).unwrap();
    file.seek(SeekFrom::Start(0)).unwrap();
    assert!(std::fs::File::open(&path).unwrap().read(&mut [0; 4]).unwrap() == 4);
    path
}

#[test]
fn memory_does_not_grow_with_the_length_of_a_file() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let data: u64 = 400 << 20;
    let rows = data / 40;
    let objects: Vec<Bytes> = ["a", "b", "c", "d", "e"].iter().map(|n| tdms_channel(n, 10, rows).u32(0)).collect();
    let tdms = |flags: u32| {
        let mut head = tdms_segment(flags, &objects, &[]).0;
        let meta = head.len() as u64 - 28;
        head[12..20].copy_from_slice(&(meta + data).to_le_bytes());
        head
    };
    let mut mdf = Mdf::new();
    let channel = (0..5).fold(0, |after, i| mdf.channel("x", after, [0, 0, 4, 0], 8 * i, 64, 0));
    let group = mdf.group(channel, 0, 0, rows, 40);
    let at = mdf.0.len().next_multiple_of(8) as u64;
    let group = mdf.block(b"DG", &[0, group, at + 64, 0], &[0; 8]);
    let mut mdf = mdf.finish(group);
    mdf.extend(Bytes::default().raw(b"##DT").u32(0).u64(24 + data).u64(0).0);
    let matrix = mat_head(6, rows as u32, 5, "x").u32(9).u32(data as u32);
    let matrix = Bytes::default().u32(14).u32(matrix.0.len() as u32 + data as u32).raw(&matrix.0);
    let files = [
        ("contiguous.tdms", tdms(14), rows),
        ("interleaved.tdms", tdms(46), rows),
        ("a.mf4", mdf, rows),
        ("a.mat", mat_file(&[matrix]), rows),
        ("a.wav", wav_head(data as u32).0, data / 4),
    ];
    for (name, head, samples) in files {
        let path = long(folder.path(), name, &head, head.len() as u64 + data);
        let (answer, held) = most_held(|| read(&path));
        assert_eq!(answer, Ok((vec![samples], Vec::new())), "{name}");
        assert!(held < 48 << 20, "{name}: {held} bytes were held");
    }
}

/// Reads what a file claims that it cannot hold: the fault's text or the notes.
fn hostile(bytes: &[u8], extension: &str) -> String {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("file.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    let start = Instant::now();
    let (answer, held) = most_held(|| read(&path));
    assert!(held < 128 << 20, "{held} bytes were held");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    answer.map_or_else(|message| message, |(_, notes)| notes.join("; "))
}

#[test]
fn conversions_that_multiply_through_references_end() {
    let mut file = Mdf::new();
    let keys = 200u16;
    let choice = |file: &mut Mdf, of: u64| {
        let data = Bytes::default().u16(8).u16(0).u16(keys + 1).u16(2 * keys).f64(0.0).f64(0.0);
        let data = (0..2 * keys).fold(data, |b, i| b.f64(f64::from(i)));
        let mut links = vec![0; 4];
        links.resize(4 + usize::from(keys) + 1, of);
        file.block(b"CC", &links, &data.0)
    };
    let identity = file.block(b"CC", &[0, 0, 0, 0], &Bytes::default().u64(0).f64(0.0).f64(0.0).0);
    let many = (0..6).fold(identity, |of, _| choice(&mut file, of));
    let good = file.channel("good", 0, [0, 0, 4, 0], 0, 64, 0);
    let channel = file.channel("x", good, [0, 0, 4, 0], 0, 64, many);
    let group = file.group(channel, 0, 0, 10, 8);
    let data = file.block(b"DT", &[], &wave(10));
    let group = file.block(b"DG", &[0, group, data, 0], &[0; 8]);
    assert!(
        hostile(&file.finish(group), "mf4").contains("\"x\" is left out: the conversions of the file are too large")
    );
}

#[test]
fn lists_that_lead_back_are_refused() {
    let mut file = Mdf::new();
    let channel = file.channel("x", 0, [0, 0, 4, 0], 0, 64, 0);
    let group = file.group(channel, 0, 0, 10, 8);
    let data = file.block(b"DT", &[], &wave(10));
    let list = file.0.len().next_multiple_of(8) as u64;
    assert_eq!(file.block(b"DL", &[list, data], &Bytes::default().u32(1).u32(1).u64(80).0), list);
    let group = file.block(b"DG", &[0, group, list, 0], &[0; 8]);
    assert!(hostile(&file.finish(group), "mf4").contains(&format!("byte {list}: two links lead to this block")));
}

#[test]
fn cells_that_lie_deep_in_each_other_are_left_out() {
    let inner = mat_matrix("", 9, 1);
    let nested = (0..2000).fold(inner, |of, i| {
        let name = if i == 1999 { "deep" } else { "" };
        mat_element(14, &mat_head(1, 1, 1, name).raw(&of.0).0)
    });
    let notes = hostile(&mat_file(&[mat_matrix("x", 9, 1), nested]), "mat");
    assert!(notes.contains("too deep in each other"), "{notes}");
}

#[test]
fn counts_beyond_the_file_are_refused() {
    let objects = tdms_segment(14, &[tdms_channel("x", 10, 50).u32(0)], &wave(50)).0;
    let with = |at: usize, n: u32| {
        let mut bytes = objects.clone();
        bytes[at..at + 4].copy_from_slice(&n.to_le_bytes());
        hostile(&bytes, "tdms")
    };
    // objects, letters of a path, properties
    for at in [28, 32, objects.len() - 404] {
        assert!(with(at, u32::MAX - 1).contains("claimed"), "{}", with(at, u32::MAX - 1));
    }
    let matrix = |rows, columns| mat_element(14, &mat_head(6, rows, columns, "x").raw(&mat_element(9, &wave(4)).0).0);
    assert!(hostile(&mat_file(&[matrix(i32::MAX as u32, i32::MAX as u32)]), "mat").contains("claims"));
    let scalar = mat_head(1, i32::MAX as u32, i32::MAX as u32, "x");
    assert!(hostile(&mat_file(&[mat_element(14, &scalar.0)]), "mat").contains("claimed"));
    assert!(hostile(&wav_head(u32::MAX - 40).raw(&wave(2)).0, "wav").contains("4 samples that are there"));
}

fn compressed(element: &[u8]) -> Bytes {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(element).unwrap();
    let data = encoder.finish().unwrap();
    Bytes::default().u32(15).u32(data.len() as u32).raw(&data)
}

/// What becomes of the file that is made, and the bytes that are held for it.
fn held_for(made: impl FnOnce() -> Vec<u8>, extension: &str) -> (Read, usize) {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("file.{extension}"));
    std::fs::write(&path, made()).unwrap();
    most_held(|| read(&path))
}

#[test]
fn a_mat_file_that_inflates_takes_the_memory_of_what_it_holds_up_to_a_limit() {
    const ROWS: u32 = 8 << 20;
    let zeros = || {
        let data = mat_element(9, &vec![0; 8 * ROWS as usize]);
        let element = mat_element(14, &mat_head(6, ROWS, 1, "x").raw(&data.0).0);
        mat_file(&[compressed(&element.0)])
    };
    let (answer, held) = held_for(zeros, "mat");
    assert_eq!(answer.unwrap().0, [u64::from(ROWS)]);
    assert!(held < 8 * ROWS as usize + (32 << 20), "{held} bytes");
    // one that claims two gigabytes
    let claims = || mat_file(&[compressed(&Bytes::default().u32(14).u32(1 << 31).raw(&[0; 64]).0)]);
    let (answer, held) = held_for(claims, "mat");
    assert!(answer.unwrap_err().contains("with it the file has more than 1073741824 bytes") && held < 1 << 20);
}

#[test]
fn a_mat_file_of_many_small_ones_takes_no_more_memory_than_it_has_bytes() {
    const COUNT: u32 = 300_000;
    let scalar = mat_matrix("", 1, 1);
    let vector = mat_matrix("", 2, 1);
    let sparse = mat_element(14, &mat_head(5, 1, 1, "").0);
    for one in [scalar, vector, sparse] {
        let length = one.0.len() * COUNT as usize;
        let many = || {
            let all = one.0.repeat(COUNT as usize);
            mat_file(&[mat_element(14, &mat_head(1, COUNT, 1, "c").raw(&all).0), mat_matrix("x", 40, 1)])
        };
        let (answer, held) = held_for(many, "mat");
        assert!(held < length + (32 << 20), "{held} bytes for {length}");
        if let Ok((_, notes)) = answer {
            assert!(notes.len() < 1100, "{}", notes.len());
        }
    }
}

/// A workbook with one sheet of these rows.
fn xlsx(rows: &str) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let sheets = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let package = "http://schemas.openxmlformats.org/package/2006/relationships";
    let relation = |kind: &str, to: &str| {
        format!("<Relationships xmlns=\"{package}\"><Relationship Id=\"r1\" Type=\"{office}/{kind}\" Target=\"{to}\"/></Relationships>")
    };
    let parts = [
        ("[Content_Types].xml", "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\"/>".into()),
        ("_rels/.rels", relation("officeDocument", "xl/workbook.xml")),
        ("xl/workbook.xml", format!("<workbook xmlns=\"{sheets}\" xmlns:r=\"{office}\"><sheets><sheet name=\"s\" sheetId=\"1\" r:id=\"r1\"/></sheets></workbook>")),
        ("xl/_rels/workbook.xml.rels", relation("worksheet", "worksheets/sheet1.xml")),
        ("xl/worksheets/sheet1.xml", format!("<worksheet xmlns=\"{sheets}\"><sheetData>{rows}</sheetData></worksheet>")),
    ];
    for (name, text) in parts {
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(format!("{head}{text}").as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn a_sheet_takes_memory_by_its_cells_however_far_apart_they_are() {
    let row = |r: usize, column: &str| format!("<row r=\"{r}\"><c r=\"{column}{r}\"><v>{r}</v></c></row>");
    let near: String = (1..50).map(|r| row(r, "B")).collect();
    assert_eq!(held_for(|| xlsx(&near), "xlsx").0.unwrap().0, [49]);
    // a cell in the last column of many rows, and in the last row
    let (answer, held) = held_for(|| xlsx(&(1..3000).map(|r| row(r, "XFD")).collect::<String>()), "xlsx");
    assert!(answer.unwrap_err().contains("the sheet holds few cells far apart") && held < 64 << 20, "{held} bytes");
    let tall = row(1, "XFD") + &row(2, "XFD") + &row(1 << 20, "A");
    let held = held_for(|| xlsx(&tall), "xlsx").1;
    assert!(held < 128 << 20, "{held} bytes");
    // two wide rows with a million between them: each column would have as many samples
    let wide = |r: usize| {
        let column = |mut c: usize| {
            let mut name = String::new();
            while c > 0 {
                name.insert(0, char::from(b'A' + ((c - 1) % 26) as u8));
                c = (c - 1) / 26;
            }
            name
        };
        let cells: String = (1..16_000).map(|c| format!("<c r=\"{}{r}\"><v>1</v></c>", column(c))).collect();
        format!("<row r=\"{r}\">{cells}</row>")
    };
    let (answer, held) = held_for(|| xlsx(&(wide(1) + &wide(2) + &wide(1 << 20))), "xlsx");
    assert!(held < 256 << 20, "{held} bytes");
    let notes = answer.unwrap().1;
    assert!(notes.iter().any(|n| n.contains("hold few cells far apart; those from")), "{notes:?}");
}

#[test]
fn a_sheet_that_was_packed_to_fill_memory_is_refused() {
    let (answer, held) = held_for(|| xlsx(&" ".repeat(64 << 20)), "xlsx");
    assert!(answer.unwrap_err().contains("more than 100 times its size") && held < 8 << 20, "{held} bytes");
}

#[test]
fn cells_that_are_repeated_take_memory_by_those_that_are_written() {
    let sheet = |rows: u32, columns: u32| {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let names: String = ["office", "table", "text"]
            .map(|n| format!(" xmlns:{n}=\"urn:oasis:names:tc:opendocument:xmlns:{n}:1.0\""))
            .concat();
        let content = format!(
            "<office:document-content{names}><office:body><office:spreadsheet><table:table table:name=\"s\">\
             <table:table-row table:number-rows-repeated=\"{rows}\"><table:table-cell \
             table:number-columns-repeated=\"{columns}\" office:value-type=\"float\" office:value=\"1\"/>\
             </table:table-row></table:table></office:spreadsheet></office:body></office:document-content>"
        );
        let kind = "application/vnd.oasis.opendocument.spreadsheet";
        for (name, text) in [("mimetype", kind.to_string()), ("content.xml", content)] {
            zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap().into_inner()
    };
    assert_eq!(held_for(|| sheet(1000, 3), "ods").0.unwrap().0, [1000]);
    let (answer, held) = held_for(|| sheet(1_000_000, 30), "ods");
    assert!(answer.unwrap_err().contains("few cells are repeated very often") && held < 256 << 20, "{held} bytes");
}
