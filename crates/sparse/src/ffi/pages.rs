//! The boundary to the system's pages of memory.

use std::mem::MaybeUninit;

/// Asks the system to back room for numbers that is not used yet by large pages, if it has any.
///
/// Factors are read from end to end in each solve. Small pages cost a look-up every 4 KiB, and
/// processors do not fetch ahead beyond their ends.
pub(crate) fn prefer_large<T>(room: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        /// Advice is taken for whole pages.
        const PAGE: usize = 4096;
        let bytes = size_of_val(room);
        let start = room.as_mut_ptr().cast::<u8>();
        let skipped = start.align_offset(PAGE);
        if let Some(whole) = bytes.checked_sub(skipped) {
            let start = start.wrapping_add(skipped);
            // SAFETY: the pages lie within the room, and the advice changes no contents. A system that
            // does not know it refuses, which does no harm.
            unsafe { libc::madvise(start.cast(), whole, libc::MADV_HUGEPAGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = room;
}
