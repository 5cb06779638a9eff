//! CPU time of this process, and time and memory of one it starts.

use anyhow::{bail, Context, Result};
use std::process::{Child, Command};
use std::time::Instant;

/// CPU seconds this process has taken, all threads together; seconds of the wall where the platform does not report it.
pub fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the pointer is to a timespec of this frame
        if unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t) } == 0 {
            return t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64;
        }
    }
    wall_seconds()
}

/// Seconds of the wall since it was first asked.
pub fn wall_seconds() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// What a process took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// From start to end, s.
    pub wall: f64,
    /// CPU time of all its threads, s; NaN where the platform does not report it.
    pub cpu: f64,
    /// Most memory resident at once, bytes; NaN where the platform does not report it.
    pub memory: f64,
}

/// Runs a command to its end.
///
/// # Errors
/// Where it does not start, or fails.
pub fn taken(command: &mut Command) -> Result<Taken> {
    let start = Instant::now();
    let child = command.spawn().with_context(|| format!("{:?} does not start", command.get_program()))?;
    let (good, cpu, memory) = reap(child)?;
    if !good {
        bail!("{command:?} failed; its words are above");
    }
    Ok(Taken { wall: start.elapsed().as_secs_f64(), cpu, memory })
}

/// Whether it ended well, CPU seconds, bytes.
#[cfg(unix)]
fn reap(child: Child) -> Result<(bool, f64, f64)> {
    let mut status = 0;
    // SAFETY: all zero is a value of rusage; both pointers are to this frame; nobody else waits for this child
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        while libc::wait4(child.id() as libc::pid_t, &mut status, 0, &mut usage) < 0 {
            let e = std::io::Error::last_os_error();
            if e.kind() != std::io::ErrorKind::Interrupted {
                bail!("the process cannot be waited for: {e}");
            }
        }
        usage
    };
    let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    // kilobytes, on macOS bytes
    let unit = if cfg!(target_os = "macos") { 1.0 } else { 1024.0 };
    Ok((status == 0, seconds(usage.ru_utime) + seconds(usage.ru_stime), usage.ru_maxrss as f64 * unit))
}

#[cfg(not(unix))]
fn reap(mut child: Child) -> Result<(bool, f64, f64)> {
    Ok((child.wait()?.success(), f64::NAN, f64::NAN))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_measured_and_a_failed_one_is_an_error() {
        let t = taken(Command::new("sh").args(["-c", "i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done"])).unwrap();
        assert!(t.wall > 0.0 && t.cpu > 0.0 && t.memory > 1e5, "{t:?}");
        assert!(taken(Command::new("sh").args(["-c", "exit 3"])).is_err());
        assert!(taken(&mut Command::new("no-such-program-here")).is_err());
    }

    #[test]
    fn cpu_time_grows_with_work() {
        let before = cpu_seconds();
        let mut x = 1.0f64;
        while cpu_seconds() <= before {
            x = std::hint::black_box(x.sin() + 1.0);
        }
        assert!(x.is_finite());
    }
}
