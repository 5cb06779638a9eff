//! Memory that the host and an FMU's process share: whose turn it is, the message under way, the log.
//!
//! The FMU may write anything in there. So each side copies a message out before it reads it, and checks every size.

use super::ring::{Ends, SIZE};
use memmap2::MmapRaw;
use rustix::fs::{fcntl_add_seals, ftruncate, memfd_create, MemfdFlags, SealFlags};
use rustix::thread::futex;
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Longest message, bytes. Memory is taken as it is touched.
pub(super) const LONGEST: usize = 64 << 20;
/// Where the ring begins, and the messages.
const RING: usize = 4096;
const MESSAGE: usize = RING + SIZE;
/// Bytes in all.
pub(super) const WHOLE: usize = MESSAGE + LONGEST;

/// Longest and shortest time that is waited awake, ns.
const AWAKE: u64 = 20_000;
const LEAST_AWAKE: u64 = 500;
/// What waking up costs at most where a processor is free: who was woken within it might as well have waited awake.
const SOON: Duration = Duration::from_micros(100);
/// Looks between two looks at the clock.
const LOOKS: u32 = 16;

/// A number of a message, on a cache line of its own, and whether the reader sleeps until it changes.
#[repr(C, align(128))]
#[derive(Default)]
pub(super) struct Turn {
    number: AtomicU32,
    sleeps: AtomicU32,
    length: AtomicU64,
}

#[repr(C)]
#[derive(Default)]
struct Head {
    request: Turn,
    reply: Turn,
    log: Ends,
    /// Which call of a batch the FMU's process is at.
    at: AtomicU32,
    takes_turns: Flag,
}

/// Whether both sides are on one processor, where who waits has to sleep for the other to work; on a cache line of its own, as it is
/// read at every message and seldom written.
#[repr(C, align(128))]
#[derive(Default)]
struct Flag(AtomicU32);

/// The memory, mapped.
pub(super) struct Shared {
    map: MmapRaw,
    file: File,
}

/// How long to wait awake: longer where that has helped, shorter where it has not.
pub(super) struct Patience {
    awake: u64,
}

impl Patience {
    pub(super) fn new() -> Patience {
        Patience { awake: AWAKE }
    }

    fn awake(&mut self, done: impl Fn() -> bool) -> bool {
        if done() {
            return true;
        }
        let limit = Duration::from_nanos(self.awake);
        let start = Instant::now();
        loop {
            for _ in 0..LOOKS {
                if done() {
                    self.awake = (self.awake + self.awake / 4).min(AWAKE);
                    return true;
                }
                std::hint::spin_loop();
            }
            // asleep after it, not yielding: on a busy machine who is woken runs sooner than who has yielded
            if start.elapsed() >= limit {
                return done();
            }
        }
    }

    /// Learns from a wait that has ended asleep.
    fn slept(&mut self, whole: Duration) {
        self.awake = if whole <= SOON { (2 * self.awake).min(AWAKE) } else { (self.awake / 2).max(LEAST_AWAKE) };
    }
}

impl Turn {
    /// Hands a message of so many bytes on, with a number.
    fn hand(&self, number: u32, length: usize) {
        self.length.store(length as u64, Ordering::Relaxed);
        self.number.store(number, Ordering::SeqCst);
        if self.sleeps.swap(0, Ordering::SeqCst) != 0 {
            // the reader looks again by itself after a while
            let _ = futex::wake(&self.number, futex::Flags::empty(), 1);
        }
    }

    /// Waits for a message of a number, awake at first where there is `patience` for it; asks `ended` at every waking, later and
    /// later. Whether it came while who waits was awake.
    fn wait<E>(
        &self,
        number: u32,
        mut patience: Option<&mut Patience>,
        mut ended: impl FnMut() -> Result<(), E>,
    ) -> Result<bool, E> {
        let here = || self.number.load(Ordering::Acquire) == number;
        let began = Instant::now();
        if patience.as_mut().is_some_and(|p| p.awake(here)) {
            return Ok(true);
        }
        let mut slept = |whole: Duration| {
            if let Some(p) = &mut patience {
                p.slept(whole);
            }
        };
        let mut nap = Duration::from_millis(1);
        loop {
            self.sleeps.store(1, Ordering::SeqCst);
            let seen = self.number.load(Ordering::SeqCst);
            if seen == number {
                slept(began.elapsed());
                return Ok(false);
            }
            let timeout = futex::Timespec { tv_sec: 0, tv_nsec: i64::from(nap.subsec_nanos()) };
            // woken, or not: the number shows which
            let _ = futex::wait(&self.number, futex::Flags::empty(), seen, Some(&timeout));
            if here() {
                slept(began.elapsed());
                return Ok(false);
            }
            ended()?;
            nap = (nap * 2).min(Duration::from_millis(50));
        }
    }
}

