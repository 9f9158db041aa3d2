//! The allocator of programs.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

/// System allocator that prints an error and ends the process if memory runs out, where Rust would abort.
#[derive(Debug)]
pub struct Allocator {
    /// Exit code of the process without memory.
    pub exit_code: i32,
}

impl Allocator {
    /// Ends the process if an allocation failed.
    fn checked(&self, memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() {
            self.end(bytes);
        }
        memory
    }

    /// Prints the error without allocating. Other threads that reach this point wait until the process ends.
    fn end(&self, bytes: usize) -> ! {
        static IS_ENDING: AtomicBool = AtomicBool::new(false);
        if !IS_ENDING.swap(true, Ordering::Relaxed) {
            let mut buffer = [0; 256];
            let mut text = &mut buffer[..];
            let _ = writeln!(
                text,
                "error: not enough memory: {bytes} more bytes are not available\n  allow more (`ulimit -v`, `--memory`, \
                 the limits of the job), or use fewer threads or a coarser mesh"
            );
            let left = text.len();
            let message = &buffer[..buffer.len() - left];
            // SAFETY: the pointer and the length describe `message`.
            unsafe { libc::write(libc::STDERR_FILENO, message.as_ptr().cast(), message.len()) };
            // SAFETY: `_exit` has no preconditions.
            unsafe { libc::_exit(self.exit_code) };
        }
        loop {
            // SAFETY: `pause` has no preconditions. It neither allocates nor unwinds.
            unsafe { libc::pause() };
        }
    }
}

// SAFETY: all memory is the system allocator's, with unchanged layouts, and no method unwinds.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's contract.
        self.checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's contract.
        self.checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract.
        unsafe { System.dealloc(memory, layout) };
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller's contract.
        self.checked(unsafe { System.realloc(memory, layout, size) }, size)
    }
}
