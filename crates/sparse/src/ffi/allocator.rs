//! Memory allocator for programs.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

/// System allocator that prints an error and ends the process if memory runs out. Rust would abort instead.
#[derive(Debug)]
pub struct Allocator {
    /// Exit code of the process if memory runs out.
    pub exit_code: i32,
}

/// Whether a thread is printing the error that ends the process, and whether the error was printed.
static IS_ENDING: AtomicBool = AtomicBool::new(false);
static IS_PRINTED: AtomicBool = AtomicBool::new(false);
/// Exit code for [`exit`].
static EXIT_CODE: AtomicI32 = AtomicI32::new(1);

/// Ends the process if a thread receives a signal while another thread prints the error.
extern "C" fn exit(_: libc::c_int) {
    // SAFETY: `_exit` has no preconditions, and may be called in signal handlers.
    unsafe { libc::_exit(EXIT_CODE.load(Ordering::Relaxed)) }
}

impl Allocator {
    /// Calls `print`, which must not allocate, unless another thread is already ending the process because memory ran
    /// out. If memory runs out afterward, the process ends without a second error. Therefore, use this function only
    /// for the last error of a program.
    pub fn print_last_error(print: impl FnOnce()) {
        if !IS_ENDING.swap(true, Ordering::Relaxed) {
            print();
            IS_PRINTED.store(true, Ordering::Release);
        }
    }

    /// Ends the process if an allocation failed.
    fn checked(&self, memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() {
            self.end(bytes);
        }
        memory
    }

    /// Makes signals end the process with the exit code. Without memory, the stacks of other threads cannot grow
    /// either, and C libraries abort.
    fn survive_signals(&self) {
        EXIT_CODE.store(self.exit_code, Ordering::Relaxed);
        // SAFETY: all fields may be zero.
        let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
        action.sa_sigaction = exit as extern "C" fn(libc::c_int) as usize;
        action.sa_flags = libc::SA_ONSTACK; // the stack may be full
        for signal in [libc::SIGSEGV, libc::SIGBUS, libc::SIGABRT] {
            // SAFETY: `action` is initialized, and its handler is async-signal-safe.
            unsafe { libc::sigaction(signal, &raw const action, std::ptr::null_mut()) };
        }
    }

    /// Prints the error without allocating, and ends the process. If another thread is already printing an error, this
    /// thread waits until the process ends.
    fn end(&self, bytes: usize) -> ! {
        if !IS_ENDING.swap(true, Ordering::Relaxed) {
            self.survive_signals();
            let mut buffer = [0; 256];
            let mut text = &mut buffer[..];
            let _ = writeln!(
                text,
                "error: not enough memory: cannot allocate {bytes} more bytes\n  allow more (`ulimit -v`, `--memory`, \
                 the limits of the job), or use fewer threads or a coarser mesh"
            );
            let left = text.len();
            let message = &buffer[..buffer.len() - left];
            // SAFETY: the pointer and the length describe `message`.
            unsafe { libc::write(libc::STDERR_FILENO, message.as_ptr().cast(), message.len()) };
            IS_PRINTED.store(true, Ordering::Release);
        }
        while !IS_PRINTED.load(Ordering::Acquire) {
            // SAFETY: `usleep` has no preconditions. It neither allocates nor unwinds.
            unsafe { libc::usleep(1000) };
        }
        // SAFETY: `_exit` has no preconditions.
        unsafe { libc::_exit(self.exit_code) }
    }
}

// SAFETY: all memory comes from the system allocator, with unchanged layouts, and no method unwinds.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the contract of `alloc`.
        self.checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the contract of `alloc_zeroed`.
        self.checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller upholds the contract of `dealloc`.
        unsafe { System.dealloc(memory, layout) };
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller upholds the contract of `realloc`.
        self.checked(unsafe { System.realloc(memory, layout, size) }, size)
    }
}