impl Shared {
    /// New memory, all zero, that has no name in any folder. Nobody can make it shorter, for what was cut off would end who
    /// reads it by SIGBUS; nor longer.
    ///
    /// # Errors
    /// As the system gives them.
    pub(super) fn new() -> io::Result<Shared> {
        let file = memfd_create("touchdown-fmu", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        ftruncate(&file, WHOLE as u64)?;
        fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?;
        Shared::of(file.into())
    }

    /// The memory that a file is of.
    ///
    /// # Errors
    /// As the system gives them; a file of another size.
    pub(super) fn of(file: File) -> io::Result<Shared> {
        if file.metadata()?.len() != WHOLE as u64 {
            return Err(io::Error::other("not the memory of this touchdown"));
        }
        let map = memmap2::MmapOptions::new().len(WHOLE).map_raw(&file)?;
        Ok(Shared { map, file })
    }

    /// The file it is of.
    pub(super) fn file(&self) -> &File {
        &self.file
    }

    #[inline]
    fn head(&self) -> &Head {
        const { assert!(std::mem::size_of::<Head>() <= RING) }
        // SAFETY: the mapping is longer than a Head, aligned to a page, lives as long as self, and any bytes are
        // atomics; the other process changes them by atomics too
        unsafe { &*self.map.as_ptr().cast::<Head>() }
    }

    pub(super) fn ends(&self) -> &Ends {
        &self.head().log
    }

    /// Copies bytes into the message's place; false where they do not fit.
    fn put(&self, bytes: &[u8]) -> bool {
        if bytes.len() > LONGEST {
            return false;
        }
        // SAFETY: they fit behind MESSAGE, and a mapping does not overlap a slice
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), self.map.as_mut_ptr().add(MESSAGE), bytes.len()) }
        true
    }

    fn take(&self, turn: &Turn, into: &mut Vec<u8>) {
        let length = turn.length.load(Ordering::Relaxed).min(LONGEST as u64) as usize;
        into.clear();
        into.reserve(length);
        // SAFETY: so many bytes lie behind MESSAGE, and there is room for as many
        unsafe {
            std::ptr::copy_nonoverlapping(self.map.as_ptr().add(MESSAGE), into.as_mut_ptr(), length);
            into.set_len(length);
        }
    }

    /// Hands a request to the FMU's process; false where it is too long.
    pub(super) fn ask(&self, number: u32, request: &[u8]) -> bool {
        self.put(request) && {
            self.head().request.hand(number, request.len());
            true
        }
    }

    /// Waits for the reply of that number. Whether it came while the host was awake.
    ///
    /// # Errors
    /// What `ended` gives.
    pub(super) fn reply<E>(
        &self,
        number: u32,
        into: &mut Vec<u8>,
        patience: &mut Patience,
        ended: impl FnMut() -> Result<(), E>,
    ) -> Result<bool, E> {
        let awake = self.head().reply.wait(number, Some(patience).filter(|_| !self.takes_turns()), ended)?;
        self.take(&self.head().reply, into);
        Ok(awake)
    }

    /// Waits for the request of that number.
    ///
    /// # Errors
    /// What `ended` gives.
    pub(super) fn request<E>(
        &self,
        number: u32,
        into: &mut Vec<u8>,
        patience: &mut Patience,
        ended: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        self.head().request.wait(number, Some(patience).filter(|_| !self.takes_turns()), ended)?;
        self.take(&self.head().request, into);
        Ok(())
    }

    /// Hands a reply to the host; false where it is too long.
    pub(super) fn answer(&self, number: u32, reply: &[u8]) -> bool {
        self.put(reply) && {
            self.head().reply.hand(number, reply.len());
            true
        }
    }

    /// Says whether both sides are on one processor.
    pub(super) fn set_takes_turns(&self, on: bool) {
        self.head().takes_turns.0.store(u32::from(on), Ordering::Relaxed);
    }

    fn takes_turns(&self) -> bool {
        self.head().takes_turns.0.load(Ordering::Relaxed) != 0
    }

    /// Notes which call of a batch is under way.
    pub(super) fn note(&self, at: usize) {
        self.head().at.store(at as u32, Ordering::Release);
    }

    /// Which call of a batch is, or was, under way; any number where the FMU wrote over it.
    pub(super) fn noted(&self) -> usize {
        self.head().at.load(Ordering::Acquire) as usize
    }

    /// Copies bytes of the ring, around its end where it is.
    pub(super) fn read_ring(&self, at: u64, into: &mut [u8]) {
        for (offset, part) in around(at, into.len()) {
            let (from, into) = (RING + offset, &mut into[part]);
            // SAFETY: `around` keeps within the ring, which lies within the mapping
            unsafe { std::ptr::copy_nonoverlapping(self.map.as_ptr().add(from), into.as_mut_ptr(), into.len()) }
        }
    }

    /// Copies bytes into the ring, around its end where it is.
    pub(super) fn write_ring(&self, at: u64, bytes: &[u8]) {
        for (offset, part) in around(at, bytes.len()) {
            let (to, bytes) = (RING + offset, &bytes[part]);
            // SAFETY: as in read_ring
            unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), self.map.as_mut_ptr().add(to), bytes.len()) }
        }
    }
}

/// The one or two parts of at most SIZE bytes from a position on: offset in the ring, range of the bytes.
fn around(at: u64, length: usize) -> [(usize, std::ops::Range<usize>); 2] {
    let offset = (at % SIZE as u64) as usize;
    let first = length.min(SIZE - offset);
    [(offset, 0..first), (0, first..length.min(first + offset))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_stays_as_long_as_it_is() {
        let shared = Shared::new().unwrap();
        for length in [0, 4096, 2 * WHOLE as u64] {
            assert!(ftruncate(shared.file(), length).is_err(), "{length}");
        }
        assert!(fcntl_add_seals(shared.file(), SealFlags::WRITE).is_err());
        assert_eq!(shared.file().metadata().unwrap().len(), WHOLE as u64);
    }
}
