//! The `touchdown` command.

use std::process::ExitCode;

/// Memory of the system; where there is none left the command says so and ends as it does for all that it cannot do.
#[cfg(unix)]
mod memory {
    use std::alloc::{GlobalAlloc, Layout, System};
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Bytes from which a piece is one that no machine has: who asks for it has an answer to none.
    const ABSURD: usize = 1 << 40;
    /// Whether the process serves somebody's FMU, whose host says how it ended.
    pub static SERVES: AtomicBool = AtomicBool::new(false);

    pub struct Ending;

    fn or_end(piece: *mut u8, bytes: usize) -> *mut u8 {
        if piece.is_null() && bytes < ABSURD && !SERVES.load(Ordering::Relaxed) {
            end();
        }
        piece
    }

    /// From here on a panic for want of memory ends the process as well: a thread panics before its work begins where there is no
    /// memory for the stack that its signals are handled on, which no caller can see coming.
    pub fn end_where_a_thread_has_none() {
        let print = std::panic::take_hook();
        let want = format!("(os error {})", libc::ENOMEM);
        std::panic::set_hook(Box::new(move |info| {
            if info.payload_as_str().is_some_and(|said| said.contains(&want)) {
                end();
            }
            print(info);
        }));
    }

    #[cold]
    fn end() -> ! {
        const SAID: &[u8] =
            b"error: memory has run out; give smaller files, close other programs, or raise the limit of \
                              memory, as with ulimit -v\n";
        // SAFETY: the bytes outlive the calls, which take no memory; who cannot read what is said sees the code
        unsafe {
            libc::write(libc::STDERR_FILENO, SAID.as_ptr().cast(), SAID.len());
            libc::_exit(2)
        }
    }

    // SAFETY: every call goes on to the system's allocator, with the same arguments
    unsafe impl GlobalAlloc for Ending {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            or_end(unsafe { System.alloc(layout) }, layout.size())
        }
        unsafe fn dealloc(&self, piece: *mut u8, layout: Layout) {
            unsafe { System.dealloc(piece, layout) }
        }
        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            or_end(unsafe { System.alloc_zeroed(layout) }, layout.size())
        }
        unsafe fn realloc(&self, piece: *mut u8, layout: Layout, size: usize) -> *mut u8 {
            or_end(unsafe { System.realloc(piece, layout, size) }, size)
        }
    }
}

#[cfg(unix)]
#[global_allocator]
static MEMORY: memory::Ending = memory::Ending;

/// Stack that a command works on [bytes]; the system's own may be small, as by `ulimit -s`.
const STACK: usize = 8 << 20;

fn main() -> ExitCode {
    // a file that grows beyond the limit is an error of the call that writes it
    #[cfg(unix)]
    // SAFETY: ignoring a signal runs nothing
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    if std::env::args_os().nth(1).is_some_and(|a| a == host::ARGUMENT) {
        #[cfg(unix)]
        memory::SERVES.store(true, std::sync::atomic::Ordering::Relaxed);
        return host::serve();
    }
    #[cfg(unix)]
    memory::end_where_a_thread_has_none();
    // where there is no thread to be had, the stack that the system gives has to do
    let worker = std::thread::Builder::new().stack_size(STACK).spawn(touchdown::commands::main);
    worker.map_or_else(|_| touchdown::commands::main(), |w| w.join().unwrap_or(ExitCode::from(101)))
}
