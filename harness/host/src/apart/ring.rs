//! Lines of an FMU's log in memory that its process shares with the host: what it said is there after it died.
//!
//! The FMU's process writes, over the oldest where it is full; the host takes. The host trusts nothing it reads there.

use super::memory::Shared;
use crate::log::LogLine;
use crate::status::Status;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Bytes of lines held.
pub(super) const SIZE: usize = 1 << 21;
/// Bytes before each line: size of category, size of message, status, as u32; number of the call, as u64.
const BEFORE: usize = 20;
/// Tries of the lock: the other side holds it for a copy of a few kB.
const TRIES: u32 = 1 << 20;

/// Where lines begin and end; positions count bytes from the start on and do not wrap.
#[repr(C)]
#[derive(Default)]
pub(super) struct Ends {
    lock: AtomicU32,
    first: AtomicU64,
    end: AtomicU64,
    dropped: AtomicU64,
}

/// The ring in a shared memory.
pub(super) struct Ring<'a>(pub(super) &'a Shared);

impl Ring<'_> {
    fn locked<T>(&self, work: impl FnOnce(&Ends) -> T) -> Option<T> {
        let ends = self.0.ends();
        for _ in 0..TRIES {
            if ends.lock.compare_exchange(0, 1, Ordering::Acquire, Ordering::Relaxed).is_ok() {
                let done = work(ends);
                ends.lock.store(0, Ordering::Release);
                return Some(done);
            }
            std::hint::spin_loop();
        }
        None
    }

    fn number(&self, at: u64) -> usize {
        let mut bytes = [0; 4];
        self.0.read_ring(at, &mut bytes);
        u32::from_ne_bytes(bytes) as usize
    }

    /// Writes a line, over the oldest where there is no room.
    pub(super) fn push(&self, line: &LogLine) {
        let (category, message) = (line.category.as_bytes(), line.message.as_bytes());
        let mut bytes = Vec::with_capacity(BEFORE + category.len() + message.len());
        for n in [category.len() as u32, message.len() as u32, line.status.number()] {
            bytes.extend(n.to_ne_bytes());
        }
        bytes.extend(line.call.to_ne_bytes());
        bytes.extend(category);
        bytes.extend(message);
        if bytes.len() > SIZE {
            return;
        }
        self.locked(|ends| {
            let (mut first, end) = (ends.first.load(Ordering::Relaxed), ends.end.load(Ordering::Relaxed));
            while end.saturating_sub(first) + bytes.len() as u64 > SIZE as u64 {
                first += (BEFORE + self.number(first) + self.number(first + 4)) as u64;
                ends.dropped.fetch_add(1, Ordering::Relaxed);
            }
            self.0.write_ring(end, &bytes);
            ends.first.store(first, Ordering::Relaxed);
            ends.end.store(end + bytes.len() as u64, Ordering::Release);
        });
    }

    /// Whether there is nothing to take.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        let ends = self.0.ends();
        ends.end.load(Ordering::Acquire) == ends.first.load(Ordering::Relaxed)
    }

    /// Takes every line, and how many were dropped. What makes no sense ends the taking.
    pub(super) fn take(&self, mut each: impl FnMut(LogLine)) -> u64 {
        let taken = self.locked(|ends| {
            let (first, end) = (ends.first.load(Ordering::Relaxed), ends.end.load(Ordering::Relaxed));
            let mut bytes = vec![0; end.wrapping_sub(first).min(SIZE as u64) as usize];
            self.0.read_ring(first, &mut bytes);
            ends.first.store(end, Ordering::Relaxed);
            (bytes, ends.dropped.swap(0, Ordering::Relaxed))
        });
        let Some((bytes, dropped)) = taken else { return 0 };
        let mut rest = &bytes[..];
        while let Some((line, after)) = parse(rest) {
            each(line);
            rest = after;
        }
        dropped
    }
}

fn parse(bytes: &[u8]) -> Option<(LogLine, &[u8])> {
    let (before, rest) = bytes.split_at_checked(BEFORE)?;
    let number = |i: usize| u32::from_ne_bytes([before[i], before[i + 1], before[i + 2], before[i + 3]]);
    let call = u64::from_ne_bytes(before[12..].try_into().ok()?);
    let (category, rest) = rest.split_at_checked(number(0) as usize)?;
    let (message, rest) = rest.split_at_checked(number(4) as usize)?;
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    let status = Status::from(number(8));
    Some((LogLine { status, category: text(category), message: text(message), call }, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_out_as_they_went_in_and_the_oldest_make_room() {
        let shared = Shared::new().unwrap();
        let ring = Ring(&shared);
        let line = |n: usize| LogLine {
            status: Status::Warning,
            category: "c".into(),
            message: format!("{n} {}", "x".repeat(n % 5000)),
            call: n as u64,
        };
        (0..10).for_each(|n| ring.push(&line(n)));
        let mut seen = Vec::new();
        assert_eq!(ring.take(|l| seen.push(l)), 0);
        assert_eq!(seen, (0..10).map(line).collect::<Vec<_>>());
        assert!(ring.is_empty());
        seen.clear();
        (0..5000).for_each(|n| ring.push(&line(n)));
        let dropped = ring.take(|l| seen.push(l)) as usize;
        assert!(dropped > 4000 && dropped < 4700, "{dropped}");
        assert_eq!(seen, (dropped..5000).map(line).collect::<Vec<_>>());
    }

    #[test]
    fn what_a_hostile_process_wrote_there_is_not_believed() {
        let shared = Shared::new().unwrap();
        let ring = Ring(&shared);
        let ends = shared.ends();
        shared.write_ring(0, &[255; 64]);
        ends.end.store(u64::MAX - 5, Ordering::Relaxed);
        let mut lines = 0;
        ring.take(|_| lines += 1);
        assert_eq!(lines, 0);
        ends.lock.store(1, Ordering::Relaxed);
        assert_eq!(ring.take(|_| lines += 1), 0);
    }
}
