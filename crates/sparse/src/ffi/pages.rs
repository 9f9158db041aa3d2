//! Interface to the memory pages of the operating system.

use std::mem::MaybeUninit;

/// Requests large pages for unused memory, if the system supports them.
///
/// Each solve reads the factors from beginning to end. Small pages require an address translation every 4 KiB, and
/// processors do not prefetch across page boundaries.
pub(crate) fn prefer_large<T>(memory: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        /// madvise works on whole pages.
        const PAGE: usize = 4096;
        let bytes = size_of_val(memory);
        let start = memory.as_mut_ptr().cast::<u8>();
        let skipped = start.align_offset(PAGE);
        if let Some(whole) = bytes.checked_sub(skipped) {
            let start = start.wrapping_add(skipped);
            // SAFETY: the pages are within `memory`, and the call does not change their contents. A system without
            // large pages returns an error, which is harmless.
            unsafe { libc::madvise(start.cast(), whole, libc::MADV_HUGEPAGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = memory;
}
